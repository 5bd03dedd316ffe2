//! Cutter geometry as convex bodies of revolution (disc, corner arc, cone), dropped on points,
//! segments and triangles: closed forms, except for one angle on segments.

use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::{Holder, Tool};

/// A convex body of revolution about the tool axis, without end upwards.
///
/// ```text
///      ╲           ╱     rise(ρ): lowest height of the body at the distance ρ from the axis
///       ╲ slope   ╱        0 up to `flat`, an arc of radius `corner`, then straight,
///        ╰─┬───┬─╯         nothing beyond `widest`
///   corner │   │ flat    dropped on a point p it stops with its tip at p.z − rise(ρ)
/// ```
///
/// It is a disc swollen by a ball and, where it has a slope, the cone that goes on from that as a tangent. `rise` is convex, so
/// that `p.z − rise` is concave along any straight line and over any plane: one highest place, found by its slope.
/// Swollen by `δ`, the bound of how far a surface is from its triangle, the body is one of the same kind with a larger
/// corner, and on a plane it simply stands `δ√(1 + m²)` higher.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Body {
    /// Height of its lowest point above the tip, mm.
    pub(crate) height: f64,
    /// Radius of the disc, mm.
    pub(crate) flat: f64,
    /// Radius of the ball that swells it, mm.
    pub(crate) corner: f64,
    /// Height gained on the cone for a millimetre of radius; infinite without a cone.
    pub(crate) slope: f64,
    /// Largest radius, mm.
    pub(crate) widest: f64,
}

/// Triangles steeper than this (cosine against the axis) are met by their sides only: they are walls.
const WALL: f64 = 1e-9;
/// Barycentric coordinates of so much are inside of a side, whatever rounding makes of them, in triangles that have so much area
/// for the squares of their sides.
const ON_A_SIDE: f64 = 1e-6;
const NO_SLIVER: f64 = 1e-7;
/// Steps of Newton's search on a segment; it ends after a few.
const STEPS: usize = 60;
/// It ends when the sine is known to this.
const SINE: f64 = 1e-13;

impl Body {
    /// The end of a tool: the disc and its corner.
    pub(crate) fn end(tool: &Tool) -> Self {
        let (widest, corner) = (tool.radius_mm(), tool.corner_radius_mm());
        Body { height: 0.0, flat: widest - corner, corner, slope: f64::INFINITY, widest }
    }

    /// What stands out above the end: a taper, and a shank that is thicker than the flutes below it. What is thinner is in
    /// their shadow.
    pub(crate) fn sides(tool: &Tool) -> Vec<Self> {
        Self::standing_out(tool.radius_mm(), &tool.sides())
    }

    /// What stands out of the sections of a holder, above a tool that is as wide as this; swollen by a distance that it keeps.
    pub(crate) fn of_holder(holder: &Holder, widest_mm: f64, clearance_mm: f64) -> Vec<Self> {
        let mut bodies = Self::standing_out(widest_mm, &holder.profile().collect::<Vec<_>>());
        for body in &mut bodies {
            body.height -= clearance_mm;
            body.corner += clearance_mm;
            body.widest += clearance_mm;
        }
        bodies
    }

    /// Of frusta above each other, each by height and radius at both ends, what is wider than all below.
    fn standing_out(mut widest: f64, frusta: &[[[f64; 2]; 2]]) -> Vec<Self> {
        let mut bodies = Vec::new();
        for &[[height, flat], [top, radius]] in frusta {
            if radius > flat {
                let slope = (top - height) / (radius - flat);
                bodies.push(Body { height, flat, corner: 0.0, slope, widest: radius });
            } else if flat > widest {
                bodies.push(Body { height, flat, corner: 0.0, slope: f64::INFINITY, widest: flat });
            }
            widest = widest.max(radius).max(flat);
        }
        bodies
    }

    /// Sine and cosine of the outline's steepest angle.
    fn steepest(&self) -> [f64; 2] {
        if self.slope.is_infinite() {
            return [1.0, 0.0];
        }
        let cosine = 1.0 / (1.0 + self.slope * self.slope).sqrt();
        [self.slope * cosine, cosine]
    }

    /// Lowest height above the tip at a distance from the axis, swollen by `delta`.
    pub(crate) fn rise(&self, from_axis: f64, delta: f64) -> Option<f64> {
        let (corner, out) = (self.corner + delta, from_axis - self.flat);
        let low = self.height - delta;
        if out <= 0.0 {
            return Some(low);
        }
        let [sine, cosine] = self.steepest();
        let tangent = corner * sine;
        if out < tangent {
            return Some(low + corner - (corner * corner - out * out).max(0.0).sqrt());
        }
        // Past its upper rim a swollen cone goes on: that is a little more than the arc about the rim. What has none ends there, and
        // a rim that is as wide as it is to the last bit is a part of it.
        (from_axis <= self.widest + delta).then(|| {
            let beyond = if self.slope.is_finite() { (out - tangent).max(0.0) * self.slope } else { 0.0 };
            low + corner * (1.0 - cosine) + beyond
        })
    }

    /// How far from the axis it is wide at a height above the tip: the inverse of `rise`.
    pub(crate) fn radius_at(&self, above_tip: f64) -> f64 {
        let ([sine, cosine], up) = (self.steepest(), above_tip - self.height);
        let arc = self.corner * (1.0 - cosine);
        if up <= 0.0 {
            0.0
        } else if up < arc {
            let down = self.corner - up;
            self.flat + (self.corner * self.corner - down * down).max(0.0).sqrt()
        } else {
            (self.flat + self.corner * sine + (up - arc) / self.slope).min(self.widest)
        }
    }

    /// How far from the axis it touches a plane that rises by `gradient`, and how high the plane has to be lifted there:
    /// the tip is so much above the plane, on the axis.
    fn on_plane(&self, gradient: f64) -> (f64, f64) {
        if gradient <= self.slope {
            let root = (1.0 + gradient * gradient).sqrt();
            let above = gradient * self.flat + self.corner * (root - 1.0) - self.height;
            return (self.flat + self.corner * gradient / root, above);
        }
        let low = self.rise(self.widest, 0.0).unwrap_or(self.height);
        (self.widest, gradient * self.widest - low)
    }

    /// Height of the tip when the body, swollen by `delta`, comes down on a segment, and the share of the way from `a` to
    /// `b` where it touches. `None` where that is no higher than `least`, as far as that is seen at once.
    pub(crate) fn on_segment(
        &self,
        a: &Point3,
        b: &Point3,
        [x, y]: [f64; 2],
        delta: f64,
        least: f64,
    ) -> Option<(f64, f64)> {
        let (dx, dy) = (b.x - a.x, b.y - a.y);
        let length = (dx * dx + dy * dy).sqrt();
        let widest = self.widest + delta;
        let tip = |share: f64| {
            let p = a + (b - a) * share;
            let (px, py) = (p.x - x, p.y - y);
            let from_axis = (px * px + py * py).sqrt();
            Some((p.z - self.rise(from_axis.min(widest), delta)?, share))
                .filter(|_| from_axis <= widest + 1e-9)
        };
        if length < 1e-12 {
            return tip(if b.z > a.z { 1.0 } else { 0.0 });
        }
        let (ex, ey) = (dx / length, dy / length);
        let along = (x - a.x) * ex + (y - a.y) * ey;
        let beside = ((x - a.x) * ey - (y - a.y) * ex).abs();
        if beside >= widest {
            return None;
        }
        let half = (widest * widest - beside * beside).sqrt();
        let (low, high) = ((-along).max(-half), (length - along).min(half));
        if low > high {
            return None;
        }
        let gradient = (b.z - a.z) / length;
        // The highest place and the one nearest to the axis, as if they were one.
        let top = a.z + gradient * (along + if gradient > 0.0 { high } else { low });
        if self.rise(beside.min(widest), delta).is_some_and(|rise| top - rise <= least) {
            return None;
        }
        let uphill = self.touching(beside, gradient.abs(), delta) * gradient.signum();
        tip(((uphill.clamp(low, high) + along) / length).clamp(0.0, 1.0))
    }

    /// How far uphill of the foot of the axis a line with this gradient touches that passes the axis at the distance `beside`.
    ///
    /// Where the body's outline has the slope angle `φ`, its radius is `d = flat + corner·sin φ`, and the line touches where
    /// `sin² φ·(d² − beside²) = gradient²·cos² φ·d²`: a polynomial of `sin φ`, the sign of which changes once.
    fn touching(&self, beside: f64, gradient: f64, delta: f64) -> f64 {
        let corner = self.corner + delta;
        let chord = |d: f64| (d * d - beside * beside).max(0.0).sqrt();
        if gradient == 0.0 {
            return 0.0;
        }
        let [steepest, _] = self.steepest();
        let tangent = self.flat + corner * steepest;
        // On the cone, or at its upper rim.
        if self.slope.is_finite() && (tangent <= beside || gradient * tangent >= self.slope * chord(tangent))
        {
            let share = gradient / self.slope;
            let d = if share < 1.0 { beside / (1.0 - share * share).sqrt() } else { f64::INFINITY };
            return chord(d.clamp(tangent.max(beside), (self.widest + delta).max(tangent).max(beside)));
        }
        if corner <= 0.0 {
            return chord(self.flat);
        }
        let gradient2 = gradient * gradient;
        // The slope is at least what it would be where the outline is widest.
        let all = self.flat + corner;
        let least = gradient * all / chord(all);
        let least = if least.is_finite() { least / (1.0 + least * least).sqrt() } else { 1.0 };
        let (mut low, mut high) = (((beside - self.flat) / corner).clamp(0.0, 1.0), steepest);
        let mut sine = least.clamp(low, high);
        for _ in 0..STEPS {
            let d = self.flat + corner * sine;
            let (d2, chord2, cosine2) = (d * d, d * d - beside * beside, 1.0 - sine * sine);
            let excess = sine * sine * chord2 - gradient2 * d2 * cosine2;
            *if excess > 0.0 { &mut high } else { &mut low } = sine;
            let rises = sine * (chord2 + sine * d * corner) - gradient2 * (d * corner * cosine2 - sine * d2);
            let newton = sine - 0.5 * excess / rises;
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            let moved = (next - sine).abs();
            sine = next;
            if moved < SINE {
                break;
            }
        }
        chord(self.flat + corner * sine)
    }

    /// The plane through a triangle with this normal (not normalised): height of the tip of the body on it, never less than
    /// on any part of it, and where it touches. `None` for a wall.
    pub(crate) fn on_plane_of(&self, p: &Point3, n: &Vector3, [x, y]: [f64; 2], delta: f64) -> Option<Touch> {
        if n.z.abs() <= WALL * n.norm() {
            return None;
        }
        let (gx, gy) = (-n.x / n.z, -n.y / n.z);
        let gradient = (gx * gx + gy * gy).sqrt();
        let (from_axis, above) = self.on_plane(gradient);
        let root = (1.0 + gradient * gradient).sqrt();
        let uphill = if gradient > 0.0 { (from_axis + delta * gradient / root) / gradient } else { 0.0 };
        Some(Touch {
            tip: p.z + gx * (x - p.x) + gy * (y - p.y) + above + delta * root,
            at: [x + gx * uphill, y + gy * uphill],
        })
    }

    /// Height of the tip when the body, swollen by `delta`, comes down on a triangle with this normal, and where it
    /// touches as barycentric coordinates. `None` where that is no higher than `least`, as far as that is seen at once.
    pub(crate) fn on_triangle(
        &self,
        t: &[Point3; 3],
        n: &Vector3,
        at: [f64; 2],
        delta: f64,
        least: f64,
    ) -> Option<Rested> {
        let touch = self.on_plane_of(&t[0], n, at, delta);
        let weights = touch.as_ref().map(|touch| barycentric(t, n.z, touch.at));
        if let Some((touch, weights)) = touch.zip(weights)
            && weights.iter().all(|w| *w >= 0.0)
        {
            return Some(Rested { tip: touch.tip, weights });
        }
        let beyond = weights.filter(|_| self.decides(t, n));
        let (mut best, mut least) = (None, least);
        for i in 0..3 {
            let (j, opposite) = ((i + 1) % 3, (i + 2) % 3);
            // From the triangle's highest place to that of its plane the height does not fall: a side lies between them.
            if beyond.is_some_and(|weights| weights[opposite] > ON_A_SIDE) {
                continue;
            }
            if let Some((tip, share)) = self.on_segment(&t[i], &t[j], at, delta, least)
                && tip > least
            {
                let mut weights = [0.0; 3];
                (weights[i], weights[j]) = (1.0 - share, share);
                (best, least) = (Some(Rested { tip, weights }), tip);
            }
        }
        best
    }

    /// Whether the highest place of a triangle's plane is that of `on_plane_of`, and is known well enough to tell the sides apart.
    fn decides(&self, t: &[Point3; 3], n: &Vector3) -> bool {
        let (a, b) = (t[1] - t[0], t[2] - t[0]);
        let size = a.x * a.x + a.y * a.y + b.x * b.x + b.y * b.y;
        // Beyond its upper rim a swollen cone is taken to go on.
        n.x * n.x + n.y * n.y <= self.slope * self.slope * n.z * n.z && n.z.abs() > NO_SLIVER * size
    }

    /// Unit vector from a point that it touches into the body, where the point alone decides; straight up where the
    /// outline has a corner.
    pub(crate) fn normal_at(&self, p: &Point3, [x, y]: [f64; 2]) -> Vector3 {
        let inward = Vector3::new(x - p.x, y - p.y, 0.0);
        let from_axis = inward.norm();
        let out = from_axis - self.flat;
        let steepest = self.slope.atan();
        let angle = if out <= 0.0 || from_axis == 0.0 {
            0.0
        } else if self.corner > 0.0 {
            (out / self.corner).min(1.0).asin().min(steepest)
        } else if self.slope.is_finite() {
            steepest
        } else {
            0.0
        };
        if angle == 0.0 {
            Vector3::z()
        } else {
            inward * (angle.sin() / from_axis) + Vector3::z() * angle.cos()
        }
    }
}

/// A body on a plane: height of its tip, and over which place it touches.
pub(crate) struct Touch {
    pub(crate) tip: f64,
    pub(crate) at: [f64; 2],
}

/// A body on a triangle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rested {
    /// Height of its tip.
    pub(crate) tip: f64,
    /// Where it touches.
    pub(crate) weights: [f64; 3],
}

/// Barycentric coordinates of a place seen from above.
fn barycentric(t: &[Point3; 3], area: f64, [x, y]: [f64; 2]) -> [f64; 3] {
    let part = |p: &Point3, q: &Point3| ((q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x)) / area;
    let (w2, w0) = (part(&t[0], &t[1]), part(&t[1], &t[2]));
    [w0, 1.0 - w0 - w2, w2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn body() -> impl Strategy<Value = Body> {
        let end = (0.0..6.0, prop_oneof![Just(0.0), 0.1..6.0]).prop_filter("no needle", |(f, c)| f + c > 0.1);
        let cone = prop_oneof![Just(None), (0.2..20.0, 0.5..6.0).prop_map(Some)];
        (end, cone).prop_map(|((flat, corner), cone)| {
            let (slope, widest) = cone.map_or((f64::INFINITY, flat + corner), |(slope, more): (f64, f64)| {
                (slope, flat + corner * slope.atan().sin() + more)
            });
            Body { height: 1.5, flat, corner, slope, widest }
        })
    }

    fn point() -> impl Strategy<Value = Point3> {
        [-8.0..8.0, -8.0..8.0, -6.0..6.0].prop_map(Point3::from)
    }

    /// Lowest height of the body itself, swollen: about its upper rim an arc, over which `rise` lets the cone go on.
    fn swollen(body: &Body, from_axis: f64, delta: f64) -> Option<f64> {
        let over_rim = from_axis - body.widest;
        if body.slope.is_infinite() || over_rim <= delta * body.slope.atan().sin() {
            return body.rise(from_axis, delta);
        }
        let rim = body.rise(body.widest, 0.0)?;
        // The outermost place is one as well, whatever rounding makes of it.
        (over_rim <= delta + 1e-12).then(|| rim - (delta * delta - over_rim * over_rim).max(0.0).sqrt())
    }

    proptest! {
        /// The outline is that of a disc swollen by a ball, and swelling it again adds to the ball.
        #[test]
        fn a_swollen_body_is_as_far_outside_as_it_is_swollen(body in body(), from_axis in 0.0..14.0_f64, delta in 0.01..1.0) {
            let Some(low) = body.rise(from_axis, delta) else { return Ok(()) };
            // The nearest point of the outline itself.
            let mut nearest = f64::INFINITY;
            for i in 0..=40_000 {
                let d = body.widest * f64::from(i) / 40_000.0;
                if let Some(rise) = body.rise(d, 0.0) {
                    nearest = nearest.min((d - from_axis).hypot(rise - low));
                }
            }
            let over_rim = body.slope.is_finite() && from_axis > body.widest - delta;
            prop_assert!(nearest >= delta - 1e-3 || over_rim, "{nearest} {delta}");
            prop_assert!(nearest <= delta + 1e-3 || over_rim, "{nearest} {delta}");
        }

        #[test]
        fn it_is_as_wide_at_a_height_as_it_rises_there(body in body(), from_axis in 0.01..14.0_f64) {
            let Some(rise) = body.rise(from_axis, 0.0) else { return Ok(()) };
            prop_assert_eq!(body.radius_at(rise - 1e-6) < from_axis.max(body.flat), true);
            prop_assert!(body.radius_at(rise + 1e-6) >= from_axis - 1e-9);
        }

        #[test]
        fn on_a_triangle_it_stops_where_the_points_of_the_triangle_stop_it(
            body in body(), a in point(), b in point(), c in point(), x in -9.0..9.0, y in -9.0..9.0,
            delta in prop_oneof![Just(0.0), 0.001..0.3]
        ) {
            let t = [a, b, c];
            let n = (b - a).cross(&(c - a));
            prop_assume!(n.norm() > 1.0);
            let found = body.on_triangle(&t, &n, [x, y], delta, f64::NEG_INFINITY);
            let (steps, mut brute) = (400, f64::NEG_INFINITY);
            for i in 0..=steps {
                for j in 0..=steps - i {
                    let (s, q) = (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
                    let p = a + (b - a) * s + (c - a) * q;
                    if let Some(rise) = swollen(&body, (p.x - x).hypot(p.y - y), delta) {
                        brute = brute.max(p.z - rise);
                    }
                }
            }
            if brute.is_finite() {
                let found = found.expect("points of the triangle are met");
                prop_assert!(found.tip >= brute - 1e-9, "{} {brute}", found.tip);
                // It is reached: at the place that is said to be touched.
                let p: Vector3 = (0..3).map(|i| t[i].coords * found.weights[i]).sum();
                let from_axis = (p.x - x).hypot(p.y - y).min(body.widest + delta);
                let own = p.z - swollen(&body, from_axis, delta).unwrap();
                // Elsewhere than over an upper rim the two are the same.
                let widened = p.z - body.rise(from_axis, delta).unwrap();
                prop_assert!(own - found.tip < 1e-6 && found.tip - widened < 1e-6, "{own} {} {widened}", found.tip);
                // Whoever knows it nearly leaves nothing out.
                let known = body.on_triangle(&t, &n, [x, y], delta, found.tip - 1e-6);
                prop_assert_eq!(known.map(|known| known.tip), Some(found.tip));
            }
        }
    }
}
