//! `claymill reach`: what directions reach of a model, the fewest that reach all, and the proof.

use std::path::Path;
use std::process::ExitCode;

use claymill::{DirectionsFrom, Merging, ModelFile, ReachAsked, ReachFound, find_reach};
use claymill_paths::{Axis, Orientation};
use claymill_toolpath::{Kind, Tool};
use claymill_viewer::{LegendEntry, Mark, PictureOptions, Pin, PinShape, Renderer, Rgb};

use super::render::{named_view, parse_size};
use super::{Context, orientation, pictures, request};
use crate::args::{ReachArgs, ShowName};
use crate::console::{counted, outln};
use crate::failure::Failure;
use crate::output;

/// Marks in a picture, at most.
const MOST_PINS: usize = 400;
const UNREACHED: Rgb = [214, 30, 36];
/// Faces that are listed.
const LISTED: usize = 10;

/// `claymill reach`.
pub(crate) fn reach(context: &Context, args: &ReachArgs) -> Result<ExitCode, Failure> {
    let asked = asked(args)?;
    let inputs = std::slice::from_ref(&args.model);
    let out = output::begin(context, &args.out, Kind::Json, inputs)?;
    let picture =
        args.picture.as_ref().map(|path| output::begin_beside_text(context, path, Kind::Picture, inputs));
    let picture = picture.transpose()?;
    let loaded = context.load(&args.model, None)?;
    let orientation = orientation(context.console, &args.axes, &loaded)?;
    context.console.stage("looking for material");
    let mut merged = claymill::merge(&loaded, &Merging::default())?;
    merged.find_sides(&loaded, orientation.up.vector(), &args.material_side)?;
    context.console.stage("looking from all directions");
    let found = find_reach(&loaded, &merged, orientation, &asked, context.console)?;
    let text = serde_json::to_string_pretty(&found.record)
        .map_err(|e| Failure::problem(format!("the result cannot be written as JSON: {e}"), ""))?;
    output::write(out, Kind::Json, text.as_bytes())?;
    if let Some((path, picture)) = args.picture.as_ref().zip(picture) {
        context.console.stage("drawing");
        output::staged(&picture, path, |staged| {
            save_picture(args, &loaded, &merged, orientation, &found, staged)
        })?;
        picture.finish(Kind::Picture)?;
        context.console.say(path.display());
    }
    context.console.say(args.out.display());
    context.console.finish();
    if context.json {
        context.print_json(&found.record)?;
    } else {
        print(&found, &loaded);
    }
    Ok(ExitCode::SUCCESS)
}

fn asked(args: &ReachArgs) -> Result<ReachAsked, Failure> {
    let tool: Tool =
        args.tool.parse().map_err(|e| Failure::usage(e, "For example: --tool flat:5, --tool ball:10."))?;
    let holder = args.holder.as_deref().map(|text| request::holder(text, &tool)).transpose()?;
    let from = match args.axis.as_deref() {
        None => DirectionsFrom::Head(args.tilt_limit),
        Some(text) => rotary(text)?,
    };
    let (mut forced, mut forced_deg) = (Vec::new(), Vec::new());
    for text in &args.forced {
        let numbers: Option<Vec<f64>> =
            text.split(',').map(|t| t.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
        match (numbers.as_deref(), &from) {
            (Some([x, y, z]), DirectionsFrom::Head(_)) => forced.push([*x, *y, *z]),
            (Some([deg]), DirectionsFrom::Rotary(_) | DirectionsFrom::BestRotary) => forced_deg.push(*deg),
            _ => {
                return Err(Failure::usage(
                    format!("`{text}` is no direction to choose here"),
                    "Write --forced 0,-0.5,1 for a head, and --forced 180 for an angle about --axis.",
                ));
            }
        }
    }
    if !(args.share > 0.0 && args.share <= 100.0) {
        let advice = "For example: --share 99.5.";
        return Err(Failure::usage(format!("a share of {} % is not between 0 and 100", args.share), advice));
    }
    let share = 0.01 * args.share;
    let steepest_deg = args.steepest;
    Ok(ReachAsked { tool, holder, steepest_deg, from, forced, forced_deg, share })
}

/// What a part is turned about.
pub(super) fn rotary(text: &str) -> Result<DirectionsFrom, Failure> {
    if text == "auto" {
        return Ok(DirectionsFrom::BestRotary);
    }
    let axis = text.parse::<Axis>();
    Ok(DirectionsFrom::Rotary(axis.map_err(|e| Failure::usage(e, "For example: --axis x, or --axis auto."))?))
}

fn print(found: &ReachFound, loaded: &ModelFile) {
    let record = &found.record;
    let percent = |mm2: f64| 100.0 * mm2 / record.area_mm2.max(f64::MIN_POSITIVE);
    if !found.axes.is_empty() {
        outln!("axis   seen      bar        length");
        for view in &found.axes {
            let chosen = if found.axis == Some(view.axis) { "  chosen" } else { "" };
            outln!(
                "{}   {:6.2} %  {:6.1} mm  {:7.1} mm{chosen}",
                view.axis,
                100.0 * view.seen_share,
                view.bar_mm,
                view.length_mm
            );
        }
        outln!("");
    }
    outln!("direction                    reached   of itself");
    for (k, &column) in record.chosen.iter().enumerate() {
        let direction = &record.directions[column];
        let [x, y, z] = direction.axis;
        let place =
            direction.angle_deg.map_or_else(|| format!("{x:.4},{y:.4},{z:.4}"), |deg| format!("{deg}°"));
        let mut own = found.reach.table.columns[column].clone();
        for &other in record.chosen.iter().filter(|other| **other != column) {
            own.take(&found.reach.table.columns[other]);
        }
        let forced = if k < record.forced { "  forced" } else { "" };
        outln!(
            "{place:27}  {:6.2} %  {:6.2} %{forced}",
            percent(direction.reached_mm2),
            percent(found.reach.area_mm2(&own))
        );
    }
    outln!("");
    outln!(
        "together {:.2} % of {:.4} m²; all {} reach {:.2} %",
        percent(record.reached_mm2),
        1e-6 * record.area_mm2,
        counted(record.directions.len(), "direction"),
        percent(record.reachable_mm2)
    );
    let chosen = record.chosen.len() - record.forced;
    if record.is_optimal {
        outln!("proven: {} these {}", below(chosen), counted(record.places.len(), "place"));
    } else {
        outln!("at least {} are needed; {chosen} were found", record.least);
    }
    if let Some(one_more) = record.gains.iter().find(|g| g.directions.len() == record.chosen.len() + 1) {
        outln!(
            "{} reach {:.2} %, and no choice of as many more than {:.2} %",
            one_more.directions.len(),
            percent(one_more.reached_mm2),
            percent(one_more.at_most_mm2)
        );
    }
    let mut unreached: Vec<_> = record.unreached.iter().collect();
    unreached.sort_by(|a, b| b.area_mm2.total_cmp(&a.area_mm2).then(a.face.cmp(&b.face)));
    for face in unreached.iter().take(LISTED) {
        outln!(
            "not reached: face {} ({}), {:.1} of {:.1} mm²: {}",
            face.face,
            face.entity,
            face.area_mm2,
            loaded.face_area_mm2[face.face],
            why(face.seen)
        );
    }
    if unreached.len() > LISTED {
        outln!("not reached: ... and {} more", counted(unreached.len() - LISTED, "face"));
    }
}

/// What one fewer do not do, in words.
fn below(count: usize) -> String {
    match count {
        0 => "none is needed besides the forced ones to reach".to_owned(),
        1 => "one is needed to reach".to_owned(),
        2 => "no single direction reaches".to_owned(),
        count => format!("no {} directions reach", count - 1),
    }
}

pub(super) fn why(seen: claymill::reaching::Seen) -> &'static str {
    use claymill::reaching::Seen as S;
    match seen {
        S::Away => "it looks away from all directions",
        S::Steep => "it leans too far for all of them",
        S::Hidden => "something is in the way",
        S::Tight => "too tight for the tool",
        S::Reached => "reached",
    }
}

fn save_picture(
    args: &ReachArgs,
    loaded: &ModelFile,
    merged: &claymill::Merged,
    orientation: Orientation,
    found: &ReachFound,
    path: &Path,
) -> Result<(), Failure> {
    let axes = pictures::axes(orientation);
    let view = named_view(&args.view, &axes)?;
    let options = PictureOptions { size: parse_size(&args.size)?, ..pictures::options(&axes) };
    let model = loaded.model();
    let tolerance_mm = merged.found.tolerance.value_mm;
    let album = pictures::Album::new(model, &merged.found.region_of_face, None, tolerance_mm);
    let mut scene = album.scene(&loaded.name(), None, &[ShowName::Model, ShowName::Trims])?;
    let record = &found.record;
    scene.caption[1] = format!(
        "{} reach {:.2} % of {:.4} m²",
        counted(record.chosen.len(), "direction"),
        100.0 * record.reached_mm2 / record.area_mm2.max(f64::MIN_POSITIVE),
        1e-6 * record.area_mm2
    );
    let reached = found.reach.table.covered(&found.cover.columns);
    let left: Vec<_> = (0..found.reach.samples.len()).filter(|&k| !reached.contains(k)).collect();
    let every = left.len().div_ceil(MOST_PINS).max(1);
    let pins = left.iter().step_by(every);
    scene.pins.extend(pins.map(|&k| Pin {
        at: found.reach.samples[k].point,
        shape: PinShape::Cross,
        colour: UNREACHED,
    }));
    if !left.is_empty() {
        let text = "not reached".to_owned();
        scene.legend.push(LegendEntry { mark: Mark::Pin(PinShape::Cross), colour: UNREACHED, text });
    }
    claymill_viewer::render_png(&Renderer::new()?, &scene, &view, &options, path)?;
    Ok(())
}
