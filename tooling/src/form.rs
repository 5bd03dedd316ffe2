//! What all of claymill's own files of this crate begin with: `format` and `version`.

use std::path::Path;

use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::error::{ToolingError, one_line};

/// The first two fields.
#[derive(Deserialize)]
struct Head {
    format: Option<String>,
    version: Option<toml::Value>,
}

/// The format that a TOML text states, if it states one.
pub(crate) fn stated(text: &str) -> Option<String> {
    toml::from_str::<Head>(text).ok()?.format
}

/// Reads a TOML text of a format and version.
pub(crate) fn parse<T: DeserializeOwned>(
    text: &str,
    path: &Path,
    format: &'static str,
    version: u64,
) -> Result<T, ToolingError> {
    let head: Head = toml::from_str(text).map_err(|e| ToolingError::syntax(path, e))?;
    match head.format.as_deref() {
        Some(found) if found == format => {}
        Some(found) => {
            let what = format!("it states the format `{}`, not `{format}`", one_line(found));
            return Err(ToolingError::Format { path: path.to_owned(), what });
        }
        None => {
            let what = format!("it states no format; the first line must be format = \"{format}\"");
            return Err(ToolingError::Format { path: path.to_owned(), what });
        }
    }
    if head.version.as_ref().and_then(toml::Value::as_integer).and_then(|v| u64::try_from(v).ok())
        != Some(version)
    {
        let found = head.version.map_or_else(|| "(none)".to_owned(), |v| one_line(&v.to_string()));
        return Err(ToolingError::Version { path: path.to_owned(), format, found, known: version });
    }
    toml::from_str(text).map_err(|e| ToolingError::syntax(path, e))
}
