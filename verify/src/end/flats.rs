//! Flat faces: an end is nearest to a plane in one place, which is on the face, or the face's border is nearer than all of its inside.

use claymill_nurbs::{NurbsSurface, Point2, Point3, Vector2, Vector3};

use super::body::EndBody;

/// A face counts as flat, and as a wall along the axis, where it is so to within this, mm.
const KNOWN_MM: f64 = 1e-6;

/// Planes that lean by less (sine) are level.
const LEVEL: f64 = 1e-12;
/// No wall leans by more than this (sine), however low it is: level ground has no height at all.
const STEEP: f64 = 1e-3;
/// The deepest place of a plane is looked for in so many steps, of which each leaves two thirds.
const STEPS: u32 = 90;

/// A surface `start + (u − u0) su + (v − v0) sv`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flat {
    start: Point3,
    from: Point2,
    ends: Point2,
    /// Products with these are how far the parameters go on.
    onward: [Vector3; 2],
    normal: Vector3,
    /// Two sides.
    sides: [Vector3; 2],
}

impl Flat {
    /// Of a surface with four control points in a parallelogram.
    pub(super) fn of(surface: &NurbsSurface) -> Option<Self> {
        if surface.size() != (2, 2) || surface.net().iter().any(|h| h.w != surface.net()[0].w) {
            return None;
        }
        let at = |i: usize, j: usize| surface.control_point(i, j);
        let start = at(0, 0);
        let (along_u, along_v) = (at(1, 0) - start, at(0, 1) - start);
        if (at(1, 1) - start - along_u - along_v).norm() > KNOWN_MM {
            return None;
        }
        let ((u0, u1), (v0, v1)) = surface.domain();
        let (su, sv) = (along_u / (u1 - u0), along_v / (v1 - v0));
        let across = su.cross(&sv);
        let onward = [sv.cross(&across), across.cross(&su)].map(|o| o / across.norm_squared());
        let normal = across.try_normalize(0.0)?;
        let is_finite = onward.iter().all(|o| o.iter().all(|x| x.is_finite()));
        let (from, ends) = (Point2::new(u0, v0), Point2::new(u1, v1));
        is_finite.then_some(Flat { start, from, ends, onward, normal, sides: [along_u, along_v] })
    }

    /// Where an end is nearest to the plane; without parameters beyond the untrimmed face.
    pub(super) fn nearest(&self, tip: &Point3, axis: &Vector3, body: &EndBody) -> (Point3, Option<Point2>) {
        // The tool goes on upwards: a plane has it on the upper side, or is entered; a wall has it on the tip's.
        let up = self.normal.dot(axis);
        let is_wall = up.abs() < STEEP && up.abs() * self.height_mm(axis) < KNOWN_MM;
        let side = if is_wall { self.normal.dot(&(tip - self.start)) } else { up };
        let n = if side < 0.0 { -self.normal } else { self.normal };
        let lowest = tip - (body.tip_over(&Point3::origin(), &n, axis) - Point3::origin());
        let clear_mm = n.dot(&(lowest - self.start));
        let point = match () {
            () if clear_mm >= 0.0 => lowest - n * clear_mm,
            // High enough to be nearer to the side than to the bottom.
            () if is_wall => lowest - n * clear_mm - axis * clear_mm,
            () => self.deepest(tip, axis, body),
        };
        let [u, v] = self.onward.map(|o| o.dot(&(point - self.start)));
        let at = self.from + Vector2::new(u, v);
        let is_on = (0..2).all(|k| at[k] >= self.from[k] && at[k] <= self.ends[k]);
        (point, is_on.then_some(at))
    }

    /// How far the untrimmed face goes on along an axis, mm.
    fn height_mm(&self, axis: &Vector3) -> f64 {
        self.sides.iter().map(|side| side.dot(axis).abs()).sum()
    }

    /// Where a slanted plane is deepest in an end that enters it: on the line of steepest slope below or above the tip.
    fn deepest(&self, tip: &Point3, axis: &Vector3, body: &EndBody) -> Point3 {
        let up = self.normal.dot(axis);
        let on_axis = tip + axis * (self.normal.dot(&(self.start - tip)) / up);
        let Some(uphill) = (axis - self.normal * up).try_normalize(LEVEL) else { return on_axis };
        let at = |s: f64| on_axis + uphill * s;
        let distance = |s: f64| body.distance(&(at(s) - tip), axis).0;
        // It is no farther from the axis than the tool is thick, where that is measured along the plane.
        let reach_mm = body.radius_mm / up.abs();
        let (mut low, mut high) = (-reach_mm, reach_mm);
        for _ in 0..STEPS {
            let third = (high - low) / 3.0;
            if distance(low + third) <= distance(high - third) { high -= third } else { low += third }
        }
        at(0.5 * (low + high))
    }
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::KnotVector;
    use proptest::prelude::*;

    use super::*;

    /// A parallelogram about a place.
    fn parallelogram(start: Vector3, along_u: Vector3, along_v: Vector3) -> NurbsSurface {
        let knots = || KnotVector::new(1, vec![0.0, 0.0, 3.0, 3.0]).unwrap();
        let corners = [start, start + along_v, start + along_u, start + along_u + along_v];
        NurbsSurface::new(knots(), knots(), corners.map(Point3::from).to_vec(), None).unwrap()
    }

    fn vector() -> impl Strategy<Value = Vector3> {
        [-1.0..1.0, -1.0..1.0, -1.0..1.0].prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn no_place_of_the_plane_is_nearer(
            start in vector(), u in vector(), v in vector(), share in 0.0..0.9, lie in 0..3_u8,
        ) {
            let level = |w: Vector3| Vector3::new(w.x, w.y, 0.0) * 9.0;
            let (u, v) = match lie {
                0 => (u * 9.0, Vector3::z() * 7.0),
                1 => (level(u), level(v)),
                _ => (u * 9.0, v * 9.0),
            };
            prop_assume!(u.cross(&v).norm() > 1.0);
            let body = EndBody { radius_mm: 3.0, corner_mm: 3.0 * share };
            let flat = Flat::of(&parallelogram(start * 8.0, u, v)).unwrap();
            let distance = |p: &Vector3| body.distance(p, &Vector3::z()).0;
            let all = (-20..=20).flat_map(|i| (-20..=20).map(move |j| (f64::from(i), f64::from(j))));
            let least = all.map(|(i, j)| distance(&(start * 8.0 + (u * i + v * j) * 0.1))).fold(f64::INFINITY, f64::min);
            let (point, at) = flat.nearest(&Point3::origin(), &Vector3::z(), &body);
            let found = distance(&point.coords);
            prop_assert!(found <= least + 1e-6, "{found} {least}");
            prop_assert!((point - start * 8.0).coords.dot(&flat.normal).abs() < 1e-6);
            if let Some(at) = at {
                let (du, dv) = (u * (at.x / 3.0), v * (at.y / 3.0));
                prop_assert!((start * 8.0 + du + dv - point.coords).norm() < 1e-6);
            }
        }
    }
}
