//! What a flat or bull-nosed end leaves over a place as it runs past.
//!
//! A ball leaves least where it comes nearest. Another end touches the model beside its axis, so the place where it cuts deepest
//! has to be looked for along its way: to both sides of where its middle comes nearest, as far as the tool reaches.

use claymill_contact::EndShape;
use claymill_nurbs::{Point3, Vector3};

use crate::pattern::rows::crests::PlannedPass;

/// Looks at places along the way first; the best one is then narrowed down to this share of their distance.
const LOOKS: u32 = 12;
const NARROWED: f64 = 1e-5;
/// The share of an interval that the golden section keeps.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// How far below a place the tool is looked for, in its radii, and how exactly, mm.
const BELOW_RADII: f64 = 0.25;
const KNOWN_MM: f64 = 1e-9;
const NEWTON_STEPS: usize = 30;

/// Height over `point` along `normal` to which a tool cuts with its middle at a place; infinite when it comes not near.
fn cut_at_mm(end: &EndShape, point: &Point3, normal: &Vector3, middle: &Point3) -> f64 {
    let from = point - middle;
    // The distance is convex along the normal: from outside Newton never steps over where the tool begins.
    let mut height = end.distance(&from).0;
    if height < 0.0 {
        height = -BELOW_RADII * end.radius_mm();
    }
    for _ in 0..NEWTON_STEPS {
        let (mm, gradient) = end.distance(&(from + normal * height));
        let fall = -gradient.dot(normal);
        if mm <= KNOWN_MM {
            return height;
        }
        if fall <= KNOWN_MM {
            return f64::INFINITY;
        }
        height += mm / fall;
    }
    height
}

impl PlannedPass {
    /// What a tool that runs along the pass leaves over a place, looked for about `s` on its drive curve; infinite where it does
    /// not come by.
    pub(crate) fn left_by_mm(&self, end: &EndShape, point: &Point3, normal: &Vector3, s: f64) -> f64 {
        let left =
            |s: f64| self.centre_at(s).map_or(f64::INFINITY, |middle| cut_at_mm(end, point, normal, &middle));
        let reach = end.radius_mm();
        let step = 2.0 * reach / f64::from(LOOKS);
        let places = (0..=LOOKS).map(|k| s - reach + f64::from(k) * step).chain([s]);
        let best = places.map(|s| (left(s), s)).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((best_mm, best_s)) = best.filter(|(mm, _)| mm.is_finite()) else { return f64::INFINITY };
        let (mut from, mut to) = (best_s - step, best_s + step);
        let mut least = best_mm;
        while to - from > NARROWED * step {
            let (a, b) = (to - GOLDEN * (to - from), from + GOLDEN * (to - from));
            let (at_a, at_b) = (left(a), left(b));
            least = least.min(at_a).min(at_b);
            *if at_a <= at_b { &mut to } else { &mut from } = if at_a <= at_b { b } else { a };
        }
        least
    }
}
