//! Holders, flutes and shanks as unions of convex frustums without upper end, with distance,
//! support function and the height at which they clear a point.

use claymill_nurbs::Vector3;
use claymill_toolpath::{Holder, Tool};

/// A convex body of revolution about the tool axis, without end upwards: a frustum that grows wider and the cylinder
/// above it.
///
/// ```text
///     │         │   outer radius, from `high` on
///      ╲       ╱
///       ╲_____╱     inner radius at `low`
/// ```
///
/// What lies above a holder is the spindle, so nothing is lost by leaving out the upper ends; and a holder of many
/// sections is the union of such bodies, each convex, whatever its outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frustum {
    /// Height of the lower end, mm.
    pub(super) low: f64,
    /// Radius there, mm.
    pub(super) inner: f64,
    /// Height from which on it is a cylinder, mm.
    pub(super) high: f64,
    /// Radius of the cylinder, mm.
    pub(super) outer: f64,
    /// Height gained for a millimetre of radius below that.
    slope: f64,
    /// Cosine of the slope's angle.
    cosine: f64,
}

/// The holder with heights counted from its own lower end. A section that grows thinner upwards is the cylinder of its
/// lower end: what it leaves out is above that and so cannot be come near to from below.
pub(super) fn of_holder(holder: &Holder) -> Vec<Frustum> {
    let mut body: Vec<Frustum> = Vec::new();
    for [[low, inner], [high, outer]] in holder.profile() {
        let (low, high) = (low - holder.stick_out_mm, high - holder.stick_out_mm);
        let piece = if outer > inner {
            Frustum::new([low, inner], [high, outer])
        } else {
            Frustum::cylinder(low, inner)
        };
        if body.iter().all(|below| below.outer < piece.outer) {
            body.push(piece);
        }
    }
    body
}

/// What a tool has above its end, heights counted from the tip, with all of its surface moved inwards. What is no thicker
/// than something below it stands in that one's shadow.
pub(super) fn of_sides(tool: &Tool, slimmer_mm: f64) -> Vec<Frustum> {
    let mut body: Vec<Frustum> = Vec::new();
    let slimmer = |radius: f64, by_mm: f64| (radius - by_mm).max(0.0);
    for [[low, lower], [high, upper]] in tool.sides() {
        let piece = if upper > lower {
            let aside = slimmer_mm * ((upper - lower) / (high - low)).hypot(1.0);
            Frustum::new([low, slimmer(lower, aside)], [high, slimmer(upper, aside)])
        } else {
            // The first one goes on from the end, the others have a shoulder.
            let raised = if body.is_empty() { 0.0 } else { slimmer_mm };
            Frustum::cylinder(low + raised, slimmer(lower, slimmer_mm))
        };
        if body.iter().all(|below| below.outer < piece.outer) {
            body.push(piece);
        }
    }
    body
}

/// How deep a point lies in the sides of a tool: its distance from their surface, negative or small outside.
pub(super) fn depth_in_sides(tool: &Tool, height: f64, from_axis: f64) -> f64 {
    let mut widest = 0.0;
    let mut deepest = f64::NEG_INFINITY;
    for [[low, lower], [high, upper]] in tool.sides() {
        let slope = if upper > lower { (upper - lower) / (high - low) } else { 0.0 };
        let radius = (lower + slope * (height - low)).min(upper);
        let inwards = (radius - from_axis) / slope.hypot(1.0);
        let up = if widest > 0.0 && lower > widest { height - low } else { f64::INFINITY };
        if height >= low {
            deepest = f64::max(deepest, inwards.min(up));
        }
        widest = upper.max(widest);
    }
    deepest
}

impl Frustum {
    /// Between two ends of height and radius, the upper one wider.
    fn new([low, inner]: [f64; 2], [high, outer]: [f64; 2]) -> Self {
        let slope = (high - low) / (outer - inner);
        Frustum { low, inner, high, outer, slope, cosine: 1.0 / slope.hypot(1.0) }
    }

    fn cylinder(low: f64, radius: f64) -> Self {
        Frustum { low, inner: radius, high: low, outer: radius, slope: 0.0, cosine: 1.0 }
    }

    /// Whether it is as thick everywhere.
    pub(super) fn is_cylinder(&self) -> bool {
        self.inner == self.outer
    }

    /// How much higher the body has to be for a point at `height`, `from_axis` away from the axis, to keep `clearance`
    /// below it; -∞ where the point is that far beside the body. It falls with the distance from the axis.
    pub(super) fn raise(&self, height: f64, from_axis: f64, clearance: f64) -> f64 {
        if from_axis > self.outer + clearance {
            return f64::NEG_INFINITY;
        }
        // The body grown by a ball: its bottom, an arc about the lower rim, a slanted side, an arc about the upper rim.
        let aside = clearance * self.cosine;
        let on_side = from_axis - aside * self.slope;
        let arc = |rim: f64| (clearance * clearance - (from_axis - rim).powi(2)).max(0.0).sqrt();
        let lowest = if from_axis <= self.inner {
            self.low - clearance
        } else if on_side <= self.inner {
            self.low - arc(self.inner)
        } else if on_side < self.outer {
            self.low + self.slope * (on_side - self.inner) - aside
        } else {
            self.high - arc(self.outer)
        };
        height - lowest
    }

    /// Distance of a point from the body; 0 inside.
    pub(super) fn distance(&self, height: f64, from_axis: f64) -> f64 {
        let beside = from_axis - self.outer;
        if height >= self.high {
            return beside.max(0.0);
        }
        if from_axis <= self.inner {
            return (self.low - height).max(0.0);
        }
        let (out, up) = (self.outer - self.inner, self.high - self.low);
        let (x, y) = (from_axis - self.inner, height - self.low);
        if y * out >= x * up && beside <= 0.0 && y >= 0.0 {
            return 0.0;
        }
        let along = ((x * out + y * up) / (out * out + up * up).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (x - along * out).hypot(y - along * up)
    }

    /// The farthest point of the body along `direction`, the body raised by `offset` and cut off at `ceiling`.
    pub(super) fn support(&self, direction: &Vector3, offset: f64, ceiling: f64) -> Vector3 {
        let level = (direction.x * direction.x + direction.y * direction.y).sqrt();
        let aside = if level > 0.0 { [direction.x / level, direction.y / level] } else { [1.0, 0.0] };
        let rim = |radius: f64, height: f64| Vector3::new(aside[0] * radius, aside[1] * radius, height);
        if direction.z > 0.0 {
            return rim(self.outer, ceiling.max(self.high + offset));
        }
        let (lower, upper) = (rim(self.inner, self.low + offset), rim(self.outer, self.high + offset));
        if upper.dot(direction) > lower.dot(direction) { upper } else { lower }
    }
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::Point2;
    use claymill_toolpath::Tool;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn sections_in_the_shadow_of_lower_ones_are_left_out() {
        let holder = Holder::parse("40:20-30x10,24x5,30-12x8,50x20", &Tool::ball(5.0)).unwrap();
        let body = of_holder(&holder);
        let expected = [[0.0, 10.0, 10.0, 15.0], [23.0, 25.0, 23.0, 25.0]];
        assert_eq!(body.iter().map(|f| [f.low, f.inner, f.high, f.outer]).collect::<Vec<_>>(), expected);
    }

    proptest! {
        /// Distances against points of the outline, raising against distances.
        #[test]
        fn distance_and_raise_agree_with_the_outline(
            inner in 1.0..20.0, wider in prop_oneof![Just(0.0), 0.1..20.0], up in prop_oneof![Just(0.0), 0.1..40.0],
            height in -30.0..60.0, from_axis in 0.0..60.0_f64, clearance in 0.1..6.0
        ) {
            let body = if wider == 0.0 {
                Frustum::cylinder(3.0, inner)
            } else {
                Frustum::new([3.0, inner], [3.0 + up, inner + wider])
            };
            let corners: [[f64; 2]; 4] = [[0.0, body.low], [inner, body.low], [body.outer, body.high], [body.outer, body.high + 200.0]];
            let here = Point2::new(from_axis, height);
            let outline = corners.windows(2).map(|pair| {
                let (start, side) = (Point2::from(pair[0]), Point2::from(pair[1]) - Point2::from(pair[0]));
                let along = (here - start).dot(&side) / side.norm_squared().max(f64::MIN_POSITIVE);
                (start + side * along.clamp(0.0, 1.0) - here).norm()
            });
            let brute = outline.fold(f64::INFINITY, f64::min);
            let found = body.distance(height, from_axis);
            prop_assert!(found == 0.0 || (found - brute).abs() < 1e-9, "{found} {brute}");
            let raise = body.raise(height, from_axis, clearance);
            if raise.is_finite() {
                let then = body.distance(height - raise, from_axis);
                prop_assert!((then - clearance).abs() < 1e-9, "{raise}: {then} for {clearance}");
                prop_assert!(body.raise(height, from_axis + 0.3, clearance) <= raise);
            } else {
                prop_assert!(found > clearance - 1e-9);
            }
        }
    }
}
