//! Where a pass runs, seen along the tool axis.

use claymill_nurbs::{Point2, Vector3};

use crate::curve::cubics::Cubics;

/// Newton on a drive curve stops here, mm.
const NEAREST_MM: f64 = 1e-9;
const NEWTON_STEPS: usize = 8;

/// A curve in the setup's horizontal plane, over which the ball is dropped. Its parameter `s` is about arc
/// length.
#[derive(Debug, Clone)]
pub(crate) enum DriveCurve {
    /// A straight row.
    Straight(Line),
    /// A smooth curve.
    Curved(Cubics),
}

/// A horizontal line in the setup: `origin + s·direction`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Line {
    pub(crate) origin: [f64; 2],
    pub(crate) direction: [f64; 2],
}

impl DriveCurve {
    pub(crate) fn at(&self, s: f64) -> [f64; 2] {
        match self {
            DriveCurve::Straight(line) => [0, 1].map(|k| line.origin[k] + s * line.direction[k]),
            DriveCurve::Curved(curve) => curve.point(s).into(),
        }
    }

    /// Derivative of [`DriveCurve::at`]: about a unit vector.
    pub(crate) fn direction(&self, s: f64) -> [f64; 2] {
        match self {
            DriveCurve::Straight(line) => line.direction,
            DriveCurve::Curved(curve) => curve.derivatives(s)[1].into(),
        }
    }

    /// Both at once.
    pub(crate) fn at_with_direction(&self, s: f64) -> ([f64; 2], [f64; 2]) {
        match self {
            DriveCurve::Straight(line) => (self.at(s), line.direction),
            DriveCurve::Curved(curve) => {
                let [p, first, _] = curve.derivatives(s);
                (p.into(), first.into())
            }
        }
    }

    /// Parameter of the place nearest to `(x, y)`, looked for close to `near`. Beyond the ends a drive curve goes on
    /// straight.
    pub(crate) fn nearest(&self, x: f64, y: f64, near: f64) -> f64 {
        match self {
            DriveCurve::Straight(line) => {
                (x - line.origin[0]) * line.direction[0] + (y - line.origin[1]) * line.direction[1]
            }
            DriveCurve::Curved(curve) => {
                let (s0, s1) = curve.domain();
                let mut s = near.clamp(s0, s1);
                for _ in 0..NEWTON_STEPS {
                    let [p, first, second] = curve.derivatives(s);
                    let off = Point2::new(x, y).coords - p;
                    let bent = first.norm_squared() - off.dot(&second);
                    let step = off.dot(&first) / if bent > 0.0 { bent } else { first.norm_squared() };
                    let next = (s + step).clamp(s0, s1);
                    let done = (next - s).abs() < NEAREST_MM;
                    s = next;
                    if done {
                        break;
                    }
                }
                s
            }
        }
    }

    /// [`lift`] at `s`.
    pub(crate) fn lift(&self, s: f64, slope: f64) -> Vector3 {
        let [ex, ey] = self.direction(s);
        let level = ex.hypot(ey);
        lift([ex / level, ey / level], slope / level)
    }
}

/// The direction in which a pass that rises by `slope` over a horizontal unit vector is raised to stay clear: across
/// the ball's path, in the upright plane through it. Upwards and not along the contact normal, because in a valley the
/// ball touches on both sides.
pub(crate) fn lift([ex, ey]: [f64; 2], slope: f64) -> Vector3 {
    Vector3::new(-slope * ex, -slope * ey, 1.0) / (slope * slope + 1.0).sqrt()
}
