//! Small models by chance, planned and verified from end to end: whatever is emitted enters no face.

mod frames;
mod parts;
mod sheets;
mod solids;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use claymill_nurbs::{Aabb, Model};
use claymill_paths::{Orientation, Plan, PlanError, PlanOptions, Regions, Strategy, plan};
use claymill_surface_merge::{Preset, merge};
use claymill_toolpath::{
    AskedSetup, FORMAT_VERSION, FolderWriter, FreeSide, HOLDER_CLEARANCE_MM, Job, ModelFacts, Program,
    Request, Tool, ToolRecord, read_moves,
};
use claymill_verify::{FindingCode, GougeSample, Severity, VerifyOptions, gouge_samples, verify_program};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// So many are planned in a usual run; all of them on request.
const FEW: u64 = 40;
const MANY: u64 = 1000;
/// No small model takes so long, whatever else the machine does.
const LONGEST: Duration = Duration::from_secs(900);
/// Of one in so many everything is measured, not gouges alone.
const FULLY: u64 = 4;
/// Findings that nothing emitted may give rise to.
const HARMFUL: [FindingCode; 4] =
    [FindingCode::Gouge, FindingCode::RapidTouches, FindingCode::Shank, FindingCode::Obstacle];

#[test]
fn few_small_models_are_planned_without_a_gouge() {
    plan_all(0..FEW);
}

/// `CLAYMILL_SEEDS=FROM-TO` chooses others.
#[test]
#[ignore = "an hour: `cargo test --release -p claymill-tests --test it -- --ignored --nocapture many_small_models`"]
fn many_small_models_are_planned_without_a_gouge() {
    let asked = std::env::var("CLAYMILL_SEEDS").ok();
    let asked = asked.as_deref().and_then(|text| {
        let (from, to) = text.split_once('-')?;
        Some(from.parse().ok()?..to.parse().ok()?)
    });
    plan_all(asked.unwrap_or(0..MANY));
}

/// What came of a seed.
enum Outcome {
    Planned(Vec<String>),
    /// There is nothing for the tool to do.
    Nothing(String),
}

fn plan_all(seeds: std::ops::Range<u64>) {
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    let next = AtomicU64::new(seeds.start);
    let (told, telling) = mpsc::channel();
    let (mut planned, mut wrong) = (0, Vec::new());
    let next = std::sync::Arc::new(next);
    for _ in 0..workers {
        let (told, next, end) = (told.clone(), next.clone(), seeds.end);
        std::thread::spawn(move || {
            loop {
                let seed = next.fetch_add(1, Ordering::Relaxed);
                if seed >= end || told.send((seed, None)).is_err() {
                    return;
                }
                let outcome = std::panic::catch_unwind(|| one(seed));
                let outcome = outcome.unwrap_or_else(|_| Outcome::Planned(vec!["a panic".into()]));
                if told.send((seed, Some(outcome))).is_err() {
                    return;
                }
            }
        });
    }
    drop(told);
    let mut begun: BTreeMap<u64, Instant> = BTreeMap::new();
    loop {
        match telling.recv_timeout(Duration::from_secs(1)) {
            Ok((seed, None)) => drop(begun.insert(seed, Instant::now())),
            Ok((seed, Some(outcome))) => {
                begun.remove(&seed);
                match outcome {
                    Outcome::Planned(found) => {
                        planned += 1;
                        wrong.extend(found);
                    }
                    Outcome::Nothing(why) => eprintln!("seed {seed}: {why}"),
                }
            }
            Err(mpsc::RecvTimeoutError::Timeout) => {}
            Err(mpsc::RecvTimeoutError::Disconnected) => break,
        }
        let hanging: Vec<_> = begun.iter().filter(|(_, at)| at.elapsed() > LONGEST).collect();
        assert!(hanging.is_empty(), "seeds that do not end: {hanging:?}; until then: {wrong:#?}");
    }
    assert!(wrong.is_empty(), "{} of {planned}: {wrong:#?}", wrong.len());
    assert!(planned * 10 > (seeds.end - seeds.start) * 7, "{planned} planned of {seeds:?}");
}

fn one(seed: u64) -> Outcome {
    let begun = Instant::now();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let solids::Solid { name, mut model } = solids::solid(&mut rng);
    let strategy = [Strategy::Planar, Strategy::Scallop, Strategy::Auto][(seed % 3) as usize];
    // The model is as large as suits the ball.
    let radius_mm = solids::between(&mut rng, 0.5f64.ln(), 100f64.ln()).exp();
    let radii = solids::between(&mut rng, 2.2f64.ln(), 40f64.ln()).exp();
    let scale = radii * radius_mm / size_mm(&model);
    for face in &mut model.faces {
        *face = scaled(face, scale);
    }
    // No more than some hundred passes.
    let least_mm = (radii * radius_mm / 80.0).powi(2) / (8.0 * radius_mm);
    let scallop_mm = least_mm.max([0.02, 0.05, 0.1][rng.random_range(0..3)]).min(0.05 * radius_mm);
    let what = format!("seed {seed}: {name}, {strategy}, ball {radius_mm:.3}, size {:.1}", radii * radius_mm);
    let outcome = match planned(&model, strategy, radius_mm, scallop_mm) {
        Err(why) => Outcome::Nothing(format!("{what}: {why}")),
        Ok((job, plan)) => {
            let folder = tempfile::tempdir().unwrap();
            let writer = FolderWriter::begin(&folder.path().join("job")).unwrap();
            writer.moves(&plan.program).unwrap();
            let program = read_moves(writer.path()).unwrap();
            Outcome::Planned(harms(&what, &model, &job, &program, seed.is_multiple_of(FULLY)))
        }
    };
    let took = begun.elapsed();
    if took > Duration::from_secs(30) {
        eprintln!("{what} took {took:.1?}");
    }
    outcome
}

/// What is wrong with the moves; all that the verifier measures if `fully`, else gouges alone.
fn harms(what: &str, model: &Model, job: &Job, program: &Program, fully: bool) -> Vec<String> {
    let options = VerifyOptions::default();
    if !fully {
        let samples = gouge_samples(model, job, program, &options, &()).unwrap();
        let deepest = samples.iter().max_by(|a, b| a.depth_mm.total_cmp(&b.depth_mm));
        let deepest = deepest.filter(|s| s.depth_mm > options.gouge_limit_mm);
        let told = |s: &GougeSample| {
            let at = &program.moves[s.move_seq as usize];
            let ends = [at.start(), at.end()].map(|p| p.coords);
            format!("{what}: {:.4} mm at {:?} on {:?} {ends:?}", s.depth_mm, s.foot, at.kind)
        };
        return deepest.map(told).into_iter().collect();
    }
    let found = verify_program(model, job, program, &options, &()).unwrap();
    let mut wrong = Vec::new();
    for finding in found.verdict.findings.iter().filter(|f| f.severity == Severity::Error) {
        let at = finding.place.as_ref().and_then(|p| p.move_seq).map(|seq| &program.moves[seq as usize]);
        let at = at.map(|m| (m.kind, m.setup.as_str(), [m.start(), m.end()].map(|p| p.coords)));
        let text = format!("{what}: {}, {at:?}, {:?}", finding.message, finding.place);
        eprintln!("{:?} {text}", finding.code);
        if HARMFUL.contains(&finding.code) {
            wrong.push(text);
        }
    }
    wrong
}

fn size_mm(model: &Model) -> f64 {
    let nets = model.faces.iter().flat_map(|f| f.surface.net());
    let bounds = nets.fold(Aabb::empty(), |mut b, h| {
        b.add(&(h.xyz() / h.w).into());
        b
    });
    (bounds.max - bounds.min).amax()
}

fn scaled(face: &claymill_nurbs::Face, by: f64) -> claymill_nurbs::Face {
    claymill_nurbs::Face { surface: face.surface.mapped(|p| p * by), ..face.clone() }
}

fn planned(
    model: &Model,
    strategy: Strategy,
    radius_mm: f64,
    scallop_mm: f64,
) -> Result<(Job, Plan), PlanError> {
    planned_on(model, Vec::new(), strategy, radius_mm, scallop_mm)
}

/// The same with other options than the usual ones.
fn planned_with(
    model: &Model,
    strategy: Strategy,
    radius_mm: f64,
    scallop_mm: f64,
    change: impl FnOnce(PlanOptions) -> PlanOptions,
) -> Result<(Job, Plan), PlanError> {
    let orientation = Orientation::new("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap();
    let usual = PlanOptions::new(Tool::ball(radius_mm), scallop_mm, orientation);
    planned_as(model, change(PlanOptions { strategy, ..usual }))
}

/// The same of a model of which faces have a side that is free of material.
fn planned_on(
    model: &Model,
    free_sides: Vec<FreeSide>,
    strategy: Strategy,
    radius_mm: f64,
    scallop_mm: f64,
) -> Result<(Job, Plan), PlanError> {
    planned_with(model, strategy, radius_mm, scallop_mm, |usual| PlanOptions { free_sides, ..usual })
}

fn planned_as(model: &Model, options: PlanOptions) -> Result<(Job, Plan), PlanError> {
    let PlanOptions { tool, scallop_mm, strategy, .. } = options;
    let face_area_mm2: Vec<f64> = model.faces.iter().map(claymill_nurbs::Face::area_mm2).collect();
    let mut merging = Preset::Clay.options();
    merging.ball_radius_mm = tool.radius_mm();
    let merged = merge(model, &merging).unwrap();
    let excluded = vec![false; model.faces.len()];
    let regions = Regions {
        merged: &merged,
        of_face: &merged.region_of_face,
        excluded: &excluded,
        face_area_mm2: &face_area_mm2,
    };
    let mut plan = plan(model, &regions, &options, &())?;
    let take = std::mem::take::<Vec<claymill_toolpath::Setup>>;
    let job = Job {
        format_version: FORMAT_VERSION,
        claymill_version: String::new(),
        model: ModelFacts {
            path: String::new(),
            place: None,
            sha256: String::new(),
            units: "mm".into(),
            unit_mm: 1.0,
            faces_in_file: model.faces.len(),
            faces_read: model.faces.len(),
            mirror: None,
            skipped: Vec::new(),
            area_mm2: face_area_mm2.iter().sum(),
            box_mm: [0.0; 6],
        },
        request: Request {
            allowance_mm: options.allowance_mm,
            stock_above_mm: options.stock_above_mm,
            tool,
            rest_of: None,
            levels: None,
            rest_above_mm: None,
            scallop_mm,
            strategy: strategy.to_string(),
            lines: None,
            guides: Vec::new(),
            pencil: false,
            link: options.link,
            preset: "clay".into(),
            up: "+z".into(),
            length: "+x".into(),
            only: Vec::new(),
            skip: Vec::new(),
            bounds: options.bounds.clone(),
            setups: (options.setups.iter())
                .map(|f| AskedSetup { name: f.name.to_string(), axis: f.axis().into() })
                .collect(),
            material_side: Vec::new(),
            check: Vec::new(),
            check_clearance_mm: 0.0,
            lead_mm_per_min: Some(options.feeds.lead_mm_per_min),
            holder_clearance_mm: HOLDER_CLEARANCE_MM,
            feed_mm_per_min: options.feeds.cut_mm_per_min,
            rapid_mm_per_min: options.feeds.rapid_mm_per_min,
            machine: options.machine.clone(),
        },
        tolerances: plan.tolerances.clone(),
        tools: vec![ToolRecord {
            id: claymill_paths::TOOL_ID.into(),
            tool,
            holder: None,
            setup_stick_out_mm: Default::default(),
        }],
        setups: take(&mut plan.setups),
        regions: plan.regions.clone(),
        totals: plan.totals,
        area: plan.area.clone(),
        faces: plan.faces.clone(),
        left_out: Vec::new(),
        stock: None,
        operations: Vec::new(),
        timings: Vec::new(),
        peak_memory_mb: 0.0,
    };
    Ok((job, plan))
}

/// A belly leans towards the sides by 8°: they get to it, if only just, with any strategy.
#[test]
fn what_is_cut_of_an_underside_that_slants_does_not_depend_on_the_strategy() {
    let model = solids::keel();
    let total_mm2: f64 = model.faces.iter().map(claymill_nurbs::Face::area_mm2).sum();
    for strategy in [Strategy::Planar, Strategy::Flow, Strategy::Scallop, Strategy::Auto] {
        let (job, plan) = planned(&model, strategy, 5.0, 0.2).unwrap();
        let options = VerifyOptions::default();
        let found = verify_program(&model, &job, &plan.program, &options, &()).unwrap();
        eprintln!("{strategy}: {:?} {:?}", found.coverage.by_state_mm2, found.verdict);
        let cut_mm2 = found.coverage.by_state_mm2[&claymill_verify::SurfaceState::Cut];
        assert!(cut_mm2 > 0.97 * total_mm2, "{strategy}: {cut_mm2} of {total_mm2} mm²");
        assert!(found.verdict.passed, "{strategy}: {:?}", found.verdict);
    }
}

/// The verifier knows by itself from where a model can be cut: a job that makes no use of a setup has left what it could cut.
#[test]
fn what_a_setup_that_is_not_made_use_of_could_cut_is_left() {
    let model = solids::keel();
    let (mut job, mut plan) = planned(&model, Strategy::Planar, 5.0, 0.5).unwrap();
    job.setups.retain(|setup| setup.name == "top");
    plan.program.moves.retain(|m| m.setup == "top");
    let found = verify_program(&model, &job, &plan.program, &VerifyOptions::default(), &()).unwrap();
    assert!(!found.verdict.passed, "{:?}", found.verdict);
    assert!(found.verdict.findings.iter().any(|f| f.code == FindingCode::ReachableLeft));
}

/// The ball's centre goes round in a small circle there.
#[test]
fn bores_hardly_wider_than_the_ball_are_cut() {
    const BORE_MM: f64 = 3.175;
    let model = solids::eye(BORE_MM, 8.89);
    let mut left = Vec::new();
    for ball_mm in [2.0, 2.5, 2.8, 2.9, 3.0, 3.1] {
        let (job, plan) = planned(&model, Strategy::Planar, ball_mm, 0.1).unwrap();
        let options = VerifyOptions::default();
        let found = verify_program(&model, &job, &plan.program, &options, &()).unwrap();
        let states = found.coverage.faces[6..].iter().map(|f| f.by_state_mm2.clone()).collect::<Vec<_>>();
        eprintln!("ball {ball_mm}: {states:.2?}, {:?}", found.verdict);
        left.extend((!found.verdict.passed).then_some(ball_mm));
    }
    assert!(left.is_empty(), "{left:?}");
}
