//! Defects of one surface.

use claymill_nurbs::{Domain, Face, FaceId, NurbsSurface, Point3, Vector3};

use super::loops::length_mm;
use super::{Defect, DefectCode, GAP_MM, HIGHEST_DEGREE, SMALLEST_RADIUS_MM, TINY_FACE_MM};

/// Places looked at in one direction of one polynomial piece, and in all pieces.
const PER_SPAN: usize = 4;
const MOST_PLACES: usize = 64;
/// Neighbouring normals that differ by more than this belong to a fold, degrees.
const FOLD_DEG: f64 = 100.0;
/// Halvings that tell a fold from a tight radius.
const HALVINGS: usize = 16;

pub(super) fn of(id: FaceId, face: &Face, area_mm2: f64) -> Vec<Defect> {
    let surface = &face.surface;
    let (us, vs) = (places(surface.knots_u().breaks()), places(surface.knots_v().breaks()));
    let mut found = Vec::new();
    let mut add = |code, at, size| found.push(Defect { code, faces: vec![id], at, size });
    let ((u0, u1), (v0, v1)) = surface.domain();
    let middle = surface.point(0.5 * (u0 + u1), 0.5 * (v0 + v1));
    let degree = surface.knots_u().degree().max(surface.knots_v().degree());
    if degree > HIGHEST_DEGREE {
        add(DefectCode::HighDegree, middle, degree as f64);
    }
    for (at, size) in close_knots(surface) {
        add(DefectCode::CloseKnots, at, size);
    }
    for (at, size) in collapsed_sides(surface) {
        add(DefectCode::Degenerate, at, size);
    }
    let around: f64 =
        face.boundary().iter().flat_map(|l| &l.edges).map(|e| length_mm(surface, &e.pcurve)).sum();
    // Width of the rectangle with this area and boundary.
    let half = 0.25 * around;
    let width = half - (half * half - area_mm2).max(0.0).sqrt();
    if width < TINY_FACE_MM {
        let start = face.boundary().first().and_then(|l| l.edges.first().map(|e| e.pcurve.start()));
        let at = start.map_or(middle, |p| surface.point(p.x, p.y));
        add(DefectCode::TinyFace, at, width);
    }
    let domain = Domain::new(face);
    let mut tightest = (f64::INFINITY, middle);
    let mut turn = (0.0_f64, middle);
    let mut before: Vec<Option<(Vector3, f64)>> = vec![None; vs.len()];
    for &u in &us {
        let mut last = None;
        for (k, &v) in vs.iter().enumerate() {
            if !domain.contains(u, v) {
                (last, before[k]) = (None, None);
                continue;
            }
            let jet = surface.jet(u, v);
            let normal = jet.normal();
            if let Some(n) = normal {
                let beside = last.map(|(m, v): (Vector3, f64)| (m, [u, v]));
                let behind = before[k].map(|(m, u)| (m, [u, v]));
                for (other, from) in [beside, behind].into_iter().flatten() {
                    if n.angle(&other).to_degrees() > FOLD_DEG {
                        let sharpest = sharpest(surface, from, [u, v]);
                        turn = if sharpest.0 > turn.0 { sharpest } else { turn };
                    }
                }
                if let Some((low, high)) = jet.curvature(&n).principal() {
                    let radius = 1.0 / low.abs().max(high.abs());
                    if radius < tightest.0 {
                        tightest = (radius, jet.p);
                    }
                }
            }
            (last, before[k]) = (normal.map(|n| (n, v)), normal.map(|n| (n, u)));
        }
    }
    if turn.0 > FOLD_DEG {
        add(DefectCode::Folded, turn.1, turn.0);
    }
    if tightest.0 < SMALLEST_RADIUS_MM {
        add(DefectCode::SmallRadius, tightest.1, tightest.0);
    }
    found
}

/// The turn of the normal, degrees, that is left when the way between two places is halved again and again: a tight
/// radius loses its turn, a fold keeps it.
fn sharpest(surface: &NurbsSurface, mut from: [f64; 2], mut to: [f64; 2]) -> (f64, Point3) {
    let normal = |at: [f64; 2]| surface.jet(at[0], at[1]).normal();
    let turn = |a: [f64; 2], b: [f64; 2]| match (normal(a), normal(b)) {
        (Some(m), Some(n)) => m.angle(&n).to_degrees(),
        _ => 0.0,
    };
    for _ in 0..HALVINGS {
        let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
        if turn(from, middle) > turn(middle, to) {
            to = middle;
        } else {
            from = middle;
        }
    }
    (turn(from, to), surface.point(from[0], from[1]))
}

/// Places inside of the polynomial pieces: at their ends parametrisations may vanish.
fn places(breaks: Vec<f64>) -> Vec<f64> {
    let per_span = (MOST_PLACES / (breaks.len() - 1)).clamp(1, PER_SPAN);
    let stride = (breaks.len() - 1).div_ceil(MOST_PLACES);
    let inside = |w: &[f64]| {
        let (a, b) = (w[0], w[1]);
        (0..per_span).map(move |i| a + (b - a) * (i as f64 + 0.5) / per_span as f64).collect::<Vec<_>>()
    };
    breaks.windows(2).step_by(stride).flat_map(inside).collect()
}

/// Spans narrower than the limit everywhere along their middle.
fn close_knots(surface: &NurbsSurface) -> Vec<(Point3, f64)> {
    let mut found = Vec::new();
    let ((u0, u1), (v0, v1)) = surface.domain();
    let across = |low: f64, high: f64| [0.05, 0.35, 0.65, 0.95].map(|x| low + (high - low) * x);
    let mut check = |width: &dyn Fn(f64) -> f64, at: &dyn Fn(f64) -> Point3, others: [f64; 4]| {
        let (wide, place) = others
            .into_iter()
            .map(|t| (width(t), t))
            .fold((0.0, others[0]), |m, w| if w.0 > m.0 { w } else { m });
        if wide < GAP_MM {
            found.push((at(place), wide));
        }
    };
    for w in surface.knots_u().breaks().windows(2) {
        let width = |v: f64| (surface.point(w[1], v) - surface.point(w[0], v)).norm();
        check(&width, &|v| surface.point(w[0], v), across(v0, v1));
    }
    for w in surface.knots_v().breaks().windows(2) {
        let width = |u: f64| (surface.point(u, w[1]) - surface.point(u, w[0])).norm();
        check(&width, &|u| surface.point(u, w[0]), across(u0, u1));
    }
    found
}

/// Sides of the net that are points.
fn collapsed_sides(surface: &NurbsSurface) -> Vec<(Point3, f64)> {
    let (rows, columns) = surface.size();
    let row = |i: usize| (0..columns).map(|j| surface.control_point(i, j)).collect::<Vec<_>>();
    let column = |j: usize| (0..rows).map(|i| surface.control_point(i, j)).collect::<Vec<_>>();
    let sides = [row(0), row(rows - 1), column(0), column(columns - 1)];
    let length = |side: &[Point3]| side.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>();
    sides.iter().map(|s| (s[0], length(s))).filter(|s| s.1 < GAP_MM).collect()
}
