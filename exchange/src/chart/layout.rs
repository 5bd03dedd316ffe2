//! Laying the edges of a loop out in the parameter plane of their carrier.
//!
//! On a periodic carrier each point has many parameters. An edge is followed without jumps, the next edge is
//! shifted by whole periods to where the last one ended, and at poles, where one parameter is free, it is
//! chosen so that the loop closes.

use claymill_nurbs::{Curve2, Curve3, Point2, Point3};
use nalgebra::Vector2;

use super::carrier::{Carrier, Foot, Quadric};
use super::{ChartError, EdgeUse, Limits};
use crate::along::{parameter_near, samples};
use crate::subcurve::mapped;

/// Legs whose places are apart by a period are a seam's to within this share of it.
const SAME_LINE: f64 = 1e-4;

/// A piece of a laid-out loop.
#[derive(Debug, Clone)]
pub(crate) struct Leg {
    /// The EDGE_CURVE.
    pub(crate) edge: Option<u64>,
    pub(crate) path: Path,
    /// Whether the start and the end are poles, per direction.
    free: [[bool; 2]; 2],
}

/// A curve in the parameter plane, finished or still to be fitted.
#[derive(Debug, Clone)]
pub(crate) enum Path {
    /// As it will be.
    Exact(Curve2),
    /// The foot of a space curve on the carrier.
    Traced { curve: Curve3, feet: Vec<(f64, Point2)> },
}

impl Path {
    pub(crate) fn start(&self) -> Point2 {
        match self {
            Path::Exact(curve) => curve.start(),
            Path::Traced { feet, .. } => feet[0].1,
        }
    }

    pub(crate) fn end(&self) -> Point2 {
        match self {
            Path::Exact(curve) => curve.end(),
            Path::Traced { feet, .. } => feet[feet.len() - 1].1,
        }
    }

    /// Points along the path, ends included.
    pub(crate) fn points(&self) -> Vec<Point2> {
        match self {
            Path::Exact(curve) => {
                let per_span = if curve.knots().degree() == 1 { 1 } else { 8 };
                samples(curve, per_span).into_iter().map(|t| curve.point(t)).collect()
            }
            Path::Traced { feet, .. } => feet.iter().map(|f| f.1).collect(),
        }
    }

    pub(crate) fn shift(&mut self, by: Vector2<f64>) {
        if by == Vector2::zeros() {
            return;
        }
        match self {
            Path::Exact(curve) => {
                if let Ok(moved) = mapped(curve, |p| p + by) {
                    *curve = moved;
                }
            }
            Path::Traced { feet, .. } => feet.iter_mut().for_each(|f| f.1 += by),
        }
    }
}

impl Leg {
    fn reverse(&mut self) {
        self.free.reverse();
        match &mut self.path {
            Path::Exact(curve) => *curve = curve.reversed(),
            Path::Traced { curve, feet } => {
                let (low, high) = curve.domain();
                *curve = curve.reversed();
                feet.reverse();
                feet.iter_mut().for_each(|f| f.0 = low + high - f.0);
            }
        }
    }

    /// A straight leg that is no edge of the file.
    pub(crate) fn straight(from: Point2, to: Point2) -> Self {
        Leg { edge: None, path: Path::Exact(Curve2::line(from, to)), free: [[false; 2]; 2] }
    }
}

/// A loop in the parameter plane.
#[derive(Debug, Clone)]
pub(crate) struct LaidLoop {
    pub(crate) legs: Vec<Leg>,
    /// How many periods the end lies from the start.
    pub(crate) winding: Vector2<f64>,
}

impl LaidLoop {
    pub(crate) fn polygon(&self) -> Vec<Point2> {
        self.legs.iter().flat_map(|leg| leg.path.points()).collect()
    }

    pub(crate) fn reverse(&mut self) {
        self.legs.reverse();
        self.legs.iter_mut().for_each(Leg::reverse);
        self.winding = -self.winding;
    }

    pub(crate) fn shift(&mut self, by: Vector2<f64>) {
        self.legs.iter_mut().for_each(|leg| leg.path.shift(by));
    }

    /// Whether two of its legs run in opposite directions over one line of the carrier, a period apart.
    pub(crate) fn follows_a_seam(&self, periods: [Option<f64>; 2]) -> bool {
        let apart = |d: usize, from: Point2, to: Point2| {
            periods[d].is_some_and(|period| {
                let mut away = to - from;
                away[d] = (away[d].abs() - period).abs();
                away.amax() <= SAME_LINE * period
            })
        };
        let middle = |leg: &Leg| {
            let points = leg.path.points();
            nalgebra::center(&points[(points.len() - 1) / 2], &points[points.len() / 2])
        };
        let opposite = |a: &Leg, b: &Leg| {
            (0..2).any(|d| {
                apart(d, a.path.start(), b.path.end())
                    && apart(d, a.path.end(), b.path.start())
                    && apart(d, middle(a), middle(b))
            })
        };
        let legs = &self.legs;
        legs.iter().enumerate().any(|(i, a)| legs[i + 1..].iter().any(|b| opposite(a, b)))
    }
}

/// Area inside the polygon, positive when it runs anticlockwise.
pub(crate) fn signed_area(polygon: &[Point2]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(a, b)| 0.5 * (a.x * b.y - a.y * b.x)).sum()
}

/// Lays out one loop. `sense` says whether the face's outside is the carrier's.
pub(crate) fn lay(
    carrier: &Carrier,
    uses: &[EdgeUse],
    sense: bool,
    limits: &Limits,
) -> Result<LaidLoop, ChartError> {
    let mut legs: Vec<Leg> = Vec::with_capacity(uses.len());
    for edge_use in uses {
        let before = legs.last().map(|leg| (leg.path.end(), leg.free[1]));
        legs.push(leg(carrier, edge_use, before, limits)?);
    }
    let mut laid = LaidLoop { legs, winding: Vector2::zeros() };
    for d in 0..2 {
        if let Some(period) = carrier.periods()[d] {
            close_at_poles(&mut laid, d, period, sense);
        }
    }
    Ok(laid)
}

/// Measures the winding, and lets a pole take up what it can.
fn close_at_poles(laid: &mut LaidLoop, d: usize, period: f64, sense: bool) {
    let legs = &mut laid.legs;
    let count = legs.len();
    let (Some(first), Some(last)) = (legs.first(), legs.last()) else {
        return;
    };
    let winding = ((last.path.end()[d] - first.path.start()[d]) / period).round();
    let wraps_at_pole = last.free[1][d] && first.free[0][d];
    let inner_pole = (1..count).find(|&k| legs[k - 1].free[1][d] && legs[k].free[0][d]);
    let mut shift_from = |k: usize, periods: f64| {
        let mut by = Vector2::zeros();
        by[d] = periods * period;
        legs[k..].iter_mut().for_each(|leg| leg.path.shift(by));
    };
    match (inner_pole, wraps_at_pole) {
        (Some(k), false) if winding != 0.0 => shift_from(k, -winding),
        (None, true) => {}
        (Some(k), true) => {
            // From pole to pole and back along one meridian: the face goes all round.
            let area = signed_area(&laid.polygon());
            let extent = laid.polygon().iter().fold(0.0_f64, |m, p| m.max(p[1 - d].abs()));
            if area.abs() <= 1e-6 * period * extent {
                let legs = &mut laid.legs;
                let up = legs[0].path.end()[1 - d] > legs[0].path.start()[1 - d];
                // Up at the far side and down at the near one is anticlockwise in (u, v).
                let away = if up == (sense == (d == 0)) { -1.0 } else { 1.0 };
                let mut by = Vector2::zeros();
                by[d] = away * period;
                legs[k..].iter_mut().for_each(|leg| leg.path.shift(by));
            }
        }
        _ => laid.winding[d] = winding,
    }
}

/// Lays out one edge so that it starts as near as can be to the end of the one before.
fn leg(
    carrier: &Carrier,
    edge_use: &EdgeUse,
    before: Option<(Point2, [bool; 2])>,
    limits: &Limits,
) -> Result<Leg, ChartError> {
    let near = before.map(|b| b.0);
    if let Carrier::Quadric { frame, quadric } = carrier
        && *quadric == Quadric::Plane
    {
        let away = edge_use.curve.points().iter().map(|p| frame.local(p).z.abs());
        off_surface(edge_use, away.fold(0.0, f64::max), limits)?;
        let flat = mapped(&edge_use.curve, |p| frame.local(p).xy());
        return Ok(Leg { edge: edge_use.edge, path: Path::Exact(flat?), free: [[false; 2]; 2] });
    }
    let mut leg = match file_pcurve(carrier, edge_use, near, limits) {
        Some(curve) => exact_leg(carrier, edge_use, curve, limits),
        None => traced_leg(carrier, edge_use, limits)?,
    };
    if let Some((near, _)) = before {
        let foot = Foot { uv: leg.path.start(), distance: 0.0, free: [false, false] };
        let shift = foot.towards(Some(near), carrier.periods()).uv - foot.uv;
        leg.path.shift(shift);
    }
    Ok(leg)
}

/// The file's own pcurve on this surface, where it agrees with the edge in space; of two (a seam) the one
/// that starts nearer to `near`.
fn file_pcurve(
    carrier: &Carrier,
    edge_use: &EdgeUse,
    near: Option<Point2>,
    limits: &Limits,
) -> Option<Curve2> {
    let Carrier::Spline(chart) = carrier else {
        return None;
    };
    let surface = chart.surface();
    let away = |p: &Point3| (edge_use.curve.point(parameter_near(&edge_use.curve, p)) - p).norm();
    let agrees = |curve: &Curve2| {
        let (space, flat) = (edge_use.curve.domain(), curve.domain());
        samples(curve, 8).into_iter().all(|t| {
            let c = curve.point(t);
            let p = surface.point(c.x, c.y);
            let fraction = (t - flat.0) / (flat.1 - flat.0);
            let q = edge_use.curve.point(space.0 + fraction * (space.1 - space.0));
            (p - q).norm() <= limits.same || away(&p) <= limits.same
        })
    };
    let distance = |c: &Curve2| near.map_or(0.0, |near| (c.start() - near).norm());
    let candidates = edge_use.flats.iter().filter(|c| agrees(c)).cloned();
    let nearest = candidates.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    // The ends must be the edge's ends, not only points somewhere on the edge.
    let c = nearest.start();
    ((surface.point(c.x, c.y) - edge_use.curve.start()).norm() <= limits.same).then_some(nearest)
}

fn exact_leg(carrier: &Carrier, edge_use: &EdgeUse, curve: Curve2, limits: &Limits) -> Leg {
    let poles = (0..2).any(|d| carrier.pole(d, false).is_some() || carrier.pole(d, true).is_some());
    let free = if poles {
        let at = |p, uv| carrier.foot(&p, Some(uv), limits.fit).free;
        [at(edge_use.curve.start(), curve.start()), at(edge_use.curve.end(), curve.end())]
    } else {
        [[false; 2]; 2]
    };
    Leg { edge: edge_use.edge, path: Path::Exact(curve), free }
}

/// A jump of more than this part of a period between neighbouring samples asks for one in between.
const LONGEST_STEP: f64 = 0.2;

/// Follows the edge on the carrier, from its middle to both ends so that a pole at an end is approached.
fn traced_leg(carrier: &Carrier, edge_use: &EdgeUse, limits: &Limits) -> Result<Leg, ChartError> {
    let curve = &edge_use.curve;
    let spans = curve.knots().breaks().len() - 1;
    let parameters = samples(curve, if spans < 3 { 8 } else { 4 });
    let middle = parameters.len() / 2;
    let foot = |t: f64, near| carrier.foot(&curve.point(t), near, limits.fit);
    let centre = (parameters[middle], foot(parameters[middle], None));
    let mut feet = vec![centre];
    for t in parameters[..middle].iter().rev() {
        advance(carrier, &foot, &mut feet, *t, FINEST_STEP);
    }
    feet.reverse();
    for t in &parameters[middle + 1..] {
        advance(carrier, &foot, &mut feet, *t, FINEST_STEP);
    }
    let away = feet.iter().map(|(_, foot)| foot.distance);
    off_surface(edge_use, away.fold(0.0, f64::max), limits)?;
    Ok(Leg {
        edge: edge_use.edge,
        free: [feet[0].1.free, feet[feet.len() - 1].1.free],
        path: Path::Traced {
            curve: curve.clone(),
            feet: feet.into_iter().map(|(t, foot)| (t, foot.uv)).collect(),
        },
    })
}

/// Refuses an edge that is `away` from its surface.
fn off_surface(edge_use: &EdgeUse, away: f64, limits: &Limits) -> Result<(), ChartError> {
    if away <= limits.misfit {
        return Ok(());
    }
    Err(ChartError::Edge {
        edge: edge_use.edge,
        what: format!("the edge lies {:.3} mm off its surface", away * limits.mm_per_unit),
    })
}

/// Steps are halved this often at most.
const FINEST_STEP: usize = 6;

/// Adds the foot at parameter `to`, and feet before it when the step is long.
fn advance(
    carrier: &Carrier,
    foot: &impl Fn(f64, Option<Point2>) -> Foot,
    feet: &mut Vec<(f64, Foot)>,
    to: f64,
    halvings: usize,
) {
    let (from, last) = feet[feet.len() - 1];
    let next = foot(to, Some(last.uv));
    let periods = carrier.periods();
    let long = |d: usize| periods[d].is_some_and(|p| (next.uv[d] - last.uv[d]).abs() > LONGEST_STEP * p);
    if halvings > 0 && (long(0) || long(1)) {
        advance(carrier, foot, feet, 0.5 * (from + to), halvings - 1);
        advance(carrier, foot, feet, to, halvings - 1);
    } else {
        feet.push((to, next));
    }
}
