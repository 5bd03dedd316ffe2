//! The space that a ball sweeps on a straight piece of path, and where a line enters it, in closed
//! form.

use claymill_nurbs::{Point3, Vector3};

/// Segments shorter than this are balls, mm.
const SHORTEST_SEGMENT_MM: f64 = 1e-9;

/// The space that a ball sweeps on a straight piece of its path.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Capsule {
    /// Ball centre at the start.
    pub(crate) a: Point3,
    /// Ball centre at the end.
    pub(crate) b: Point3,
    /// Ball radius, mm.
    pub(crate) radius: f64,
}

impl Capsule {
    /// Distance of `p` from the axis segment, mm.
    pub(crate) fn axis_distance(&self, p: &Point3) -> f64 {
        let d = self.b - self.a;
        let t = (p - self.a).dot(&d) / d.norm_squared().max(SHORTEST_SEGMENT_MM.powi(2));
        (p - (self.a + d * t.clamp(0.0, 1.0))).norm()
    }

    /// Where the line `p + t·n` (`n` a unit vector) enters the capsule: the smallest `t` inside it.
    /// For a surface point `p` with normal `n` toward the tool this is the height of the material that the
    /// capsule leaves standing, negative where it cuts into the surface (docs/theory.md §10.1).
    pub(crate) fn entry(&self, p: &Point3, n: &Vector3) -> Option<f64> {
        let d = self.b - self.a;
        let m = p - self.a;
        let length_squared = d.norm_squared();
        if length_squared > SHORTEST_SEGMENT_MM.powi(2) {
            let q = 1.0 / length_squared;
            let (nd, md) = (n.dot(&d), m.dot(&d));
            let a = 1.0 - nd * nd * q;
            if a > 1e-12 {
                let b = m.dot(n) - md * nd * q;
                let c = m.norm_squared() - md * md * q - self.radius * self.radius;
                let root = b * b - a * c;
                if root < 0.0 {
                    return None;
                }
                let t = (-b - root.sqrt()) / a;
                let along = (md + t * nd) * q;
                if (0.0..=1.0).contains(&along) {
                    return Some(t);
                }
            }
        }
        let ends = [self.a, self.b].map(|end| ball_entry(&(p - end), n, self.radius));
        match ends {
            [Some(t), Some(s)] => Some(t.min(s)),
            [t, s] => t.or(s),
        }
    }
}

/// Where the line `m + t·n` enters the ball of radius `r` about the origin.
pub(crate) fn ball_entry(m: &Vector3, n: &Vector3, r: f64) -> Option<f64> {
    let b = m.dot(n);
    let root = b * b - m.norm_squared() + r * r;
    (root >= 0.0).then(|| -b - root.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Point3> {
        [-5.0..5.0, -5.0..5.0, -5.0..5.0].prop_map(Point3::from)
    }

    /// The first point of the line inside the capsule: a coarse walk, then bisection.
    fn walked_entry(capsule: &Capsule, p: &Point3, n: &Vector3) -> Option<f64> {
        let inside = |t: f64| capsule.axis_distance(&(p + n * t)) <= capsule.radius;
        let step = 1e-2;
        let mut t = -30.0;
        while !inside(t) {
            t += step;
            if t > 30.0 {
                return None;
            }
        }
        let (mut out, mut into) = (t - step, t);
        for _ in 0..60 {
            let middle = 0.5 * (out + into);
            if inside(middle) {
                into = middle;
            } else {
                out = middle;
            }
        }
        Some(into)
    }

    proptest! {
        #[test]
        fn entry_agrees_with_a_walk_along_the_line(a in point(), b in point(), p in point(), w in point(), radius in 0.5..4.0) {
            prop_assume!(w.coords.norm() > 0.1);
            let n = w.coords.normalize();
            let capsule = Capsule { a, b, radius };
            // A walk of 0.01 mm misses grazing lines: those are left out.
            if let Some(walked) = walked_entry(&capsule, &p, &n) {
                let exact = capsule.entry(&p, &n).expect("the walk found it");
                prop_assert!((exact - walked).abs() < 1e-6 || exact < walked);
                let at = p + n * exact;
                prop_assert!((capsule.axis_distance(&at) - radius).abs() < 1e-7);
            } else if let Some(t) = capsule.entry(&p, &n) {
                prop_assert!((capsule.axis_distance(&(p + n * t)) - radius).abs() < 1e-7);
                prop_assert!(capsule.axis_distance(&(p + n * (t + 0.02))) > radius, "the chord is longer than the walk's step");
            }
        }
    }

    #[test]
    fn two_passes_over_a_plane_leave_the_crest_of_the_textbook() {
        let (radius, h) = (10.0, 0.02);
        let s: f64 = 1.264_278_450_6;
        let n = Vector3::z();
        let crest = [-s / 2.0, s / 2.0]
            .map(|y| Capsule { a: Point3::new(-5.0, y, radius), b: Point3::new(5.0, y, radius), radius })
            .iter()
            .filter_map(|c| c.entry(&Point3::origin(), &n))
            .fold(f64::INFINITY, f64::min);
        approx::assert_abs_diff_eq!(crest, h, epsilon = 1e-11);
    }
}
