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
/// What is further than this from a tool is outside of it, mm: more than rounding.
const OUTSIDE_MM: f64 = 1e-9;
/// Steps after which a place that may be inside is looked at in full.
const FEW_STEPS: u32 = 12;

/// A straight piece of the path of an end's middle, which is a corner radius above its tip.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SweptEnd {
    pub(crate) a: Point3,
    pub(crate) b: Point3,
    pub(crate) axis: Vector3,
    pub(crate) body: EndBody,
}

/// Where on its way a tool is nearest to a place.
enum Nearest {
    /// At the start or the end: the distance there, and its gradient.
    End((f64, Vector3)),
    Between(Bracket),
}

/// Two places of the way, and the distance from the tool there with its gradient: from the first it falls, from the second it rises.
struct Bracket {
    way: Vector3,
    low: f64,
    high: f64,
    before: (f64, Vector3),
    after: (f64, Vector3),
}

impl Bracket {
    /// How fast the distance falls from the first place on, and how fast it has risen up to the second.
    fn slopes(&self) -> [f64; 2] {
        [self.before.1.dot(&self.way), -self.after.1.dot(&self.way)]
    }

    fn is_narrow(&self) -> bool {
        let ([falling, rising], width) = (self.slopes(), self.high - self.low);
        falling.min(rising) * width < KNOWN_MM || width < NARROWEST
    }

    /// Replaces one of the places by one between them.
    fn narrow(&mut self, step: u32, at: impl FnOnce(f64) -> (f64, Vector3)) {
        let ([falling, rising], width) = (self.slopes(), self.high - self.low);
        let share = match step % 3 {
            // Where the distance is smooth, and where it has a kink.
            0 => falling / (falling + rising),
            1 => (self.before.0 - self.after.0 + rising * width) / ((falling + rising) * width),
            _ => 0.5,
        };
        let between = self.low + width * share.clamp(BESIDE, 1.0 - BESIDE);
        let found = at(between);
        if found.1.dot(&self.way) > 0.0 {
            (self.low, self.before) = (between, found);
        } else {
            (self.high, self.after) = (between, found);
        }
    }

    /// The tangents of both places meet here: the distance is nowhere less on the way, and where the outline has a corner, or nearly
    /// one, not more. The gradient between theirs that does not change along the way is that of what is swept.
    fn least(&self) -> (f64, Vector3) {
        let [falling, rising] = self.slopes();
        let of_after = falling / (falling + rising);
        let after_mm = self.after.0 - rising * (self.high - self.low);
        let mm = self.before.0 + of_after * (after_mm - self.before.0);
        (mm, self.before.1.lerp(&self.after.1, of_after))
    }
}

impl SweptEnd {
    /// The tool with its middle at one place.
    pub(crate) fn at(middle: Point3, axis: Vector3, body: EndBody) -> Self {
        SweptEnd { a: middle, b: middle, axis, body }
    }

    /// Distance of a place from what is swept, negative inside, with its gradient there.
    pub(crate) fn distance(&self, p: &Point3) -> (f64, Vector3) {
        match self.bracket(p) {
            Nearest::End(found) => found,
            Nearest::Between(mut bracket) => {
                for step in 0..STEPS {
                    if bracket.is_narrow() {
                        break;
                    }
                    bracket.narrow(step, |share| self.at_share(p, share));
                }
                bracket.least()
            }
        }
    }

    /// Whether the line that comes along `n` to a place is outside all the way up to there, as far as few steps tell.
    pub(crate) fn is_clear_up_to(&self, p: &Point3, n: &Vector3) -> bool {
        // A convex function lies above its tangents: where they fall along the line, it was larger before.
        let is_outside = |(mm, gradient): (f64, Vector3)| mm > OUTSIDE_MM && gradient.dot(n) <= 0.0;
        match self.bracket(p) {
            Nearest::End(found) => is_outside(found),
            Nearest::Between(mut bracket) => {
                for step in 0..FEW_STEPS {
                    if is_outside(bracket.least()) {
                        return true;
                    }
                    if bracket.before.0.min(bracket.after.0) <= 0.0 || bracket.is_narrow() {
                        return false;
                    }
                    bracket.narrow(step, |share| self.at_share(p, share));
                }
                is_outside(bracket.least())
            }
        }
    }

    /// Distance of a place from the tool where it is after a share of the way.
    fn at_share(&self, p: &Point3, share: f64) -> (f64, Vector3) {
        let middle = self.a + (self.b - self.a) * share;
        self.body.distance(&(p - middle + self.axis * self.body.corner_mm), &self.axis)
    }

    fn bracket(&self, p: &Point3) -> Nearest {
        let way = self.b - self.a;
        let before = self.at_share(p, 0.0);
        if way == Vector3::zeros() || before.1.dot(&way) <= 0.0 {
            return Nearest::End(before);
        }
        let after = self.at_share(p, 1.0);
        if after.1.dot(&way) > 0.0 {
            return Nearest::End(after);
        }
        Nearest::Between(Bracket { way, low: 0.0, high: 1.0, before, after })
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
    use proptest::prelude::*;

    use super::*;

    fn place(size_mm: f64) -> impl Strategy<Value = Vector3> {
        let side = || -size_mm..size_mm;
        [side(), side(), side()].prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn a_line_that_is_clear_comes_nowhere_into_the_tool(
            (radius_mm, share) in (1.0..12.0, 0.0..1.0),
            (a, way, p, n) in (place(5.0), place(8.0), place(18.0), place(1.0)),
        ) {
            prop_assume!(n.norm() > 0.1);
            let body = EndBody { radius_mm, corner_mm: 0.95 * share * radius_mm };
            let (a, p, n) = (Point3::from(a), Point3::from(p), n.normalize());
            let swept = SweptEnd { a, b: a + way, axis: Vector3::z(), body };
            let clear = swept.is_clear_up_to(&p, &n);
            for k in 0..200 {
                let before = p - n * (0.25 * f64::from(k));
                prop_assert!(!clear || swept.distance(&before).0 > 0.0);
            }
            // Few steps tell that it is, unless it comes very near.
            let (mm, gradient) = swept.distance(&p);
            prop_assert!(clear || mm < 0.1 || gradient.dot(&n) > -0.05, "{mm} {gradient:?}");
        }
    }

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
