//! Where parts of plans are kept.

use std::path::PathBuf;

use clap::Args;

pub(super) const REUSE: &str = "Reuse";

/// Where the parts of a plan are kept.
#[derive(Debug, Clone, Default, Args)]
pub(crate) struct ReuseArgs {
    /// Keep the parts of the plan in this folder, and take from it what is known: a plan that was ended goes on, one of a
    /// model that was changed computes what is new [default: .claymill-store beside the job folder, where there is one].
    #[arg(help_heading = REUSE, long, value_name = "DIR", conflicts_with = "no_store")]
    pub(crate) store: Option<PathBuf>,
    /// Keep nothing and take nothing.
    #[arg(help_heading = REUSE, long)]
    pub(crate) no_store: bool,
    /// Most that the store may take on the disk, in MB: parts that were not used for the longest time go [default: 8590].
    #[arg(help_heading = REUSE, long, value_name = "MB", conflicts_with = "no_store")]
    pub(crate) store_limit: Option<u64>,
}

impl ReuseArgs {
    /// Nothing is kept.
    pub(crate) fn nowhere() -> Self {
        ReuseArgs { no_store: true, ..ReuseArgs::default() }
    }
}
