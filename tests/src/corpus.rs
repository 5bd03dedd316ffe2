//! Where tests find the real models. Without them, tests that need them are skipped with a message.

use std::path::PathBuf;

/// The folder of real models: `$CLAYMILL_CORPUS`, else `../shared/corpus` beside the repository. `None`, with
/// a visible message, where there is none.
#[must_use]
pub fn corpus() -> Option<PathBuf> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/corpus");
    let folder = std::env::var_os("CLAYMILL_CORPUS").map_or_else(|| beside.into(), PathBuf::from);
    if !folder.is_dir() {
        eprintln!("skipped: no corpus at {}", folder.display());
        return None;
    }
    Some(folder)
}
