//! What an end leaves over a place as it goes past on a straight piece of path.
//!
//! The distance of a point from the tool is convex in where the point and where the tool is. So of all places on a straight piece
//! one is nearest, and along a normal the swept tool begins once.

use claymill_nurbs::{Point3, Vector3};

use super::body::EndBody;

/// The nearest place of a piece is looked for in so many steps, of which every third halves what is left, until that is this share.
const STEPS: u32 = 80;
const NARROWEST: f64 = 1e-8;
/// No place is looked at closer to those that are known than by this share of what is left.
const BESIDE: f64 = 1e-3;
const NEWTON_STEPS: u32 = 24;
const KNOWN_MM: f64 = 1e-10;

/// A straight piece of the path of an end's middle, which is a corner radius above its tip.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SweptEnd {
    pub(crate) a: Point3,
    pub(crate) b: Point3,
    pub(crate) axis: Vector3,
    pub(crate) body: EndBody,
}

impl SweptEnd {
    /// The tool with its middle at one place.
    pub(crate) fn at(middle: Point3, axis: Vector3, body: EndBody) -> Self {
        SweptEnd { a: middle, b: middle, axis, body }
    }

    /// Distance of a place from what is swept, negative inside, with its gradient there.
    pub(crate) fn distance(&self, p: &Point3) -> (f64, Vector3) {
        let way = self.b - self.a;
        let up = self.axis * self.body.corner_mm;
        let at = |share: f64| self.body.distance(&(p - (self.a + way * share) + up), &self.axis);
        // How fast the distance falls on the way: ever more slowly, and from its least place on it rises.
        let fall = |(_, gradient): &(f64, Vector3)| gradient.dot(&way);
        let mut before = at(0.0);
        if way == Vector3::zeros() || fall(&before) <= 0.0 {
            return before;
        }
        let mut after = at(1.0);
        if fall(&after) > 0.0 {
            return after;
        }
        let (mut low, mut high) = (0.0, 1.0);
        for step in 0..STEPS {
            let (falling, rising, width) = (fall(&before), -fall(&after), high - low);
            if falling.min(rising) * width < KNOWN_MM || width < NARROWEST {
                break;
            }
            let share = match step % 3 {
                // Where the distance is smooth, and where it has a kink.
                0 => falling / (falling + rising),
                1 => (before.0 - after.0 + rising * width) / ((falling + rising) * width),
                _ => 0.5,
            };
            let between = low + width * share.clamp(BESIDE, 1.0 - BESIDE);
            let found = at(between);
            if fall(&found) > 0.0 {
                (low, before) = (between, found);
            } else {
                (high, after) = (between, found);
            }
        }
        // Where the outline has a corner, or nearly one, the distance has a kink there: the tangents of both sides meet in it, and
        // the gradient between theirs that does not change along the way is that of what is swept.
        let (falling, rising) = (fall(&before), fall(&after));
        let of_after = falling / (falling - rising);
        let after_mm = after.0 + rising * (high - low);
        (before.0 + of_after * (after_mm - before.0), before.1.lerp(&after.1, of_after))
    }

    /// The smallest `t` at which `p + t·n` is inside, looked for from `t = −below`.
    pub(crate) fn entry(&self, p: &Point3, n: &Vector3, below_mm: f64) -> Option<f64> {
        let mut t = self.distance(p).0;
        if t < 0.0 {
            t = -below_mm;
            if self.distance(&(p + n * t)).0 < 0.0 {
                return Some(t);
            }
        }
        // From outside Newton never steps over where a convex function becomes 0.
        for _ in 0..NEWTON_STEPS {
            let (mm, gradient) = self.distance(&(p + n * t));
            if mm <= KNOWN_MM {
                return Some(t);
            }
            let fall = -gradient.dot(n);
            if fall <= 0.0 {
                return None;
            }
            t += mm / fall;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The exact steps of reference case C2 leave the height that they were computed for.
    #[test]
    fn two_passes_uphill_leave_the_crest_of_the_reference() {
        const H: f64 = 0.02;
        for (corner_mm, slope_deg, step) in [
            (2.0, 3.0, 4.919_463_257),
            (2.0, 10.0, 2.764_115_340),
            (2.0, 30.0, 1.695_327_378),
            (0.0, 3.0, 5.476_090_990),
            (0.0, 15.0, 2.481_539_877),
        ] {
            let body = EndBody { radius_mm: 10.0, corner_mm };
            let (sine, cosine) = f64::to_radians(slope_deg).sin_cos();
            let (n, uphill) = (Vector3::new(-sine, 0.0, cosine), Vector3::new(cosine, 0.0, sine));
            let pass = |y: f64| {
                let tip = body.tip_over(&Point3::new(0.0, y, 0.0), &n, &Vector3::z());
                let middle = tip + Vector3::z() * corner_mm;
                SweptEnd { a: middle - uphill * 30.0, b: middle + uphill * 30.0, axis: Vector3::z(), body }
            };
            let place = Point3::from(uphill);
            let left = |y: f64| pass(y).entry(&place, &n, 1.0).unwrap();
            approx::assert_abs_diff_eq!(left(0.5 * step), H, epsilon = 1e-8);
            approx::assert_abs_diff_eq!(left(-0.5 * step), H, epsilon = 1e-8);
            approx::assert_abs_diff_eq!(left(0.0), 0.0, epsilon = 1e-8);
        }
    }
}
