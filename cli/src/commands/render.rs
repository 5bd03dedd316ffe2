use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::ValueEnum;
use claymill_nurbs::Point3;
use claymill_surface_merge::Preset;
use claymill_toolpath::{Program, read_job, read_moves, read_regions};
use claymill_viewer::{Axes, Backdrop, PictureOptions, Renderer, View};

use super::export::{ExportFormat, export};
use super::{Context, diagrams, merge, orientation, pictures, plan, region_of_face};
use crate::args::{AxisArgs, PresetName, RenderArgs, ShowName};
use crate::failure::Failure;
use crate::merging::MergingArgs;

/// `claymill render`.
pub(crate) fn render(context: &Context, args: &RenderArgs) -> Result<ExitCode, Failure> {
    let size = parse_size(&args.size)?;
    let job = if args.what.is_dir() { Some(read_job(&args.what)?) } else { None };
    let path = job.as_ref().map_or_else(|| args.what.clone(), |job| PathBuf::from(&job.model.path));
    let loaded = context.load(&path)?;
    let model = &loaded.import.model;
    let axes = match &job {
        Some(job) => AxisArgs {
            up: args.axes.up.clone().or_else(|| Some(job.request.up.clone())),
            length: args.axes.length.clone().or_else(|| Some(job.request.length.clone())),
        },
        None => args.axes.clone(),
    };
    let axes = pictures::axes(orientation(context.console, &axes, &loaded.bounds)?);
    let view = camera(args.camera.as_deref(), &args.view, &axes)?;

    context.console.stage("merging");
    let (region_of_face, tolerance_mm, program) = match &job {
        Some(_) => {
            let regions = read_regions(&args.what)?;
            let of_face = region_of_face(&regions, model.faces.len())?;
            (of_face, regions.tolerance_mm, read_moves(&args.what)?)
        }
        None => {
            let merged = merge::regions(model, &Preset::Clay.options())?;
            (merged.region_of_face, merged.tolerance.value_mm, Program::default())
        }
    };
    context.console.stage("drawing");
    let tools = job.as_ref().map_or(&[][..], |job| &job.tools);
    let paths =
        (!args.no_paths && !program.moves.is_empty()).then_some(pictures::Paths { program: &program, tools });
    let title = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let cut = job.as_ref().map(pictures::cut_faces).filter(|cut| cut.len() == model.faces.len());
    let album = pictures::Album::new(model, &region_of_face, cut.as_deref(), tolerance_mm);
    // Anything but a model format is a picture, as ever.
    if let Ok(format) = ExportFormat::of(&args.out) {
        context.console.stage("exporting");
        export(&args.out, format, model, &album, &region_of_face, &program)?;
        return done(context, &args.out);
    }
    let album = if args.zebra { album.for_reflections() } else { album };
    let mut scene = album.scene(&title, paths, &args.show)?;
    let diagrams = [ShowName::Classes, ShowName::Worst, ShowName::IsoLines];
    if args.show.iter().any(|s| diagrams.contains(s)) {
        let named = job.as_ref().and_then(|job| PresetName::from_str(&job.request.preset, true).ok());
        let preset = Preset::from(named.unwrap_or(PresetName::Clay));
        let toml = args.what.join(plan::JOB_TOML);
        let merging = if job.is_some() && toml.exists() {
            plan::read_job_file(&toml)?.merging
        } else {
            MergingArgs::default()
        };
        let options = merging.options(preset, model)?;
        let merged = merge::regions(model, &options)?;
        diagrams::draw(&mut scene, model, &merged, &options, &args.show);
    }
    if args.zebra {
        diagrams::explain_zebra(&mut scene);
    }
    let options = PictureOptions {
        size,
        supersampling: args.supersample,
        backdrop: if args.transparent { Backdrop::Transparent } else { Backdrop::Studio },
        annotations: !args.transparent,
        reflection_lines: args.zebra,
        ..pictures::options(&axes)
    };
    claymill_viewer::render_png(&Renderer::new()?, &scene, &view, &options, &args.out)?;
    done(context, &args.out)
}

fn done(context: &Context, written: &Path) -> Result<ExitCode, Failure> {
    context.console.finish();
    context.console.say(written.display());
    if context.json {
        context.print_json(&serde_json::json!({ "written": written }))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The camera as told, or else the view of that name.
pub(crate) fn camera(camera: Option<&str>, view: &str, axes: &Axes) -> Result<View, Failure> {
    match camera {
        Some(camera) => parse_camera(camera, axes),
        None => named_view(view, axes),
    }
}

pub(crate) fn named_view(name: &str, axes: &Axes) -> Result<View, Failure> {
    View::named(name, axes).ok_or_else(|| {
        Failure::usage(
            format!("there is no view `{name}`"),
            "There are: iso, top, left, right, front, rear; render's --camera gives any other.",
        )
    })
}

pub(crate) fn parse_size(text: &str) -> Result<[u32; 2], Failure> {
    let parsed = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    parsed.ok_or_else(|| {
        Failure::usage(format!("`{text}` is not a size"), "Write for example --size 1920x1080.")
    })
}

/// `AZIMUTH/ELEVATION` or eye and target as six coordinates.
fn parse_camera(text: &str, axes: &Axes) -> Result<View, Failure> {
    let numbers = |separator: char| {
        let all = text.split(separator).map(|t| t.trim().parse::<f64>().ok().filter(|v| v.is_finite()));
        all.collect::<Option<Vec<f64>>>()
    };
    let view = match (numbers('/').as_deref(), numbers(',').as_deref()) {
        (Some(&[azimuth, elevation]), _) if elevation.abs() <= 90.0 => {
            Some(View::around(axes, azimuth, elevation))
        }
        (_, Some(&[x, y, z, u, v, w])) => View::standing(axes, Point3::new(x, y, z), Point3::new(u, v, w)),
        _ => None,
    };
    view.ok_or_else(|| {
        Failure::usage(
            format!("`{text}` is not a camera"),
            "Write --camera AZIMUTH/ELEVATION in degrees, for example 30/20 (elevation -90 to 90), or eye and \
             target in mm, for example 3000,-4000,2000,0,0,500.",
        )
    })
}
