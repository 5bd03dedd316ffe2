//! The STEP reader.

use std::path::Path;

use crate::{Import, ReadError};

/// Reads a STEP Part 21 file.
pub(crate) fn read(_bytes: &[u8], path: &Path) -> Result<Import, ReadError> {
    Err(ReadError::Unsupported {
        path: path.into(),
        what: "STEP".into(),
    })
}
