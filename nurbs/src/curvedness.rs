//! Sound bounds on first and second derivatives of a surface, one set for each Bézier piece, and
//! the deviation from triangles that follows (Filip, Magedson, Markot 1986).

use nalgebra::Vector1;

use crate::bernstein::Bernstein;
use crate::{NurbsSurface, Point2, Vector3};

/// Bounds on the derivatives over one piece of a surface, mm per parameter (squared).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) u: f64,
    pub(crate) v: f64,
    pub(crate) uu: f64,
    pub(crate) uv: f64,
    pub(crate) vv: f64,
    /// The same of the second derivatives' coordinates: `uu`, `uv`, `vv`.
    coordinates: [Vector3; 3],
}

impl Bounds {
    fn max(&self, o: &Bounds) -> Bounds {
        Bounds {
            u: self.u.max(o.u),
            v: self.v.max(o.v),
            uu: self.uu.max(o.uu),
            uv: self.uv.max(o.uv),
            vv: self.vv.max(o.vv),
            coordinates: std::array::from_fn(|k| self.coordinates[k].sup(&o.coordinates[k])),
        }
    }

    /// Largest distance between the surface and the linear interpolant over any parameter triangle that
    /// fits a box of the size `(hu, hv)` (Filip, Magedson, Markot 1986, who state it for right triangles;
    /// it holds for all because the variance of three numbers is at most a quarter of their range squared).
    pub(crate) fn deviation_mm(&self, hu: f64, hv: f64) -> f64 {
        0.125 * (hu * hu * self.uu + 2.0 * hu * hv * self.uv + hv * hv * self.vv)
    }

    /// The same for each coordinate of the surface by itself.
    pub(crate) fn deviations_mm(&self, hu: f64, hv: f64) -> Vector3 {
        let [uu, uv, vv] = self.coordinates;
        (uu * (hu * hu) + uv * (2.0 * hu * hv) + vv * (hv * hv)) * 0.125
    }
}

/// Sound bounds on the derivatives of a surface, one set per polynomial piece.
#[derive(Debug, Clone)]
pub(crate) struct Curvedness {
    pub(crate) breaks_u: Vec<f64>,
    pub(crate) breaks_v: Vec<f64>,
    pieces: Vec<Bounds>,
}

impl Curvedness {
    pub(crate) fn of(surface: &NurbsSurface) -> Self {
        let pieces = surface.bezier_pieces();
        let pieces =
            pieces.iter().map(if surface.is_rational() { quartered_bounds } else { polynomial_bounds });
        Curvedness {
            breaks_u: surface.knots_u().breaks(),
            breaks_v: surface.knots_v().breaks(),
            pieces: pieces.collect(),
        }
    }

    /// Bounds of the piece between breaks `i`, `i + 1` and `j`, `j + 1`.
    pub(crate) fn piece(&self, i: usize, j: usize) -> &Bounds {
        &self.pieces[i * (self.breaks_v.len() - 1) + j]
    }

    /// Bounds over a parameter box.
    pub(crate) fn over(&self, min: Point2, max: Point2) -> Bounds {
        let pieces = self.pieces_over(min, max);
        pieces.fold(Bounds::default(), |bounds, k| bounds.max(&self.pieces[k]))
    }

    /// The numbers of the pieces that meet a parameter box.
    pub(crate) fn pieces_over(&self, min: Point2, max: Point2) -> impl Iterator<Item = usize> + use<> {
        let spans = |breaks: &[f64], a: f64, b: f64| {
            let last = breaks.len() - 2;
            let first = breaks.partition_point(|&k| k <= a).saturating_sub(1).min(last);
            // A box that ends on a break does not reach into the next piece.
            let end = breaks.partition_point(|&k| k < b).saturating_sub(1).clamp(first, last);
            first..=end
        };
        let (rows, columns) = (spans(&self.breaks_u, min.x, max.x), spans(&self.breaks_v, min.y, max.y));
        let width = self.breaks_v.len() - 1;
        rows.flat_map(move |i| columns.clone().map(move |j| i * width + j))
    }
}

/// Control points of a piece relative to their middle, which keeps products small, and the weights.
pub(crate) fn nets(piece: &NurbsSurface) -> (Bernstein<3>, Bernstein<1>) {
    let degrees = [piece.knots_u().degree(), piece.knots_v().degree()];
    let middle = piece.net().iter().map(|h| h.xyz() / h.w).sum::<Vector3>() / piece.net().len() as f64;
    let local = piece.net().iter().map(|h| h.xyz() - middle * h.w);
    let weights = piece.net().iter().map(|h| Vector1::new(h.w));
    (Bernstein::new(degrees, local.collect()), Bernstein::new(degrees, weights.collect()))
}

/// From bounds for parameters that run over the unit square to those of the piece's own.
fn on_domain(piece: &NurbsSurface, [u, v]: [f64; 2], second: [(f64, Vector3); 3]) -> Bounds {
    let ((u0, u1), (v0, v1)) = piece.domain();
    let (wu, wv) = (u1 - u0, v1 - v0);
    let [uu, uv, vv] = [(second[0], wu * wu), (second[1], wu * wv), (second[2], wv * wv)]
        .map(|((length, coordinates), w)| (length / w, coordinates / w));
    Bounds { u: u / wu, v: v / wv, uu: uu.0, uv: uv.0, vv: vv.0, coordinates: [uu.1, uv.1, vv.1] }
}

/// Largest length, and largest absolute value of each coordinate, of some vectors.
fn largest(vectors: impl Iterator<Item = Vector3>) -> (f64, Vector3) {
    vectors.fold((0.0, Vector3::zeros()), |(l, c), x| (l.max(x.norm()), c.sup(&x.abs())))
}

/// The derivatives are Bézier patches themselves and lie in the hulls of their control points.
fn polynomial_bounds(piece: &NurbsSurface) -> Bounds {
    let (s, _) = nets(piece);
    let (u, v) = (s.derivative(0), s.derivative(1));
    let of = |net: &Bernstein<3>| largest(net.coefficients().iter().copied());
    on_domain(piece, [of(&u).0, of(&v).0], [of(&u.derivative(0)), of(&u.derivative(1)), of(&v.derivative(1))])
}

/// The bounds of a rational piece, tightened by cutting it in four.
fn quartered_bounds(piece: &NurbsSurface) -> Bounds {
    let ((u0, u1), (v0, v1)) = piece.domain();
    let halves = piece.split_u(0.5 * (u0 + u1)).map_or_else(Vec::new, |(a, b)| vec![a, b]);
    let quarters = halves.iter().filter_map(|half| half.split_v(0.5 * (v0 + v1)));
    let bounds = quarters.map(|(a, b)| rational_bounds(&a).max(&rational_bounds(&b)));
    // A piece too narrow to cut is bounded as it is.
    bounds.reduce(|a, b| a.max(&b)).unwrap_or_else(|| rational_bounds(piece))
}

/// A derivative of a rational patch is a rational patch: that of `X / w^k` is
/// `(X' w - k X w') / w^(k + 1)`. Its control points are the quotients of the coefficients above and below.
fn rational_bounds(piece: &NurbsSurface) -> Bounds {
    let (s, w) = nets(piece);
    let slopes = [w.derivative(0), w.derivative(1)];
    let derive = |x: &Bernstein<3>, k: f64, axis: usize| {
        x.derivative(axis).times(&w).minus(&x.times(&slopes[axis]), k)
    };
    let (u, v) = (derive(&s, 1.0, 0), derive(&s, 1.0, 1));
    let second = [derive(&u, 2.0, 0), derive(&u, 2.0, 1), derive(&v, 2.0, 1)];
    let w2 = w.times(&w);
    let w3 = w2.times(&w);
    let of = |above: &Bernstein<3>, below: &Bernstein<1>| {
        // Coefficients only pair up in one basis.
        let above = above.raised_to(below.degrees());
        largest(above.coefficients().iter().zip(below.coefficients()).map(|(a, b)| a / b.x))
    };
    on_domain(piece, [of(&u, &w2).0, of(&v, &w2).0], second.each_ref().map(|x| of(x, &w3)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analytic::{Frame, torus};
    use crate::{KnotVector, Point3};

    fn check(surface: &NurbsSurface, looseness: f64) {
        let curved = Curvedness::of(surface);
        let ((u0, u1), (v0, v1)) = surface.domain();
        let mut seen = Bounds::default();
        for i in 0..200 {
            for j in 0..200 {
                let (u, v) = (u0 + (u1 - u0) * f64::from(i) / 199.0, v0 + (v1 - v0) * f64::from(j) / 199.0);
                let jet = surface.jet(u, v);
                let here = Bounds {
                    u: jet.su.norm(),
                    v: jet.sv.norm(),
                    uu: jet.suu.norm(),
                    uv: jet.suv.norm(),
                    vv: jet.svv.norm(),
                    coordinates: [jet.suu, jet.suv, jet.svv].map(|x| x.abs()),
                };
                let at = Point2::new(u, v);
                assert_eq!(curved.over(at, at).max(&here), {
                    let mut b = curved.over(at, at);
                    let slack = |b: &mut f64, h: f64| *b = b.max(h.min(*b * (1.0 + 1e-9) + 1e-9));
                    slack(&mut b.u, here.u);
                    slack(&mut b.v, here.v);
                    slack(&mut b.uu, here.uu);
                    slack(&mut b.uv, here.uv);
                    slack(&mut b.vv, here.vv);
                    for k in 0..9 {
                        slack(&mut b.coordinates[k / 3][k % 3], here.coordinates[k / 3][k % 3]);
                    }
                    b
                });
                seen = seen.max(&here);
            }
        }
        let all = curved.over(Point2::new(u0, v0), Point2::new(u1, v1));
        assert!(all.uu <= looseness * seen.uu && all.vv <= looseness * seen.vv, "{all:?} {seen:?}");
    }

    #[test]
    fn bounds_hold_and_are_not_wild() {
        let turn = (0.0, 2.0 * std::f64::consts::PI);
        let frame = Frame::new(Point3::new(1000.0, 0.0, 0.0), Vector3::z(), Vector3::x());
        check(&torus(&frame.unwrap(), 10.0, 3.0, turn, turn).unwrap(), 2.0);
        let (ku, kv) = (KnotVector::clamped_uniform(3, 6), KnotVector::clamped_uniform(5, 7));
        let wave = |k: i32| (f64::from(k) * 1.3).sin();
        let net = (0..6)
            .flat_map(|i| (0..7).map(move |j| Point3::new(f64::from(i), f64::from(j), wave(3 * i + j))));
        check(&NurbsSurface::new(ku, kv, net.collect(), None).unwrap(), 2.0);
    }
}
