//! Exact membership by brute force: the distance from a tool, made small over the way. It knows outlines of tools and
//! nothing of the crate's bodies.

use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::{Holder, Tool};

/// An outline in the half plane of (distance from the axis, height above the tip).
pub(super) enum Outline {
    /// Everything within `ball` of the segment from the axis to `flat`, at a height.
    Disc { height: f64, flat: f64, ball: f64 },
    /// Between two heights, radii in between.
    Cone { low: [f64; 2], high: [f64; 2] },
}

/// Which parts of a tool move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Parts {
    End,
    Cutting,
    Whole,
}

pub(super) fn outlines(tool: &Tool, holder: Option<&Holder>, parts: Parts) -> Vec<Outline> {
    let corner = tool.corner_radius_mm();
    let mut found = Vec::new();
    if corner > 0.0 {
        found.push(Outline::Disc { height: corner, flat: tool.radius_mm() - corner, ball: corner });
    }
    let sides = tool.sides();
    let count = match parts {
        Parts::End => 0,
        Parts::Cutting => 1,
        Parts::Whole => sides.len(),
    };
    let top = holder.map_or(1e4, |h| h.stick_out_mm);
    for [low, mut high] in sides.into_iter().take(count) {
        let slope = if high[0].is_finite() { (high[1] - low[1]) / (high[0] - low[0]) } else { 0.0 };
        let limit = if parts == Parts::Whole { top } else { 1e4 };
        if high[0] > limit {
            high = [limit, low[1] + slope * (limit - low[0])];
        }
        if low[0] < high[0] {
            found.push(Outline::Cone { low, high });
        }
    }
    if let (Parts::Whole, Some(holder)) = (parts, holder) {
        found.extend(holder.profile().map(|[low, high]| Outline::Cone { low, high }));
    }
    found
}

impl Outline {
    /// Distance of a place of the half plane; 0 inside.
    fn distance(&self, out: f64, height: f64) -> f64 {
        match *self {
            Outline::Disc { height: disc, flat, ball } => {
                ((out - flat).max(0.0).hypot(height - disc) - ball).max(0.0)
            }
            Outline::Cone { low, high } => {
                let corners = [[0.0, low[0]], [low[1], low[0]], [high[1], high[0]], [0.0, high[0]]];
                let (mut least, mut is_inside) = (f64::INFINITY, true);
                for i in 0..3 {
                    let ([ax, ay], [bx, by]) = (corners[i], corners[i + 1]);
                    let (dx, dy) = (bx - ax, by - ay);
                    let square = dx * dx + dy * dy;
                    if square == 0.0 {
                        continue;
                    }
                    is_inside &= dx * (height - ay) - dy * (out - ax) >= 0.0;
                    let share = (((out - ax) * dx + (height - ay) * dy) / square).clamp(0.0, 1.0);
                    least = least.min((out - ax - share * dx).hypot(height - ay - share * dy));
                }
                if is_inside { 0.0 } else { least }
            }
        }
    }
}

/// Distance of a point from all outlines on a way.
pub(super) fn distance(outlines: &[Outline], axis: &Vector3, from: &Point3, to: &Point3, p: &Point3) -> f64 {
    let least = |outline: &Outline| {
        let at = |share: f64| {
            let q = p - (from + (to - from) * share);
            let height = q.dot(axis);
            outline.distance((q - axis * height).norm(), height)
        };
        // The distance from something convex is convex along a line.
        let (mut low, mut high) = (0.0, 1.0);
        let mut best = at(0.0).min(at(1.0));
        for _ in 0..64 {
            if best == 0.0 {
                break;
            }
            let (a, b) = (low + (high - low) * 0.381_966, low + (high - low) * 0.618_034);
            let (fa, fb) = (at(a), at(b));
            best = best.min(fa).min(fb);
            if fa < fb {
                high = b;
            } else {
                low = a;
            }
        }
        best
    };
    outlines.iter().map(least).fold(f64::INFINITY, f64::min)
}
