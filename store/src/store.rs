//! The store: a folder of parts.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use claymill_toolpath::{PartKey, PartStore};

use crate::contents::{Contents, contents, remove_leftovers, shrink};
use crate::error::{StoreError, Trouble};
use crate::part_file::{self, FORM, path_of};

/// Says what the folder is.
const MARK_FILE: &str = "STORE";
const MARK: &str = "claymill parts, form ";
/// A store that is too large shrinks to this share of its limit, so that it does not do so again at once.
const SHRUNK: f64 = 0.9;

/// A folder that keeps parts; see the crate's documentation.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    limit_bytes: u64,
    /// About what it holds: other processes may add to it.
    bytes: AtomicU64,
    is_full: AtomicBool,
    troubles: Mutex<Vec<Trouble>>,
}

impl Store {
    /// Beyond this, parts that were not used for the longest time go: a few hundred plans of a car.
    pub const USUAL_LIMIT_BYTES: u64 = 8 << 30;

    /// Opens a store. A folder that is not there, or is empty, becomes one; what dead processes have left half-written is
    /// removed.
    ///
    /// # Errors
    /// The folder cannot be made or read, holds something else, or was made by another version.
    pub fn open(folder: &Path, limit_bytes: u64) -> Result<Self, StoreError> {
        fs::create_dir_all(folder).map_err(StoreError::io(folder))?;
        Store::begin(folder)?;
        Store::of(folder, limit_bytes)
    }

    /// Opens a store that is there.
    ///
    /// # Errors
    /// The folder cannot be read, or is no store of this version.
    pub fn open_existing(folder: &Path, limit_bytes: u64) -> Result<Self, StoreError> {
        Store::of(folder, limit_bytes)
    }

    /// Marks a folder that is still empty.
    fn begin(folder: &Path) -> Result<(), StoreError> {
        let io = |e| StoreError::io(folder)(e);
        let mut names = fs::read_dir(folder).map_err(io)?.map(|entry| Ok(entry?.file_name()));
        if names.next().transpose().map_err(|e: io::Error| io(e))?.is_some() {
            return Ok(());
        }
        // In one piece: another process may be looking at it.
        let (mark, beside) =
            (folder.join(MARK_FILE), folder.join(format!(".{MARK_FILE}.{}", std::process::id())));
        let mut file = fs::File::create(&beside).map_err(StoreError::io(&beside))?;
        let written = writeln!(file, "{MARK}{FORM}").and_then(|()| fs::rename(&beside, &mark));
        written.map_err(|e| {
            let _ = fs::remove_file(&beside);
            StoreError::io(&mark)(e)
        })
    }

    fn of(folder: &Path, limit_bytes: u64) -> Result<Self, StoreError> {
        let mark = folder.join(MARK_FILE);
        let text = match fs::read_to_string(&mark) {
            Ok(text) => text,
            Err(e) if e.kind() == io::ErrorKind::NotFound => {
                return Err(StoreError::Foreign { path: folder.to_owned() });
            }
            Err(e) => return Err(StoreError::io(&mark)(e)),
        };
        let found = text.trim().strip_prefix(MARK);
        let found = found.ok_or_else(|| StoreError::Foreign { path: folder.to_owned() })?;
        if found != FORM.to_string() {
            let path = folder.to_owned();
            return Err(StoreError::Version { path, found: format!("form {found}"), read: FORM });
        }
        remove_leftovers(folder).map_err(StoreError::io(folder))?;
        let bytes = contents(folder).map_err(StoreError::io(folder))?.bytes;
        Ok(Store {
            folder: folder.to_owned(),
            limit_bytes,
            bytes: AtomicU64::new(bytes),
            is_full: AtomicBool::new(false),
            troubles: Mutex::default(),
        })
    }

    /// Where it is.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What it holds now.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub fn contents(&self) -> Result<Contents, StoreError> {
        contents(&self.folder).map_err(StoreError::io(&self.folder))
    }

    /// Removes the parts that were not used for the longest time, until the others take no more than this; returns what went.
    ///
    /// # Errors
    /// A part cannot be removed.
    pub fn shrink(&self, most_bytes: u64) -> Result<Contents, StoreError> {
        let [left, gone] = shrink(&self.folder, most_bytes).map_err(StoreError::io(&self.folder))?;
        self.bytes.store(left.bytes, Ordering::Relaxed);
        Ok(gone)
    }

    /// What went wrong since this was asked the last time.
    pub fn troubles(&self) -> Vec<Trouble> {
        std::mem::take(&mut *self.troubles.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn say(&self, trouble: Trouble) {
        self.troubles.lock().unwrap_or_else(PoisonError::into_inner).push(trouble);
    }
}

impl PartStore for Store {
    fn get(&self, key: &PartKey) -> Option<Vec<u8>> {
        part_file::read(&self.folder, key).unwrap_or_else(|damage| {
            let path = path_of(&self.folder, key);
            // Otherwise the part that is computed instead would find its place taken.
            let _ = fs::remove_file(&path);
            self.say(Trouble::Damaged { path, damage });
            None
        })
    }

    fn has(&self, key: &PartKey) -> bool {
        path_of(&self.folder, key).exists()
    }

    fn put(&self, key: &PartKey, payload: &[u8]) {
        let path = path_of(&self.folder, key);
        if self.is_full.load(Ordering::Relaxed) || path.exists() {
            return;
        }
        match part_file::write(&self.folder, key, payload) {
            Ok(bytes) => {
                let all = self.bytes.fetch_add(bytes, Ordering::Relaxed) + bytes;
                if all > self.limit_bytes {
                    // What cannot be removed is tried again with the next part.
                    let _ = self.shrink((SHRUNK * self.limit_bytes as f64) as u64);
                }
            }
            // Another thread is writing it.
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
            Err(source) => {
                // Once: the next part would fare no better.
                if !self.is_full.swap(true, Ordering::Relaxed) {
                    self.say(Trouble::NotKept { path, source });
                }
            }
        }
    }
}
