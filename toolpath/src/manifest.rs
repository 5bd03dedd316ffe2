//! Which files of a folder claymill wrote, and what was in them: only those may be replaced.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::folder::io_error;
use crate::{FolderError, JOB_FILE, sha256_of};

/// Name of the list, in the form of `sha256sum`.
pub const MANIFEST_FILE: &str = "files.sha256";

/// What is in a folder, each path from the folder, in order.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Survey {
    /// Files as they were written.
    pub(crate) ours: Vec<PathBuf>,
    /// Files that were written and changed since.
    pub(crate) edited: Vec<PathBuf>,
    /// What somebody else put there.
    pub(crate) foreign: Vec<PathBuf>,
}

impl Survey {
    /// Looks at all that is in `folder`; nothing where it is not there.
    pub(crate) fn of(folder: &Path) -> Result<Self, FolderError> {
        let listed = read(folder)?;
        let mut found = Survey::default();
        for path in files_in(folder)? {
            if path == Path::new(MANIFEST_FILE) {
                continue;
            }
            match path.to_str().and_then(|name| listed.get(name)) {
                None => found.foreign.push(path),
                Some(hash) if sha256_of(&folder.join(&path)).is_ok_and(|h| h == *hash) => {
                    found.ours.push(path)
                }
                Some(_) => found.edited.push(path),
            }
        }
        Ok(found)
    }

    /// Refuses a folder in which something would be lost.
    pub(crate) fn replaceable(&self, folder: &Path) -> Result<(), FolderError> {
        if self.edited.is_empty() && self.foreign.is_empty() {
            return Ok(());
        }
        Err(FolderError::NotOurs {
            folder: folder.to_owned(),
            edited: self.edited.clone(),
            foreign: self.foreign.clone(),
        })
    }
}

/// The files of the list by name; none where there is no list.
fn read(folder: &Path) -> Result<BTreeMap<String, String>, FolderError> {
    let path = folder.join(MANIFEST_FILE);
    let text = match fs::read_to_string(&path) {
        Ok(text) => text,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(BTreeMap::new()),
        Err(e) => return Err(io_error(&path)(e)),
    };
    let line = |line: &str| line.split_once("  ").map(|(hash, name)| (name.to_owned(), hash.to_owned()));
    Ok(text.lines().filter_map(line).collect())
}

/// Whether all that claymill wrote into a folder lies there as it was written; what somebody else put there does not count.
#[must_use]
pub fn is_whole(folder: &Path) -> bool {
    let as_written =
        |(name, hash): (&String, &String)| sha256_of(&folder.join(name)).is_ok_and(|found| found == *hash);
    read(folder).is_ok_and(|listed| !listed.is_empty() && listed.iter().all(as_written))
}

/// Lists all files of a folder that was written whole.
pub(crate) fn write(folder: &Path) -> Result<(), FolderError> {
    let names = files_in(folder)?.into_iter().filter_map(|p| p.to_str().map(str::to_owned));
    put(folder, folder, names, BTreeMap::new())
}

/// Lists the files `names` anew, as they lie in `folder`; the list goes into `into`.
pub(crate) fn update(
    folder: &Path,
    into: &Path,
    names: impl Iterator<Item = String>,
) -> Result<(), FolderError> {
    put(folder, into, names, read(into)?)
}

fn put(
    folder: &Path,
    into: &Path,
    names: impl Iterator<Item = String>,
    mut listed: BTreeMap<String, String>,
) -> Result<(), FolderError> {
    for name in names.filter(|name| name != MANIFEST_FILE) {
        let hash = sha256_of(&folder.join(&name))?;
        listed.insert(name, hash);
    }
    let text: String = listed.iter().map(|(name, hash)| format!("{hash}  {name}\n")).collect();
    let path = into.join(MANIFEST_FILE);
    crate::write_whole(&path, text.as_bytes()).map_err(io_error(&path))
}

/// Whether files of a finished folder may be made anew: those that claymill wrote, and none that was changed since. A job of a
/// version without lists counts as written.
pub(crate) fn may_renew(folder: &Path, names: &[&str], computed: &[&str]) -> Result<(), FolderError> {
    let listed = read(folder)?;
    if listed.is_empty() && folder.join(JOB_FILE).exists() {
        return Ok(());
    }
    let mut survey = Survey::default();
    for name in names.iter().filter(|name| !computed.contains(name)) {
        let path = folder.join(name);
        match listed.get(*name) {
            _ if fs::symlink_metadata(&path).is_err() => {}
            None => survey.foreign.push(name.into()),
            Some(hash) if sha256_of(&path).is_ok_and(|h| h == *hash) => {}
            Some(_) => survey.edited.push(name.into()),
        }
    }
    survey.replaceable(folder)
}

/// The names on the list of a folder.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    read(folder).unwrap_or_default().into_keys().collect()
}

/// All that is not a folder, from `folder`, in order; empty folders count as things too.
fn files_in(folder: &Path) -> Result<Vec<PathBuf>, FolderError> {
    let mut found = Vec::new();
    let mut open = vec![PathBuf::new()];
    while let Some(inner) = open.pop() {
        let here = folder.join(&inner);
        let entries = match fs::read_dir(&here) {
            Err(e) if e.kind() == io::ErrorKind::NotFound && inner.as_os_str().is_empty() => {
                return Ok(found);
            }
            entries => entries.map_err(io_error(&here))?,
        };
        let mut any = false;
        for entry in entries {
            let entry = entry.map_err(io_error(&here))?;
            any = true;
            let path = inner.join(entry.file_name());
            // Links are things of their own, wherever they lead.
            if entry.file_type().map_err(io_error(&here))?.is_dir() {
                open.push(path);
            } else {
                found.push(path);
            }
        }
        if !any && !inner.as_os_str().is_empty() {
            found.push(inner);
        }
    }
    found.sort();
    Ok(found)
}

/// Removes from `folder` what is ours; whether nothing else was in it, and it went too.
pub(crate) fn remove_ours(folder: &Path) -> Result<bool, FolderError> {
    let survey = Survey::of(folder)?;
    if survey.edited.is_empty() && survey.foreign.is_empty() {
        fs::remove_dir_all(folder).map_err(io_error(folder))?;
        return Ok(true);
    }
    for path in survey.ours.iter().map(PathBuf::as_path).chain([Path::new(MANIFEST_FILE)]) {
        // What stays is kept anyway.
        let _ = fs::remove_file(folder.join(path));
    }
    Ok(false)
}
