//! Writes a file beside its destination and renames it, so that no half-written file is ever seen.

use std::path::Path;
use std::{fs, io};

/// Writes `bytes` beside `path` and renames, so that no half-written file is ever seen.
///
/// # Errors
/// What the operating system said; nothing is left behind.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.partial", std::process::id()));
    let partial = path.with_file_name(name);
    fs::write(&partial, bytes).and_then(|()| fs::rename(&partial, path)).inspect_err(|_| {
        // Best effort: the first error is the one worth telling.
        let _ = fs::remove_file(&partial);
    })
}
