//! Controls and machines.

use std::path::PathBuf;

use clap::Args;

#[derive(Debug, Args)]
pub(crate) struct StreamArgs {
    /// Job folder.
    pub(crate) folder: PathBuf,
    /// linuxcnc:HOST:PORT, shm:FILE (a queue in memory, for example shm:/dev/shm/mill) or tcp:HOST:PORT.
    #[arg(long, value_name = "TARGET")]
    pub(crate) to: String,
    /// Begin at this move: over the clearance height, down by the lead-in of the job before it or, where there is none,
    /// straight down at the feed of leads. A rapid, a link or a lead-out is passed over, to the cut behind it.
    #[arg(long, value_name = "SEQ", default_value_t = 0, allow_negative_numbers = true)]
    pub(crate) from: u64,
    /// First come to rest and drop what the machine was doing, then go up from there: at the feed of leads, then
    /// rapidly to the clearance height. LinuxCNC is told to abort, which stops its spindle until the tool is up. Without
    /// it, another stream that has not ended is not displaced.
    #[arg(long)]
    pub(crate) restart: bool,
    /// Come down rapidly to this height above a cut that has no lead-in, mm. Without it the whole way from the clearance
    /// height is at the feed of leads, since nobody looked at what stands beside it.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) plunge: Option<f64>,
    /// Only this region.
    #[arg(long, value_name = "ID", allow_negative_numbers = true)]
    pub(crate) region: Option<usize>,
    /// Machine definition (TOML), for linuxcnc.
    #[arg(long, value_name = "FILE")]
    pub(crate) machine: Option<PathBuf>,
    /// Version of LinuxCNC: 2.9 or 2.10 [default: 2.9].
    #[arg(long, value_name = "VERSION")]
    pub(crate) version: Option<String>,
    /// File with the secret that both sides share, for tcp.
    #[arg(long, value_name = "FILE")]
    pub(crate) secret: Option<PathBuf>,
    /// The target may be another machine.
    #[arg(long)]
    pub(crate) remote: bool,
    /// Run a job that did not pass verification, or whose verdict belongs to other moves.
    #[arg(long)]
    pub(crate) unverified: bool,
    #[command(flatten)]
    pub(crate) place: PlaceArgs,
}

/// Where the job's tools and setups are on the machine.
#[derive(Debug, Args)]
pub(crate) struct PlaceArgs {
    /// Number of the tool in the machine; of several T1=12. May be repeated [default: that of its id in the job].
    #[arg(long, value_name = "[TOOL=]NUMBER")]
    pub(crate) tool_number: Vec<String>,
    /// Work offset, for example G55 (Heidenhain: the preset's number); of one setup left=G55. May be repeated
    /// [default: G54].
    #[arg(long, value_name = "[SETUP=]OFFSET")]
    pub(crate) work_offset: Vec<String>,
    /// Spindle speed, 1/min [default: none is written].
    #[arg(long, value_name = "RPM")]
    pub(crate) spindle: Option<f64>,
}

#[derive(Debug, Args)]
pub(crate) struct ControlArgs {
    /// The queue's file, for example /dev/shm/mill: new, or a queue of yours that nobody else may touch.
    #[arg(long, value_name = "FILE")]
    pub(crate) queue: PathBuf,
    /// Take connections at this address into the queue.
    #[arg(long, value_name = "HOST:PORT", requires = "secret")]
    pub(crate) listen: Option<String>,
    /// File with the secret that both sides share.
    #[arg(long, value_name = "FILE")]
    pub(crate) secret: Option<PathBuf>,
    /// Other machines may connect.
    #[arg(long)]
    pub(crate) remote: bool,
    /// Machine definition (TOML): its dynamics count.
    #[arg(long, value_name = "FILE")]
    pub(crate) machine: Option<PathBuf>,
    /// Stop after every path until told to run.
    #[arg(long)]
    pub(crate) step: bool,
    /// Begin at rest, until told to run.
    #[arg(long)]
    pub(crate) hold: bool,
    /// Do not keep to real time.
    #[arg(long)]
    pub(crate) fast: bool,
}

#[derive(Debug, Args)]
pub(crate) struct OrderArgs {
    /// hold: come to rest on the path. run: go on. step: go on to the end of the path. abort: come to rest and leave;
    /// what was not done stays in the queue. discard: come to rest and drop the path and all that waits, a fault
    /// with it. status: none.
    pub(crate) order: String,
    /// Address of `claymill control --listen`.
    #[arg(long, value_name = "HOST:PORT")]
    pub(crate) to: String,
    /// File with the secret that both sides share.
    #[arg(long, value_name = "FILE")]
    pub(crate) secret: PathBuf,
    /// The target may be another machine.
    #[arg(long)]
    pub(crate) remote: bool,
}

#[derive(Debug, Args)]
pub(crate) struct PostArgs {
    /// Job folder.
    pub(crate) folder: PathBuf,
    /// fanuc, mitsubishi, siemens, heidenhain, linuxcnc, beckhoff, g1, apt, apt-creo or step-nc.
    #[arg(long, value_name = "DIALECT")]
    pub(crate) to: String,
    /// Program to write; - for standard output.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Machine definition (TOML).
    #[arg(long, value_name = "FILE")]
    pub(crate) machine: Option<PathBuf>,
    /// Version of LinuxCNC: 2.9 or 2.10 [default: 2.9].
    #[arg(long, value_name = "VERSION")]
    pub(crate) version: Option<String>,
    /// Write setups off the axes by the control's tilted plane: siemens, fanuc and heidenhain. The part stays as it stands
    /// in the setup from above. The machine definition may say so too.
    #[arg(long)]
    pub(crate) tilt: bool,
    /// Run the program on a virtual control too: cut error, feed and time go into the totals.
    #[arg(long)]
    pub(crate) simulate: bool,
    /// Write a job that did not pass verification, or whose verdict belongs to other moves. The program says so.
    #[arg(long)]
    pub(crate) unverified: bool,
    #[command(flatten)]
    pub(crate) place: PlaceArgs,
}

#[derive(Debug, Args)]
pub(crate) struct SimulateArgs {
    /// Job folder that the program was written from.
    pub(crate) folder: PathBuf,
    /// The program. May be repeated for a program of several files, in order.
    #[arg(long, value_name = "FILE", required = true)]
    pub(crate) program: Vec<PathBuf>,
    /// The program's dialect, where its header does not name it.
    #[arg(long, value_name = "DIALECT")]
    pub(crate) dialect: Option<String>,
    /// The machine definition (TOML) that the program was written with.
    #[arg(long, value_name = "FILE")]
    pub(crate) machine: Option<PathBuf>,
}
