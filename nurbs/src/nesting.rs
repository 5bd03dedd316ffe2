//! Which closed loops of a parameter plane lie inside which.
//!
//! Decided by the exact curves: neither the order of the loops nor the way they run round matters, nor how far
//! the control points of their arcs reach beyond them, nor whether a hole touches its outer loop.

use crate::arc::Arc;
use crate::gauss::nodes;
use crate::rings::Ring;
use crate::winding::Winding;
use crate::{Point2, TrimLoop, Vector2};

/// Parts of an arc that the rule is applied to.
const PARTS: usize = 2;
/// Places along a loop at which others are asked whether they enclose it.
const PROBES: usize = 64;
/// Probes stand inside of their loop by this part of its mean half width, so that a loop that touches another is
/// on one side of it.
const INWARD: f64 = 0.01;
/// Loops whose areas differ by less than this part are one loop, given twice: neither lies in the other.
const SAME_AREA: f64 = 1e-6;

/// Turns loops inside an even number of others anticlockwise and the rest (holes) clockwise.
///
/// Loops must be closed in the parameter plane; those that run across the seam of a closed surface have to be laid
/// out beyond it.
pub fn turn_by_nesting(loops: &mut [TrimLoop]) {
    let rings: Vec<Ring> = loops.iter().map(closed).collect();
    for (trim, turned) in loops.iter_mut().zip(to_be_turned(&rings)) {
        if turned {
            trim.edges.reverse();
            trim.edges.iter_mut().for_each(|e| e.pcurve = e.pcurve.reversed());
        }
    }
}

/// The arcs of a loop, with every end moved onto the next start.
fn closed(trim: &TrimLoop) -> Ring {
    let mut arcs: Vec<Arc> = trim.edges.iter().flat_map(|e| Arc::of_curve(&e.pcurve)).collect();
    let starts: Vec<Point2> = arcs.iter().map(Arc::start).collect();
    let next = starts.iter().cycle().skip(1);
    arcs.iter_mut().zip(next).for_each(|(arc, next)| arc.set_end(*next));
    Ring { arcs }
}

/// For each ring whether it runs the wrong way round for its depth.
pub(crate) fn to_be_turned(rings: &[Ring]) -> Vec<bool> {
    let areas: Vec<f64> = rings.iter().map(signed_area).collect();
    if let [area] = areas[..] {
        return vec![area < 0.0];
    }
    let windings: Vec<Winding> = rings.iter().map(|r| Winding::new(&r.arcs)).collect();
    let boxes: Vec<(Point2, Point2)> = rings.iter().map(Ring::hull).collect();
    let wrong = |i: usize| {
        let mut probes = None;
        let mut holds = |j: usize| {
            let ((a, b), (c, d)) = (boxes[i], boxes[j]);
            let boxed = c.x <= b.x && a.x <= d.x && c.y <= b.y && a.y <= d.y;
            if !boxed || areas[j].abs() * (1.0 - SAME_AREA) <= areas[i].abs() {
                return false;
            }
            let probes = probes.get_or_insert_with(|| probes_inside(&rings[i], areas[i]));
            let inside = |p: &&(Point2, f64)| windings[j].number(p.0) != 0;
            let length = |p: &(Point2, f64)| p.1;
            2.0 * probes.iter().filter(inside).map(length).sum::<f64>() > probes.iter().map(length).sum()
        };
        let depth = (0..rings.len()).filter(|&j| j != i && holds(j)).count();
        (areas[i] > 0.0) != (depth % 2 == 0)
    };
    (0..rings.len()).map(wrong).collect()
}

/// The area inside a ring, positive when it runs anticlockwise.
fn signed_area(ring: &Ring) -> f64 {
    // Relative to the first point: far windows would lose digits.
    let origin = ring.arcs.first().map_or(Point2::origin(), Arc::start);
    let of_arc = |arc: &Arc| {
        if arc.is_line() {
            return (arc.start() - origin).perp(&(arc.end() - origin));
        }
        let width = 1.0 / PARTS as f64;
        let part = |k: usize| {
            nodes().map(move |(x, weight)| {
                let (at, slope) = arc.jet((k as f64 + x) * width);
                weight * width * (at - origin).perp(&slope)
            })
        };
        (0..PARTS).flat_map(part).sum()
    };
    0.5 * ring.arcs.iter().map(of_arc).sum::<f64>()
}

/// Places just inside of a ring, each with the length that it stands for. Lengths are measured in the ring's own
/// box: the two parameters of a surface may be of very different size.
fn probes_inside(ring: &Ring, area: f64) -> Vec<(Point2, f64)> {
    let corners = ring.arcs.iter().flat_map(|a| [a.start(), a.point(0.5)]);
    let inf = Point2::new(f64::INFINITY, f64::INFINITY);
    let (low, high) = corners.fold((inf, -inf), |(a, b), p| (a.inf(&p), b.sup(&p)));
    let size = (high - low).map(|x| if x > 0.0 { x } else { 1.0 });
    let lengthwise = |slope: Vector2| slope.component_div(&size);
    let stride = ring.arcs.len().div_ceil(PROBES).max(1);
    let per_arc = (PROBES / ring.arcs.len().max(1)).clamp(1, 8);
    let mut places = Vec::new();
    for arc in ring.arcs.iter().step_by(stride) {
        // A probe in a corner would stand beside both sides of it.
        let at = |k: usize| (k as f64 + 0.37) / per_arc as f64;
        places.extend((0..per_arc).map(|k| {
            let (p, slope) = arc.jet(at(k));
            (p, lengthwise(slope))
        }));
    }
    let perimeter: f64 = places.iter().map(|p| p.1.norm()).sum::<f64>() * stride as f64 / per_arc as f64;
    let inward = INWARD * area / (size.x * size.y) / perimeter;
    let probe = |(p, slope): &(Point2, Vector2)| {
        let length = slope.norm();
        // To the left where the ring runs anticlockwise.
        let left = Vector2::new(-slope.y, slope.x) / length;
        (p + left.component_mul(&size) * inward, length)
    };
    places.iter().filter(|p| p.1.norm() > 0.0).map(probe).collect()
}
