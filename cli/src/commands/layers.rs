//! Layers of `render` that come from a measurement or from a time of the job.

use std::collections::BTreeMap;
use std::path::Path;

use claymill::seconds_of_moves;
use claymill_nurbs::{Model, Point3, Vector3};
use claymill_toolpath::{Holder, Job, MoveKind, Program, ToolRecord};
use claymill_verify::{
    SurfaceState, VerifyOptions, crest_samples, gouge_samples, read_crests, residual_samples,
};
use claymill_viewer::{
    LegendEntry, LineKind, Mark, Pin, PinShape, Reel, Rgb, Scene, StateScale, Stock, StrokeStyle, kind_colour,
};

use super::pictures::paint_scallops;
use super::{Context, request};
use crate::args::ShowName;
use crate::failure::Failure;

/// A gouge deeper than this is one that the verifier does not pass, mm.
const DEEP_MM: f64 = 0.005;
const DEEP: Rgb = [190, 20, 30];
const SHALLOW: Rgb = [214, 120, 0];
/// Distance of the verifier's samples on the faces.
const SPACING_MM: f64 = 8.0;

/// What became of the surface: light where it is cut, dark and strong where it is not.
const STATES: [(SurfaceState, Rgb, &str); 9] = [
    (SurfaceState::Cut, [222, 216, 204], "cut"),
    (SurfaceState::ReachableLeft, [206, 28, 40], "left, though in reach"),
    (SurfaceState::TooTight, [232, 150, 32], "too tight for the ball"),
    (SurfaceState::HolderInTheWay, [214, 200, 60], "out of reach for the holder"),
    (SurfaceState::Hidden, [70, 86, 120], "in reach from no direction"),
    (SurfaceState::Excluded, [150, 152, 156], "left out as asked"),
    (SurfaceState::EarlierTool, [150, 190, 170], "cut by the earlier tool"),
    (SurfaceState::OutOfBounds, [178, 178, 140], "out of bounds, as asked"),
    (SurfaceState::NotMeasured, [130, 60, 150], "not measured"),
];

/// A job and its model.
#[derive(Clone, Copy)]
pub(crate) struct Work<'a> {
    pub(crate) model: &'a Model,
    pub(crate) job: &'a Job,
    pub(crate) program: &'a Program,
    /// Where the job is.
    pub(crate) folder: &'a Path,
}

/// The job's tools, with another holder if one is given.
pub(crate) fn tools(job: &Job, holder: Option<&str>) -> Result<Vec<ToolRecord>, Failure> {
    let with = |t: &ToolRecord| -> Result<ToolRecord, Failure> {
        let own: Option<Holder> = holder.map(|text| request::holder(text, &t.tool)).transpose()?;
        Ok(match own {
            // In all setups.
            Some(holder) => {
                ToolRecord { holder: Some(holder), setup_stick_out_mm: BTreeMap::new(), ..t.clone() }
            }
            None => t.clone(),
        })
    };
    job.tools.iter().map(with).collect()
}

/// Paints or marks what has to be measured.
pub(crate) fn add_measured(
    context: &Context,
    scene: &mut Scene,
    work: &Work<'_>,
    show: &[ShowName],
) -> Result<(), Failure> {
    let Work { model, job, program, folder } = *work;
    let options = VerifyOptions { folder: folder.to_owned(), ..VerifyOptions::default() };
    if show.contains(&ShowName::Scallop) {
        let crests = match read_crests(folder, job) {
            Some(crests) => crests,
            None => crest_samples(model, job, program, &options, context.console)?,
        };
        paint_scallops(scene, &crests, &job.request);
    }
    if show.contains(&ShowName::Uncut) {
        let samples = residual_samples(model, job, program, &options, context.console)?;
        let number = |state: SurfaceState| STATES.iter().position(|s| s.0 == state).unwrap_or(0);
        let states = STATES.map(|(state, colour, words)| {
            let mm2: f64 = samples.iter().filter(|s| s.state == state).map(|s| s.area_mm2).sum();
            (colour, if mm2 > 0.0 { format!("{words}: {}", square(mm2)) } else { String::new() })
        });
        let placed: Vec<(Point3, Vector3, usize)> =
            samples.iter().map(|s| (s.point, s.normal, number(s.state))).collect();
        scene.paint_states(&placed, &StateScale { states: states.into(), spacing_mm: SPACING_MM });
    }
    if show.contains(&ShowName::Gouges) {
        let found = gouge_samples(model, job, program, &options, context.console)?;
        for (deep, shape, colour, words) in [
            (false, PinShape::Ring, SHALLOW, "1 to 5 µm deep"),
            (true, PinShape::Cross, DEEP, "deeper than 5 µm"),
        ] {
            let of_kind = || found.iter().filter(|g| (g.depth_mm > DEEP_MM) == deep);
            scene.pins.extend(of_kind().map(|g| Pin { at: g.foot, shape, colour }));
            let text = format!("{words}: {} places", of_kind().count());
            scene.legend.push(LegendEntry { mark: Mark::Pin(shape), colour, text });
        }
    }
    Ok(())
}

fn square(mm2: f64) -> String {
    if mm2 >= 1e5 { format!("{:.3} m²", mm2 * 1e-6) } else { format!("{:.1} cm²", mm2 * 1e-2) }
}

/// The job as it stands at a time.
pub(crate) struct Moment<'a> {
    /// As asked for.
    pub(crate) at: Option<&'a str>,
    /// The tools that are drawn.
    pub(crate) tools: &'a [ToolRecord],
    /// Material over the model, mm.
    pub(crate) allowance_mm: f64,
    /// How paths are drawn.
    pub(crate) style: StrokeStyle<'a>,
}

/// `scene`, which has no paths, with the paths until then, the tool and the material.
pub(crate) fn at_moment(
    scene: Scene,
    work: &Work<'_>,
    moment: &Moment<'_>,
    show: &[ShowName],
) -> Result<Scene, Failure> {
    let mut bare = scene;
    let colours = |kind: LineKind| match kind {
        LineKind::Cut => Some((ShowName::Cut, MoveKind::Cut, "cut")),
        LineKind::Link => Some((ShowName::Link, MoveKind::Link, "link")),
        LineKind::Lead => Some((ShowName::Lead, MoveKind::LeadIn, "lead in and out")),
        _ => None,
    };
    if let Some(tool) = moment.tools.first() {
        bare.explain_tool(tool);
    }
    let reel = Reel::new(bare, work.program, &seconds_of_moves(work.job, work.program), &moment.style);
    let stock = show.contains(&ShowName::Stock);
    let at_s = match moment.at {
        Some(text) => parse_time(text, reel.duration_s())?,
        None => reel.duration_s(),
    };
    let mut scene = reel.scene(at_s);
    scene.framed.clear();
    scene.lines.retain(|l| colours(l.kind).is_none_or(|(name, ..)| show.contains(&name)));
    if stock {
        let mut material = Stock::of(reel.bare(), reel.course(), moment.allowance_mm);
        material.go_to(reel.bare(), reel.course(), at_s);
        material.show(reel.bare(), &mut scene);
    }
    for layer in &scene.lines {
        if let Some((_, kind, words)) = colours(layer.kind) {
            let colour = if kind == MoveKind::Cut { [60, 60, 64] } else { kind_colour(kind) };
            let entry = LegendEntry { mark: Mark::Line(1.5), colour, text: words.to_owned() };
            scene.legend.push(entry);
        }
    }
    Ok(scene)
}

/// The tool halfway through the job, over a finished picture of all paths.
pub(crate) fn add_tool(scene: &mut Scene, work: &Work<'_>, moment: &Moment<'_>) {
    let nothing = Scene::new(scene.origin);
    let reel = Reel::new(nothing, work.program, &seconds_of_moves(work.job, work.program), &moment.style);
    if let Some(tool) = reel.tool(0.5 * reel.duration_s()) {
        scene.add_posed_tool(&tool);
        scene.explain_tool(tool.record);
    }
}

/// `40%`, `90`, `12:30` or `1:12:30`.
fn parse_time(text: &str, whole_s: f64) -> Result<f64, Failure> {
    let number = |t: &str| t.trim().parse::<f64>().ok().filter(|v| v.is_finite() && *v >= 0.0);
    let parsed = match text.strip_suffix('%') {
        Some(percent) => number(percent).map(|p| 0.01 * p * whole_s),
        None => text.split(':').try_fold(0.0, |s, part| Some(60.0 * s + number(part)?)),
    };
    let at_s = parsed.ok_or_else(|| {
        Failure::usage(
            format!("`{text}` is not a time of the job"),
            "For example: --at 40%, --at 90 (seconds), --at 1:12:30.",
        )
    })?;
    if at_s > whole_s * (1.0 + 1e-9) {
        return Err(Failure::usage(
            format!("{at_s:.0} s is after the end of the job, which takes {whole_s:.0} s"),
            "Choose an earlier time, or a share of the job such as --at 40%.",
        ));
    }
    Ok(at_s.min(whole_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_shares_seconds_or_clocks() {
        for (text, s) in [
            ("40%", 1440.0),
            ("0", 0.0),
            ("90", 90.0),
            ("12:30", 750.0),
            ("0:59:59.5", 3599.5),
            ("100%", 3600.0),
        ] {
            assert!((parse_time(text, 3600.0).unwrap() - s).abs() < 1e-9, "{text}");
        }
        for text in ["", "noon", "-5", "5 %%", "1:00:01", "101%", "1::2", "nan"] {
            assert!(parse_time(text, 3600.0).is_err(), "{text}");
        }
    }
}
