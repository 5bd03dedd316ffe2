//! The patch under a face, cut from its carrier, and the closed trim loops on it.

use claymill_nurbs::{Curve2, KnotVector, NurbsSurface, Point2, TrimEdge, TrimLoop};

use super::carrier::{Carrier, Range};
use super::closing::{close, contains};
use super::fit::Fitter;
use super::layout::{LaidLoop, Path, lay, signed_area};
use super::{ChartError, EdgeUse, Limits};
use crate::along::samples;

/// Points of loops are held against sides of others at most about so many times in a face.
const MOST_STEPS: u64 = 200_000_000;
/// Strips thinner than this part of a patch are not cut off.
const SLIVER: f64 = 1e-9;

/// A surface with its trim loops.
#[derive(Debug)]
pub(crate) struct Patch {
    pub(crate) surface: NurbsSurface,
    pub(crate) loops: Vec<TrimLoop>,
    /// Lengths of the gaps that were bridged.
    pub(crate) bridged: Vec<f64>,
}

/// Puts the loops `bounds` on `carrier`. `sense` says whether the face's outside is the carrier's, so that the
/// face lies to the left of its loops. With `uncut` the patch stays as large as the carrier is.
pub(crate) fn trimmed(
    carrier: &Carrier,
    bounds: &[Vec<EdgeUse>],
    sense: bool,
    uncut: bool,
    limits: &Limits,
) -> Result<Patch, ChartError> {
    let laid: Result<Vec<LaidLoop>, _> =
        bounds.iter().map(|uses| lay(carrier, uses, sense, limits)).collect();
    let wrong = |what: String| ChartError::Loops { what };
    let mut laid = close(carrier, laid?, sense).map_err(wrong)?;
    let range = match laid.is_empty() {
        true => carrier.whole().ok_or_else(|| wrong("it has no boundary".into()))?,
        false => at_home(carrier, &mut laid),
    };
    let patch = carrier.patch(&range)?;
    let fitter = Fitter { carrier, patch: &patch, tolerance: limits.fit, same: limits.same };
    let mut finish = Finish { fitter, limits, bridged: Vec::new() };
    let loops: Result<Vec<TrimLoop>, _> = laid.iter().map(|l| finish.trim_loop(l)).collect();
    let loops = oriented(loops?.into_iter().filter(|l| !l.edges.is_empty()).collect());
    let bridged = finish.bridged;
    let surface = if uncut { patch } else { cut_to(patch, &loops) };
    Ok(Patch { surface, loops, bridged })
}

/// Moves all loops together by whole periods to where the carrier begins; gives the range they cover.
fn at_home(carrier: &Carrier, laid: &mut [LaidLoop]) -> Range {
    let covered = |laid: &[LaidLoop]| {
        Range::of(laid.iter().flat_map(|l| &l.legs).flat_map(|leg| match &leg.path {
            // The hull is certain to hold the curve.
            Path::Exact(curve) => curve.points().to_vec(),
            traced @ Path::Traced { .. } => traced.points(),
        }))
    };
    let by = carrier.home_shift(&covered(laid));
    laid.iter_mut().for_each(|l| l.shift(by));
    covered(laid)
}

/// Turns laid-out loops into trim loops.
struct Finish<'a> {
    fitter: Fitter<'a>,
    limits: &'a Limits,
    /// Lengths of gaps that were bridged.
    bridged: Vec<f64>,
}

impl Finish<'_> {
    fn trim_loop(&mut self, laid: &LaidLoop) -> Result<TrimLoop, ChartError> {
        let mut edges = Vec::with_capacity(laid.legs.len() + 1);
        for leg in &laid.legs {
            let pcurve = match &leg.path {
                Path::Exact(curve) => curve.clone(),
                Path::Traced { curve, feet } => self.fitter.pcurve(curve, feet)?,
            };
            // A straight leg without length is only a joint.
            if leg.edge.is_some() || pcurve.start() != pcurve.end() {
                edges.push(TrimEdge { pcurve, shared: leg.edge });
            }
        }
        let mut closed: Vec<TrimEdge> = Vec::with_capacity(edges.len());
        let count = edges.len();
        for i in 0..count {
            let next = edges[(i + 1) % count].pcurve.start();
            let mut edge = edges[i].clone();
            let end = edge.pcurve.end();
            let snapped = self.is_joint(end, next).then(|| ending_at(&edge.pcurve, next)).flatten();
            let bridge = match snapped {
                Some(curve) => {
                    edge.pcurve = curve;
                    None
                }
                None => (end != next).then(|| Curve2::line(end, next)),
            };
            closed.push(edge);
            if let Some(pcurve) = bridge {
                let length = self.length(&pcurve);
                if length > self.limits.misfit {
                    let gap_mm = length * self.limits.mm_per_unit;
                    let what = format!("a trim loop does not close: gap {gap_mm:.3} mm");
                    return Err(ChartError::Loops { what });
                }
                if length > self.fitter.same {
                    self.bridged.push(length);
                }
                closed.push(TrimEdge { pcurve, shared: None });
            }
        }
        Ok(TrimLoop { edges: closed })
    }

    /// Whether two ends are one point, both in space and in parameters (at a pole only the former holds).
    fn is_joint(&self, a: Point2, b: Point2) -> bool {
        let s = self.fitter.patch;
        let ((u0, u1), (v0, v1)) = s.domain();
        let apart = (a.x - b.x).abs().max(0.0) > 1e-3 * (u1 - u0) || (a.y - b.y).abs() > 1e-3 * (v1 - v0);
        !apart && (s.point(a.x, a.y) - s.point(b.x, b.y)).norm() <= self.fitter.same
    }

    /// Length of a short pcurve in space.
    fn length(&self, pcurve: &Curve2) -> f64 {
        let s = self.fitter.patch;
        let on = |t: f64| {
            let c = pcurve.point(t);
            s.point(c.x, c.y)
        };
        (0..8).map(|i| (on(f64::from(i + 1) / 8.0) - on(f64::from(i) / 8.0)).norm()).sum()
    }
}

/// The curve with its last control point moved to `end`; `None` when that does not end the curve there.
fn ending_at(curve: &Curve2, end: Point2) -> Option<Curve2> {
    let knots = curve.knots().as_slice();
    if knots[knots.len() - 1] != knots[knots.len() - 1 - curve.knots().degree()] {
        return None;
    }
    let mut points = curve.points().to_vec();
    *points.last_mut()? = end;
    Curve2::new(curve.knots().clone(), points, curve.weights().map(<[f64]>::to_vec)).ok()
}

/// The part of a carrier over a range of its parameters, without trim loops.
pub(crate) fn rectangle(carrier: &Carrier, range: &Range) -> Result<NurbsSurface, ChartError> {
    Ok(cut(carrier.patch(range)?, range))
}

/// The patch without what lies outside of the loops' hull; parameters keep their meaning.
fn cut_to(patch: NurbsSurface, loops: &[TrimLoop]) -> NurbsSurface {
    let hull = loops.iter().flat_map(|l| &l.edges).flat_map(|e| e.pcurve.points().iter().copied());
    cut(patch, &Range::of(hull))
}

fn cut(mut patch: NurbsSurface, range: &Range) -> NurbsSurface {
    let (u, v) =
        (ends(patch.knots_u(), range.min.x, range.max.x), ends(patch.knots_v(), range.min.y, range.max.y));
    patch = patch.split_u(u.0).map_or(patch, |(_, above)| above);
    patch = patch.split_u(u.1).map_or(patch, |(below, _)| below);
    patch = patch.split_v(v.0).map_or(patch, |(_, above)| above);
    patch.split_v(v.1).map_or(patch, |(below, _)| below)
}

/// Where to cut for a range. Slivers stay: a cut next to a knot would leave an interval of rounding size.
fn ends(knots: &KnotVector, low: f64, high: f64) -> (f64, f64) {
    let (first, last) = knots.domain();
    let sliver = SLIVER * (last - first);
    let snapped = |at: f64| knots.breaks().into_iter().find(|k| (k - at).abs() <= sliver).unwrap_or(at);
    (snapped(low), snapped(high))
}

/// Gives loops at even depth (outer boundaries) an anticlockwise run and those at odd depth (holes) a clockwise
/// one, so that the winding number is 1 exactly inside.
fn oriented(mut loops: Vec<TrimLoop>) -> Vec<TrimLoop> {
    let polygons: Vec<Vec<Point2>> = loops.iter().map(polygon).collect();
    let boxes: Vec<Range> = polygons.iter().map(|p| Range::of(p.iter().copied())).collect();
    let meet = |i: usize, k: usize| {
        let (a, b) = (&boxes[i], &boxes[k]);
        (0..2).all(|d| a.min[d] <= b.max[d] && b.min[d] <= a.max[d])
    };
    let size = |i: usize, k: usize| polygons[i].len() as u64 * polygons[k].len() as u64;
    let count = polygons.len();
    let pairs = (0..count).flat_map(|i| (0..count).map(move |k| (i, k))).filter(|(i, k)| meet(*i, *k));
    let steps: u64 = pairs.map(|(i, k)| size(i, k)).sum();
    // Thousands of loops in one place: not every point of theirs is looked at.
    let stride = 1 + (steps / MOST_STEPS) as usize;
    for (i, l) in loops.iter_mut().enumerate() {
        let around = |k: &usize| *k != i && meet(i, *k) && within(&polygons[i], &polygons[*k], stride);
        let outer = (0..polygons.len()).filter(around).count() % 2 == 0;
        if (signed_area(&polygons[i]) > 0.0) != outer {
            l.edges.reverse();
            l.edges.iter_mut().for_each(|e| e.pcurve = e.pcurve.reversed());
        }
    }
    loops
}

/// Whether most of `inner` lies in `outer`: touching loops have points on both sides by rounding.
fn within(inner: &[Point2], outer: &[Point2], stride: usize) -> bool {
    let points = || inner.iter().step_by(stride);
    let inside = points().filter(|p| contains(outer, p)).count();
    2 * inside > points().count()
}

fn polygon(l: &TrimLoop) -> Vec<Point2> {
    let along = |e: &TrimEdge| {
        let per_span = if e.pcurve.knots().degree() == 1 { 1 } else { 8 };
        let mut points: Vec<Point2> =
            samples(&e.pcurve, per_span).into_iter().map(|t| e.pcurve.point(t)).collect();
        points.pop();
        points
    };
    l.edges.iter().flat_map(along).collect()
}
