//! Verification: measures a finished job from its written files and the model alone.
//!
//! ```text
//!   job folder ─ toolpath ─► moves ─┬─ one by one ──────── order, feeds ────► sequence
//!                                   ├─ along the paths ──── closest point ──► gouge, contact
//!                                   ├─ between the passes ─ cusp ───────────► scallop crests
//!                                   ├─ above the model ──── lowered tool ───► rapids
//!                    obstacles ─────┼─ beside obstacles ─── triangles ──────► clearance
//!                    bounds ────────┼─ along the paths ──── boxes, shadow ──► bounds kept
//!   model file ─ exchange ─► faces ─┴─ over the faces ───── swept balls ────► residual, coverage
//!                                                                                 │
//!                                                             verify.json ◄─ verdict
//! ```
//!
//! Three quantities need three samplings. A gouge is smooth along a path, so it is measured on the path. A
//! scallop crest is sharp, so it is looked for where two passes meet. Coverage is a question of area, so it is
//! asked on points spread evenly over the faces. None of this shares code with the planner beyond the kernel:
//! the ball's distance is the exact closest point over all faces, and what the tool could have reached is
//! judged anew.
//!
//! ```no_run
//! use claymill_verify::{VerifyOptions, verify};
//! let result = verify("out".as_ref(), &VerifyOptions::default(), &())?;
//! println!("deepest gouge {} mm, passed: {}", result.gouge.deepest_mm, result.verdict.passed);
//! # Ok::<(), claymill_verify::VerifyError>(())
//! ```

// What is to be said is returned: only the command prints.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod across;
mod ahead;
mod allowance;
mod asked;
mod astray;
mod bounds;
mod capsule;
mod contact;
mod coverage;
mod crest;
mod crest_file;
mod crest_peak;
mod directions;
mod distribution;
mod drop;
mod end;
mod error;
mod golden;
mod holder;
mod levels;
mod limits;
mod mesh;
mod obstacles;
mod openings;
mod operations;
mod options;
mod parts;
mod rapids;
mod reach;
mod report;
mod scene;
mod sequence;
mod shadow;
mod sides;
pub mod stock;
mod surface;
mod swept;
mod tight;
mod track;
mod verdict;
mod way_in;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use claymill_nurbs::{ClosestPoints, MeshOptions, Model};
use claymill_toolpath::{
    FORMAT_VERSION, Job, Kept, LATEST_FORMAT_VERSION, Monitor, Program, Stage, read_job, read_moves_judged,
    sha256_of,
};

use crate::parts::Parts;
use crate::reach::AskedOfStock;

pub use crest_file::{CRESTS_FILE, read_crests, write_crests};
pub use error::VerifyError;
pub use holder::{HolderClearance, RegionStickOut, ShankContact};
pub use levels::{ClosedPockets, LevelsFound};
pub use options::{SCALLOP_BAR, USUAL_RADIUS_MM, USUAL_SCALLOP_MM, VerifyOptions};
pub use report::{
    AreaAt, BallShare, BoundsKept, Contact, Coverage, CrestSample, Crests, FaceCoverage, Fault, Gouge,
    GougeSample, HISTOGRAM_BIN, HISTOGRAM_BINS, Obstacles, OperationFound, Place, Rapids, RegionCrests,
    ResidualSample, Scallop, Sequence, SidesKept, SurfaceResidual, SurfaceState, TooTight, Verification,
};
pub use verdict::{Finding, FindingCode, Severity, Verdict};

/// Verifies a job folder against its model file.
///
/// # Errors
/// Folder or model cannot be read, the model has changed since, or a move is unusable. Whatever is wrong with
/// the job itself is a finding in the result's verdict.
pub fn verify(
    folder: &Path,
    options: &VerifyOptions,
    monitor: &dyn Monitor,
) -> Result<Verification, VerifyError> {
    monitor.at(Stage::Reading, 0.0);
    let job = known_job(folder)?;
    let (program, judged) = read_moves_judged(folder, &job)?;
    let (model, options) = asked_of(folder, &job, options)?;
    let found = verify_program(&model, &job, &program, &options, monitor)?;
    Ok(Verification { judged: Some(judged), ..found })
}

/// Verifies other moves than the folder's own against its model: those of a program that was written from it. Their order and
/// their feeds are not judged: the program is held against the job's moves where it is read.
///
/// # Errors
/// As [`verify()`].
pub fn verify_instead(
    folder: &Path,
    program: &Program,
    options: &VerifyOptions,
    monitor: &dyn Monitor,
) -> Result<Verification, VerifyError> {
    let job = known_job(folder)?;
    let (model, options) = asked_of(folder, &job, options)?;
    Ok(measure_all(
        &model,
        &job,
        (program, None, AskedOfStock::default()),
        &options,
        &Kept::nowhere(),
        monitor,
    )?
    .0)
}

/// The job, if its format is known; the other files are not looked at before.
fn known_job(folder: &Path) -> Result<Job, VerifyError> {
    let job = read_job(folder)?;
    if !(FORMAT_VERSION..=LATEST_FORMAT_VERSION).contains(&job.format_version) {
        return Err(VerifyError::Version { found: job.format_version, known: LATEST_FORMAT_VERSION });
    }
    Ok(job)
}

/// The very model that a job was planned on, and options that know the job's folder.
fn asked_of(
    folder: &Path,
    job: &Job,
    options: &VerifyOptions,
) -> Result<(Model, VerifyOptions), VerifyError> {
    let path = model_of(folder, job, options.model.as_deref())?;
    let mut model = claymill_exchange::read(&path)?.model;
    if let Some(mirror) = job.model.mirror {
        model = mirror.of(&model);
    }
    Ok((model, VerifyOptions { folder: folder.to_owned(), ..options.clone() }))
}

/// The model file of a job: as told, else where the job says. It must be the one that the job was planned on.
///
/// # Errors
/// It cannot be read, or has changed.
pub fn model_of(folder: &Path, job: &Job, told: Option<&Path>) -> Result<PathBuf, VerifyError> {
    let path = told.map_or_else(|| job.model.find(folder), Path::to_owned);
    let found = sha256_of(&path)?;
    if found != job.model.sha256 {
        return Err(VerifyError::ModelChanged { path, expected: job.model.sha256.clone(), found });
    }
    Ok(path)
}

/// Verifies moves that were read back from their file against a model that is in memory.
///
/// # Errors
/// A move is not a curve, or names a tool or setup that the job does not list.
pub fn verify_program(
    model: &Model,
    job: &Job,
    program: &Program,
    options: &VerifyOptions,
    monitor: &dyn Monitor,
) -> Result<Verification, VerifyError> {
    Ok(verify_with_crests(model, job, program, options, monitor)?.0)
}

/// As [`verify_program`], and the crests that were measured, along the passes: the data of a scallop map.
///
/// # Errors
/// As [`verify_program`].
pub fn verify_with_crests(
    model: &Model,
    job: &Job,
    program: &Program,
    options: &VerifyOptions,
    monitor: &dyn Monitor,
) -> Result<(Verification, Vec<CrestSample>), VerifyError> {
    verify_keeping(model, job, program, options, &Kept::nowhere(), monitor)
}

/// As [`verify_with_crests`], where findings along moves are kept and taken from what is kept.
///
/// # Errors
/// As [`verify_program`].
pub fn verify_keeping(
    model: &Model,
    job: &Job,
    program: &Program,
    options: &VerifyOptions,
    kept: &Kept,
    monitor: &dyn Monitor,
) -> Result<(Verification, Vec<CrestSample>), VerifyError> {
    if !job.operations.is_empty() {
        return operations::measure(model, job, program, options, monitor);
    }
    let sequence = Some(sequence::measure(job, program, 0));
    measure_all(model, job, (program, sequence, AskedOfStock::default()), options, kept, monitor)
}

/// The moves, what is known of their sequence, and the stock that there is.
fn measure_all(
    model: &Model,
    job: &Job,
    (program, sequence, stock): (&Program, Option<Sequence>, AskedOfStock<'_>),
    options: &VerifyOptions,
    kept: &Kept,
    monitor: &dyn Monitor,
) -> Result<(Verification, Vec<CrestSample>), VerifyError> {
    let allowance_mm = job.request.allowance_mm;
    let (job, program) = &allowance::on_the_surface(job, program)?;
    let avoided = limits::avoided_model(model, job);
    let bench = Bench::new([model, &avoided], job, program, options, monitor)?;
    let scene = &bench.scene;
    let swept = swept::Swept::new(&scene.tracks, scene.options.chord_mm);
    let mesh = mesh::Mesh::joined(model, &bench.meshes, &scene.obstacles.triangles);
    let reach = reach::Reach::new(scene, &mesh, &bench.meshes).in_stock(stock);
    let outward = reach.is_of_faces_alone().then(|| reach.outward());
    let parts = Parts::new(kept, scene, outward, &mesh);

    let stage = |name| scene::Stage::begin(name, monitor);
    let (gouge, contact, touched, _) =
        contact::measure(scene, &reach, &parts, &stage(Stage::GougeAndContact))?;
    let rapids = rapids::measure(scene, &bench.meshes, &reach, &stage(Stage::Rapids))?;
    let obstacles = obstacles::measure(scene, &stage(Stage::Obstacles))?;
    let bounds = bounds::measure(scene, reach.limits(), &stage(Stage::Bounds))?;
    let shank = holder::measure_shank(scene, &bench.meshes, &reach, &parts, &stage(Stage::Shank))?;
    let holder = holder::measure(scene, &bench.meshes, &reach, &stage(Stage::Holder))?;
    let (mut crests, samples, seeds) =
        crest::measure(scene, &swept, &reach, &parts, &stage(Stage::ScallopCrests))?;
    let faces = surface::measure(scene, &bench.meshes, &swept, &reach, &stage(Stage::Coverage))?;
    crest_peak::raise(scene, &swept, &reach, &faces, seeds, &mut crests);
    let coverage = coverage::account(scene, &faces, tight::measure(scene, &reach, &faces));
    let sides = sides::account(scene, touched, &faces);
    let scallop = Scallop { crests, surface: coverage::residual_on_cut_area(scene, &faces) };
    let verdict = verdict::conclude(
        job,
        options,
        &verdict::Measured {
            gouge: &gouge,
            contact: Some(&contact),
            sequence: sequence.as_ref(),
            rapids: &rapids,
            obstacles: obstacles.as_ref(),
            bounds: bounds.as_ref(),
            shank: &shank,
            holder: holder.as_ref(),
            scallop: Some(&scallop),
            coverage: Some(&coverage),
            sides: sides.as_ref(),
        },
    );
    let found = Verification {
        format_version: FORMAT_VERSION,
        judged: None,
        scallop_mm: job.request.scallop_mm,
        allowance_mm,
        gouge,
        contact,
        sequence,
        rapids,
        obstacles,
        bounds,
        shank: Some(shank),
        holder,
        scallop,
        coverage,
        sides,
        stock: None,
        operations: Vec::new(),
        verdict,
    };
    Ok((found, samples))
}

/// The smallest stick-out at which the job's holders keep their clearance on every move of a setup, mm, whatever they have now:
/// by tool and setup. Empty where no tool has a holder.
///
/// # Errors
/// As [`verify_program`].
pub fn stick_outs_needed_mm(
    model: &Model,
    job: &Job,
    program: &Program,
    options: &VerifyOptions,
    monitor: &dyn Monitor,
) -> Result<BTreeMap<(String, String), f64>, VerifyError> {
    let (job, program) = &allowance::on_the_surface(job, program)?;
    let avoided = limits::avoided_model(model, job);
    let bench = Bench::new([model, &avoided], job, program, options, monitor)?;
    let mesh = mesh::Mesh::joined(model, &bench.meshes, &bench.scene.obstacles.triangles);
    let reach = reach::Reach::new(&bench.scene, &mesh, &bench.meshes);
    let stage = scene::Stage::begin(Stage::Holder, monitor);
    let found = holder::measure(&bench.scene, &bench.meshes, &reach, &stage)?;
    Ok(found.map(|f| f.needed_mm()).unwrap_or_default())
}

/// The crests alone, along the passes, with nothing else measured: the data of a scallop map.
///
/// # Errors
/// As [`verify_program`].
pub fn crest_samples(
    model: &Model,
    job: &Job,
    program: &Program,
    options: &VerifyOptions,
    monitor: &dyn Monitor,
) -> Result<Vec<CrestSample>, VerifyError> {
    let (job, program) = &allowance::on_the_surface(job, program)?;
    let avoided = limits::avoided_model(model, job);
    let bench = Bench::new([model, &avoided], job, program, options, monitor)?;
    let scene = &bench.scene;
    let swept = swept::Swept::new(&scene.tracks, scene.options.chord_mm);
    let mesh = mesh::Mesh::joined(model, &bench.meshes, &scene.obstacles.triangles);
    let reach = reach::Reach::new(scene, &mesh, &bench.meshes);
    Ok(crest::measure(
        scene,
        &swept,
        &reach,
        &Parts::nowhere(),
        &scene::Stage::begin(Stage::ScallopCrests, monitor),
    )?
    .1)
}

/// What the swept balls leave on points spread evenly over all faces, face by face: the data of a residual
/// map.
///
/// # Errors
/// As [`verify_program`].
pub fn residual_samples(
    model: &Model,
    job: &Job,
    program: &Program,
    options: &VerifyOptions,
    monitor: &dyn Monitor,
) -> Result<Vec<ResidualSample>, VerifyError> {
    let (job, program) = &allowance::on_the_surface(job, program)?;
    let avoided = limits::avoided_model(model, job);
    let bench = Bench::new([model, &avoided], job, program, options, monitor)?;
    let swept = swept::Swept::new(&bench.scene.tracks, bench.scene.options.chord_mm);
    let mesh = mesh::Mesh::joined(model, &bench.meshes, &bench.scene.obstacles.triangles);
    let reach = reach::Reach::new(&bench.scene, &mesh, &bench.meshes);
    let stage = scene::Stage::begin(Stage::Coverage, monitor);
    let faces = surface::measure(&bench.scene, &bench.meshes, &swept, &reach, &stage)?;
    Ok(faces.into_iter().flat_map(|f| f.samples).collect())
}

/// Places where the ball enters a face by more than a micrometre, in the order of the moves, at most 200 a move.
///
/// # Errors
/// As [`verify_program`].
pub fn gouge_samples(
    model: &Model,
    job: &Job,
    program: &Program,
    options: &VerifyOptions,
    monitor: &dyn Monitor,
) -> Result<Vec<GougeSample>, VerifyError> {
    let (job, program) = &allowance::on_the_surface(job, program)?;
    let avoided = limits::avoided_model(model, job);
    let bench = Bench::new([model, &avoided], job, program, options, monitor)?;
    let mesh = mesh::Mesh::joined(model, &bench.meshes, &bench.scene.obstacles.triangles);
    let reach = reach::Reach::new(&bench.scene, &mesh, &bench.meshes);
    let stage = scene::Stage::begin(Stage::GougeAndContact, monitor);
    Ok(contact::measure(&bench.scene, &reach, &Parts::nowhere(), &stage)?.3)
}

/// What all measurements need.
struct Bench<'a> {
    scene: scene::Scene<'a>,
    meshes: Vec<Option<claymill_nurbs::FaceMesh>>,
}

impl<'a> Bench<'a> {
    /// Of a model, and of its faces to be avoided as one of their own.
    fn new(
        [model, avoided]: [&'a Model; 2],
        job: &'a Job,
        program: &Program,
        options: &VerifyOptions,
        monitor: &dyn Monitor,
    ) -> Result<Self, VerifyError> {
        let tracks = track::Track::all(job, program)?;
        monitor.at(Stage::PreparingModel, 0.0);
        monitor.go_on()?;
        let options = options.suited_to(job);
        let obstacles = obstacles::ObstacleSet::read(job, &options)?;
        end::check_alone(&tracks, job, !obstacles.triangles.is_empty())?;
        astray::check(model, &obstacles.triangles, program)?;
        let mesh_options =
            MeshOptions { deviation_mm: options.mesh_deviation_mm, longest_edge_mm: options.mesh_edge_mm };
        let mut meshes = mesh::face_meshes(model, &mesh_options);
        // Where the planner kept a whole box clear nothing else is asked of it.
        let mut kept_clear = Vec::new();
        for face in surface::uncovered_faces(job).filter(|&face| face < model.faces.len()) {
            meshes[face] = None;
            kept_clear.push(model.faces[face].bounds());
        }
        Ok(Bench {
            meshes,
            scene: scene::Scene {
                model,
                job,
                options,
                closest: ClosestPoints::new(model),
                tracks,
                obstacles,
                avoided: ClosestPoints::new(avoided),
                free_sides: scene::free_sides(model, job),
                kept_clear,
            },
        })
    }
}
