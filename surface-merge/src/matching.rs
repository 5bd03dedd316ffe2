//! Which edges run along each other, and where.

use claymill_nurbs::{Aabb, Point3, bisect};
use rayon::prelude::*;

use crate::chord_tree::{Chord, ChordTree};
use crate::edge::Edge;
use crate::tolerance::{ALONG_DEG, OVERSHOOT_MM, RUN_END_SHARE};

/// Two edges that run along each other somewhere, seen from the shorter one (`a`).
#[derive(Debug)]
pub(crate) struct Pair {
    pub(crate) a: usize,
    pub(crate) b: usize,
    /// Along `a`, in order: its stations, and the points opposite the ends of `b`.
    pub(crate) points: Vec<Opposite>,
}

/// A point of edge `a` with its nearest point on edge `b`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Opposite {
    pub(crate) ta: f64,
    pub(crate) tb: f64,
    pub(crate) gap_mm: f64,
    /// The edges are parallel here, and `b` does not end before this point.
    pub(crate) along: bool,
}

/// A stretch on which two edges stay within the tolerance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run {
    pub(crate) a: usize,
    pub(crate) b: usize,
    pub(crate) on_a: [f64; 2],
    /// Opposite `on_a[0]` and `on_a[1]`: decreasing when the edges run against each other.
    pub(crate) on_b: [f64; 2],
}

/// All pairs of edges that come within `radius_mm` of each other side by side.
pub(crate) fn pairs(edges: &[Edge<'_>], radius_mm: f64) -> Vec<Pair> {
    let tree = ChordTree::new(edges);
    (0..edges.len())
        .into_par_iter()
        .flat_map_iter(|i| {
            let near = neighbours(edges, &tree, i, radius_mm);
            near.into_iter().map(move |j| (i, j))
        })
        .map(|(i, j)| {
            let (a, b) = if edges[j].length_mm() < edges[i].length_mm() { (j, i) } else { (i, j) };
            profile(edges, a, b, radius_mm)
        })
        .filter(|pair| pair.points.iter().any(|o| o.along && o.gap_mm <= radius_mm))
        .collect()
}

/// Edges after `i` with a chord beside one of its chords.
fn neighbours(edges: &[Edge<'_>], tree: &ChordTree, i: usize, radius_mm: f64) -> Vec<usize> {
    let mut near = Vec::new();
    let edge = &edges[i];
    for w in edge.stations.windows(2) {
        let chord = Chord { edge: i, a: w[0].point, b: w[1].point };
        let reach = radius_mm + edge.sagitta_mm;
        tree.touching(&Aabb::of([&chord.a, &chord.b]).inflated(reach), |other| {
            if other.edge > i && side_by_side(&chord, other, reach + edges[other.edge].sagitta_mm) {
                near.push(other.edge);
            }
        });
    }
    near.sort_unstable();
    near.dedup();
    near
}

/// Whether two chords are nearly parallel, near, and overlap along their direction. Chords that only touch
/// end to end do not: a straight continuation across a vertex is no neighbour.
fn side_by_side(p: &Chord, q: &Chord, reach_mm: f64) -> bool {
    // Each chord may turn by CHORD_TURN against its curve, twice, on top of the angle allowed.
    const COS_LARGEST_ANGLE: f64 = 0.8;
    const SMALLEST_OVERLAP: f64 = 0.001;
    let (dp, dq) = (p.b - p.a, q.b - q.a);
    let (lp, lq) = (dp.norm(), dq.norm());
    if lp == 0.0 || lq == 0.0 || dp.dot(&dq).abs() < COS_LARGEST_ANGLE * lp * lq {
        return false;
    }
    let u = dp / lp;
    let (x0, x1) = ((q.a - p.a).dot(&u), (q.b - p.a).dot(&u));
    let (from, to) = (x0.min(x1).max(0.0), x0.max(x1).min(lp));
    let allowance = reach_mm.min(SMALLEST_OVERLAP * lp.min(lq));
    if to - from < allowance {
        return false;
    }
    // Distance in the middle of the overlap.
    let on_p = p.a + u * (0.5 * (from + to));
    let share = (0.5 * (from + to) - x0) / (x1 - x0);
    let spread = 0.5 * (to - from) * (1.0 - COS_LARGEST_ANGLE * COS_LARGEST_ANGLE).sqrt();
    (q.a + dq * share - on_p).norm() <= reach_mm + spread
}

fn profile(edges: &[Edge<'_>], a: usize, b: usize, radius_mm: f64) -> Pair {
    let (ea, eb) = (&edges[a], &edges[b]);
    let mut params: Vec<f64> = ea.stations.iter().map(|s| s.t).collect();
    for end in [eb.stations[0].point, eb.stations[eb.stations.len() - 1].point] {
        let foot = ea.foot(&end);
        if (foot.point - end).norm() <= radius_mm {
            params.push(foot.t);
        }
    }
    params.sort_by(f64::total_cmp);
    params.dedup();
    let points = params.into_iter().map(|t| opposite(ea, eb, t)).collect();
    Pair { a, b, points }
}

fn opposite(ea: &Edge<'_>, eb: &Edge<'_>, ta: f64) -> Opposite {
    let [p, velocity, _] = ea.lift(ta);
    let foot = eb.foot(&Point3::from(p));
    let gap = foot.point.coords - p;
    let (la, lb) = (velocity.norm(), foot.velocity.norm());
    let parallel = velocity.dot(&foot.velocity).abs() >= ALONG_DEG.to_radians().cos() * la * lb;
    // Beside the edge the gap is across it; past its end the gap points along it.
    let overshoot = gap.dot(&foot.velocity).abs() / lb;
    let beside = overshoot <= OVERSHOOT_MM + gap.norm() * ALONG_DEG.to_radians().sin();
    Opposite { ta, tb: foot.t, gap_mm: gap.norm(), along: parallel && beside }
}

/// The stretches of a pair that stay within `tolerance_mm`.
pub(crate) fn runs(edges: &[Edge<'_>], pair: &Pair, tolerance_mm: f64) -> Vec<Run> {
    let good = |o: &Opposite| o.along && o.gap_mm <= tolerance_mm;
    let (ea, eb) = (&edges[pair.a], &edges[pair.b]);
    let mut found = Vec::new();
    let mut i = 0;
    while i < pair.points.len() {
        if !good(&pair.points[i]) {
            i += 1;
            continue;
        }
        let first = i;
        let mut heading = 0.0;
        while i + 1 < pair.points.len() && good(&pair.points[i + 1]) {
            // A run along b goes one way; where it turns back, another run begins.
            let step = pair.points[i + 1].tb - pair.points[i].tb;
            if step * heading < 0.0 {
                break;
            }
            if step != 0.0 {
                heading = step;
            }
            i += 1;
        }
        if i > first {
            let at_end_of_b = |o: &Opposite| {
                let (t0, t1) = eb.ends();
                (o.tb - t0).min(t1 - o.tb) <= RUN_END_SHARE * (t1 - t0)
            };
            let refine = |inside: usize, outside: Option<usize>| match outside {
                // Where b ends the run ends: that point was put into the profile exactly.
                Some(outside) if !good(&pair.points[outside]) && !at_end_of_b(&pair.points[inside]) => {
                    run_end(ea, eb, pair.points[inside], pair.points[outside].ta, good)
                }
                _ => pair.points[inside],
            };
            let start = refine(first, first.checked_sub(1));
            let end = refine(i, (i + 1 < pair.points.len()).then_some(i + 1));
            found.extend(long_enough(pair, ea, eb, &start, &end, tolerance_mm));
        }
        i += 1;
    }
    found
}

/// The last good point between a good one and a parameter that is not, by bisection.
fn run_end(
    ea: &Edge<'_>,
    eb: &Edge<'_>,
    mut inside: Opposite,
    outside: f64,
    good: impl Fn(&Opposite) -> bool,
) -> Opposite {
    let (t0, t1) = ea.ends();
    bisect(inside.ta, outside, RUN_END_SHARE * (t1 - t0), |t| {
        let middle = opposite(ea, eb, t);
        let is_good = good(&middle);
        if is_good {
            inside = middle;
        }
        is_good
    });
    inside
}

/// Snaps the ends of a run to the ends of its edges and drops runs that are mere touches.
fn long_enough(
    pair: &Pair,
    ea: &Edge<'_>,
    eb: &Edge<'_>,
    start: &Opposite,
    end: &Opposite,
    tolerance_mm: f64,
) -> Option<Run> {
    let snap = |edge: &Edge<'_>, t: f64| {
        let (t0, t1) = edge.ends();
        let s = edge.arc_length(t);
        let near = tolerance_mm.min(0.1 * edge.length_mm());
        match (s <= near, edge.length_mm() - s <= near) {
            (true, _) => t0,
            (_, true) => t1,
            _ => t,
        }
    };
    let run = Run {
        a: pair.a,
        b: pair.b,
        on_a: [snap(ea, start.ta), snap(ea, end.ta)],
        on_b: [snap(eb, start.tb), snap(eb, end.tb)],
    };
    let length = |edge: &Edge<'_>, on: [f64; 2]| (edge.arc_length(on[1]) - edge.arc_length(on[0])).abs();
    let (la, lb) = (length(ea, run.on_a), length(eb, run.on_b));
    let touch = tolerance_mm.min(0.2 * ea.length_mm());
    // Both sides must cover about the same length, or the edges only fan out from a common point.
    let alike = la.min(lb) >= 0.8 * la.max(lb) - tolerance_mm;
    (la.min(lb) > touch && alike).then_some(run)
}
