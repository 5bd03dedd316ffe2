//! `claymill render`: one picture of a model or a job, with layers, view and size of choice.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::ValueEnum;
use claymill::ModelFile;
use claymill_nurbs::{Aabb, Model, Point3};
use claymill_surface_merge::Preset;
use claymill_toolpath::{Job, Kind, Program, read_moves};
use claymill_viewer::{
    Axes, Backdrop, ColourBy, LineKind, PictureOptions, Renderer, Scene, StrokeStyle, View,
};

use super::export::{ExportFormat, export};
use super::subject::{Subject, job_in};
use super::{Context, animate, diagrams, job_file, layers, pictures};
use crate::args::{PathColour, PresetName, RenderArgs, ShowName};
use crate::console::peak_memory_mb;
use crate::failure::Failure;
use crate::merging::MergingArgs;
use crate::output;

/// Layers that need a job.
const OF_A_JOB: [ShowName; 5] =
    [ShowName::Tool, ShowName::Stock, ShowName::Scallop, ShowName::Uncut, ShowName::Gouges];
/// Layers that colour the whole model by themselves.
const PAINTED: [ShowName; 3] = [ShowName::Stock, ShowName::Scallop, ShowName::Uncut];

/// `claymill render`.
pub(crate) fn render(context: &Context, args: &RenderArgs) -> Result<ExitCode, Failure> {
    let began = Instant::now();
    let size = parse_size(&args.size)?;
    let job = job_in(&args.what)?;
    let needs_job = |s: &&ShowName| OF_A_JOB.contains(s);
    if let (None, Some(layer)) = (&job, args.show.iter().find(needs_job)) {
        let name = layer.to_possible_value().map_or_else(String::new, |v| v.get_name().to_owned());
        return Err(Failure::usage(
            format!("{} is a model: {name} is a layer of jobs", args.what.display()),
            "Name a job folder, made by `claymill plan`.",
        ));
    }
    let format = ExportFormat::of(&args.out).ok();
    let kind = if format.is_some() { Kind::Model } else { Kind::Picture };
    let names = names_of(args, format.is_some());
    let inputs = output::inputs(&args.what, job.as_ref(), args.model.as_deref());
    let out = output::begin(context, &args.out.with_file_name(&names[0]), kind, &inputs)?;
    names[1..].iter().try_for_each(|name| out.check_beside(name, kind))?;
    let subject = Subject::read(context, &args.what, job.as_ref(), args.model.as_deref(), &args.axes)?;
    let (model, axes) = (&subject.loaded.import.model, subject.axes);
    context.console.stage("merging");
    let (regions, region_of_face) = subject.regions(&args.what, job.as_ref())?;
    let program = if job.is_some() { read_moves(&args.what)? } else { Program::default() };
    let views = views(args, model, &region_of_face, &axes)?;
    context.console.stage("drawing");
    let cut = job.as_ref().map(pictures::cut_faces).filter(|cut| cut.len() == model.faces.len());
    let mut album = pictures::Album::new(model, &region_of_face, cut.as_deref(), regions.tolerance_mm)
        .with_sides(&regions.sheets);
    // Anything but a model format is a picture, as ever.
    if let Some(format) = format {
        context.console.stage("exporting");
        output::staged(&out, &args.out, |staged| {
            export(context.console, staged, format, model, &album, &region_of_face, &program)
        })?;
        out.finish(kind)?;
        return done(context, &Made { written: vec![args.out.clone()], ..Made::default() });
    }
    if let Some(focus) = views.iter().find_map(|v| v.focus) {
        album = album.for_scale(focus.diagonal() / f64::from(size[0].max(1)));
    }
    if args.show.iter().any(|s| PAINTED.contains(s)) {
        album = album.for_maps();
    }
    if args.zebra {
        album = album.for_reflections();
    }
    let mut scene = match &job {
        Some(job) => {
            let work = layers::Work { model, job, program: &program, folder: &args.what };
            of_job(context, args, &album, &subject.title, &work)?
        }
        None => album.scene(&subject.title, None, &args.show)?,
    };
    add_more(args, job.as_ref(), &subject.loaded, &mut scene)?;
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
    let renderer = Renderer::new()?;
    let is_path =
        |kind: LineKind| matches!(kind, LineKind::Cut | LineKind::Link | LineKind::Lead | LineKind::Rapid);
    let points = scene.lines.iter().filter(|l| is_path(l.kind)).map(|l| l.points.len()).sum();
    let mut made = Made { points, ..Made::default() };
    let staged: Vec<OsString> = if names.len() == 1 { vec![out.name().to_owned()] } else { names.clone() };
    for (k, (view, name)) in views.iter().zip(&staged).enumerate() {
        context.console.at("pictures", k as f64 / views.len() as f64);
        let before = if k == 0 { Duration::ZERO } else { began.elapsed() };
        let (staged, told) = (out.folder().join(name), args.out.with_file_name(&names[k]));
        let drawn = claymill_viewer::render_png(&renderer, &scene, view, &options, &staged);
        drawn.map_err(|e| Failure::from(e).about(out.folder(), &told))?;
        made.took.push(began.elapsed().saturating_sub(before));
        made.written.push(told);
    }
    let files: Vec<(OsString, Kind)> = staged.into_iter().map(|name| (name, kind)).collect();
    out.finish_all(&files)?;
    done(context, &made)
}

/// The scene of a job with its paths, or at a time of it.
fn of_job(
    context: &Context,
    args: &RenderArgs,
    album: &pictures::Album<'_>,
    title: &str,
    work: &layers::Work<'_>,
) -> Result<Scene, Failure> {
    let shown = |what: ShowName| args.show.contains(&what);
    let tools = layers::tools(work.job, args.holder.as_deref())?;
    let colours = album.colours();
    let style = StrokeStyle {
        region_colours: Some(&colours),
        by: match args.paths_by {
            PathColour::Region => ColourBy::Region,
            PathColour::Setup => ColourBy::Setup,
            PathColour::Kind => ColourBy::Kind,
            PathColour::Pass => ColourBy::Pass,
            PathColour::Feed => ColourBy::Feed,
        },
        tools: &tools,
        ..StrokeStyle::new(pictures::CHORD_MM)
    };
    let moment =
        layers::Moment { at: args.at.as_deref(), tools: &tools, allowance_mm: args.allowance, style };
    let in_time = args.at.is_some() || shown(ShowName::Stock);
    if in_time || shown(ShowName::Tool) {
        animate::has_moves(&args.what, work.program)?;
    }
    let with_paths = !args.no_paths && !in_time && !work.program.moves.is_empty();
    let paths = with_paths.then_some(pictures::Paths { program: work.program, style });
    // Colours of paths are told apart on a ground of one colour.
    let ground = |s: &ShowName| match (s, args.paths_by) {
        (ShowName::Regions, PathColour::Region) => *s,
        (ShowName::Regions, _) => ShowName::Model,
        _ => *s,
    };
    let show: Vec<ShowName> = args.show.iter().map(ground).collect();
    let mut scene = album.scene(title, paths, &show)?;
    if in_time {
        scene = layers::at_moment(scene, work, &moment, &args.show)?;
    } else if shown(ShowName::Tool) {
        layers::add_tool(&mut scene, work, &moment);
    }
    layers::add_measured(context, &mut scene, work, &args.show)?;
    if shown(ShowName::ControlPolygons) {
        scene.add_control_polygons(work.program, &tools);
    }
    Ok(scene)
}

/// What comes from the model and from merging it.
fn add_more(
    args: &RenderArgs,
    job: Option<&Job>,
    file: &ModelFile,
    scene: &mut Scene,
) -> Result<(), Failure> {
    if args.show.contains(&ShowName::ControlNets) {
        scene.add_control_nets(file.model());
    }
    let diagrams = [ShowName::Classes, ShowName::Worst, ShowName::IsoLines];
    if !args.show.iter().any(|s| diagrams.contains(s)) {
        return Ok(());
    }
    let named = job.and_then(|job| PresetName::from_str(&job.request.preset, true).ok());
    let preset = Preset::from(named.unwrap_or(PresetName::Clay));
    let toml = args.what.join(job_file::JOB_TOML);
    let merging =
        if job.is_some() && toml.exists() { job_file::read(&toml)?.merging } else { MergingArgs::default() };
    let merged = claymill::merge(file, &merging.merging(preset)?)?;
    diagrams::draw(scene, file.model(), &merged.found, &merged.options, &args.show);
    Ok(())
}

/// The views asked for, of the whole model or a part.
fn views(
    args: &RenderArgs,
    model: &Model,
    region_of_face: &[usize],
    axes: &Axes,
) -> Result<Vec<View>, Failure> {
    let named = || args.view.iter().map(|name| named_view(name, axes)).collect::<Result<Vec<_>, _>>();
    let views = match &args.camera {
        Some(camera) => vec![parse_camera(camera, axes)?],
        None => named()?,
    };
    if args.focus.is_empty() {
        return Ok(views);
    }
    let named = claymill::named_faces(model, region_of_face, &args.focus)?;
    let part = model.faces.iter().zip(named).filter(|(_, is_named)| *is_named);
    let focus = part.fold(Aabb::empty(), |b, (face, _)| b.union(&face.bounds()));
    Ok(views.into_iter().map(|v| v.clone().focused(&v.name, focus)).collect())
}

/// Names of the files to be written: of several views each has its own.
fn names_of(args: &RenderArgs, is_model: bool) -> Vec<OsString> {
    let out = &args.out;
    if is_model || args.camera.is_some() || args.view.len() < 2 {
        return vec![out.file_name().unwrap_or(out.as_os_str()).to_owned()];
    }
    args.view.iter().map(|view| named_after(out, view)).collect()
}

/// `car.png` for the view `iso`: `car-iso.png`.
fn named_after(out: &Path, view: &str) -> OsString {
    let mut name = out.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{view}."));
    name.push(out.extension().unwrap_or("png".as_ref()));
    name
}

/// What was written.
#[derive(Default)]
struct Made {
    written: Vec<PathBuf>,
    /// Time of each picture; the first one's with all that comes before it.
    took: Vec<Duration>,
    /// Of the tool paths, before they are thinned out.
    points: usize,
}

fn done(context: &Context, made: &Made) -> Result<ExitCode, Failure> {
    context.console.finish();
    for path in &made.written {
        context.console.say(path.display());
    }
    if context.json {
        let shown: Vec<String> = made.written.iter().map(|path| path.display().to_string()).collect();
        let mut value = match shown.as_slice() {
            [one] => serde_json::json!({ "written": one }),
            all => serde_json::json!({ "written": all }),
        };
        if !made.took.is_empty() {
            let seconds: Vec<f64> = made.took.iter().map(|t| (t.as_secs_f64() * 1e2).round() / 1e2).collect();
            value["seconds"] = seconds.into();
            value["path_points"] = made.points.into();
            value["peak_memory_mb"] = peak_memory_mb().round().into();
        }
        context.print_json(&value)?;
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
