//! Faces whose shape alone says where a tool that comes down can rest on them.
//!
//! ```text
//!     ●            on a flat face only where the plane would carry it
//!    ─┴──────
//!            │ ●   on one that stands upright nowhere: the rim is higher than all of the inside
//! ```

use claymill_nurbs::{NurbsSurface, Point3, Vector3};

/// A face counts as upright, and as flat, where it is so to within this, mm: a tool enters it no deeper then.
const KNOWN_MM: f64 = 1e-6;
/// Heights on planes that are steeper than this (cosine against the axis) are not known.
const WALL: f64 = 1e-9;

/// What is known of a face as seen from a setup.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Shape {
    /// All of it stands along the tool axis. A tool rests on its rim at most.
    Upright,
    /// A parallelogram over its whole domain, before it is trimmed.
    Flat(Flat),
    /// Anything else.
    Free,
}

/// A surface `start + (u - u0) su + (v - v0) sv`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Flat {
    start: Point3,
    from: [f64; 2],
    /// Products with these are how far the parameters go on.
    onward: [Vector3; 2],
    /// Upwards, of unit length.
    normal: Vector3,
}

/// Where a ball would rest on a plane.
pub(crate) struct OnPlane {
    pub(crate) centre: Point3,
    pub(crate) normal: Vector3,
    pub(crate) u: f64,
    pub(crate) v: f64,
}

impl Shape {
    /// Of a surface in the setup's coordinates.
    pub(crate) fn of(surface: &NurbsSurface) -> Self {
        if is_upright(surface) {
            return Shape::Upright;
        }
        Flat::of(surface).map_or(Shape::Free, Shape::Flat)
    }
}

impl Flat {
    fn of(surface: &NurbsSurface) -> Option<Self> {
        let [a, b, c, d] = *surface.net() else { return None };
        let weights_differ = [b, c, d].iter().any(|h| h.w != a.w);
        let [a, b, c, d] = [a, b, c, d].map(|h| Point3::from(h.xyz() / h.w));
        if weights_differ || (b - a - (d - c)).norm() > KNOWN_MM {
            return None;
        }
        let ((u0, u1), (v0, v1)) = surface.domain();
        // The second index runs along v.
        let (su, sv) = ((c - a) / (u1 - u0), (b - a) / (v1 - v0));
        let normal = su.cross(&sv);
        let size2 = normal.norm_squared();
        let upper = normal.try_normalize(0.0).filter(|n| n.z.abs() > WALL).map(|n| n * n.z.signum())?;
        let onward = [sv.cross(&normal) / size2, normal.cross(&su) / size2];
        onward.iter().all(|o| o.iter().all(|x| x.is_finite())).then_some(Flat {
            start: a,
            from: [u0, v0],
            onward,
            normal: upper,
        })
    }

    /// Where a ball over `(x, y)` rests on the whole plane.
    pub(crate) fn rest(&self, x: f64, y: f64, radius_mm: f64) -> OnPlane {
        let (n, start) = (self.normal, self.start);
        let z = start.z + (radius_mm - n.x * (x - start.x) - n.y * (y - start.y)) / n.z;
        let centre = Point3::new(x, y, z);
        let [u, v] = self.parameters(&(centre - n * radius_mm));
        OnPlane { centre, normal: n, u, v }
    }

    /// A point of the plane, and its normal upwards, of unit length.
    pub(crate) fn plane(&self) -> (&Point3, &Vector3) {
        (&self.start, &self.normal)
    }

    /// The point of the plane over a place.
    pub(crate) fn over(&self, [x, y]: [f64; 2]) -> Point3 {
        let (n, start) = (self.normal, self.start);
        Point3::new(x, y, start.z - (n.x * (x - start.x) + n.y * (y - start.y)) / n.z)
    }

    /// Parameters of a point of the plane.
    pub(crate) fn parameters(&self, p: &Point3) -> [f64; 2] {
        [0, 1].map(|k| self.from[k] + self.onward[k].dot(&(p - self.start)))
    }
}

/// Whether a surface is made of lines along the axis: its points' places over the ground do not depend on one of the
/// parameters; or a plane that contains the axis.
fn is_upright(surface: &NurbsSurface) -> bool {
    let (rows, columns) = (surface.knots_u().point_count(), surface.knots_v().point_count());
    let net = surface.net();
    let point = |i: usize, j: usize| net[i * columns + j];
    let same = |i: usize, j: usize, k: usize, l: usize| {
        let (a, b) = (point(i, j), point(k, l));
        a.w == b.w && (a.xy() - b.xy()).norm() <= KNOWN_MM * a.w.abs()
    };
    let mut all = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
    all.clone().all(|(i, j)| same(i, j, 0, j)) || all.all(|(i, j)| same(i, j, i, 0)) || is_wall(surface)
}

/// Whether all points lie in one plane along the axis.
fn is_wall(surface: &NurbsSurface) -> bool {
    let points = || surface.net().iter().map(|h| Point3::from(h.xyz() / h.w));
    let Some(first) = points().next() else { return false };
    let aside = |p: &Point3| (p - first).xy();
    let far = points().map(|p| aside(&p)).max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
    let Some(along) = far.and_then(|far| far.try_normalize(KNOWN_MM)) else { return true };
    points().all(|p| aside(&p).perp(&along).abs() <= KNOWN_MM)
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::KnotVector;
    use claymill_nurbs::analytic::{Frame, cylinder};

    use super::*;

    fn parallelogram(a: [f64; 3], su: [f64; 3], sv: [f64; 3]) -> NurbsSurface {
        let (a, su, sv) = (Point3::from(a), Vector3::from(su), Vector3::from(sv));
        let knots = |end: f64| KnotVector::new(1, vec![0.0, 0.0, end, end]).unwrap();
        NurbsSurface::new(knots(2.0), knots(4.0), vec![a, a + sv, a + su, a + su + sv], None).unwrap()
    }

    #[test]
    fn a_ball_touches_a_plane_where_its_parameters_say() {
        let surface = parallelogram([3.0, -2.0, 7.0], [5.0, 1.0, 2.0], [-1.0, 8.0, -3.0]);
        let Shape::Flat(flat) = Shape::of(&surface) else { panic!("it is flat") };
        for [x, y] in [[3.0, 1.0], [5.0, 2.0], [-40.0, 70.0]] {
            let rest = flat.rest(x, y, 4.0);
            assert_eq!([rest.centre.x, rest.centre.y], [x, y]);
            assert!(rest.normal.z > 0.0 && (rest.normal.norm() - 1.0).abs() < 1e-12);
            let ((u0, u1), (v0, v1)) = surface.domain();
            if (u0..=u1).contains(&rest.u) && (v0..=v1).contains(&rest.v) {
                let touched = surface.point(rest.u, rest.v);
                assert!((rest.centre - rest.normal * 4.0 - touched).norm() < 1e-12);
            }
        }
        let rest = flat.rest(5.0, 2.0, 4.0);
        assert!((0.0..2.0).contains(&rest.u) && (0.0..4.0).contains(&rest.v), "{} {}", rest.u, rest.v);
    }

    #[test]
    fn what_stands_along_the_axis_is_upright_and_nothing_else() {
        let upright = |s: &NurbsSurface| matches!(Shape::of(s), Shape::Upright);
        let bore = |axis: Vector3| {
            let frame = Frame::new(Point3::new(10.0, 20.0, 30.0), axis, Vector3::x()).unwrap();
            cylinder(&frame, 5.0, (0.0, 2.0), (0.0, 50.0)).unwrap()
        };
        assert!(upright(&bore(Vector3::z())) && upright(&bore(-Vector3::z())));
        assert!(!upright(&bore(Vector3::y())) && !upright(&bore(Vector3::new(0.0, 1e-6, 1.0).normalize())));
        assert!(upright(&parallelogram([0.0; 3], [3.0, 4.0, 1.0], [6.0, 8.0, 9.0])));
        assert!(!upright(&parallelogram([0.0; 3], [3.0, 4.0, 1.0], [6.0, 8.001, 9.0])));
    }

    #[test]
    fn what_is_bent_is_free() {
        let mut net = vec![[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 1e-3]];
        let surface = |net: &[[f64; 3]]| {
            let knots = KnotVector::new(1, vec![0.0, 0.0, 1.0, 1.0]).unwrap();
            NurbsSurface::new(knots.clone(), knots, net.iter().map(|p| Point3::from(*p)).collect(), None)
                .unwrap()
        };
        assert!(matches!(Shape::of(&surface(&net)), Shape::Free));
        net[3][2] = 0.0;
        assert!(matches!(Shape::of(&surface(&net)), Shape::Flat(_)));
    }
}
