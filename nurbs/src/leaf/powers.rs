//! Converts a leaf from Bernstein to centred power basis, in double-double arithmetic for high
//! degrees. It declines where rounding would cost digits.

use super::Leaf;
use crate::bernstein::centred_powers;

/// The power basis stands in for the Bernstein polynomials while the absolute values of its terms add up to no
/// more than this many times the leaf's size: what rounding takes then stays below 1e-14 of that size.
const LARGEST_GROWTH: f64 = 32.0;
/// Coefficients by powers of the surface's own parameters must keep away from the ends of the number range.
const LARGEST_EXPONENT: f64 = 300.0;

/// Up to this sum of both degrees the change of basis amplifies rounding by no more than 2⁸.
const LARGEST_PLAIN_DEGREE: usize = 8;

/// Numbers for the change of basis.
trait Number: Copy + Default {
    fn of(x: f64) -> Self;
    /// `self + a · x`, where `a` is exact.
    fn plus_product(self, a: f64, x: Self) -> Self;
    fn rounded(self) -> f64;
}

impl Number for f64 {
    fn of(x: f64) -> f64 {
        x
    }
    fn plus_product(self, a: f64, x: f64) -> f64 {
        self + a * x
    }
    fn rounded(self) -> f64 {
        self
    }
}

/// A number as the unevaluated sum of two, for about 32 digits.
#[derive(Debug, Clone, Copy, Default)]
struct Double(f64, f64);

impl Number for Double {
    fn of(x: f64) -> Double {
        Double(x, 0.0)
    }
    /// Dekker 1971; Ogita, Rump, Oishi 2005.
    fn plus_product(self, a: f64, x: Double) -> Double {
        let product = a * x.0;
        let lost = a.mul_add(x.0, -product) + a * x.1;
        let sum = self.0 + product;
        let back = sum - self.0;
        let rest = (self.0 - (sum - back)) + (product - back);
        let low = self.1 + rest + lost;
        Double(sum + low, low - ((sum + low) - sum))
    }
    fn rounded(self) -> f64 {
        self.0
    }
}

/// A leaf by powers of `u − ū` and `v − v̄` around the middle of its parameters: one block for each of
/// `x`, `y`, `z` (and `w`), row-major in `u`. `None` where that would lose digits.
pub(super) fn powers(leaf: &Leaf) -> Option<Box<[f64]>> {
    let [p, q] = leaf.degree;
    if p + q <= LARGEST_PLAIN_DEGREE { changed::<f64>(leaf) } else { changed::<Double>(leaf) }
}

fn changed<N: Number>(leaf: &Leaf) -> Option<Box<[f64]>> {
    let [p, q] = leaf.degree;
    let widths = [leaf.u.1 - leaf.u.0, leaf.v.1 - leaf.v.0];
    let exponent = |width: f64, degree: usize| width.log2().abs() * degree as f64;
    if exponent(widths[0], p) + exponent(widths[1], q) > LARGEST_EXPONENT {
        return None;
    }
    let (mu, mv) = (centred_powers(p), centred_powers(q));
    let components = if leaf.rational { 4 } else { 3 };
    let mut out = Vec::with_capacity(components * (p + 1) * (q + 1));
    let mut half = vec![N::default(); (p + 1) * (q + 1)];
    for c in 0..components {
        let largest = leaf.net.iter().map(|h| h[c].abs()).fold(0.0, f64::max);
        for (half, net) in half.chunks_exact_mut(q + 1).zip(leaf.net.chunks_exact(q + 1)) {
            for (j, half) in half.iter_mut().enumerate() {
                let terms = mv.iter().zip(net);
                *half = terms.fold(N::default(), |sum, (m, h)| sum.plus_product(m[j], N::of(h[c])));
            }
        }
        let mut growth = 0.0;
        let (mut unit_u, mut part_u) = (1.0, 1.0);
        for i in 0..=p {
            let (mut unit, mut part) = (unit_u, part_u);
            for j in 0..=q {
                let terms = mu.iter().zip(half.chunks_exact(q + 1));
                let sum = terms.fold(N::default(), |sum, (m, row)| sum.plus_product(m[i], row[j])).rounded();
                growth += sum.abs() * part;
                out.push(sum * unit);
                unit /= widths[1];
                part *= 0.5;
            }
            unit_u /= widths[0];
            part_u *= 0.5;
        }
        if growth > LARGEST_GROWTH * largest {
            return None;
        }
    }
    Some(out.into_boxed_slice())
}
