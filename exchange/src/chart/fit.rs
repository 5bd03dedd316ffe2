//! Pcurves for traced edges: a straight line where that is near enough, else Hermite cubics through exact
//! feet with exact tangents, halved until they follow the foot of the edge.

use claymill_nurbs::{Curve2, Curve3, KnotVector, NurbsError, NurbsSurface, Point2, Vector2};

use super::carrier::Carrier;

/// Intervals of a trace are halved this often at most.
const MOST_HALVINGS: usize = 12;
/// Pieces of one curve before it is refined no further: sound curves have a few dozen.
const MOST_PIECES: usize = 500;

/// What is needed to fit on one face.
pub(crate) struct Fitter<'a> {
    pub(crate) carrier: &'a Carrier,
    pub(crate) patch: &'a NurbsSurface,
    /// Largest distance in space between the pcurve and the foot of the edge.
    pub(crate) tolerance: f64,
    /// Points closer than this are one point.
    pub(crate) same: f64,
}

/// A knot of the fit.
#[derive(Clone, Copy)]
struct Node {
    t: f64,
    uv: Point2,
}

/// One cubic piece on `[a.t, b.t]`.
struct Piece {
    a: Node,
    b: Node,
    /// Derivatives with respect to `t` at both ends.
    slopes: [Vector2; 2],
}

impl Piece {
    fn control(&self) -> [Point2; 4] {
        let third = (self.b.t - self.a.t) / 3.0;
        let [s, e] = self.slopes;
        [self.a.uv, self.a.uv + s * third, self.b.uv - e * third, self.b.uv]
    }

    fn at(&self, fraction: f64) -> Point2 {
        let (x, y) = (1.0 - fraction, fraction);
        let [a, b, c, d] = self.control().map(|p| p.coords);
        Point2::from(a * (x * x * x) + b * (3.0 * x * x * y) + c * (3.0 * x * y * y) + d * (y * y * y))
    }
}

impl Fitter<'_> {
    /// The pcurve of `curve`, whose feet are given in order.
    pub(crate) fn pcurve(&self, curve: &Curve3, feet: &[(f64, Point2)]) -> Result<Curve2, NurbsError> {
        let (first, last) = (feet[0].1, feet[feet.len() - 1].1);
        if self.is_straight(curve, feet) {
            return Ok(Curve2::line(first, last));
        }
        let mut pieces = Vec::new();
        for w in feet.windows(2) {
            let node = |(t, uv): (f64, Point2)| Node { t, uv };
            self.halve(curve, node(w[0]), node(w[1]), MOST_HALVINGS, &mut pieces);
        }
        assemble(&pieces)
    }

    fn foot(&self, curve: &Curve3, t: f64, near: Point2) -> Point2 {
        self.carrier.foot(&curve.point(t), Some(near), self.same).uv
    }

    fn distance(&self, a: Point2, b: Point2) -> f64 {
        (self.patch.point(a.x, a.y) - self.patch.point(b.x, b.y)).norm()
    }

    /// Whether the chord from first to last foot passes all feet, and feet between them, in order.
    fn is_straight(&self, curve: &Curve3, feet: &[(f64, Point2)]) -> bool {
        let (first, last) = (feet[0].1, feet[feet.len() - 1].1);
        let chord = last - first;
        let passes = |uv: Point2| {
            let j = self.patch.jet(uv.x, uv.y);
            // Nearest point of the chord in the metric of the surface at the foot.
            let (lift, back) =
                (j.su * chord.x + j.sv * chord.y, j.su * (uv.x - first.x) + j.sv * (uv.y - first.y));
            let fraction = if lift.norm_squared() > 0.0 {
                back.dot(&lift) / lift.norm_squared()
            } else {
                chord.dot(&(uv - first)) / chord.norm_squared().max(f64::MIN_POSITIVE)
            };
            let on_chord = first + chord * fraction.clamp(0.0, 1.0);
            self.distance(on_chord, uv) <= 0.5 * self.tolerance
        };
        feet.iter().all(|f| passes(f.1))
            && feet.windows(2).all(|w| {
                let near = nalgebra::center(&w[0].1, &w[1].1);
                passes(self.foot(curve, 0.5 * (w[0].0 + w[1].0), near))
            })
    }

    fn halve(&self, curve: &Curve3, a: Node, b: Node, halvings: usize, pieces: &mut Vec<Piece>) {
        let secant = (b.uv - a.uv) / (b.t - a.t);
        let inward = 1e-9 * (b.t - a.t);
        let slopes = [
            self.slope(curve, a.uv, a.t + inward).unwrap_or(secant),
            self.slope(curve, b.uv, b.t - inward).unwrap_or(secant),
        ];
        let piece = Piece { a, b, slopes };
        let check = |fraction: f64| {
            let guess = piece.at(fraction);
            let t = a.t + fraction * (b.t - a.t);
            self.distance(guess, self.foot(curve, t, guess)) <= self.tolerance
        };
        if halvings == 0 || pieces.len() > MOST_PIECES || [0.5, 0.25, 0.75].into_iter().all(check) {
            pieces.push(piece);
            return;
        }
        let t = 0.5 * (a.t + b.t);
        let near = nalgebra::center(&a.uv, &b.uv);
        let middle = Node { t, uv: self.foot(curve, t, near) };
        self.halve(curve, a, middle, halvings - 1, pieces);
        self.halve(curve, middle, b, halvings - 1, pieces);
    }

    /// Derivative of the foot's parameters along the edge; `None` at poles.
    fn slope(&self, curve: &Curve3, uv: Point2, t: f64) -> Option<Vector2> {
        let jet = self.patch.jet(uv.x, uv.y);
        jet.normal()?;
        let slope = jet.tangent_coordinates(&curve.derivatives(t)[1])?;
        // Next to a pole the parameters run away; the secant serves there.
        let ((u0, u1), (v0, v1)) = self.patch.domain();
        let (low, high) = curve.domain();
        let sane = slope.x.abs() * (high - low) <= 100.0 * (u1 - u0)
            && slope.y.abs() * (high - low) <= 100.0 * (v1 - v0);
        sane.then_some(slope)
    }
}

/// Slopes that differ by less than this part are one: the joint is smooth.
const SAME_SLOPE: f64 = 1e-6;

/// One cubic B-spline: double knots where pieces join smoothly, triple ones at kinks.
fn assemble(pieces: &[Piece]) -> Result<Curve2, NurbsError> {
    let (mut knots, mut points) = (Vec::new(), Vec::new());
    for (i, piece) in pieces.iter().enumerate() {
        let control = piece.control();
        let smooth = i > 0 && {
            let (before, after) = (pieces[i - 1].slopes[1], piece.slopes[0]);
            (before - after).norm() <= SAME_SLOPE * before.norm().max(after.norm())
        };
        match (i, smooth) {
            (0, _) => {
                knots.extend([piece.a.t; 4]);
                points.push(control[0]);
            }
            (_, true) => {
                points.pop();
                knots.extend([piece.a.t; 2]);
            }
            (_, false) => knots.extend([piece.a.t; 3]),
        }
        points.extend(&control[1..]);
    }
    knots.extend(pieces.last().map_or([0.0; 4], |p| [p.b.t; 4]));
    Curve2::new(KnotVector::new(3, knots)?, points, None)
}
