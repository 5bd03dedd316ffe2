//! `claymill simulate`: time, stops, path error and feed of a program on a virtual control.

use std::process::ExitCode;

use claymill_controller::Simulation;

use super::{Context, post};
use crate::args::SimulateArgs;
use crate::failure::Failure;

/// `claymill simulate`.
pub(crate) fn simulate(context: &Context, args: &SimulateArgs) -> Result<ExitCode, Failure> {
    let machine = post::machine(args.machine.as_deref())?;
    let (job, dialect) =
        post::written(context, &args.folder, args.dialect.as_deref(), &args.program, &machine)?;
    context.console.stage("running");
    let simulation = claymill_controller::simulate(&job, &args.program, dialect, &machine)?;
    context.console.finish();
    if context.json {
        context.print_json(&simulation)?;
    } else {
        say(context, &simulation);
    }
    Ok(ExitCode::SUCCESS)
}

/// What a control makes of a program, in two lines.
pub(crate) fn say(context: &Context, s: &Simulation) {
    let feed = &s.feed;
    context.console.say(format!(
        "simulated {}: {:.1} s, {:.1} s of it cutting, {} stops; largest distance from the job {:.4} mm at move {} \
         (corners rounded by up to {} mm beside)",
        s.control, s.time_s, s.cut_time_s, s.stops, s.cut_error_mm, s.cut_error_seq, s.corner_mm
    ));
    context.console.say(format!(
        "feed      {:.0} mm/min programmed, {:.0} on average, {:.0} and less on a hundredth of the length; {:.1} % of it is slower than \
         programmed",
        feed.programmed_mm_per_min,
        feed.mean_mm_per_min,
        feed.slowest_hundredth_mm_per_min,
        100.0 * feed.below_share
    ));
}
