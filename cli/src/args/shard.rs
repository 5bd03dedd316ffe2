//! A plan in shards, for many machines.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

use super::OneJob;

#[derive(Debug, Args)]
pub(crate) struct ShardArgs {
    #[command(subcommand)]
    pub(crate) what: ShardCommand,
}

#[derive(Debug, Subcommand)]
pub(crate) enum ShardCommand {
    /// Read a model, decide what each setup cuts, and list the shards of its plan in a work folder.
    Open(Box<OpenArgs>),
    /// Lay the passes of shards. Exit codes: 0 done, 1 the model or the job has a problem, 75 try again, 76 try again with more
    /// memory, 130 interrupted.
    Run {
        /// Work folder.
        folder: PathBuf,
        /// Shards, as in 3 or 4-9,12 [default: that of the array task: SLURM_ARRAY_TASK_ID or HQ_TASK_ID].
        shards: Vec<String>,
    },
    /// Which shards are done, from the files in the work folder alone.
    Status {
        /// Work folder.
        folder: PathBuf,
        /// Print the shards that are not done, and nothing else.
        #[arg(long)]
        missing: bool,
        /// How the shards are printed.
        #[arg(long = "as", value_enum, default_value_t = ListForm::Ranges, requires = "missing")]
        form: ListForm,
    },
    /// Join the shards to the job folder that `plan` would have written, and verify it.
    Join {
        /// Work folder.
        folder: PathBuf,
        /// Job folder to write.
        #[arg(short, long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Write the file that hands the shards and their join to an engine; read it before you run it.
    Script {
        /// Work folder.
        folder: PathBuf,
        /// The engine.
        #[arg(long = "for", value_enum, value_name = "ENGINE")]
        engine: Engine,
        /// Job folder that the join writes [default: `job` in the work folder].
        #[arg(short, long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Processor cores of a shard.
        #[arg(long, default_value_t = 2, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
        cores: u32,
    },
}

#[derive(Debug, Args)]
pub(crate) struct OpenArgs {
    /// IGES, STEP or Rhino 3dm file. It stays where it is, and has to be readable there for every shard.
    pub(crate) model: PathBuf,
    /// Work folder: the list of shards, the job, and their results.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Take the job from this TOML file; options on the command line go before it.
    #[arg(long = "job", value_name = "FILE")]
    pub(crate) job_file: Option<PathBuf>,
    /// Parts are put together until a shard takes about so many minutes on one core.
    #[arg(long, default_value_t = 10.0, value_name = "MIN", allow_negative_numbers = true)]
    pub(crate) minutes: f64,
    #[command(flatten)]
    pub(crate) job: OneJob,
}

/// How a list of shards is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ListForm {
    /// 3,17,40-44: as Slurm and HyperQueue take it behind --array.
    Ranges,
    /// One number a line.
    Lines,
    /// A JSON array.
    Json,
}

/// What runs shards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Engine {
    Slurm,
    Hyperqueue,
    Snakemake,
    /// A template of Open Job Description, for render farms.
    Openjd,
    /// GNU parallel.
    Parallel,
}
