//! A ball dropped along −z on flat things: closed forms.
//!
//! Heights are those of the ball's *centre* above the point `(x, y)`.

use claymill_nurbs::{Point3, Vector3};

/// Where a dropped ball comes to rest on a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rest {
    /// Height of the centre.
    pub(crate) z: f64,
    /// Barycentric coordinates of the contact point.
    pub(crate) at: [f64; 3],
}

/// Height of the centre of a ball of radius `r` above `(x, y)` resting on the point `p`.
pub(crate) fn on_point(p: &Point3, x: f64, y: f64, r: f64) -> Option<f64> {
    let d2 = (p.x - x).powi(2) + (p.y - y).powi(2);
    (d2 < r * r).then(|| p.z + (r * r - d2).sqrt())
}

/// No ball of radius `r` above `(x, y)` rests on anything in the box of `points` with its centre above this.
pub(crate) fn box_height(points: &[Point3], x: f64, y: f64, r: f64) -> f64 {
    let (mut low, mut high) = (points[0], points[0]);
    for p in &points[1..] {
        low = low.inf(p);
        high = high.sup(p);
    }
    let dx = (low.x - x).max(x - high.x).max(0.0);
    let dy = (low.y - y).max(y - high.y).max(0.0);
    let d2 = dx * dx + dy * dy;
    if d2 >= r * r { f64::NEG_INFINITY } else { high.z + (r * r - d2).sqrt() }
}

/// The ball on the segment `a b`: height of the centre and contact as a fraction of the way to `b`.
///
/// In the vertical plane through the segment the ball is a circle of radius `√(r² − h²)`, `h` the horizontal
/// distance from the segment's line, that rests on a line of slope `m`.
pub(crate) fn on_segment(a: &Point3, b: &Point3, x: f64, y: f64, r: f64) -> Option<(f64, f64)> {
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    let length = (dx * dx + dy * dy).sqrt();
    let ends = || {
        let (za, zb) = (on_point(a, x, y, r), on_point(b, x, y, r));
        match (za, zb) {
            (Some(za), Some(zb)) if zb > za => Some((zb, 1.0)),
            (Some(za), _) => Some((za, 0.0)),
            (None, zb) => zb.map(|z| (z, 1.0)),
        }
    };
    if length < 1e-12 {
        return ends();
    }
    let (ex, ey) = (dx / length, dy / length);
    let h = (x - a.x) * ey - (y - a.y) * ex;
    if h.abs() >= r {
        return None;
    }
    let rho = (r * r - h * h).sqrt();
    let along = (x - a.x) * ex + (y - a.y) * ey;
    let m = (b.z - a.z) / length;
    let root = (1.0 + m * m).sqrt();
    let contact = along + rho * m / root;
    if contact > 0.0 && contact < length {
        return Some((a.z + m * along + rho * root, contact / length));
    }
    ends()
}

/// The ball on a triangle with upward or downward normal `n` (not normalised).
///
/// How high a ball is that touches the plane in some place is a concave function of that place: where its top lies
/// outside of the triangle, the highest place of the triangle is on a side that is seen from there.
pub(crate) fn on_triangle(t: &[Point3; 3], n: &Vector3, x: f64, y: f64, r: f64) -> Option<Rest> {
    let mut seen = [true; 3];
    if let Some((z, nz)) = plane_height(&t[0], n, x, y, r) {
        let size = n.norm() * nz.signum();
        let c = Point3::new(x, y, z) - n * (r / size);
        let at = barycentric(t, n, &c);
        if at.iter().all(|&w| w >= 0.0) {
            return Some(Rest { z, at });
        }
        seen = at.map(|w| w.is_nan() || w < 0.0);
    }
    let mut best: Option<Rest> = None;
    for i in (0..3).filter(|i| seen[(i + 2) % 3]) {
        let j = (i + 1) % 3;
        if let Some((z, s)) = on_segment(&t[i], &t[j], x, y, r)
            && best.is_none_or(|b| z > b.z)
        {
            let mut at = [0.0; 3];
            at[i] = 1.0 - s;
            at[j] = s;
            best = Some(Rest { z, at });
        }
    }
    best
}

/// Height of the centre on the infinite plane through `p`: never below the height on any part of it.
/// The second value is the normal's `z`. `None` for a vertical plane.
pub(crate) fn plane_height(p: &Point3, n: &Vector3, x: f64, y: f64, r: f64) -> Option<(f64, f64)> {
    let size = n.norm();
    if n.z.abs() <= 1e-9 * size {
        return None;
    }
    let z = p.z - (n.x * (x - p.x) + n.y * (y - p.y)) / n.z;
    Some((z + r * size / n.z.abs(), n.z))
}

/// Barycentric coordinates of the foot of `p` on the plane of a triangle with normal `n` (not normalised).
pub(crate) fn barycentric(t: &[Point3; 3], n: &Vector3, p: &Point3) -> [f64; 3] {
    let nn = n.norm_squared();
    let part = |a: &Point3, b: &Point3| (b - a).cross(&(p - a)).dot(n) / nn;
    let (w2, w0) = (part(&t[0], &t[1]), part(&t[1], &t[2]));
    [w0, 1.0 - w0 - w2, w2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    fn normal(t: &[Point3; 3]) -> Vector3 {
        (t[1] - t[0]).cross(&(t[2] - t[0]))
    }

    #[test]
    fn ball_on_a_slope_needle_and_ridge() {
        // Plane of 30°: centre at z + R / cos 30° (docs/theory.md §6.7).
        let k = 30f64.to_radians().tan();
        let t = [
            Point3::new(-100.0, -100.0, -100.0 * k),
            Point3::new(100.0, -100.0, 100.0 * k),
            Point3::new(0.0, 100.0, 0.0),
        ];
        let rest = on_triangle(&t, &normal(&t), 0.0, -20.0, 10.0).unwrap();
        assert_abs_diff_eq!(rest.z, 11.547005383792515, epsilon = 1e-12);
        assert_abs_diff_eq!(
            on_point(&Point3::new(6.0, 0.0, 1.0), 0.0, 0.0, 10.0).unwrap(),
            9.0,
            epsilon = 1e-12
        );
        let (z, s) =
            on_segment(&Point3::new(-50.0, 6.0, 0.0), &Point3::new(50.0, 6.0, 0.0), 0.0, 0.0, 10.0).unwrap();
        assert_abs_diff_eq!(z, 8.0, epsilon = 1e-12);
        assert_abs_diff_eq!(s, 0.5, epsilon = 1e-12);
        assert!(on_point(&Point3::new(11.0, 0.0, 0.0), 0.0, 0.0, 10.0).is_none());
    }

    #[test]
    fn triangle_agrees_with_brute_force() {
        let t = [Point3::new(0.0, 0.0, 0.0), Point3::new(9.0, 2.0, 5.0), Point3::new(1.0, 8.0, -3.0)];
        let n = normal(&t);
        let r = 6.0;
        for (x, y) in [(3.0, 3.0), (12.0, 0.0), (-3.0, -4.0), (0.0, 12.0), (5.0, 9.0)] {
            let mut brute = f64::NEG_INFINITY;
            let steps = 700;
            for i in 0..=steps {
                for j in 0..=steps - i {
                    let (a, b) = (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
                    let p = t[0] + (t[1] - t[0]) * a + (t[2] - t[0]) * b;
                    if let Some(z) = on_point(&p, x, y, r) {
                        brute = brute.max(z);
                    }
                }
            }
            let rest = on_triangle(&t, &n, x, y, r).unwrap();
            assert_abs_diff_eq!(rest.z, brute, epsilon = 1e-4);
            assert!(rest.z >= brute - 1e-12, "exact is never below a sampled height");
        }
    }
}
