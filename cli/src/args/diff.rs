//! What differs between a job's model and another one.

use std::path::PathBuf;

use clap::{Args, Subcommand};

#[derive(Debug, Args)]
pub(crate) struct DiffArgs {
    /// Job folder of the model as it was.
    pub(crate) job: PathBuf,
    /// The model as it is now: IGES, STEP or Rhino 3dm file.
    pub(crate) model: PathBuf,
    /// The job's model, where it is no longer where the job says.
    #[arg(long = "model", value_name = "FILE")]
    pub(crate) old_model: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct StoreArgs {
    #[command(subcommand)]
    pub(crate) what: StoreCommand,
}

#[derive(Debug, Subcommand)]
pub(crate) enum StoreCommand {
    /// How many parts a store holds, and what they take on the disk.
    Status {
        /// Folder of the store.
        folder: PathBuf,
    },
    /// Remove parts that were not used for the longest time.
    Clean {
        /// Folder of the store.
        folder: PathBuf,
        /// Leave so many MB.
        #[arg(long, default_value_t = 0, value_name = "MB")]
        to: u64,
    },
}
