//! A cone or cylinder between two discs, along a segment, in closed form.
//!
//! ```text
//!      ╭───────────────╮       the surface of what is swept consists of pieces of
//!     ╱ ╲             ╱ ╲        the frustum at both ends of the way,
//!    ╱   ╲           ╱   ╲       its two discs along the way (slanted cylinders, or flat),
//!    ╰───╯───────────╰───╯       the two straight lines of its side where the way is tangential
//! ```
//!
//! All of these lie in the swept body, which is convex: a ray's interval goes from the lowest to the highest place where it
//! meets one of them. Where one of them is degenerate it may be left out: that only shortens the interval by rounding.

use super::{Found, Turned, cross, dot, plus};

/// Parallel to within this, a disc and the way, or the way and a line of the side, span nothing.
const PARALLEL: f64 = 1e-9;

/// A frustum along a segment, in turned coordinates.
pub(crate) struct Frustum {
    /// Middle of the lower disc at the start.
    base: Turned,
    axis: Turned,
    along: Turned,
    height: f64,
    /// Radii of the lower and the upper disc.
    radii: [f64; 2],
    /// Growth of the radius for a millimetre of height.
    slope: f64,
    lines: [Option<Line>; 2],
    /// How far the way goes along the axis, and its length.
    forward: f64,
    length: f64,
    /// A cylinder along the rays.
    is_post: bool,
}

/// A line of the side along the way: a parallelogram.
struct Line {
    /// Lower end of the line.
    at: Turned,
    normal: Turned,
    /// The share of the line, and of the way, at a place of the plane.
    shares: [Turned; 2],
}

impl Frustum {
    pub(crate) fn new(base: Turned, axis: Turned, along: Turned, height: f64, radii: [f64; 2]) -> Self {
        let slope = (radii[1] - radii[0]) / height;
        let forward = dot(&along, &axis);
        let level = plus(&along, &axis, -forward);
        let across = dot(&level, &level).sqrt();
        let mut lines = [None, None];
        // The side's normal at the direction `w` is w − slope·axis: it is across the way where w·level = slope·forward.
        let cosine = slope * forward / across;
        if across > 0.0 && cosine.abs() < 1.0 {
            let ahead = level.map(|c| c / across);
            let beside = cross(&axis, &ahead);
            let sine = (1.0 - cosine * cosine).sqrt();
            lines = [sine, -sine].map(|sine| {
                let out = plus(&ahead.map(|c| c * cosine), &beside, sine);
                let at = plus(&base, &out, radii[0]);
                let line = plus(&axis.map(|c| c * height), &out, radii[1] - radii[0]);
                Line::new(at, line, along)
            });
        }
        let is_post = slope == 0.0 && axis[2].abs() == 1.0 && axis[0] == 0.0 && axis[1] == 0.0;
        let length = dot(&along, &along).sqrt();
        Frustum { base, axis, along, height, radii, slope, lines, forward, length, is_post }
    }

    /// Where the ray at this place is inside.
    pub(crate) fn interval(&self, u: f64, v: f64) -> Option<[f64; 2]> {
        // The ray's foot is beside the disc: its coordinates stay small.
        let foot = self.base[2];
        let at = [u, v, foot];
        let start = plus(&at, &self.base, -1.0);
        if self.is_post {
            return self.standing_along(&start).map(|[low, high]| [low + foot, high + foot]);
        }
        let mut found = Found::NOTHING;
        self.standing(&start, &mut found);
        if self.along != [0.0; 3] {
            self.standing(&plus(&start, &self.along, -1.0), &mut found);
            self.disc(&start, self.radii[0], &mut found);
            self.disc(&plus(&start, &self.axis, -self.height), self.radii[1], &mut found);
            for line in self.lines.iter().flatten() {
                line.meet(&at, &mut found);
            }
        }
        found.interval().map(|[low, high]| [low + foot, high + foot])
    }

    /// A ray along the axis of a cylinder: it is inside between the shares of the way at which the disc covers it.
    fn standing_along(&self, q: &Turned) -> Option<[f64; 2]> {
        let [du, dv, dw] = self.along;
        let shares = in_circle(&[q[0], q[1], 0.0], &[-du, -dv, 0.0], self.radii[0], [0.0, 1.0])?;
        let [a, b] = shares.map(|share| share * dw);
        let (up, down) = if self.axis[2] > 0.0 { (self.height, 0.0) } else { (0.0, self.height) };
        Some([a.min(b) - down, a.max(b) + up])
    }

    /// The ray in the frustum itself, from the middle of whose lower disc the ray's foot lies by `q`.
    fn standing(&self, q: &Turned, found: &mut Found) {
        let [.., steep] = self.axis;
        let level = dot(q, &self.axis);
        let slab = if steep == 0.0 {
            if !(0.0..=self.height).contains(&level) {
                return;
            }
            [f64::NEG_INFINITY, f64::INFINITY]
        } else {
            let ends = [-level / steep, (self.height - level) / steep];
            [ends[0].min(ends[1]), ends[0].max(ends[1])]
        };
        // |q|² − h² ≤ (r + slope·h)², with h = level + t·steep, as a·t² + 2b·t + c ≤ 0.
        let grown = 1.0 + self.slope * self.slope;
        let a = (1.0 - steep * steep) - self.slope * self.slope * steep * steep;
        let b = q[2] - steep * (level * grown + self.slope * self.radii[0]);
        let c = dot(q, q) - level * level - (self.radii[0] + self.slope * level).powi(2);
        let mut within = |low: f64, high: f64| {
            let (low, high) = (low.max(slab[0]), high.min(slab[1]));
            if low < high {
                found.add(low);
                found.add(high);
            }
        };
        if a.abs() < 1e-14 {
            match b {
                _ if b.abs() < 1e-12 && c <= 0.0 => within(f64::NEG_INFINITY, f64::INFINITY),
                _ if b.abs() < 1e-12 => {}
                _ if b > 0.0 => within(f64::NEG_INFINITY, -c / (2.0 * b)),
                _ => within(-c / (2.0 * b), f64::INFINITY),
            }
            return;
        }
        let under = b * b - a * c;
        if under <= 0.0 {
            if a < 0.0 {
                within(f64::NEG_INFINITY, f64::INFINITY);
            }
            return;
        }
        // The root of the larger size first: no digits cancel.
        let sum = -b - under.sqrt().copysign(b);
        let (one, other) = (sum / a, if sum == 0.0 { 0.0 } else { c / sum });
        let (low, high) = (one.min(other), one.max(other));
        if a > 0.0 {
            within(low, high);
        } else {
            // Steeper than the side: the ray leaves one nappe and enters the other. Only one lies between the discs.
            within(f64::NEG_INFINITY, low);
            within(high, f64::INFINITY);
        }
    }

    /// The ray in a disc on its way; its foot lies by `q` from the disc's middle.
    fn disc(&self, q: &Turned, radius: f64, found: &mut Found) {
        let (steep, forward, length) = (self.axis[2], self.forward, self.length);
        let level = dot(q, &self.axis);
        if steep.abs() * length >= forward.abs() && steep.abs() > PARALLEL {
            // The ray meets the disc at t = (share·forward − level) / steep, at the place y₀ + share·y₁ of it.
            let (t0, t1) = (-level / steep, forward / steep);
            let y0 = [q[0], q[1], q[2] + t0];
            let mut y1 = self.along.map(|c| -c);
            y1[2] += t1;
            if let Some(shares) = in_circle(&y0, &y1, radius, [0.0, 1.0]) {
                shares.into_iter().for_each(|share| found.add(t0 + share * t1));
            }
        } else if forward.abs() > PARALLEL * length {
            // The disc meets the ray at the share (level + t·steep) / forward of the way.
            let (s0, s1) = (level / forward, steep / forward);
            let y0 = plus(q, &self.along, -s0);
            let mut y1 = self.along.map(|c| -c * s1);
            y1[2] += 1.0;
            let range = if s1 == 0.0 {
                if !(0.0..=1.0).contains(&s0) {
                    return;
                }
                [f64::NEG_INFINITY, f64::INFINITY]
            } else {
                let ends = [-s0 / s1, (1.0 - s0) / s1];
                [ends[0].min(ends[1]), ends[0].max(ends[1])]
            };
            if let Some(ends) = in_circle(&y0, &y1, radius, range) {
                ends.into_iter().for_each(|t| found.add(t));
            }
        }
    }
}

/// The parameters within a range at which `from + t·along` is not longer than a radius.
fn in_circle(from: &Turned, along: &Turned, radius: f64, range: [f64; 2]) -> Option<[f64; 2]> {
    let (a, b) = (dot(along, along), dot(from, along));
    let c = dot(from, from) - radius * radius;
    let mut inside = range;
    if a > 0.0 {
        // The least distance, in place of b² − a·c, in which digits cancel.
        let nearest = plus(from, along, -b / a);
        let under = radius * radius - dot(&nearest, &nearest);
        if under <= 0.0 {
            return None;
        }
        let half = (under / a).sqrt();
        inside = [(-b / a - half).max(range[0]), (-b / a + half).min(range[1])];
    } else if c > 0.0 {
        return None;
    }
    (inside[0] <= inside[1] && inside[0].is_finite() && inside[1].is_finite()).then_some(inside)
}

impl Line {
    fn new(at: Turned, line: Turned, along: Turned) -> Option<Self> {
        let across = cross(&line, &along);
        let size = dot(&across, &across).sqrt();
        if size <= 1e-7 * (dot(&line, &line) * dot(&along, &along)).sqrt() {
            return None;
        }
        let normal = across.map(|c| c / size);
        let shares = [cross(&along, &normal).map(|c| c / size), cross(&normal, &line).map(|c| c / size)];
        (normal[2].abs() > PARALLEL).then_some(Line { at, normal, shares })
    }

    fn meet(&self, foot: &Turned, found: &mut Found) {
        let from = plus(foot, &self.at, -1.0);
        let t = -dot(&from, &self.normal) / self.normal[2];
        let there = [from[0], from[1], from[2] + t];
        if self.shares.iter().all(|share| (0.0..=1.0).contains(&dot(&there, share))) {
            found.add(t);
        }
    }
}
