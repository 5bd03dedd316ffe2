use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use claymill_controller::Machine;
use claymill_exchange::read_mesh;
use claymill_nurbs::{Model, Point3};
use claymill_paths::{Feeds, Plan, PlanOptions, Regions, Strategy, check_tools, plan_around};
use claymill_surface_merge::Preset;
use claymill_toolpath::{
    Area, Bounds, FORMAT_VERSION, FilePlace, FolderWriter, HOLDER_CLEARANCE_MM, Holder, JOB_FILE, Job,
    Judged, LinkStyle, MachineLimits, ModelFacts, Obstacle, Program, REGIONS_FILE, REPORT_FILE, Setup,
    Skipped, Tool, ToolRecord, Totals, VERIFY_FILE, read_moves, sha256_of,
};
use claymill_verify::{
    Verdict, Verification, VerifyOptions, stick_outs_needed_mm, verify_with_crests, write_crests,
};

use claymill_viewer::ReportPicture;
use serde::Serialize;

use super::job_file::{self, JOB_TOML};
use super::report::{self, Finished};
use super::{Context, Loaded, box_mm, left_out, merge, orientation, pictures, plan_summary, verify};
use crate::args::{JobOptions, LinkName, PlanArgs, PresetName, StrategyName};
use crate::console::{counted, peak_memory_mb};
use crate::failure::Failure;
use crate::{interrupt, material, select};

/// Written instead of a stick-out: the least that does.
pub(super) const LEAST: &str = "auto";
/// Where nothing else is asked for.
pub(super) const USUAL_TOOL: &str = "ball:10";
pub(super) const USUAL_SCALLOP_MM: f64 = 0.1;
/// Largest number of a tool.
const LARGEST_TOOL: u32 = 999_999;
/// Holders are asked to keep no more than this from the model, mm.
const LARGEST_CLEARANCE_MM: f64 = 1000.0;

/// No machine cuts faster, mm/min.
const LARGEST_FEED_MM_PER_MIN: f64 = 500_000.0;
/// Passes are fitted and written to a few tenths of a micrometre: lower scallops cannot be told from that, mm.
const LOWEST_SCALLOP_MM: f64 = 0.001;

/// A job with all defaults filled in.
pub(crate) struct Request {
    pub(super) model: PathBuf,
    pub(super) options: JobOptions,
    pub(super) tool: Tool,
    pub(super) holder: Option<Holder>,
    /// The holder sticks out as far as it has to.
    pub(super) least_stick_out: bool,
    pub(super) holder_clearance_mm: f64,
    /// The tool whose rest is cut.
    rest_of: Option<Tool>,
    pub(super) scallop_mm: f64,
    pub(super) strategy: StrategyName,
    pub(super) steep_deg: f64,
    lines: Option<usize>,
    guides: Vec<Point3>,
    bounds: Bounds,
    pub(super) check_clearance_mm: f64,
    pub(super) rapid_clearance_mm: f64,
    pub(super) link: LinkStyle,
    pub(super) preset: PresetName,
    pub(super) feeds: Feeds,
    pub(super) machine: MachineLimits,
}

/// What is of interest after a job.
pub(crate) struct Done {
    pub(crate) region_of_face: Vec<usize>,
    pub(crate) exit: ExitCode,
    pub(crate) job: Job,
    pub(crate) program: Program,
    pub(crate) found: Verification,
    pub(crate) scallop_map: Option<ReportPicture>,
}

/// What `claymill plan --json` prints: the totals, and what came of them.
#[derive(Serialize)]
struct Summary<'a> {
    folder: &'a Path,
    passed: bool,
    verdict: &'a Verdict,
    area: &'a Area,
    #[serde(flatten)]
    totals: &'a Totals,
}

/// `claymill plan`.
pub(crate) fn plan(context: &Context, args: &PlanArgs) -> Result<ExitCode, Failure> {
    let options = job_file::with(args.job.options(), args.job_file.as_deref())?;
    let request = Request::new(&args.model, &options)?;
    Ok(run(context, &request, &args.out)?.exit)
}

impl Request {
    /// Id of the tool: its number in the machine, where that is known.
    fn tool_id(&self) -> String {
        self.options
            .tool_number
            .map_or_else(|| claymill_paths::TOOL_ID.to_owned(), |number| format!("T{number}"))
    }

    pub(crate) fn new(model: &Path, options: &JobOptions) -> Result<Self, Failure> {
        let tool = options.tool.as_deref().unwrap_or(USUAL_TOOL).parse::<Tool>();
        let tool = tool.map_err(|e| {
            Failure::usage(e, "For example: --tool ball:10, or --tool ball:5,taper:3,length:30,shank:12.")
        })?;
        let least = options.holder.as_deref().and_then(|text| text.trim().strip_prefix(LEAST));
        // What the tool has to stick out is known when there are paths; until then the ball does.
        let text = least.map(|sections| format!("{}{sections}", tool.radius_mm()));
        let text = text.as_deref().or(options.holder.as_deref());
        let holder = text.map(|text| holder(text, &tool)).transpose()?;
        let holder_clearance_mm = holder_clearance(options.holder_clearance)?;
        let rest_of = options.rest_of.as_deref().map(str::parse::<Tool>).transpose();
        let rest_of = rest_of.map_err(|e| Failure::usage(e, "For example: --rest-of ball:10."))?;
        let scallop_mm = options.scallop.unwrap_or(USUAL_SCALLOP_MM);
        if (0.0..LOWEST_SCALLOP_MM).contains(&scallop_mm) {
            return Err(Failure::usage(
                format!(
                    "scallop height {scallop_mm} mm is below {LOWEST_SCALLOP_MM} mm, to which passes are exact"
                ),
                "Usual scallop heights are 0.02 to 0.2 mm, for example --scallop 0.1.",
            ));
        }
        // Said before the model is read, which may take a while.
        check_tools(&tool, rest_of.as_ref(), scallop_mm)?;
        let machine = options.machine.as_deref().map(Machine::read).transpose()?;
        let feeds = feeds(options.feed, machine.as_ref())?;
        if options.angle.is_some_and(|angle| !angle.is_finite()) {
            return Err(Failure::usage("the angle of the rows must be a number", "For example: --angle 45."));
        }
        if options.tool_number.is_some_and(|number| !(1..=LARGEST_TOOL).contains(&number)) {
            let what = format!("a tool has a number from 1 to {LARGEST_TOOL}");
            return Err(Failure::usage(what, "For example: --tool-number 12."));
        }
        let strategy = options.strategy.unwrap_or(StrategyName::Planar);
        Ok(Request {
            model: model.to_owned(),
            tool,
            holder,
            least_stick_out: least.is_some(),
            holder_clearance_mm: holder_clearance_mm.unwrap_or(HOLDER_CLEARANCE_MM),
            rest_of,
            scallop_mm,
            strategy,
            steep_deg: options.steep_deg()?,
            lines: options.lines(strategy)?,
            guides: options.guides(strategy)?,
            bounds: options.bounds.bounds()?,
            check_clearance_mm: options.check_clearance_mm()?,
            rapid_clearance_mm: options.rapid_clearance_mm()?,
            link: match options.link {
                Some(LinkName::Box) => LinkStyle::Box,
                Some(LinkName::Lace) | None => LinkStyle::Lace,
            },
            preset: options.preset.unwrap_or(PresetName::Clay),
            feeds,
            machine: machine.map(|m| m.limits()).unwrap_or_default(),
            options: options.clone(),
        })
    }
}

/// The feeds as asked for, or as usual, as far as the machine allows them.
fn feeds(asked_mm_per_min: Option<f64>, machine: Option<&Machine>) -> Result<Feeds, Failure> {
    let usual = Feeds::default();
    let cut_mm_per_min = asked_mm_per_min.unwrap_or(usual.cut_mm_per_min);
    if !(cut_mm_per_min > 0.0 && cut_mm_per_min <= LARGEST_FEED_MM_PER_MIN) {
        let what = format!("feed {cut_mm_per_min} mm/min is not between 0 and {LARGEST_FEED_MM_PER_MIN}");
        return Err(Failure::usage(what, "For example: --feed 6000."));
    }
    let Some(machine) = machine else { return Ok(Feeds { cut_mm_per_min, ..usual }) };
    let most = machine.feed.max_mm_per_min;
    if asked_mm_per_min.is_some_and(|asked| asked > most) {
        let what = format!("feed {cut_mm_per_min} mm/min is more than {most}, the most of {}", machine.name);
        return Err(Failure::usage(what, "Give a lower --feed, or another --machine."));
    }
    Ok(Feeds {
        cut_mm_per_min: cut_mm_per_min.min(most),
        lead_mm_per_min: usual.lead_mm_per_min.min(most),
        rapid_mm_per_min: machine.feed.rapid_mm_per_min,
    })
}

/// A distance that can be kept.
pub(crate) fn holder_clearance(asked_mm: Option<f64>) -> Result<Option<f64>, Failure> {
    match asked_mm {
        Some(mm) if !(0.0..=LARGEST_CLEARANCE_MM).contains(&mm) => Err(Failure::usage(
            format!(
                "holders cannot keep {mm} mm from the model: it must be between 0 and {LARGEST_CLEARANCE_MM}"
            ),
            "For example: --holder-clearance 2.",
        )),
        asked => Ok(asked),
    }
}

/// The holder as written on the command line or in a job file.
pub(crate) fn holder(text: &str, tool: &Tool) -> Result<Holder, Failure> {
    Holder::parse(text, tool)
        .map_err(|e| Failure::usage(e, "For example: --holder 60, or --holder 60:27-34x50,63x26."))
}

impl From<StrategyName> for Strategy {
    fn from(name: StrategyName) -> Self {
        match name {
            StrategyName::Planar => Strategy::Planar,
            StrategyName::Iso => Strategy::Iso,
            StrategyName::Scallop => Strategy::Scallop,
            StrategyName::Waterline => Strategy::Waterline,
            StrategyName::SteepShallow => Strategy::SteepShallow,
            StrategyName::IsoPatch => Strategy::IsoPatch,
            StrategyName::Auto => Strategy::Auto,
        }
    }
}

/// The main job, from the model file to the finished folder.
pub(crate) fn run(context: &Context, request: &Request, out: &Path) -> Result<Done, Failure> {
    let console = context.console;
    let folder = FolderWriter::begin(out)?;
    folder.leftovers().into_iter().for_each(interrupt::remove_on_interrupt);
    let loaded = context.load(&request.model)?;
    let model = &loaded.import.model;
    let sha256 = sha256_of(&request.model)?;
    let orientation = orientation(console, &request.options.axes, &loaded)?;

    console.stage("merging");
    let preset = Preset::from(request.preset);
    let mut options = request.options.merging.options(preset, model)?;
    options.ball_radius_mm = request.tool.radius_mm();
    options.feed_mm_per_min = request.feeds.cut_mm_per_min;
    let merged = merge::regions(model, &options)?;
    let mut regions = merge::record(&merged, preset);
    merge::add_quality(&mut regions, model, &merged, options.ball_radius_mm);
    console.say(format!(
        "regions   {} in {}, {}",
        counted(model.faces.len(), "face"),
        counted(regions.regions.len(), "region"),
        counted(regions.joints.len(), "joint")
    ));

    console.stage("planning");
    let asked = &request.options;
    let (excluded, avoided) =
        select::left_out(model, &merged.region_of_face, &asked.only, &asked.skip, &asked.bounds.avoid)?;
    regions.sheets =
        material::find(&loaded, &merged, orientation.up.vector(), &request.options.material_side)?;
    material::say(console, &regions.sheets, &excluded);
    let plan_options = PlanOptions {
        tool: request.tool,
        rest_of: request.rest_of,
        scallop_mm: request.scallop_mm,
        strategy: request.strategy.into(),
        steep_deg: request.steep_deg,
        lines: request.lines,
        guides: request.guides.clone(),
        pencil: request.options.pencil,
        row_angle_deg: request.options.angle,
        free_sides: material::free_sides(&regions.sheets, model.faces.len()),
        bounds: Bounds { avoid: avoided, ..request.bounds.clone() },
        check_clearance_mm: request.check_clearance_mm,
        clearance_mm: request.rapid_clearance_mm,
        link: request.link,
        orientation,
        feeds: request.feeds,
        machine: request.machine.clone(),
    };
    let to_cut = Regions {
        merged: &merged,
        of_face: &merged.region_of_face,
        excluded: &excluded,
        face_area_mm2: &loaded.face_area_mm2,
    };
    plan_summary::warn_of_much(console, &plan_options, &to_cut);
    let (check, triangles) = obstacles(console, &request.options, out)?;
    let at = |stage: &str, share: f64| console.at(stage, share);
    let mut plan = plan_around(model, &to_cut, &triangles, &plan_options, &at)?;
    left_out::say(console, &loaded, &plan.left_out);
    for (record, areas) in regions.regions.iter_mut().zip(&plan.region_setup_area_mm2) {
        record.setup_area_mm2.clone_from(areas);
    }
    plan_summary::say_plan(console, &plan);

    console.stage("writing");
    let tool_id = request.tool_id();
    plan.program.moves.iter_mut().for_each(|m| m.tool.clone_from(&tool_id));
    folder.moves(&plan.program)?;
    let seconds = std::mem::take(&mut plan.seconds);
    let mut job = job(request, &loaded, sha256, &plan_options, plan);
    job.model.place = Some(FilePlace::of(&request.model, out));
    job.request.check_clearance_mm = if check.is_empty() { 0.0 } else { request.check_clearance_mm };
    job.request.check = check;

    console.stage("verifying");
    let program = read_moves(folder.path())?;
    if request.least_stick_out {
        choose_stick_outs(console, model, &mut job, &program)?;
    }
    folder.text(JOB_TOML, &job_file::text(request, orientation)?)?;
    verify::expect(console, program.moves.len(), job.totals.passes, model.faces.len());
    let at = |stage: &str, share: f64| console.at(stage, share);
    let (mut found, crests) = verify_with_crests(model, &job, &program, &VerifyOptions::default(), &at)?;
    let judged = Judged::of(folder.path(), &job)?;
    found.judged = Some(judged.clone());
    for needed in found.holder.iter().flat_map(|h| &h.regions) {
        let record = regions.regions.iter_mut().find(|r| r.id == needed.region);
        let record = record.map(|r| &mut r.stick_out_needed_mm);
        record.map(|r| r.insert(needed.setup.clone(), needed.stick_out_needed_mm));
    }
    folder.json(REGIONS_FILE, &regions)?;
    folder.json(VERIFY_FILE, &found)?;
    write_crests(folder.path(), &judged, &crests)?;
    verify::say(context, &found);

    console.stage("pictures");
    let finished = Finished {
        model,
        job: &job,
        regions: &regions,
        region_of_face: &merged.region_of_face,
        program: &program,
        seconds: &seconds,
        found: &found,
        crests: &crests,
        orientation,
    };
    let sights = pictures::take(console, &finished, folder.path())?;
    let job = Job { timings: console.finish(), peak_memory_mb: peak_memory_mb(), ..job.clone() };
    folder.json(JOB_FILE, &job)?;
    report::write(&Finished { job: &job, ..finished }, &sights, folder.path(), out)?;
    if let Some(kept) = folder.finish()? {
        console.say(format!("kept      what came into the folder meanwhile: {}", kept.display()));
    }
    let seconds: f64 = job.timings.iter().map(|t| t.seconds).sum();
    console.say(format!("job       {} ({seconds:.1} s, {:.0} MB)", out.display(), job.peak_memory_mb));
    console.say(format!("report    {}", out.join(REPORT_FILE).display()));
    if context.json {
        context.print_json(&Summary {
            folder: out,
            passed: found.verdict.passed,
            verdict: &found.verdict,
            area: &job.area,
            totals: &job.totals,
        })?;
    }
    Ok(Done {
        exit: verify::exit_code(&found),
        region_of_face: merged.region_of_face,
        scallop_map: sights.scallop_map().cloned(),
        job,
        program,
        found,
    })
}

/// Lets the tool stick out in each setup as far as it has to there, in whole millimetres.
fn choose_stick_outs(
    console: &crate::console::Console,
    model: &Model,
    job: &mut Job,
    program: &Program,
) -> Result<(), Failure> {
    let at = |stage: &str, share: f64| console.at(stage, share);
    let needed = stick_outs_needed_mm(model, job, program, &VerifyOptions::default(), &at)?;
    for tool in &mut job.tools {
        let of =
            |setup: &Setup| Some((setup.name.clone(), *needed.get(&(tool.id.clone(), setup.name.clone()))?));
        let mine: Vec<(String, f64)> = job.setups.iter().filter_map(of).collect();
        let Some(holder) = &mut tool.holder else { continue };
        for (setup, needed_mm) in &mine {
            holder.stick_out_mm = needed_mm.ceil();
            console.say(format!(
                "holder    {setup}: {holder}, {needed_mm:.2} mm of stick-out are needed, {} mm are taken",
                holder.stick_out_mm
            ));
        }
        tool.setup_stick_out_mm = mine.into_iter().map(|(setup, mm)| (setup, mm.ceil())).collect();
        // Whoever does not look at setups has one that does in all of them.
        if let Some(most_mm) = tool.setup_stick_out_mm.values().copied().reduce(f64::max) {
            holder.stick_out_mm = most_mm;
        }
    }
    Ok(())
}

/// The meshes that nothing may touch: their records and all their triangles.
fn obstacles(
    console: &crate::console::Console,
    options: &JobOptions,
    folder: &Path,
) -> Result<(Vec<Obstacle>, Vec<[Point3; 3]>), Failure> {
    let unit_mm = options.mesh_unit.unwrap_or(1.0);
    let (mut records, mut triangles) = (Vec::new(), Vec::new());
    for path in &options.check {
        let mesh = read_mesh(path, unit_mm)?;
        let name = path.display();
        if mesh.open_edges() > 0 {
            console.say(format!(
                "warning: {name} has {} open edges: nothing guards its inside",
                mesh.open_edges()
            ));
        }
        let size = mesh.bounds().max - mesh.bounds().min;
        console.say(format!(
            "obstacle  {name}: {} triangles, {:.1} x {:.1} x {:.1} mm",
            mesh.triangles.len(),
            size.x,
            size.y,
            size.z
        ));
        let place = Some(FilePlace::of(path, folder));
        records.push(Obstacle { path: name.to_string(), place, sha256: sha256_of(path)?, unit_mm });
        triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| mesh.vertices[i as usize])));
    }
    Ok((records, triangles))
}

fn job(request: &Request, loaded: &Loaded, sha256: String, options: &PlanOptions, plan: Plan) -> Job {
    let report = &loaded.import.report;
    Job {
        format_version: FORMAT_VERSION,
        claymill_version: env!("CARGO_PKG_VERSION").to_owned(),
        model: ModelFacts {
            path: request.model.display().to_string(),
            place: None,
            sha256,
            units: report.units.declared.clone(),
            unit_mm: report.units.mm_per_unit,
            faces_in_file: report.faces_in_file,
            faces_read: report.faces_read,
            skipped: report
                .skipped
                .iter()
                .map(|s| Skipped { entity: s.entity.clone(), reason: s.reason.clone() })
                .collect(),
            area_mm2: loaded.face_area_mm2.iter().sum(),
            box_mm: box_mm(&loaded.bounds),
        },
        request: claymill_toolpath::Request {
            tool: request.tool,
            rest_of: request.rest_of,
            lines: request.lines,
            guides: request.guides.iter().map(|at| (*at).into()).collect(),
            pencil: request.options.pencil,
            scallop_mm: request.scallop_mm,
            strategy: options.strategy.to_string(),
            link: request.link,
            preset: merge::name(&request.preset),
            up: options.orientation.up.to_string(),
            length: options.orientation.front.to_string(),
            only: request.options.only.clone(),
            skip: request.options.skip.clone(),
            material_side: request.options.material_side.clone(),
            bounds: options.bounds.clone(),
            check: Vec::new(),
            check_clearance_mm: 0.0,
            holder_clearance_mm: request.holder_clearance_mm,
            feed_mm_per_min: options.feeds.cut_mm_per_min,
            lead_mm_per_min: Some(options.feeds.lead_mm_per_min),
            rapid_mm_per_min: options.feeds.rapid_mm_per_min,
            machine: options.machine.clone(),
        },
        tolerances: plan.tolerances,
        tools: vec![ToolRecord {
            id: request.tool_id(),
            tool: request.tool,
            holder: request.holder.clone(),
            setup_stick_out_mm: BTreeMap::new(),
        }],
        setups: plan.setups,
        regions: plan.regions,
        totals: plan.totals,
        area: plan.area,
        faces: plan.faces,
        left_out: left_out::records(loaded, &plan.left_out),
        timings: Vec::new(),
        peak_memory_mb: 0.0,
    }
}
