//! Locks on files beside a file, one for each number, where a system has none on single bytes that belong
//! to an opening. The empty files stay: to remove one that another process opens would give its lock twice.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// `.NAME.lock64` for the lock 64 of the file `NAME`.
#[derive(Debug)]
pub(super) struct Locks {
    path: PathBuf,
    /// Those that this opening has, which the system takes back with their files.
    taken: Mutex<BTreeMap<u64, File>>,
}

impl Locks {
    pub(super) fn of(path: &Path) -> Self {
        Locks { path: path.to_owned(), taken: Mutex::default() }
    }

    /// Takes a lock; `false` where another opening has it.
    pub(super) fn try_lock(&self, _: &File, at: u64) -> io::Result<bool> {
        let mut taken = self.taken();
        if taken.contains_key(&at) {
            return Ok(true);
        }
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false);
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        let file = options.open(self.beside(at))?;
        match file.try_lock() {
            Ok(()) => {
                taken.insert(at, file);
                Ok(true)
            }
            Err(TryLockError::WouldBlock) => Ok(false),
            Err(TryLockError::Error(e)) => Err(e),
        }
    }

    pub(super) fn unlock(&self, _: &File, at: u64) -> io::Result<()> {
        self.taken().remove(&at).map_or(Ok(()), |file| file.unlock())
    }

    fn taken(&self) -> MutexGuard<'_, BTreeMap<u64, File>> {
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn beside(&self, at: u64) -> PathBuf {
        let mut name = OsString::from(".");
        name.push(self.path.file_name().unwrap_or_default());
        name.push(format!(".lock{at}"));
        self.path.with_file_name(name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_is_there_once_and_goes_with_its_owner() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("queue");
        let file = File::create(&path).unwrap();
        let (one, other) = (Locks::of(&path), Locks::of(&path));
        assert!(one.try_lock(&file, 0).unwrap() && one.try_lock(&file, 0).unwrap());
        assert!(!other.try_lock(&file, 0).unwrap() && other.try_lock(&file, 64).unwrap());
        one.unlock(&file, 0).unwrap();
        assert!(other.try_lock(&file, 0).unwrap() && !one.try_lock(&file, 0).unwrap());
        drop(other);
        assert!(one.try_lock(&file, 0).unwrap() && one.try_lock(&file, 64).unwrap());
        let mut names: Vec<_> = folder.path().read_dir().unwrap().map(|f| f.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, [".queue.lock0", ".queue.lock64", "queue"]);
    }
}
