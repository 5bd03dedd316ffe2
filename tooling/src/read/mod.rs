//! Readers of tool libraries, and how a format is recognised.

mod archive;
mod fctb;
mod fields;
mod fusion;
mod length;
mod machine;
mod table;

use std::path::Path;

use claymill_toolpath::read_plain;
use serde_json::Value;

pub use length::LengthUnit;

use crate::error::{ToolingError, one_line};
use crate::library::{LIBRARY_FORMAT, Library, LibraryTool, MOST_TOOLS};
pub use machine::machine_from_freecad;

/// Library files are no longer than this, bytes, unpacked or not.
pub(crate) const LONGEST_FILE: u64 = 16 << 20;
/// Objects of a JSON file at most: ten thousand tools with presets and holders.
const MOST_OBJECTS: usize = 250_000;

/// A format of tool libraries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LibraryFormat {
    /// claymill's own, TOML.
    Own,
    /// Fusion, JSON.
    FusionJson,
    /// Fusion, a zip archive with such a JSON (`.tools`).
    FusionTools,
    /// FreeCAD tool bit (`.fctb`).
    FreeCadBit,
    /// LinuxCNC tool table (`tool.tbl`).
    ToolTable,
}

/// What a file does not say itself.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// Unit of a tool table, which is that of its machine.
    pub table_unit: LengthUnit,
}

/// A library as read. Every tool of the file is among the tools or among the skipped ones.
#[derive(Debug, Clone, PartialEq)]
pub struct LibraryReading {
    /// Format that was recognised.
    pub format: LibraryFormat,
    /// The tools.
    pub library: Library,
    /// What is no tool for milling surfaces, or makes no sense, with the reason.
    pub skipped: Vec<SkippedTool>,
    /// What was assumed, or taken over in part only.
    pub notes: Vec<String>,
}

/// A tool that was not taken over.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SkippedTool {
    /// Its name in the file, or its place.
    pub tool: String,
    /// Why.
    pub reason: String,
}

/// Reads a tool library of any known format.
///
/// # Errors
/// The file cannot be read, is of no known format, or is damaged. One tool that makes no sense is skipped by name, but in
/// claymill's own form it is an error.
pub fn read_library(path: &Path, options: &ReadOptions) -> Result<LibraryReading, ToolingError> {
    let bytes = read_plain(path, LONGEST_FILE)
        .map_err(|source| ToolingError::Io { path: path.to_owned(), source })?;
    parse_library(&bytes, path, options)
}

/// Reads a tool library from its bytes; `path` is for messages, and its extension decides between texts that have no
/// marks.
///
/// # Errors
/// As [`read_library`].
pub fn parse_library(
    bytes: &[u8],
    path: &Path,
    options: &ReadOptions,
) -> Result<LibraryReading, ToolingError> {
    if bytes.len() as u64 > LONGEST_FILE {
        return Err(ToolingError::TooMuch {
            path: path.into(),
            what: "bytes",
            most: usize::try_from(LONGEST_FILE).unwrap_or(usize::MAX),
        });
    }
    if bytes.starts_with(b"PK") {
        let mut gathered = Gathered::new(LibraryFormat::FusionTools);
        fusion::read(&json(&archive::the_json(bytes, path)?, path)?, path, &mut gathered)?;
        return Ok(gathered.reading);
    }
    let text = text(bytes, path)?;
    if text.trim_start().starts_with('{') {
        return read_json(&json(text, path)?, path);
    }
    let format = format_of_text(text, path)?;
    let mut gathered = Gathered::new(format);
    if format == LibraryFormat::ToolTable {
        table::read(text, path, options, &mut gathered)?;
    } else {
        gathered.reading.library = Library::parse(text, path)?;
    }
    Ok(gathered.reading)
}

fn read_json(file: &Value, path: &Path) -> Result<LibraryReading, ToolingError> {
    let has = |key: &str| file.get(key).is_some();
    let what = match () {
        () if has("data") => {
            let mut gathered = Gathered::new(LibraryFormat::FusionJson);
            fusion::read(file, path, &mut gathered)?;
            return Ok(gathered.reading);
        }
        () if has("parameter") => {
            let mut gathered = Gathered::new(LibraryFormat::FreeCadBit);
            fctb::read(file, path, &mut gathered)?;
            return Ok(gathered.reading);
        }
        () if has("machine") => "it is a FreeCAD machine, not a tool library",
        () => "it is JSON, but neither a Fusion library (`data`) nor a FreeCAD tool bit (`parameter`)",
    };
    Err(ToolingError::Format { path: path.to_owned(), what: what.to_owned() })
}

/// A JSON text as a value. Each object takes some hundred bytes, so they are counted before they are built.
fn json(text: &str, path: &Path) -> Result<Value, ToolingError> {
    if text.bytes().filter(|b| *b == b'{').count() > MOST_OBJECTS {
        return Err(ToolingError::TooMuch { path: path.into(), what: "JSON objects", most: MOST_OBJECTS });
    }
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    serde_json::from_str(text).map_err(|e| ToolingError::syntax(path, format!("no JSON: {e}")))
}

fn text<'b>(bytes: &'b [u8], path: &Path) -> Result<&'b str, ToolingError> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        ToolingError::syntax(path, format!("it is not text in UTF-8 (byte {})", e.valid_up_to()))
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// The format of a text that is no JSON, by content; the extension helps only where content says nothing.
fn format_of_text(text: &str, path: &Path) -> Result<LibraryFormat, ToolingError> {
    let unknown = |what: &str| ToolingError::Format { path: path.to_owned(), what: what.to_owned() };
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    match crate::form::stated(text) {
        Some(format) if format == LIBRARY_FORMAT => return Ok(LibraryFormat::Own),
        Some(format) => {
            return Err(unknown(&format!(
                "it states the format `{}`, which is no tool library",
                one_line(&format)
            )));
        }
        None => {}
    }
    if table::looks_like(text) {
        return Ok(LibraryFormat::ToolTable);
    }
    match extension.as_str() {
        // The reader says what is wrong, and where.
        "toml" => Ok(LibraryFormat::Own),
        "tbl" => Ok(LibraryFormat::ToolTable),
        _ => Err(unknown("it is of no tool library's format that is known")),
    }
}

/// The tools of a foreign file as they are read.
pub(crate) struct Gathered {
    pub(crate) reading: LibraryReading,
    ids: std::collections::BTreeSet<String>,
}

impl Gathered {
    fn new(format: LibraryFormat) -> Self {
        let library = Library::default();
        Gathered {
            reading: LibraryReading { format, library, skipped: vec![], notes: vec![] },
            ids: std::collections::BTreeSet::new(),
        }
    }

    /// Takes over what was read of a tool, if it makes sense, under an id of its own.
    pub(crate) fn add(&mut self, name: &str, read: Result<LibraryTool, String>) {
        let checked = read.and_then(|mut tool| {
            tool.id = self.free_id(&tool);
            tool.check().map(|()| tool).map_err(|fault| fault.what)
        });
        match checked {
            Ok(tool) => {
                self.ids.insert(tool.id.clone());
                self.reading.library.tools.push(tool);
            }
            Err(reason) => {
                self.reading.skipped.push(SkippedTool { tool: one_line(name), reason: one_reason(&reason) });
            }
        }
    }

    /// `T7` after the number, where there is one that is free, else the first free `N1`, `N2`, …
    fn free_id(&self, tool: &LibraryTool) -> String {
        let numbered = tool.number.map(|n| format!("T{n}")).filter(|id| !self.ids.contains(id));
        numbered.unwrap_or_else(|| format!("N{}", self.reading.library.tools.len() + 1))
    }

    pub(crate) fn note(&mut self, note: impl Into<String>) {
        if self.reading.notes.len() < 100 {
            self.reading.notes.push(note.into());
        }
    }

    /// Refuses files with more tools than any library has.
    pub(crate) fn bound(count: usize, path: &Path) -> Result<(), ToolingError> {
        if count > MOST_TOOLS {
            return Err(ToolingError::TooMuch { path: path.into(), what: "tools", most: MOST_TOOLS });
        }
        Ok(())
    }
}

/// A reason on one line, of at most 300 characters.
fn one_reason(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(300).collect()
}
