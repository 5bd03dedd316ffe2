//! `claymill order`: sends an order to a machine that listens, and waits until it is carried out.

use std::process::ExitCode;
use std::thread::sleep;
use std::time::{Duration, Instant};

use claymill_controller::{Order, Status, WireError, tell};

use super::Context;
use super::stream::near;
use crate::args::OrderArgs;
use crate::failure::Failure;
use crate::secret::secret;

/// How often the machine is asked.
const ASK: Duration = Duration::from_millis(30);
/// A machine comes to rest within this time.
const BRAKES: Duration = Duration::from_secs(20);

/// `claymill order`: waits until the order has been carried out.
pub(crate) fn order(context: &Context, args: &OrderArgs) -> Result<ExitCode, Failure> {
    near(&args.to, args.remote)?;
    let secret = secret(Some(&args.secret))?;
    let order = match args.order.as_str() {
        "status" => None,
        text => Some(text.parse::<Order>().map_err(|e| Failure::usage(e, "Or status, to ask only."))?),
    };
    let ask = |order| tell(&args.to, &secret, order);
    let begun = Instant::now();
    let mut status = ask(order)?;
    if let (Some(given), Some(fault)) = (order, &status.fault)
        && matches!(given, Order::Run | Order::Step | Order::Discard)
    {
        let advice = if given == Order::Discard {
            "What waits could not be dropped: abort, and remove the queue's file."
        } else {
            "Say discard to drop what waits, then stream the job again."
        };
        return Err(Failure::problem(format!("the machine does not go on: {fault}"), advice));
    }
    while let Some(given) = order.filter(|given| !done(*given, &status)) {
        // Only a step may take as long as its path.
        if given != Order::Step && begun.elapsed() > BRAKES {
            return Err(Failure::problem("the machine does not come to rest", "Is it running?"));
        }
        sleep(ASK);
        status = match ask(None) {
            Err(WireError::Io(_)) if given == Order::Abort => {
                // It came to rest and left.
                status.speed = 0.0;
                break;
            }
            other => other?,
        };
    }
    if context.json {
        let place = status.place.map(|(tip, axis)| [[tip.x, tip.y, tip.z], [axis.x, axis.y, axis.z]]);
        context.print_json(&serde_json::json!({
            "order": status.order.to_string(),
            "seq": status.seq,
            "paths": status.paths,
            "mm_per_s": status.speed,
            "tip_mm": place.map(|p| p[0]),
            "axis": place.map(|p| p[1]),
            "fault": status.fault,
        }))?;
    } else {
        context.console.say(line(&status));
    }
    Ok(ExitCode::SUCCESS)
}

/// Whether the machine has done what it was told.
fn done(given: Order, status: &Status) -> bool {
    let rests = status.speed == 0.0;
    match given {
        Order::Run => true,
        Order::Hold => rests,
        Order::Step => rests && (status.order != Order::Step || status.fault.is_some()),
        Order::Abort => false,
        Order::Discard => rests && status.order != Order::Discard,
    }
}

fn line(status: &Status) -> String {
    let place = status.place.map_or_else(
        || "has not moved".to_owned(),
        |(p, _)| {
            format!(
                "record {}, X {:.3} Y {:.3} Z {:.3} mm, {:.1} mm/s",
                status.seq, p.x, p.y, p.z, status.speed
            )
        },
    );
    let fault = status.fault.as_ref().map_or_else(String::new, |why| format!("; fault: {why}"));
    format!("{:9} {place}; {} paths done{fault}", status.order, status.paths)
}
