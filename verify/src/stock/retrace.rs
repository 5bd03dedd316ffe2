//! Ways that were gone before: which part of a sweep is surely held by one earlier position of the
//! same tool, without any box being divided.
//!
//! An earlier piece holds a sweep, being convex, if it holds the body at both ends of its way. A body like the piece's own is
//! held where its tip is on the piece's way. Above that a frustum may stand as far as the piece's own reaches up, and an end
//! as far as the flutes that go on from the piece's end as a tangent: a tool that grows no thinner upwards holds
//! itself raised.

use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, Point3};

use super::body::Shape;
use super::piece::Sweep;
use super::sweeps::{Sweeps, Time};

/// Parts that a way is divided into at most.
const MOST_PARTS: usize = 128;
/// Parts of a way are not shorter than this, mm.
const SHORTEST_PART_MM: f64 = 0.05;
/// Axes that differ by less are one.
const SAME_AXIS: f64 = 1e-9;

/// The part of a sweep of which no single earlier position of a tool is known to hold all but a skin; `None` where there is none.
pub(super) fn uncovered(sweep: &Sweep, before: Time, sweeps: &Sweeps, skin_mm: f64) -> Option<Sweep> {
    let length = sweep.way.norm();
    let mut parts = vec![[0.0, 1.0]];
    let mut left: Option<[f64; 2]> = None;
    let mut looked_at = 0;
    while let Some([from, to]) = parts.pop() {
        looked_at += 1;
        if is_held(sweep, [from, to], before, sweeps, skin_mm) {
            continue;
        }
        if looked_at < MOST_PARTS && (to - from) * length > 2.0 * SHORTEST_PART_MM {
            let middle = 0.5 * (from + to);
            parts.extend([[middle, to], [from, middle]]);
        } else {
            left = Some(left.map_or([from, to], |[a, b]| [a.min(from), b.max(to)]));
        }
    }
    let [from, to] = left?;
    Some(Sweep { start: sweep.start + sweep.way * from, way: sweep.way * (to - from), ..*sweep })
}

/// Whether an earlier position is known to hold the body along a part of its way.
fn is_held(sweep: &Sweep, part: [f64; 2], before: Time, sweeps: &Sweeps, skin_mm: f64) -> bool {
    let [low, high, _] = sweep.shape.extent();
    let inner = sweep.axis * (0.5 * (low + high));
    let ends = part.map(|s| sweep.start + sweep.way * s);
    let middles = ends.map(|e| e + inner);
    // Ends of tools that would do with flutes on top, with what of the skin is left; and flutes.
    let (mut waiting, mut flutes): (Vec<(Sweep, f64, f64)>, Vec<Sweep>) = (Vec::new(), Vec::new());
    let mut held = false;
    sweeps.around(&Aabb::of(&middles), before, |piece, _| {
        if (piece.axis - sweep.axis).norm() > SAME_AXIS {
            return ControlFlow::Continue(());
        }
        let places = ends.map(|e| beside(piece, &e));
        let aside = |[across, rise]: [f64; 2]| {
            sweep.shape.raised(rise).beyond(&piece.shape).map(|beyond| beyond.max(0.0) + across)
        };
        held = places.iter().all(|p| aside(*p).is_some_and(|mm| mm <= skin_mm));
        if held {
            return ControlFlow::Break(());
        }
        if let Shape::Frustum { .. } = piece.shape {
            flutes.push(*piece);
        } else if let (Shape::End { .. }, Some(beyond)) = (sweep.shape, sweep.shape.beyond(&piece.shape)) {
            let across = places[0][0].max(places[1][0]) + beyond.max(0.0);
            let (lowest, highest) = (places[0][1].min(places[1][1]), places[0][1].max(places[1][1]));
            let used = across + (-lowest).max(0.0);
            if used <= skin_mm {
                waiting.push((*piece, skin_mm - used, high + highest));
            }
        }
        ControlFlow::Continue(())
    });
    held || waiting.iter().any(|(end, left_mm, top)| {
        flutes
            .iter()
            .any(|f| f.start == end.start && f.way == end.way && go_on(&end.shape, &f.shape, *left_mm, *top))
    })
}

/// Whether flutes go on from an end as a tangent, but for a skin, and no thinner, as far up as is asked.
fn go_on(end: &Shape, flutes: &Shape, skin_mm: f64, top: f64) -> bool {
    let (Shape::End { disc, corner, centre, .. }, Shape::Frustum { low, high, radius, slope, cosine }) =
        (*end, *flutes)
    else {
        return false;
    };
    // Distance of the flank's line from the ball that it should touch, and of its lower end from where it should.
    let line = (radius + slope * (centre - low) - disc) * cosine - corner;
    let foot = (radius - disc).hypot(low - centre) - corner;
    slope >= 0.0 && high >= top && line.abs() <= skin_mm && foot.abs() <= skin_mm
}

/// How far a tip is aside of a piece's way, across the axis, and above it.
fn beside(piece: &Sweep, tip: &Point3) -> [f64; 2] {
    let w = tip - piece.start;
    let across = |v: claymill_nurbs::Vector3| v - piece.axis * v.dot(&piece.axis);
    let way = across(piece.way);
    let s = if way.norm_squared() > 1e-18 {
        across(w).dot(&way) / way.norm_squared()
    } else {
        w.dot(&piece.way) / piece.way.norm_squared().max(f64::MIN_POSITIVE)
    };
    let off = w - piece.way * s.clamp(0.0, 1.0);
    [across(off).norm(), off.dot(&piece.axis)]
}
