use std::io::{BufRead, Write};
use std::net::TcpListener;
use std::process::ExitCode;
use std::sync::atomic::{AtomicU8, Ordering};

use claymill_controller::{Consumer, Ended, Event, Order, Producer, Reference, ReferenceError, serve};

use super::stream::{QUEUE_BYTES, is_local, secret};
use super::{Context, post};
use crate::args::ControlArgs;
use crate::console::outln;
use crate::failure::{Failure, advice_on};

/// What the standard input last ordered.
static ORDER: AtomicU8 = AtomicU8::new(RUN);
const RUN: u8 = 0;
const HOLD: u8 = 1;
const ABORT: u8 = 2;

impl From<ReferenceError> for Failure {
    fn from(error: ReferenceError) -> Self {
        match error {
            ReferenceError::Queue(e) => e.into(),
            damaged @ (ReferenceError::Record { .. } | ReferenceError::Gap { .. }) => {
                Failure::problem(damaged, "Stream the job again into a new queue.")
            }
        }
    }
}

/// `claymill control`: the reference controller.
pub(crate) fn control(context: &Context, args: &ControlArgs) -> Result<ExitCode, Failure> {
    let machine = post::machine(args.machine.as_deref())?;
    if let Some(address) = &args.listen {
        if !args.remote && !is_local(address) {
            let advice = "Say --remote if other machines may connect.";
            return Err(Failure::usage(format!("{address} can be reached from elsewhere"), advice));
        }
        listen(context, args, address)?;
    }
    std::thread::spawn(orders);
    let mut queue = Consumer::open(&args.queue, QUEUE_BYTES)?;
    let limits = machine.dynamics;
    let reference = Reference { limits, real_time: !args.fast, single_step: args.step };
    context.console.stage("running");
    let json = context.json;
    let mut order = || match ORDER.load(Ordering::Relaxed) {
        HOLD => Order::Hold,
        ABORT => Order::Abort,
        _ => Order::Run,
    };
    let mut report = |event: Event| match event {
        Event::At(p) if json => outln!(
            "{{\"seq\":{},\"t\":{},\"tip\":[{},{},{}],\"mm_per_s\":{}}}",
            p.seq,
            p.parameter,
            p.tip.x,
            p.tip.y,
            p.tip.z,
            p.speed
        ),
        // The next path waits for its own order.
        Event::PathDone(_) if args.step => ORDER.store(HOLD, Ordering::Relaxed),
        Event::Executed(seq, record) if json => {
            outln!("{{\"seq\":{seq},\"executed\":\"{record:?}\"}}");
        }
        _ => {}
    };
    let (ended, tally) = reference.run(&mut queue, &mut order, &mut report)?;
    let _ = std::io::stdout().flush();
    let how = if ended == Ended::Done { "the stream has ended" } else { "aborted" };
    context.console.say(format!(
        "executed  {} paths in {:.3} s of the machine's time, {:.3} s planned, {} stops; {how}",
        tally.paths,
        tally.cycles as f64 * limits.cycle_s,
        tally.planned_s,
        tally.stops
    ));
    Ok(ExitCode::SUCCESS)
}

/// `hold`, `run`, `step` and `abort`, a line each.
fn orders() {
    for line in std::io::stdin().lock().lines().map_while(Result::ok) {
        match line.trim() {
            "hold" => ORDER.store(HOLD, Ordering::Relaxed),
            "run" | "resume" | "step" => ORDER.store(RUN, Ordering::Relaxed),
            "abort" => ORDER.store(ABORT, Ordering::Relaxed),
            other => eprintln!("`{other}` is no order; write hold, run, step or abort"),
        }
    }
}

/// Takes connections, one at a time, into the queue.
fn listen(context: &Context, args: &ControlArgs, address: &str) -> Result<(), Failure> {
    let secret = secret(args.secret.as_deref())?;
    let listener =
        TcpListener::bind(address).map_err(|e| Failure::problem(format!("{address}: {e}"), advice_on(&e)))?;
    let mut producer = Producer::open(&args.queue, QUEUE_BYTES)?;
    context.console.say(format!("listening {address}"));
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            if let Err(error) = serve(stream, &secret, &mut producer) {
                eprintln!("{error}");
            }
        }
    });
    Ok(())
}
