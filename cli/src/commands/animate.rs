//! `claymill animate`: a film of the tool cutting a job, as animated PNG, GIF, video or storyboard.
//! Every frame is a picture at one time of the job's schedule; videos are encoded by ffmpeg.

use std::io::{Read as _, Write as _};
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};

use claymill::seconds_of_moves;
use claymill_toolpath::{Kind, Output, Program, read_job, read_moves};
use claymill_viewer::{Movie, PictureOptions, Places, Reel, Renderer, Stock, StrokeStyle, View};

use super::finished::title;
use super::pictures::{self, Album};
use super::render::{camera, parse_size};
use super::subject::Subject;
use super::{Context, layers};
use crate::args::{AnimateArgs, AxisArgs, ShowName};
use crate::failure::{Failure, advice_on};
use crate::{interrupt, output};

/// The model that the tool runs over.
const SHOWN: [ShowName; 3] = [ShowName::Regions, ShowName::Joints, ShowName::Trims];
/// Height of frames from which on lines have their full width, pixels.
const FULL_HEIGHT: f32 = 800.0;
/// Frames of a storyboard and how many stand side by side.
const STORYBOARD: (u32, u32) = (12, 3);
/// Frames that fit into memory without a thought: 2 GB.
const MOST_BYTES: u64 = 2_000_000_000;

/// What the extension asks for.
#[derive(Clone, Copy, PartialEq)]
enum Format {
    Png,
    Gif,
    Video,
}

fn format_of(path: &Path) -> Result<Format, Failure> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        Some("png" | "apng") => Ok(Format::Png),
        None if Output::is_standard(path) => Ok(Format::Png),
        Some("gif") => Ok(Format::Gif),
        Some("mp4" | "webm") => Ok(Format::Video),
        _ => Err(Failure::usage(
            format!("{}: the extension names no format of animations", path.display()),
            "Name the file .png (animated), .gif, .mp4 or .webm.",
        )),
    }
}

/// `claymill animate`.
pub(crate) fn animate(context: &Context, args: &AnimateArgs) -> Result<ExitCode, Failure> {
    let console = context.console;
    let format = format_of(&args.out)?;
    let size = parse_size(&args.size)?;
    let count = frames(args, format, size)?;
    if format == Format::Video && Command::new("ffmpeg").arg("-version").output().is_err() {
        return Err(Failure::problem(
            "there is no ffmpeg to make the video with",
            "Install it (apt-get install ffmpeg), or write a .gif or an animated .png.",
        ));
    }
    let job = read_job(&args.folder)?;
    let inputs = output::inputs(&args.folder, Some(&job), args.model.as_deref());
    let out = output::begin(context, &args.out, Kind::Picture, &inputs)?;
    let program = read_moves(&args.folder)?;
    has_moves(&args.folder, &program)?;
    let no_axes = AxisArgs { up: None, length: None };
    let subject = Subject::read(context, &args.folder, Some(&job), args.model.as_deref(), &no_axes)?;
    let (model, axes) = (&subject.loaded.import.model, subject.axes);
    let (regions, region_of_face) = subject.regions(&args.folder, Some(&job))?;
    let view = camera(args.camera.as_deref(), &args.view, &axes)?;

    console.stage("preparing");
    let cut = pictures::cut_faces(&job);
    let album =
        Album::new(model, &region_of_face, Some(&cut), regions.tolerance_mm).with_sides(&regions.sheets);
    let album = if args.stock.is_some() { album.for_maps() } else { album };
    let shown = if args.stock.is_some() { &SHOWN[..2] } else { &SHOWN[..] };
    let mut bare = album.scene(&title(&job), None, shown)?;
    bare.legend.clear();
    // Outlines that suit a large picture are heavy in a small one.
    let finer = (size[1] as f32 / FULL_HEIGHT).clamp(0.45, 1.0);
    bare.lines.iter_mut().for_each(|l| l.width_px *= finer);
    let colours = album.colours();
    let tools = layers::tools(&job, args.holder.as_deref())?;
    if let Some(tool) = tools.first() {
        bare.explain_tool(tool);
    }
    let style = StrokeStyle { region_colours: Some(&colours), tools: &tools, ..StrokeStyle::new(0.3) };
    let reel = Reel::new(bare, &program, &seconds_of_moves(&job, &program), &style);
    let mut stock = args.stock.map(|allowance_mm| Stock::of(reel.bare(), reel.course(), allowance_mm));

    console.stage("frames");
    console.expect("frames", u64::from(count), "frames");
    let renderer = Renderer::new()?;
    let options = PictureOptions { size, ..pictures::options(&axes) };
    let mut places = Places::default();
    let mut movie = Movie { frames: Vec::new(), frames_per_s: args.fps };
    for k in 0..count {
        console.at("frames", f64::from(k) / f64::from(count));
        let at_s = reel.duration_s() * f64::from(k) / f64::from(count.max(2) - 1);
        let view: View = reel.view(&view, at_s, args.follow);
        let mut scene = reel.scene(at_s);
        if let Some(stock) = &mut stock {
            stock.go_to(reel.bare(), reel.course(), at_s);
            stock.show(reel.bare(), &mut scene);
        }
        movie.frames.push(renderer.render_next(&scene, &view, &options, &mut places)?);
    }
    console.stage("writing");
    write(args, format, &movie, out)?;
    console.finish();
    let step_s = reel.duration_s() / f64::from(count.max(2) - 1);
    let pace = if args.storyboard {
        format!("one every {:.1} min of the machine's time", step_s / 60.0)
    } else {
        format!("{:.0} times as fast as the machine", step_s * f64::from(args.fps))
    };
    console.say(format!("{}: {count} frames, {pace}", args.out.display()));
    if context.json {
        context.print_json(
            &serde_json::json!({ "written": args.out.display().to_string(), "frames": count, "machining_s": reel.duration_s() }),
        )?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A job without moves has no time.
pub(crate) fn has_moves(folder: &Path, program: &Program) -> Result<(), Failure> {
    if program.moves.is_empty() {
        return Err(Failure::problem(
            format!("{} holds no moves", folder.display()),
            "Nothing was cut: `claymill plan` says why, and so does the report.",
        ));
    }
    Ok(())
}

/// How many frames, if they fit into memory.
fn frames(args: &AnimateArgs, format: Format, [width, height]: [u32; 2]) -> Result<u32, Failure> {
    if args.follow.is_some_and(|mm| !(mm.is_finite() && mm > 0.0)) {
        return Err(Failure::usage("--follow needs a size", "For example: --follow 300."));
    }
    if args.stock.is_some_and(|mm| !(mm.is_finite() && mm > 0.0)) {
        return Err(Failure::usage("--stock needs an allowance", "For example: --stock 3."));
    }
    if args.storyboard {
        if format != Format::Png {
            return Err(Failure::usage("a storyboard is one picture", "Name the file .png."));
        }
        return Ok(STORYBOARD.0);
    }
    if !(args.seconds > 0.0 && args.seconds <= 3600.0 && args.fps > 0 && args.fps <= 100) {
        return Err(Failure::usage(
            format!("{} s at {} frames a second is no animation", args.seconds, args.fps),
            "For example: --seconds 12 --fps 15.",
        ));
    }
    let count = (args.seconds * f64::from(args.fps)).round().max(2.0) as u32;
    let bytes = 4 * u64::from(width) * u64::from(height) * u64::from(count);
    if bytes > MOST_BYTES {
        return Err(Failure::usage(
            format!("{count} frames of {width} x {height} pixels are {} GB", bytes / 1_000_000_000),
            "Choose a smaller --size, fewer --seconds or a lower --fps.",
        ));
    }
    Ok(count)
}

fn write(args: &AnimateArgs, format: Format, movie: &Movie, out: Output) -> Result<(), Failure> {
    let impossible = |e: &dyn std::fmt::Display| Failure::problem(format!("{}: {e}", args.out.display()), "");
    let bytes = match format {
        _ if args.storyboard => movie.sheet(STORYBOARD.1).png(),
        Format::Png => movie.apng().map_err(|e| impossible(&e))?,
        Format::Gif => movie.gif().map_err(|e| impossible(&e))?,
        Format::Video => {
            video(&args.out, movie, &out)?;
            return Ok(out.finish(Kind::Picture)?);
        }
    };
    output::write(out, Kind::Picture, &bytes)
}

/// Through ffmpeg, in a folder beside the destination. An interruption takes the folder away: whenever ffmpeg comes to open
/// its file, it leaves none.
fn video(told: &Path, movie: &Movie, out: &Output) -> Result<(), Failure> {
    let failed = |e: &std::io::Error| Failure::problem(format!("{}: {e}", told.display()), advice_on(e));
    // The extension tells ffmpeg the format.
    let whole = out.folder().join("whole").with_extension(told.extension().unwrap_or_default());
    let done = encode(&whole, movie);
    interrupt::wait_if_interrupted();
    match done {
        Ok(None) => std::fs::rename(&whole, out.staged()).map_err(|e| failed(&e)),
        Ok(Some(said)) => Err(Failure::problem(
            format!("ffmpeg could not write {}: {said}", told.display()),
            "Where its build lacks the encoder, try .mp4, .webm or another ffmpeg, or write a .gif or an animated .png.",
        )),
        Err(e) => Err(failed(&e)),
    }
}

/// Sends the frames to ffmpeg; what it says where it fails.
fn encode(out: &Path, movie: &Movie) -> std::io::Result<Option<String>> {
    let Some(first) = movie.frames.first() else { return Ok(Some("there are no frames".to_owned())) };
    let mut ffmpeg = Command::new("ffmpeg")
        .args(["-y", "-loglevel", "error", "-f", "rawvideo", "-pixel_format", "rgb24"])
        .args(["-video_size", &format!("{}x{}", first.width, first.height)])
        .args(["-framerate", &movie.frames_per_s.to_string(), "-i", "-"])
        // Colours at half the size need even sides, and the matrix that players expect of such pictures.
        .args(["-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv"])
        .args(["-pix_fmt", "yuv420p", "-colorspace", "bt709", "-color_primaries", "bt709"])
        .args(["-color_trc", "bt709", "-color_range", "tv"])
        // Known again as one of ours.
        .args(["-metadata", "comment=claymill", "-metadata", "title=claymill"])
        .arg(out)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()?;
    let (pipe, errors) = (ffmpeg.stdin.take(), ffmpeg.stderr.take());
    // Read all the while: an ffmpeg whose complaints nobody reads stops taking frames.
    let listener = std::thread::spawn(move || {
        let mut said = Vec::new();
        let read = errors.map_or(Ok(0), |mut e| e.read_to_end(&mut said));
        read.map(|_| String::from_utf8_lossy(&said).trim().to_owned())
    });
    let sent = pipe.map_or(Ok(()), |mut pipe| movie.write_raw(&mut pipe).and_then(|()| pipe.flush()));
    let status = ffmpeg.wait()?;
    let said = listener.join().unwrap_or_else(|_| Ok(String::new()))?;
    // What ffmpeg says of itself comes before the broken pipe that it left.
    match (status.success(), said.is_empty()) {
        (true, _) => sent.map(|()| None),
        (false, true) => Ok(Some(status.to_string())),
        (false, false) => Ok(Some(said)),
    }
}
