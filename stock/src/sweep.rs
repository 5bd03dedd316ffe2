//! A body that moves along a straight line without turning; curves as chords within a deviation.

use claymill_nurbs::{Curve3, Point3, Vector3};
use claymill_toolpath::Move;

use crate::grid::{FARTHEST_MM, unit};
use crate::{StockError, ToolBody};

/// A tool body on its way along a segment, its axis fixed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep<'a> {
    pub(crate) body: &'a ToolBody,
    pub(crate) axis: Vector3,
    pub(crate) from: Point3,
    pub(crate) to: Point3,
}

impl<'a> Sweep<'a> {
    /// From tip to tip, mm, with the unit vector that points from the tip to the spindle. Both tips may be the same.
    ///
    /// # Errors
    /// A direction that is no unit vector, and a coordinate that is no number or more than [`FARTHEST_MM`].
    pub fn new(body: &'a ToolBody, axis: Vector3, from: Point3, to: Point3) -> Result<Self, StockError> {
        for p in [&from, &to] {
            let reach_mm = p.iter().fold(0.0, |a: f64, c| if c.is_nan() { *c } else { a.max(c.abs()) });
            if reach_mm.is_nan() || p.iter().any(|c| c.is_nan()) {
                return Err(StockError::NotFinite("a tip"));
            }
            if reach_mm > FARTHEST_MM {
                return Err(StockError::TooFar { reach_mm });
            }
        }
        Ok(Sweep { body, axis: unit(&axis)?, from, to })
    }

    /// Length of the way, mm.
    #[must_use]
    pub fn length_mm(&self) -> f64 {
        (self.to - self.from).norm()
    }
}

/// Straight pieces in place of a curve.
///
/// ```text
///        ╭──·──╮          every point of the curve is within δ of its chord, and every point of the
///     ╭──┴─────┴──╮       chord within δ of the curve: a tool smaller by δ removes less, one larger
///     •           •       by δ touches more than the tool on the curve
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Chords {
    /// Their ends, on the curve, mm.
    pub points_mm: Vec<Point3>,
    /// Largest distance between curve and chords, mm.
    pub within_mm: f64,
}

/// Chords deviate by at least this much, mm: a quantum of the stock.
const LEAST_DEVIATION_MM: f64 = 1e-4;
/// Chords of one curve at most.
const MOST_CHORDS: usize = 1_000_000;

impl Chords {
    /// Halves the Bézier pieces of a curve of tips until their control points are within a distance of their chords: the
    /// curve lies in the hull of these, and what is within a distance of a chord is convex.
    ///
    /// # Errors
    /// A distance below 0.1 µm; a curve that is not finite; more than a million chords.
    pub fn of(curve: &Curve3, within_mm: f64) -> Result<Self, StockError> {
        if !(within_mm >= LEAST_DEVIATION_MM && within_mm.is_finite()) {
            let least = LEAST_DEVIATION_MM;
            return Err(StockError::Size { what: "a deviation of chords", mm: within_mm, least });
        }
        let mut points_mm = vec![curve.start()];
        for piece in curve.bezier_pieces() {
            let weights = piece.weights().map_or_else(|| vec![1.0; piece.points().len()], <[f64]>::to_vec);
            let net: Vec<_> = piece.points().iter().zip(&weights).map(|(p, w)| (p.coords * *w, *w)).collect();
            if net.iter().any(|(p, w)| !(p.norm().is_finite() && *w > 0.0)) {
                return Err(StockError::NotFinite("a control point"));
            }
            let mut waiting = vec![net];
            while let Some(net) = waiting.pop() {
                if deviation(&net) <= within_mm {
                    let (end, weight) = net[net.len() - 1];
                    points_mm.push((end / weight).into());
                    if points_mm.len() > MOST_CHORDS {
                        return Err(StockError::Chords(MOST_CHORDS));
                    }
                } else {
                    // Halving quarters the deviation: it ends long before this.
                    if waiting.len() > 60 {
                        return Err(StockError::Chords(MOST_CHORDS));
                    }
                    let [first, second] = halves(net);
                    waiting.extend([second, first]);
                }
            }
        }
        Ok(Chords { points_mm, within_mm })
    }

    /// The same of a move.
    ///
    /// # Errors
    /// The move is no curve; and as [`Chords::of`].
    pub fn of_move(m: &Move, within_mm: f64) -> Result<Self, StockError> {
        Chords::of(&m.curve().map_err(|_| StockError::NotFinite("a move"))?, within_mm)
    }

    /// A body along all chords.
    ///
    /// # Errors
    /// As [`Sweep::new`].
    pub fn sweeps<'a>(&self, body: &'a ToolBody, axis: Vector3) -> Result<Vec<Sweep<'a>>, StockError> {
        self.points_mm.windows(2).map(|p| Sweep::new(body, axis, p[0], p[1])).collect()
    }
}

/// Control points, multiplied by their weights.
type Net = Vec<(Vector3, f64)>;

/// Largest distance of a control point from the chord.
fn deviation(net: &Net) -> f64 {
    let place = |(p, w): &(Vector3, f64)| p / *w;
    let (from, to) = (place(&net[0]), place(&net[net.len() - 1]));
    let along = to - from;
    let square = along.norm_squared();
    let distance = |p: Vector3| {
        let share = if square > 0.0 { ((p - from).dot(&along) / square).clamp(0.0, 1.0) } else { 0.0 };
        (p - from - along * share).norm()
    };
    net.iter().map(|p| distance(place(p))).fold(0.0, f64::max)
}

/// De Casteljau's halves.
fn halves(mut net: Net) -> [Net; 2] {
    let (mut first, mut second) = (vec![net[0]], vec![net[net.len() - 1]]);
    while net.len() > 1 {
        net = net.windows(2).map(|p| ((p[0].0 + p[1].0) * 0.5, 0.5 * (p[0].1 + p[1].1))).collect();
        first.push(net[0]);
        second.push(net[net.len() - 1]);
    }
    second.reverse();
    [first, second]
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::KnotVector;

    use super::*;

    /// A quarter of a circle of radius 50 mm: the chord's height is `r(1 − cos(α/2))`.
    #[test]
    fn chords_of_a_circle_are_as_close_as_asked() {
        let points = [[50.0, 0.0, 1.0], [50.0, 50.0, 1.0], [0.0, 50.0, 1.0]].map(Point3::from).to_vec();
        let weights = Some(vec![1.0, 0.5f64.sqrt(), 1.0]);
        let curve = Curve3::new(KnotVector::clamped_uniform(2, 3), points, weights).unwrap();
        for within_mm in [1.0, 0.1, 0.01, 0.001] {
            let chords = Chords::of(&curve, within_mm).unwrap();
            let mut largest: f64 = 0.0;
            for p in chords.points_mm.windows(2) {
                assert!((p[0].xy().coords.norm() - 50.0).abs() < 1e-9);
                largest = largest.max(50.0 - middle(&p[0], &p[1]).xy().coords.norm());
            }
            assert!(largest <= within_mm && largest > 0.05 * within_mm, "{largest} {within_mm}");
        }
        assert!(Chords::of(&curve, 0.0).is_err() && Chords::of(&curve, f64::NAN).is_err());
        assert!(matches!(Chords::of(&curve, 1e-300), Err(StockError::Size { .. })));
    }

    fn middle(a: &Point3, b: &Point3) -> Point3 {
        a + (b - a) * 0.5
    }

    #[test]
    fn what_is_no_number_is_no_sweep() {
        let body = ToolBody { solids: Vec::new() };
        let o = Point3::origin();
        assert_eq!(Sweep::new(&body, Vector3::z() * 2.0, o, o), Err(StockError::Direction(2.0)));
        assert!(matches!(Sweep::new(&body, Vector3::zeros() / 0.0, o, o), Err(StockError::Direction(_))));
        for bad in [f64::NAN, f64::INFINITY] {
            for k in 0..3 {
                let mut p = o;
                p[k] = bad;
                assert!(Sweep::new(&body, Vector3::z(), o, p).is_err());
            }
        }
    }
}
