//! The whole job: what each setup cuts, the passes of each part, the program.

pub(crate) mod covered;
pub(crate) mod error;
pub(crate) mod kept_plan;
pub(crate) mod keys;
pub(crate) mod obstacles;
pub(crate) mod options;
pub(crate) mod planned;
pub(crate) mod regions;

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use claymill_contact::{BallDrop, CONTACT_EPSILON_MM, Covering, FreeSides, Material, Rims, near_mm};
use claymill_nurbs::{Aabb, FaceId, Model, NurbsError, Point3};
use claymill_surface_merge::{Guides, RegionMesh};
use claymill_toolpath::{Cancelled, Monitor, PartKey, Stage, Tool};
use rayon::prelude::*;

use crate::containment::{Avoided, Containment};
use crate::pattern::levels::field::mesh_edge_mm;
use crate::pattern::levels::sweeps::Sweeps;
use crate::pattern::step_over::flat_mm;
use crate::plan::covered::{Covered, WiderRegions};
use crate::plan::error::{EndRefusal, FARTHEST_GUIDE_MM, PlanError};
use crate::plan::keys::{Aside, PlanKeys};
use crate::plan::options::{PlanOptions, check_end, check_tools};
use crate::plan::planned::Plan;
use crate::plan::regions::{Regions, open_borders};
use crate::program::Output;
use crate::program::account::Account;
use crate::program::in_stock::{Shank, leave_out_struck};
use crate::program::part::Part;
use crate::setup::assignment::{Assignments, assign};
use crate::setup::claims::Claims;
use crate::setup::context::SetupContext;
use crate::setup::heights::Heights;
use crate::setup::leaning::{LEAST_FACING, LEAST_SLANT};
use crate::setup::probe::Views;
use crate::setup::sides::Sides;
use crate::setup::slopes::Slopes;
use crate::setup::space::Space;
use crate::setup::wall_claims::Walls;
use crate::{FitTolerance, Frame, RowsAlong, Strategy};

/// What each setup cuts is decided on triangles with sides of a ball radius; of half of one for rest strips, which are
/// narrow, and where that makes no more squares than this in all. But what two setups cut has to overlap by more than a
/// step-over, and overlaps by a triangle.
const FINEST: f64 = 0.5;
const MANY_SQUARES: f64 = 2e5;
const FINEST_STEPS: f64 = 1.5;
/// Where there are no more of the smallest squares than this, strips that a setup gets to are looked for on parts of triangles.
const FEW_SQUARES: f64 = 1e5;

/// Plans the whole job; see the crate's documentation for the stages.
///
/// The monitor is asked between stages, regions and parts: a part that is begun is finished first.
///
/// # Errors
/// Options that do not suit the model, faces that cannot be covered, nothing to cut, or the monitor ends it.
pub fn plan(
    model: &Model,
    regions: &Regions,
    options: &PlanOptions,
    monitor: &dyn Monitor,
) -> Result<Plan, PlanError> {
    let own = model.faces.len();
    plan_crowded(model, regions, own..own, options, monitor)
}

/// The same for a model of which these faces are obstacles.
pub(crate) fn plan_crowded(
    model: &Model,
    regions: &Regions,
    obstacles: Range<FaceId>,
    options: &PlanOptions,
    monitor: &dyn Monitor,
) -> Result<Plan, PlanError> {
    check_tools(&options.tool, options.rest_of.as_ref(), options.scallop_mm)?;
    check_end(options)?;
    options.rest()?;
    if !obstacles.is_empty() && !options.tool.is_ball() {
        return Err(PlanError::EndNotFor { tool: options.tool, what: EndRefusal::Obstacles });
    }
    if options.allowance_mm != 0.0 {
        let on_the_surface = options.on_the_surface()?;
        let plan = plan_crowded(model, regions, obstacles, &on_the_surface, monitor)?;
        return Ok(plan.with_allowance(options.allowance_mm));
    }
    let radius_mm = options.tool.radius_mm();
    check_size(model, radius_mm)?;
    monitor.at(Stage::Setups, 0.0);
    let obstacles: Vec<FaceId> = obstacles.collect();
    let area_mm2: f64 = regions.face_area_mm2.iter().sum();
    let fineness_mm = fineness_mm(options, area_mm2);
    let aside = Aside { bare: &[], obstacles: &obstacles };
    let keys = PlanKeys::new(model, regions, options, &aside, fineness_mm);
    if let Some(plan) = keys.as_ref().and_then(|keys| keys.known_plan(model, regions)) {
        return Ok(plan);
    }
    let covered =
        Covered::new(model, regions.excluded, area_mm2, fineness_mm).map_err(|e| uncovered(model, e))?;
    if covered.left_out.is_empty() {
        let plan = lay(&covered, &aside, keys.as_ref(), regions, options, monitor)?;
        keys.inspect(|keys| keys.keep_plan(model, regions, &plan));
        return Ok(plan);
    }
    let bare: Vec<FaceId> =
        covered.left_out.iter().map(|l| l.face).filter(|&face| !regions.excluded[face]).collect();
    let mut wider = WiderRegions::over(regions, &covered.model);
    wider.leave_out(bare.iter().copied());
    let wider = wider.as_regions(regions);
    let aside = Aside { bare: &bare, obstacles: &obstacles };
    let keys = PlanKeys::new(&covered.model, &wider, options, &aside, fineness_mm);
    let plan = lay(&covered, &aside, keys.as_ref(), &wider, options, monitor)?;
    Ok(Plan { left_out: covered.left_out, ..plan }.of_own_faces(regions))
}

fn uncovered(model: &Model, (face, source): (FaceId, NurbsError)) -> PlanError {
    let entity = model.faces[face].source.entity.clone();
    PlanError::Face { face, entity, source }
}

/// Lays paths over a model that is covered, but for faces that could not be, and of which some are obstacles.
fn lay(
    covered: &Covered,
    &Aside { bare, obstacles: faces_in_the_way }: &Aside,
    keys: Option<&PlanKeys>,
    regions: &Regions,
    options: &PlanOptions,
    monitor: &dyn Monitor,
) -> Result<Plan, PlanError> {
    let (model, covering): (&Model, &Covering) = (&covered.model, &covered.covering);
    let radius_mm = options.tool.radius_mm();
    let area_mm2: f64 = regions.face_area_mm2.iter().sum();
    let frames = options.frames()?;
    let free = FreeSides::new(&options.free_sides);
    let open = open_borders(regions.merged);
    let space = Space::new(model, options.orientation.up.vector());
    let of_tool = |tool: &Tool| -> Vec<BallDrop> {
        let drop = |f: &Frame| {
            let rims = Rims::new(model, &open, free, f);
            // Without an open border there is no way behind a sheet.
            let near_mm = near_mm(tool.radius_mm(), options.scallop_mm);
            let behind = || Material::new(&space.closest, covering, free, f, [tool.radius_mm(), near_mm]);
            let material = if rims.is_empty() { None } else { behind() };
            BallDrop::of_tool(model, covering, f, tool).on_free_sides(free, rims, material)
        };
        frames.par_iter().map(drop).collect()
    };
    let balls = of_tool(&options.tool);
    let earlier = options.rest_of.map_or_else(Vec::new, |tool| of_tool(&tool));
    let stock: Vec<BallDrop> = match options.stock_above_mm {
        mm if mm > 0.0 => {
            frames.par_iter().map(|f| BallDrop::new(model, covering, f, radius_mm + mm)).collect()
        }
        _ => Vec::new(),
    };
    monitor.go_on()?;
    monitor.at(Stage::Setups, 0.5);
    let avoid = |faces: &[FaceId], mm: f64| {
        Avoided::new(model, faces, mm, radius_mm).map_err(|e| uncovered(model, e))
    };
    let avoided = avoid(&options.bounds.avoid, options.bounds.avoid_mm)?;
    let obstacle_mm = if faces_in_the_way.is_empty() { 0.0 } else { options.check_clearance_mm };
    let obstacles = avoid(if obstacle_mm > 0.0 { faces_in_the_way } else { &[] }, obstacle_mm)?;
    let kept_in = |f: &Frame, room| {
        let avoided = [avoided.as_ref(), obstacles.as_ref()];
        Containment::new(&options.bounds, f, radius_mm, covering, regions.excluded, avoided, room)
    };
    let keeps: Vec<Option<Containment>> = frames.par_iter().map(|f| kept_in(f, None)).collect();
    let views = Views {
        keeps: &keeps,
        frames: &frames,
        balls: &balls,
        earlier: &earlier,
        rest: options.rest()?,
        space: &space,
        free,
        scallop_mm: options.scallop_mm,
        divides: area_mm2 <= FEW_SQUARES * (FINEST * radius_mm).powi(2),
    };
    let make = || assign(model, covering, &views, regions);
    let assignments = match keys {
        Some(keys) => keys.assignments(&frames, make),
        None => make(),
    };
    let account = Account::new(covering, &assignments.of, regions);
    let faces_of = group(regions.of_face);
    monitor.go_on()?;
    let tolerance = FitTolerance::of_scallop(options.scallop_mm);
    let sides = Sides::new(covering, &assignments.of, &frames);
    let views_of: Vec<View> = (0..frames.len())
        .into_par_iter()
        .map(|k| View::new(covering, &assignments, k, &balls[k], &space, regions))
        .collect();
    let contexts: Vec<SetupContext> = (views_of.iter().zip(&frames).enumerate())
        .map(|(index, (view, frame))| SetupContext {
            model,
            covering,
            frame: *frame,
            index,
            assignments: &assignments.of,
            claims: &view.claims,
            walls: &view.walls,
            beside_walls: None,
            ball: &balls[index],
            earlier: earlier.get(index),
            stock: stock.get(index).map(|ball| (ball, options.stock_above_mm)),
            heights: &view.heights,
            containment: keeps[index].as_ref(),
            least_facing: if assignments.slants { LEAST_SLANT } else { LEAST_FACING },
            obstacle_mm,
            clearance_mm: options.clearance_mm.max(obstacle_mm),
            excluded: regions.excluded,
            extend_mm: options.bounds.extend_mm,
            strategy: options.strategy,
            slopes: Slopes::All,
            steep_deg: options.steep_deg,
            lines: options.lines.filter(|_| options.strategy == Strategy::Isoparametric),
            pencil: options.pencil,
            rows_along: options.row_angle_deg.map(RowsAlong::at_deg),
            scallop_mm: tolerance.to_lay_mm(options.scallop_mm),
            tolerance,
            link: options.link,
            feeds: options.feeds,
        })
        .collect();
    // A part has stages of its own that are not parallel: meanwhile others go on, and the largest ones begin.
    let area_mm2 = |&(index, region): &(usize, usize)| account.region_setup_mm2[region][index];
    let mut jobs: Vec<(usize, usize)> =
        (0..frames.len()).flat_map(|index| (0..faces_of.len()).map(move |region| (index, region))).collect();
    jobs.retain(|job| area_mm2(job) > 0.0);
    jobs.sort_by(|a, b| area_mm2(b).total_cmp(&area_mm2(a)).then(a.cmp(b)));
    let keys = keys.map(|keys| keys.of_passes(&assignments, &balls));
    let known = |job: &(usize, usize)| {
        monitor.go_on()?;
        let Some(keys) = &keys else { return Ok(Known { key: None, part: None }) };
        let key = keys.of(&contexts[job.0], &faces_of[job.1], area_mm2(job));
        Ok(Known { key: Some(key), part: keys.known(&key) })
    };
    let known = jobs.par_iter().map(known).collect::<Result<Vec<Known>, Cancelled>>()?;
    monitor.at(Stage::RegionMeshes, 0.0);
    let edge_mm = mesh_edge_mm(radius_mm, options.scallop_mm);
    let shank = options.in_process.as_ref().and_then(Shank::of);
    // Which region a place lies beside only the meshes of all of them say. And what the shank is struck on is laid again.
    let mut wanted = vec![options.strategy.sweeps_regions() && !options.guides.is_empty(); faces_of.len()];
    for ((_, region), known) in jobs.iter().zip(&known) {
        wanted[*region] |= options.strategy.sweeps_regions() && (known.part.is_none() || shank.is_some());
    }
    // A region without a mesh is cut patch by patch.
    let meshes: Vec<Option<RegionMesh>> = (0..faces_of.len())
        .into_par_iter()
        .map(|r| {
            monitor.go_on()?;
            Ok(if wanted[r] { RegionMesh::of_region(model, regions.merged, r, edge_mm).ok() } else { None })
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut chosen = chosen(&meshes, &options.guides)?;
    let sweeps: Vec<Option<Sweeps>> = (meshes.iter().zip(&faces_of).enumerate())
        .map(|(r, (mesh, faces))| {
            mesh.as_ref().map(|mesh| Sweeps::new(mesh, faces, &sides, chosen.remove(&r)))
        })
        .collect();
    let done = AtomicUsize::new(0);
    let part = |(job, known): (&(usize, usize), Known)| {
        monitor.go_on()?;
        monitor.at(Stage::Paths, done.fetch_add(1, Ordering::Relaxed) as f64 / jobs.len() as f64);
        let &(index, region) = job;
        let part = known.part.unwrap_or_else(|| {
            let part = contexts[index].part(&faces_of[region], area_mm2(job), sweeps[region].as_ref());
            keys.as_ref().zip(known.key).inspect(|(keys, key)| keys.keep(key, &part));
            part
        });
        Ok(part.map(|part| (index, region, part)))
    };
    let parts = jobs.par_iter().zip(known).with_max_len(1).map(part);
    let parts = parts.collect::<Result<Vec<_>, Cancelled>>()?;
    let mut parts: Vec<(usize, usize, Part)> = parts.into_iter().flatten().collect();
    parts.sort_by_key(|&(index, region, _)| (index, region));
    let program = |parts: Vec<(usize, usize, Part)>| {
        let mut out = Output::default();
        let mut parts = parts.into_iter().peekable();
        for context in &contexts {
            let of_setup = std::iter::from_fn(|| parts.next_if(|(index, ..)| *index == context.index));
            let of_setup = of_setup.map(|(_, region, part)| (region, part)).collect();
            out.setup(context, &account, of_setup, &options.machine);
        }
        out
    };
    let mut struck_passes = 0;
    if let Some(shank) = shank {
        let moves = |parts: &[(usize, usize, Part)]| program(parts.to_vec()).program.moves;
        let mut left_out = leave_out_struck(&shank, &contexts, &mut parts, moves, monitor)?;
        if left_out.count > 0 && options.tool.is_ball() {
            // Up to where the shank stands clear.
            let mut rooms = shank.rooms(moves(&parts), &frames, radius_mm, monitor)?;
            let keeps: Vec<Option<Containment>> =
                frames.iter().map(|f| kept_in(f, rooms.remove(f.name.as_str()))).collect();
            let contexts: Vec<SetupContext> = (contexts.iter().zip(&keeps))
                .map(|(context, kept)| SetupContext { containment: kept.as_ref(), ..*context })
                .collect();
            let again: Vec<(usize, usize)> = left_out.parts.iter().copied().collect();
            let part = |job: &(usize, usize)| {
                monitor.go_on()?;
                let &(index, region) = job;
                let part = contexts[index].part(&faces_of[region], area_mm2(job), sweeps[region].as_ref());
                Ok(part.map(|part| (index, region, part)))
            };
            let laid = again.par_iter().with_max_len(1).map(part).collect::<Result<Vec<_>, Cancelled>>()?;
            parts.retain(|&(index, region, _)| !left_out.parts.contains(&(index, region)));
            parts.extend(laid.into_iter().flatten());
            parts.sort_by_key(|&(index, region, _)| (index, region));
            left_out = leave_out_struck(&shank, &contexts, &mut parts, moves, monitor)?;
        }
        struck_passes = left_out.count;
    }
    let mut out = program(parts);
    if out.program.moves.is_empty() {
        return Err(if options.is_rest() { PlanError::NoRest } else { PlanError::NothingToCut });
    }
    out.add_up();
    let (area, faces) = account.faces(model, regions, free, bare);
    let name_areas = |region: usize| {
        let named = frames.iter().zip(account.region_setup_mm2[region]).filter(|(_, a)| *a > 0.0);
        named.map(|(f, a)| (f.name.to_string(), a)).collect()
    };
    Ok(Plan {
        region_setup_area_mm2: (0..faces_of.len()).map(name_areas).collect(),
        program: out.program,
        seconds: out.seconds,
        setups: out.setups,
        regions: out.regions,
        totals: out.totals,
        area,
        faces,
        tolerances: [
            ("contact_mm", CONTACT_EPSILON_MM),
            ("fit_bias_mm", tolerance.bias_mm),
            ("fit_mm", tolerance.fit_mm),
            ("clearance_mm", options.clearance_mm),
        ]
        .map(|(name, value)| (name.to_owned(), value))
        .into(),
        left_out: Vec::new(),
        struck_passes,
        notes: Vec::new(),
    })
}

/// The sides that regions are to be swept between.
fn chosen(meshes: &[Option<RegionMesh>], places: &[Point3]) -> Result<BTreeMap<usize, Guides>, PlanError> {
    let mut of_region: BTreeMap<usize, (&RegionMesh, Vec<Point3>)> = BTreeMap::new();
    for &at in places {
        let meshes = meshes.iter().enumerate().filter_map(|(r, mesh)| Some((r, mesh.as_ref()?)));
        let distances = meshes.filter_map(|(r, mesh)| Some((r, mesh, mesh.from_border_mm(&at)?)));
        match distances.min_by(|a, b| a.2.total_cmp(&b.2)) {
            Some((region, mesh, mm)) if mm <= FARTHEST_GUIDE_MM => {
                of_region.entry(region).or_insert((mesh, Vec::new())).1.push(at);
            }
            nearest => return Err(PlanError::NoSide { at, nearest_mm: nearest.map(|n| n.2) }),
        }
    }
    let guides = |(region, (mesh, places)): (usize, (&RegionMesh, Vec<Point3>))| {
        let guides = match &places[..] {
            [from] => mesh.guides_near(from, None),
            [from, to] => mesh.guides_near(from, Some(to)),
            _ => return Err(PlanError::TooManySides { region }),
        };
        Ok((region, guides.map_err(|source| PlanError::Sides { region, source })?))
    };
    of_region.into_iter().map(guides).collect()
}

/// A part that may be known already.
struct Known {
    /// Where parts are kept.
    key: Option<PartKey>,
    /// If it is known; nothing may be cut of it.
    part: Option<Option<Part>>,
}

/// The model as one setup sees it.
struct View<'a> {
    claims: Claims,
    walls: Walls<'a>,
    heights: Heights,
}

impl<'a> View<'a> {
    fn new(
        covering: &Covering,
        assignments: &Assignments,
        setup: usize,
        ball: &BallDrop,
        space: &'a Space<'_>,
        regions: &Regions<'a>,
    ) -> Self {
        View {
            claims: Claims::new(covering, assignments, |assignment| assignment.is_cut_by(setup)),
            walls: Walls::new(covering, assignments, setup, space, &regions.merged.joints),
            heights: Heights::new(ball),
        }
    }
}

/// Sides of the triangles on which it is decided what a setup cuts, mm.
fn fineness_mm(options: &PlanOptions, area_mm2: f64) -> f64 {
    let radius_mm = options.tool.radius_mm();
    if options.is_rest() {
        return FINEST * radius_mm;
    }
    let step_mm = flat_mm(radius_mm, options.scallop_mm);
    let finest_mm = (FINEST * radius_mm).max(FINEST_STEPS * step_mm).min(radius_mm);
    (area_mm2 / MANY_SQUARES).sqrt().clamp(finest_mm, radius_mm)
}

fn check_size(model: &Model, radius_mm: f64) -> Result<(), PlanError> {
    let nets = model.faces.iter().flat_map(|f| f.surface.net());
    let bounds = nets.fold(Aabb::empty(), |mut b, h| {
        b.add(&(h.xyz() / h.w).into());
        b
    });
    let size = if bounds.is_empty() { 0.0 } else { (bounds.max - bounds.min).amax() };
    if 2.0 * radius_mm > size {
        return Err(PlanError::ToolTooBig { radius_mm, size_mm: size });
    }
    Ok(())
}

fn group(region_of_face: &[usize]) -> Vec<Vec<usize>> {
    let mut faces = vec![Vec::new(); region_of_face.iter().max().map_or(0, |m| m + 1)];
    for (face, &region) in region_of_face.iter().enumerate() {
        faces[region].push(face);
    }
    faces
}
