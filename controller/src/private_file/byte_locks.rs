//! Locks on single bytes of a file, which belong to an opening of it and go with it (Linux).

use std::fs::File;
use std::io;
use std::path::Path;

use nix::errno::Errno;
use nix::fcntl::{FcntlArg, fcntl};
use nix::libc;

/// The file itself knows its locks.
#[derive(Debug)]
pub(super) struct Locks;

impl Locks {
    pub(super) fn of(_: &Path) -> Self {
        Locks
    }

    /// Locks byte `at`; `false` where another opening has it.
    pub(super) fn try_lock(&self, file: &File, at: u64) -> io::Result<bool> {
        match set(file, at, libc::F_WRLCK) {
            Ok(()) => Ok(true),
            Err(Errno::EAGAIN | Errno::EACCES) => Ok(false),
            Err(e) => Err(e.into()),
        }
    }

    pub(super) fn unlock(&self, file: &File, at: u64) -> io::Result<()> {
        Ok(set(file, at, libc::F_UNLCK)?)
    }
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
