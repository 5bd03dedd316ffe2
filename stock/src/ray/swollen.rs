//! A disc swollen by a ball, along a segment: the end of a bull-nosed tool.
//!
//! The distance of a place from the disc on its way is a convex function along the ray. Newton's tangents from either end
//! of the ray never pass the first place that is inside: they end there, or find that the distance grows again. They begin
//! where the ray enters a cylinder about the body, which has a closed form; on its lower end most are done.

use super::frustum::Frustum;
use super::{Turned, dot, plus};

/// Steps of Newton's search from one end; at a grazing ray the distance falls by a factor of four a step.
const STEPS: usize = 60;
/// Steps of the search for the share of the way that is nearest.
const SHARE_STEPS: usize = 60;
/// It ends when the share is known to this: of the distance that is the square.
const SHARE: f64 = 1e-9;
/// The search begins this far before the cylinder, for rounding, mm.
const BEFORE_MM: f64 = 1e-6;
/// A place this close is inside, mm.
const INSIDE_MM: f64 = 1e-10;

/// A swollen disc along a segment, in turned coordinates.
pub(crate) struct Swollen {
    middle: Turned,
    axis: Turned,
    /// A cylinder about it, on the same way.
    around: Frustum,
    flat: f64,
    corner: f64,
    /// How far the way rises along the axis.
    rise: f64,
    /// The rest of the way, in the disc's plane, and its squared length.
    level: Turned,
    level_square: f64,
}

impl Swollen {
    pub(crate) fn new(middle: Turned, axis: Turned, along: Turned, flat: f64, corner: f64) -> Self {
        let rise = dot(&along, &axis);
        let level = plus(&along, &axis, -rise);
        let level_square = dot(&level, &level);
        let base = plus(&middle, &axis, -corner);
        let around = Frustum::new(base, axis, along, 2.0 * corner, [flat + corner; 2]);
        Swollen { middle, axis, around, flat, corner, rise, level, level_square }
    }

    /// Where the ray at this place is inside.
    pub(crate) fn interval(&self, u: f64, v: f64) -> Option<[f64; 2]> {
        let [low, high] = self.around.interval(u, v)?;
        let low = self.first_inside(u, v, low - BEFORE_MM, 1.0)?;
        let high = self.first_inside(u, v, high + BEFORE_MM, -1.0)?;
        (low < high).then_some([low, high])
    }

    /// The first place inside on the way up (`sense` 1) or down.
    fn first_inside(&self, u: f64, v: f64, start: f64, sense: f64) -> Option<f64> {
        let (mut t, mut share) = (start, 0.5);
        for _ in 0..STEPS {
            let (distance, growth) = self.distance(&[u, v, t], &mut share);
            let over = distance - self.corner;
            if over <= INSIDE_MM {
                return Some(t);
            }
            if growth * sense >= -1e-14 {
                return None;
            }
            t -= over / growth;
        }
        None
    }

    /// Distance of a place from the disc on its way, and how it grows along the ray. The share of the way is where the
    /// search for the nearest one begins, and then that one.
    fn distance(&self, p: &Turned, share: &mut f64) -> (f64, f64) {
        let q = plus(p, &self.middle, -1.0);
        let above = dot(&q, &self.axis);
        let beside = plus(&q, &self.axis, -above);
        *share = self.nearest_share(above, &beside, *share);
        let height = above - *share * self.rise;
        let out = plus(&beside, &self.level, -*share);
        let radius = dot(&out, &out).sqrt();
        let over = radius - self.flat;
        if over <= 0.0 {
            return (height.abs(), self.axis[2] * height.signum());
        }
        let distance = (height * height + over * over).sqrt();
        if distance == 0.0 {
            return (0.0, 0.0);
        }
        (distance, (height * self.axis[2] + over * out[2] / radius) / distance)
    }

    /// The share of the way at which the disc is nearest to a place `above` its plane and `beside` its middle.
    fn nearest_share(&self, above: f64, beside: &Turned, first: f64) -> f64 {
        let forward = dot(beside, &self.level);
        if self.level_square <= 1e-24 * self.rise * self.rise {
            return if self.rise == 0.0 { 0.0 } else { (above / self.rise).clamp(0.0, 1.0) };
        }
        if self.rise.abs() <= 1e-12 * self.level_square.sqrt() {
            return (forward / self.level_square).clamp(0.0, 1.0);
        }
        // Half the derivative of the squared distance grows with the share. With its own derivative, for Newton.
        let slope = |share: f64| {
            let out = plus(beside, &self.level, -share);
            let ahead = forward - share * self.level_square;
            let height = above - share * self.rise;
            let radius = dot(&out, &out).sqrt();
            let over = radius - self.flat;
            if over <= 0.0 {
                return (-height * self.rise, self.rise * self.rise);
            }
            let cosine = ahead / radius;
            let bend = cosine * cosine + over / radius * (self.level_square - cosine * cosine);
            (-height * self.rise - over * cosine, self.rise * self.rise + bend)
        };
        // The ends of the way are not looked at before Newton leads there.
        let (mut low, mut high) = (-1.0, 2.0);
        let mut share = first;
        for _ in 0..SHARE_STEPS {
            let (value, bend) = slope(share);
            if (share == 0.0 && value >= 0.0) || (share == 1.0 && value <= 0.0) {
                return share;
            }
            *if value > 0.0 { &mut high } else { &mut low } = share;
            let newton = (share - value / bend).clamp(0.0, 1.0);
            let is_within = low < newton && newton < high;
            let next = if is_within { newton } else { 0.5 * (low.max(0.0) + high.min(1.0)) };
            let moved = (next - share).abs();
            share = next;
            if moved < SHARE {
                break;
            }
        }
        share
    }
}
