//! Defects of edges and trim loops.

use claymill_nurbs::{Curve2, Face, FaceId, NurbsSurface, Point2};

use super::{Defect, DefectCode, GAP_MM};

/// Chords of one polynomial piece.
const CHORDS: usize = 8;
/// Chords of all loops of a face beyond this are compared more coarsely.
const MOST_CHORDS: usize = 20_000;
/// A loop comes this near to itself at corners and seams without crossing, in parts of the domain.
const TOUCH: f64 = 1e-6;

pub(super) fn of(id: FaceId, face: &Face) -> Vec<Defect> {
    let mut found = Vec::new();
    for edge in face.loops.iter().flat_map(|l| &l.edges) {
        let length = length_mm(&face.surface, &edge.pcurve);
        // Sides that collapse are the surface's defect, not the edge's.
        if length < GAP_MM && length > 1e-3 * GAP_MM {
            let at = edge.pcurve.start();
            let at = face.surface.point(at.x, at.y);
            found.push(Defect { code: DefectCode::TinyEdge, faces: vec![id], at, size: length });
        }
    }
    if let Some(at) = crossing(face) {
        let at = face.surface.point(at.x, at.y);
        found.push(Defect { code: DefectCode::CrossingLoop, faces: vec![id], at, size: 0.0 });
    }
    found
}

fn parameters(curve: &Curve2, per_span: usize) -> Vec<f64> {
    let breaks = curve.knots().breaks();
    let per_span = if curve.knots().degree() == 1 { 1 } else { per_span };
    let inner = breaks
        .windows(2)
        .flat_map(|w| (0..per_span).map(move |i| w[0] + (w[1] - w[0]) * i as f64 / per_span as f64));
    inner.chain(breaks.last().copied()).collect()
}

pub(super) fn length_mm(surface: &NurbsSurface, curve: &Curve2) -> f64 {
    let breaks = curve.knots().breaks();
    let along = breaks
        .windows(2)
        .flat_map(|w| (0..CHORDS).map(move |i| w[0] + (w[1] - w[0]) * i as f64 / CHORDS as f64));
    let points: Vec<_> = along.chain(breaks.last().copied()).map(|t| surface.point_on(curve, t)).collect();
    points.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
}

/// A chord of a loop.
struct Chord {
    a: Point2,
    b: Point2,
    /// Loop, and place in it.
    place: (usize, usize),
}

/// Where two chords of the loops cross that are not neighbours.
fn crossing(face: &Face) -> Option<Point2> {
    let ((u0, u1), (v0, v1)) = face.surface.domain();
    let spans: usize =
        face.loops.iter().flat_map(|l| &l.edges).map(|e| e.pcurve.knots().breaks().len()).sum();
    let per_span = (MOST_CHORDS / spans.max(1)).clamp(1, CHORDS);
    let mut chords = Vec::new();
    let mut counts = Vec::new();
    for (l, trim) in face.loops.iter().enumerate() {
        let mut ring: Vec<Point2> = Vec::new();
        for edge in &trim.edges {
            let points = parameters(&edge.pcurve, per_span).into_iter().map(|t| edge.pcurve.point(t));
            // The domain is the unit square here.
            ring.extend(points.map(|p| Point2::new((p.x - u0) / (u1 - u0), (p.y - v0) / (v1 - v0))));
        }
        ring.dedup_by(|b, a| (*b - *a).norm() <= TOUCH);
        let count = ring.len();
        counts.push(count);
        for k in 0..count {
            chords.push(Chord { a: ring[k], b: ring[(k + 1) % count], place: (l, k) });
        }
    }
    chords.sort_by(|x, y| x.a.x.min(x.b.x).total_cmp(&y.a.x.min(y.b.x)));
    for (i, x) in chords.iter().enumerate() {
        let right = x.a.x.max(x.b.x);
        for y in chords[i + 1..].iter().take_while(|y| y.a.x.min(y.b.x) <= right) {
            let apart = y.a.y.max(y.b.y) < x.a.y.min(x.b.y) || y.a.y.min(y.b.y) > x.a.y.max(x.b.y);
            if apart || neighbours(x, y, counts[x.place.0]) {
                continue;
            }
            if let Some(at) = meet(x, y) {
                return Some(Point2::new(u0 + (u1 - u0) * at.x, v0 + (v1 - v0) * at.y));
            }
        }
    }
    None
}

fn neighbours(x: &Chord, y: &Chord, count: usize) -> bool {
    let apart = x.place.1.abs_diff(y.place.1);
    x.place.0 == y.place.0 && (apart <= 1 || apart + 1 >= count)
}

/// Where two chords cross well inside of both.
fn meet(x: &Chord, y: &Chord) -> Option<Point2> {
    let (d, e, f) = (x.b - x.a, y.b - y.a, y.a - x.a);
    let cross = d.perp(&e);
    let (s, t) = (f.perp(&e) / cross, f.perp(&d) / cross);
    let inside = |s: f64, length: f64| s * length > TOUCH && (1.0 - s) * length > TOUCH;
    // Seams run there and back on one line, edges that touch cross by rounding: both all but parallel.
    let steep = cross.abs() > 1e-3 * d.norm() * e.norm();
    (steep && inside(s, d.norm()) && inside(t, e.norm())).then(|| x.a + d * s)
}
