use std::io::{BufRead, Write};
use std::net::TcpListener;
use std::process::ExitCode;
use std::sync::Arc;

use claymill_controller::{Consumer, Ended, Event, Order, Panel, Port, Producer, Reference, ReferenceError};

use super::stream::{QUEUE_BYTES, is_local};
use super::{Context, post};
use crate::args::ControlArgs;
use crate::console::outln;
use crate::failure::{Failure, advice_on};
use crate::secret::secret;

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
    let panel = Arc::new(Panel::new(if args.hold { Order::Hold } else { Order::Run }, args.step));
    let port = if let Some(address) = &args.listen {
        if !args.remote && !is_local(address) {
            let advice = "Say --remote if other machines may connect.";
            return Err(Failure::usage(format!("{address} can be reached from elsewhere"), advice));
        }
        Some(listen(context, args, address, &panel)?)
    } else {
        None
    };
    let told = Arc::clone(&panel);
    std::thread::spawn(move || orders(&told));
    let mut queue = Consumer::open(&args.queue, QUEUE_BYTES)?;
    let limits = machine.dynamics;
    let reference = Reference { limits, real_time: !args.fast, single_step: args.step };
    context.console.stage("running");
    let json = context.json;
    let mut order = || panel.status().order;
    let mut report = |event: Event| {
        panel.saw(&event);
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
    let served = Arc::clone(&port);
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let (port, secret) = (Arc::clone(&served), Arc::clone(&secret));
            std::thread::spawn(move || {
                if let Err(error) = port.serve(stream, &secret) {
                    eprintln!("{error}");
                }
            });
        }
    });
    Ok(port)
}
