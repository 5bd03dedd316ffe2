//! Private files on Unix: owner, mode and names are looked at.

use std::fs::{File, Metadata, OpenOptions};
use std::io;
use std::os::unix::fs::{FileExt, MetadataExt, OpenOptionsExt};
use std::path::Path;

use nix::libc;
use nix::unistd::geteuid;

/// Bits of a mode that let others in.
const OTHERS: u32 = 0o077;

pub(super) fn open(path: &Path) -> io::Result<File> {
    // Without waiting: a pipe or a device is looked at, not used.
    let flags = libc::O_NOFOLLOW | libc::O_NONBLOCK | libc::O_NOCTTY;
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false).mode(0o600).custom_flags(flags);
    options.open(path)
}

/// Why something is no file, where that is why it could not be opened.
pub(super) fn not_a_file(error: &io::Error, _: &Path) -> Option<&'static str> {
    match error.raw_os_error() {
        Some(libc::ELOOP) => Some("is a link"),
        Some(libc::EISDIR) => Some("is a folder"),
        Some(libc::ENXIO) => Some("is no regular file"),
        _ => None,
    }
}

/// Why an open file is not its owner's alone.
pub(super) fn not_private(found: &Metadata) -> Option<String> {
    let mode = found.mode() & 0o777;
    if found.uid() != geteuid().as_raw() {
        return Some("belongs to another user".into());
    }
    if mode & OTHERS != 0 {
        return Some(format!("could be read, written or locked by other users (mode {mode:04o})"));
    }
    (found.nlink() > 1).then(|| "has other names too".into())
}

pub(super) fn read_exact_at(file: &File, bytes: &mut [u8], at: u64) -> io::Result<()> {
    file.read_exact_at(bytes, at)
}

pub(super) fn write_all_at(file: &File, bytes: &[u8], at: u64) -> io::Result<()> {
    file.write_all_at(bytes, at)
}
