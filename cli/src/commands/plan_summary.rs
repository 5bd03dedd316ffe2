//! What `claymill plan` says of a plan, before and after.

use claymill_paths::{Plan, PlanOptions, flat_mm};
use claymill_toolpath::UncutReason;
use claymill_viewer::figures;

use crate::console::Console;

/// So long a path takes an hour to plan and prove on two cores, and tens of gigabytes, mm.
const MUCH_MM: f64 = 2.5e7;

/// Figures in the report's form, with spaces that every terminal shows.
fn plain(text: String) -> String {
    text.replace(char::is_whitespace, " ")
}

fn area(mm2: f64) -> String {
    plain(figures::area(mm2))
}

fn area_of(part_mm2: f64, whole_mm2: f64) -> String {
    plain(figures::area_of(part_mm2, whole_mm2))
}

fn length(mm: f64) -> String {
    plain(figures::length(mm))
}

fn duration(seconds: f64) -> String {
    plain(figures::duration(seconds))
}

/// A plan that will take very long is announced before it begins.
pub(super) fn warn_of_much(
    console: &Console,
    options: &PlanOptions,
    excluded: &[bool],
    face_area_mm2: &[f64],
) {
    let areas = face_area_mm2.iter().zip(excluded);
    let area_mm2: f64 = areas.filter(|(_, excluded)| !**excluded).map(|(mm2, _)| mm2).sum();
    let step_mm = flat_mm(options.tool.radius_mm(), options.scallop_mm);
    if area_mm2 / step_mm > MUCH_MM {
        console.say(format!(
            "warning: {} at a step-over of {} are up to {} of passes: this may take hours, and more memory than there is. \
             Is the unit right? A larger ball or scallop height, or some regions at a time (--only), take less.",
            area(area_mm2),
            length(step_mm),
            length(area_mm2 / step_mm)
        ));
    }
}

/// The plan in a few lines: with all that is said before and after it, a job fits on one screen.
pub(super) fn say_plan(console: &Console, plan: &Plan) {
    let totals = &plan.totals;
    let whole_mm2 = plan.area.total_mm2;
    let setups: Vec<String> = plan
        .setups
        .iter()
        .map(|s| format!("{} {} {}", s.name, area_of(s.area_mm2, whole_mm2), duration(s.time_s)))
        .collect();
    console.say_long("setups", &setups.join(", "));
    let uncut: Vec<String> = plan
        .area
        .uncut_mm2
        .iter()
        .map(|(reason, mm2)| {
            format!("{} {}", area_of(*mm2, whole_mm2), claymill::name(reason).replace('_', " "))
        })
        .collect();
    let not_cut = if uncut.is_empty() {
        "nothing left out".to_owned()
    } else {
        format!("not cut: {}", uncut.join(", "))
    };
    let (cut, total) = (area_of(plan.area.cut_mm2, whole_mm2), area(whole_mm2));
    // Levels cut stock, and no surface.
    let is_roughed =
        plan.area.cut_mm2 == 0.0 && plan.area.uncut_mm2.keys().all(|r| *r == UncutReason::Roughed);
    let words = if is_roughed {
        format!("{total} roughed, none finished")
    } else {
        format!("{cut} of {total} cut; {not_cut}")
    };
    console.say_long("area", &words);
    let [cut, link, lead, rapid] =
        [totals.length.cut_mm, totals.length.link_mm, totals.length.lead_mm, totals.length.rapid_mm]
            .map(length);
    let (passes, retracts) = (totals.passes, totals.retracts);
    console.say_long(
        "paths",
        &format!(
            "{cut} in {passes} passes, {retracts} retracts, links {link}, leads {lead}, rapids {rapid}; {} moves, {} \
             control points, about {}",
            totals.moves,
            totals.control_points,
            duration(totals.time_s)
        ),
    );
    if totals.locations > 0 {
        let share = 100.0 * totals.certified_locations as f64 / totals.locations as f64;
        console.say_long(
            "",
            &format!(
                "{share:.1} % of {} locations lie where their contact is certified to be the only one",
                totals.locations
            ),
        );
    }
    if plan.struck_passes > 0 {
        let struck = plan.struck_passes;
        console.say_long(
            "",
            &format!("{struck} passes cut short or left out: shank or holder would run into stock"),
        );
    }
    for note in &plan.notes {
        console.say_long("", note);
    }
    if totals.lifted_locations > 0 {
        let lifted = totals.lifted_locations;
        console
            .say_long("", &format!("{lifted} locations rest on a proven bound instead of an exact contact"));
    }
}
