use std::cmp::Ordering;

use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::Tool;

use crate::drop::DropMesh;
use crate::holder::sides_enter;
use crate::mesh::Mesh;
use crate::report::SurfaceState;
use crate::scene::Scene;

/// Radius of the line of sight, in tool radii.
const SIGHT_RADIUS: f64 = 0.01;

/// Judges whether the tool could have touched a point of the surface, from the model and the setups' axes
/// alone.
///
/// ```text
///   q = p + R·n   ball there?      exact distance of q from all faces ≥ R − sink
///   along axis    shank there?     tool of radius R − sink lowered on the mesh stops below q; flutes and shank of
///                                  another thickness enter nothing
///   otherwise     seen at all?     the same with a thin pin at p: yes → too tight, no → hidden
/// ```
pub(crate) struct Reach<'a> {
    scene: &'a Scene<'a>,
    setups: Vec<(Vector3, DropMesh<'a>)>,
    tool: Tool,
    /// The earlier tool, where a job cuts its rest.
    earlier: Option<Tool>,
    /// What it may have left where it counts as having been, over the crests of its passes, mm.
    earlier_sink_mm: f64,
    least_cosine: f64,
}

impl<'a> Reach<'a> {
    /// Prepares the views of all setups of the job.
    pub(crate) fn new(scene: &'a Scene<'a>, mesh: &'a Mesh) -> Self {
        let axes = scene.job.setups.iter().map(|s| Vector3::from(s.axis).normalize());
        Reach {
            scene,
            setups: axes.map(|a| (a, DropMesh::new(mesh, &a))).collect(),
            tool: scene.job.request.tool,
            earlier: scene.job.request.rest_of,
            earlier_sink_mm: (scene.options.cut_limit - 1.0) * scene.scallop_mm(),
            least_cosine: scene.options.steepest_deg.to_radians().cos(),
        }
    }

    /// The view of one setup.
    pub(crate) fn setup(&self, index: usize) -> &DropMesh<'a> {
        &self.setups[index].1
    }

    /// What a point with normal `±n` is to the tool, if the ball may enter other places by `sink_mm`:
    /// [`SurfaceState::ReachableLeft`], [`SurfaceState::EarlierTool`], [`SurfaceState::TooTight`] or
    /// [`SurfaceState::Hidden`].
    pub(crate) fn judge(&self, p: &Point3, n: &Vector3, sink_mm: f64) -> SurfaceState {
        let mut sides = [*n, -n].map(|n| (self.side(p, &n, sink_mm), n));
        // Of a sheet without thickness the side counts that faces a setup best, and of equal ones that which is done.
        let facing = |n: &Vector3| self.setups.iter().map(|(axis, _)| n.dot(axis)).fold(-1.0, f64::max);
        let second_counts = match facing(&sides[1].1).total_cmp(&facing(&sides[0].1)) {
            Ordering::Less => false,
            Ordering::Equal => sides[1].0 == SurfaceState::EarlierTool,
            Ordering::Greater => true,
        };
        if self.earlier.is_some() && second_counts {
            sides.swap(0, 1);
        }
        let reached = [SurfaceState::ReachableLeft, SurfaceState::EarlierTool];
        let has = |state| sides.iter().any(|s| s.0 == state);
        if let Some((state, _)) = sides.iter().find(|s| reached.contains(&s.0)) {
            *state
        } else if has(SurfaceState::TooTight) {
            SurfaceState::TooTight
        } else {
            SurfaceState::Hidden
        }
    }

    /// Whether what is left over this side of a point is the tool's to cut, and no earlier one's on the other side.
    pub(crate) fn is_left(&self, p: &Point3, n: &Vector3, sink_mm: f64) -> bool {
        let left = SurfaceState::ReachableLeft;
        self.side(p, n, sink_mm) == left && (self.earlier.is_none() || self.judge(p, n, sink_mm) == left)
    }

    /// What one side of a point is to the tool.
    fn side(&self, p: &Point3, n: &Vector3, sink_mm: f64) -> SurfaceState {
        let mut facing = self.setups.iter().filter(|(axis, _)| n.dot(axis) >= self.least_cosine);
        let fits = |tool: Tool, sink_mm: f64| {
            let radius_mm = tool.radius_mm();
            let (ball, slim) = (p + n * radius_mm, radius_mm - sink_mm);
            let passes = |view: &DropMesh<'_>| {
                let centre = view.in_frame(&ball);
                let tip = centre - Vector3::z() * radius_mm;
                !view.blocks(&centre, slim) && !sides_enter(view, &tool, &tip)
            };
            facing.clone().next().is_some()
                && !self.scene.closest.any_within(&ball, slim)
                && !self.scene.obstacles.any_within(&ball, slim)
                && facing.clone().any(|(_, view)| passes(view))
        };
        if self.earlier.is_some_and(|tool| fits(tool, self.earlier_sink_mm)) {
            return SurfaceState::EarlierTool;
        }
        if fits(self.tool, sink_mm) {
            return SurfaceState::ReachableLeft;
        }
        let pin = SIGHT_RADIUS * self.tool.radius_mm();
        let sees = |view: &DropMesh<'_>| {
            let end = p + n * (pin + view.worst_deviation_mm());
            !view.screens(&view.in_frame(&end), pin)
        };
        if facing.any(|(_, view)| sees(view)) { SurfaceState::TooTight } else { SurfaceState::Hidden }
    }
}
