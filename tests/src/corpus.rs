//! Where tests find the real models. Tests that need them are left out without them.

use std::path::PathBuf;

use crate::need::{Need, leave_out};

fn folder() -> PathBuf {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/corpus");
    std::env::var_os("CLAYMILL_CORPUS").map_or_else(|| beside.into(), PathBuf::from)
}

/// The folder of real models: `$CLAYMILL_CORPUS`, else `../shared/corpus` beside the repository. `None` where there is
/// none: the calling test is left out.
#[must_use]
#[track_caller]
pub fn corpus() -> Option<PathBuf> {
    let folder = folder();
    if !folder.is_dir() {
        leave_out(Need::Corpus, format_args!("no corpus at {}", folder.display()));
        return None;
    }
    Some(folder)
}

/// A file of the corpus. `None` where it is not there: the calling test, or this part of it, is left out.
#[must_use]
#[track_caller]
pub fn corpus_file(name: &str) -> Option<PathBuf> {
    let path = folder().join(name);
    if !path.is_file() {
        leave_out(Need::Corpus, format_args!("no {}", path.display()));
        return None;
    }
    Some(path)
}
