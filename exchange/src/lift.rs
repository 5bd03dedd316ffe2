//! Curves in a surface's parameter plane as curves in space.

use claymill_nurbs::{Curve2, Curve3, KnotVector, NurbsError, NurbsSurface, Point3, Vector3};

/// The lifted curve keeps this close to the surface's own, mm.
const LIFTED_MM: f64 = 1e-5;
/// Halvings of one knot span before refining is given up.
const DEEPEST: u32 = 12;

/// Position and derivative at a parameter.
#[derive(Clone, Copy)]
struct Station {
    t: f64,
    point: Vector3,
    slope: Vector3,
}

/// `S(c(t))` as a cubic with the parameter of `c`, exact in position and slope at its knots.
pub(crate) fn lifted(surface: &NurbsSurface, pcurve: &Curve2) -> Result<Curve3, NurbsError> {
    let at = |t: f64| {
        let [point, slope, _] = surface.lift(pcurve, t);
        Station { t, point, slope }
    };
    let breaks = pcurve.knots().breaks();
    let mut pieces = Vec::new();
    for span in breaks.windows(2) {
        // The slopes are the span's own: kinks of the pcurve stay kinks.
        let inset = 1e-9 * (span[1] - span[0]);
        let ends = [span[0] + inset, span[1] - inset].map(at);
        let a = Station { t: span[0], point: at(span[0]).point, ..ends[0] };
        let b = Station { t: span[1], point: at(span[1]).point, ..ends[1] };
        refine(&at, a, b, DEEPEST, &mut pieces);
    }
    let mut knots = Vec::new();
    let mut points = Vec::new();
    for [a, b] in &pieces {
        let third = (b.t - a.t) / 3.0;
        knots.extend([a.t; 3]);
        points.extend([a.point, a.point + a.slope * third, b.point - b.slope * third]);
    }
    if let (Some([first, _]), Some([_, last])) = (pieces.first(), pieces.last()) {
        points.push(last.point);
        knots.insert(0, first.t);
        knots.extend([last.t; 4]);
    }
    Curve3::new(KnotVector::new(3, knots)?, points.into_iter().map(Point3::from).collect(), None)
}

fn refine(at: &impl Fn(f64) -> Station, a: Station, b: Station, depth: u32, pieces: &mut Vec<[Station; 2]>) {
    let h = b.t - a.t;
    let hermite = |x: f64| {
        let y = 1.0 - x;
        let (p1, p2) = (a.point + a.slope * (h / 3.0), b.point - b.slope * (h / 3.0));
        a.point * (y * y * y) + p1 * (3.0 * y * y * x) + p2 * (3.0 * y * x * x) + b.point * (x * x * x)
    };
    let follows = |x: &f64| (hermite(*x) - at(a.t + x * h).point).norm() <= LIFTED_MM;
    if depth == 0 || [0.25, 0.5, 0.75].iter().all(follows) {
        pieces.push([a, b]);
        return;
    }
    let middle = at(a.t + 0.5 * h);
    refine(at, a, middle, depth - 1, pieces);
    refine(at, middle, b, depth - 1, pieces);
}
