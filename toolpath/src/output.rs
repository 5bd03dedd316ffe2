//! The one way to write a file that somebody named on the command line.
//!
//! Links are followed; `-` and devices are written to, everything else appears whole or not at all. An input of the same
//! command is never written over, and what claymill did not write only on request.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::manifest;
use crate::place::whole;
use crate::scratch::{Scratch, parent_of};
use crate::{FolderError, JOB_FILE, MANIFEST_FILE, REGIONS_FILE, REPORT_FILE, TOOLPATHS_FILE, VERIFY_FILE};

/// What a file is, and thereby how one of claymill's own is known again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A program for a control: its header names the post.
    Program,
    /// Totals or answers in JSON.
    Json,
    /// A model: IGES, STEP, glTF, or a mesh as binary STL.
    Model,
    /// A picture or an animation.
    Picture,
    /// A page of the manual.
    Manual,
}

/// Stands in the header of every program.
const PROGRAM_MARK: &[u8] = b"claymill post:";
const MARK: &[u8] = b"claymill";
/// A mark stands so near to the beginning or the end of a file, bytes.
const LOOKED_AT: u64 = 1 << 14;

/// Why nothing is written there.
#[derive(Debug, Error)]
pub enum OutputError {
    /// It is what the command reads.
    #[error("{}: the command reads {}, which would be written over", path.display(), input.display())]
    Input {
        /// The destination as it was told.
        path: PathBuf,
        /// The input.
        input: PathBuf,
    },
    /// It is there, and claymill did not write it.
    #[error("{} exists, and claymill did not write it", .0.display())]
    Foreign(PathBuf),
    /// Several files do not fit into a stream.
    #[error("{}: {count} files cannot go into one stream", path.display())]
    Several {
        /// The destination.
        path: PathBuf,
        /// Number of files.
        count: usize,
    },
    /// Reading or writing failed, or another process writes there.
    #[error(transparent)]
    Folder(#[from] FolderError),
}

fn io_error(path: &Path) -> impl FnOnce(io::Error) -> OutputError + '_ {
    |source| OutputError::Folder(FolderError::Io { path: path.to_owned(), source })
}

/// Where a destination leads.
#[derive(Debug, Clone, PartialEq, Eq)]
enum To {
    /// Standard output.
    Standard,
    /// A device, a pipe, a socket: something that is written to, not replaced.
    Stream(PathBuf),
    /// A file, behind all links.
    File(PathBuf),
}

/// A file to be written, and its place while it is not whole.
#[derive(Debug)]
pub struct Output {
    told: PathBuf,
    to: To,
    inputs: Vec<PathBuf>,
    force: bool,
    scratch: Scratch,
}

impl Output {
    /// Looks at a destination before any work is done. `inputs` are the files that the command reads; `force` replaces what
    /// claymill did not write.
    ///
    /// # Errors
    /// It is an input, a folder, somebody else's file, or its folder cannot be written.
    pub fn begin(told: &Path, kind: Kind, inputs: &[PathBuf], force: bool) -> Result<Self, OutputError> {
        let to = leads_to(told)?;
        let inputs = inputs.to_vec();
        if let To::File(target) = &to {
            check(told, target, kind, &inputs, force)?;
        }
        let beside = match &to {
            To::File(target) => target.clone(),
            // Beside a device is no place for anything.
            _ => std::env::temp_dir().join(format!("claymill-{}", std::process::id())),
        };
        let scratch = Scratch::beside(&beside)?;
        Ok(Output { told: told.to_owned(), to, inputs, force, scratch })
    }

    /// Whether it is written to as it comes: there is no place beside it.
    #[must_use]
    pub fn is_stream(&self) -> bool {
        !matches!(self.to, To::File(_))
    }

    /// Whether a destination is standard output, where nothing else may be printed then.
    #[must_use]
    pub fn is_standard(told: &Path) -> bool {
        matches!(leads_to(told), Ok(To::Standard))
    }

    /// Where files are written first, under the names that they will have.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.scratch.folder
    }

    /// Name of the file.
    #[must_use]
    pub fn name(&self) -> &OsStr {
        match &self.to {
            To::File(_) => self.told.file_name().unwrap_or(OsStr::new("out")),
            _ => OsStr::new("out"),
        }
    }

    /// Where the file is written first.
    #[must_use]
    pub fn staged(&self) -> PathBuf {
        self.folder().join(self.name())
    }

    /// What must be removed when the process is interrupted.
    #[must_use]
    pub fn leftovers(&self) -> Vec<PathBuf> {
        self.scratch.leftovers()
    }

    /// Looks at a further file, which will lie beside.
    ///
    /// # Errors
    /// As [`Output::begin`].
    pub fn check_beside(&self, name: &OsStr, kind: Kind) -> Result<(), OutputError> {
        let told = self.told.with_file_name(name);
        match leads_to(&told)? {
            To::File(target) => check(&told, &target, kind, &self.inputs, self.force),
            _ => Ok(()),
        }
    }

    /// Writes these bytes.
    ///
    /// # Errors
    /// The system refuses.
    pub fn write(self, kind: Kind, bytes: &[u8]) -> Result<(), OutputError> {
        let staged = self.staged();
        fs::write(&staged, bytes).map_err(io_error(&self.told))?;
        self.finish(kind)
    }

    /// Puts the one file that was written in place.
    ///
    /// # Errors
    /// As [`Output::finish_all`].
    pub fn finish(self, kind: Kind) -> Result<(), OutputError> {
        let name = self.name().to_owned();
        self.finish_all(&[(name, kind)]).map(drop)
    }

    /// Puts files that were written in place, none before all were looked at; returns where they are.
    ///
    /// # Errors
    /// One of them is an input or somebody else's, or the system refuses.
    pub fn finish_all(self, files: &[(OsString, Kind)]) -> Result<Vec<PathBuf>, OutputError> {
        let stream = match &self.to {
            To::File(_) => {
                let told: Vec<PathBuf> =
                    files.iter().map(|(name, _)| self.told.with_file_name(name)).collect();
                let mut targets = Vec::new();
                for (told, (_, kind)) in told.iter().zip(files) {
                    let to = leads_to(told)?;
                    if let To::File(target) = &to {
                        check(told, target, *kind, &self.inputs, self.force)?;
                    }
                    targets.push(to);
                }
                for ((to, told), (name, _)) in targets.iter().zip(&told).zip(files) {
                    let staged = self.folder().join(name);
                    let done = match to {
                        To::File(target) => put(&staged, target),
                        To::Stream(device) => pour(&staged, File::options().write(true).open(device)),
                        To::Standard => pour(&staged, Ok(io::stdout().lock())),
                    };
                    done.map_err(io_error(told))?;
                }
                return Ok(told);
            }
            stream => stream,
        };
        let [(name, _)] = files else {
            return Err(OutputError::Several { path: self.told.clone(), count: files.len() });
        };
        let staged = self.folder().join(name);
        let done = match stream {
            To::Stream(device) => pour(&staged, File::options().write(true).open(device)),
            _ => pour(&staged, Ok(io::stdout().lock())),
        };
        // A reader that has seen enough (`| head`) is no error.
        match done {
            Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(vec![self.told.clone()]),
            done => done.map(|()| vec![self.told.clone()]).map_err(io_error(&self.told)),
        }
    }
}

/// Follows links. A place that is not there yet is a file.
fn leads_to(told: &Path) -> Result<To, OutputError> {
    let standard = ["-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"];
    if standard.iter().any(|name| told == Path::new(name)) {
        return Ok(To::Standard);
    }
    // What the system shows as a file and is none; a descriptor may lead to a file that somebody else writes too.
    if told.starts_with("/dev/fd") || told.starts_with("/proc") {
        return Ok(To::Stream(told.to_owned()));
    }
    match fs::metadata(told) {
        Ok(meta) if meta.is_file() => Ok(To::File(whole(told))),
        Ok(meta) if meta.is_dir() => {
            Err(io_error(told)(io::Error::new(io::ErrorKind::IsADirectory, "this is a folder")))
        }
        Ok(_) => Ok(To::Stream(told.to_owned())),
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(To::File(behind_links(told)?)),
        Err(e) => Err(io_error(told)(e)),
    }
}

/// Links to a file that is not there.
const MOST_LINKS: usize = 40;

/// Where links lead whose end is not there.
fn behind_links(told: &Path) -> Result<PathBuf, OutputError> {
    let mut path = told.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&path) {
            Ok(next) => path = parent_of(&path).join(next),
            Err(_) => return Ok(whole(&path)),
        }
    }
    Err(io_error(told)(io::Error::other("its links lead in a circle")))
}

/// Refuses what would be lost.
fn check(told: &Path, target: &Path, kind: Kind, inputs: &[PathBuf], force: bool) -> Result<(), OutputError> {
    if let Some(input) = inputs.iter().find(|input| is_same(input, target)) {
        return Err(OutputError::Input { path: told.to_owned(), input: input.clone() });
    }
    if force || is_ours(target, kind).map_err(io_error(told))? {
        return Ok(());
    }
    Err(OutputError::Foreign(told.to_owned()))
}

/// Whether two paths lead to one file, by whatever names.
#[cfg(unix)]
fn is_same(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (fs::metadata(a), fs::metadata(b)) {
        (Ok(a), Ok(b)) => (a.dev(), a.ino()) == (b.dev(), b.ino()),
        _ => whole(a) == whole(b),
    }
}

#[cfg(not(unix))]
fn is_same(a: &Path, b: &Path) -> bool {
    whole(a) == whole(b)
}

/// Whether nothing is there that somebody else made.
fn is_ours(path: &Path, kind: Kind) -> io::Result<bool> {
    let mut file = match File::open(path) {
        Ok(file) => file,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(true),
        Err(e) => return Err(e),
    };
    let size = file.metadata()?.len();
    if size == 0 {
        return Ok(true);
    }
    let mut head = Vec::new();
    (&file).take(LOOKED_AT).read_to_end(&mut head)?;
    let mut tail = Vec::new();
    file.seek(SeekFrom::Start(size.saturating_sub(LOOKED_AT)))?;
    file.take(LOOKED_AT).read_to_end(&mut tail)?;
    let has = |text: &[u8], mark: &[u8]| text.windows(mark.len()).any(|w| w == mark);
    let begins = |signs: &[&[u8]]| signs.iter().any(|sign| head.starts_with(sign));
    Ok(match kind {
        Kind::Program => has(&head, PROGRAM_MARK),
        Kind::Json => begins(&[b"{"]) && (has(&head, MARK) || has(&tail, MARK)),
        // The mark of an IGES file stands in its first, fixed columns; a STEP file and a glTF begin with a word.
        Kind::Model => {
            let iges = head.get(72) == Some(&b'S');
            (iges || begins(&[b"ISO-10303-21", b"glTF", b"claymill, millimetres"])) && has(&head, MARK)
        }
        // As pages of roff begin that are made by a program.
        Kind::Manual => begins(&[b".ie "]) && has(&head, MARK),
        Kind::Picture => {
            let film = head.get(4..8) == Some(b"ftyp") || begins(&[b"\x1a\x45\xdf\xa3"]);
            (film || begins(&[b"\x89PNG", b"GIF8", b"<svg"])) && (has(&head, MARK) || has(&tail, MARK))
        }
    })
}

/// Renames, or copies where another file system begins.
fn put(staged: &Path, target: &Path) -> io::Result<()> {
    if let Ok(before) = fs::metadata(target) {
        // Whoever could read it still can.
        fs::set_permissions(staged, before.permissions())?;
    }
    match fs::rename(staged, target) {
        Err(e) if e.kind() == io::ErrorKind::CrossesDevices => crate::write_whole(target, &fs::read(staged)?),
        done => done,
    }
}

fn pour(staged: &Path, to: io::Result<impl Write>) -> io::Result<()> {
    let mut to = to?;
    io::copy(&mut File::open(staged)?, &mut to)?;
    to.flush()
}

/// The files of a job folder that commands read.
#[must_use]
pub fn job_files(folder: &Path) -> Vec<PathBuf> {
    let known = [JOB_FILE, REGIONS_FILE, TOOLPATHS_FILE, VERIFY_FILE, REPORT_FILE, MANIFEST_FILE];
    let known = known.into_iter().map(str::to_owned);
    known.chain(manifest::names(folder)).map(|name| folder.join(name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PROGRAM: &[u8] = b"%\n(claymill post: fanuc)\n";

    fn write(to: &Path, inputs: &[PathBuf], force: bool) -> Result<(), OutputError> {
        Output::begin(to, Kind::Program, inputs, force)?.write(Kind::Program, PROGRAM)
    }

    #[test]
    fn what_claymill_did_not_write_stays() {
        let place = tempfile::tempdir().unwrap();
        let to = place.path().join("a.nc");
        write(&to, &[], false).unwrap();
        write(&to, &[], false).unwrap();
        fs::write(&to, "my own program").unwrap();
        assert!(matches!(write(&to, &[], false), Err(OutputError::Foreign(_))));
        assert_eq!(fs::read(&to).unwrap(), b"my own program");
        write(&to, &[], true).unwrap();
        assert_eq!(fs::read(&to).unwrap(), PROGRAM);
        // Another kind of file is not one of ours of this kind.
        let picture = Output::begin(&to, Kind::Picture, &[], false);
        assert!(matches!(picture, Err(OutputError::Foreign(_))));
        assert!(matches!(write(place.path(), &[], true), Err(OutputError::Folder(_))));
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 1);
    }

    #[test]
    #[cfg(unix)]
    fn an_input_is_not_written_over_by_any_name() {
        use std::os::unix::fs::symlink;
        let place = tempfile::tempdir().unwrap();
        let input = place.path().join("input");
        fs::write(&input, PROGRAM).unwrap();
        let (link, hard) = (place.path().join("link"), place.path().join("hard"));
        symlink("input", &link).unwrap();
        fs::hard_link(&input, &hard).unwrap();
        let roundabout =
            place.path().join(".").join("..").join(place.path().file_name().unwrap()).join("input");
        for to in [&input, &link, &hard, &roundabout] {
            let refused = write(to, std::slice::from_ref(&input), true);
            assert!(matches!(refused, Err(OutputError::Input { .. })), "{refused:?}");
        }
    }

    #[test]
    #[cfg(unix)]
    fn links_are_followed_and_devices_written_to() {
        use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
        let place = tempfile::tempdir().unwrap();
        let (here, there) = (place.path().join("here"), place.path().join("there"));
        fs::create_dir_all(&here).unwrap();
        fs::create_dir_all(&there).unwrap();
        let link = here.join("a.nc");
        symlink("../there/real.nc", &link).unwrap();
        // Of a file that is not there yet, and of one that is; its rights stay.
        for _ in 0..2 {
            write(&link, &[], false).unwrap();
            assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
            assert_eq!(fs::read(there.join("real.nc")).unwrap(), PROGRAM);
            fs::set_permissions(there.join("real.nc"), fs::Permissions::from_mode(0o640)).unwrap();
        }
        write(&link, &[], false).unwrap();
        assert_eq!(fs::metadata(there.join("real.nc")).unwrap().permissions().mode() & 0o777, 0o640);
        symlink("b.nc", here.join("b.nc")).unwrap();
        assert!(write(&here.join("b.nc"), &[], false).is_err());

        write(Path::new("/dev/null"), &[], false).unwrap();
        assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
        symlink("/dev/null", here.join("null")).unwrap();
        write(&here.join("null"), &[], false).unwrap();
        assert!(fs::symlink_metadata(here.join("null")).unwrap().is_symlink());
        let pipe = here.join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        if !made.is_ok_and(|s| s.success()) {
            return claymill_tests::leave_out(claymill_tests::Need::UnixTools, "no mkfifo");
        }
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read(pipe).unwrap()
        });
        write(&pipe, &[], false).unwrap();
        assert_eq!(reader.join().unwrap(), PROGRAM);
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
    }
}
