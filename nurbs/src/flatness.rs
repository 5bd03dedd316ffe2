//! Proven distances of a surface from the planes of triangles on it: measured in the middle of the
//! sides, plus what third derivatives can add. Never above the bound from second derivatives.

use crate::bernstein::Bernstein;
use crate::curvedness::{Curvedness, nets};
use crate::{KnotVector, NurbsSurface, Point2};

/// The quadratic with zeros in the corners of a triangle is nowhere larger than this times the largest of its values in
/// the middles of the sides: `4 (λ₁λ₂ + λ₂λ₃ + λ₃λ₁) ≤ 4/3`.
const BETWEEN: f64 = 4.0 / 3.0;
/// The six quadratics of Lagrange's interpolation in corners and middles add up, in absolute value, to no more than 5/3;
/// a sixth of that times the third derivative bounds what the interpolation misses (Taylor about the place).
const MISSED: f64 = 5.0 / 18.0;

/// Proven bounds of how far a surface is from the planes of triangles with corners on it.
///
/// ```text
///             ╭─•─╮            •  distance measured in the middle of each side,
///          ╭──  e  ──╮         ⌒  4/3 of the largest, if the surface were quadratic there;
///   ──────●───────────●──      and what its third derivatives can add to that
/// ```
#[derive(Debug, Clone)]
pub struct Flatness<'a> {
    surface: &'a NurbsSurface,
    curved: Curvedness,
    /// Per Bézier piece: largest lengths of the derivatives uuu, uuv, uvv and vvv.
    thirds: Vec<[f64; 4]>,
    /// Whether the second derivatives may jump at a break, for `u` and `v`.
    rough: [Vec<bool>; 2],
}

impl<'a> Flatness<'a> {
    /// Bounds the derivatives of a surface.
    #[must_use]
    pub fn of(surface: &'a NurbsSurface) -> Self {
        let rational = surface.is_rational();
        let thirds = surface.bezier_pieces().iter().map(|p| thirds(p, rational)).collect();
        let rough = [surface.knots_u(), surface.knots_v()].map(rough);
        Flatness { surface, curved: Curvedness::of(surface), thirds, rough }
    }

    /// The surface over a triangle of the parameter plane is no further than this from the plane through its corners, mm.
    /// Where these do not make a plane: from the segment through them.
    #[must_use]
    pub fn off_plane_mm(&self, uv: &[Point2; 3]) -> f64 {
        let (low, high) = (uv[0].inf(&uv[1]).inf(&uv[2]), uv[0].sup(&uv[1]).sup(&uv[2]));
        let (hu, hv) = (high.x - low.x, high.y - low.y);
        let linear = self.curved.over(low, high).deviation_mm(hu, hv);
        let at = |p: Point2| self.surface.point(p.x, p.y);
        let [a, b, c] = uv.map(at);
        let Some(n) = (b - a).cross(&(c - a)).try_normalize(0.0) else { return linear };
        let axes = [(&self.curved.breaks_u, low.x, high.x), (&self.curved.breaks_v, low.y, high.y)];
        let smooth = axes.iter().zip(&self.rough).all(|((breaks, low, high), rough)| {
            breaks.iter().zip(rough).all(|(k, rough)| !(*rough && low < k && k < high))
        });
        if !smooth {
            return linear;
        }
        let middle = |i: usize, j: usize| (at(nalgebra::center(&uv[i], &uv[j])) - a).dot(&n).abs();
        let measured = middle(0, 1).max(middle(1, 2)).max(middle(2, 0));
        let mut thirds = [0.0f64; 4];
        for k in self.curved.pieces_over(low, high) {
            thirds = std::array::from_fn(|i| thirds[i].max(self.thirds[k][i]));
        }
        let [uuu, uuv, uvv, vvv] = thirds;
        let missed = hu * hu * hu * uuu + 3.0 * hu * hv * (hu * uuv + hv * uvv) + hv * hv * hv * vvv;
        (BETWEEN * measured + MISSED * missed).min(linear)
    }
}

/// At which breaks the surface is not twice continuously differentiable.
fn rough(knots: &KnotVector) -> Vec<bool> {
    let breaks = knots.breaks();
    breaks.iter().map(|&k| knots.multiplicity(k) + 2 > knots.degree()).collect()
}

/// Largest lengths of the third derivatives of a piece: uuu, uuv, uvv, vvv.
fn thirds(piece: &NurbsSurface, rational: bool) -> [f64; 4] {
    let (a, w) = nets(piece);
    let lengths = Lengths::of(&a);
    let lengths = if rational { lengths.over(&a, &w) } else { lengths };
    let ((u0, u1), (v0, v1)) = piece.domain();
    let (wu, wv) = (u1 - u0, v1 - v0);
    std::array::from_fn(|j| lengths.0[3 - j][j] / (wu.powi(3 - j as i32) * wv.powi(j as i32)))
}

/// Largest lengths of the derivatives of a polynomial, by how often it is derived along `u` and `v`, up to three times.
struct Lengths([[f64; 4]; 4]);

impl Lengths {
    /// Derivatives lie in the hulls of their coefficients.
    fn of<const N: usize>(polynomial: &Bernstein<N>) -> Self {
        let mut lengths = [[0.0; 4]; 4];
        let mut along_u = polynomial.clone();
        for (i, row) in lengths.iter_mut().enumerate() {
            let mut both = along_u.clone();
            for length in &mut row[..4 - i] {
                *length = both.coefficients().iter().map(|c| c.norm()).fold(0.0, f64::max);
                both = both.derivative(1);
            }
            along_u = along_u.derivative(0);
        }
        Lengths(lengths)
    }

    /// Those of `A / w`, `self` being those of `A`: Leibniz' rule for `A = S w`, solved for each derivative of `S`.
    fn over(&self, a: &Bernstein<3>, w: &Bernstein<1>) -> Self {
        const BINOMIAL: [[f64; 4]; 4] =
            [[1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], [1.0, 2.0, 1.0, 0.0], [1.0, 3.0, 3.0, 1.0]];
        let least = w.coefficients().iter().map(|w| w.x).fold(f64::INFINITY, f64::min);
        let weights = Lengths::of(w).0;
        let quotients = a.coefficients().iter().zip(w.coefficients()).map(|(a, w)| a.norm() / w.x);
        let mut s = [[0.0; 4]; 4];
        s[0][0] = quotients.fold(0.0, f64::max);
        for order in 1..4 {
            for i in 0..=order {
                let j = order - i;
                let mut sum = self.0[i][j];
                for (k, l) in (0..=i).flat_map(|k| (0..=j).map(move |l| (k, l))).skip(1) {
                    sum += BINOMIAL[i][k] * BINOMIAL[j][l] * weights[k][l] * s[i - k][j - l];
                }
                s[i][j] = sum / least;
            }
        }
        Lengths(s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analytic::{Frame, torus};
    use crate::{Point3, Vector3};

    /// Random triangles: the bound holds on a dense sample, and is not much larger than what is needed.
    fn check(surface: &NurbsSurface, looseness: f64) {
        let flatness = Flatness::of(surface);
        let ((u0, u1), (v0, v1)) = surface.domain();
        let mut seed = 7u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 40) as f64 / (1u64 << 24) as f64
        };
        let (mut bound_sum, mut found_sum) = (0.0, 0.0);
        for _ in 0..400 {
            let size = 0.004 + 0.016 * random();
            let at = [random(), random()];
            let uv: [Point2; 3] = std::array::from_fn(|_| {
                let place = at.map(|x| (x + size * (random() - 0.5)).clamp(0.0, 1.0));
                Point2::new(u0 + (u1 - u0) * place[0], v0 + (v1 - v0) * place[1])
            });
            let [a, b, c] = uv.map(|p| surface.point(p.x, p.y));
            let Some(n) = (b - a).cross(&(c - a)).try_normalize(1e-12) else { continue };
            let bound = flatness.off_plane_mm(&uv);
            let mut found = 0.0f64;
            for i in 0..=24 {
                for j in 0..=24 - i {
                    let w = [f64::from(i) / 24.0, f64::from(j) / 24.0, f64::from(24 - i - j) / 24.0];
                    let p = (0..3).map(|k| uv[k].coords * w[k]).sum::<nalgebra::Vector2<f64>>();
                    found = found.max((surface.point(p.x, p.y) - a).dot(&n).abs());
                }
            }
            assert!(found <= bound + 1e-12, "{found} {bound} {uv:?}");
            (bound_sum, found_sum) = (bound_sum + bound, found_sum + found);
        }
        assert!(bound_sum < looseness * found_sum, "{bound_sum} {found_sum}");
    }

    #[test]
    fn surfaces_stay_within() {
        let turn = (0.0, 2.0 * std::f64::consts::PI);
        let frame = Frame::new(Point3::new(1000.0, 0.0, 0.0), Vector3::z(), Vector3::x());
        check(&torus(&frame.unwrap(), 10.0, 3.0, turn, turn).unwrap(), 3.5);
        let wave = |k: i32| (f64::from(k) * 1.3).sin();
        for (degree, looseness) in [(2, 4.0), (3, 6.0), (5, 15.0)] {
            let knots = KnotVector::clamped_uniform(degree, 9);
            let net = (0..9)
                .flat_map(|i| (0..9).map(move |j| Point3::new(f64::from(i), f64::from(j), wave(3 * i + j))));
            check(&NurbsSurface::new(knots.clone(), knots, net.collect(), None).unwrap(), looseness);
        }
    }

    /// The sums of the absolute values of the six quadratics, on a fine grid.
    #[test]
    fn interpolation_adds_up_to_five_thirds_at_most() {
        let mut most = 0.0f64;
        for i in 0..=300 {
            for j in 0..=300 - i {
                let l = [f64::from(i) / 300.0, f64::from(j) / 300.0, f64::from(300 - i - j) / 300.0];
                let corners: f64 = l.iter().map(|l| (l * (2.0 * l - 1.0)).abs()).sum();
                let sides = 4.0 * (l[0] * l[1] + l[1] * l[2] + l[2] * l[0]);
                most = most.max(corners + sides);
            }
        }
        assert!(most <= 6.0 * MISSED + 1e-9 && most > 6.0 * MISSED - 1e-3, "{most}");
    }
}
