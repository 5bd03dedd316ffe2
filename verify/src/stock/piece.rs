//! The convex space that a body of revolution sweeps along a straight way with a fixed axis:
//! membership in closed form, signed distance, and where a line leaves it.
//!
//! The sweep is the union of the body's positions `s` in [0, 1]. A point at `w` from the start has, as the body sees
//! it there, the height `z(s) = w·a − s d·a` and the distance from the axis `x(s) = |w⊥ − s d⊥|`. The body's signed
//! distance is a convex function of both, so that its least value over `s` is found without doubt; where it is not
//! positive the sweep holds the point.

use claymill_nurbs::{Aabb, Point3, Vector3};

use super::body::Shape;

/// A body along a straight way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sweep {
    /// Tip at the start.
    pub(super) start: Point3,
    /// From there to the tip at the end.
    pub(super) way: Vector3,
    /// Unit vector from the tip to the holder.
    pub(super) axis: Vector3,
    /// What is moved.
    pub(super) shape: Shape,
}

/// Ways across the axis that are shorter than this are none, mm.
const STANDING_MM: f64 = 1e-11;
/// Halvings that find the least value of a convex function along a way.
const HALVINGS: u32 = 50;
/// Where a line leaves a sweep is found to this, mm.
const ROOT_MM: f64 = 1e-10;
/// Halvings for that: enough for any line within 1e4 mm.
const MOST_HALVINGS: u32 = 64;

/// A point as the body sees it from its way.
struct Seen {
    /// Across the axis from the start.
    across: Vector3,
    /// The way across the axis.
    way_across: Vector3,
    /// Square of its length.
    square: f64,
    /// Height at the start.
    height: f64,
    /// Rise of the body along its way.
    rise: f64,
}

impl Seen {
    /// Distance from the axis at `s`.
    fn radius(&self, s: f64) -> f64 {
        (self.across - self.way_across * s).norm()
    }

    /// Height at `s`.
    fn height(&self, s: f64) -> f64 {
        self.height - s * self.rise
    }

    /// Where the axis passes nearest.
    fn nearest(&self) -> f64 {
        if self.square > STANDING_MM * STANDING_MM {
            self.across.dot(&self.way_across) / self.square
        } else {
            0.0
        }
    }

    /// The part of the way on which the height is between two limits.
    fn within(&self, low: f64, high: f64) -> Option<[f64; 2]> {
        if self.rise == 0.0 {
            return (low..=high).contains(&self.height).then_some([0.0, 1.0]);
        }
        let (a, b) = ((self.height - high) / self.rise, (self.height - low) / self.rise);
        let (from, to) = (a.min(b).max(0.0), a.max(b).min(1.0));
        (from <= to).then_some([from, to])
    }
}

impl Sweep {
    fn seen(&self, p: &Point3) -> Seen {
        let w = p - self.start;
        let (height, rise) = (w.dot(&self.axis), self.way.dot(&self.axis));
        let way_across = self.way - self.axis * rise;
        Seen {
            across: w - self.axis * height,
            square: way_across.norm_squared(),
            way_across,
            height,
            // What rounding leaves of a level way is none.
            rise: if rise.abs() < STANDING_MM { 0.0 } else { rise },
        }
    }

    /// Whether the sweep holds a point, its surface included.
    pub(super) fn holds(&self, p: &Point3) -> bool {
        let seen = self.seen(p);
        match self.shape {
            Shape::Frustum { low, high, radius, slope, .. } => {
                let Some([from, to]) = seen.within(low, high) else { return false };
                let s = least_of_cone(&seen, slope, from, to);
                // At a corner of a frustum rounding may leave the height a little outside: the radius there is what counts.
                let height = seen.height(s).clamp(low, high);
                seen.radius(s) <= radius + slope * (height - low)
            }
            Shape::End { disc, corner, centre, cap } => {
                let Some([from, to]) = seen.within(f64::NEG_INFINITY, cap) else { return false };
                holds_in_end(&seen, [from, to], disc, corner, centre)
            }
        }
    }

    /// A signed distance, mm: negative inside, 0 on the surface, outside the true distance; it never changes faster than the point
    /// moves. Inside it is the depth in the best of the body's positions: the radius of a ball that the body holds at one time.
    pub(super) fn signed_mm(&self, p: &Point3) -> f64 {
        let seen = self.seen(p);
        if let Shape::End { disc: 0.0, corner, centre, cap } = self.shape
            && cap >= centre + corner
        {
            let along = seen.across.dot(&seen.way_across) + (seen.height - centre) * seen.rise;
            let s = along / (seen.square + seen.rise * seen.rise).max(STANDING_MM * STANDING_MM);
            let s = s.clamp(0.0, 1.0);
            let (x, z) = (seen.radius(s), seen.height(s) - centre);
            return (x * x + z * z).sqrt() - corner;
        }
        if seen.rise == 0.0 {
            return self.at(&seen, seen.nearest().clamp(0.0, 1.0))[0];
        }
        let [at_start, slope] = self.at(&seen, 0.0);
        if slope >= 0.0 {
            return at_start;
        }
        let [at_end, slope] = self.at(&seen, 1.0);
        if slope <= 0.0 {
            return at_end;
        }
        let (mut from, mut to, mut least) = (0.0, 1.0, at_start.min(at_end));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (from + to);
            let [value, slope] = self.at(&seen, middle);
            least = least.min(value);
            if slope < 0.0 { from = middle } else { to = middle }
        }
        least
    }

    /// The body's signed distance at a place of the way, and how fast it grows along it.
    fn at(&self, seen: &Seen, s: f64) -> [f64; 2] {
        let (x, z) = (seen.radius(s), seen.height(s));
        let growth = if x > 0.0 { seen.square * (s - seen.nearest()) / x } else { 0.0 };
        let larger = |a: [f64; 2], b: [f64; 2]| if b[0] > a[0] { b } else { a };
        match self.shape {
            Shape::End { disc, corner, centre, cap } => {
                let (u, v) = ((x - disc).max(0.0), z - centre);
                let distance = (u * u + v * v).sqrt();
                let slope = if distance > 0.0 { (u * growth - v * seen.rise) / distance } else { 0.0 };
                larger([distance - corner, slope], [z - cap, -seen.rise])
            }
            Shape::Frustum { low, high, radius, slope, cosine } => {
                let flank = (x - radius - slope * (z - low)) * cosine;
                let beside = [flank, (growth + slope * seen.rise) * cosine];
                let sides = larger(larger(beside, [low - z, seen.rise]), [z - high, -seen.rise]);
                // Where a rim is nearest the planes of its two sides are nearer than that.
                let rims = [(radius, low, 1.0), (radius + slope * (high - low), high, -1.0)];
                let rim = rims.into_iter().find_map(|(rim, height, inwards)| {
                    let (dx, dz) = (x - rim, z - height);
                    let is_nearest = rim > 0.0 && dx >= 0.0 && inwards * (slope * dx + dz) <= 0.0;
                    let distance = (dx * dx + dz * dz).sqrt();
                    (is_nearest && distance > 0.0)
                        .then(|| [distance, (dx * growth - dz * seen.rise) / distance])
                });
                rim.unwrap_or(sides)
            }
        }
    }

    /// The smallest box around it, a little wider for rounding.
    pub(super) fn bounds(&self) -> Aabb {
        let mut bounds = Aabb::empty();
        let [low, high, _] = self.shape.extent();
        let aside = self.axis.map(|a| (1.0 - a * a).max(0.0).sqrt());
        for tip in [self.start, self.start + self.way] {
            match self.shape {
                Shape::End { disc, corner, centre, .. } => {
                    let reach = aside * disc + Vector3::repeat(corner);
                    let c = tip + self.axis * centre;
                    bounds = bounds.union(&Aabb { min: c - reach, max: c + reach });
                }
                Shape::Frustum { radius, slope, .. } => {
                    for (height, radius) in [(low, radius), (high, radius + slope * (high - low))] {
                        let (c, reach) = (tip + self.axis * height, aside * radius.max(0.0));
                        bounds = bounds.union(&Aabb { min: c - reach, max: c + reach });
                    }
                }
            }
        }
        let size = bounds.min.coords.amax().max(bounds.max.coords.amax());
        bounds.inflated(1e-12 * size + 1e-9)
    }

    /// The least `t`, not below `low`, down to which the line `p + t·n` (`n` a unit vector) stays inside the sweep from a place that
    /// it holds, `from`; to 1e-10 mm, on the inner side.
    pub(super) fn exit(&self, p: &Point3, n: &Vector3, from: f64, low: f64) -> f64 {
        let (mut within, mut out) = (from, low);
        if self.holds(&(p + n * low)) {
            return low;
        }
        for _ in 0..MOST_HALVINGS {
            let middle = 0.5 * (out + within);
            if (within - out).abs() <= ROOT_MM || middle == out || middle == within {
                break;
            }
            if self.holds(&(p + n * middle)) { within = middle } else { out = middle }
        }
        within
    }
}

/// Where along a part of the way the distance from a cone's flank is least: the root of
/// `ℓ²(s − s₀)/√(q² + ℓ²(s − s₀)²) + slope·rise = 0`.
fn least_of_cone(seen: &Seen, slope: f64, from: f64, to: f64) -> f64 {
    let pull = slope * seen.rise;
    let length = seen.square.sqrt();
    let s = if length <= STANDING_MM || pull.abs() >= length {
        if pull > 0.0 { from } else { to }
    } else {
        let nearest = seen.nearest();
        nearest - pull * seen.radius(nearest) / (length * (length * length - pull * pull).sqrt())
    };
    s.clamp(from, to)
}

/// Whether a point is no farther than `corner` from the disc on a part of its way.
fn holds_in_end(seen: &Seen, [from, to]: [f64; 2], disc: f64, corner: f64, centre: f64) -> bool {
    let limit = corner * corner;
    let square = |s: f64| {
        let (u, v) = ((seen.radius(s) - disc).max(0.0), seen.height(s) - centre);
        u * u + v * v
    };
    if disc == 0.0 {
        let size = seen.square + seen.rise * seen.rise;
        if size <= STANDING_MM * STANDING_MM {
            return square(from) <= limit;
        }
        let along = seen.across.dot(&seen.way_across) + (seen.height - centre) * seen.rise;
        return square((along / size).clamp(from, to)) <= limit;
    }
    let nearest = seen.nearest().clamp(from, to);
    if square(nearest) <= limit {
        return true;
    }
    if seen.rise == 0.0 || seen.radius(nearest) > disc + corner {
        return false;
    }
    // The derivative of half the square grows along the way: halve to its root.
    let slope = |s: f64| {
        let x = seen.radius(s);
        let growth = if x > 0.0 { seen.square * (s - seen.nearest()) / x } else { 0.0 };
        (x - disc).max(0.0) * growth - (seen.height(s) - centre) * seen.rise
    };
    let (mut a, mut b) = (from, to);
    if square(a) <= limit || square(b) <= limit {
        return true;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (a + b);
        if square(middle) <= limit {
            return true;
        }
        if slope(middle) < 0.0 { a = middle } else { b = middle }
    }
    false
}
