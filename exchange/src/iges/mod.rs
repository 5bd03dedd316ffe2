//! The IGES reader.

use std::path::Path;

use crate::{Import, ReadError};

/// Reads an IGES file.
pub(crate) fn read(_bytes: &[u8], path: &Path) -> Result<Import, ReadError> {
    Err(ReadError::Unsupported {
        path: path.into(),
        what: "IGES".into(),
    })
}
