//! A place for work in progress beside its destination, which one process at a time has.
//!
//! ```text
//!   .NAME.lock      held by the process that writes NAME; the system lets go of it when that process ends, however
//!   .NAME.partial   what it has written so far, removed by it, or by whoever takes the lock next
//! ```

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::FolderError;
use crate::folder::io_error;

/// Begins the text of a lock; the number of the process follows.
const MARK: &str = "claymill ";
/// A lock that was removed while it was waited for is taken anew; nobody has bad luck that often.
const ATTEMPTS: usize = 100;

const LOCK: &str = "lock";
const PARTIAL: &str = "partial";

/// The right to write one destination.
#[derive(Debug)]
pub(crate) struct Lock {
    path: PathBuf,
    /// Held as long as it is open.
    _file: File,
    /// A process that had the lock before has not given it back.
    pub(crate) was_left: bool,
}

/// `.NAME.ENDING` beside `NAME`.
fn hidden(destination: &Path, ending: &str) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(destination.file_name().unwrap_or(OsStr::new("job")));
    name.push(format!(".{ending}"));
    parent_of(destination).join(name)
}

/// The folder that a path is in.
pub(crate) fn parent_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    }
}

impl Lock {
    /// Takes the lock of a destination, whose folder must be there.
    pub(crate) fn take(destination: &Path) -> Result<Self, FolderError> {
        let path = hidden(destination, LOCK);
        for _ in 0..ATTEMPTS {
            let open = File::options().read(true).write(true).create(true).truncate(false).open(&path);
            // The message names what was asked for, not the lock.
            let mut file = open.map_err(io_error(destination))?;
            let mut text = String::new();
            let held = match file.try_lock() {
                Ok(()) => false,
                Err(TryLockError::WouldBlock) => true,
                // A file system without locks: better written without than not at all.
                Err(TryLockError::Error(_)) => false,
            };
            // Whoever wrote something else than a mark has nothing to do with this.
            let _ = (&file).take(64).read_to_string(&mut text);
            if held {
                let owner = text.strip_prefix(MARK).map(|pid| pid.trim().to_owned()).unwrap_or_default();
                return Err(FolderError::Busy { path: destination.to_owned(), owner });
            }
            if !is_at(&file, &path) {
                continue;
            }
            let was_left = text.starts_with(MARK);
            if let Err(e) = mark(&mut file) {
                let _ = fs::remove_file(&path);
                return Err(io_error(destination)(e));
            }
            return Ok(Lock { path, _file: file, was_left });
        }
        Err(FolderError::Busy { path: destination.to_owned(), owner: String::new() })
    }

    /// Its file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // While it is still held, so that nobody takes what is about to go.
        let _ = fs::remove_file(&self.path);
    }
}

/// Writes whose lock this is.
fn mark(file: &mut File) -> io::Result<()> {
    file.set_len(0)?;
    file.seek(SeekFrom::Start(0))?;
    writeln!(file, "{MARK}{}", std::process::id())
}

/// Whether an open file is the one that the path leads to now.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (file.metadata(), fs::symlink_metadata(path)) {
        (Ok(a), Ok(b)) => (a.dev(), a.ino()) == (b.dev(), b.ino()),
        _ => false,
    }
}

#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

/// A folder for what is not finished.
#[derive(Debug)]
pub(crate) struct Scratch {
    pub(crate) folder: PathBuf,
    pub(crate) lock: Lock,
}

impl Scratch {
    /// Beside `destination`, whose folder must be there. What dead processes left there goes.
    pub(crate) fn beside(destination: &Path) -> Result<Self, FolderError> {
        let lock = Lock::take(destination)?;
        sweep(&parent_of(destination));
        let folder = hidden(destination, PARTIAL);
        if lock.was_left {
            remove(&folder).map_err(io_error(&folder))?;
        }
        fs::create_dir(&folder).map_err(io_error(&folder))?;
        Ok(Scratch { folder, lock })
    }

    /// Forgets the folder: what lies there now is not half-written, and stays.
    pub(crate) fn release(&mut self) {
        self.folder = PathBuf::new();
    }

    /// What must go when the process is interrupted.
    pub(crate) fn leftovers(&self) -> Vec<PathBuf> {
        vec![self.folder.clone(), self.lock.path().to_owned()]
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // Best effort: there is nobody left to tell.
        let _ = remove(&self.folder);
    }
}

/// Whether a scratch folder or its lock belongs to this process now: what it has given back may be another one's.
#[must_use]
pub fn is_own_scratch(path: &Path) -> bool {
    let text = fs::read_to_string(path.with_extension(LOCK)).unwrap_or_default();
    text.strip_prefix(MARK).is_some_and(|owner| owner.trim() == std::process::id().to_string())
}

/// Removes a folder with all that is in it, or a file; nothing where there is none.
fn remove(path: &Path) -> io::Result<()> {
    let removed = match fs::symlink_metadata(path) {
        Ok(meta) if meta.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
        Err(e) => Err(e),
    };
    match removed {
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

/// Removes what processes that are no more have left half-written in a folder.
fn sweep(parent: &Path) {
    let Ok(entries) = fs::read_dir(parent) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let bytes = name.as_encoded_bytes();
        let Some(stem) = bytes.strip_prefix(b".").and_then(|b| b.strip_suffix(b".lock")) else { continue };
        let lock = entry.path();
        // Only a lock of ours that nobody holds, and that is still there when it is taken.
        let Ok(file) = File::options().read(true).write(true).open(&lock) else { continue };
        let mut text = String::new();
        let ours = (&file).take(64).read_to_string(&mut text).is_ok() && text.starts_with(MARK);
        if !ours || file.try_lock().is_err() || !is_at(&file, &lock) {
            continue;
        }
        let mut partial = b".".to_vec();
        partial.extend(stem);
        partial.extend(b".partial");
        // A file name's bytes cut at ASCII stay a file name.
        if let Some(partial) = name_of(partial) {
            let _ = remove(&parent.join(partial));
        }
        let _ = fs::remove_file(&lock);
    }
}

#[cfg(unix)]
fn name_of(bytes: Vec<u8>) -> Option<OsString> {
    Some(std::os::unix::ffi::OsStringExt::from_vec(bytes))
}

#[cfg(not(unix))]
fn name_of(bytes: Vec<u8>) -> Option<OsString> {
    String::from_utf8(bytes).ok().map(OsString::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_process_at_a_time_and_what_the_dead_left_goes() {
        let place = tempfile::tempdir().unwrap();
        let to = place.path().join("out");
        let first = Scratch::beside(&to).unwrap();
        fs::write(first.folder.join("half"), "").unwrap();
        assert!(first.leftovers().iter().all(|path| is_own_scratch(path)));
        let second = Scratch::beside(&to);
        assert!(
            matches!(&second, Err(FolderError::Busy { owner, .. })
            if *owner == std::process::id().to_string()),
            "{second:?}"
        );
        // Another destination in the same folder leaves it alone.
        let other = Scratch::beside(&place.path().join("other")).unwrap();
        assert!(first.folder.join("half").exists());
        drop((first, other));
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);

        // As a killed process leaves it: the lock's file is there and nobody holds it.
        let leave = |name: &str| {
            fs::write(place.path().join(format!(".{name}.lock")), "claymill 4711\n").unwrap();
            fs::create_dir(place.path().join(format!(".{name}.partial"))).unwrap();
            assert!(!is_own_scratch(&place.path().join(format!(".{name}.partial"))));
            fs::write(place.path().join(format!(".{name}.partial/half")), "").unwrap();
        };
        leave("out");
        leave("third");
        let again = Scratch::beside(&to).unwrap();
        assert!(!again.folder.join("half").exists());
        assert!(!place.path().join(".third.partial").exists());
        drop(again);
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);

        // What others call so stays.
        fs::write(place.path().join(".mine.lock"), "4711").unwrap();
        fs::create_dir(place.path().join(".mine.partial")).unwrap();
        fs::create_dir(place.path().join(".out.partial")).unwrap();
        assert!(matches!(Scratch::beside(&to), Err(FolderError::Io { .. })));
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 3);
    }
}
