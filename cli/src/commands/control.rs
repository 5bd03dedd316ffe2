//! `claymill control`: the reference controller as a process. It takes records from a queue in
//! shared memory, or from a connection, and orders from standard input or from connections.

use std::cell::Cell;
use std::io::{BufRead, Write};
use std::net::TcpListener;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use claymill_controller::{
    Consumer, Ended, Event, Order, Panel, Port, Producer, Reference, ReferenceError, WireError,
};

use super::stream::{QUEUE_BYTES, is_local};
use super::{Context, post};
use crate::args::ControlArgs;
use crate::console::outln;
use crate::failure::{Failure, advice_on};
use crate::interrupt;
use crate::secret::secret;

/// What goes wrong on connections is said no more often than this.
const QUIET: Duration = Duration::from_secs(1);

impl From<ReferenceError> for Failure {
    fn from(error: ReferenceError) -> Self {
        let advice = "The machine came to rest. Drop what waits by the order discard (`claymill order discard` \
            with --listen, or a line on standard input), then stream the job again.";
        Failure::problem(error, advice)
    }
}

/// `claymill control`: the reference controller.
pub(crate) fn control(context: &Context, args: &ControlArgs) -> Result<ExitCode, Failure> {
    let machine = post::machine(args.machine.as_deref())?;
    let panel = Arc::new(Panel::new(if args.hold { Order::Hold } else { Order::Run }, args.step));
    // The queue first: where another controller takes from it, nobody is to reach this one.
    let mut queue = Consumer::open(&args.queue, QUEUE_BYTES)?;
    let port = if let Some(address) = &args.listen {
        if !args.remote && !is_local(address) {
            let advice = "Say --remote if other machines may connect.";
            return Err(Failure::usage(format!("{address} can be reached from elsewhere"), advice));
        }
        Some(listen(context, args, address, &panel)?)
    } else {
        None
    };
    let stopped = Arc::new(AtomicBool::new(false));
    let (told, stops) = (Arc::clone(&panel), Arc::clone(&stopped));
    interrupt::at_first(move || {
        stops.store(true, Ordering::SeqCst);
        told.tell(Order::Abort);
    });
    // Whether somebody could still give an order.
    let heard = Arc::new(AtomicBool::new(true));
    let (told, hears) = (Arc::clone(&panel), Arc::clone(&heard));
    std::thread::spawn(move || {
        orders(&told);
        hears.store(false, Ordering::SeqCst);
    });
    let limits = machine.dynamics;
    let reference = Reference { limits, real_time: !args.fast, single_step: args.step };
    context.console.stage("running");
    let json = context.json;
    let alone = port.is_none();
    // A fault that nobody could clear ends the process, once the machine stands there.
    let stands = Cell::new(false);
    let mut order = || match panel.order() {
        _ if stands.get() && alone && !heard.load(Ordering::SeqCst) => Order::Abort,
        order => order,
    };
    let mut report = |event: Event| {
        panel.saw(&event);
        if event == Event::Discarded {
            stands.set(false);
        }
        match event {
            Event::At(p) if json => outln!(
                "{{\"seq\":{},\"t\":{},\"tip\":[{},{},{}],\"mm_per_s\":{}}}",
                p.seq,
                p.parameter,
                p.tip.x,
                p.tip.y,
                p.tip.z,
                p.speed
            ),
            Event::Executed(seq, record) if json => {
                outln!("{{\"seq\":{seq},\"executed\":\"{record:?}\"}}");
            }
            Event::Stands => stands.set(true),
            Event::Discarded if json => outln!("{{\"discarded\":true}}"),
            Event::ToldAgain(record) if json => outln!("{{\"told_again\":\"{record:?}\"}}"),
            Event::ToldAgain(record) => context.console.say(format!("again     {record:?}")),
            Event::Fault(why) => {
                if json {
                    outln!("{}", serde_json::json!({ "fault": why }));
                }
                context.console.say(format!("fault     {why}; the machine comes to rest"));
            }
            _ => {}
        }
    };
    let ran = reference.run(&mut queue, &mut order, &mut report);
    if let Some(port) = port {
        port.close();
    }
    let (ended, tally) = ran?;
    let _ = std::io::stdout().flush();
    let how = if ended == Ended::Done { "the stream has ended" } else { "aborted" };
    context.console.say(format!(
        "executed  {} paths in {:.3} s of the machine's time, {:.3} s planned, {} stops; {how}",
        tally.paths,
        tally.cycles as f64 * limits.cycle_s,
        tally.planned_s,
        tally.stops
    ));
    if stopped.load(Ordering::SeqCst) && ended == Ended::Aborted {
        return Ok(ExitCode::from(interrupt::INTERRUPTED));
    }
    Ok(ExitCode::SUCCESS)
}

/// Orders from the standard input, a line each.
fn orders(panel: &Panel) {
    for line in std::io::stdin().lock().lines().map_while(Result::ok) {
        match line.trim().parse() {
            Ok(order) => panel.tell(order),
            Err(unknown) => eprintln!("{unknown}"),
        }
    }
}

/// Takes connections: one stream at a time into the queue, and orders.
fn listen(
    context: &Context,
    args: &ControlArgs,
    address: &str,
    panel: &Arc<Panel>,
) -> Result<Arc<Port>, Failure> {
    let secret = secret(args.secret.as_deref())?;
    let listener =
        TcpListener::bind(address).map_err(|e| Failure::problem(format!("{address}: {e}"), advice_on(&e)))?;
    let port = Arc::new(Port::new(Producer::open(&args.queue, QUEUE_BYTES)?, Arc::clone(panel)));
    let place = listener.local_addr().map_or_else(|_| address.to_owned(), |a| a.to_string());
    context.console.say(format!("listening {place}"));
    let secret: Arc<[u8]> = secret.into();
    let said = Arc::new(Mutex::new(None::<Instant>));
    let report = move |error: WireError| {
        let mut said = said.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if said.is_none_or(|s| s.elapsed() > QUIET) {
            *said = Some(Instant::now());
            eprintln!("{error}");
        }
    };
    let served = Arc::clone(&port);
    std::thread::spawn(move || served.listen(&listener, &secret, report));
    Ok(port)
}
