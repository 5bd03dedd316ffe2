//! The patch under a face, cut from its carrier, and the closed trim loops on it.

use claymill_nurbs::{Curve2, KnotVector, NurbsSurface, Point2, TrimEdge, TrimLoop, turn_by_nesting};

use super::carrier::{Carrier, Range};
use super::closing::close;
use super::fit::Fitter;
use super::layout::{LaidLoop, Path, lay};
use super::{ChartError, EdgeUse, Limits};
use crate::trim::widest_gap_mm;

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
    let mut loops: Vec<TrimLoop> = loops?.into_iter().filter(|l| !l.edges.is_empty()).collect();
    turn_by_nesting(&mut loops);
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
        let mm = self.limits.mm_per_unit;
        let around: f64 = edges.iter().map(|e| self.length(&e.pcurve)).sum();
        let widest = self.limits.misfit.max(widest_gap_mm(around * mm) / mm);
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
                if length > widest {
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
