//! Private files on Windows: links are refused; who else may use a file cannot be seen without `unsafe`.

use std::fs::{File, Metadata, OpenOptions};
use std::io;
use std::os::windows::fs::{FileExt, OpenOptionsExt};
use std::path::Path;

/// `FILE_FLAG_OPEN_REPARSE_POINT`: a link is opened itself, not what it leads to.
const LINKS_THEMSELVES: u32 = 0x0020_0000;

pub(super) fn open(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false).custom_flags(LINKS_THEMSELVES);
    options.open(path)
}

/// Why something is no file, where that is why it could not be opened.
pub(super) fn not_a_file(_: &io::Error, path: &Path) -> Option<&'static str> {
    let found = path.symlink_metadata().ok()?;
    match (found.is_symlink(), found.is_dir()) {
        (true, _) => Some("is a link"),
        (_, true) => Some("is a folder"),
        _ => None,
    }
}

/// The access control list is not looked at.
pub(super) fn not_private(_: &Metadata) -> Option<String> {
    None
}

pub(super) fn read_exact_at(file: &File, mut bytes: &mut [u8], mut at: u64) -> io::Result<()> {
    while !bytes.is_empty() {
        match file.seek_read(bytes, at) {
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => {
                bytes = &mut bytes[count..];
                at += count as u64;
            }
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(())
}

pub(super) fn write_all_at(file: &File, mut bytes: &[u8], mut at: u64) -> io::Result<()> {
    while !bytes.is_empty() {
        match file.seek_write(bytes, at) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(count) => {
                bytes = &bytes[count..];
                at += count as u64;
            }
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(())
}
