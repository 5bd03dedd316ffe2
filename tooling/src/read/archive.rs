//! The JSON inside a Fusion `.tools` file, which is a zip archive.

use std::io::{Cursor, Read};
use std::path::Path;

use super::LONGEST_FILE;
use crate::error::ToolingError;

/// Entries that an archive may have.
const MOST_ENTRIES: usize = 100;

/// The only entry of the archive whose name ends in `.json`, as text, unpacked to at most [`LONGEST_FILE`].
pub(super) fn the_json(bytes: &[u8], path: &Path) -> Result<String, ToolingError> {
    let damaged =
        |e: &dyn std::fmt::Display| ToolingError::syntax(path, format!("the zip archive is damaged: {e}"));
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|e| damaged(&e))?;
    if archive.len() > MOST_ENTRIES {
        return Err(ToolingError::TooMuch { path: path.into(), what: "entries", most: MOST_ENTRIES });
    }
    let names = archive.file_names().filter_map(|name| Some(name.ok()?.into_owned()));
    let names: Vec<String> = names.filter(|name| name.to_ascii_lowercase().ends_with(".json")).collect();
    let [name] = &names[..] else {
        let what = format!("the archive has {} JSON files, and a Fusion library has one", names.len());
        return Err(ToolingError::Format { path: path.to_owned(), what });
    };
    let entry = archive.by_name(name).map_err(|e| damaged(&e))?;
    let mut text = String::new();
    // What the archive says of the size is not believed.
    entry.take(LONGEST_FILE + 1).read_to_string(&mut text).map_err(|e| damaged(&e))?;
    if text.len() as u64 > LONGEST_FILE {
        return Err(ToolingError::TooMuch { path: path.into(), what: "MB unpacked", most: 16 });
    }
    Ok(text)
}
