//! A covered model as its setups see it, and the shares of the plan: what one setup cuts of one region. Each share becomes a
//! part, whichever process lays it.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use claymill_contact::{BallDrop, Covering, FreeSides, Material, Rims, near_mm};
use claymill_nurbs::{Aabb, FaceId, Model, Point3};
use claymill_surface_merge::{Guides, RegionMesh};
use claymill_toolpath::{Cancelled, Holder, Monitor, PartKey, Stage, Tool};
use rayon::prelude::*;
use tracing::info_span;

use crate::containment::room::ShankRoom;
use crate::containment::{Avoided, Containment};
use crate::pattern::levels::field::mesh_edge_mm;
use crate::pattern::levels::sweeps::Sweeps;
use crate::plan::covered::Covered;
use crate::plan::error::{FARTHEST_GUIDE_MM, PlanError};
use crate::plan::keys::{Aside, PassKeys, PlanKeys};
use crate::plan::options::PlanOptions;
use crate::plan::probe_keys::ProbeKeys;
use crate::plan::regions::{Regions, open_borders};
use crate::plan::whole::divides;
use crate::program::account::Account;
use crate::program::part::Part;
use crate::setup::assignment::{Assignments, assign};
use crate::setup::claims::Claims;
use crate::setup::context::SetupContext;
use crate::setup::heights::Heights;
use crate::setup::leaning::{LEAST_FACING, LEAST_SLANT};
use crate::setup::probe::{SeenBefore, Views};
use crate::setup::sides::Sides;
use crate::setup::slopes::Slopes;
use crate::setup::space::Space;
use crate::setup::wall_claims::Walls;
use crate::{FitTolerance, Frame, RowsAlong, Strategy};

/// Holders keep so much more than is asked for: what is written and measured of their distance is exact to it, mm.
const HOLDER_MARGIN_MM: f64 = 0.03;

/// What is decided before passes are laid.
pub(super) struct Laying<'a> {
    pub(super) model: &'a Model,
    /// Faces that could not be covered.
    pub(super) bare: &'a [FaceId],
    pub(super) regions: &'a Regions<'a>,
    pub(super) options: &'a PlanOptions,
    pub(super) monitor: &'a dyn Monitor,
    pub(super) frames: &'a [Frame],
    pub(super) contexts: Vec<SetupContext<'a>>,
    pub(super) account: &'a Account,
    pub(super) free: FreeSides<'a>,
    pub(super) tolerance: FitTolerance,
    /// The faces of each region.
    pub(super) faces_of: Vec<Vec<FaceId>>,
    /// Largest first.
    pub(super) shares: Vec<Share>,
    /// Where the tool may go in a setup, and in what room its shank has.
    pub(super) kept_in: &'a KeptIn<'a>,
    keys: Option<PassKeys<'a>>,
    sides: Sides,
}

/// Where the tool may go in a setup.
pub(super) type KeptIn<'a> = dyn Fn(&Frame, Option<ShankRoom>) -> Option<Containment<'a>> + Sync + 'a;

/// What a setup cuts of a region.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Share {
    pub(super) setup: usize,
    pub(super) region: usize,
}

/// A part that may be known already.
pub(super) struct Known {
    /// Where parts are kept.
    key: Option<PartKey>,
    /// If it is known; nothing may be cut of it.
    part: Option<Option<Part>>,
}

impl Known {
    pub(super) fn is_known(&self) -> bool {
        self.part.is_some()
    }
}

/// A part of a setup and a region.
pub(super) type Placed = (usize, usize, Part);

/// Sees a covered model as the setups do, decides what each of them cuts, and goes on with that.
pub(super) fn with_laying<T>(
    covered: &Covered,
    &Aside { bare, obstacles: faces_in_the_way }: &Aside,
    keys: Option<&PlanKeys>,
    regions: &Regions,
    options: &PlanOptions,
    monitor: &dyn Monitor,
    then: impl FnOnce(&Laying) -> Result<T, PlanError>,
) -> Result<T, PlanError> {
    let (model, covering): (&Model, &Covering) = (&covered.model, &covered.covering);
    let radius_mm = options.tool.radius_mm();
    let area_mm2: f64 = regions.face_area_mm2.iter().sum();
    let frames = options.frames()?;
    let free = FreeSides::new(&options.free_sides);
    let open = open_borders(regions.merged);
    let space = Space::new(model, options.orientation.up.vector());
    let of_tool = |tool: &Tool| -> Vec<BallDrop> {
        let drop = |f: &Frame| {
            let _span = info_span!("drop cutter", axis = ?f.axis()).entered();
            let rims = Rims::new(model, &open, free, f);
            // Without an opening there is no way behind a sheet.
            let near_mm = near_mm(tool.radius_mm(), options.scallop_mm);
            let behind = || Material::new(&space.closest, covering, free, f, [tool.radius_mm(), near_mm]);
            let material = if rims.let_through(tool.radius_mm()) { behind() } else { None };
            BallDrop::of_tool(model, covering, f, tool).on_free_sides(free, rims, material)
        };
        frames.par_iter().map(drop).collect()
    };
    let clearance_mm = options.holder_clearance_mm + HOLDER_MARGIN_MM;
    let held = |tool: &Tool, holder: &Option<Holder>| -> Vec<BallDrop> {
        let balls = of_tool(tool).into_iter();
        match holder {
            Some(holder) => balls.map(|ball| ball.with_holder(holder, clearance_mm)).collect(),
            None => balls.collect(),
        }
    };
    let balls = held(&options.tool, &options.holder);
    let earlier = options.rest_of.map_or_else(Vec::new, |tool| held(&tool, &options.rest_holder));
    let stock: Vec<BallDrop> = match options.stock_above_mm {
        mm if mm > 0.0 => {
            frames.par_iter().map(|f| BallDrop::new(model, covering, f, radius_mm + mm)).collect()
        }
        _ => Vec::new(),
    };
    monitor.go_on()?;
    monitor.at(Stage::Setups, 0.5);
    let avoid = |faces: &[FaceId], mm: f64| {
        Avoided::new(model, faces, mm, radius_mm).map_err(|e| PlanError::of_face(model, e))
    };
    let avoided = avoid(&options.bounds.avoid, options.bounds.avoid_mm)?;
    let obstacle_mm = if faces_in_the_way.is_empty() { 0.0 } else { options.check_clearance_mm };
    let obstacles = avoid(if obstacle_mm > 0.0 { faces_in_the_way } else { &[] }, obstacle_mm)?;
    let kept_in = |f: &Frame, room: Option<ShankRoom>| {
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
        divides: divides(area_mm2, radius_mm),
    };
    let boxes: Vec<Vec<Aabb>> = match keys {
        Some(_) => balls.par_iter().map(BallDrop::face_boxes).collect(),
        None => Vec::new(),
    };
    let widest_mm = balls.iter().chain(&earlier).map(BallDrop::widest_mm).fold(radius_mm, f64::max);
    // Bounds may follow from all of the model.
    let is_unbound = keeps.iter().all(Option::is_none);
    let probes = keys.filter(|_| is_unbound).map(|keys| {
        let height_mm = options.scallop_mm.max(1.0) + options.stock_above_mm;
        ProbeKeys::new(keys, &views, &boxes, options.orientation.up.vector(), [widest_mm, height_mm])
    });
    let make = || {
        let _span = info_span!("assignment to setups").entered();
        assign(model, covering, &views, regions, probes.as_ref().map(|keys| keys as &dyn SeenBefore))
    };
    let assignments = match keys {
        Some(keys) => keys.assignments(&frames, make),
        None => make(),
    };
    let account = Account::new(covering, &assignments.of, regions);
    let faces_of = group(regions.of_face);
    monitor.go_on()?;
    let tolerance = FitTolerance::of_scallop(options.scallop_mm);
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
    let area_mm2 = |share: &Share| account.region_setup_mm2[share.region][share.setup];
    let of_setup = |setup| (0..faces_of.len()).map(move |region| Share { setup, region });
    let mut shares: Vec<Share> = (0..frames.len()).flat_map(of_setup).collect();
    shares.retain(|share| area_mm2(share) > 0.0);
    shares.sort_by(|a, b| area_mm2(b).total_cmp(&area_mm2(a)).then(a.cmp(b)));
    then(&Laying {
        model,
        bare,
        regions,
        options,
        monitor,
        frames: &frames,
        contexts,
        account: &account,
        free,
        tolerance,
        faces_of,
        shares,
        kept_in: &kept_in,
        keys: keys.map(|keys| keys.of_passes(&assignments, &boxes)),
        sides: Sides::new(covering, &assignments.of, &frames),
    })
}

impl Laying<'_> {
    pub(super) fn area_mm2(&self, share: &Share) -> f64 {
        self.account.region_setup_mm2[share.region][share.setup]
    }

    /// The key of a share's part, where parts are kept.
    pub(super) fn key(&self, share: &Share) -> Option<PartKey> {
        let of_share = |keys: &PassKeys| {
            keys.of(&self.contexts[share.setup], &self.faces_of[share.region], self.area_mm2(share))
        };
        self.keys.as_ref().map(of_share)
    }

    /// The parts of shares, as far as they are known.
    pub(super) fn known(&self, shares: &[Share]) -> Result<Vec<Known>, Cancelled> {
        let known = |share: &Share| {
            self.monitor.go_on()?;
            let key = self.key(share);
            let part = self.keys.as_ref().zip(key).and_then(|(keys, key)| keys.known(&key));
            Ok(Known { key, part })
        };
        shares.par_iter().map(known).collect()
    }

    /// Meshes of the regions that passes are to sweep. A region without a mesh is cut patch by patch.
    pub(super) fn meshes(
        &self,
        is_wanted: impl Fn(usize) -> bool + Sync,
    ) -> Result<Vec<Option<RegionMesh<'_>>>, Cancelled> {
        let options = self.options;
        self.monitor.at(Stage::RegionMeshes, 0.0);
        let edge_mm = mesh_edge_mm(options.tool.radius_mm(), options.scallop_mm);
        // Which region a place lies beside only the meshes of all of them say.
        let all = !options.guides.is_empty();
        let mesh = |region: usize| {
            self.monitor.go_on()?;
            let is_wanted = options.strategy.sweeps_regions() && (all || is_wanted(region));
            let mesh = || {
                let _span = info_span!("region mesh", region).entered();
                RegionMesh::of_region(self.model, self.regions.merged, region, edge_mm).ok()
            };
            Ok(is_wanted.then(mesh).flatten())
        };
        (0..self.faces_of.len()).into_par_iter().map(mesh).collect()
    }

    /// How passes sweep regions with these meshes.
    pub(super) fn sweeps<'m>(
        &'m self,
        meshes: &'m [Option<RegionMesh>],
    ) -> Result<Vec<Option<Sweeps<'m, 'm>>>, PlanError> {
        let mut chosen = chosen(meshes, &self.options.guides)?;
        let sweeps = |(region, mesh): (usize, &'m Option<RegionMesh>)| {
            mesh.as_ref()
                .map(|mesh| Sweeps::new(mesh, &self.faces_of[region], &self.sides, chosen.remove(&region)))
        };
        Ok(meshes.iter().enumerate().map(sweeps).collect())
    }

    /// The parts of shares: those that are known, and the others laid and kept. Parts in which nothing is cut are left out.
    pub(super) fn parts(
        &self,
        shares: &[Share],
        known: Vec<Known>,
        sweeps: &[Option<Sweeps>],
    ) -> Result<Vec<Placed>, Cancelled> {
        let done = AtomicUsize::new(0);
        let part = |(share, known): (&Share, Known)| {
            self.monitor.go_on()?;
            let begun = done.fetch_add(1, Ordering::Relaxed);
            self.monitor.at(Stage::Paths, begun as f64 / shares.len() as f64);
            let part = known.part.unwrap_or_else(|| {
                let part = self.lay(&self.contexts, share, sweeps);
                self.keys.as_ref().zip(known.key).inspect(|(keys, key)| keys.keep(key, &part));
                part
            });
            Ok(part.map(|part| (share.setup, share.region, part)))
        };
        // A part has stages of its own that are not parallel: meanwhile others go on, and the largest ones begin.
        let parts = shares.par_iter().zip(known).with_max_len(1).map(part);
        Ok(parts.collect::<Result<Vec<_>, Cancelled>>()?.into_iter().flatten().collect())
    }

    /// The passes of a share.
    pub(super) fn lay(
        &self,
        contexts: &[SetupContext],
        share: &Share,
        sweeps: &[Option<Sweeps>],
    ) -> Option<Part> {
        let &Share { setup, region } = share;
        let area_mm2 = self.area_mm2(share);
        let _span = info_span!("part", setup, region, area_m2 = 1e-6 * area_mm2).entered();
        contexts[setup].part(&self.faces_of[region], area_mm2, sweeps[region].as_ref())
    }
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
            claims: Claims::of_setup(covering, assignments, setup),
            walls: Walls::new(covering, assignments, setup, space, &regions.merged.joints),
            heights: Heights::new(ball),
        }
    }
}

fn group(region_of_face: &[usize]) -> Vec<Vec<usize>> {
    let mut faces = vec![Vec::new(); region_of_face.iter().max().map_or(0, |m| m + 1)];
    for (face, &region) in region_of_face.iter().enumerate() {
        faces[region].push(face);
    }
    faces
}
