use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use claymill_nurbs::{Aabb, FaceId, Model, NurbsError, Point3};
use claymill_surface_merge::{FieldError, Guides, Merge, RegionMesh};
use claymill_toolpath::{
    Area, Bounds, CHECK_CLEARANCE_MM, FaceAccount, FreeSide, LinkStyle, MachineLimits, Program, RegionTotals,
    Setup, Tool, Totals,
};
use rayon::prelude::*;
use thiserror::Error;

use crate::account::Account;
use crate::claims::Claims;
use crate::contact::{BallDrop, CONTACT_EPSILON_MM, Covering};
use crate::crowd::{Covered, LeftOut, WiderRegions};
use crate::field_levels::mesh_edge_mm;
use crate::free_sides::FreeSides;
use crate::heights::Heights;
use crate::keep::{Avoided, Keep};
use crate::material::{Material, near_mm};
use crate::obstacles::of_own_faces;
use crate::part::{CLEARANCE_MM, Part, SetupContext};
use crate::probe::{LEAST_FACING, LEAST_SLANT, Views};
use crate::program::Output;
use crate::reach::{Fates, assign};
use crate::rims::Rims;
use crate::sides::Sides;
use crate::slopes::Slopes;
use crate::space::Space;
use crate::step_over::flat_mm;
use crate::sweeps::Sweeps;
use crate::walls::Walls;
use crate::{FitTolerance, Frame, Orientation, RowsAlong, Strategy};

/// What to cut and how.
#[derive(Debug, Clone)]
pub struct PlanOptions {
    /// The tool.
    pub tool: Tool,
    /// A larger tool that has been over the model: only what it could not cut is cut.
    pub rest_of: Option<Tool>,
    /// Scallop height, mm.
    pub scallop_mm: f64,
    /// Where passes run.
    pub strategy: Strategy,
    /// Slope above which [`Strategy::SteepShallow`] has waterlines instead of rows, degrees; see [`STEEP_DEG`].
    pub steep_deg: f64,
    /// Parameter lines of every patch for [`Strategy::IsoPatch`]; as many as the scallop height takes if `None`.
    pub lines: Option<usize>,
    /// Places beside sides of regions, mm, in the model's coordinates: where [`Strategy::Iso`] and [`Strategy::Scallop`] sweep
    /// a region from, and with a second place beside the same region, where to. By itself a region has the two of
    /// [`RegionMesh::guides`].
    pub guides: Vec<Point3>,
    /// Whether passes along the valleys in which the ball touches on both sides come last in every region.
    pub pencil: bool,
    /// Direction of planar rows, degrees from each setup's `x` to its `y`; the cheapest one by region if `None`.
    pub row_angle_deg: Option<f64>,
    /// The side of each face that is free of material, and cut; either one of faces beyond the end of the list.
    pub free_sides: Vec<FreeSide>,
    /// Where the tool is kept.
    pub bounds: Bounds,
    /// Distance that the ball keeps from obstacles, mm.
    pub check_clearance_mm: f64,
    /// Distance that rapids keep from the finished model along the tool axis, mm.
    pub clearance_mm: f64,
    /// How passes are joined.
    pub link: LinkStyle,
    /// How the vehicle lies in its file.
    pub orientation: Orientation,
    /// Feeds.
    pub feeds: Feeds,
    /// What the machine can do, for the times.
    pub machine: MachineLimits,
}

impl PlanOptions {
    /// Planar rows with a tool at a scallop height, and everything else as usual.
    #[must_use]
    pub fn new(tool: Tool, scallop_mm: f64, orientation: Orientation) -> Self {
        PlanOptions {
            tool,
            rest_of: None,
            scallop_mm,
            strategy: Strategy::Planar,
            steep_deg: STEEP_DEG,
            lines: None,
            guides: Vec::new(),
            pencil: false,
            row_angle_deg: None,
            free_sides: Vec::new(),
            bounds: Bounds::default(),
            check_clearance_mm: CHECK_CLEARANCE_MM,
            clearance_mm: CLEARANCE_MM,
            link: LinkStyle::Lace,
            orientation,
            feeds: Feeds::default(),
            machine: MachineLimits::default(),
        }
    }
}

/// Feeds, mm/min.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feeds {
    /// Along passes and links.
    pub cut_mm_per_min: f64,
    /// Leads.
    pub lead_mm_per_min: f64,
    /// Rapids.
    pub rapid_mm_per_min: f64,
}

impl Default for Feeds {
    /// A clay mill: 6 m/min, leads at 3 m/min, rapids at 20 m/min.
    fn default() -> Self {
        Feeds { cut_mm_per_min: 6000.0, lead_mm_per_min: 3000.0, rapid_mm_per_min: 20_000.0 }
    }
}

/// The regions to cut.
#[derive(Debug, Clone)]
pub struct Regions<'a> {
    /// What merging found: regions and joints.
    pub merged: &'a Merge,
    /// Region of each face.
    pub of_face: &'a [usize],
    /// Whether each face is left out by the user's wish.
    pub excluded: &'a [bool],
    /// Area of each face, mm².
    pub face_area_mm2: &'a [f64],
}

/// Why no plan could be made.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PlanError {
    /// The scallop height does not suit the tool.
    #[error(
        "scallop height {scallop_mm} mm must be positive and smaller than the ball radius {radius_mm} mm"
    )]
    Scallop {
        /// Scallop height asked for.
        scallop_mm: f64,
        /// Ball radius.
        radius_mm: f64,
    },
    /// Rest passes are for a smaller tool.
    #[error("a ball of radius {radius_mm} mm leaves no rest for one of {earlier_mm} mm that went before")]
    EarlierTool {
        /// Ball radius.
        radius_mm: f64,
        /// Radius of the earlier one.
        earlier_mm: f64,
    },
    /// The end is not one that passes are laid for.
    #[error("passes are laid for ball ends only so far: {tool} cannot be planned with")]
    NoBall {
        /// The tool.
        tool: Tool,
    },
    /// The tool does not fit the model.
    #[error("a ball of radius {radius_mm} mm is too big for a model of {size_mm:.1} mm")]
    ToolTooBig {
        /// Ball radius.
        radius_mm: f64,
        /// The model's longest side.
        size_mm: f64,
    },
    /// A face cannot be covered with triangles.
    #[error("face {face} ({entity}): {source}")]
    Face {
        /// Index of the face.
        face: FaceId,
        /// Where it came from.
        entity: String,
        /// What is wrong.
        source: NurbsError,
    },
    /// No region's side can be meant by a place.
    #[error("no region that is cut has a border within {FARTHEST_GUIDE_MM} mm of {}, {}, {}{}", at.x, at.y, at.z, nearest(*nearest_mm))]
    NoSide {
        /// The place.
        at: Point3,
        /// Distance of the nearest border, mm, if there is one.
        nearest_mm: Option<f64>,
    },
    /// Places that do not choose sides of a region.
    #[error("the sides chosen for region {region}: {source}")]
    Sides {
        /// The region.
        region: usize,
        /// What is wrong.
        source: FieldError,
    },
    /// More places than a region can be swept between.
    #[error("three places or more choose sides of region {region}: it is swept from one to another")]
    TooManySides {
        /// The region.
        region: usize,
    },
    /// There is nothing to cut.
    #[error("no setup reaches any face that is to be cut")]
    NothingToCut,
    /// There is no rest.
    #[error("the earlier tool could cut all that this one reaches")]
    NoRest,
}

/// The program and its totals.
#[derive(Debug, Clone)]
pub struct Plan {
    /// All moves, in machining order.
    pub program: Program,
    /// Time of each, s.
    pub seconds: Vec<f64>,
    /// Setups that cut something.
    pub setups: Vec<Setup>,
    /// Totals by region and setup.
    pub regions: Vec<RegionTotals>,
    /// Totals.
    pub totals: Totals,
    /// Where the area went.
    pub area: Area,
    /// The same by face.
    pub faces: Vec<FaceAccount>,
    /// Area by region and setup name, mm².
    pub region_setup_area_mm2: Vec<BTreeMap<String, f64>>,
    /// Tolerances used, by name.
    pub tolerances: BTreeMap<String, f64>,
    /// Faces that could not be covered with triangles; their boxes were kept clear.
    pub left_out: Vec<LeftOut>,
}

/// Tells how far a stage has come: its name and a share from 0 to 1.
pub type Progress<'a> = &'a (dyn Fn(&str, f64) + Sync);

/// What each setup cuts is decided on triangles with sides of a ball radius; of half of one for rest strips, which are
/// narrow, and where that makes no more squares than this in all. But what two setups cut has to overlap by more than a
/// step-over, and overlaps by a triangle.
const FINEST: f64 = 0.5;
const MANY_SQUARES: f64 = 2e5;
const FINEST_STEPS: f64 = 1.5;
/// Where there are no more of the smallest squares than this, strips that a setup gets to are looked for on parts of triangles.
const FEW_SQUARES: f64 = 1e5;

/// Usual limit between shallow and steep, degrees. Rows across a slope of 45° are 1.4 times closer in plan than on the
/// level, those across a steeper one soon half as far apart and less; waterlines come together the same way as the
/// surface flattens. In the middle neither has to be refined.
pub const STEEP_DEG: f64 = 45.0;

/// A place chooses a side of a region this far from it at most, mm.
const FARTHEST_GUIDE_MM: f64 = 50.0;

/// Identity of the only tool.
pub const TOOL_ID: &str = "T1";

/// Plans the whole job; see the crate's documentation for the stages.
///
/// # Errors
/// Options that do not suit the model, faces that cannot be covered, nothing to cut.
pub fn plan(
    model: &Model,
    regions: &Regions,
    options: &PlanOptions,
    progress: Progress,
) -> Result<Plan, PlanError> {
    let own = model.faces.len();
    plan_crowded(model, regions, own..own, options, progress)
}

/// The same for a model of which these faces are obstacles.
pub(crate) fn plan_crowded(
    model: &Model,
    regions: &Regions,
    obstacles: Range<FaceId>,
    options: &PlanOptions,
    progress: Progress,
) -> Result<Plan, PlanError> {
    let radius_mm = options.tool.radius_mm();
    check_tools(&options.tool, options.rest_of.as_ref(), options.scallop_mm)?;
    check_size(model, radius_mm)?;
    progress("setups", 0.0);
    let obstacles: Vec<FaceId> = obstacles.collect();
    let area_mm2: f64 = regions.face_area_mm2.iter().sum();
    let fineness_mm = fineness_mm(options, area_mm2);
    let covered =
        Covered::new(model, regions.excluded, area_mm2, fineness_mm).map_err(|e| uncovered(model, e))?;
    if covered.left_out.is_empty() {
        return lay(&covered, [&[], &obstacles], regions, options, progress);
    }
    let bare: Vec<FaceId> =
        covered.left_out.iter().map(|l| l.face).filter(|&face| !regions.excluded[face]).collect();
    let mut wider = WiderRegions::over(regions, &covered.model);
    wider.leave_out(bare.iter().copied());
    let plan = lay(&covered, [&bare, &obstacles], &wider.as_regions(regions), options, progress)?;
    Ok(of_own_faces(Plan { left_out: covered.left_out, ..plan }, regions))
}

fn uncovered(model: &Model, (face, source): (FaceId, NurbsError)) -> PlanError {
    let entity = model.faces[face].source.entity.clone();
    PlanError::Face { face, entity, source }
}

/// Lays paths over a model that is covered, but for `bare` faces that could not be, and of which some are obstacles.
fn lay(
    covered: &Covered,
    [bare, obstacles]: [&[FaceId]; 2],
    regions: &Regions,
    options: &PlanOptions,
    progress: Progress,
) -> Result<Plan, PlanError> {
    let (model, covering): (&Model, &Covering) = (&covered.model, &covered.covering);
    let radius_mm = options.tool.radius_mm();
    let area_mm2: f64 = regions.face_area_mm2.iter().sum();
    let frames = Frame::five(options.orientation);
    let free = FreeSides::new(&options.free_sides);
    let space = Space::new(model, frames[0].axis());
    let of_tool = |tool: &Tool| -> Vec<BallDrop> {
        let drop = |f: &Frame| {
            let rims = Rims::new(model, regions.merged, free, f);
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
    progress("setups", 0.5);
    let avoid = |faces: &[FaceId], mm: f64| {
        Avoided::new(model, faces, mm, radius_mm).map_err(|e| uncovered(model, e))
    };
    let avoided = avoid(&options.bounds.avoid, options.bounds.avoid_mm)?;
    let obstacle_mm = if obstacles.is_empty() { 0.0 } else { options.check_clearance_mm };
    let obstacles = avoid(if obstacle_mm > 0.0 { obstacles } else { &[] }, obstacle_mm)?;
    let keeps: Vec<Option<Keep>> = frames
        .par_iter()
        .map(|f| {
            let avoided = [avoided.as_ref(), obstacles.as_ref()];
            Keep::new(&options.bounds, f, radius_mm, covering, regions.excluded, avoided)
        })
        .collect();
    let views = Views {
        keeps: &keeps,
        frames: &frames,
        balls: &balls,
        earlier: &earlier,
        space: &space,
        free,
        scallop_mm: options.scallop_mm,
        divides: area_mm2 <= FEW_SQUARES * (FINEST * radius_mm).powi(2),
    };
    let fates = assign(model, covering, &views, regions);
    let account = Account::new(covering, &fates.of, regions);
    let faces_of = group(regions.of_face);
    progress("region meshes", 0.0);
    let edge_mm = mesh_edge_mm(radius_mm, options.scallop_mm);
    let tolerance = FitTolerance::of_scallop(options.scallop_mm);
    let wanted = |region: usize| {
        options.strategy.sweeps_regions() && account.region_setup_mm2[region].iter().any(|&a| a > 0.0)
    };
    // A region without a mesh is cut patch by patch.
    let meshes: Vec<Option<RegionMesh>> = (0..faces_of.len())
        .into_par_iter()
        .map(|r| if wanted(r) { RegionMesh::of_region(model, regions.merged, r, edge_mm).ok() } else { None })
        .collect();
    let mut chosen = chosen(&meshes, &options.guides)?;
    let sides = Sides::new(covering, &fates.of, &frames);
    let sweeps: Vec<Option<Sweeps>> = (meshes.iter().zip(&faces_of).enumerate())
        .map(|(r, (mesh, faces))| {
            mesh.as_ref().map(|mesh| Sweeps::new(mesh, faces, &sides, chosen.remove(&r)))
        })
        .collect();
    let views_of: Vec<View> = (0..frames.len())
        .into_par_iter()
        .map(|k| View::new(covering, &fates, k, &balls[k], &space, regions))
        .collect();
    let contexts: Vec<SetupContext> = (views_of.iter().zip(&frames).enumerate())
        .map(|(index, (view, frame))| SetupContext {
            model,
            covering,
            frame: *frame,
            index,
            fates: &fates.of,
            claims: &view.claims,
            walls: &view.walls,
            beside_walls: None,
            ball: &balls[index],
            earlier: earlier.get(index),
            heights: &view.heights,
            keep: keeps[index].as_ref(),
            least_facing: if fates.slants { LEAST_SLANT } else { LEAST_FACING },
            obstacle_mm,
            clearance_mm: options.clearance_mm.max(obstacle_mm),
            excluded: regions.excluded,
            extend_mm: options.bounds.extend_mm,
            strategy: options.strategy,
            slopes: Slopes::All,
            steep_deg: options.steep_deg,
            lines: options.lines.filter(|_| options.strategy == Strategy::IsoPatch),
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
    let done = AtomicUsize::new(0);
    let part = |job: &(usize, usize)| {
        progress("paths", done.fetch_add(1, Ordering::Relaxed) as f64 / jobs.len() as f64);
        let &(index, region) = job;
        let part = contexts[index].part(&faces_of[region], area_mm2(job), sweeps[region].as_ref())?;
        Some((index, region, part))
    };
    let mut parts: Vec<(usize, usize, Part)> = jobs.par_iter().with_max_len(1).filter_map(part).collect();
    parts.sort_by_key(|&(index, region, _)| (index, region));
    let mut out = Output::default();
    let mut parts = parts.into_iter().peekable();
    for context in &contexts {
        let of_setup = std::iter::from_fn(|| parts.next_if(|(index, ..)| *index == context.index));
        out.setup(
            context,
            &account,
            of_setup.map(|(_, region, part)| (region, part)).collect(),
            &options.machine,
        );
    }
    if out.program.moves.is_empty() {
        return Err(if earlier.is_empty() { PlanError::NothingToCut } else { PlanError::NoRest });
    }
    out.add_up();
    let (area, faces) = account.faces(model, regions, free, bare);
    let name_areas = |region: usize| {
        let named = frames.iter().zip(account.region_setup_mm2[region]).filter(|(_, a)| *a > 0.0);
        named.map(|(f, a)| (f.name.to_owned(), a)).collect()
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

fn nearest(mm: Option<f64>) -> String {
    mm.map_or_else(String::new, |mm| format!(": the nearest is {mm:.1} mm away"))
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
        fates: &Fates,
        setup: usize,
        ball: &BallDrop,
        space: &'a Space<'_>,
        regions: &Regions<'a>,
    ) -> Self {
        View {
            claims: Claims::new(covering, fates, |fate| fate.is_cut_by(setup)),
            walls: Walls::new(covering, fates, setup, space, &regions.merged.joints),
            heights: Heights::new(ball),
        }
    }
}

/// Whether passes can be laid for a tool, for the rest of an earlier one if there is one, at a scallop height: all that can be
/// said before the model is known.
///
/// # Errors
/// They cannot.
pub fn check_tools(tool: &Tool, rest_of: Option<&Tool>, scallop_mm: f64) -> Result<(), PlanError> {
    let radius_mm = tool.radius_mm();
    if let Some(&tool) = [Some(tool), rest_of].into_iter().flatten().find(|t| !t.is_ball()) {
        return Err(PlanError::NoBall { tool });
    }
    if !(scallop_mm > 0.0 && scallop_mm < radius_mm) {
        return Err(PlanError::Scallop { scallop_mm, radius_mm });
    }
    match rest_of.map(Tool::radius_mm).filter(|&mm| mm <= radius_mm) {
        Some(earlier_mm) => Err(PlanError::EarlierTool { radius_mm, earlier_mm }),
        None => Ok(()),
    }
}

/// Sides of the triangles on which it is decided what a setup cuts, mm.
fn fineness_mm(options: &PlanOptions, area_mm2: f64) -> f64 {
    let radius_mm = options.tool.radius_mm();
    if options.rest_of.is_some() {
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
