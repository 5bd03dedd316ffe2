//! NURBS curves in the plane and in space: evaluation, two derivatives by the quotient rule, Bézier
//! pieces.

use nalgebra::{Point, SVector};

use crate::insertion::{bezier_extraction, restrict, spans};
use crate::knots::for_degree;
use crate::tolerance::{EQUAL_WEIGHTS, LARGEST_COORDINATE_MM};
use crate::{KnotVector, NurbsError};

/// A NURBS curve in `D` dimensions: knots, control points and, when rational, weights.
#[derive(Debug, Clone, PartialEq)]
pub struct NurbsCurve<const D: usize> {
    knots: KnotVector,
    points: Vec<Point<f64, D>>,
    weights: Option<Vec<f64>>,
}

/// A curve in a surface's parameter plane (a pcurve).
pub type Curve2 = NurbsCurve<2>;
/// A curve in model space, mm.
pub type Curve3 = NurbsCurve<3>;

impl<const D: usize> NurbsCurve<D> {
    /// Checks and wraps the parts; weights that are all equal are dropped.
    ///
    /// # Errors
    /// Counts that do not fit, non-finite or absurd coordinates, non-positive weights.
    pub fn new(
        knots: KnotVector,
        points: Vec<Point<f64, D>>,
        weights: Option<Vec<f64>>,
    ) -> Result<Self, NurbsError> {
        if knots.point_count() != points.len() {
            let (knots, degree) = (knots.as_slice().len(), knots.degree());
            return Err(NurbsError::KnotCount { knots, points: points.len(), degree });
        }
        let bad = |p: &Point<f64, D>| p.iter().any(|c| !c.is_finite() || c.abs() > LARGEST_COORDINATE_MM);
        if let Some(index) = points.iter().position(bad) {
            return Err(NurbsError::NotFinite { what: "control point", index });
        }
        Ok(NurbsCurve { weights: check_weights(weights, points.len())?, knots, points })
    }

    /// Wraps parts that are known to be sound.
    pub(crate) fn from_sound(
        knots: KnotVector,
        points: Vec<Point<f64, D>>,
        weights: Option<Vec<f64>>,
    ) -> Self {
        debug_assert_eq!(knots.point_count(), points.len(), "control point count");
        NurbsCurve { knots, points, weights }
    }

    /// The straight segment from `a` at parameter 0 to `b` at parameter 1.
    #[must_use]
    pub fn line(a: Point<f64, D>, b: Point<f64, D>) -> Self {
        NurbsCurve { knots: KnotVector::clamped_uniform(1, 2), points: vec![a, b], weights: None }
    }

    /// The knot vector.
    #[must_use]
    pub fn knots(&self) -> &KnotVector {
        &self.knots
    }

    /// The control points (not multiplied by weights).
    #[must_use]
    pub fn points(&self) -> &[Point<f64, D>] {
        &self.points
    }

    /// The weights; `None` when all are equal.
    #[must_use]
    pub fn weights(&self) -> Option<&[f64]> {
        self.weights.as_deref()
    }

    /// First and last parameter.
    #[must_use]
    pub fn domain(&self) -> (f64, f64) {
        self.knots.domain()
    }

    /// The point at `t`.
    #[must_use]
    pub fn point(&self, t: f64) -> Point<f64, D> {
        for_degree!(self.knots.degree(), self.point_sized(t))
    }

    fn point_sized<const N: usize>(&self, t: f64) -> Point<f64, D> {
        let (first, values) = self.knots.values::<N>(t);
        let (mut sum, mut w) = (SVector::<f64, D>::zeros(), 0.0);
        for (i, value) in values[..=self.knots.degree()].iter().enumerate() {
            let b = value * self.weights.as_ref().map_or(1.0, |w| w[first + i]);
            sum += self.points[first + i].coords * b;
            w += b;
        }
        Point::from(if self.weights.is_some() { sum / w } else { sum })
    }

    /// Start point.
    #[must_use]
    pub fn start(&self) -> Point<f64, D> {
        self.point(self.domain().0)
    }

    /// End point.
    #[must_use]
    pub fn end(&self) -> Point<f64, D> {
        self.point(self.domain().1)
    }

    /// Position, first and second derivative at `t` (quotient rule; The NURBS Book, eq. 4.8).
    #[must_use]
    pub fn derivatives(&self, t: f64) -> [SVector<f64, D>; 3] {
        for_degree!(self.knots.degree(), self.derivatives_sized(t))
    }

    fn derivatives_sized<const N: usize>(&self, t: f64) -> [SVector<f64, D>; 3] {
        let basis = self.knots.basis::<N>(t);
        let count = self.knots.degree() + 1;
        let mut c = [SVector::<f64, D>::zeros(); 3];
        let mut w = [0.0; 3];
        for i in 0..count {
            let index = basis.first + i;
            let weight = self.weights.as_ref().map_or(1.0, |w| w[index]);
            for k in 0..3 {
                let b = basis.n[k][i] * weight;
                c[k] += self.points[index].coords * b;
                w[k] += b;
            }
        }
        if self.weights.is_none() {
            return c;
        }
        let p = c[0] / w[0];
        let d1 = (c[1] - p * w[1]) / w[0];
        let d2 = (c[2] - d1 * (2.0 * w[1]) - p * w[2]) / w[0];
        [p, d1, d2]
    }

    /// The curve cut at its distinct knots: Bézier curves of the same degree, each on its own stretch of the
    /// domain.
    #[must_use]
    pub fn bezier_pieces(&self) -> Vec<Self> {
        let (p, u) = (self.knots.degree(), self.knots.as_slice());
        let weight = |i: usize| self.weights.as_ref().map_or(1.0, |w| w[i]);
        spans(&self.knots)
            .map(|span| {
                let rows = bezier_extraction(&self.knots, span);
                let mut points = Vec::with_capacity(p + 1);
                let mut weights = Vec::with_capacity(p + 1);
                for row in rows.row_iter() {
                    let (mut sum, mut w) = (SVector::<f64, D>::zeros(), 0.0);
                    for (k, share) in row.iter().enumerate() {
                        let share = share * weight(span - p + k);
                        sum += self.points[span - p + k].coords * share;
                        w += share;
                    }
                    points.push(Point::from(sum / w));
                    weights.push(w);
                }
                let mut knots = vec![u[span]; p + 1];
                knots.extend(vec![u[span + 1]; p + 1]);
                let weights = self.weights.is_some().then_some(weights);
                NurbsCurve::from_sound(KnotVector::from_sound(p, knots), points, weights)
            })
            .collect()
    }

    /// The curve between two parameters, which it keeps: clamped at both, by knot insertion. What is beyond the domain is left out;
    /// `None` where nothing of it is between them.
    #[must_use]
    pub fn between(&self, from: f64, to: f64) -> Option<Self> {
        let (first, last) = self.domain();
        let range = (from.max(first), to.min(last));
        if from.is_nan() || to.is_nan() || range.0 >= range.1 {
            return None;
        }
        let weights = self.weights.clone().unwrap_or_else(|| vec![1.0; self.points.len()]);
        let weighted: Vec<_> = self.points.iter().zip(&weights).map(|(p, w)| p.coords * *w).collect();
        let weights: Vec<_> = weights.into_iter().map(SVector::<f64, 1>::new).collect();
        let (knots, weighted) = restrict(&self.knots, &weighted, 1, range);
        let (_, weights) = restrict(&self.knots, &weights, 1, range);
        let points = weighted.iter().zip(&weights).map(|(p, w)| Point::from(p / w.x)).collect();
        let weights = self.weights.is_some().then(|| weights.iter().map(|w| w.x).collect());
        Some(NurbsCurve::from_sound(knots, points, weights))
    }

    /// The same curve run backwards on the same domain.
    #[must_use]
    pub fn reversed(&self) -> Self {
        NurbsCurve {
            knots: self.knots.reversed(),
            points: self.points.iter().rev().copied().collect(),
            weights: self.weights.as_ref().map(|w| w.iter().rev().copied().collect()),
        }
    }
}

/// Refuses unusable weights; equal weights become `None`.
pub(crate) fn check_weights(
    weights: Option<Vec<f64>>,
    points: usize,
) -> Result<Option<Vec<f64>>, NurbsError> {
    let Some(weights) = weights else { return Ok(None) };
    if weights.len() != points {
        return Err(NurbsError::NetSize { needed: points, given: weights.len() });
    }
    if let Some(index) = weights.iter().position(|w| !w.is_finite() || *w <= 0.0) {
        return Err(NurbsError::Weight { index, value: weights[index] });
    }
    let equal = weights.iter().all(|w| (w - weights[0]).abs() <= EQUAL_WEIGHTS * weights[0]);
    Ok(if equal { None } else { Some(weights) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;

    #[test]
    fn bezier_pieces_are_the_curve() {
        let knots = KnotVector::new(3, vec![0.0, 0.0, 0.0, 0.1, 0.4, 0.4, 0.9, 1.0, 1.0, 1.2]).unwrap();
        let points: Vec<Point2<f64>> =
            (0..6).map(|i| Point2::new(f64::from(i), f64::from(i * i % 5))).collect();
        for weights in [None, Some(vec![1.0, 2.0, 0.5, 1.0, 3.0, 1.0])] {
            let curve = Curve2::new(knots.clone(), points.clone(), weights).unwrap();
            let pieces = curve.bezier_pieces();
            // The domain is [0.1, 0.9], with one knot inside.
            assert_eq!(pieces.len(), 2);
            for piece in &pieces {
                let (a, b) = piece.domain();
                for i in 0..=8 {
                    let t = a + (b - a) * (0.001 + 0.998 * f64::from(i) / 8.0);
                    approx::assert_relative_eq!(piece.point(t), curve.point(t), epsilon = 1e-12);
                }
            }
        }
    }

    #[test]
    fn what_is_between_two_parameters_is_the_curve() {
        let knots = KnotVector::new(3, vec![0.0, 0.0, 0.0, 0.1, 0.4, 0.4, 0.9, 1.0, 1.0, 1.2]).unwrap();
        let points: Vec<Point2<f64>> =
            (0..6).map(|i| Point2::new(f64::from(i), f64::from(i * i % 5))).collect();
        for weights in [None, Some(vec![1.0, 2.0, 0.5, 1.0, 3.0, 1.0])] {
            let curve = Curve2::new(knots.clone(), points.clone(), weights).unwrap();
            for (from, to, spans) in
                [(0.2, 0.3, 1), (0.1, 0.4, 1), (0.15, 0.7, 2), (0.4, 2.0, 1), (0.0, 1.0, 2)]
            {
                let part = curve.between(from, to).unwrap();
                let (a, b) = (f64::max(from, 0.1), f64::min(to, 0.9));
                assert_eq!(part.domain(), (a, b));
                assert_eq!(part.bezier_pieces().len(), spans);
                for i in 0..=8 {
                    let t = (a + (b - a) * f64::from(i) / 8.0).min(b);
                    approx::assert_relative_eq!(part.point(t), curve.point(t), epsilon = 1e-12);
                }
            }
            assert_eq!(curve.between(0.9, 1.0), None);
            assert_eq!(curve.between(0.5, 0.5), None);
            assert_eq!(curve.between(f64::NAN, 0.5), None);
        }
    }

    #[test]
    fn a_rational_quadratic_is_a_circle_with_its_curvature() {
        let s = std::f64::consts::FRAC_1_SQRT_2;
        let points = vec![Point2::new(5.0, 0.0), Point2::new(5.0, 5.0), Point2::new(0.0, 5.0)];
        let arc = Curve2::new(KnotVector::clamped_uniform(2, 3), points, Some(vec![1.0, s, 1.0])).unwrap();
        for i in 0..=20 {
            let [p, d1, d2] = arc.derivatives(f64::from(i) / 20.0);
            approx::assert_relative_eq!(p.norm(), 5.0, epsilon = 1e-14);
            let curvature = (d1.x * d2.y - d1.y * d2.x) / d1.norm().powi(3);
            approx::assert_relative_eq!(curvature, 0.2, epsilon = 1e-13);
        }
        let back = arc.reversed();
        approx::assert_relative_eq!(back.point(0.3), arc.point(0.7), epsilon = 1e-14);
    }
}
