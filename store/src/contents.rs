//! What lies in a store, and what of it goes when it grows too large.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::part_file::{is_part, is_partial, remove_if_dead};

/// What a store holds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Contents {
    /// How many parts.
    pub parts: usize,
    /// What they take on the disk.
    pub bytes: u64,
}

/// A part's file, by when it was last used.
struct Entry {
    used: SystemTime,
    path: PathBuf,
    bytes: u64,
}

fn entries(folder: &Path) -> io::Result<Vec<Entry>> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if !is_part(&entry.file_name().to_string_lossy()) {
            continue;
        }
        // Another process may have removed it meanwhile.
        let Ok(about) = entry.metadata() else { continue };
        let used = about.modified().unwrap_or(SystemTime::UNIX_EPOCH);
        all.push(Entry { used, path: entry.path(), bytes: about.len() });
    }
    Ok(all)
}

/// What is there.
pub(crate) fn contents(folder: &Path) -> io::Result<Contents> {
    let all = entries(folder)?;
    Ok(Contents { parts: all.len(), bytes: all.iter().map(|entry| entry.bytes).sum() })
}

/// Removes the parts that were not used for the longest time until the others fit; returns what is left, and what went.
pub(crate) fn shrink(folder: &Path, most_bytes: u64) -> io::Result<[Contents; 2]> {
    let mut all = entries(folder)?;
    all.sort_by(|a, b| a.used.cmp(&b.used).then_with(|| a.path.cmp(&b.path)));
    let mut left = Contents { parts: all.len(), bytes: all.iter().map(|entry| entry.bytes).sum() };
    let mut gone = Contents::default();
    for entry in all {
        if left.bytes <= most_bytes {
            break;
        }
        match fs::remove_file(&entry.path) {
            Ok(()) => {
                gone.parts += 1;
                gone.bytes += entry.bytes;
            }
            Err(e) if e.kind() == io::ErrorKind::NotFound => {}
            Err(e) => return Err(e),
        }
        left.parts -= 1;
        left.bytes -= entry.bytes;
    }
    Ok([left, gone])
}

/// Removes what dead processes have left half-written.
pub(crate) fn remove_leftovers(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if is_partial(&entry.file_name().to_string_lossy()) {
            remove_if_dead(&entry.path());
        }
    }
    Ok(())
}
