//! Knot vectors, and B-spline basis functions with derivatives by the Cox–de Boor recursion.

use crate::NurbsError;

/// Largest supported polynomial degree. Class-A sources use up to 7, translators up to 15; evaluation
/// scratch lives on the stack and is bounded by this.
pub const MAX_DEGREE: usize = 25;

/// A degree and its non-decreasing knots.
///
/// For `n` control points of degree `p` there are `n + p + 1` knots; the curve or surface lives on
/// `[knots[p], knots[n]]`. Knots need not be clamped.
#[derive(Debug, Clone, PartialEq)]
pub struct KnotVector {
    degree: usize,
    knots: Vec<f64>,
}

/// The basis functions that do not vanish on one span, with two derivatives.
///
/// `n[k][i]` is the k-th derivative of basis function `first + i`, for `i` in `0..=degree`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Basis<const N: usize> {
    pub(crate) first: usize,
    pub(crate) n: [[f64; N]; 3],
}

/// Calls a method with the smallest scratch size that holds a degree: cubics need not pay for degree 25.
macro_rules! for_degree {
    ($degree:expr, $this:ident . $method:ident ( $($argument:expr),* )) => {
        match $degree {
            1 => $this.$method::<2>($($argument),*),
            2 => $this.$method::<3>($($argument),*),
            3 => $this.$method::<4>($($argument),*),
            5 => $this.$method::<6>($($argument),*),
            4 | 6 | 7 => $this.$method::<8>($($argument),*),
            _ => $this.$method::<{ $crate::MAX_DEGREE + 1 }>($($argument),*),
        }
    };
}
pub(crate) use for_degree;

impl KnotVector {
    /// Checks and wraps `knots` for degree `degree`.
    ///
    /// # Errors
    /// A degree out of range, non-finite or decreasing knots, an empty domain, or a multiplicity above
    /// `degree + 1`.
    pub fn new(degree: usize, knots: Vec<f64>) -> Result<Self, NurbsError> {
        if degree == 0 || degree > MAX_DEGREE {
            return Err(NurbsError::Degree { degree, max: MAX_DEGREE });
        }
        if knots.len() < 2 * (degree + 1) {
            let points = knots.len().saturating_sub(degree + 1);
            return Err(NurbsError::KnotCount { knots: knots.len(), points, degree });
        }
        if let Some(index) = knots.iter().position(|k| !k.is_finite() || k.abs() > 1e12) {
            return Err(NurbsError::NotFinite { what: "knot", index });
        }
        if let Some(index) = knots.windows(2).position(|w| w[1] < w[0]) {
            return Err(NurbsError::KnotsDecrease { index: index + 1 });
        }
        let this = KnotVector { degree, knots };
        let (a, b) = this.domain();
        let repeated = this.knots.windows(degree + 2).any(|w| w[0] == w[degree + 1]);
        if b <= a || repeated {
            return Err(NurbsError::KnotMultiplicity);
        }
        Ok(this)
    }

    /// Clamped knots on `[0, 1]`, equally spaced inside, for `points` control points.
    ///
    /// # Panics
    /// If `degree` is 0 or `points ≤ degree`: both are the caller's own constants.
    #[must_use]
    pub fn clamped_uniform(degree: usize, points: usize) -> Self {
        assert!(degree >= 1 && points > degree, "a clamped knot vector needs points > degree >= 1");
        let spans = points - degree;
        let mut knots = vec![0.0; degree];
        knots.extend((0..=spans).map(|i| i as f64 / spans as f64));
        knots.extend(vec![1.0; degree]);
        KnotVector { degree, knots }
    }

    /// Whether both ends have full multiplicity.
    #[must_use]
    pub fn is_clamped(&self) -> bool {
        let (k, p) = (self.as_slice(), self.degree());
        k[0] == k[p] && k[k.len() - 1] == k[k.len() - 1 - p]
    }

    /// Wraps knots that are known to be sound.
    pub(crate) fn from_sound(degree: usize, knots: Vec<f64>) -> Self {
        debug_assert!(KnotVector::new(degree, knots.clone()).is_ok(), "unsound knots {knots:?}");
        KnotVector { degree, knots }
    }

    /// The polynomial degree.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// All knots.
    #[must_use]
    pub fn as_slice(&self) -> &[f64] {
        &self.knots
    }

    /// Number of control points that belong to these knots.
    #[must_use]
    pub fn point_count(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// First and last parameter.
    #[must_use]
    pub fn domain(&self) -> (f64, f64) {
        (self.knots[self.degree], self.knots[self.knots.len() - self.degree - 1])
    }

    /// The distinct knots of the domain: where polynomial pieces meet, ends included.
    #[must_use]
    pub fn breaks(&self) -> Vec<f64> {
        let mut breaks = self.knots[self.degree..self.knots.len() - self.degree].to_vec();
        breaks.dedup();
        breaks
    }

    /// The knots mirrored on the same domain, as a curve run backwards needs them.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let (a, b) = self.domain();
        // The ends are swapped rather than computed, so that the domain stays the same to the last bit.
        let mirror = |&k: &f64| match k {
            k if k == a => b,
            k if k == b => a,
            k if a < k && k < b => (a + b - k).clamp(a, b),
            k => a + b - k,
        };
        KnotVector { degree: self.degree, knots: self.knots.iter().rev().map(mirror).collect() }
    }

    /// How often `knot` occurs, to the last bit.
    #[must_use]
    pub fn multiplicity(&self, knot: f64) -> usize {
        self.knots.iter().filter(|&&k| k == knot).count()
    }

    /// Index `i` of the non-empty span `[knots[i], knots[i+1])` that holds `t`; `t` outside the domain
    /// belongs to the first or last span.
    #[must_use]
    pub fn span(&self, t: f64) -> usize {
        let (p, n) = (self.degree, self.point_count());
        if t >= self.knots[n] {
            let mut i = n - 1;
            while i > p && self.knots[i] == self.knots[i + 1] {
                i -= 1;
            }
            return i;
        }
        // The first knot greater than t, minus one; t below the domain lands on the first span.
        let i = self.knots[p..=n].partition_point(|&k| k <= t);
        let mut i = p + i.max(1) - 1;
        while self.knots[i] == self.knots[i + 1] {
            i += 1;
        }
        i
    }

    /// Index of the first control point that acts at `t`, and the values of the `degree + 1` basis functions
    /// from there on.
    #[must_use]
    pub fn basis_functions(&self, t: f64) -> (usize, Vec<f64>) {
        let (first, values) = self.values::<{ MAX_DEGREE + 1 }>(t);
        (first, values[..=self.degree].to_vec())
    }

    /// Non-vanishing basis functions at `t` with first and second derivatives
    /// (Cox–de Boor recursion; The NURBS Book, eq. 2.5 and 2.7). `N` must be above the degree.
    pub(crate) fn basis<const N: usize>(&self, t: f64) -> Basis<N> {
        self.basis_in::<N, 2>(self.span(t), t)
    }

    /// The same on the polynomial piece of span `span`, also where `t` is a little outside it, with derivatives up to
    /// `ORDER`; those above are zero.
    #[inline(always)]
    pub(crate) fn basis_in<const N: usize, const ORDER: usize>(&self, span: usize, t: f64) -> Basis<N> {
        // Where the scratch is just large enough the degree is a constant, and loops unroll.
        if self.degree + 1 == N {
            self.basis_up_to::<N, ORDER>(N - 1, span, t)
        } else {
            self.basis_up_to::<N, ORDER>(self.degree, span, t)
        }
    }

    /// The same without derivatives.
    pub(crate) fn values<const N: usize>(&self, t: f64) -> (usize, [f64; N]) {
        let basis = self.basis_in::<N, 0>(self.span(t), t);
        (basis.first, basis.n[0])
    }

    #[inline(always)]
    fn basis_up_to<const N: usize, const ORDER: usize>(&self, p: usize, i: usize, t: f64) -> Basis<N> {
        // The 2p knots around the span: u[p - 1 + k] is knot i + k.
        let u = &self.knots[i + 1 - p..=i + p];
        let mut n = [[0.0; N]; 3];
        // The basis of degree p - 1 and p - 2, from which the derivatives follow.
        let (mut one_less, mut two_less) = ([0.0; N], [0.0; N]);
        let b = &mut n[0];
        b[0] = 1.0;
        for d in 1..=p {
            if d == p {
                one_less[..d].copy_from_slice(&b[..d]);
            } else if d + 1 == p {
                two_less[..d].copy_from_slice(&b[..d]);
            }
            let mut carry = 0.0;
            for r in 0..d {
                let (right, left) = (u[p + r], u[p + r - d]);
                let w = b[r] / (right - left);
                b[r] = carry + (right - t) * w;
                carry = (t - left) * w;
            }
            b[d] = carry;
        }
        if ORDER == 0 {
            return Basis { first: i - p, n };
        }
        // Derivative of degree d from the basis of degree d - 1:
        // N' = d (N_{j,d-1} / (u_{j+d} - u_j) - N_{j+1,d-1} / (u_{j+d+1} - u_{j+1})).
        let derive = |b: &[f64; N], d: usize, out: &mut [f64; N]| {
            let mut carry = 0.0;
            for r in 0..d {
                let w = d as f64 * b[r] / (u[p + r] - u[p + r - d]);
                out[r] = carry - w;
                carry = w;
            }
            out[d] = carry;
        };
        derive(&one_less, p, &mut n[1]);
        if ORDER >= 2 && p >= 2 {
            let mut first = [0.0; N];
            derive(&two_less, p - 1, &mut first);
            derive(&first, p, &mut n[2]);
        }
        Basis { first: i - p, n }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uneven() -> KnotVector {
        KnotVector::new(3, vec![0.0, 0.0, 0.0, 0.0, 0.2, 0.5, 0.5, 0.9, 1.0, 1.0, 1.0, 1.0]).unwrap()
    }

    #[test]
    fn basis_is_a_partition_of_unity_and_its_derivatives_match_differences() {
        let k = uneven();
        for t in [0.0, 0.1, 0.2, 0.37, 0.61, 0.95, 1.0] {
            let b = k.basis::<4>(t);
            let sums: Vec<f64> = b.n.iter().map(|row| row.iter().sum()).collect();
            approx::assert_abs_diff_eq!(sums[0], 1.0, epsilon = 1e-14);
            approx::assert_abs_diff_eq!(sums[1], 0.0, epsilon = 1e-12);
            approx::assert_abs_diff_eq!(sums[2], 0.0, epsilon = 1e-10);
        }
        let (t, h) = (0.37, 1e-5);
        let (a, m, b) = (k.basis::<4>(t - h), k.basis::<4>(t), k.basis::<4>(t + h));
        for i in 0..4 {
            approx::assert_abs_diff_eq!(m.n[1][i], (b.n[0][i] - a.n[0][i]) / (2.0 * h), epsilon = 1e-7);
            let second = (b.n[0][i] - 2.0 * m.n[0][i] + a.n[0][i]) / (h * h);
            approx::assert_abs_diff_eq!(m.n[2][i], second, epsilon = 1e-4);
        }
    }

    #[test]
    fn span_skips_repeated_knots_and_clamps() {
        let k = uneven();
        assert_eq!(k.span(0.5), 6);
        assert_eq!(k.span(0.49), 4);
        assert_eq!(k.span(-1.0), 3);
        assert_eq!(k.span(1.0), 7);
        assert_eq!(k.span(2.0), 7);
    }

    #[test]
    fn bad_knots_are_refused() {
        assert!(matches!(KnotVector::new(0, vec![0.0; 4]), Err(NurbsError::Degree { .. })));
        assert!(matches!(
            KnotVector::new(1, vec![0.0, 0.0, 1.0, 0.5]),
            Err(NurbsError::KnotsDecrease { index: 3 })
        ));
        assert!(matches!(
            KnotVector::new(1, vec![0.0, 0.0, f64::NAN, 1.0]),
            Err(NurbsError::NotFinite { .. })
        ));
        assert!(matches!(KnotVector::new(1, vec![0.0; 4]), Err(NurbsError::KnotMultiplicity)));
    }
}
