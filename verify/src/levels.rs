//! An operation that roughs by levels: engagement, what it leaves as stock, and links that run through some. It cuts no surface, so
//! crests and coverage are not asked for; gouges are, against the allowance.
//!
//! ```text
//!        n ↑  ╭──────╮     A place is within reach where the tool, a hair off its contact, holds nothing on the mesh above
//!      ────┴──┤ tool ├     itself from a setup of the operation. There no more stock may be left than allowance and band.
//!     ━━━━━━━━━━━━━━━━━
//! ```
//!
//! Over a wall stock counts as far as the wall is the nearest face: farther off it stands over the floor. A stair that is low over a
//! floor is as wide as the floor.

use std::collections::BTreeMap;

use claymill_nurbs::{FaceMesh, Model, Point3, Vector3};
use claymill_toolpath::{
    Cancelled, FORMAT_VERSION, Job, Levels, Monitor, Move, MoveKind, Program, Setup, Stage, ToolRecord,
};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tracing::info_span;

use crate::across::across;
use crate::asked::excluded_faces;
use crate::end::EndBody;
use crate::error::VerifyError;
use crate::options::VerifyOptions;
use crate::parts::Parts;
use crate::reach::Reach;
use crate::report::{
    BoundsKept, Coverage, Crests, Place, Rapids, Scallop, Sequence, SurfaceResidual, Verification,
};
use crate::scene::Scene;
use crate::stock::{
    Ground, LeftBand, LevelEngagement, StockCheck, StockContact, StockError, StockLeft, StockSample,
    engagement_on,
};
use crate::surface::spread;
use crate::verdict::{Finding, FindingCode, Measured, Severity, conclude};
use crate::way_in::gets_in;
use crate::{Bench, allowance, contact, holder, mesh, rapids, scene};

/// The engagement may exceed the limit by this, degrees: how exactly arcs are written and measured.
const ENGAGEMENT_SLACK_DEG: f64 = 0.5;
/// More of the area within reach than this may not have more stock than the band.
const LEFT_SHARE: f64 = 0.01;
/// And more than this share of the tool's cross-section: of stock that is all but done any corner is a large share.
const LEFT_SECTION: f64 = 0.01;
/// From this share on it is said.
const SAID_SHARE: f64 = 1e-3;
/// Less stock than the allowance by this is cut into, mm: the bar for gouges.
const LESS_MM: f64 = 5e-3;
/// Samples of the model, about.
const SAMPLES: f64 = 20_000.0;
const SAMPLES_PER_FACE: usize = 4;
/// The tool is looked for this far off its contact, mm, and no farther than half of the band: triangles stand for the faces.
const OFF_MM: f64 = 0.15;
const MESH_MM: f64 = 0.03;
/// A wall may lean over by rounding (`n·axis`), and ground that leans by less (1°) is level.
const UPRIGHT: f64 = -2e-3;
const LEVEL_COSINE: f64 = 0.999_85;
/// Ground that leans by less (60°) from level is a floor, and more is a wall.
const FLOOR_COSINE: f64 = 0.5;
/// The largest ball at a wall enters nothing by more, mm.
const BALL_MM: f64 = 1e-3;
/// Over level ground the tool is looked for with its middle over the place, and with the place below so many of its edges.
const EDGES: u32 = 8;
/// Places of a move at which its axis is held against a box; and it may leave that by as much, mm.
const PLACES_ON_MOVE: u32 = 16;
const BEYOND_BOX_MM: f64 = 0.02;
/// Stock is looked for as far as this above allowance and band, mm.
const BEYOND_MM: f64 = 20.0;

/// What was found of levels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LevelsFound {
    /// What was asked for.
    pub asked: Levels,
    /// The engagement along all moves that stay on a level, with the largest and its place.
    pub engagement: LevelEngagement,
    /// Straight lead-ins and links that run through stock.
    pub links: StockContact,
    /// Stock over what is within reach and had stock, against the band.
    pub left: StockLeft,
    /// What had stock in pockets into which the tool has no way; that is not within reach.
    #[serde(default)]
    pub closed: ClosedPockets,
}

/// Places of a model at which an end can stand.
#[derive(Debug, Default)]
pub(crate) struct Standing {
    /// To which it gets, each with all of the poses that bring it there if it has a holder.
    reached: Vec<(StockSample, Vec<Pose>)>,
    /// In pockets into which it has no way.
    closed: Vec<StockSample>,
    /// Distance that the holder keeps, mm.
    holder_mm: f64,
}

/// A setup of the operation, and a tip of the tool with which the surface is touched, in model coordinates.
type Pose = (usize, Point3);

/// Pockets in which an end could stand and into which it has no way: it does not cut in its middle, and has no room to move.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ClosedPockets {
    /// Area of their walls and floors, mm².
    pub area_mm2: f64,
    /// Its share of all on which the end could stand.
    pub share: f64,
    /// Diameter about the axis that does not cut, mm.
    pub dead_centre_mm: f64,
    /// A place in one of them.
    pub at: Option<Place>,
}

/// Measures all of levels that asks nothing of the stock, and returns the places on which the end can stand.
pub(crate) fn measure_moves(
    model: &Model,
    job: &Job,
    (program, sequence): (&Program, Sequence),
    options: &VerifyOptions,
    monitor: &dyn Monitor,
) -> Result<(Verification, Standing), VerifyError> {
    let allowance_mm = job.request.allowance_mm;
    let rapids = rapids_of(model, job, program, options, monitor)?;
    let (job, program) = &allowance::on_the_surface(job, program)?;
    let options =
        &VerifyOptions { mesh_deviation_mm: options.mesh_deviation_mm.min(MESH_MM), ..options.clone() };
    let nothing = Model::default();
    let bench = Bench::new([model, &nothing], job, program, options, monitor)?;
    let scene = &bench.scene;
    let mesh = mesh::Mesh::joined(model, &bench.meshes, &scene.obstacles.triangles);
    let reach = Reach::new(scene, &mesh, &bench.meshes);
    let stage = |name| scene::Stage::begin(name, monitor);
    let parts = Parts::nowhere();
    let (gouge, contact, ..) = contact::measure(scene, &reach, &parts, &stage(Stage::GougeAndContact))?;
    let shank = holder::measure_shank(scene, &bench.meshes, &reach, &parts, &stage(Stage::Shank))?;
    let holder = holder::measure(scene, &bench.meshes, &reach, &stage(Stage::Holder))?;
    let samples = standing(scene, &bench.meshes, &reach, &stage(Stage::Coverage))?;
    let bounds = axis_in_its_box(job, program)?;
    let measured = Measured {
        gouge: &gouge,
        contact: None,
        sequence: Some(&sequence),
        rapids: &rapids,
        obstacles: None,
        bounds: bounds.as_ref(),
        shank: &shank,
        holder: holder.as_ref(),
        scallop: None,
        coverage: None,
        sides: None,
    };
    let verdict = conclude(job, options, &measured);
    let found = Verification {
        format_version: FORMAT_VERSION,
        judged: None,
        scallop_mm: job.request.scallop_mm,
        allowance_mm,
        gouge,
        contact,
        sequence: Some(sequence),
        rapids,
        obstacles: None,
        bounds,
        shank: Some(shank),
        holder,
        scallop: no_scallop(),
        coverage: no_coverage(job.area.total_mm2),
        sides: None,
        stock: None,
        operations: Vec::new(),
        verdict,
    };
    Ok((found, samples))
}

/// Rapids over the model with the tool as it is: they go up and down beside walls from which passes keep just the allowance.
fn rapids_of(
    model: &Model,
    job: &Job,
    program: &Program,
    options: &VerifyOptions,
    monitor: &dyn Monitor,
) -> Result<Rapids, VerifyError> {
    let nothing = Model::default();
    let bench = Bench::new([model, &nothing], job, program, options, monitor)?;
    let mesh = mesh::Mesh::joined(model, &bench.meshes, &bench.scene.obstacles.triangles);
    let reach = Reach::new(&bench.scene, &mesh, &bench.meshes);
    let stage = scene::Stage::begin(Stage::Rapids, monitor);
    Ok(rapids::measure(&bench.scene, &bench.meshes, &reach, &stage)?)
}

/// How far the tool's axis leaves the box that it is to stay in, on moves that are no rapids; `None` where there is no box.
fn axis_in_its_box(job: &Job, program: &Program) -> Result<Option<BoundsKept>, VerifyError> {
    let Some(sides) = job.request.bounds.centre_within_mm else { return Ok(None) };
    let mut kept = BoundsKept::default();
    for m in program.moves.iter().filter(|m| m.kind != MoveKind::Rapid) {
        let curve = m.curve()?;
        let (from, to) = curve.domain();
        let mut worst_mm = 0.0_f64;
        for k in 0..=PLACES_ON_MOVE {
            let at = from + (to - from) * f64::from(k) / f64::from(PLACES_ON_MOVE);
            let p = curve.point(at);
            let beyond = (0..3).map(|i| (sides[i] - p[i]).max(p[i] - sides[i + 3])).fold(0.0, f64::max);
            kept.samples += 1;
            worst_mm = worst_mm.max(beyond);
            if beyond > kept.beyond_max_mm {
                kept.beyond_max_mm = beyond;
                kept.beyond_at = Some(Place {
                    point_mm: p.into(),
                    move_seq: Some(m.seq),
                    parameter: Some(at),
                    face: None,
                    entity: None,
                });
            }
        }
        kept.beyond += u64::from(worst_mm > BEYOND_BOX_MM);
    }
    Ok(Some(kept))
}

/// Levels leave no crests.
fn no_scallop() -> Scallop {
    Scallop {
        crests: Crests::default(),
        surface: SurfaceResidual { samples: 0, p99_mm: 0.0, mean_mm: 0.0, above_limit_share: 0.0 },
    }
}

/// Nor do they cut a surface.
fn no_coverage(total_mm2: f64) -> Coverage {
    Coverage {
        total_mm2,
        by_state_mm2: BTreeMap::new(),
        reachable_left_at: Vec::new(),
        faces: Vec::new(),
        too_tight: None,
        least_length_mm: 0.0,
        planner_difference_mm2: BTreeMap::new(),
    }
}

/// Places of all faces on which the tool can stand, from a setup of the operation.
fn standing(
    scene: &Scene<'_>,
    meshes: &[Option<FaceMesh>],
    reach: &Reach<'_>,
    stage: &scene::Stage<'_>,
) -> Result<Standing, Cancelled> {
    let excluded = excluded_faces(scene);
    let areas: Vec<f64> = scene.model.faces.par_iter().map(claymill_nurbs::Face::area_mm2).collect();
    let sample_mm2 = areas.iter().sum::<f64>() / SAMPLES;
    let tool = &scene.job.request.tool;
    let body = EndBody { radius_mm: tool.radius_mm(), corner_mm: tool.corner_radius_mm() };
    let band_mm = scene.job.request.levels.map_or(OFF_MM, |levels| levels.band_mm);
    let off_mm = OFF_MM.min(0.5 * band_mm);
    let farthest_mm = scene.job.request.allowance_mm + band_mm + BEYOND_MM;
    let on_face = |face: usize| {
        let (Some(mesh), false) = (&meshes[face], excluded[face]) else { return Vec::new() };
        let count = ((areas[face] / sample_mm2).ceil() as usize).max(SAMPLES_PER_FACE);
        let surface = &scene.model.faces[face].surface;
        let spots = spread(&scene.model.faces[face], mesh, count);
        let area_mm2 = areas[face] / spots.len().max(1) as f64;
        let of_spot = |uv: &claymill_nurbs::Point2| {
            let point = surface.point(uv.x, uv.y);
            let (normal, _) = surface.normal(uv.x, uv.y)?;
            let sides = [(true, normal), (false, -normal)].into_iter();
            let free = sides.filter(|(along, _)| scene.free_sides[face].allows(*along)).map(|side| side.1);
            let stands = free.filter_map(|normal| {
                let stands = stands(scene, reach, &body, [&point.coords, &normal], off_mm)?;
                let ahead_mm = if stands.is_floor {
                    0.5 * reach.setup(0).clear_ahead_mm(&point, &normal, 2.0 * farthest_mm)
                } else {
                    // Farther from a wall other faces are nearer: a low stair over a floor runs on up to there.
                    scene.closest.largest_ball_mm(&point, &normal, [0.0, farthest_mm], BALL_MM)
                };
                Some((stands, StockSample { point, normal, area_mm2, ahead_mm }))
            });
            stands.reduce(|a, b| if b.0.gets_in && !a.0.gets_in { b } else { a })
        };
        spots.iter().filter_map(of_spot).collect::<Vec<_>>()
    };
    let faces = (0..meshes.len()).into_par_iter();
    let all = faces.map(|face| stage.part(meshes.len(), || on_face(face)));
    let all = all.collect::<Result<Vec<_>, Cancelled>>()?.into_iter().flatten();
    let (reached, closed): (Vec<_>, Vec<_>) = all.partition(|(stands, _)| stands.gets_in);
    Ok(Standing {
        reached: reached.into_iter().map(|(stands, sample)| (sample, stands.poses)).collect(),
        closed: closed.into_iter().map(|(_, sample)| sample).collect(),
        holder_mm: scene.holder_clearance_mm(),
    })
}

/// How a tool stands in a place.
#[derive(Default)]
struct Stands {
    /// Whether there is a way to it.
    gets_in: bool,
    /// Whether it is a floor rather than a wall from one of the setups in which there is.
    is_floor: bool,
    /// All of the poses to which there is one, if it has a holder.
    poses: Vec<Pose>,
}

/// Whether the tool gets to a place from the side of its normal, holding nothing above itself, from some setup; `None` where it
/// cannot even stand.
fn stands(
    scene: &Scene<'_>,
    reach: &Reach<'_>,
    body: &EndBody,
    [place, n]: [&Vector3; 2],
    off_mm: f64,
) -> Option<Stands> {
    let place = Point3::from(*place);
    let dead_centre_mm = scene.job.request.levels.map_or(0.0, |l| l.dead_centre_of_mm(2.0 * body.radius_mm));
    let mut found: Option<Stands> = None;
    let axes = scene.job.setups.iter().map(|record| Vector3::from(record.axis));
    let mut setups: Vec<(usize, f64, Vector3)> = axes.enumerate().map(|(k, a)| (k, n.dot(&a), a)).collect();
    // What is a wall in one setup may be a floor in another.
    setups.sort_by(|a, b| b.1.total_cmp(&a.1));
    for (setup, facing, axis) in setups {
        let (is_held, view) = (reach.has_holder(setup), reach.setup(setup));
        if facing < UPRIGHT {
            break;
        }
        let is_free = |at: &Point3| !view.may_hold(at, body);
        let mut stands = |tip: Point3| {
            let at = view.in_frame(&(tip + n * off_mm));
            let stands = is_free(&at) && !reach.is_held_off(setup, &at);
            let gets_in = stands && gets_in(&at, dead_centre_mm, &is_free);
            if stands {
                let found = found.get_or_insert_default();
                found.gets_in |= gets_in;
                found.is_floor |= gets_in && facing > FLOOR_COSINE;
                if gets_in && is_held {
                    found.poses.push((setup, tip + n * off_mm));
                }
            }
            // What the holder does to stock is asked of all poses.
            gets_in && !is_held
        };
        let is_level = facing >= LEVEL_COSINE;
        let flat_mm = body.radius_mm - body.corner_mm;
        let tip = if is_level { place } else { body.tip_over(&place, n, &axis) };
        let x = across(&axis);
        let y = axis.cross(&x);
        let beside = |k: u32| {
            let (sine, cosine) = (std::f64::consts::TAU * f64::from(k) / f64::from(EDGES)).sin_cos();
            place + (x * cosine + y * sine) * flat_mm
        };
        if stands(tip) || (is_level && (0..EDGES).any(|k| stands(beside(k)))) {
            break;
        }
    }
    found
}

/// What levels do to the stock, of which the operation's moves are `moves` of all, with the `tools` of all; `whole` follows the stock
/// through all moves, and `until` ends with the operation.
pub(crate) fn measure_stock(
    (job, asked, tools): (&Job, Levels, &[ToolRecord]),
    program: &Program,
    moves: std::ops::Range<usize>,
    [whole, until]: [&StockCheck<'_>; 2],
    standing: &Standing,
    monitor: &dyn Monitor,
) -> Result<LevelsFound, StockError> {
    let keep_going = &|| monitor.go_on().is_ok();
    let stage = scene::Stage::begin(Stage::Stock, monitor);
    let so_far = &program.moves[..moves.end];
    let own = |m: &Move| (moves.start as u64..moves.end as u64).contains(&m.seq);
    let mut engagement: Option<LevelEngagement> = None;
    for setup in &job.setups {
        let is_wanted = |m: &Move| own(m) && m.setup == setup.name;
        let Some(first) = so_far.iter().position(is_wanted) else { continue };
        let time = whole.time_of(first)?;
        let tell = |p: &Point3, limit_mm| whole.told_at(p, time, limit_mm);
        let ground = Ground { bounds: whole.initial().bounds(), tell: &tell };
        let measure = || engagement_on(&ground, so_far, tools, &is_wanted, keep_going);
        let one = info_span!("engagement", setup = setup.name).in_scope(measure)?;
        match &mut engagement {
            Some(all) => all.add(one),
            None => engagement = Some(one),
        }
    }
    // A lead-in along a level cuts, within the engagement; one straight down must not.
    let is_straight = |k: &usize| {
        let m = &program.moves[*k];
        let way = m.end() - m.start();
        let goes_down = way.dot(&Vector3::from(m.axis_start)) < -0.5 * way.norm();
        m.degree == 1 && (m.kind == MoveKind::Link || (m.kind == MoveKind::LeadIn && goes_down))
    };
    let straight: Vec<usize> = moves.clone().filter(is_straight).collect();
    let proof = |&k: &usize| {
        let _span = info_span!("link in stock", seq = k).entered();
        let proof = || whole.rapid_is_clear(k, whole.time_of(k)?);
        stage.part(straight.len(), proof).map_err(|Cancelled| StockError::Stopped)?
    };
    let mut links = StockContact::default();
    straight.par_iter().map(proof).collect::<Result<Vec<_>, _>>()?.into_iter().for_each(|p| links.add(p));
    let allowance_mm = job.request.allowance_mm;
    let had_stock =
        |s: &StockSample| whole.initial().contains(&(s.point + s.normal * (allowance_mm + LESS_MM)));
    let last_in = |setup: &Setup| moves.clone().rev().find(|&k| program.moves[k].setup == setup.name);
    let last_in: Vec<Option<usize>> = job.setups.iter().map(last_in).collect();
    // What stands in the way of a holder when its setup is done was never taken out of it there.
    let gets_there = |(setup, tip): &Pose| {
        let axis = Vector3::from(job.setups[*setup].axis);
        let tip = tip + axis * job.request.allowance_mm;
        let struck = |last| until.struck_at(last, &tip, &axis, standing.holder_mm);
        last_in[*setup].and_then(struck).is_none()
    };
    let is_reached = |(sample, poses): &(StockSample, Vec<Pose>)| {
        had_stock(sample) && (poses.is_empty() || poses.iter().any(gets_there))
    };
    let reached = standing.reached.par_iter().filter(|place| is_reached(place)).map(|(sample, _)| *sample);
    let samples: Vec<StockSample> = reached.collect();
    let closed: Vec<StockSample> = standing.closed.iter().filter(|s| had_stock(s)).copied().collect();
    let band = LeftBand {
        allowance_mm,
        less_mm: LESS_MM,
        more_mm: asked.band_mm,
        reach_mm: allowance_mm + asked.band_mm + BEYOND_MM,
    };
    let left = info_span!("stock left").in_scope(|| until.stock_left(&samples, &band, keep_going))?;
    let area_mm2 = |all: &[StockSample]| all.iter().fold(0.0, |sum, s| sum + s.area_mm2);
    let closed_mm2 = area_mm2(&closed);
    let closed = ClosedPockets {
        area_mm2: closed_mm2,
        share: closed_mm2 / (closed_mm2 + area_mm2(&samples)).max(f64::MIN_POSITIVE),
        dead_centre_mm: asked.dead_centre_of_mm(2.0 * job.request.tool.radius_mm()),
        at: closed.first().map(|s| Place {
            point_mm: s.point.into(),
            move_seq: None,
            parameter: None,
            face: None,
            entity: None,
        }),
    };
    Ok(LevelsFound { asked, engagement: engagement.unwrap_or_default(), links, left, closed })
}

/// What of levels is not as it was asked for.
pub(crate) fn findings(found: &LevelsFound, radius_mm: f64) -> Vec<Finding> {
    let mut findings = Vec::new();
    let limit_deg = found.asked.engagement_deg;
    if let Some(largest) = &found.engagement.largest
        && largest.angle_deg > limit_deg + ENGAGEMENT_SLACK_DEG
    {
        findings.push(Finding {
            code: FindingCode::Engagement,
            severity: Severity::Error,
            message: format!(
                "the tool cuts along {:.1}° of its circle, {limit_deg}° were allowed: too much along {:.1} mm",
                largest.angle_deg,
                found.engagement.above_mm(limit_deg)
            ),
            place: Some(largest.at.clone()),
        });
    }
    if found.links.touching > 0 {
        findings.push(Finding {
            code: FindingCode::LinkInStock,
            severity: Severity::Error,
            message: format!(
                "{} of {} straight links and lead-ins of levels run through stock",
                found.links.touching, found.links.moves
            ),
            place: found.links.worst.as_ref().map(|hit| hit.at.clone()),
        });
    }
    let left = &found.left;
    if left.above > SAID_SHARE {
        let [_, high_mm] = left.band_mm;
        let section_mm2 = std::f64::consts::PI * radius_mm * radius_mm;
        let is_too_much = left.above > LEFT_SHARE && left.above * left.area_mm2 > LEFT_SECTION * section_mm2;
        let most_mm = left.extremes_mm.map_or(high_mm, |e| e[1]);
        let thickest =
            if left.beyond > 0 { "more than can be told".to_owned() } else { format!("{most_mm:.2} mm") };
        findings.push(Finding {
            code: FindingCode::StockLeft,
            severity: if is_too_much { Severity::Error } else { Severity::Warning },
            message: format!(
                "over {:.2} % of what the levels reach more than {high_mm:.2} mm of stock are left, {thickest} at most",
                100.0 * left.above
            ),
            place: left.thickest_at.clone(),
        });
    }
    let closed = &found.closed;
    if closed.area_mm2 > 0.0 {
        findings.push(Finding {
            code: FindingCode::ClosedPockets,
            severity: Severity::Warning,
            message: format!(
                "{:.2} % of what the tool fits into lies in pockets without a way in: it does not cut within {:.2} mm about its \
                 axis; a smaller tool, or one that may plunge, gets in",
                100.0 * closed.share, closed.dead_centre_mm
            ),
            place: closed.at.clone(),
        });
    }
    findings
}

/// Said where nothing can be measured of levels: the job has no stock, or its moves are not in their order.
pub(crate) fn unmeasured() -> Finding {
    Finding {
        code: FindingCode::NotMeasured,
        severity: Severity::Error,
        message: "levels cannot be measured: the job has no stock, or its moves are not in their order"
            .into(),
        place: None,
    }
}
