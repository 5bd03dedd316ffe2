//! The command as users have it: the built binary, real files, exit codes.

mod animate;
mod auto;
mod bad_input;
mod bad_pictures;
mod bounds;
mod browser;
mod compare;
mod compare_again;
mod corpus;
mod damaged_job;
mod elementary;
mod ends;
mod export;
mod flaws;
mod golden;
mod holder;
#[path = "../../../exchange/tests/it/iges_text/mod.rs"]
mod iges_text;
mod keeping;
mod kills;
mod large;
mod left_out;
mod levels;
mod machine;
mod manual;
mod material;
mod mirror;
mod obstacle;
mod operations;
mod other_formats;
mod post;
mod prototype;
mod public_form;
mod queue;
#[path = "../../../controller/tests/it/records/mod.rs"]
mod records;
mod rest;
mod rest_above;
mod reuse;
mod roadster;
mod run;
mod shank;
mod shank_in_stock;
mod shards;
mod sides;
#[cfg(unix)]
mod slurm;
mod standing;
mod steep;
mod stock_file;
mod tilted;
mod times;
mod tools;
#[cfg(feature = "window")]
mod trace;
mod view;
mod whole_job;

/// A folder that goes when its test ends.
fn scratch() -> tempfile::TempDir {
    tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("a folder for the test")
}
