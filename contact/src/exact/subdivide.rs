//! Subdivision of covering triangles where Newton proves nothing: bounds shrink by four at each
//! level, and in the end a proven upper bound serves as the height.

use claymill_nurbs::{Point2, Point3, Vector2, Vector3};

use crate::drop::{Search, Triangle, weighted};
use crate::exact::flat::on_triangle;
use crate::{CONTACT_EPSILON_MM, Location, Support};

/// A ball that touches the inside of a face this near to the rim rests on the rim as well, but for `d² / 2R`:
/// a tenth of a micrometre for a ball of 2 mm, mm.
const AT_RIM_MM: f64 = 0.02;
/// So far inside, as a share of the way to the middle, a triangle's corners are judged.
const CORNER_INSET: f64 = 0.02;
/// Triangles cut this often that are outside the trims in all places looked at are outside.
const SLIVER_LEVEL: u32 = 3;
/// A triangle whose normal leans further from its surface's (60°) stands across it.
const ALONG_COSINE: f64 = 0.5;
/// Pieces that turn by more than this, radians, say nothing about where a ball could rest on them.
const WIDEST_TURNING: f64 = 1.0;
/// Deepest subdivision of a triangle; its deviation shrinks by 4 at each level.
const DEEPEST: u32 = 12;
/// Triangles that are cut at one place, at most; then bounds serve as heights.
const MOST_CUTS: u32 = 50_000;

impl Search<'_> {
    /// Cuts a triangle in four in the parameter plane until its bound falls below the best contact, or is so
    /// close to the surface that the bound itself can serve as the height.
    pub(crate) fn subdivide(
        &mut self,
        t: &Triangle,
        uv: [Point2; 3],
        p: [Point3; 3],
        delta: f64,
        level: u32,
    ) {
        let (r, floor) = (self.ball.radius_mm(), self.floor.z);
        let n = (p[1] - p[0]).cross(&(p[2] - p[0]));
        let Some(high) = on_triangle(&p, &n, self.x, self.y, r + delta) else {
            return;
        };
        if high.z <= floor {
            return;
        }
        if !self.could_rest(t, &uv, &p, delta) {
            return;
        }
        let low = on_triangle(&p, &n, self.x, self.y, r);
        let mut fine = low.is_some_and(|low| high.z - low.z < CONTACT_EPSILON_MM);
        // Where a trim curve bends inwards its chord takes in a sliver that is not the face's. Edges are met
        // on their own.
        if t.rimmed && (fine || level >= SLIVER_LEVEL) {
            let inside = self.share_inside(t, &uv, high.at);
            let size = (0..3).map(|i| (p[(i + 1) % 3] - p[i]).norm()).fold(0.0, f64::max);
            if inside == 0.0 && level >= SLIVER_LEVEL || inside < 1.0 && size < AT_RIM_MM {
                return;
            }
            fine &= inside == 1.0;
        }
        fine = fine && self.lies_flat(t, &uv, &n);
        if level >= DEEPEST || fine || self.cuts == MOST_CUTS {
            let at = weighted(&p, high.at);
            let centre = Point3::new(self.x, self.y, high.z);
            let normal = (centre - at).normalize();
            let (face, support) = (t.face as usize, Support::Bound);
            self.offer(Location { centre, normal, face, support, certified: false }, None);
            return;
        }
        self.cuts += 1;
        let surface = &self.ball.faces[t.face as usize].leaves;
        let middle = |i: usize, j: usize| Point2::from((uv[i].coords + uv[j].coords) * 0.5);
        let m = [middle(0, 1), middle(1, 2), middle(2, 0)];
        let q = m.map(|c| surface.point(c.x, c.y));
        let quarters = [
            ([uv[0], m[0], m[2]], [p[0], q[0], q[2]]),
            ([m[0], uv[1], m[1]], [q[0], p[1], q[1]]),
            ([m[2], m[1], uv[2]], [q[2], q[1], p[2]]),
            ([m[0], m[1], m[2]], [q[0], q[1], q[2]]),
        ];
        for (uv, p) in quarters {
            self.subdivide(t, uv, p, 0.25 * delta, level + 1);
        }
    }

    /// Whether the ball could rest inside a piece of a face. It does so beside the point that it touches, by the radius along
    /// the normal; what that leaves open is as wide as the piece and its turning. Edges are met on their own.
    fn could_rest(&self, t: &Triangle, uv: &[Point2; 3], p: &[Point3; 3], delta: f64) -> bool {
        let curvature = self.ball.covering.curvature[t.face as usize][t.index as usize];
        let most = f64::from(curvature[0].abs().max(curvature[1].abs()));
        let middle = (uv[0].coords + uv[1].coords + uv[2].coords) / 3.0;
        let jet = self.ball.faces[t.face as usize].leaves.jet(middle.x, middle.y);
        let far = p.iter().map(|p| (p - jet.p).norm()).fold(0.0, f64::max) + delta;
        let turning = most * far;
        if turning.is_nan() || turning > WIDEST_TURNING {
            return true;
        }
        let Some(normal) = jet.normal() else { return true };
        let open = delta + turning * self.ball.radius_mm() + CONTACT_EPSILON_MM;
        let place = Point2::new(self.x, self.y);
        let outline = p.map(|p| p.xy());
        [normal, -normal]
            .into_iter()
            .filter(|n| n.z >= -turning)
            .any(|n| distance_from(&outline, &(place - n.xy() * self.ball.radius_mm())) <= open)
    }

    /// Whether a triangle lies along its surface. One whose corners are all on a bent side of the face stands
    /// across it, however small its distance: its surface is the side and not what its chords enclose.
    fn lies_flat(&self, t: &Triangle, uv: &[Point2; 3], n: &Vector3) -> bool {
        let middle = (uv[0].coords + uv[1].coords + uv[2].coords) / 3.0;
        let surface = &self.ball.faces[t.face as usize].surface;
        match (surface.normal(middle.x, middle.y), n.try_normalize(0.0)) {
            (Some((normal, _)), Some(n)) => normal.dot(&n).abs() >= ALONG_COSINE,
            _ => true,
        }
    }

    /// How many places in a triangle, its middle, close to its corners and where the ball would touch, belong
    /// to the face, as a share. The corners themselves may be on a trim curve.
    fn share_inside(&self, t: &Triangle, uv: &[Point2; 3], touch: [f64; 3]) -> f64 {
        let Some(domain) = &self.ball.faces[t.face as usize].domain else {
            return 1.0;
        };
        let middle = Point2::from((uv[0].coords + uv[1].coords + uv[2].coords) / 3.0);
        let corners = [0, 1, 2].map(|i| uv[i] + (middle - uv[i]) * CORNER_INSET);
        let places = corners.into_iter().chain([middle, weighted(uv, touch)]);
        places.filter(|p| domain.contains(p.x, p.y)).count() as f64 / 5.0
    }
}

/// Distance of a place from a triangle in the plane.
fn distance_from(corners: &[Point2; 3], p: &Point2) -> f64 {
    let sides = [[0, 1], [1, 2], [2, 0]].map(|[i, j]| (corners[j] - corners[i], p - corners[i]));
    let turns = sides.map(|(side, arm)| side.perp(&arm));
    if turns.iter().all(|&t| t >= 0.0) || turns.iter().all(|&t| t <= 0.0) {
        return 0.0;
    }
    let from_side = |(side, arm): (Vector2, Vector2)| {
        let along = arm.dot(&side) / side.norm_squared().max(f64::MIN_POSITIVE);
        (arm - side * along.clamp(0.0, 1.0)).norm()
    };
    sides.map(from_side).into_iter().fold(f64::INFINITY, f64::min)
}
