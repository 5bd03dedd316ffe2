//! `claymill store`: what a store of parts holds, and making it smaller.

use std::path::Path;
use std::process::ExitCode;

use claymill_store::{Contents, Store};
use serde::Serialize;

use super::Context;
use crate::args::{StoreArgs, StoreCommand};
use crate::console::{counted, outln};
use crate::failure::Failure;
use crate::reuse::MB;

/// What `claymill store --json` prints.
#[derive(Serialize)]
struct Summary {
    parts: usize,
    bytes: u64,
    removed_parts: usize,
    removed_bytes: u64,
}

/// `claymill store`.
pub(crate) fn store(context: &Context, args: &StoreArgs) -> Result<ExitCode, Failure> {
    let open = |folder: &Path| Store::open_existing(folder, Store::USUAL_LIMIT_BYTES);
    let (store, gone) = match &args.what {
        StoreCommand::Status { folder } => (open(folder)?, Contents::default()),
        StoreCommand::Clean { folder, to } => {
            let store = open(folder)?;
            let gone = store.shrink(to.saturating_mul(MB))?;
            (store, gone)
        }
    };
    let left = store.contents()?;
    if context.json {
        let Contents { parts, bytes } = left;
        let (removed_parts, removed_bytes) = (gone.parts, gone.bytes);
        context.print_json(&Summary { parts, bytes, removed_parts, removed_bytes })?;
        return Ok(ExitCode::SUCCESS);
    }
    let words = |Contents { parts, bytes }: Contents| {
        format!("{}, {:.1} MB", counted(parts, "part"), bytes as f64 / MB as f64)
    };
    if gone.parts > 0 {
        outln!("removed   {}", words(gone));
    }
    outln!("store     {}: {}", store.folder().display(), words(left));
    Ok(ExitCode::SUCCESS)
}
