//! A file that nobody but its owner can touch, read and written at places, and locks that a process
//! loses when it dies.
//!
//! ```text
//!   system      owner, mode, links    locks
//!   Linux       checked               bytes of the file itself (`byte_locks`)
//!   other Unix  checked               files beside it (`lock_files`)
//!   Windows     links alone           files beside it
//! ```
//!
//! What Windows calls the access control list of a file is not looked at: there a queue is as private
//! as the folder that it lies in.

use std::fs::File;
use std::io;
use std::path::Path;

use crate::QueueError;

#[cfg(target_os = "linux")]
mod byte_locks;
#[cfg(any(not(target_os = "linux"), test))]
mod lock_files;
#[cfg_attr(unix, path = "unix.rs")]
#[cfg_attr(windows, path = "windows.rs")]
mod system;

#[cfg(target_os = "linux")]
use byte_locks::Locks;
#[cfg(not(target_os = "linux"))]
use lock_files::Locks;

/// A file for reading and writing at places, with locks.
#[derive(Debug)]
pub(crate) struct PrivateFile {
    file: File,
    locks: Locks,
}

impl PrivateFile {
    /// Opens a file for reading and writing, or makes it, empty; never through a link.
    ///
    /// Whoever may read a file may also lock it, so that readers are refused like writers.
    pub(crate) fn open(path: &Path) -> Result<Self, QueueError> {
        let foreign = |why: String| QueueError::Foreign { path: path.to_owned(), why };
        let file = system::open(path).map_err(|e| match system::not_a_file(&e, path) {
            Some(why) => foreign(why.into()),
            None => QueueError::Open { path: path.to_owned(), source: e },
        })?;
        let found = file.metadata()?;
        if found.is_symlink() {
            return Err(foreign("is a link".into()));
        }
        if !found.is_file() {
            return Err(foreign("is no regular file".into()));
        }
        if let Some(why) = system::not_private(&found) {
            return Err(foreign(why));
        }
        Ok(PrivateFile { file, locks: Locks::of(path) })
    }

    /// Its length, bytes.
    pub(crate) fn len(&self) -> io::Result<u64> {
        Ok(self.file.metadata()?.len())
    }

    /// Makes it as long as this, bytes.
    pub(crate) fn set_len(&self, length: u64) -> io::Result<()> {
        self.file.set_len(length)
    }

    /// Reads all of `bytes`, beginning at byte `at`.
    pub(crate) fn read_exact_at(&self, bytes: &mut [u8], at: u64) -> io::Result<()> {
        system::read_exact_at(&self.file, bytes, at)
    }

    /// Writes all of `bytes`, beginning at byte `at`; a few bytes in one call.
    pub(crate) fn write_all_at(&self, bytes: &[u8], at: u64) -> io::Result<()> {
        system::write_all_at(&self.file, bytes, at)
    }

    /// Takes the lock with the number `at` for this opening of the file; `false` where another one has it. It is lost with the
    /// file.
    pub(crate) fn try_lock(&self, at: u64) -> io::Result<bool> {
        self.locks.try_lock(&self.file, at)
    }

    /// Gives a lock of [`PrivateFile::try_lock`] back.
    pub(crate) fn unlock(&self, at: u64) -> io::Result<()> {
        self.locks.unlock(&self.file, at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_come_back_from_where_they_were_put() {
        let folder = tempfile::tempdir().unwrap();
        let file = PrivateFile::open(&folder.path().join("queue")).unwrap();
        assert_eq!(file.len().unwrap(), 0);
        file.set_len(100).unwrap();
        file.write_all_at(b"second", 50).unwrap();
        file.write_all_at(b"first", 3).unwrap();
        let mut bytes = [1; 8];
        file.read_exact_at(&mut bytes, 50).unwrap();
        assert_eq!(&bytes, b"second\0\0");
        file.read_exact_at(&mut bytes[..5], 3).unwrap();
        assert_eq!(&bytes[..5], b"first");
        let short = file.read_exact_at(&mut bytes, 99).unwrap_err();
        assert_eq!(short.kind(), io::ErrorKind::UnexpectedEof);
    }

    #[test]
    fn a_lock_is_there_once_and_goes_with_its_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("queue");
        let (one, other) = (PrivateFile::open(&path).unwrap(), PrivateFile::open(&path).unwrap());
        assert!(one.try_lock(64).unwrap() && one.try_lock(64).unwrap());
        assert!(!other.try_lock(64).unwrap() && other.try_lock(128).unwrap());
        one.unlock(64).unwrap();
        assert!(other.try_lock(64).unwrap());
        drop(other);
        assert!(one.try_lock(64).unwrap() && one.try_lock(128).unwrap());
    }
}
