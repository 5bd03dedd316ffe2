//! Exact cuts of surfaces and curves by knot insertion, Bézier extraction, and exchanged or
//! reversed parameters.

use nalgebra::{DMatrix, Point, SVector, Vector4};

use crate::insertion::{bezier_extraction, restrict, spans};
use crate::{KnotVector, NurbsCurve, NurbsSurface};

impl NurbsSurface {
    /// Cuts the surface at `u` into the pieces below and above, exactly (knot insertion, The NURBS Book
    /// A5.3); `None` when `u` is not strictly inside the domain. Both pieces keep their parameters and are
    /// clamped in `u`.
    #[must_use]
    pub fn split_u(&self, u: f64) -> Option<(NurbsSurface, NurbsSurface)> {
        let (u0, u1) = self.knots_u().domain();
        (u0 < u && u < u1).then(|| (self.restricted_u(u0, u), self.restricted_u(u, u1)))
    }

    /// Cuts the surface at `v`; see [`Self::split_u`].
    #[must_use]
    pub fn split_v(&self, v: f64) -> Option<(NurbsSurface, NurbsSurface)> {
        let (below, above) = self.transposed().split_u(v)?;
        Some((below.transposed(), above.transposed()))
    }

    /// The same surface with knots of full multiplicity at the ends of its domain, so that its outer control points are its
    /// sides. Writers of periodic surfaces go without.
    #[must_use]
    pub fn clamped(mut self) -> Self {
        let whole_u = |s: &NurbsSurface| s.restricted_u(s.domain().0.0, s.domain().0.1);
        if !self.knots_u().is_clamped() {
            self = whole_u(&self);
        }
        if !self.knots_v().is_clamped() {
            self = whole_u(&self.transposed()).transposed();
        }
        self
    }

    /// The part of the surface over `[a, b]` in `u`; both must lie in the domain, `a < b`.
    fn restricted_u(&self, a: f64, b: f64) -> NurbsSurface {
        let (knots, net) = restrict(self.knots_u(), self.net(), self.size().1, (a, b));
        NurbsSurface::from_net(knots, self.knots_v().clone(), net, self.is_rational())
    }

    /// The same surface with `u` and `v` exchanged.
    #[must_use]
    pub fn transposed(&self) -> Self {
        let (rows, columns) = self.size();
        let net = (0..columns).flat_map(|j| (0..rows).map(move |i| self.net()[i * columns + j])).collect();
        NurbsSurface::from_net(self.knots_v().clone(), self.knots_u().clone(), net, self.is_rational())
    }

    /// The same surface with `u` run backwards on the same domain.
    #[must_use]
    pub fn reversed_u(&self) -> Self {
        let net = self.net().chunks(self.size().1).rev().flatten().copied().collect();
        NurbsSurface::from_net(self.knots_u().reversed(), self.knots_v().clone(), net, self.is_rational())
    }

    /// The polynomial pieces, each a single-span surface on its own knot interval (so that parameters keep
    /// their meaning), row by row in `u`, then `v`.
    #[must_use]
    pub fn bezier_pieces(&self) -> Vec<NurbsSurface> {
        let extract = |knots: &KnotVector| -> Vec<(usize, DMatrix<f64>)> {
            spans(knots).map(|s| (s, bezier_extraction(knots, s))).collect()
        };
        let (along_u, along_v) = (extract(self.knots_u()), extract(self.knots_v()));
        let mut pieces = Vec::with_capacity(along_u.len() * along_v.len());
        for (i, rows) in &along_u {
            for (j, columns) in &along_v {
                pieces.push(NurbsSurface::from_net(
                    single_span(self.knots_u(), *i),
                    single_span(self.knots_v(), *j),
                    self.extracted((*i, rows), (*j, columns)),
                    self.is_rational(),
                ));
            }
        }
        pieces
    }

    /// The Bézier net of the piece on spans `i`, `j`, given their extraction matrices.
    fn extracted(
        &self,
        (i, rows): (usize, &DMatrix<f64>),
        (j, columns): (usize, &DMatrix<f64>),
    ) -> Vec<Vector4<f64>> {
        let (p, q) = (self.knots_u().degree(), self.knots_v().degree());
        let stride = self.size().1;
        let mut half = vec![Vector4::zeros(); (p + 1) * (q + 1)];
        for a in 0..=p {
            let source = &self.net()[(i - p + a) * stride + j - q..][..=q];
            for b in 0..=q {
                for (c, point) in source.iter().enumerate() {
                    half[a * (q + 1) + b] += *point * columns[(b, c)];
                }
            }
        }
        let mut net = vec![Vector4::zeros(); (p + 1) * (q + 1)];
        for a in 0..=p {
            for c in 0..=p {
                for b in 0..=q {
                    net[a * (q + 1) + b] += half[c * (q + 1) + b] * rows[(a, c)];
                }
            }
        }
        net
    }
}

/// Knots of the Bézier piece on `span`.
fn single_span(knots: &KnotVector, span: usize) -> KnotVector {
    let (p, u) = (knots.degree(), knots.as_slice());
    let mut ends = vec![u[span]; p + 1];
    ends.extend(vec![u[span + 1]; p + 1]);
    KnotVector::from_sound(p, ends)
}

impl NurbsCurve<2> {
    /// The part over `[a, b]`; both must lie in the domain, `a < b`. Parameters keep their meaning.
    fn restricted(&self, a: f64, b: f64) -> Self {
        let weight = |i: usize| self.weights().map_or(1.0, |w| w[i]);
        let homogeneous: Vec<SVector<f64, 3>> =
            (self.points().iter().enumerate()).map(|(i, p)| (p.coords * weight(i)).push(weight(i))).collect();
        let (knots, net) = restrict(self.knots(), &homogeneous, 1, (a, b));
        let points = net.iter().map(|h| Point::from(h.xy() / h.z)).collect();
        let weights = self.weights().map(|_| net.iter().map(|h| h.z).collect());
        NurbsCurve::from_sound(knots, points, weights)
    }

    /// Cuts the curve at `t`, exactly; `None` when `t` is not strictly inside the domain.
    #[must_use]
    pub fn split(&self, t: f64) -> Option<(Self, Self)> {
        let (a, b) = self.domain();
        (a < t && t < b).then(|| (self.restricted(a, t), self.restricted(t, b)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Curve2, Point2, Point3};
    use proptest::prelude::*;

    /// A wavy rational surface on uneven, partly repeated, in `v` unclamped knots.
    fn wavy() -> NurbsSurface {
        let ku = KnotVector::new(3, vec![1., 1., 1., 1., 1.3, 2., 2., 2.7, 4., 4., 4., 4.]).unwrap();
        let kv = KnotVector::new(2, vec![-0.4, 0.0, 0.1, 0.5, 0.55, 1.0, 1.2, 1.9]).unwrap();
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for i in 0..ku.point_count() {
            for j in 0..kv.point_count() {
                let (x, y) = (i as f64 * 30.0, j as f64 * 25.0);
                points.push(Point3::new(x + (0.1 * y).sin(), y - (0.07 * x).cos(), 10.0 * (x + y).sin()));
                weights.push(1.0 + 0.4 * ((3 * i + j) as f64).cos());
            }
        }
        NurbsSurface::new(ku, kv, points, Some(weights)).unwrap()
    }

    fn lerp((a, b): (f64, f64), t: f64) -> f64 {
        a + (b - a) * t
    }

    /// Largest difference of the two over the domain of `part`, mm.
    fn difference(part: &NurbsSurface, whole: &NurbsSurface) -> f64 {
        let (du, dv) = part.domain();
        let mut worst = 0.0f64;
        for i in 0..=20 {
            for j in 0..=20 {
                // Parameters beside the shared knots too: 1 is avoided, where `whole` may use the next span.
                let (u, v) = (lerp(du, f64::from(i) / 20.0001), lerp(dv, f64::from(j) / 20.0001));
                worst = worst.max((part.point(u, v) - whole.point(u, v)).norm());
            }
        }
        worst
    }

    proptest! {
        #[test]
        fn splits_keep_the_shape(s in 0.0001..0.9999f64, t in 0.0001..0.9999f64) {
            let whole = wavy();
            let (du, dv) = whole.domain();
            let (low, high) = whole.split_u(lerp(du, s)).unwrap();
            let (left, right) = high.split_v(lerp(dv, t)).unwrap();
            for part in [&low, &left, &right] {
                prop_assert!(difference(part, &whole) < 1e-12 * 200.0);
            }
        }
    }

    #[test]
    fn splits_at_knots_and_outside() {
        let whole = wavy();
        for u in [1.3, 2.0] {
            let (a, b) = whole.split_u(u).unwrap();
            assert!(difference(&a, &whole).max(difference(&b, &whole)) < 2e-10);
            assert_eq!(a.domain().0, (1.0, u));
        }
        assert!(
            whole.split_u(1.0).is_none() && whole.split_u(4.0).is_none() && whole.split_v(f64::NAN).is_none()
        );
    }

    #[test]
    fn bezier_pieces_cover_the_surface() {
        let whole = wavy();
        let pieces = whole.bezier_pieces();
        assert_eq!(pieces.len(), 4 * 3);
        for piece in &pieces {
            assert_eq!(piece.size(), (4, 3));
            assert!(difference(piece, &whole) < 2e-10);
        }
        assert_eq!(pieces[1].domain(), ((1.0, 1.3), (0.5, 0.55)));
    }

    #[test]
    fn transposing_and_reversing_exchange_parameters() {
        let s = wavy();
        let (t, r) = (s.transposed(), s.reversed_u());
        let ((u0, u1), _) = s.domain();
        assert_eq!(r.domain(), s.domain());
        for (u, v) in [(1.1, 0.2), (2.0, 0.9), (3.3, 0.52)] {
            approx::assert_relative_eq!(s.point(u, v), t.point(v, u), epsilon = 1e-13);
            approx::assert_relative_eq!(s.point(u, v), r.point(u0 + u1 - u, v), epsilon = 1e-11);
        }
    }

    #[test]
    fn a_discontinuous_surface_splits_at_its_jump() {
        let ku = KnotVector::new(1, vec![0.0, 0.0, 1.0, 1.0, 2.0, 2.0]).unwrap();
        let kv = KnotVector::clamped_uniform(1, 2);
        let xs = [0.0, 1.0, 5.0, 6.0];
        let points = xs.iter().flat_map(|&x| [Point3::new(x, 0.0, 0.0), Point3::new(x, 1.0, 0.0)]);
        let s = NurbsSurface::new(ku, kv, points.collect(), None).unwrap();
        let (a, b) = s.split_u(1.0).unwrap();
        assert_eq!((a.point(1.0, 0.0).x, b.point(1.0, 0.0).x), (1.0, 5.0));
    }

    #[test]
    fn curve_pieces_keep_the_shape() {
        let knots = KnotVector::new(3, vec![0.0, 0.1, 0.2, 0.3, 0.5, 0.5, 0.9, 1.0, 1.0, 1.0]).unwrap();
        let points = (0..6).map(|i| Point2::new(f64::from(i), f64::from(i * i % 5)));
        let curve = Curve2::new(knots, points.collect(), Some(vec![1.0, 2.0, 0.5, 1.0, 1.5, 1.0])).unwrap();
        let pieces = curve.bezier_pieces();
        assert_eq!(pieces.len(), 2);
        for piece in &pieces {
            for i in 0..=50 {
                let t = lerp(piece.domain(), f64::from(i) / 50.0);
                approx::assert_relative_eq!(piece.point(t), curve.point(t), epsilon = 1e-13);
            }
        }
    }
}
