//! Plane cubic splines as polynomials between their knots: evaluated far more often than they are made.

use claymill_nurbs::{Curve2, Vector2};

/// A plane curve, polynomial of the third degree between its breaks.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Cubics {
    /// Ascending; one more than there are pieces.
    breaks: Vec<f64>,
    /// Factors of the powers of the parameter since the piece began.
    pieces: Vec<[Vector2; 4]>,
}

impl Cubics {
    /// The pieces of a cubic without weights; `None` of another curve.
    pub(crate) fn new(curve: &Curve2) -> Option<Self> {
        if curve.weights().is_some() || curve.knots().degree() != 3 {
            return None;
        }
        let breaks = curve.knots().breaks();
        // From control points of the piece alone, a very short one would have no digits of its derivatives left.
        let of_piece = |ends: &[f64]| {
            let half = 0.5 * (ends[1] - ends[0]);
            let [p, first, second] = curve.derivatives(ends[0]);
            let [_, _, halfway] = curve.derivatives(ends[0] + half);
            [p, first, second * 0.5, (halfway - second) / (6.0 * half)]
        };
        let pieces = breaks.windows(2).map(of_piece).collect();
        Some(Cubics { breaks, pieces })
    }

    pub(crate) fn domain(&self) -> (f64, f64) {
        (self.breaks[0], self.breaks[self.breaks.len() - 1])
    }

    #[cfg(test)]
    pub(crate) fn breaks(&self) -> &[f64] {
        &self.breaks
    }

    /// The point at a parameter; beyond the ends the first and the last piece go on.
    pub(crate) fn point(&self, t: f64) -> Vector2 {
        let ([a, b, c, d], x) = self.piece(t);
        a + (b + (c + d * x) * x) * x
    }

    /// The point, and the first and second derivative.
    pub(crate) fn derivatives(&self, t: f64) -> [Vector2; 3] {
        let ([a, b, c, d], x) = self.piece(t);
        [a + (b + (c + d * x) * x) * x, b + (c * 2.0 + d * (3.0 * x)) * x, c * 2.0 + d * (6.0 * x)]
    }

    fn piece(&self, t: f64) -> (&[Vector2; 4], f64) {
        let index = self.breaks.partition_point(|&b| b <= t).clamp(1, self.pieces.len()) - 1;
        (&self.pieces[index], t - self.breaks[index])
    }
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::{KnotVector, Point2};

    use super::*;

    #[test]
    fn pieces_are_the_curve() {
        // A double knot and a very short stretch, as drive curves have them.
        let knots = [[1.0; 4], [2.0, 2.0, 3.5, 3.5 + 1e-6], [9.0; 4]].concat();
        let points = (0..8).map(|k| Point2::new(f64::from(k), (f64::from(k) * 1.7).sin())).collect();
        let curve = Curve2::new(KnotVector::new(3, knots).unwrap(), points, None).unwrap();
        let cubics = Cubics::new(&curve).unwrap();
        assert_eq!(cubics.domain(), (1.0, 9.0));
        for t in (0..=400).map(|k| 0.9 + 8.2 * f64::from(k) / 400.0).chain([2.0, 3.5, 3.500_000_5]) {
            for (ours, exact) in cubics.derivatives(t).into_iter().zip(curve.derivatives(t)) {
                assert!(
                    (ours - exact).norm() < 1e-9 * (1.0 + exact.norm()),
                    "{ours} instead of {exact} at {t}"
                );
            }
            assert_eq!(cubics.point(t), cubics.derivatives(t)[0]);
        }
    }

    #[test]
    fn other_curves_have_no_cubic_pieces() {
        let line = |weights| {
            let knots = KnotVector::new(1, vec![0.0, 0.0, 1.0, 1.0]).unwrap();
            Curve2::new(knots, vec![Point2::origin(), Point2::new(1.0, 0.0)], weights).unwrap()
        };
        assert!(Cubics::new(&line(None)).is_none());
        assert!(Cubics::new(&line(Some(vec![1.0, 2.0]))).is_none());
    }
}
