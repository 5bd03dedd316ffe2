//! `claymill view`: a model or a job in a window, or one picture of that window.

use std::process::ExitCode;

use super::Context;
use crate::args::ViewArgs;
use crate::failure::Failure;

/// `claymill view`.
#[cfg(not(feature = "window"))]
pub(crate) fn view(_: &Context, args: &ViewArgs) -> Result<ExitCode, Failure> {
    Err(Failure::problem(
        format!("{}: this claymill was built without its window", args.what.display()),
        "Build it with the feature `window`, or make pictures with `claymill render`.",
    ))
}

#[cfg(feature = "window")]
pub(crate) use with_window::view;

#[cfg(feature = "window")]
mod with_window {
    use std::path::Path;
    use std::sync::Arc;
    use std::time::{Duration, Instant};

    use claymill::{free_sides, seconds_of_moves};
    use claymill_toolpath::{Kind, LONGEST_MADE, Output, Standing, VERIFY_FILE, read_moves, read_plain};
    use claymill_verify::{Verification, read_crests};
    use claymill_viewer::{ViewError, shows_material};
    use claymill_window::{Exhibit, Headless, JobToShow, Paint, Stage, WindowError, WindowOptions, show};

    use super::{Context, ExitCode, Failure, ViewArgs};
    use crate::commands::render::parse_size;
    use crate::commands::subject::{Subject, job_in};
    use crate::commands::{layers, pictures};
    use crate::console::{outln, peak_memory_mb};
    use crate::output;

    impl From<WindowError> for Failure {
        fn from(error: WindowError) -> Self {
            match error {
                WindowError::View(e) => e.into(),
                e @ WindowError::NoDisplay { .. } => Failure::problem(
                    e,
                    "Run it on a desktop, or with DISPLAY set to an X server (ssh -X, Xvfb). `claymill render` and \
                     `claymill view --picture PNG` need no display.",
                ),
            }
        }
    }

    /// `claymill view`.
    pub(crate) fn view(context: &Context, args: &ViewArgs) -> Result<ExitCode, Failure> {
        let size = parse_size(&args.size)?;
        let out = match &args.picture {
            Some(path) => {
                let inputs = output::inputs(&args.what, job_in(&args.what)?.as_ref(), args.model.as_deref());
                Some(output::begin(context, path, Kind::Picture, &inputs)?)
            }
            None => None,
        };
        let exhibit = exhibit(context, args)?;
        if let (Some(picture), Some(out)) = (&args.picture, out) {
            return save(context, exhibit, args, size, picture, out);
        }
        context.console.finish();
        let options = WindowOptions { size, dark: args.dark };
        let json = context.json;
        show(exhibit, options, &mut |said| {
            if json {
                outln!("{said}");
            }
        })?;
        Ok(ExitCode::SUCCESS)
    }

    /// The window as it opens, without one.
    fn save(
        context: &Context,
        exhibit: Exhibit,
        args: &ViewArgs,
        size: [u32; 2],
        path: &Path,
        out: Output,
    ) -> Result<ExitCode, Failure> {
        context.console.stage("drawing");
        let exhibit = Arc::new(exhibit);
        let began = Instant::now();
        let mut window = Headless::new(&exhibit, size)?;
        window.pane.desk.dark = args.dark;
        let prepared = began.elapsed();
        window.open()?;
        window.rest()?;
        output::write(out, Kind::Picture, &window.picture()?.png())?;
        context.console.finish();
        context.console.say(path.display());
        if context.json {
            let at_rest = window.last().map(|(_, took)| took);
            let [segments, drawn] = Stage::segments(&window.pane.desk);
            let turning = turn(&mut window)?;
            let picture = window.last().map(|(_, took)| took);
            let material = material(&mut window)?;
            let ms = |d: Duration| (d.as_secs_f64() * 1e4).round() / 10.0;
            context.print_json(&serde_json::json!({
                "written": path.display().to_string(),
                "adapter": window.adapter(),
                "segments": segments,
                "segments_drawn": drawn,
                "prepared_s": (prepared.as_secs_f64() * 1e2).round() / 1e2,
                "at_rest_ms": at_rest.map(ms),
                "turning_ms": ms(turning),
                "of_that_picture_ms": picture.map(ms),
                "material_ms": material.map(|m| {
                    serde_json::json!({ "anew": ms(m.anew), "on": ms(m.on), "back": ms(m.back), "anywhere": ms(m.anywhere) })
                }),
                "peak_memory_mb": peak_memory_mb().round(),
            }))?;
        }
        Ok(ExitCode::SUCCESS)
    }

    /// Turns the model by hand and tells the median time of a frame, panels included.
    fn turn(window: &mut Headless<'_>) -> Result<Duration, ViewError> {
        const FRAMES: usize = 24;
        window.begin_turning()?;
        let mut took = Vec::new();
        for i in 1..=FRAMES {
            let began = Instant::now();
            window.turn_to([6.0 * i as f32, 1.5 * i as f32])?;
            took.push(began.elapsed());
        }
        took.sort();
        Ok(took[FRAMES / 2])
    }

    /// Times until the material of a moment is in the picture, medians but for the first.
    struct MaterialTimes {
        /// At the end of the job, nothing being known.
        anew: Duration,
        /// Little steps on and back, and jumps.
        on: Duration,
        back: Duration,
        anywhere: Duration,
    }

    fn material(window: &mut Headless<'_>) -> Result<Option<MaterialTimes>, ViewError> {
        const STEPS: u32 = 15;
        let whole_s = window.pane.desk.duration_s();
        if whole_s <= 0.0 {
            return Ok(None);
        }
        window.pane.desk.layers.paint = Paint::Stock;
        let mut until_shown = |share: f64| -> Result<Duration, ViewError> {
            let began = Instant::now();
            window.pane.desk.clock.now_s = share * whole_s;
            window.frame(Vec::new())?;
            while window.pane.desk.is_cutting_material() {
                std::thread::sleep(Duration::from_millis(2));
                window.frame(Vec::new())?;
            }
            Ok(began.elapsed())
        };
        let anew = until_shown(1.0)?;
        let mut median = |share: &dyn Fn(u32) -> f64| -> Result<Duration, ViewError> {
            until_shown(share(0))?;
            let mut took = (1..=STEPS).map(|k| until_shown(share(k))).collect::<Result<Vec<_>, _>>()?;
            took.sort();
            Ok(took[took.len() / 2])
        };
        let step = |k: u32| f64::from(k) / 200.0;
        let on = median(&|k| 0.5 + step(k))?;
        let back = median(&|k| 0.5 - step(k))?;
        // Places that lie evenly and in no order.
        let anywhere = median(&|k| (f64::from(k) * 0.618_034).fract())?;
        Ok(Some(MaterialTimes { anew, on, back, anywhere }))
    }

    fn exhibit(context: &Context, args: &ViewArgs) -> Result<Exhibit, Failure> {
        let job = job_in(&args.what)?;
        let subject = Subject::read(context, &args.what, job.as_ref(), args.model.as_deref(), &args.axes)?;
        context.console.stage("merging");
        let (regions, region_of_face) = subject.regions(&args.what, job.as_ref())?;
        let Subject { title, loaded, axes } = subject;
        let model = loaded.import.model;
        context.console.stage("meshing");
        let meshes = pictures::meshes(&model, &pictures::PICTURE_MESH);
        pictures::warn_of_undrawn(context.console, &model, &meshes);
        let job = match job {
            Some(mut job) => {
                job.tools = layers::tools(&job, args.holder.as_deref())?;
                let program = read_moves(&args.what)?;
                if program.moves.is_empty() {
                    context.console.say("warning: the job holds no moves; the model alone is shown");
                }
                let seconds = seconds_of_moves(&job, &program);
                let verification = verification(context, &args.what);
                let crests = read_crests(&args.what, &job)
                    .map(|crests| Arc::new(crests.into_iter().map(|c| (c.foot, c.height_mm)).collect()));
                Some(JobToShow { job, program, seconds, verification, crests })
            }
            None => None,
        };
        let free_sides = match shows_material(&regions.sheets) {
            true => free_sides(&regions.sheets, model.faces.len()),
            false => Vec::new(),
        };
        Ok(Exhibit { title, model, meshes, region_of_face, regions, free_sides, axes, job })
    }

    /// What verification wrote, if it was written of these moves; a job is worth a look without.
    fn verification(context: &Context, folder: &Path) -> Option<Verification> {
        let standing = Standing::of(folder);
        if !standing.is_current() {
            context.console.say(format!("warning: {standing}"));
            return None;
        }
        let path = folder.join(VERIFY_FILE);
        let text = read_plain(&path, LONGEST_MADE).ok()?;
        let read = serde_json::from_slice(&text);
        read.map_err(|e| context.console.say(format!("warning: {}: {e}", path.display()))).ok()
    }
}
