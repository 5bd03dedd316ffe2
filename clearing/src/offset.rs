//! Sets without holes, grown or shrunk by a disc.
//!
//! ```text
//!         ╭──────────╮      Every edge is moved along its normal, and every corner becomes an arc about it, backwards where the
//!       ╭─┤          ├─╮    corner is hollow. How often this curve runs around a point is the Euler characteristic of
//!       │ │   set    │ │    what the disc about the point has of the set: its pieces less its holes. A set without holes
//!       ╰─┤     ╭────┼─╯    has none, so the curve runs around exactly the points that the disc of the set reaches.
//!         ╰─────╯    │
//! ```
//!
//! To shrink a set, its complement grows. That has a hole in a disc only if the whole set is in the disc; but then the set holds no
//! such disc, and nothing is left.

use std::f64::consts::{PI, TAU};

use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::i_float::int::point::IntPoint;

use crate::planar_set::{Contour, STEPS_PER_MM, chord_angle, overlay, side_length};

/// Hollow corners that turn by less are parts of arcs, radians.
const SMOOTH: f64 = 0.3;
/// Edges that bulge by less between two of them are left out, steps of the grid: twice the height of chords.
const SKIPPED_STEPS: f64 = 2.2e-3 * STEPS_PER_MM;
/// Of an edge beside a hollow corner only the ends are moved, if circles about them leave no more than this between them, steps of
/// the grid: of a set that grows, and of one that shrinks.
const NOTCH_STEPS: [f64; 2] = [3e-3 * STEPS_PER_MM, 1.5e-3 * STEPS_PER_MM];
/// Corners are left out between others that are no further from each other than this share of the distance.
const WIDEST_NOTCH: f64 = 0.125;

/// A circle rests on two corners that are no further from each other than this, in its radii.
const WIDEST_MOUTH: f64 = 1.9;

/// What is within a distance of a set with an anticlockwise outline; further inside than it if it is negative.
pub(crate) fn offset(outline: &Contour, mm: f64) -> Vec<Vec<Contour>> {
    if mm < 0.0 && least_width(outline) <= -2.0 * mm * STEPS_PER_MM {
        return Vec::new();
    }
    let raw = raw(outline, mm);
    let nothing: Contour = Vec::new();
    overlay(&raw, &nothing, OverlayRule::Subject, FillRule::Positive)
}

/// The shorter side of the box of an outline, steps of the grid.
fn least_width(outline: &Contour) -> f64 {
    let side = |of: fn(&IntPoint<i32>) -> i32| {
        let (low, high) = outline.iter().map(of).fold((i32::MAX, i32::MIN), |(l, h), c| (l.min(c), h.max(c)));
        f64::from(high) - f64::from(low)
    };
    side(|p| p.x).min(side(|p| p.y))
}

/// An edge of an outline that is moved to its right.
#[derive(Clone, Copy)]
struct Edge {
    ends: [IntPoint<i32>; 2],
    /// The direction of its normal, radians.
    normal: f64,
    /// Its ends are moved towards each other by this, radians, to where circles about them meet.
    lean: f64,
    is_notch: bool,
}

impl Edge {
    fn new(ends: [IntPoint<i32>; 2]) -> Self {
        let [a, b] = ends;
        let normal = (f64::from(a.x) - f64::from(b.x)).atan2(f64::from(b.y) - f64::from(a.y));
        Edge { ends, normal, lean: 0.0, is_notch: false }
    }

    /// Moved by a distance at its ends alone.
    fn notch(ends: [IntPoint<i32>; 2], far: f64) -> Self {
        let lean = (0.5 * side_length(ends[0], ends[1]) / far).asin();
        Edge { lean, is_notch: true, ..Edge::new(ends) }
    }
}

/// The turn from where the end of an edge is moved to where the start of the next one is, radians: at a tip it may be more than half
/// a turn.
fn turn(before: &Edge, after: &Edge) -> f64 {
    // The shorter way from normal to normal.
    let turn = (after.normal - before.normal + PI).rem_euclid(TAU) - PI;
    let turn = if turn <= -PI { -turn } else { turn };
    turn + before.lean + after.lean
}

/// Whether a corner that turns by so much is hollow, and a part of an arc.
fn is_hollow(turn: f64, far: f64) -> bool {
    turn * far < 0.0 && turn.abs() < SMOOTH
}

/// The edges of an outline as they are moved by a distance.
///
/// ```text
///        ╲           ╱        A hollow arc on the grid has corners that stand back from their neighbours by a little. A circle
///         •.       .•         that rolls along never touches them; moved far they would be thrown about, and the curve would
///           •._ _.•           run to and fro. They are left out, and what the circle touches is moved alone.
///              •
/// ```
fn edges(outline: &Contour, far: f64) -> Vec<Edge> {
    let longest = (8.0 * far.abs() * NOTCH_STEPS[usize::from(far < 0.0)]).sqrt();
    let whole = if far > 0.0 {
        rolled(outline, far, longest)
    } else {
        let corners = outline.iter().zip(outline.iter().cycle().skip(1)).filter(|(a, b)| a != b);
        corners.map(|(&a, &b)| Edge::new([a, b])).collect()
    };
    let n = whole.len();
    let hollow: Vec<bool> = (0..n).map(|k| is_hollow(turn(&whole[k], &whole[(k + 1) % n]), far)).collect();
    let mut kept: Vec<Edge> = Vec::with_capacity(n);
    for (k, edge) in whole.iter().enumerate() {
        let [a, b] = edge.ends;
        let is_beside_hollow = hollow[k] || hollow[(k + n - 1) % n];
        let is_notch = !edge.is_notch && is_beside_hollow && side_length(a, b) <= longest.min(far.abs());
        let mut next = if is_notch { Edge::notch(edge.ends, far) } else { *edge };
        while let Some(last) = kept.last().filter(|last| last.is_notch && next.is_notch) {
            let ends = [last.ends[0], next.ends[1]];
            let is_small = ends[0] != ends[1] && side_length(ends[0], ends[1]) <= WIDEST_NOTCH * far.abs();
            if !is_small || !is_hollow(turn(last, &next), far) {
                break;
            }
            next = Edge::notch(ends, far);
            kept.pop();
        }
        kept.push(next);
    }
    kept
}

/// A corner of an outline and the way to it from the one before.
struct Touched {
    at: IntPoint<i32>,
    /// Whether corners between them were left out.
    is_notch: bool,
    /// The box of all between.
    low: IntPoint<i32>,
    high: IntPoint<i32>,
}

impl Touched {
    fn after(before: IntPoint<i32>, at: IntPoint<i32>) -> Self {
        let low = IntPoint::new(before.x.min(at.x), before.y.min(at.y));
        let high = IntPoint::new(before.x.max(at.x), before.y.max(at.y));
        Touched { at, is_notch: false, low, high }
    }

    /// The way past a corner that is left out.
    fn past(&self, left_out: &Touched) -> Self {
        let low = IntPoint::new(self.low.x.min(left_out.low.x), self.low.y.min(left_out.low.y));
        let high = IntPoint::new(self.high.x.max(left_out.high.x), self.high.y.max(left_out.high.y));
        Touched { at: self.at, is_notch: true, low, high }
    }

    /// Whether no circle of this radius has room in the box of the way.
    fn is_narrow(&self, far: f64) -> bool {
        let side = |low: i32, high: i32| f64::from(high) - f64::from(low);
        side(self.low.x, self.high.x).min(side(self.low.y, self.high.y)) < 2.0 * far
    }
}

/// The edges of an outline that a circle touches when it rolls along outside, and between them the corners on which it rests at once.
///
/// ```text
///           ╭───────╮
///          │    far  │       What lies in a pocket that the circle does not get into, and that has no room for one, adds nothing
///        ●─●╲       ╱●─●     to what is within the distance: most of an outline if the distance is large.
///            │╲___╱│
///            ╰─────╯
/// ```
fn rolled(outline: &Contour, far: f64, longest: f64) -> Vec<Edge> {
    // The first corner from the left is touched.
    let Some(first) = (0..outline.len()).min_by_key(|&k| (outline[k].x, outline[k].y)) else {
        return Vec::new();
    };
    let start = outline[first];
    let mut touched = vec![Touched::after(start, start)];
    for k in 1..=outline.len() {
        let at = outline[(first + k) % outline.len()];
        let last = touched[touched.len() - 1].at;
        if at == last {
            continue;
        }
        let mut way = Touched::after(last, at);
        while let [.., before, left_out] = &touched[..] {
            let past = way.past(left_out);
            if !past.is_narrow(far) || !rests_on(before.at, (left_out, &way), far, longest) {
                break;
            }
            way = past;
            touched.pop();
        }
        touched.push(way);
    }
    let edge = |pair: &[Touched]| match (pair[0].at, &pair[1]) {
        (from, to) if to.is_notch => Edge::notch([from, to.at], far),
        (from, to) => Edge::new([from, to.at]),
    };
    touched.windows(2).map(edge).collect()
}

/// Whether a circle that rests on a corner and on the end of a way touches nothing of the way to the middle one, nor from there on.
fn rests_on(from: IntPoint<i32>, (to_middle, to_end): (&Touched, &Touched), far: f64, longest: f64) -> bool {
    let relative =
        |p: IntPoint<i32>| [f64::from(p.x) - f64::from(from.x), f64::from(p.y) - f64::from(from.y)];
    let (middle, end) = (relative(to_middle.at), relative(to_end.at));
    let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    let width2 = dot(end, end);
    let is_inside = end[0] * middle[1] - end[1] * middle[0] > 0.0;
    if !is_inside || width2 == 0.0 || width2 > (WIDEST_MOUTH * far).powi(2) {
        return false;
    }
    let up = (far * far / width2 - 0.25).sqrt();
    let centre = [0.5 * end[0] + up * end[1], 0.5 * end[1] - up * end[0]];
    let off = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
    let to_centre = off(middle, centre);
    // An edge that starts on the circle runs so far within it.
    let within = |corner: [f64; 2]| {
        let along = off(middle, corner);
        2.0 * dot(along, off(centre, corner)) / dot(along, along).sqrt()
    };
    let is_clear = |way: &Touched, corner: [f64; 2]| way.is_notch || within(corner) <= longest;
    dot(to_centre, to_centre) >= far * far && is_clear(to_middle, [0.0, 0.0]) && is_clear(to_end, end)
}

/// The curve at a distance to the right of an outline, with all its loops.
fn raw(outline: &Contour, mm: f64) -> Contour {
    let (far, chord) = (mm * STEPS_PER_MM, chord_angle(mm.abs()));
    let mut curve = Contour::with_capacity(3 * outline.len());
    let mut push = |p: IntPoint<i32>, angle: f64, far: f64| {
        let (sine, cosine) = angle.sin_cos();
        let moved = IntPoint::new(
            (f64::from(p.x) + far * cosine).round() as i32,
            (f64::from(p.y) + far * sine).round() as i32,
        );
        if curve.last() != Some(&moved) {
            curve.push(moved);
        }
    };
    let edges = edges(outline, far);
    for (k, edge) in edges.iter().enumerate() {
        let next = &edges[(k + 1) % edges.len()];
        let ([a, b], [_, after]) = (edge.ends, next.ends);
        let (angle, turn) = (edge.normal - edge.lean, turn(edge, next));
        if is_hollow(turn, far) {
            // Moved edges meet in a corner, if they are long enough. Shorter ones are turned around, which would be a zigzag
            // about every corner of a hollow arc: there one point does.
            let cut = (far * (0.5 * turn).tan()).abs();
            let are_long = [(a, b), (b, after)].map(|(p, q)| side_length(p, q) >= 2.0 * cut);
            if are_long == [true, true] {
                push(b, angle + 0.5 * turn, far / (0.5 * turn).cos());
                continue;
            }
            let counts =
                [(a, b), (b, after)].map(|(p, q)| 0.25 * side_length(p, q) * turn.abs() > SKIPPED_STEPS);
            if counts[0] {
                push(b, angle, far);
            }
            push(b, angle + 0.5 * turn, far);
            if counts[1] {
                push(b, next.normal + next.lean, far);
            }
            continue;
        }
        let steps = (turn.abs() / chord).ceil().max(1.0) as usize;
        for i in 0..=steps {
            push(b, angle + turn * i as f64 / steps as f64, far);
        }
    }
    curve
}

#[cfg(test)]
mod tests {
    use crate::outline::Outline;
    use crate::planar_set::PlanarSet;

    /// Blobs of discs with holes, cut from each other: the sets that rounds are made of.
    fn blobs(seed: u64) -> PlanarSet {
        let mut state = seed;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1_u64 << 31) as f64
        };
        let mut set = PlanarSet::rectangle([-30.0, -30.0, 30.0, 30.0]);
        for k in 0..14 {
            let disc =
                PlanarSet::disc([60.0 * random() - 30.0, 60.0 * random() - 30.0], 1.0 + 12.0 * random());
            set = if k % 3 == 2 { set.union(&disc) } else { set.minus(&disc) };
        }
        set.simplified()
    }

    #[test]
    fn grown_and_shrunk_sets_agree_with_distances() {
        let mut looked_at = 0;
        for seed in 0..12 {
            let set = blobs(seed);
            let outline = Outline::new(&set);
            for mm in [0.05, 0.4, 1.7, 5.0, 13.0, 31.0] {
                let (grown, shrunk) = (Outline::new(&set.dilated(mm)), Outline::new(&set.eroded(mm)));
                for k in 0..1500 {
                    let p = [
                        -50.0 + 100.0 * (f64::from(k) * 0.618_034).fract(),
                        -50.0 + 100.0 * (f64::from(k) * 0.754_878).fract(),
                    ];
                    let (inside, far) = (outline.contains(p), outline.distance(p, 60.0));
                    if (far - mm).abs() < 0.004 {
                        continue;
                    }
                    looked_at += 1;
                    assert_eq!(
                        grown.contains(p),
                        inside || far < mm,
                        "seed {seed}, grown by {mm}: {p:?} at {far}"
                    );
                    assert_eq!(
                        shrunk.contains(p),
                        inside && far > mm,
                        "seed {seed}, shrunk by {mm}: {p:?} at {far}"
                    );
                }
            }
        }
        assert!(looked_at > 80_000);
    }

    /// Bottles: a circle that does not come through the neck has room behind it, or has none.
    #[test]
    fn what_is_behind_a_neck_is_within_the_distance_or_not() {
        for (inner, mm) in [(8.0, 5.0), (8.0, 7.9), (8.0, 8.1), (8.0, 20.0), (3.0, 2.9)] {
            let bottle = PlanarSet::rectangle([-20.0, -20.0, 20.0, 20.0])
                .minus(&PlanarSet::disc([0.0, 0.0], inner))
                .minus(&PlanarSet::rectangle([-1.0, 0.0, 1.0, 30.0]));
            let middle = Outline::new(&bottle.dilated(mm)).contains([0.0, 0.0]);
            // The neck is no nearer than the wall.
            assert_eq!(middle, mm > inner, "{inner} mm wide, grown by {mm}");
        }
    }

    /// Slivers with sharp tips and noise on their borders, grown by far more than their size.
    #[test]
    fn slivers_grow_as_far_as_they_should() {
        for k in 0..40_u32 {
            let share = |prime: u32| (f64::from(k * prime) * 0.618_034).fract();
            let (radius, aside) = (2.0 + 30.0 * share(1), 0.02 + 2.0 * share(3));
            let noise = PlanarSet::disc([0.4 * radius, aside + 0.9 * radius], 0.2 * radius);
            let disc = PlanarSet::disc([0.0, 0.0], radius);
            let crescent =
                disc.minus(&PlanarSet::disc([aside, 0.3 * aside], radius * (0.9 + 0.2 * share(5))));
            for set in [crescent.clone(), crescent.minus(&noise), noise.minus(&crescent)] {
                for mm in [1.0, 40.0, 267.7, 523.6] {
                    let outline = Outline::new(&set);
                    for p in set.dilated(mm).contours().into_iter().flatten() {
                        let far = outline.distance(p, 2.0 * mm);
                        assert!((far - mm).abs() < 0.008, "{k}: a corner {p:?} at {far} instead of {mm}");
                    }
                }
            }
        }
    }
}
