//! What a tool can reach: from which setups, and why not from any. It knows nothing of the planner.

use std::cmp::Ordering;

use claymill_nurbs::{Aabb, FaceMesh, Hint, Point3, Vector3};
use claymill_toolpath::{FreeSide, Tool};

use crate::directions::{axis, directions};
use crate::drop::DropMesh;
use crate::end::faces::Nearest;
use crate::end::{EndBody, EndFaces};
use crate::holder::{Held, sides_enter};
use crate::limits::{Limits, STRIP_MM};
use crate::mesh::Mesh;
use crate::openings::let_through;
use crate::report::SurfaceState;
use crate::scene::Scene;
use crate::stock::ToolPart;

/// Radius of the line of sight, in tool radii.
const SIGHT_RADIUS: f64 = 0.01;
/// A wall may lean over by rounding (`n·axis`).
const UPRIGHT: f64 = -2e-3;
/// Passes keep so far from walls, mm: between two that the tool just fits into, there is no room for any.
const OFF_WALL_MM: f64 = 4e-3;
/// Down to so many tool radii below where the tool rests over it a wall is within reach.
const DEEPEST_RADII: f64 = 19.0;
/// Nothing stands out over a wall by more than this, mm, looked for at heights this far apart, in tool radii.
const STANDS_OUT_MM: f64 = 2e-3;
const RISE_RADII: f64 = 0.25;
/// What looks down by more than this (`−n·up`, 10°), over so many tool radii of room, is no wall.
const DOWNWARD: f64 = 0.173_648;
const ROOM_RADII: f64 = 10.0;
/// No model is larger, mm; and ways out of it that run along nothing.
const FAR_MM: f64 = 1e7;
const WAYS_OUT: [[f64; 3]; 8] = [
    [0.61, 0.53, 0.59],
    [-0.57, 0.49, 0.66],
    [0.52, -0.63, 0.58],
    [0.55, 0.62, -0.56],
    [-0.64, -0.51, 0.57],
    [-0.5, 0.66, -0.56],
    [0.58, -0.54, -0.61],
    [-0.6, -0.58, -0.55],
];
/// On its way up from a place a tool is looked for in the material in such steps, in its radii, where a face is near; and so far
/// around.
const UPWARD_RADII: f64 = 0.1;
const AROUND_RADII: f64 = 8.0;
/// It is in the way of the material where it comes so near to that side, in what counts as cut and as seen from a path.
const NEAR_MATERIAL: f64 = 1.25;
/// The room begins this far from the surface, mm.
const OFF_SURFACE_MM: f64 = 0.01;

/// Whether something holds for a place and a direction.
pub(crate) type Judged<'a> = &'a (dyn Fn(&Point3, &Vector3) -> bool + Sync);

/// What of a tool runs into something, with the ball's centre in a place and along an axis.
pub(crate) type Struck<'a> = &'a (dyn Fn(&Point3, &Vector3) -> Option<ToolPart> + Sync);

/// What is asked of the stock.
#[derive(Clone, Copy, Default)]
pub(crate) struct AskedOfStock<'a> {
    /// Whether stock stands over a place, towards a unit normal, that is worth cutting; where only that is to be cut.
    pub(crate) stands: Option<Judged<'a>>,
    /// Whether shank or holder run into it.
    pub(crate) struck: Option<Struck<'a>>,
}

/// Judges whether the tool could have touched a point of the surface, from the model and the directions alone that it can be
/// cut from, whether or not the job has setups there.
///
/// ```text
///   q = p + R·n   ball there?      exact distance of q from all faces ≥ R − sink
///   along axis    shank there?     tool of radius R − sink lowered on the mesh stops below q; flutes and shank of
///                                  another thickness enter nothing, and the holder keeps its distance
///   material?     on its way up nothing is nearest to the ball on the side of its material
///   a wall?       n·axis ≈ 0       not too deep, no underside, no ceiling; no sink, so that nothing opposite is in the way
///   stock?        shank and holder stand in none, where that is followed; else it is too tight
///   in bounds?    ball at q        boxes, faces cut, faces avoided and obstacles allow it; in no setup that it fits in: out of bounds
///   otherwise     seen at all?     the same with a thin pin at p: yes → too tight, no → hidden
/// ```
pub(crate) struct Reach<'a> {
    scene: &'a Scene<'a>,
    /// The views of the job's setups, then those from where else it could be cut.
    views: Vec<(Vector3, DropMesh<'a>)>,
    limits: Option<Limits<'a>>,
    tool: Tool,
    /// What holds it in each view, and the earlier one; and the distance that it keeps, mm.
    held: Vec<Option<Held>>,
    earlier_held: Vec<Option<Held>>,
    held_off_mm: f64,
    /// The earlier tool, where a job cuts its rest.
    earlier: Option<Tool>,
    /// What it may have left where it counts as having been, over the crests of its passes, mm.
    earlier_sink_mm: f64,
    stock: AskedOfStock<'a>,
    least_cosine: f64,
    /// The end, if it is no ball, and the faces that it is held against.
    end: Option<(EndBody, EndFaces<'a>)>,
    up: Option<Vector3>,
    /// As far as a tool has to go to be out of a model that it may get behind, mm.
    way_out_mm: Option<f64>,
}

impl<'a> Reach<'a> {
    /// Prepares the views from all directions.
    pub(crate) fn new(scene: &'a Scene<'a>, mesh: &'a Mesh, meshes: &'a [Option<FaceMesh>]) -> Self {
        let tools = scene.job.tools.iter().map(|t| &t.tool).chain([&scene.job.request.tool]);
        let end = tools.filter_map(EndBody::of).next();
        let own = [Some(&scene.job.request.tool), scene.job.request.rest_of.as_ref()];
        let axes = directions(scene.job);
        let held = |tool: Option<Tool>| -> Vec<Option<Held>> {
            let number = scene.job.tools.iter().position(|t| Some(t.tool) == tool);
            (0..axes.len()).map(|view| Some(Held::of(&scene.holder(number?, view)?))).collect()
        };
        let thinnest_mm = own.into_iter().flatten().map(Tool::radius_mm).fold(f64::INFINITY, f64::min);
        Reach {
            scene,
            views: axes.iter().map(|&a| (a, DropMesh::new(mesh, &a))).collect(),
            limits: Limits::new(scene, mesh),
            tool: scene.job.request.tool,
            held: held(Some(scene.job.request.tool)),
            earlier_held: held(scene.job.request.rest_of),
            held_off_mm: scene.holder_clearance_mm(),
            earlier: scene.job.request.rest_of,
            earlier_sink_mm: (scene.options.cut_limit - 1.0) * scene.scallop_mm(),
            stock: AskedOfStock::default(),
            least_cosine: scene.options.steepest_deg.to_radians().cos(),
            end: end.map(|body| (body, EndFaces::new(scene.model, meshes))),
            up: axis(&scene.job.request.up),
            way_out_mm: way_out_mm(scene, thinnest_mm),
        }
    }

    /// The same with the stock that there is.
    pub(crate) fn in_stock(self, stock: AskedOfStock<'a>) -> Self {
        Reach { stock, ..self }
    }

    /// Whether nothing but the faces says what can be reached by a ball.
    pub(crate) fn is_of_faces_alone(&self) -> bool {
        let AskedOfStock { stands, struck } = &self.stock;
        let scene = self.scene;
        self.limits.is_none()
            && self.earlier.is_none()
            && self.end.is_none()
            && self.held.iter().all(Option::is_none)
            && stands.is_none()
            && struck.is_none()
            && scene.obstacles.triangles.is_empty()
            && scene.kept_clear.is_empty()
    }

    /// All views with their axes, those of the job's setups first, and as far as a tool has to go to be out of the model, mm.
    pub(crate) fn outward(&self) -> (Vec<(Vector3, &DropMesh<'a>)>, Option<f64>) {
        (self.views.iter().map(|(axis, view)| (*axis, view)).collect(), self.way_out_mm)
    }

    /// The view of one setup.
    pub(crate) fn setup(&self, index: usize) -> &DropMesh<'a> {
        &self.views[index].1
    }

    /// What an end is nearest to in a setup, if that is no farther than `within_mm`; `last` is what it was nearest to a little
    /// before.
    pub(crate) fn nearest_to_end(
        &self,
        setup: usize,
        tip_and_axis: [&Vector3; 2],
        body: &EndBody,
        within_mm: f64,
        last: Option<&Nearest>,
    ) -> Option<Nearest> {
        self.end.as_ref()?.1.nearest(self.setup(setup), tip_and_axis, body, within_mm, last)
    }

    /// Whether something holds the tool in a setup.
    pub(crate) fn has_holder(&self, setup: usize) -> bool {
        self.held.get(setup).is_some_and(Option::is_some)
    }

    /// Whether the holder surely comes too near to the model in a setup, with the tip in one place of its view.
    pub(crate) fn is_held_off(&self, setup: usize, tip: &Point3) -> bool {
        self.holds_off(&self.held, setup, tip)
    }

    fn holds_off(&self, held: &[Option<Held>], setup: usize, tip: &Point3) -> bool {
        let held = held.get(setup).and_then(Option::as_ref);
        held.is_some_and(|held| held.comes_near(self.setup(setup), tip, self.held_off_mm))
    }

    /// Where the tool is kept, if the job says so.
    pub(crate) fn limits(&self) -> Option<&Limits<'a>> {
        self.limits.as_ref()
    }

    /// What a point with normal `n`, of which a side is `free`, is to the tool, if the ball may enter other places by `sink_mm`:
    /// [`SurfaceState::ReachableLeft`], [`SurfaceState::EarlierTool`], [`SurfaceState::OutOfBounds`],
    /// [`SurfaceState::HolderInTheWay`], [`SurfaceState::TooTight`] or [`SurfaceState::Hidden`].
    pub(crate) fn judge(&self, p: &Point3, n: &Vector3, sink_mm: f64, free: FreeSide) -> SurfaceState {
        let mut sides = [(true, *n), (false, -n)].map(|(along, n)| {
            let state = if free.allows(along) { self.side(p, &n, sink_mm) } else { SurfaceState::Hidden };
            (state, n)
        });
        // Of a sheet without thickness the side counts that faces a setup best, and of equal ones that which is done.
        let second_counts = match self.facing(&sides[1].1).total_cmp(&self.facing(&sides[0].1)) {
            Ordering::Less => false,
            Ordering::Equal => sides[1].0 == SurfaceState::EarlierTool,
            Ordering::Greater => true,
        };
        if self.earlier.is_some() && free.is_both() && second_counts {
            sides.swap(0, 1);
        }
        let reached = [SurfaceState::ReachableLeft, SurfaceState::EarlierTool];
        let has = |state| sides.iter().any(|s| s.0 == state);
        if let Some((state, _)) = sides.iter().find(|s| reached.contains(&s.0)) {
            *state
        } else if has(SurfaceState::OutOfBounds) {
            SurfaceState::OutOfBounds
        } else if has(SurfaceState::HolderInTheWay) {
            SurfaceState::HolderInTheWay
        } else if has(SurfaceState::TooTight) {
            SurfaceState::TooTight
        } else {
            SurfaceState::Hidden
        }
    }

    /// The one of `±n` that faces a setup best; `n` where that is the free side.
    pub(crate) fn best_facing(&self, n: &Vector3, free: FreeSide) -> Vector3 {
        if free.is_both() && self.facing(&-n) > self.facing(n) { -n } else { *n }
    }

    /// How well a normal faces the setup that it faces best (cosine).
    fn facing(&self, n: &Vector3) -> f64 {
        self.views.iter().map(|(axis, _)| n.dot(axis)).fold(-1.0, f64::max)
    }

    /// Where the ball's centre comes to rest over a point, in every setup that it faces.
    pub(crate) fn lowered_over<'s>(
        &'s self,
        p: &'s Point3,
        n: &'s Vector3,
    ) -> impl Iterator<Item = Point3> + 's {
        let facing = self.views.iter().filter(|(axis, _)| n.dot(axis) >= self.least_cosine);
        facing.filter_map(|(_, view)| {
            let at = view.in_frame(p);
            let height = view.highest(&at, self.tool.radius_mm())?;
            Some(view.in_model(&Point3::new(at.x, at.y, height)))
        })
    }

    /// Whether what is left over this side of a point, which is free or as free as the other one, is the tool's to cut, and no
    /// earlier one's on the other side.
    pub(crate) fn is_left(&self, p: &Point3, n: &Vector3, sink_mm: f64, is_both: bool) -> bool {
        let (left, free) =
            (SurfaceState::ReachableLeft, if is_both { FreeSide::Both } else { FreeSide::Along });
        self.side(p, n, sink_mm) == left
            && (self.earlier.is_none() || self.judge(p, n, sink_mm, free) == left)
    }

    /// Whether a ball that touches a point from the side of `n` is inside of a body: it leads out through an odd number of faces
    /// whichever way one goes. Not where the material's side was asked for.
    pub(crate) fn is_inside(&self, p: &Point3, n: &Vector3) -> bool {
        if !self.scene.job.request.material_side.is_empty() {
            return false;
        }
        let centre = p + n * self.tool.radius_mm();
        // Mostly the way the tool came is free, which settles it.
        let mut axes: Vec<Vector3> = self.views.iter().map(|view| view.0).collect();
        axes.sort_by(|a, b| n.dot(b).total_cmp(&n.dot(a)));
        let is_odd = |way: Vector3| {
            let met = self.scene.closest.crossings(&centre, &way, FAR_MM);
            met.complete && met.all.len() % 2 == 1
        };
        axes.into_iter().chain(WAYS_OUT.map(Vector3::from)).all(is_odd)
    }

    /// How far the tool comes to rest above a point.
    fn depth_mm(&self, p: &Point3, view: &DropMesh<'_>) -> f64 {
        let (at, radius_mm) = (view.in_frame(p), self.tool.radius_mm());
        view.highest(&at, radius_mm).map_or(0.0, |centre| centre - radius_mm - at.z)
    }

    /// Whether a ball is in the material somewhere on its way up from a place of its centre.
    fn comes_through_material(&self, centre: &Point3, axis: &Vector3, radius_mm: f64) -> bool {
        let Some(way_out_mm) = self.way_out_mm else { return false };
        let options = &self.scene.options;
        let seen_mm = options.path_spacing_mm.max(options.cut_limit * self.scene.scallop_mm());
        let within_mm = radius_mm + NEAR_MATERIAL * seen_mm;
        let (mut hint, mut risen_mm) = (Hint::default(), 0.0);
        while risen_mm <= way_out_mm {
            let at = centre + axis * risen_mm;
            let around_mm = within_mm + AROUND_RADII * radius_mm;
            let foot = self.scene.closest.closest_from(&at, around_mm, &mut hint);
            let clear_mm = foot.as_ref().map_or(around_mm, |foot| foot.distance_mm) - within_mm;
            if clear_mm <= 0.0 && foot.is_some_and(|foot| self.scene.is_in_material(&foot, &at)) {
                return true;
            }
            risen_mm += clear_mm.max(UPWARD_RADII * radius_mm);
        }
        false
    }

    /// Whether nothing stands out over a wall: balls one above the other enter no face.
    fn is_free_above(&self, p: &Point3, n: &Vector3, axis: &Vector3) -> bool {
        let radius_mm = self.tool.radius_mm();
        let steps = (DEEPEST_RADII / RISE_RADII) as u32;
        let above = |k: u32| p + n * radius_mm + axis * (f64::from(k) * RISE_RADII * radius_mm);
        !(1..=steps).any(|k| self.scene.closest.any_within(&above(k), radius_mm - STANDS_OUT_MM))
    }

    /// Whether a side of a point is that of an underside or a ceiling.
    fn is_underside(&self, p: &Point3, n: &Vector3) -> bool {
        self.up.is_some_and(|up| {
            let from = p + n * OFF_SURFACE_MM;
            let room_mm = ROOM_RADII * self.tool.radius_mm();
            n.dot(&up) < -DOWNWARD && self.scene.closest.crossings(&from, &-up, room_mm).all.is_empty()
        })
    }

    /// Whether the ball, and what comes down with it, surely keeps the distance from obstacles that is asked for.
    fn is_clear_of_obstacles(&self, view: &DropMesh<'_>, centre: &Point3, radius_mm: f64) -> bool {
        let clearance_mm = self.scene.check_clearance_mm();
        let kept_mm = radius_mm + clearance_mm + STRIP_MM;
        self.scene.obstacles.triangles.is_empty()
            || clearance_mm == 0.0
            || !view.obstacles_block(&view.in_frame(centre), kept_mm)
    }

    /// Whether an end that is no ball, in contact with one side of a point, enters nothing by more than `sink_mm`.
    fn end_fits(&self, p: &Point3, n: &Vector3, body: &EndBody, sink_mm: f64) -> Option<SurfaceState> {
        let faces = &self.end.as_ref()?.1;
        let mut fits = None;
        let facing = self.views.iter().enumerate().filter(|(_, (axis, _))| n.dot(axis) >= self.least_cosine);
        for (setup, (axis, view)) in facing {
            let tip = body.tip_over(p, n, axis);
            let enters = faces.nearest(view, [&tip.coords, axis], body, -sink_mm, None).is_some();
            let at = view.in_frame(&tip);
            if enters || sides_enter(view, &self.tool, &at) {
                continue;
            }
            if self.comes_through_material(&(tip + axis * body.radius_mm), axis, body.radius_mm) {
                fits.get_or_insert(SurfaceState::Hidden);
            } else if self.is_held_off(setup, &at) {
                fits = Some(SurfaceState::HolderInTheWay);
            } else {
                return Some(SurfaceState::ReachableLeft);
            }
        }
        fits
    }

    /// What one side of a point is to the tool.
    fn side(&self, p: &Point3, n: &Vector3, sink_mm: f64) -> SurfaceState {
        let facing = || self.views.iter().enumerate().filter(|(_, (axis, _))| n.dot(axis) >= UPRIGHT);
        let looks_down = std::cell::OnceCell::new();
        let faces_well = |axis: &Vector3| n.dot(axis) >= self.least_cosine;
        let counts = |axis: &Vector3, view: &DropMesh<'_>| {
            let is_shallow = || self.depth_mm(p, view) <= DEEPEST_RADII * self.tool.radius_mm();
            let is_upside = || !*looks_down.get_or_init(|| self.is_underside(p, n));
            let is_wall = || is_shallow() && is_upside() && self.is_free_above(p, n, axis);
            // Passes beside walls are those of a ball.
            faces_well(axis) || (self.tool.is_ball() && is_wall())
        };
        // In bounds or out of them, if at all; hidden where it would only come through the material.
        let fits = |tool: Tool, sink_mm: f64, limits: Option<&Limits<'_>>| {
            let radius_mm = tool.radius_mm();
            let (ball, slim) = (p + n * radius_mm, radius_mm - sink_mm);
            let passes = |view: &DropMesh<'_>| {
                let centre = view.in_frame(&ball);
                let tip = centre - Vector3::z() * radius_mm;
                !view.blocks(&centre, slim) && !sides_enter(view, &tool, &tip)
            };
            let is_held_off = |setup: usize, view: &DropMesh<'_>| {
                let held = if tool == self.tool { &self.held } else { &self.earlier_held };
                let tip = view.in_frame(&ball) - Vector3::z() * radius_mm;
                self.holds_off(held, setup, &tip)
            };
            let beside = ball + n * OFF_WALL_MM;
            let has_room = || !self.scene.closest.any_within(&beside, radius_mm - STANDS_OUT_MM);
            let is_free = facing().next().is_some()
                && !self.scene.closest.any_within(&ball, slim)
                && !self.scene.obstacles.any_within(&ball, slim);
            let fitting = facing().filter(|(_, (axis, view))| {
                is_free && passes(view) && counts(axis, view) && (faces_well(axis) || has_room())
            });
            let mut fits = None;
            for (setup, (axis, view)) in fitting {
                if self.comes_through_material(&ball, axis, radius_mm) {
                    fits.get_or_insert(SurfaceState::Hidden);
                    continue;
                }
                let is_allowed = limits.is_none_or(|limits| limits.allow(setup, &ball, p, radius_mm));
                if !(is_allowed && self.is_clear_of_obstacles(view, &ball, radius_mm)) {
                    fits = Some(SurfaceState::OutOfBounds);
                    continue;
                }
                // Stock that an earlier tool left is there for this one to cut.
                let asked = self.stock.struck.filter(|_| tool == self.tool);
                let struck = asked.and_then(|struck| struck(&ball, axis));
                if struck == Some(ToolPart::Holder) || (struck.is_none() && is_held_off(setup, view)) {
                    fits.get_or_insert(SurfaceState::HolderInTheWay);
                } else if struck.is_some() {
                    fits.get_or_insert(SurfaceState::TooTight);
                } else {
                    return Some(SurfaceState::ReachableLeft);
                }
            }
            fits
        };
        let gets_there =
            |state: SurfaceState| !matches!(state, SurfaceState::Hidden | SurfaceState::HolderInTheWay);
        if self.earlier.is_some_and(|tool| fits(tool, self.earlier_sink_mm, None).is_some_and(gets_there)) {
            return SurfaceState::EarlierTool;
        }
        let own = match EndBody::of(&self.tool) {
            None => fits(self.tool, sink_mm, self.limits.as_ref()),
            Some(body) => self.end_fits(p, n, &body, sink_mm),
        };
        match own {
            Some(SurfaceState::ReachableLeft) if self.stock.stands.is_some_and(|stands| !stands(p, n)) => {
                return SurfaceState::EarlierTool;
            }
            Some(state) => return state,
            None => {}
        }
        let pin = SIGHT_RADIUS * self.tool.radius_mm();
        let sees = |view: &DropMesh<'_>| {
            let end = p + n * (pin + view.worst_deviation_mm());
            !view.screens(&view.in_frame(&end), pin)
        };
        if facing().any(|(_, (axis, view))| sees(view) && counts(axis, view)) {
            SurfaceState::TooTight
        } else {
            SurfaceState::Hidden
        }
    }
}

/// The size of a model that a ball may get behind, mm.
fn way_out_mm(scene: &Scene<'_>, radius_mm: f64) -> Option<f64> {
    if scene.free_sides.iter().all(|side| side.is_both()) || !let_through(scene, radius_mm) {
        return None;
    }
    let mut around = Aabb::empty();
    for pole in scene.model.faces.iter().flat_map(|face| face.surface.net()) {
        around.add(&(pole.xyz() / pole.w).into());
    }
    (!around.is_empty()).then(|| around.diagonal())
}
