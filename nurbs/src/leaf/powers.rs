use super::Leaf;
use crate::bernstein::centred_powers;

/// The power basis stands in for the Bernstein polynomials while the absolute values of its terms add up to no
/// more than this many times the leaf's size: what rounding takes then stays below 1e-14 of that size.
const LARGEST_GROWTH: f64 = 32.0;
/// Coefficients by powers of the surface's own parameters must keep away from the ends of the number range.
const LARGEST_EXPONENT: f64 = 300.0;

/// A number as the unevaluated sum of two, for about 32 digits.
#[derive(Debug, Clone, Copy, Default)]
struct Double(f64, f64);

impl Double {
    /// `self + a · x`, where `a` is exact (Dekker 1971; Ogita, Rump, Oishi 2005).
    fn plus_product(self, a: f64, x: Double) -> Double {
        let product = a * x.0;
        let lost = a.mul_add(x.0, -product) + a * x.1;
        let sum = self.0 + product;
        let back = sum - self.0;
        let rest = (self.0 - (sum - back)) + (product - back);
        let low = self.1 + rest + lost;
        Double(sum + low, low - ((sum + low) - sum))
    }
}

/// A leaf by powers of `u − ū` and `v − v̄` around the middle of its parameters: one block for each of
/// `x`, `y`, `z` (and `w`), row-major in `u`. `None` where that would lose digits.
pub(super) fn powers(leaf: &Leaf) -> Option<Box<[f64]>> {
    let [p, q] = leaf.degree;
    let widths = [leaf.u.1 - leaf.u.0, leaf.v.1 - leaf.v.0];
    let exponent = |width: f64, degree: usize| width.log2().abs() * degree as f64;
    if exponent(widths[0], p) + exponent(widths[1], q) > LARGEST_EXPONENT {
        return None;
    }
    let (mu, mv) = (centred_powers(p), centred_powers(q));
    let components = if leaf.rational { 4 } else { 3 };
    let mut out = Vec::with_capacity(components * (p + 1) * (q + 1));
    for c in 0..components {
        let largest = leaf.net.iter().map(|h| h[c].abs()).fold(0.0, f64::max);
        let mut half = vec![Double::default(); (p + 1) * (q + 1)];
        for i in 0..=p {
            for j in 0..=q {
                for k in 0..=q {
                    let b = Double(leaf.net[i * (q + 1) + k][c], 0.0);
                    half[i * (q + 1) + j] = half[i * (q + 1) + j].plus_product(mv[k][j], b);
                }
            }
        }
        let mut growth = 0.0;
        for i in 0..=p {
            for j in 0..=q {
                let sum = (0..=p)
                    .fold(Double::default(), |sum, k| sum.plus_product(mu[k][i], half[k * (q + 1) + j]));
                growth += sum.0.abs() * 0.5f64.powi((i + j) as i32);
                out.push(sum.0 / (widths[0].powi(i as i32) * widths[1].powi(j as i32)));
            }
        }
        if growth > LARGEST_GROWTH * largest {
            return None;
        }
    }
    Some(out.into_boxed_slice())
}
