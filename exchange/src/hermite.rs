//! Any smooth curve in space as a cubic that follows it within a tolerance.

use claymill_nurbs::{Curve3, KnotVector, NurbsError, Point3, Vector3};

/// Halvings of one piece before refining is given up.
const DEEPEST: u32 = 12;

/// Position and derivative at a parameter.
#[derive(Clone, Copy)]
struct Station {
    t: f64,
    point: Vector3,
    slope: Vector3,
}

/// The curve of which `at` gives position and derivative, as a cubic with the same parameter, exact in both at
/// its knots; also the largest distance met between the two. Kinks may lie at `breaks` only.
///
/// # Errors
/// `at` gave numbers that are not finite.
pub(crate) fn fitted(
    breaks: &[f64],
    tolerance: f64,
    at: impl Fn(f64) -> [Vector3; 2],
) -> Result<(Curve3, f64), NurbsError> {
    let station = |t: f64, inside: f64| Station { t, point: at(t)[0], slope: at(inside)[1] };
    let mut fit = Fit { at: &at, tolerance, pieces: Vec::new(), deviation: 0.0 };
    for span in breaks.windows(2) {
        // The slopes are the span's own: kinks stay kinks.
        let inset = 1e-9 * (span[1] - span[0]);
        fit.refine(station(span[0], span[0] + inset), station(span[1], span[1] - inset), DEEPEST);
    }
    let (mut knots, mut points) = (Vec::new(), Vec::new());
    for [a, b] in &fit.pieces {
        let third = (b.t - a.t) / 3.0;
        knots.extend([a.t; 3]);
        points.extend([a.point, a.point + a.slope * third, b.point - b.slope * third]);
    }
    if let (Some([first, _]), Some([_, last])) = (fit.pieces.first(), fit.pieces.last()) {
        points.push(last.point);
        knots.insert(0, first.t);
        knots.extend([last.t; 4]);
    }
    let points = points.into_iter().map(Point3::from).collect();
    Ok((Curve3::new(KnotVector::new(3, knots)?, points, None)?, fit.deviation))
}

struct Fit<'a, F> {
    at: &'a F,
    tolerance: f64,
    pieces: Vec<[Station; 2]>,
    deviation: f64,
}

impl<F: Fn(f64) -> [Vector3; 2]> Fit<'_, F> {
    fn refine(&mut self, a: Station, b: Station, depth: u32) {
        let h = b.t - a.t;
        let hermite = |x: f64| {
            let y = 1.0 - x;
            let (p1, p2) = (a.point + a.slope * (h / 3.0), b.point - b.slope * (h / 3.0));
            a.point * (y * y * y) + p1 * (3.0 * y * y * x) + p2 * (3.0 * y * x * x) + b.point * (x * x * x)
        };
        let away = |x: f64| (hermite(x) - (self.at)(a.t + x * h)[0]).norm();
        let off = [0.25, 0.5, 0.75].map(away).into_iter().fold(0.0, f64::max);
        let middle = 0.5 * (a.t + b.t);
        let [point, slope] = (self.at)(middle);
        // What is not finite does not become so by halving.
        if depth == 0 || off <= self.tolerance || !(off + point.norm() + slope.norm()).is_finite() {
            self.deviation = self.deviation.max(off);
            self.pieces.push([a, b]);
            return;
        }
        let middle = Station { t: middle, point, slope };
        self.refine(a, middle, depth - 1);
        self.refine(middle, b, depth - 1);
    }
}
