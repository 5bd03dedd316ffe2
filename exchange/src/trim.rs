//! From the edges that a file gives to closed trim loops in the parameter plane.
//!
//! A file gives an edge as a curve in space, as a curve in the parameter plane, or as both, and its word on
//! which of them to prefer means little. Here the pcurve is used when it agrees with the space curve,
//! otherwise the space curve is projected onto the surface.

use claymill_nurbs::{Curve2, Curve3, KnotVector, NurbsSurface, Point2, Point3, TrimEdge, TrimLoop};
use thiserror::Error;

use crate::along::parameter_near;
use crate::foot::Projector;

/// A pcurve agrees with its space curve within this (or the file's tolerance, if larger), mm.
const AGREE_MM: f64 = 0.01;
/// A space curve farther from its surface than this is no edge of it (or ten times the file's tolerance), mm.
const OFF_SURFACE_MM: f64 = 0.5;
/// Ends closer than this are moved together without a word, mm.
const SNAPPED_MM: f64 = 1e-4;
/// Points that miss the domain by no more than this are put on its side, mm.
const ROUNDING_MM: f64 = 1e-6;
/// Gaps up to this (or ten times the file's tolerance) are bridged and reported, mm.
pub(crate) const BRIDGED_MM: f64 = 0.5;
/// ... but never more than this part of the loop's length.
const BRIDGED_PART: f64 = 0.1;
/// Wider ones, up to this, mm, and this part of the loop's length, are closed rather than losing the face, and warned about.
const WIDE_MM: f64 = 5.0;
const WIDE_PART: f64 = 0.05;
/// Samples per knot span when curves are compared.
const SAMPLES: usize = 6;

/// One edge as the file gives it. The direction need not fit its neighbours.
#[derive(Debug, Clone, Default)]
pub(crate) struct RawEdge {
    /// The curve in space, mm.
    pub(crate) curve: Option<Curve3>,
    /// The curve in the parameter plane.
    pub(crate) pcurve: Option<Curve2>,
    /// Identity of the edge in the file's topology.
    pub(crate) shared: Option<u64>,
}

/// A loop that was made, and what had to be mended.
#[derive(Debug)]
pub(crate) struct Closed {
    pub(crate) trim: TrimLoop,
    /// Widest gap that was bridged, mm; 0 when there was none.
    pub(crate) bridged_mm: f64,
}

/// Why a loop could not be made.
#[derive(Debug, Clone, PartialEq, Error)]
pub(crate) enum TrimError {
    #[error("a trim loop has no edges")]
    Empty,
    #[error("a trim curve lies {distance_mm:.3} mm off its surface")]
    OffSurface { distance_mm: f64 },
    #[error("a trim loop does not close: gap {gap_mm:.3} mm")]
    Open { gap_mm: f64 },
    #[error("a trim curve cannot be projected onto its surface")]
    Projection,
    #[error("the trim loops enclose no area")]
    NoArea,
}

/// Makes trim loops on one surface.
#[derive(Debug)]
pub(crate) struct Trimmer<'a> {
    surface: &'a NurbsSurface,
    tolerance_mm: f64,
    projector: std::cell::OnceCell<Projector<'a>>,
    /// Largest millimetres per parameter unit, from the net.
    pace: [f64; 2],
}

impl<'a> Trimmer<'a> {
    /// `tolerance_mm` is what the file declares.
    pub(crate) fn new(surface: &'a NurbsSurface, tolerance_mm: f64) -> Self {
        Trimmer { surface, tolerance_mm, projector: std::cell::OnceCell::new(), pace: pace(surface) }
    }

    /// The closed loop through `edges`, which must be in order.
    pub(crate) fn closed(&self, edges: &[RawEdge]) -> Result<Closed, TrimError> {
        let mut chain = Vec::with_capacity(edges.len());
        for edge in edges {
            let pcurve = self.snapped_to_domain(self.pcurve(edge)?);
            if self.span_mm(&pcurve) > 0.0 {
                chain.push(TrimEdge { pcurve, shared: edge.shared });
            }
        }
        if chain.is_empty() {
            return Err(TrimError::Empty);
        }
        match self.in_order(&chain) {
            Some(ordered) => chain = ordered,
            None => self.direct(&mut chain),
        }
        self.close(chain)
    }

    /// The loop from curves of which the file does not say which pcurve belongs to which space curve.
    pub(crate) fn closed_from_sets(
        &self,
        curves: &[Curve3],
        pcurves: &[Curve2],
    ) -> Result<Closed, TrimError> {
        let paired = curves.len() == pcurves.len();
        let from_curves = |with: bool| -> Vec<RawEdge> {
            let edge = |(i, c): (usize, &Curve3)| RawEdge {
                curve: Some(c.clone()),
                pcurve: pcurves.get(i).filter(|_| with).cloned(),
                shared: None,
            };
            curves.iter().enumerate().map(edge).collect()
        };
        if paired {
            return self.closed(&from_curves(true));
        }
        let trusted = curves.is_empty() || pcurves.iter().all(|p| self.agrees(p, curves));
        if trusted && !pcurves.is_empty() {
            let edge = |p: &Curve2| RawEdge { pcurve: Some(p.clone()), ..RawEdge::default() };
            return self.closed(&pcurves.iter().map(edge).collect::<Vec<_>>());
        }
        self.closed(&from_curves(false))
    }

    fn pcurve(&self, edge: &RawEdge) -> Result<Curve2, TrimError> {
        match (&edge.curve, &edge.pcurve) {
            (None, None) => Err(TrimError::Empty),
            (None, Some(p)) => Ok(p.clone()),
            (Some(c), Some(p)) if self.agrees(p, std::slice::from_ref(c)) => Ok(p.clone()),
            (Some(c), _) => self.projected(c),
        }
    }

    fn projected(&self, curve: &Curve3) -> Result<Curve2, TrimError> {
        let projector = self.projector.get_or_init(|| Projector::new(self.surface));
        let limit = OFF_SURFACE_MM.max(10.0 * self.tolerance_mm);
        let projected = projector.curve(curve, limit).ok_or(TrimError::Projection)?;
        if projected.distance_mm > limit {
            let distance_mm = projected.distance_mm;
            return Err(TrimError::OffSurface { distance_mm });
        }
        Ok(projected.pcurve)
    }

    /// Whether every point of the lifted pcurve lies on one of `curves`.
    fn agrees(&self, pcurve: &Curve2, curves: &[Curve3]) -> bool {
        let tolerance = AGREE_MM.max(self.tolerance_mm);
        let (a, b) = pcurve.domain();
        let breaks = pcurve.knots().breaks();
        let samples = breaks
            .windows(2)
            .flat_map(|w| (0..SAMPLES).map(move |i| w[0] + (w[1] - w[0]) * i as f64 / SAMPLES as f64));
        samples.chain(std::iter::once(b)).all(|t| {
            let p = self.lifted(pcurve, t);
            // Most files run both curves at the same pace, forwards or backwards.
            let x = (t - a) / (b - a);
            let nearby = curves.iter().any(|c| {
                let (c0, c1) = c.domain();
                let at = |x: f64| (c.point(c0 + (c1 - c0) * x) - p).norm();
                at(x) <= tolerance || at(1.0 - x) <= tolerance
            });
            nearby || curves.iter().any(|c| (c.point(parameter_near(c, &p)) - p).norm() <= tolerance)
        })
    }

    fn lifted(&self, pcurve: &Curve2, t: f64) -> Point3 {
        let q = pcurve.point(t);
        self.surface.point(q.x, q.y)
    }

    fn gap_mm(&self, a: &Point2, b: &Point2) -> f64 {
        (self.surface.point(a.x, a.y) - self.surface.point(b.x, b.y)).norm()
    }

    /// Length of the control polygon at the surface's fastest pace: an upper bound of the length, mm.
    fn span_mm(&self, pcurve: &Curve2) -> f64 {
        let step = |w: &[Point2]| self.reach_mm(&w[0], &w[1]);
        pcurve.points().windows(2).map(step).sum()
    }

    /// Upper bound of the length of the straight pcurve from `a` to `b`, mm.
    fn reach_mm(&self, a: &Point2, b: &Point2) -> f64 {
        (a.x - b.x).abs() * self.pace[0] + (a.y - b.y).abs() * self.pace[1]
    }

    /// Puts control points that miss the domain by rounding onto its side.
    fn snapped_to_domain(&self, pcurve: Curve2) -> Curve2 {
        let ((u0, u1), (v0, v1)) = self.surface.domain();
        let snap = |x: f64, (low, high): (f64, f64), pace: f64| {
            let size = high - low;
            // Points inside stay where the file has them, but for rounding.
            let reach =
                |inside: bool| if inside { 1e-12 * size } else { (ROUNDING_MM / pace).min(1e-3 * size) };
            match x {
                x if (x - low).abs() <= reach(x > low) => low,
                x if (x - high).abs() <= reach(x < high) => high,
                x => x,
            }
        };
        let points = (pcurve.points().iter())
            .map(|p| Point2::new(snap(p.x, (u0, u1), self.pace[0]), snap(p.y, (v0, v1), self.pace[1])))
            .collect();
        let weights = pcurve.weights().map(<[f64]>::to_vec);
        Curve2::new(pcurve.knots().clone(), points, weights).unwrap_or(pcurve)
    }

    /// The edges in an order, and each in a direction, in which they meet in the parameter plane. On a surface that
    /// closes on itself many corners are one point, and writers order the edges there as it happens. `None` where they do
    /// not all meet.
    fn in_order(&self, chain: &[TrimEdge]) -> Option<Vec<TrimEdge>> {
        let near_mm = AGREE_MM.max(self.tolerance_mm);
        let mut left: Vec<TrimEdge> = chain[1..].to_vec();
        let mut ordered = vec![chain[0].clone()];
        while !left.is_empty() {
            let end = ordered[ordered.len() - 1].pcurve.end();
            let next = |e: &TrimEdge| {
                let [there, back] = [e.pcurve.start(), e.pcurve.end()].map(|p| self.reach_mm(&end, &p));
                (there.min(back), back < there)
            };
            let (at, (gap_mm, turned)) =
                (left.iter().map(next).enumerate()).min_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
            if gap_mm > near_mm {
                return None;
            }
            let mut edge = left.remove(at);
            if turned {
                edge.pcurve = edge.pcurve.reversed();
            }
            ordered.push(edge);
        }
        let gap_mm = self.reach_mm(&ordered[ordered.len() - 1].pcurve.end(), &chain[0].pcurve.start());
        (gap_mm <= near_mm).then_some(ordered)
    }

    /// Turns edges round where that brings ends together.
    fn direct(&self, chain: &mut [TrimEdge]) {
        let gap = |a: &TrimEdge, b: &TrimEdge| self.gap_mm(&a.pcurve.end(), &b.pcurve.start());
        let turned = |e: &TrimEdge| TrimEdge { pcurve: e.pcurve.reversed(), shared: e.shared };
        head_to_tail(chain, self.tolerance_mm.max(SNAPPED_MM), gap, turned);
    }

    /// Joins neighbouring ends: moves them together when they all but meet, bridges small gaps.
    fn close(&self, chain: Vec<TrimEdge>) -> Result<Closed, TrimError> {
        let length: f64 = chain.iter().map(|e| self.span_mm(&e.pcurve)).sum();
        let limit =
            BRIDGED_MM.max(10.0 * self.tolerance_mm).min(BRIDGED_PART * length).max(widest_gap_mm(length));
        let count = chain.len();
        let mut bridged_mm = 0.0_f64;
        let mut edges = chain;
        let mut bridges = Vec::new();
        for i in 0..count {
            let next = (i + 1) % count;
            let (a, b) = (edges[i].pcurve.end(), edges[next].pcurve.start());
            if a == b {
                continue;
            }
            let bridge = Curve2::line(a, b);
            let gap_mm = self.gap_mm(&a, &b);
            if self.reach_mm(&a, &b) <= SNAPPED_MM {
                let middle = nalgebra::center(&a, &b);
                let moved = move_end(&edges[i].pcurve, middle, End::Last).zip(move_end(
                    &edges[next].pcurve,
                    middle,
                    End::First,
                ));
                if let Some((end, start)) = moved {
                    if i == next {
                        edges[i].pcurve = move_end(&end, middle, End::First).unwrap_or(start);
                    } else {
                        edges[i].pcurve = end;
                        edges[next].pcurve = start;
                    }
                    continue;
                }
            }
            // The bridge may be long in the parameter plane where the surface collapses to a point.
            let length_mm = self.length_mm(&bridge);
            if length_mm > limit {
                return Err(TrimError::Open { gap_mm: gap_mm.max(length_mm) });
            }
            if length_mm > SNAPPED_MM {
                bridged_mm = bridged_mm.max(length_mm);
            }
            bridges.push((i, bridge));
        }
        for (i, pcurve) in bridges.into_iter().rev() {
            edges.insert(i + 1, TrimEdge { pcurve, shared: None });
        }
        Ok(Closed { trim: TrimLoop { edges }, bridged_mm })
    }

    /// Length of the lifted curve from chords, mm.
    fn length_mm(&self, pcurve: &Curve2) -> f64 {
        let (a, b) = pcurve.domain();
        let points: Vec<_> =
            (0..=16).map(|i| self.lifted(pcurve, a + (b - a) * f64::from(i) / 16.0)).collect();
        points.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
    }
}

/// Gaps wider than this in a loop of such a length, mm, cannot be what was meant.
pub(crate) fn widest_gap_mm(length_mm: f64) -> f64 {
    WIDE_MM.min(WIDE_PART * length_mm)
}

/// Turns edges round where that clearly, by more than `slack_mm`, brings the end of one and the start of the next together.
/// The ends of a circle are as near either way: then only the file knows which way it runs.
pub(crate) fn head_to_tail<E>(
    chain: &mut [E],
    slack_mm: f64,
    gap_mm: impl Fn(&E, &E) -> f64,
    turned: impl Fn(&E) -> E,
) {
    let [head, second, ..] = &*chain else { return };
    // The first edge's end must meet one end of the second.
    let nearest = |e: &E| gap_mm(e, second).min(gap_mm(e, &turned(second)));
    let first = turned(head);
    if nearest(&first) + slack_mm < nearest(head) {
        chain[0] = first;
    }
    for i in 1..chain.len() {
        let other = turned(&chain[i]);
        if gap_mm(&chain[i - 1], &other) + slack_mm < gap_mm(&chain[i - 1], &chain[i]) {
            chain[i] = other;
        }
    }
}

/// Which end of a curve.
#[derive(Clone, Copy)]
enum End {
    First,
    Last,
}

/// The curve with one end moved; `None` when the knots are not clamped there.
fn move_end(pcurve: &Curve2, to: Point2, end: End) -> Option<Curve2> {
    let knots = pcurve.knots();
    let (p, all) = (knots.degree(), knots.as_slice());
    let clamped = match end {
        End::First => all[0] == all[p],
        End::Last => all[all.len() - 1] == all[all.len() - 1 - p],
    };
    if !clamped {
        return None;
    }
    let mut points = pcurve.points().to_vec();
    match end {
        End::First => *points.first_mut()? = to,
        End::Last => *points.last_mut()? = to,
    }
    Curve2::new(knots.clone(), points, pcurve.weights().map(<[f64]>::to_vec)).ok()
}

/// Largest distance of neighbouring control points over their knot distance, in `u` and `v`: bounds `|Su|` and
/// `|Sv|` for polynomial surfaces and is near enough for rational ones.
pub(crate) fn pace(surface: &NurbsSurface) -> [f64; 2] {
    let (nu, nv) = surface.size();
    let speed = |knots: &KnotVector, i: usize, distance: f64| {
        let (p, all) = (knots.degree(), knots.as_slice());
        let width = all[i + p + 1] - all[i + 1];
        if width > 0.0 { p as f64 * distance / width } else { 0.0 }
    };
    let mut pace = [0.0_f64; 2];
    for i in 0..nu {
        for j in 0..nv {
            let p = surface.control_point(i, j);
            if i + 1 < nu {
                let d = (surface.control_point(i + 1, j) - p).norm();
                pace[0] = pace[0].max(speed(surface.knots_u(), i, d));
            }
            if j + 1 < nv {
                let d = (surface.control_point(i, j + 1) - p).norm();
                pace[1] = pace[1].max(speed(surface.knots_v(), j, d));
            }
        }
    }
    pace
}
