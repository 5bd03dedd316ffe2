//! Curves brought to one degree and one set of breaks, exactly: each becomes a run of Bézier pieces.

use claymill_nurbs::{Curve3, KnotVector, NurbsError, NurbsSurface, Point3};
use nalgebra::Vector4;

use crate::subcurve::blossom;

/// Bézier pieces of one degree, joined end to end, in homogeneous coordinates.
#[derive(Debug, Clone)]
struct Run {
    degree: usize,
    breaks: Vec<f64>,
    /// The last point of a piece is the first of the next and stands once.
    net: Vec<Vector4<f64>>,
}

impl Run {
    /// `curve` over `breaks`, which hold all its own.
    fn new(curve: &Curve3, breaks: &[f64], degree: usize) -> Self {
        let own = curve.knots().degree();
        let mut net: Vec<Vector4<f64>> = Vec::new();
        for w in breaks.windows(2) {
            let span = curve.knots().span(0.5 * (w[0] + w[1]));
            let point = |j: usize| {
                let at: Vec<f64> = (0..own).map(|k| if k < own - j { w[0] } else { w[1] }).collect();
                let (p, weight) = blossom(curve, span, &at);
                p.push(weight)
            };
            let mut piece: Vec<_> = (0..=own).map(point).collect();
            for _ in own..degree {
                piece = elevated(&piece);
            }
            let joint = usize::from(!net.is_empty());
            net.extend(&piece[joint..]);
        }
        Run { degree, breaks: breaks.to_vec(), net }
    }

    fn knots(&self) -> Result<KnotVector, NurbsError> {
        let mut knots: Vec<f64> = self.breaks.iter().flat_map(|b| vec![*b; self.degree]).collect();
        if let (Some(first), Some(last)) = (self.breaks.first(), self.breaks.last()) {
            knots.insert(0, *first);
            knots.push(*last);
        }
        KnotVector::new(self.degree, knots)
    }
}

/// One degree more (The NURBS Book, eq. 5.36).
fn elevated(piece: &[Vector4<f64>]) -> Vec<Vector4<f64>> {
    let degree = piece.len();
    let share = |i: usize| i as f64 / degree as f64;
    let inner = |i: usize| piece[i - 1] * share(i) + piece[i] * (1.0 - share(i));
    let mut raised = vec![piece[0]];
    raised.extend((1..degree).map(inner));
    raised.push(piece[degree - 1]);
    raised
}

/// The curves one behind the other as one curve; the parameter runs on. The end of each is taken for the start
/// of the next. `None` for no curves.
pub(crate) fn chained(curves: &[Curve3]) -> Option<Result<Curve3, NurbsError>> {
    let (first, rest) = curves.split_first()?;
    if rest.is_empty() {
        return Some(Ok(first.clone()));
    }
    let degree = curves.iter().map(|c| c.knots().degree()).max()?;
    let mut whole = Run::new(first, &first.knots().breaks(), degree);
    for curve in rest {
        let mut next = Run::new(curve, &curve.knots().breaks(), degree);
        let shift = whole.breaks.last()? - next.breaks.first()?;
        let scale = whole.net.last()?.w / next.net.first()?.w;
        next.net.iter_mut().for_each(|h| *h *= scale);
        whole.breaks.extend(next.breaks[1..].iter().map(|b| b + shift));
        whole.net.extend(&next.net[1..]);
    }
    Some(whole.knots().and_then(|knots| {
        let (points, weights) = whole.net.iter().map(|h| (Point3::from(h.xyz() / h.w), h.w)).unzip();
        Curve3::new(knots, points, Some(weights))
    }))
}

/// The surface `(1 − v) · A(u) + v · B(u)` between two curves, both run over `[0, 1]`.
pub(crate) fn ruled(a: &Curve3, b: &Curve3) -> Result<NurbsSurface, NurbsError> {
    /// Breaks nearer than this are one, in parts of the domain.
    const SAME: f64 = 1e-12;
    let (a, b) = (over_unit(a)?, over_unit(b)?);
    let degree = a.knots().degree().max(b.knots().degree());
    let mut breaks = a.knots().breaks();
    breaks.extend(b.knots().breaks());
    breaks.sort_by(f64::total_cmp);
    breaks.dedup_by(|later, first| *later - *first <= SAME);
    let [a, b] = [a, b].map(|c| Run::new(&c, &breaks, degree));
    let pairs = || a.net.iter().zip(&b.net).flat_map(|(p, q)| [p, q]);
    NurbsSurface::new(
        a.knots()?,
        KnotVector::clamped_uniform(1, 2),
        pairs().map(|h| Point3::from(h.xyz() / h.w)).collect(),
        Some(pairs().map(|h| h.w).collect()),
    )
}

/// The curve with its parameter run over `[0, 1]`.
fn over_unit(curve: &Curve3) -> Result<Curve3, NurbsError> {
    let (low, high) = curve.domain();
    let knots = curve.knots().as_slice().iter().map(|k| (k - low) / (high - low)).collect();
    let knots = KnotVector::new(curve.knots().degree(), knots)?;
    Curve3::new(knots, curve.points().to_vec(), curve.weights().map(<[f64]>::to_vec))
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::Vector3;
    use claymill_nurbs::analytic::{Frame, circle_arc};

    fn arc() -> Curve3 {
        let frame = Frame::new(Point3::new(1.0, 0.0, 0.0), Vector3::z(), Vector3::x()).unwrap();
        circle_arc(&frame, 4.0, (0.0, 3.0)).unwrap()
    }

    fn cubic() -> Curve3 {
        let knots = KnotVector::new(3, vec![2., 2., 2., 2., 2.4, 5., 5., 5., 5.]).unwrap();
        let points = (0..5).map(|i| Point3::new(f64::from(i), f64::from(i * i % 3), 7.0));
        Curve3::new(knots, points.collect(), None).unwrap()
    }

    #[test]
    fn a_ruled_surface_joins_equal_parameters_of_unlike_curves() {
        let (a, b) = (arc(), cubic());
        let s = ruled(&a, &b).unwrap();
        for i in 0..=50 {
            let t = f64::from(i) / 50.0;
            let p = a.point(3.0 * t);
            let q = b.point(2.0 + 3.0 * t);
            approx::assert_abs_diff_eq!(s.point(t, 0.0), p, epsilon = 1e-12);
            approx::assert_abs_diff_eq!(s.point(t, 1.0), q, epsilon = 1e-12);
        }
    }

    #[test]
    fn a_chain_runs_through_all_its_parts() {
        let line = Curve3::line(arc().end(), Point3::new(9.0, 9.0, 9.0));
        let whole = chained(&[arc(), line.clone()]).unwrap().unwrap();
        assert_eq!(whole.domain(), (0.0, 4.0));
        for i in 0..=40 {
            let t = f64::from(i) / 10.0;
            let expected = if t <= 3.0 { arc().point(t) } else { line.point(t - 3.0) };
            approx::assert_abs_diff_eq!(whole.point(t), expected, epsilon = 1e-12);
        }
        assert!(chained(&[]).is_none());
    }
}
