//! `claymill plan`: the main job, from the model file to the finished folder.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;

use claymill_exchange::read_mesh;
use claymill_nurbs::{Model, Point3};
use claymill_paths::{Frame, Orientation, Plan, PlanError, PlanOptions, Regions, plan_around};
use claymill_surface_merge::Preset;
use claymill_toolpath::{
    Area, AskedSetup, Bounds, FORMAT_VERSION, FilePlace, FolderWriter, JOB_FILE, Job, Judged, ModelFacts,
    Obstacle, Program, REGIONS_FILE, REPORT_FILE, Setup, Skipped, ToolRecord, Totals, VERIFY_FILE,
    read_moves, sha256_of,
};
use claymill_verify::{
    Verdict, Verification, VerifyOptions, stick_outs_needed_mm, verify_with_crests, write_crests,
};

use claymill_viewer::ReportPicture;
use serde::Serialize;

use super::finished::Finished;
use super::job_file::{self, JOB_TOML};
use super::request::Request;
use super::{Context, Loaded, box_mm, left_out, merge, orientation, pictures, plan_summary, report, verify};
use crate::args::{JobOptions, PlanArgs};
use crate::console::{counted, peak_memory_mb};
use crate::failure::Failure;
use crate::{interrupt, material, select};

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

/// The setups that were asked for by name; none if all five usual ones may be used.
fn chosen_setups(orientation: Orientation, names: &[String]) -> Result<Vec<Frame>, Failure> {
    let of_name = |name: &String| {
        orientation.setup(name).map_err(PlanError::from)?.ok_or_else(|| {
            Failure::usage(
                format!("there is no setup `{name}`"),
                "Setups are top, left, right, front, rear and bottom, for example --setups top,bottom.",
            )
        })
    };
    names.iter().map(of_name).collect()
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
        setups: chosen_setups(orientation, &asked.setups)?,
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
            setups: (options.setups.iter())
                .map(|f| AskedSetup { name: f.name.to_owned(), axis: f.axis().into() })
                .collect(),
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
