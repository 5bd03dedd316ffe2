//! The tool library that is taken where none is given.

use std::path::Path;

use crate::library::Library;

const TOOLS: &str = include_str!("../data/tools.toml");

impl Library {
    /// The tools that are shipped: balls of 2 to 25 mm radius, flat and bull nose end mills, with holders and with cutting
    /// data for clay, foam and aluminium.
    #[must_use]
    pub fn shipped() -> Self {
        let read = Self::parse(TOOLS, Path::new("(shipped)/tools.toml"));
        debug_assert!(read.is_ok(), "{read:?}");
        read.unwrap_or_default()
    }
}
