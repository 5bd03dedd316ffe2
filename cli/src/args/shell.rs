//! What is asked for of the shell's completions and of the manual.

use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;

#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell that completes.
    pub(crate) shell: Shell,
}

#[derive(Debug, Args)]
pub(crate) struct ManArgs {
    /// Folder of the pages, one a command. It is made where it is not there.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: PathBuf,
}
