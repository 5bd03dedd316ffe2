//! `claymill drop`: where a tool comes to rest over given places, with proof and picture.

use std::path::Path;
use std::process::ExitCode;

use claymill::{Merging, ModelFile};
use claymill_nurbs::{FaceId, Point3};
use claymill_paths::{Covered, CutterDrop, Frame, PlanError, ToolPart};
use claymill_toolpath::{Tool, ToolRecord};
use claymill_viewer::{PictureOptions, PosedTool, Renderer};
use serde::Serialize;

use super::render::{named_view, parse_size};
use super::{Context, left_out, orientation, pictures};
use crate::args::{DropArgs, ShowName};
use crate::console::outln;
use crate::failure::Failure;

/// Where a tool came to rest, in model coordinates.
#[derive(Debug, Serialize)]
struct Rest {
    /// The tool's tip, mm: free of gouges there.
    tip_mm: [f64; 3],
    /// Proven to be higher than it would have to be by no more than this, mm.
    gap_mm: f64,
    /// What it touches.
    contact_mm: [f64; 3],
    face: FaceId,
    entity: String,
    /// `end` or `side`: taper or shank.
    part: &'static str,
}

/// `claymill drop`.
pub(crate) fn drop(context: &Context, args: &DropArgs) -> Result<ExitCode, Failure> {
    let tool: Tool =
        args.tool.parse().map_err(|e| Failure::usage(e, "For example: --tool bull:10:2, --tool ball:10."))?;
    let lines = args.at.iter().map(|text| place(text)).collect::<Result<Vec<Point3>, _>>()?;
    let loaded = context.load(&args.model, None)?;
    let orientation = orientation(context.console, &args.axes, &loaded)?;
    let model = &loaded.import.model;
    context.console.stage("covering");
    let excluded = vec![false; model.faces.len()];
    let area_mm2 = loaded.face_area_mm2.iter().sum();
    let covered = Covered::new(model, &excluded, area_mm2, tool.radius_mm()).map_err(|(face, source)| {
        let entity = model.faces[face].source.entity.clone();
        Failure::from(claymill_paths::PlanError::Face { face, entity, source })
    })?;
    left_out::say(context.console, &claymill::left_out_faces(&loaded, &covered.left_out));
    let [frame, ..] = orientation.five_setups().map_err(PlanError::from)?;
    let end = CutterDrop::new(&covered.model, &covered.covering, &frame, &tool);
    let rest = |line: &Point3| {
        let at = frame.to_setup(line);
        let location = end.drop(at.x, at.y)?;
        let face = covered.own_face(location.face);
        Some(Rest {
            tip_mm: frame.to_model(&location.tip).into(),
            gap_mm: location.gap_mm,
            contact_mm: frame.to_model(&location.contact).into(),
            face,
            entity: model.faces[face].source.entity.clone(),
            part: if location.part == ToolPart::End { "end" } else { "side" },
        })
    };
    let rests: Vec<Option<Rest>> = lines.iter().map(rest).collect();
    if let Some(path) = &args.out {
        context.console.stage("drawing");
        save_picture(context, args, &loaded, orientation, (&tool, &frame), &rests, path)?;
    }
    context.console.finish();
    if context.json {
        context.print_json(&rests)?;
        return Ok(ExitCode::SUCCESS);
    }
    for (rest, text) in rests.iter().zip(&args.at) {
        match rest {
            Some(r) => outln!(
                "{text}  tip {:.6} {:.6} {:.6}, proven to {:.5} mm; its {} touches face {} ({}) at {:.4} {:.4} {:.4}",
                r.tip_mm[0],
                r.tip_mm[1],
                r.tip_mm[2],
                r.gap_mm,
                r.part,
                r.face,
                r.entity,
                r.contact_mm[0],
                r.contact_mm[1],
                r.contact_mm[2],
            ),
            None => outln!("{text}  nothing below"),
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn place(text: &str) -> Result<Point3, Failure> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|t| t.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
    match numbers.as_deref() {
        Some([x, y, z]) => Ok(Point3::new(*x, *y, *z)),
        _ => Err(Failure::usage(
            format!("`{text}` is not a point"),
            "Write its coordinates in mm, for example --at 120,-35.5,0.",
        )),
    }
}

fn save_picture(
    context: &Context,
    args: &DropArgs,
    loaded: &ModelFile,
    orientation: claymill_paths::Orientation,
    (tool, frame): (&Tool, &Frame),
    rests: &[Option<Rest>],
    path: &Path,
) -> Result<(), Failure> {
    let axes = pictures::axes(orientation);
    let view = named_view(&args.view, &axes)?;
    let options = PictureOptions { size: parse_size(&args.size)?, ..pictures::options(&axes) };
    let model = &loaded.import.model;
    let merged = claymill::merge(loaded, &Merging::default())?.found;
    let album = pictures::Album::new(model, &merged.region_of_face, None, merged.tolerance.value_mm);
    let mut scene = album.scene(&loaded.name(), None, &[ShowName::Model, ShowName::Trims])?;
    let record = ToolRecord {
        id: tool.to_string(),
        tool: *tool,
        holder: None,
        setup_stick_out_mm: Default::default(),
    };
    for rest in rests.iter().flatten() {
        let (tip, axis) = (Point3::from(rest.tip_mm), frame.axis());
        scene.add_posed_tool(&PosedTool { record: &record, tip, axis });
    }
    scene.explain_tool(&record);
    claymill_viewer::render_png(&Renderer::new()?, &scene, &view, &options, path)?;
    context.console.say(path.display());
    Ok(())
}
