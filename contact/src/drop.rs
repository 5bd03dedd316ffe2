//! The ball dropped along the tool axis on all faces: branch and bound over the covering, then Newton on
//! the exact surfaces.

use std::sync::OnceLock;

use claymill_nurbs::{Aabb, Curve2, Domain, FaceId, Leaves, Model, NurbsSurface, Point2, Point3};
use claymill_toolpath::{Holder, Tool};
use rayon::prelude::*;

use crate::Frame;
use crate::certificate::one_sheet::Certificates;
use crate::certificate::support_bound::SupportBound;
use crate::covering::{Covering, EdgePiece};
use crate::cutter::{Body, Effort, EndShape, held_above};
use crate::exact::edge::OnEdge;
use crate::exact::face::{Pace, Polished, polish};
use crate::exact::flat::{box_height, on_point, on_triangle, plane_height};
use crate::exact::shape::{Flat, OnPlane, Shape};
use crate::material::behind::Material;
use crate::material::free_sides::FreeSides;
use crate::material::rims::Rims;
use crate::search::tree::DropTree;
use crate::search::vertex_bound::VertexBound;
use crate::{CONTACT_EPSILON_MM, Location, Support};

/// A triangle where `κ⁺·R` exceeds this may hold more than one contact.
pub(crate) const TIGHT: f64 = 0.8;
/// Sides of a domain that are shorter than this are a point, mm; in so many places it is looked.
const POLE_MM: f64 = 1e-9;
const POLE_LOOKS: u32 = 7;

/// The whole model as seen from one setup, ready for dropping a ball of one radius on it.
#[derive(Debug)]
pub struct BallDrop<'a> {
    radius_mm: f64,
    pub(crate) covering: &'a Covering,
    pub(crate) faces: Vec<SetupFace>,
    pub(crate) triangles: Vec<Triangle>,
    pub(crate) edges: Vec<EdgePiece>,
    pub(crate) tree: DropTree,
    pub(crate) certificates: Certificates,
    vertex_bound: OnceLock<VertexBound>,
    /// What stands out above the ball.
    sides: Vec<Body>,
    end: EndShape,
    /// The end, if it is no ball, and what stands out above it.
    pub(crate) bodies: Vec<Body>,
    /// The sides of faces that it may touch when it cuts.
    pub(crate) free: FreeSides<'a>,
    pub(crate) rims: Rims,
    /// Where it is in the material though it may touch nothing there; `None` where it cannot be.
    pub(crate) material: Option<Material<'a>>,
    widest_mm: f64,
}

#[derive(Debug)]
pub(crate) struct SetupFace {
    pub(crate) surface: NurbsSurface,
    /// The same for evaluation.
    pub(crate) leaves: Leaves,
    /// The trims; `None` where the whole domain belongs to the face.
    pub(crate) domain: Option<Domain>,
    pub(crate) boundary: Vec<Curve2>,
    pub(crate) shape: Shape,
    /// No place of the face is higher, mm.
    pub(crate) top_mm: f64,
    poles: OnceLock<[bool; 4]>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Triangle {
    pub(crate) p: [Point3; 3],
    pub(crate) face: u32,
    pub(crate) index: u32,
    pub(crate) deviation_mm: f32,
    pub(crate) tight: bool,
    pub(crate) rimmed: bool,
}

impl SetupFace {
    /// Whether a side of the domain is one point: where `u` begins and ends, and `v`.
    pub(crate) fn poles(&self) -> [bool; 4] {
        *self.poles.get_or_init(|| poles(&self.leaves))
    }

    /// Whether parameters are of a place inside the trims.
    pub(crate) fn holds(&self, u: f64, v: f64) -> bool {
        let ((u0, u1), (v0, v1)) = self.leaves.domain();
        let inside = (u0..=u1).contains(&u) && (v0..=v1).contains(&v);
        inside && self.domain.as_ref().is_none_or(|d| d.contains(u, v))
    }
}

impl<'a> BallDrop<'a> {
    /// Looks at a covered model from a setup. The radius should be the one that it was covered for.
    #[must_use]
    pub fn new(model: &Model, covering: &'a Covering, frame: &Frame, radius_mm: f64) -> Self {
        let faces: Vec<SetupFace> = model
            .faces
            .par_iter()
            .map(|f| {
                let surface = f.surface.mapped(|p| frame.to_setup(&p));
                SetupFace {
                    poles: OnceLock::new(),
                    shape: Shape::of(&surface),
                    top_mm: surface.net().iter().map(|h| h.z / h.w).fold(f64::NEG_INFINITY, f64::max),
                    leaves: Leaves::new(&surface),
                    surface,
                    domain: (!f.loops.is_empty()).then(|| Domain::new(f)),
                    boundary: f.boundary().into_iter().flat_map(|l| l.edges).map(|e| e.pcurve).collect(),
                }
            })
            .collect();
        let triangles: Vec<Triangle> = covering
            .meshes
            .par_iter()
            .zip(&covering.curvature)
            .zip(&covering.deviation_mm)
            .enumerate()
            .flat_map_iter(|(face, ((mesh, curvature), deviation))| {
                mesh.triangles.iter().enumerate().map(move |(index, t)| {
                    let p = t.map(|i| frame.to_setup(&mesh.points[i as usize]));
                    // The mesh's triangles agree with Su × Sv; the upper side decides which curvature is κ⁺.
                    let up = (p[1] - p[0]).cross(&(p[2] - p[0])).z >= 0.0;
                    let kappa = if up { curvature[index][1] } else { -curvature[index][0] };
                    Triangle {
                        p,
                        face: face as u32,
                        index: index as u32,
                        deviation_mm: deviation[index],
                        tight: f64::from(kappa) * radius_mm > TIGHT,
                        rimmed: covering.rimmed[face][index],
                    }
                })
            })
            .collect();
        let edges: Vec<EdgePiece> = covering
            .edges
            .iter()
            .map(|e| EdgePiece { a: frame.to_setup(&e.a), b: frame.to_setup(&e.b), ..e.clone() })
            .collect();
        let boxes: Vec<Aabb> = triangles
            .iter()
            .map(|t| Aabb::of(&t.p).inflated(f64::from(t.deviation_mm)))
            .chain(edges.iter().map(|e| Aabb::of([&e.a, &e.b]).inflated(e.deviation_mm)))
            .collect();
        let (tree, sides) = (DropTree::new(&boxes), Vec::new());
        let certificates = Certificates::new(&covering.adjacency, &tree.0);
        let vertex_bound = OnceLock::new();
        BallDrop {
            radius_mm,
            covering,
            faces,
            triangles,
            edges,
            tree,
            certificates,
            vertex_bound,
            sides,
            end: EndShape::ball(radius_mm),
            bodies: Vec::new(),
            free: FreeSides::default(),
            rims: Rims::default(),
            material: None,
            widest_mm: radius_mm,
        }
    }

    /// The same with the taper and the shank above the ball of a tool, which it must not touch with either; and of any
    /// other end.
    #[must_use]
    pub fn of_tool(model: &Model, covering: &'a Covering, frame: &Frame, tool: &Tool) -> Self {
        let ball = BallDrop::new(model, covering, frame, tool.radius_mm());
        let (sides, end) = (Body::sides(tool), EndShape::of(tool));
        let of_end = (!end.is_ball()).then(|| Body::end(tool));
        let bodies = of_end.map_or_else(Vec::new, |own| [own].into_iter().chain(sides.clone()).collect());
        BallDrop { sides, end, bodies, widest_mm: tool.widest_mm(), ..ball }
    }

    /// The same with a holder above the tool, which must keep so far from everything, mm.
    #[must_use]
    pub fn with_holder(mut self, holder: &Holder, clearance_mm: f64) -> Self {
        let above = Body::of_holder(holder, self.widest_mm, clearance_mm);
        self.widest_mm = above.iter().map(|body| body.widest).fold(self.widest_mm, f64::max);
        self.bodies.extend(above.iter().filter(|_| !self.end.is_ball()));
        self.sides.extend(above);
        self
    }

    /// The tool's end.
    #[must_use]
    pub fn end(&self) -> EndShape {
        self.end
    }

    /// Corners of the triangles, which lie on the faces.
    pub(crate) fn vertex_bound(&self) -> &VertexBound {
        self.vertex_bound
            .get_or_init(|| VertexBound::new(self.triangles.iter().flat_map(|t| &t.p), self.radius_mm))
    }

    /// The largest radius of ball, taper and shank.
    #[must_use]
    pub fn widest_mm(&self) -> f64 {
        self.widest_mm
    }

    /// Where the ball is if taper or shank hold it up above where it would `rest` itself.
    fn held_by_sides(&self, rest: Option<Location>, x: f64, y: f64) -> Option<Location> {
        let floor = rest.map_or(f64::NEG_INFINITY, |l| l.centre.z - self.radius_mm);
        let held = held_above(self, &self.sides, [x, y], floor, Effort::IN_THE_WAY)?;
        let centre = Point3::new(x, y, held.tip + self.radius_mm);
        Some(Location {
            centre,
            normal: held.normal,
            face: held.face,
            support: Support::Side,
            certified: false,
        })
    }

    /// The ball's radius; of another end the largest.
    #[must_use]
    pub fn radius_mm(&self) -> f64 {
        self.radius_mm
    }

    /// The surface of a face in the setup's coordinates.
    #[must_use]
    pub fn surface(&self, face: FaceId) -> &NurbsSurface {
        &self.faces[face].surface
    }

    /// Drops the ball at `(x, y)` on everything (setup coordinates, mm). `None` where nothing is below.
    #[must_use]
    pub fn drop(&self, x: f64, y: f64) -> Option<Location> {
        if !self.end.is_ball() {
            return self.rest_of_end([x, y], None, f64::NEG_INFINITY);
        }
        let mut search = Search::new(self, x, y);
        search.descend();
        search.finish()
    }

    /// The same where the centre comes to rest above this height; `None` where it does not.
    #[must_use]
    pub fn drop_above(&self, x: f64, y: f64, height: f64) -> Option<Location> {
        self.drop_between(x, y, [height, f64::INFINITY])
    }

    /// Height of the tip of a ball of `radius_mm` whose centre this one holds up, or `tip` if that is larger: this ball is as large,
    /// or larger by a distance that is kept. Of another end `radius_mm` is that of the corner.
    #[must_use]
    pub fn tip_above(&self, x: f64, y: f64, tip: f64, radius_mm: f64) -> f64 {
        self.drop_above(x, y, tip + radius_mm).map_or(tip, |rest| rest.centre.z - radius_mm)
    }

    /// The same, but what carries the centre as high as the second of these heights need not be the highest.
    pub(crate) fn drop_between(&self, x: f64, y: f64, [height, enough]: [f64; 2]) -> Option<Location> {
        if !self.end.is_ball() {
            return self.rest_of_end([x, y], None, height);
        }
        let mut search = Search::new(self, x, y);
        search.floor.z = height;
        search.enough_z = enough;
        search.descend();
        search.finish().filter(|rest| rest.centre.z > height)
    }

    /// The point of the model that a ball touches.
    pub(crate) fn touched(&self, location: &Location) -> Point3 {
        location.centre - location.normal * self.radius_mm
    }

    /// A point of the same face close to where a ball at `to` would touch it, if the face reaches so far.
    pub(crate) fn point_ahead(&self, from: &Location, pace: &Pace, to: Point2) -> Option<Point3> {
        let Support::Face { u, v } = from.support else { return None };
        let face = &self.faces[from.face];
        let (u, v) = pace.ahead((u, v), (to.x - from.centre.x, to.y - from.centre.y));
        face.holds(u, v).then(|| face.leaves.point(u, v))
    }

    /// Walks from one triangle of a face to the one that parameters lie in, or to the side on which the face ends.
    fn walk(&self, from: u32, to: Point2) -> Option<Result<u32, (u32, usize)>> {
        let face = self.triangles[from as usize].face;
        self.covering.adjacency.walk(face, &self.covering.meshes[face as usize], from, to)
    }

    /// Points of a triangle or piece of an edge, and how far from their hull it may be.
    pub(crate) fn hull(&self, item: usize) -> ([Point3; 3], f64) {
        match self.triangles.get(item) {
            Some(t) => (t.p, f64::from(t.deviation_mm)),
            None => {
                let e = &self.edges[item - self.triangles.len()];
                ([e.a, e.b, e.b], e.deviation_mm)
            }
        }
    }

    /// Calls `visit` with all that a ball over the rectangle could rest on with its centre above `low`: its number, and
    /// points with the distance from their hull.
    pub(crate) fn over(
        &self,
        rectangle: [[f64; 2]; 2],
        low: f64,
        mut visit: impl FnMut(usize, [Point3; 3], f64),
    ) {
        self.tree.over(rectangle, self.radius_mm, low, |item| {
            let (points, delta) = self.hull(item);
            visit(item, points, delta);
        });
    }
}

/// Which sides of the domain are one point.
fn poles(leaves: &Leaves) -> [bool; 4] {
    let ((u0, u1), (v0, v1)) = leaves.domain();
    let is_point = |a: Point2, b: Point2| {
        let start = leaves.point(a.x, a.y);
        (1..=POLE_LOOKS).all(|k| {
            let at = a + (b - a) * (f64::from(k) / f64::from(POLE_LOOKS));
            (leaves.point(at.x, at.y) - start).norm() < POLE_MM
        })
    };
    let at = Point2::new;
    [
        is_point(at(u0, v0), at(u0, v1)),
        is_point(at(u1, v0), at(u1, v1)),
        is_point(at(u0, v0), at(u1, v0)),
        is_point(at(u0, v1), at(u1, v1)),
    ]
}

/// Whether the parameters lie in the triangle or no further from it than its own size.
fn is_beside(uv: &[Point2; 3], u: f64, v: f64) -> bool {
    let (a, b) = (uv[1] - uv[0], uv[2] - uv[0]);
    let p = Point2::new(u, v) - uv[0];
    let area = a.perp(&b);
    // Barycentric coordinates times the area, which may have either sign.
    let (wb, wc) = (p.perp(&b) * area.signum(), a.perp(&p) * area.signum());
    let area = area.abs();
    [wb, wc, area - wb - wc].iter().all(|w| (-area..=2.0 * area).contains(w))
}

/// The place with these barycentric coordinates.
pub(crate) fn weighted<const D: usize>(
    corners: &[nalgebra::Point<f64, D>; 3],
    at: [f64; 3],
) -> nalgebra::Point<f64, D> {
    (0..3).map(|i| corners[i].coords * at[i]).sum::<nalgebra::SVector<f64, D>>().into()
}

/// The search for what a ball over `(x, y)` rests on.
pub(crate) struct Search<'a> {
    pub(crate) ball: &'a BallDrop<'a>,
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) best: Option<Location>,
    /// What would have to be exceeded for another best.
    pub(crate) floor: SupportBound,
    /// What carries the ball as high as this need not be the highest.
    pub(crate) enough_z: f64,
    /// The triangle that the best contact lies in, if it is known.
    pub(crate) triangle: Option<u32>,
    /// Triangles that wait to be subdivided until everything has been met: most then fall below the best contact.
    unproven: Vec<(&'a Triangle, [Point2; 3])>,
    /// The last flat face that was looked at.
    flat: Option<u32>,
    /// Triangles that were cut in four so far.
    pub(crate) cuts: u32,
}

impl<'a> Search<'a> {
    pub(crate) fn new(ball: &'a BallDrop<'a>, x: f64, y: f64) -> Self {
        Search {
            ball,
            x,
            y,
            best: None,
            floor: SupportBound::NONE,
            enough_z: f64::INFINITY,
            triangle: None,
            unproven: Vec::new(),
            flat: None,
            cuts: 0,
        }
    }

    /// Begins with what carried a ball close by, in a triangle if that is known; says how fast the contact moves if one
    /// is found.
    pub(crate) fn start_from(&mut self, near: &Location, triangle: Option<u32>, pace: &Pace) -> Option<Pace> {
        let mut onward = None;
        match near.support {
            Support::Face { u, v } => {
                let moved = (self.x - near.centre.x, self.y - near.centre.y);
                let to = pace.ahead((u, v), moved);
                onward = triangle
                    .and_then(|from| self.beyond_rim(from, Point2::new(to.0, to.1)))
                    .or_else(|| self.try_face(near.face, triangle, to, *pace).pace());
            }
            Support::Edge => {}
            Support::Bound | Support::Side => return None,
        }
        // The point that was touched is there in any case.
        let touched = self.ball.touched(near);
        if self.best.is_none()
            && let Some(z) = on_point(&touched, self.x, self.y, self.ball.radius_mm)
        {
            self.floor.z = z - CONTACT_EPSILON_MM;
        }
        onward
    }

    /// Tries what a face goes on in, where the way from one of its triangles to these parameters leads off it.
    fn beyond_rim(&mut self, from: u32, to: Point2) -> Option<Pace> {
        let (triangle, side) = self.ball.walk(from, to)?.err()?;
        let joint = self.ball.joint(triangle, side)?;
        joint.onward.iter().find_map(|&(onward, start)| {
            let face = self.ball.triangles[onward as usize].face as usize;
            self.try_face(face, Some(onward), (start.x, start.y), Pace::default()).pace()
        })
    }

    /// Whether the best contact is known to be where the ball rests.
    pub(crate) fn is_certified(&self) -> bool {
        self.best.is_some_and(|l| l.certified)
    }

    /// Looks at everything, the most promising first.
    pub(crate) fn descend(&mut self) {
        let ball = self.ball;
        ball.tree.descend(self.x, self.y, ball.radius_mm, self.floor, |item| {
            self.visit(item);
            self.floor
        });
    }

    /// Looks at one triangle or piece of an edge.
    fn visit(&mut self, item: usize) {
        let (points, delta) = self.ball.hull(item);
        if !self.floor.clears_hull(&points, delta) {
            self.visit_uncleared(item);
        }
    }

    /// Looks at one that may rise above the floor.
    pub(crate) fn visit_uncleared(&mut self, item: usize) {
        let ball = self.ball;
        match ball.triangles.get(item) {
            Some(t) => self.triangle(t),
            None => self.edge(&ball.edges[item - ball.triangles.len()]),
        }
    }

    /// What carries the ball when everything has been looked at.
    pub(crate) fn finish(&mut self) -> Option<Location> {
        if self.best.is_some_and(|best| best.centre.z >= self.enough_z) {
            return self.best;
        }
        for (t, uv) in std::mem::take(&mut self.unproven) {
            self.subdivide(t, uv, t.p, f64::from(t.deviation_mm), 0);
        }
        if self.ball.sides.is_empty() {
            return self.best;
        }
        self.ball.held_by_sides(self.best, self.x, self.y).or(self.best)
    }

    pub(crate) fn offer(&mut self, location: Location, triangle: Option<u32>) {
        if self.best.is_none_or(|b| location.centre.z > b.centre.z) {
            let Location { centre, normal, .. } = &location;
            let floor = SupportBound::under(centre, normal, self.ball.radius_mm, CONTACT_EPSILON_MM);
            if location.certified || centre.z >= self.enough_z {
                self.floor = SupportBound::ALL;
            } else if floor.z > self.floor.z {
                self.floor = floor;
            }
            (self.best, self.triangle) = (Some(location), triangle);
        }
    }

    /// Looks for a contact on a face from `start`, which is in or near a triangle if that is known.
    fn try_face(&mut self, face: FaceId, near: Option<u32>, start: (f64, f64), pace: Pace) -> Polished {
        let f = &self.ball.faces[face];
        let polished = polish(&f.leaves, start, pace, self.x, self.y, self.ball.radius_mm);
        if let Polished::Contact { centre, normal, u, v, .. } = polished {
            if f.domain.as_ref().is_some_and(|d| !d.contains(u, v)) {
                return Polished::Outside { u, v };
            }
            if self.best.is_some_and(|best| best.centre.z >= centre.z) {
                return polished;
            }
            let triangle = near.and_then(|near| self.ball.walk(near, Point2::new(u, v))?.ok());
            let certified = triangle.is_some_and(|t| self.ball.is_alone(t));
            self.offer(
                Location { centre, normal, face, support: Support::Face { u, v }, certified },
                triangle,
            );
        }
        polished
    }

    fn triangle(&mut self, t: &'a Triangle) {
        match &self.ball.faces[t.face as usize].shape {
            Shape::Upright => return,
            Shape::Flat(flat) => return self.flat(t, flat),
            Shape::Free => {}
        }
        let delta = f64::from(t.deviation_mm);
        let (r, floor) = (self.ball.radius_mm, self.floor.z);
        let mesh = &self.ball.covering.meshes[t.face as usize];
        let uv = mesh.triangles[t.index as usize].map(|i| mesh.uv[i as usize]);
        // A sheet that curves less tightly than the ball leaves it on all sides of a contact
        // (docs/theory.md §6.4), so a contact speaks for its own triangle and for those around it, as long as none of them
        // is tight. Further away on the same face a second contact is possible, across a groove.
        let here = |u: f64, v: f64| !t.tight && is_beside(&uv, u, v);
        if let Some(Location { face, support: Support::Face { u, v }, .. }) = self.best
            && face == t.face as usize
            && here(u, v)
        {
            return;
        }
        if box_height(&t.p, self.x, self.y, r + delta) <= floor {
            return;
        }
        if self.enough_z < f64::INFINITY && self.is_held_by_corner(t) {
            return;
        }
        let n = (t.p[1] - t.p[0]).cross(&(t.p[2] - t.p[0]));
        if let Some((z, _)) = plane_height(&t.p[0], &n, self.x, self.y, r + delta)
            && z <= floor
        {
            return;
        }
        let Some(rest) = on_triangle(&t.p, &n, self.x, self.y, r + delta) else {
            return;
        };
        if rest.z <= floor {
            return;
        }
        let start = weighted(&uv, rest.at);
        let own = self.ball.covering.adjacency.number(t.face, t.index);
        let proven = match self.try_face(t.face as usize, Some(own), (start.x, start.y), Pace::default()) {
            Polished::Contact { u, v, .. } | Polished::Outside { u, v } => here(u, v),
            Polished::Failed => false,
        };
        if !proven {
            self.unproven.push((t, uv));
        }
    }

    /// Looks at all of a flat face that a triangle is of.
    fn flat(&mut self, t: &Triangle, flat: &Flat) {
        if self.flat.replace(t.face) == Some(t.face) {
            return;
        }
        let OnPlane { centre, normal, u, v } = flat.rest(self.x, self.y, self.ball.radius_mm);
        if self.best.is_some_and(|best| best.centre.z >= centre.z) {
            return;
        }
        if self.ball.faces[t.face as usize].holds(u, v) {
            let number = self.ball.covering.adjacency.number(t.face, t.index);
            let triangle = self.ball.walk(number, Point2::new(u, v)).and_then(Result::ok);
            let certified = triangle.is_some_and(|t| self.ball.is_alone(t));
            let (face, support) = (t.face as usize, Support::Face { u, v });
            self.offer(Location { centre, normal, face, support, certified }, triangle);
        }
    }

    /// Whether a corner of a triangle, which is a point of its face, carries the ball high enough.
    fn is_held_by_corner(&mut self, t: &Triangle) -> bool {
        let r = self.ball.radius_mm;
        let height = |p: &Point3| on_point(p, self.x, self.y, r).filter(|z| *z >= self.enough_z);
        let Some((p, z)) = t.p.iter().find_map(|p| Some((*p, height(p)?))) else { return false };
        let centre = Point3::new(self.x, self.y, z);
        let (face, support) = (t.face as usize, Support::Bound);
        self.offer(Location { centre, normal: (centre - p) / r, face, support, certified: false }, None);
        true
    }

    fn edge(&mut self, e: &EdgePiece) {
        let r = self.ball.radius_mm;
        if box_height(&[e.a, e.b], self.x, self.y, r + e.deviation_mm) <= self.floor.z {
            return;
        }
        let face = &self.ball.faces[e.face as usize];
        let pcurve = &face.boundary[e.pcurve as usize];
        let on_edge = OnEdge { surface: &face.leaves, pcurve, x: self.x, y: self.y, r };
        if let Some((z, point)) = on_edge.highest(e, self.floor.z) {
            let centre = Point3::new(self.x, self.y, z);
            let normal = (centre - point) / r;
            let (face, support) = (e.face as usize, Support::Edge);
            self.offer(Location { centre, normal, face, support, certified: false }, None);
        }
    }
}
