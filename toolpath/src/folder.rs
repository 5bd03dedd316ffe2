//! Reads and writes job folders. A folder is written beside its destination and renamed when whole;
//! nothing that claymill did not write is replaced.

use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};
use thiserror::Error;

use crate::io_advice::advice_on;
use crate::largest::Largest;
use crate::manifest::{self, Survey};
use crate::place::whole;
use crate::plain_file::{LONGEST_MADE, open_plain, read_plain};
use crate::plausible::{check_move, implausible, impossible_region};
use crate::scratch::{Scratch, parent_of};
use crate::{Job, Move, Program, RegionsFile};

/// Name of the job record.
pub const JOB_FILE: &str = "job.json";
/// Name of the regions' file.
pub const REGIONS_FILE: &str = "regions.json";
/// Name of the moves' file.
pub const TOOLPATHS_FILE: &str = "toolpaths.jsonl";
/// Name of the verification's result.
pub const VERIFY_FILE: &str = "verify.json";
/// Name of the report.
pub const REPORT_FILE: &str = "report.html";

/// Why a job folder could not be read or written.
#[derive(Debug, Error)]
pub enum FolderError {
    /// Reading or writing failed.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// A file does not have the documented form.
    #[error("{} line {line}: {message}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// A value is one that no job has.
    #[error("{}: {what}", path.display())]
    Implausible {
        /// The file.
        path: PathBuf,
        /// Which value, and what it may be.
        what: String,
    },
    /// The destination exists and is not a job folder: it is left alone.
    #[error("{} exists and is not a claymill job folder", .0.display())]
    NotAJobFolder(PathBuf),
    /// The destination has files that would be lost: it is left alone.
    #[error("{} {}", folder.display(), what_is_there(edited, foreign))]
    NotOurs {
        /// The folder.
        folder: PathBuf,
        /// Files that claymill wrote and somebody changed since.
        edited: Vec<PathBuf>,
        /// Files that somebody else put there.
        foreign: Vec<PathBuf>,
    },
    /// Another process writes there.
    #[error("{} is being written by another claymill{}", path.display(), process(owner))]
    Busy {
        /// The destination.
        path: PathBuf,
        /// Number of the other process, where that is known.
        owner: String,
    },
}

impl FolderError {
    /// What the user can do about it: one whole sentence.
    #[must_use]
    pub fn advice(&self) -> &'static str {
        match self {
            FolderError::Io { source, .. } => advice_on(source),
            FolderError::Format { .. } | FolderError::Implausible { .. } => {
                "The file was changed or made by another version: plan the job again."
            }
            FolderError::NotAJobFolder(_) => {
                "Choose a new folder, or empty this one; other people's files are never replaced."
            }
            FolderError::NotOurs { .. } => {
                "Move them elsewhere, or choose another folder: only what claymill wrote is replaced."
            }
            FolderError::Busy { .. } => "Wait until it has ended, or choose another place.",
        }
    }
}

/// Files that a message names.
const NAMED: usize = 5;

/// What keeps a folder from being replaced, in words.
fn what_is_there(edited: &[PathBuf], foreign: &[PathBuf]) -> String {
    let list = |files: &[PathBuf]| {
        let mut names: Vec<String> = files.iter().take(NAMED).map(|f| f.display().to_string()).collect();
        if files.len() > NAMED {
            names.push(format!("{} more", files.len() - NAMED));
        }
        names.join(", ")
    };
    match (edited.is_empty(), foreign.is_empty()) {
        (true, _) => format!("holds what claymill did not write: {}", list(foreign)),
        (false, true) => format!("holds files that were changed since claymill wrote them: {}", list(edited)),
        (false, false) => format!(
            "holds files that were changed since claymill wrote them: {}; and what it did not write: {}",
            list(edited),
            list(foreign)
        ),
    }
}

fn process(owner: &str) -> String {
    if owner.is_empty() { String::new() } else { format!(" (process {owner})") }
}

pub(crate) fn io_error(path: &Path) -> impl FnOnce(io::Error) -> FolderError + '_ {
    |source| FolderError::Io { path: path.to_owned(), source }
}

/// Writes a job folder beside its destination and moves it into place when it is whole.
///
/// Dropping the writer without [`FolderWriter::finish`] removes everything that was written.
#[derive(Debug)]
pub struct FolderWriter {
    destination: PathBuf,
    scratch: Scratch,
    /// Goes after the scratch folder in it.
    made: Made,
}

/// Folders that had to be made for a destination, innermost first: they go again where nothing comes of it.
#[derive(Debug)]
struct Made(Vec<PathBuf>);

impl Drop for Made {
    fn drop(&mut self) {
        for folder in &self.0 {
            // Best effort: there is nobody left to tell. What is not empty stays.
            let _ = fs::remove_dir(folder);
        }
    }
}

impl FolderWriter {
    /// Starts a folder that will become `destination`.
    ///
    /// # Errors
    /// The destination's parent cannot be written, another process writes there, or the destination exists and holds
    /// something else than a job as it was written (an empty folder is fine).
    pub fn begin(destination: &Path) -> Result<Self, FolderError> {
        Self::begin_replacing(destination, JOB_FILE)
    }

    /// As [`FolderWriter::begin`], for a folder that may be replaced when it holds the file `mark`; a job only by a job.
    ///
    /// # Errors
    /// As [`FolderWriter::begin`].
    pub fn begin_replacing(destination: &Path, mark: &str) -> Result<Self, FolderError> {
        // A link to a folder stays, and the folder that it leads to is the one that is replaced.
        let destination = whole(destination);
        let parent = parent_of(&destination);
        let missing = parent.ancestors().take_while(|p| !p.as_os_str().is_empty() && !p.exists());
        let made = Made(missing.map(Path::to_owned).collect());
        fs::create_dir_all(&parent).map_err(io_error(&parent))?;
        let scratch = Scratch::beside(&destination)?;
        if destination.exists() {
            let mut entries = fs::read_dir(&destination).map_err(io_error(&destination))?;
            let other_kind = mark != JOB_FILE && destination.join(JOB_FILE).exists();
            if entries.next().is_some() && (other_kind || !destination.join(mark).exists()) {
                return Err(FolderError::NotAJobFolder(destination));
            }
            Survey::of(&destination)?.replaceable(&destination)?;
        }
        Ok(FolderWriter { destination, scratch, made })
    }

    /// Where the files are until the folder is whole.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.scratch.folder
    }

    /// Where they will be then, from the root.
    #[must_use]
    pub fn destination(&self) -> &Path {
        &self.destination
    }

    /// What must be removed when the process is interrupted.
    #[must_use]
    pub fn leftovers(&self) -> Vec<PathBuf> {
        self.scratch.leftovers()
    }

    /// Writes `value` as indented JSON.
    ///
    /// # Errors
    /// Writing fails.
    pub fn json(&self, name: &str, value: &impl Serialize) -> Result<(), FolderError> {
        let path = self.path().join(name);
        let mut text = serde_json::to_vec_pretty(value).map_err(|e| FolderError::Format {
            path: path.clone(),
            line: 0,
            message: e.to_string(),
        })?;
        text.push(b'\n');
        fs::write(&path, text).map_err(io_error(&path))
    }

    /// Writes plain text.
    ///
    /// # Errors
    /// Writing fails.
    pub fn text(&self, name: &str, text: &str) -> Result<(), FolderError> {
        let path = self.path().join(name);
        fs::write(&path, text).map_err(io_error(&path))
    }

    /// Writes the moves, one a line.
    ///
    /// # Errors
    /// Writing fails.
    pub fn moves(&self, program: &Program) -> Result<(), FolderError> {
        let path = self.path().join(TOOLPATHS_FILE);
        let mut out = BufWriter::new(File::create(&path).map_err(io_error(&path))?);
        for m in &program.moves {
            serde_json::to_writer(&mut out, m)
                .map_err(|e| FolderError::Io { path: path.clone(), source: e.into() })?;
            out.write_all(b"\n").map_err(io_error(&path))?;
        }
        out.flush().map_err(io_error(&path))
    }

    /// Moves the folder into place; an earlier job there is replaced. What came into it since [`FolderWriter::begin`] and is
    /// not claymill's stays in the folder that is returned.
    ///
    /// # Errors
    /// Renaming fails.
    pub fn finish(mut self) -> Result<Option<PathBuf>, FolderError> {
        let partial = self.scratch.folder.clone();
        manifest::write(&partial)?;
        let replaced = self.destination.exists();
        let mut old = partial.clone();
        if replaced && exchange(&partial, &self.destination).is_err() {
            // Where folders cannot change places there is a moment with neither.
            old.set_extension("old");
            fs::rename(&self.destination, &old).map_err(io_error(&self.destination))?;
            fs::rename(&partial, &self.destination).map_err(|source| {
                // The earlier job comes back; the first error is the one worth telling.
                let _ = fs::rename(&old, &self.destination);
                io_error(&self.destination)(source)
            })?;
        } else if !replaced {
            fs::rename(&partial, &self.destination).map_err(io_error(&self.destination))?;
        }
        self.made.0.clear();
        self.scratch.release();
        if !replaced || manifest::remove_ours(&old)? {
            return Ok(None);
        }
        let kept = unused(&self.destination);
        fs::rename(&old, &kept).map_err(io_error(&kept))?;
        Ok(Some(kept))
    }
}

/// `NAME.before`, or with a number behind it where that is there.
fn unused(destination: &Path) -> PathBuf {
    let named = |number: u32| {
        let mut name = destination.file_name().unwrap_or_default().to_owned();
        name.push(if number == 1 { ".before".to_owned() } else { format!(".before-{number}") });
        destination.with_file_name(name)
    };
    (1..).map(named).find(|path| fs::symlink_metadata(path).is_err()).unwrap_or_else(|| named(1))
}

/// Lets two folders change places at once: whoever looks sees the one or the other, whole.
#[cfg(target_os = "linux")]
fn exchange(a: &Path, b: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE)?)
}

#[cfg(not(target_os = "linux"))]
fn exchange(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// JSON files of a job are no longer than this, bytes.
const LONGEST_JSON: u64 = 1 << 30;
/// Neither are lines of moves.
const LONGEST_LINE: u64 = 256 << 20;
/// No number of a job, and no area in mm², is larger.
const LARGEST_NUMBER: f64 = 1e15;

fn format_error(path: &Path, e: &serde_json::Error) -> FolderError {
    FolderError::Format { path: path.to_owned(), line: e.line(), message: e.to_string() }
}

fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T, FolderError> {
    let text = read_plain(path, LONGEST_JSON).map_err(io_error(path))?;
    let value = serde_json::from_slice(&text).map_err(|e| format_error(path, &e))?;
    let Largest(largest) = serde_json::from_slice(&text).map_err(|e| format_error(path, &e))?;
    if largest > LARGEST_NUMBER {
        let what = format!("it holds the number {largest:e}, which nothing of a job is");
        return Err(FolderError::Implausible { path: path.to_owned(), what });
    }
    Ok(value)
}

/// Reads `job.json` of a job folder.
///
/// # Errors
/// The file is missing, not of the documented form, or has values that no job has.
pub fn read_job(folder: &Path) -> Result<Job, FolderError> {
    let path = folder.join(JOB_FILE);
    let job = read_json(&path)?;
    match implausible(&job) {
        Some(what) => Err(FolderError::Implausible { path, what }),
        None => Ok(job),
    }
}

/// Reads `regions.json` of a job folder.
///
/// # Errors
/// The file is missing, not of the documented form, or numbers its regions as none does.
pub fn read_regions(folder: &Path) -> Result<RegionsFile, FolderError> {
    let path = folder.join(REGIONS_FILE);
    let regions = read_json(&path)?;
    match impossible_region(&regions) {
        Some(what) => Err(FolderError::Implausible { path, what }),
        None => Ok(regions),
    }
}

/// Reads `toolpaths.jsonl` of a job folder.
///
/// # Errors
/// The file is missing, or a line is not a move that a machine could make.
pub fn read_moves(folder: &Path) -> Result<Program, FolderError> {
    Ok(read_moves_with_hash(folder)?.0)
}

/// The moves, and the SHA-256 of the very bytes that they were read from.
pub(crate) fn read_moves_with_hash(folder: &Path) -> Result<(Program, String), FolderError> {
    let path = folder.join(TOOLPATHS_FILE);
    let mut file = BufReader::new(open_plain(&path, LONGEST_MADE).map_err(io_error(&path))?);
    let (mut moves, mut hash, mut text) = (Vec::new(), Sha256::new(), Vec::new());
    for line in 1.. {
        text.clear();
        let length =
            file.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut text).map_err(io_error(&path))?;
        if length == 0 {
            break;
        }
        hash.update(&text);
        let wrong = |message: String| FolderError::Format { path: path.clone(), line, message };
        if length as u64 == LONGEST_LINE {
            return Err(wrong("the line has no end".into()));
        }
        if text.trim_ascii().is_empty() {
            continue;
        }
        let parsed: Move = serde_json::from_slice(&text).map_err(|e| wrong(e.to_string()))?;
        check_move(&parsed).map_err(|e| wrong(e.to_string()))?;
        moves.push(parsed);
    }
    Ok((Program { moves }, hex(&hash.finalize())))
}

/// Bytes in hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// SHA-256 of a file, hexadecimal.
///
/// # Errors
/// The file cannot be read, or is a device or pipe.
pub fn sha256_of(path: &Path) -> Result<String, FolderError> {
    let mut file = open_plain(path, LONGEST_MADE).map_err(io_error(path))?;
    let mut hash = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        let count = file.read(&mut buffer).map_err(io_error(path))?;
        if count == 0 {
            break;
        }
        hash.update(&buffer[..count]);
    }
    Ok(hex(&hash.finalize()))
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    fn write(destination: &Path, number: u32) {
        let writer = FolderWriter::begin_replacing(destination, "number").unwrap();
        writer.text("number", &number.to_string()).unwrap();
        writer.text("again", &number.to_string()).unwrap();
        assert_eq!(writer.finish().unwrap(), None);
    }

    /// Names in a folder, in order.
    fn names(folder: &Path) -> Vec<String> {
        let names = fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    }

    #[test]
    fn nothing_is_lost_that_was_not_written_here() {
        let place = tempfile::tempdir().unwrap();
        let out = place.path().join("out");
        write(&out, 1);
        write(&out, 2);
        let refused = |named: &str| {
            let before = names(&out);
            let error = FolderWriter::begin_replacing(&out, "number").unwrap_err();
            assert!(matches!(error, FolderError::NotOurs { .. }), "{error}");
            assert!(error.to_string().contains(named), "{error}");
            assert_eq!((names(&out), names(place.path())), (before, vec!["out".to_owned()]));
        };
        fs::write(out.join("body.nc"), "G0").unwrap();
        refused("body.nc");
        fs::remove_file(out.join("body.nc")).unwrap();
        fs::create_dir_all(out.join("notes/empty")).unwrap();
        refused("notes/empty");
        fs::remove_dir_all(out.join("notes")).unwrap();
        fs::write(out.join("again"), "3").unwrap();
        refused("changed since claymill wrote them: again");
        fs::write(out.join("again"), "2").unwrap();
        // Without the list nobody can tell.
        let list = fs::read(out.join("files.sha256")).unwrap();
        fs::remove_file(out.join("files.sha256")).unwrap();
        refused("again, number");
        fs::write(out.join("files.sha256"), list).unwrap();
        write(&out, 3);

        // What comes while the folder is written is kept beside it.
        for expected in ["out.before", "out.before-2"] {
            let writer = FolderWriter::begin_replacing(&out, "number").unwrap();
            writer.text("number", "4").unwrap();
            fs::write(out.join("note"), "mine").unwrap();
            let kept = writer.finish().unwrap().expect("a note");
            assert_eq!(kept.file_name().unwrap(), expected);
            assert_eq!(
                (names(&kept), names(&out)),
                (vec!["note".to_owned()], vec!["files.sha256".to_owned(), "number".to_owned()])
            );
        }
    }

    #[test]
    #[cfg(unix)]
    fn a_link_to_a_folder_stays_a_link() {
        let place = tempfile::tempdir().unwrap();
        let (real, link) = (place.path().join("real"), place.path().join("link"));
        write(&real, 1);
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write(&link, 2);
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(real.join("number")).unwrap(), "2");
        assert_eq!(names(place.path()), ["link", "real"]);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_folder_is_there_at_every_moment_while_it_is_replaced() {
        let place = tempfile::tempdir().unwrap();
        let destination = place.path().join("out");
        write(&destination, 0);
        let done = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let watch = scope.spawn(|| {
                let mut looks = 0u64;
                while !done.load(Ordering::Relaxed) {
                    assert!(destination.exists());
                    looks += 1;
                }
                looks
            });
            (1..300).for_each(|number| write(&destination, number));
            done.store(true, Ordering::Relaxed);
            assert!(watch.join().unwrap() > 100);
        });
        assert_eq!(fs::read_to_string(destination.join("again")).unwrap(), "299");
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 1);
    }
}
