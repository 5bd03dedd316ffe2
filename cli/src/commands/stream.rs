//! `claymill stream`: sends a job record by record to a queue in shared memory or over TCP, or
//! block by block to LinuxCNC. It can begin at any move and replace a stream that runs.

use std::hash::{BuildHasher, RandomState};
use std::path::Path;
use std::process::ExitCode;
use std::thread::sleep;
use std::time::{Duration, Instant};

use claymill_controller::{
    Coolant, Machine, MachineJob, Order, Path as PathRecord, Producer, QueueError, Record, Remote,
    RemoteError, Route, Sender, WireError, blocks_of, retreat_of, tell,
};
use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::{Move, Program, TOOLPATHS_FILE, sha256_of};

use super::{Context, post};
use crate::args::StreamArgs;
use crate::clearance::cleared;
use crate::failure::{Failure, advice_on};
use crate::secret::secret;

/// Bytes of a queue in memory.
pub(crate) const QUEUE_BYTES: u64 = 1 << 20;
/// A machine comes to rest within this time.
const BRAKES: Duration = Duration::from_secs(20);
/// A broken connection is tried again this often.
const RETRY: Duration = Duration::from_millis(300);

impl From<QueueError> for Failure {
    fn from(error: QueueError) -> Self {
        let advice = match &error {
            QueueError::Dropped => "Say --restart, and --from SEQ, to begin anew.",
            QueueError::Silent(_) => "Start `claymill control --queue` with this queue, then say it again.",
            QueueError::Taken => "One controller at a time: end the other one, or choose another queue.",
            QueueError::Written => {
                "Wait until it has ended, or say --restart: the machine comes to rest and drops that stream."
            }
            QueueError::Unfinished => {
                "Stream that one again, and it goes on; or say --restart: the machine comes to rest and drops it."
            }
            QueueError::Foreign { .. } => {
                "Nothing was changed. Choose a path where claymill may make a new file, for you alone (mode 0600)."
            }
            QueueError::Open { source, .. } => advice_on(source),
            QueueError::Record { .. } => "Plan the job again.",
            QueueError::Io(_) | QueueError::Format(_) => {
                "Check the queue's path, or remove the file to begin anew."
            }
        };
        Failure::problem(&error, advice)
    }
}

impl From<RemoteError> for Failure {
    fn from(error: RemoteError) -> Self {
        Failure::problem(&error, "Is linuxcncrsh running there, with the machine's emergency stop released?")
    }
}

impl From<WireError> for Failure {
    fn from(error: WireError) -> Self {
        let advice = match &error {
            WireError::Busy(_) => {
                "Wait until it has ended, or say --restart: the machine comes to rest and drops that stream."
            }
            WireError::Refused(_) => "Plan the job again, with the claymill that runs the machine.",
            WireError::Dropped => "Say --restart, and --from SEQ, to begin anew.",
            _ => "Check the address, and that both sides have the same --secret.",
        };
        Failure::problem(&error, advice)
    }
}

/// `claymill stream`.
pub(crate) fn stream(context: &Context, args: &StreamArgs) -> Result<ExitCode, Failure> {
    let (kind, place) = args.to.split_once(':').ok_or_else(|| {
        Failure::usage(
            format!("`{}` is no target", args.to),
            "Write linuxcnc:HOST:PORT, shm:FILE or tcp:HOST:PORT.",
        )
    })?;
    if kind != "shm" {
        near(place, args.remote)?;
    }
    if args.plunge.is_some_and(|mm| !(mm.is_finite() && mm > 0.0)) {
        return Err(Failure::usage("--plunge needs a height above 0", "For example --plunge 20."));
    }
    let cleared = cleared(context, &args.folder, args.unverified)?;
    let (job, program) = (cleared.job(), cleared.program());
    let wanted = |m: &Move| m.seq >= args.from && args.region.is_none_or(|r| r == m.region);
    if !program.moves.iter().any(wanted) {
        return Err(Failure::usage("no move is left to stream", "Check --from and --region."));
    }
    let machine = post::placed(post::machine(args.machine.as_deref())?, &args.place, job)?;
    let routed = |stands: Option<(Point3, Vector3)>| {
        let route = Route::new(job, program, wanted, stands, args.plunge);
        if let Some(approach) = &route.approach {
            context.console.say(format!("approach  {approach}"));
        }
        route
    };
    match kind {
        "linuxcnc" => {
            let moves = Program { moves: routed(None).moves };
            let lift_mm = job.tolerances.get("clearance_mm").copied();
            let job = MachineJob::new(job.clone(), &moves, &machine)?;
            let dialect = post::dialect("linuxcnc", args.version.as_deref())?;
            let blocks = blocks_of(&job, dialect, &machine)?;
            let mut remote = Remote::connect(place)?;
            if args.restart {
                remote.abort(BRAKES)?;
                let stands = remote.work_position()?;
                let retreat = |z_mm| retreat_of(&job, dialect, &machine, z_mm, lift_mm);
                linuxcnc(context, &mut remote, &stands.map_or_else(Vec::new, |p| retreat(p.z)))?;
            }
            linuxcnc(context, &mut remote, &blocks)?;
        }
        "shm" => {
            let mut queue = Producer::open(Path::new(place), QUEUE_BYTES)?;
            let (name, stands) =
                if args.restart { (fresh_name(), queue.recall()?) } else { (name(args)?, None) };
            to_queue(context, &mut queue, &Stream::new(&routed(stands), &machine)?, name)?;
        }
        "tcp" => {
            let secret = secret(args.secret.as_deref())?;
            let stands = match args.restart {
                true => tell(place, &secret, Some(Order::Discard))?.place,
                false => None,
            };
            let name = if args.restart { fresh_name() } else { name(args)? };
            let stream = Stream::new(&routed(stands), &machine)?;
            to_machine(context, place, &secret, &stream, name, args.restart)?;
        }
        other => {
            let advice = "Write linuxcnc:HOST:PORT, shm:FILE or tcp:HOST:PORT.";
            return Err(Failure::usage(format!("`{other}` is no kind of target"), advice));
        }
    }
    context.console.finish();
    Ok(ExitCode::SUCCESS)
}

/// Refuses another machine unless that was said.
pub(crate) fn near(place: &str, remote: bool) -> Result<(), Failure> {
    if remote || is_local(place) {
        return Ok(());
    }
    Err(Failure::usage(
        format!("{place} is another machine"),
        "Say --remote if a program may move a machine that stands elsewhere.",
    ))
}

pub(crate) fn is_local(place: &str) -> bool {
    ["localhost:", "127.0.0.1:", "[::1]:"].iter().any(|local| place.starts_with(local))
}

/// A stream's name: the same moves of the same job go on where they stopped, others begin anew.
fn name(args: &StreamArgs) -> Result<u64, Failure> {
    let hash = sha256_of(&args.folder.join(TOOLPATHS_FILE))?;
    let moves = u64::from_str_radix(&hash[..16], 16).unwrap_or(1);
    let part = args.region.map_or(0, |r| r as u64 + 1).rotate_left(32) ^ args.from;
    Ok((moves ^ part).max(1))
}

/// A name that no other stream has: what was dropped does not come again under its own.
fn fresh_name() -> u64 {
    RandomState::new().hash_one(std::process::id()).max(1)
}

fn linuxcnc(context: &Context, remote: &mut Remote, blocks: &[String]) -> Result<(), Failure> {
    context.console.stage("streaming");
    let begun = Instant::now();
    for (i, block) in blocks.iter().enumerate() {
        remote.mdi(block)?;
        context.console.at("streaming", i as f64 / blocks.len() as f64);
    }
    remote.settle(Duration::from_secs(3600), |_| ())?;
    if let Some(error) = remote.error()? {
        return Err(Failure::problem(format!("LinuxCNC: {error}"), "The machine may stand on the path."));
    }
    let seconds = begun.elapsed().as_secs_f64();
    context
        .console
        .say(format!("streamed  {} blocks in {seconds:.1} s; the machine stands still", blocks.len()));
    Ok(())
}

/// The records of a route: where it leads up from where the machine stands, that first; tool, spindle and coolant before
/// the other moves, a change of tool between them, everything off and the end behind them.
struct Stream {
    records: Vec<Record>,
}

impl Stream {
    fn new(route: &Route, machine: &Machine) -> Result<Self, Failure> {
        let turn = if machine.spindle.counterclockwise { -1.0 } else { 1.0 };
        let mut records = Vec::with_capacity(route.moves.len() + 8);
        let mut tool = None;
        for (i, m) in route.moves.iter().enumerate() {
            if i >= route.departs && tool != Some(&m.tool) {
                if tool.is_some() {
                    records.push(Record::Spindle(0.0));
                }
                tool = Some(&m.tool);
                records.push(Record::Tool(machine.tool_number(&m.tool)));
                if machine.speed_rpm(&m.tool) > 0.0 {
                    records.push(Record::Spindle(turn * machine.speed_rpm(&m.tool)));
                }
                if machine.coolant != Coolant::Off {
                    records.push(Record::Coolant(true));
                }
            }
            let mut path = PathRecord::of(m).map_err(|e| Failure::problem(e, "Plan the job again."))?;
            path.feed = path.feed.min(machine.feed.of(m.kind));
            records.push(Record::Path(Box::new(path)));
        }
        if machine.coolant != Coolant::Off {
            records.push(Record::Coolant(false));
        }
        if tool.is_some_and(|tool| machine.speed_rpm(tool) > 0.0) {
            records.push(Record::Spindle(0.0));
        }
        records.push(Record::End);
        Ok(Stream { records })
    }

    fn len(&self) -> u64 {
        self.records.len() as u64
    }

    fn encode(&self, seq: u64, out: &mut Vec<u8>) {
        out.clear();
        self.records.get(seq as usize).unwrap_or(&Record::End).encode(seq, out);
    }
}

fn to_queue(context: &Context, queue: &mut Producer, stream: &Stream, name: u64) -> Result<(), Failure> {
    context.console.stage("streaming");
    let count = stream.len();
    let mut silent = false;
    let mut waits = |error: QueueError| match error {
        QueueError::Silent(_) => {
            if !std::mem::replace(&mut silent, true) {
                context.console.say("waiting   nobody takes records from the queue");
            }
            Ok(())
        }
        other => Err(other),
    };
    let mut record = Vec::new();
    let begun = queue.resume(name)?;
    let last = queue.next() - begun + count;
    for seq in begun..count {
        stream.encode(seq, &mut record);
        while let Err(error) = queue.push(&record) {
            waits(error)?;
        }
        context.console.at("streaming", seq as f64 / count as f64);
    }
    while let Err(error) = queue.flush() {
        waits(error)?;
    }
    while queue.done()? < last {
        queue.beat()?;
        sleep(Duration::from_millis(5));
    }
    context.console.say(format!("streamed  {count} records; all are done"));
    Ok(())
}

fn to_machine(
    context: &Context,
    address: &str,
    secret: &[u8],
    stream: &Stream,
    name: u64,
    restart: bool,
) -> Result<(), Failure> {
    context.console.stage("streaming");
    let count = stream.len();
    let mut record = Vec::new();
    let mut held = restart;
    loop {
        let mut attempt = || -> Result<(), WireError> {
            let mut sender = Sender::connect(address, secret, name)?;
            if held {
                tell(address, secret, Some(Order::Run))?;
                held = false;
            }
            for seq in sender.next()..count {
                stream.encode(seq, &mut record);
                sender.send(&record)?;
                context.console.at("streaming", seq as f64 / count as f64);
            }
            sender.confirm()
        };
        match attempt() {
            Ok(()) => break,
            Err(WireError::Io(e)) => {
                context.console.say(format!("waiting   {e}"));
                sleep(RETRY);
            }
            Err(error) => return Err(error.into()),
        }
    }
    context.console.say(format!("streamed  {count} records into the machine's queue"));
    Ok(())
}
