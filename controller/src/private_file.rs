//! A file that nobody but its owner can touch, and locks on parts of it that a process loses when it dies.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::Path;

use nix::errno::Errno;
use nix::fcntl::{FcntlArg, fcntl};
use nix::libc;
use nix::unistd::geteuid;

use crate::QueueError;

/// Bits of a mode that let others in.
const OTHERS: u32 = 0o077;

/// Opens a file for reading and writing, or makes it, empty; never through a link.
///
/// Whoever may read a file may also lock it, so that readers are refused like writers.
pub(crate) fn open(path: &Path) -> Result<File, QueueError> {
    let foreign = |why: String| QueueError::Foreign { path: path.to_owned(), why };
    // Without waiting: a pipe or a device is looked at, not used.
    let flags = libc::O_NOFOLLOW | libc::O_NONBLOCK | libc::O_NOCTTY;
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false).mode(0o600).custom_flags(flags);
    let file = options.open(path).map_err(|e| match e.raw_os_error() {
        Some(libc::ELOOP) => foreign("is a link".into()),
        Some(libc::EISDIR) => foreign("is a folder".into()),
        Some(libc::ENXIO) => foreign("is no regular file".into()),
        _ => QueueError::Open { path: path.to_owned(), source: e },
    })?;
    let found = file.metadata()?;
    let mode = found.mode() & 0o777;
    if !found.is_file() {
        return Err(foreign("is no regular file".into()));
    }
    if found.uid() != geteuid().as_raw() {
        return Err(foreign("belongs to another user".into()));
    }
    if mode & OTHERS != 0 {
        return Err(foreign(format!("could be read, written or locked by other users (mode {mode:04o})")));
    }
    if found.nlink() > 1 {
        return Err(foreign("has other names too".into()));
    }
    Ok(file)
}

/// Locks byte `at` for this opening of the file; `false` where another one has it. It is lost with the file.
pub(crate) fn try_lock(file: &File, at: u64) -> io::Result<bool> {
    match set(file, at, libc::F_WRLCK) {
        Ok(()) => Ok(true),
        Err(Errno::EAGAIN | Errno::EACCES) => Ok(false),
        Err(e) => Err(e.into()),
    }
}

/// Gives a lock of [`try_lock`] back.
pub(crate) fn unlock(file: &File, at: u64) -> io::Result<()> {
    Ok(set(file, at, libc::F_UNLCK)?)
}

fn set(file: &File, at: u64, kind: libc::c_int) -> Result<(), Errno> {
    let lock = libc::flock {
        l_type: kind as libc::c_short,
        l_whence: libc::SEEK_SET as libc::c_short,
        l_start: at as libc::off_t,
        l_len: 1,
        l_pid: 0,
    };
    fcntl(file, FcntlArg::F_OFD_SETLK(&lock)).map(|_| ())
}
