//! Gaps too wide to be joints: edges without a neighbour that have one after all within the search radius.

use std::collections::BTreeMap;

use claymill_nurbs::{FaceId, Point3, Vector3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::account::Bare;
use crate::edge::Edge;
use crate::joint::EdgeStretch;
use crate::laps;
use crate::lone::LoneFaces;
use crate::matching::{self, Pair, Run};

/// A stretch of edge beside another face, farther away than the tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WideGap {
    /// Where.
    pub stretch: EdgeStretch,
    /// The face on the other side.
    pub beside: FaceId,
    /// The gap leads to the other face's boundary; if not, to its inside.
    pub to_edge: bool,
    /// Length of the stretch, mm.
    pub length_mm: f64,
    /// Largest distance, mm.
    pub gap_max_mm: f64,
    /// A place on it, mm; edge to edge the one where it is largest.
    pub at: Point3,
}

/// Places on a gap where it is measured.
const PLACES: usize = 16;
/// Cosine of the angle within which two faces lie on the same side of a gap, like the two skins of a sheet.
const SAME_SIDE: f64 = 0.866;

/// The gaps among the stretches without a neighbour, edge to edge first.
pub(crate) fn find(
    edges: &[Edge<'_>],
    pairs: &[Pair],
    bare: &[Bare],
    lone: &LoneFaces<'_>,
    is_copy: &[bool],
    radius_mm: f64,
    tolerance_mm: f64,
) -> Vec<WideGap> {
    let mut of_edge: BTreeMap<usize, Vec<Bare>> = BTreeMap::new();
    bare.iter().for_each(|b| of_edge.entry(b.edge).or_default().push(*b));
    let between = |pair: &Pair| -> Vec<(WideGap, [Bare; 2])> {
        let (Some(on_a), Some(on_b)) = (of_edge.get(&pair.a), of_edge.get(&pair.b)) else {
            return Vec::new();
        };
        let runs = matching::runs(edges, pair, radius_mm);
        runs.iter().flat_map(|run| opposite(edges, run, on_a, on_b, tolerance_mm)).collect()
    };
    let found: Vec<(WideGap, [Bare; 2])> = pairs.par_iter().flat_map_iter(between).collect();
    let mut taken: BTreeMap<usize, Vec<Bare>> = BTreeMap::new();
    found.iter().flat_map(|(_, sides)| sides).for_each(|b| taken.entry(b.edge).or_default().push(*b));
    let left: Vec<Bare> = bare
        .iter()
        .flat_map(|b| without(b, taken.get(&b.edge).map_or(&[], Vec::as_slice), tolerance_mm))
        .collect();
    let (onto, _) = laps::find(edges, &left, lone, is_copy, radius_mm);
    let over = onto.into_iter().map(|lap| WideGap {
        stretch: lap.stretch,
        beside: lap.onto,
        to_edge: false,
        length_mm: lap.length_mm,
        gap_max_mm: lap.gap_mm,
        at: lap.ends[0],
    });
    found.into_iter().map(|(gap, _)| gap).chain(over).collect()
}

/// The parts of a run that are bare on both sides.
fn opposite(
    edges: &[Edge<'_>],
    run: &Run,
    on_a: &[Bare],
    on_b: &[Bare],
    tolerance_mm: f64,
) -> Vec<(WideGap, [Bare; 2])> {
    let (ea, eb) = (&edges[run.a], &edges[run.b]);
    let span = |edge: &Edge<'_>, on: [f64; 2]| {
        let [s, t] = on.map(|t| edge.arc_length(t));
        [s.min(t), s.max(t)]
    };
    let across = |from: &Edge<'_>, s: f64, to: &Edge<'_>| {
        let p = Point3::from(from.lift(from.at_length(s))[0]);
        to.arc_length(to.foot(&p).t)
    };
    let ([a0, a1], [b0, b1]) = (span(ea, run.on_a), span(eb, run.on_b));
    let mut found = Vec::new();
    for b in on_b {
        let (from, to) = (b.from.max(b0), b.to.min(b1));
        if to - from <= tolerance_mm {
            continue;
        }
        let [x, y] = [from, to].map(|s| across(eb, s, ea));
        for a in on_a {
            let (from, to) = (a.from.max(a0).max(x.min(y)), a.to.min(a1).min(x.max(y)));
            if to - from <= tolerance_mm || is_no_gap(ea, eb, 0.5 * (from + to)) {
                continue;
            }
            let (mut gap_max_mm, mut at) = (0.0, Point3::origin());
            for k in 0..=PLACES {
                let s = from + (to - from) * k as f64 / PLACES as f64;
                let p = Point3::from(ea.lift(ea.at_length(s))[0]);
                let gap = (eb.foot(&p).point - p).norm();
                if gap > gap_max_mm {
                    (gap_max_mm, at) = (gap, p);
                }
            }
            let [x, y] = [from, to].map(|s| across(ea, s, eb));
            let sides = [Bare { edge: run.a, from, to }, Bare { edge: run.b, from: x.min(y), to: x.max(y) }];
            let gap = WideGap {
                stretch: ea.stretch([from, to].map(|s| ea.at_length(s))),
                beside: eb.face,
                to_edge: true,
                length_mm: to - from,
                gap_max_mm,
                at,
            };
            found.push((gap, sides));
        }
    }
    found
}

/// Whether what is between the edges is no gap: both faces lie on one side of it, or one face fills it.
fn is_no_gap(ea: &Edge<'_>, eb: &Edge<'_>, s: f64) -> bool {
    let t = ea.at_length(s);
    let from = Point3::from(ea.lift(t)[0]);
    let foot = eb.foot(&from);
    match (inward(ea, t), inward(eb, foot.t)) {
        (Some(a), _) if ea.face == eb.face => a.dot(&(foot.point - from)) > 0.0,
        (Some(a), Some(b)) => a.dot(&b) > SAME_SIDE,
        _ => false,
    }
}

/// From the edge into its face, in the tangent plane.
fn inward(edge: &Edge<'_>, t: f64) -> Option<Vector3> {
    let c = edge.pcurve.point(t);
    let (normal, _) = edge.surface.normal(c.x, c.y)?;
    let left = normal.cross(&edge.lift(t)[1]).try_normalize(1e-12)?;
    Some(if edge.inside_left { left } else { -left })
}

/// What of a stretch is left when others are taken from it.
fn without(bare: &Bare, taken: &[Bare], tolerance_mm: f64) -> Vec<Bare> {
    let mut taken: Vec<&Bare> = taken.iter().filter(|t| t.to > bare.from && t.from < bare.to).collect();
    taken.sort_by(|a, b| a.from.total_cmp(&b.from));
    let mut left = Vec::new();
    let mut from = bare.from;
    for t in taken {
        left.push(Bare { from, to: t.from, ..*bare });
        from = from.max(t.to);
    }
    left.push(Bare { from, ..*bare });
    left.retain(|b| b.to - b.from > tolerance_mm);
    left
}
