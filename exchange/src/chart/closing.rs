//! From laid-out loops to closed ones: loops that run round a periodic carrier are paired across it or led
//! over a pole, and a face that lies outside of its loops gets the carrier's own rectangle.

use claymill_nurbs::Point2;
use nalgebra::Vector2;

use super::carrier::{Carrier, Range};
use super::layout::{LaidLoop, Leg, signed_area};

/// Closes the loops of one face. `sense` says whether the face's outside is the carrier's, so that the face
/// lies to the left of its loops in the parameter plane. No loops at all mean the whole carrier.
pub(crate) fn close(
    carrier: &Carrier,
    mut loops: Vec<LaidLoop>,
    sense: bool,
) -> Result<Vec<LaidLoop>, String> {
    loops.retain(|l| !l.legs.is_empty());
    let (mut essential, mut closed): (Vec<_>, Vec<_>) =
        loops.into_iter().partition(|l| l.winding != Vector2::zeros());
    let mut outer = Vec::new();
    while let Some(first) = essential.pop() {
        let partner = essential.iter().position(|l| l.winding == -first.winding);
        // Some writers run all loops the same way round: two of them still bound a band.
        let alike = || essential.iter().position(|l| l.winding == first.winding);
        let closed = match (partner, over_pole(carrier, first.clone(), sense)) {
            (Some(k), _) => paired(carrier, first, essential.remove(k), sense),
            (None, Ok(cap)) => cap,
            (None, Err(open)) => {
                let mut partner = essential.remove(alike().ok_or(open)?);
                partner.reverse();
                paired(carrier, first, partner, sense)
            }
        };
        outer.push(closed);
    }
    if outer.is_empty() && carrier.is_closed() && !closed.is_empty() {
        let area = |l: &LaidLoop| signed_area(&l.polygon());
        let largest = closed.iter().map(|l| (area(l), l)).max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        // A seam that a loop follows there and back is inside of the face, whichever way writers say that the loop runs.
        if largest.is_some_and(|(area, l)| (area > 0.0) != sense && !l.follows_a_seam(carrier.periods())) {
            outer.extend(carrier.whole().map(|range| around(&clear_of(range, &closed, carrier.periods()))));
        }
    }
    gather(carrier, &outer, &mut closed);
    outer.append(&mut closed);
    Ok(outer)
}

/// The side of a loop on which the face lies, across the direction `d` that it runs round: 1 above, −1 below.
fn face_side(winding: f64, d: usize, sense: bool) -> f64 {
    let left = if d == 0 { winding } else { -winding };
    if sense { left } else { -left }
}

/// Two loops round the carrier, joined by a cut there and back.
fn paired(carrier: &Carrier, mut first: LaidLoop, mut second: LaidLoop, sense: bool) -> LaidLoop {
    let periods = carrier.periods();
    let d = usize::from(first.winding.x == 0.0);
    // Across a second periodic direction the partner lies on the face's side of the first loop.
    if let Some(period) = periods[1 - d] {
        let middle = |l: &LaidLoop| {
            let range = Range::of(l.polygon());
            0.5 * (range.min[1 - d] + range.max[1 - d])
        };
        let side = face_side(first.winding[d], d, sense);
        let ahead = (side * (middle(&second) - middle(&first))).rem_euclid(period);
        let mut by = Vector2::zeros();
        by[1 - d] = middle(&first) + side * ahead - middle(&second);
        second.shift(by);
    }
    let Some(period) = periods[d] else { return first };
    let cut_from = end(&first);
    // Start the second loop where the cut is shortest.
    let slant = |leg: &Leg| {
        let gap = cut_from[d] - leg.path.start()[d];
        (gap - period * (gap / period).round()).abs()
    };
    let best =
        (0..second.legs.len()).min_by(|a, b| slant(&second.legs[*a]).total_cmp(&slant(&second.legs[*b])));
    for _ in 0..best.unwrap_or(0) {
        let mut leg = second.legs.remove(0);
        let mut by = Vector2::zeros();
        by[d] = second.winding[d] * period;
        leg.path.shift(by);
        second.legs.push(leg);
    }
    let gap = cut_from[d] - start(&second)[d];
    let mut by = Vector2::zeros();
    by[d] = period * (gap / period).round();
    second.shift(by);
    let (there, back) = (Leg::straight(cut_from, start(&second)), Leg::straight(end(&second), start(&first)));
    first.legs.push(there);
    first.legs.append(&mut second.legs);
    first.legs.push(back);
    first.winding = Vector2::zeros();
    first
}

/// One loop round the carrier, closed over the pole on the face's side.
fn over_pole(carrier: &Carrier, mut only: LaidLoop, sense: bool) -> Result<LaidLoop, String> {
    let d = usize::from(only.winding.x == 0.0);
    let upper = face_side(only.winding[d], d, sense) > 0.0;
    let pole = carrier
        .pole(d, upper)
        .ok_or("a boundary runs round the surface and nothing closes the face on the other side")?;
    let (from, to) = (end(&only), start(&only));
    let at_pole = |mut p: Point2| {
        p[1 - d] = pole;
        p
    };
    only.legs.push(Leg::straight(from, at_pole(from)));
    only.legs.push(Leg::straight(at_pole(from), at_pole(to)));
    only.legs.push(Leg::straight(at_pole(to), to));
    only.winding = Vector2::zeros();
    Ok(only)
}

fn start(l: &LaidLoop) -> Point2 {
    l.legs[0].path.start()
}

fn end(l: &LaidLoop) -> Point2 {
    l.legs[l.legs.len() - 1].path.end()
}

/// The range moved along its periodic directions until its sides run through the widest gap between the loops.
fn clear_of(mut range: Range, loops: &[LaidLoop], periods: [Option<f64>; 2]) -> Range {
    for d in 0..2 {
        let Some(period) = periods[d] else { continue };
        let mut spans: Vec<(f64, f64)> = loops
            .iter()
            .map(|l| {
                let covered = Range::of(l.polygon());
                let from = (covered.min[d] - range.min[d]).rem_euclid(period);
                (from, from + covered.max[d] - covered.min[d])
            })
            .collect();
        spans.sort_by(|a, b| a.0.total_cmp(&b.0));
        let Some(first) = spans.first().copied() else {
            continue;
        };
        spans.push((first.0 + period, 0.0));
        let (mut covered_to, mut widest) = (first.1, (0.0, 0.0));
        for (from, to) in &spans[1..] {
            if from - covered_to > widest.0 {
                widest = (from - covered_to, 0.5 * (from + covered_to));
            }
            covered_to = to.max(covered_to);
        }
        range.min[d] += widest.1;
        range.max[d] += widest.1;
    }
    range
}

/// The range's four sides, anticlockwise.
fn around(range: &Range) -> LaidLoop {
    let (a, c) = (range.min, range.max);
    let (b, d) = (Point2::new(c.x, a.y), Point2::new(a.x, c.y));
    LaidLoop {
        legs: [(a, b), (b, c), (c, d), (d, a)].map(|(p, q)| Leg::straight(p, q)).into(),
        winding: Vector2::zeros(),
    }
}

/// Shifts loops by whole periods so that all lie on one sheet: inside the largest of them.
fn gather(carrier: &Carrier, outer: &[LaidLoop], inner: &mut [LaidLoop]) {
    let periods = carrier.periods();
    if periods == [None, None] {
        return;
    }
    let area = |l: &LaidLoop| signed_area(&l.polygon()).abs();
    let largest = outer.iter().chain(inner.iter()).max_by(|a, b| area(a).total_cmp(&area(b)));
    let Some(home) = largest.map(LaidLoop::polygon) else {
        return;
    };
    let home_range = Range::of(home.iter().copied());
    for l in inner {
        let polygon = l.polygon();
        let range = Range::of(polygon.iter().copied());
        let shifts = |d: usize| -> Vec<f64> {
            let Some(period) = periods[d] else {
                return vec![0.0];
            };
            let middle = 0.5 * (home_range.min[d] + home_range.max[d] - range.min[d] - range.max[d]);
            let nearest = (middle / period).round();
            [0.0, -1.0, 1.0].map(|k| period * (nearest + k)).into()
        };
        let inside = |by: &Vector2<f64>| polygon.iter().all(|p| contains(&home, &(p + by)));
        let all: Vec<Vector2<f64>> =
            shifts(0).iter().flat_map(|u| shifts(1).into_iter().map(|v| Vector2::new(*u, v))).collect();
        let by = all.iter().find(|by| inside(by)).or(all.first());
        // The largest loop itself stays: its own nearest shift is none.
        l.shift(by.copied().unwrap_or_default());
    }
}

/// Whether `p` is inside the polygon (even–odd).
fn contains(polygon: &[Point2], p: &Point2) -> bool {
    let next = polygon.iter().cycle().skip(1);
    let crossings = polygon
        .iter()
        .zip(next)
        .filter(|(a, b)| (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) * (b.x - a.x) / (b.y - a.y));
    crossings.count() % 2 == 1
}
