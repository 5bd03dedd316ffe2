//! Who covers what: every stretch of every edge is matched, lapped, non-manifold or naked.

use claymill_nurbs::Point3;
use serde::{Deserialize, Serialize};

use crate::edge::Edge;
use crate::joint::EdgeStretch;
use crate::matching::Run;

/// Where the boundary length of all faces goes: the four parts sum to the total.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct BoundaryAccount {
    /// Length of the boundaries of all faces, collapsed sides left out, mm.
    pub total_mm: f64,
    /// Matched with exactly one other edge, mm (both sides of a joint count).
    pub matched_mm: f64,
    /// Lying on the inside of another face, mm; the boundaries of copies of faces count here.
    pub lapped_mm: f64,
    /// With no neighbour, mm.
    pub naked_mm: f64,
    /// Matched with two or more edges, mm.
    pub non_manifold_mm: f64,
}

/// A stretch of edge without a neighbour.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NakedStretch {
    /// Where.
    pub stretch: EdgeStretch,
    /// Length, mm.
    pub length_mm: f64,
    /// Its two ends, mm.
    pub ends: [Point3; 2],
}

/// A stretch of an edge without a neighbouring edge, as lengths from its start, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bare {
    pub(crate) edge: usize,
    pub(crate) from: f64,
    pub(crate) to: f64,
}

/// The runs on each edge as intervals of arc length.
pub(crate) struct Coverage {
    by_edge: Vec<Vec<Interval>>,
}

#[derive(Debug, Clone, Copy)]
struct Interval {
    run: usize,
    from: f64,
    to: f64,
}

impl Coverage {
    pub(crate) fn new(edges: &[Edge<'_>], runs: &[Run]) -> Self {
        let mut by_edge = vec![Vec::new(); edges.len()];
        for (run, r) in runs.iter().enumerate() {
            for (edge, on) in [(r.a, r.on_a), (r.b, r.on_b)] {
                let [s0, s1] = on.map(|t| edges[edge].arc_length(t));
                by_edge[edge].push(Interval { run, from: s0.min(s1), to: s0.max(s1) });
            }
        }
        Coverage { by_edge }
    }

    /// For each run, the runs that share more than `tolerance_mm` of an edge with it.
    pub(crate) fn rivals(&self, runs: usize, tolerance_mm: f64) -> Vec<Vec<usize>> {
        let mut rivals = vec![Vec::new(); runs];
        for intervals in &self.by_edge {
            for (k, x) in intervals.iter().enumerate() {
                for y in &intervals[k + 1..] {
                    if x.to.min(y.to) - x.from.max(y.from) > tolerance_mm {
                        rivals[x.run].push(y.run);
                        rivals[y.run].push(x.run);
                    }
                }
            }
        }
        rivals
    }

    /// Sums up all edges, those of copies as lapped, and lists the stretches longer than `tolerance_mm` that
    /// no edge runs along. What of these is lapped is still to be told: it counts as naked here.
    pub(crate) fn account(
        &self,
        edges: &[Edge<'_>],
        is_copy: &[bool],
        tolerance_mm: f64,
    ) -> (BoundaryAccount, Vec<Bare>) {
        let mut account = BoundaryAccount::default();
        let mut bare = Vec::new();
        for (id, (edge, intervals)) in edges.iter().zip(&self.by_edge).enumerate() {
            if is_copy[edge.face] {
                account.total_mm += edge.length_mm();
                account.lapped_mm += edge.length_mm();
                continue;
            }
            let mut list = |from: f64, to: f64| {
                if to - from > tolerance_mm {
                    bare.push(Bare { edge: id, from, to });
                }
            };
            let mut cuts = vec![0.0, edge.length_mm()];
            cuts.extend(intervals.iter().flat_map(|i| [i.from, i.to]));
            cuts.sort_by(f64::total_cmp);
            let mut open: Option<f64> = None;
            for w in cuts.windows(2) {
                let length = w[1] - w[0];
                let covered = |i: &&Interval| i.from <= w[0] && i.to >= w[1];
                let covers = if length > 0.0 { intervals.iter().filter(covered).count() } else { 0 };
                account.total_mm += length;
                match covers {
                    0 => account.naked_mm += length,
                    1 => account.matched_mm += length,
                    _ => account.non_manifold_mm += length,
                }
                if covers == 0 {
                    open.get_or_insert(w[0]);
                } else if let Some(from) = open.take() {
                    list(from, w[0]);
                }
            }
            if let Some(from) = open {
                list(from, edge.length_mm());
            }
        }
        (account, bare)
    }
}

impl Bare {
    pub(crate) fn naked(&self, edges: &[Edge<'_>]) -> NakedStretch {
        let edge = &edges[self.edge];
        let on = [self.from, self.to].map(|s| edge.at_length(s));
        NakedStretch { stretch: edge.stretch(on), length_mm: self.to - self.from, ends: edge.points(on) }
    }
}

/// Cuts runs where another run on the same edge begins or ends, so that on each elementary run the same
/// edges meet from end to end (T-junctions).
pub(crate) fn imprint(edges: &[Edge<'_>], runs: &[Run], tolerance_mm: f64) -> Vec<Run> {
    // Arc length and parameter, by length: an edge that wavers about the tolerance has thousands of runs.
    let mut ends: Vec<Vec<(f64, f64)>> = vec![Vec::new(); edges.len()];
    for r in runs {
        for (edge, on) in [(r.a, r.on_a), (r.b, r.on_b)] {
            ends[edge].extend(on.map(|t| (edges[edge].arc_length(t), t)));
        }
    }
    ends.iter_mut().for_each(|of_edge| of_edge.sort_by(|x, y| x.0.total_cmp(&y.0)));
    let within = |edge: usize, on: [f64; 2]| {
        let [s0, s1] = on.map(|t| edges[edge].arc_length(t));
        let (low, high) = (s0.min(s1) + 2.0 * tolerance_mm, s0.max(s1) - 2.0 * tolerance_mm);
        let of_edge = &ends[edge];
        let first = of_edge.partition_point(|(s, _)| *s <= low);
        let last = of_edge.partition_point(|(s, _)| *s < high).max(first);
        of_edge[first..last].iter().map(|(_, t)| *t)
    };
    let mut found = Vec::with_capacity(runs.len());
    for r in runs {
        let (ea, eb) = (&edges[r.a], &edges[r.b]);
        let opposite = |from: &Edge<'_>, t: f64, to: &Edge<'_>| to.foot(&Point3::from(from.lift(t)[0])).t;
        let mut cuts: Vec<(f64, f64)> = within(r.a, r.on_a).map(|t| (t, opposite(ea, t, eb))).collect();
        cuts.extend(within(r.b, r.on_b).map(|t| (opposite(eb, t, ea), t)));
        cuts.sort_by(|x, y| x.0.total_cmp(&y.0));
        cuts.dedup_by(|later, earlier| {
            ea.arc_length(later.0) - ea.arc_length(earlier.0) <= 2.0 * tolerance_mm
        });
        cuts.insert(0, (r.on_a[0], r.on_b[0]));
        cuts.push((r.on_a[1], r.on_b[1]));
        found.extend(cuts.windows(2).map(|w| Run { on_a: [w[0].0, w[1].0], on_b: [w[0].1, w[1].1], ..*r }));
    }
    found
}
