//! Tensor-product polynomials in Bernstein form: derivatives, products, degree elevation and
//! halving. Their convex hulls bound derivatives elsewhere.

use std::sync::LazyLock;

use nalgebra::SVector;

use crate::MAX_DEGREE;

/// A tensor-product polynomial on the unit square with values in `N` dimensions, by its Bernstein
/// coefficients, row-major.
#[derive(Debug, Clone)]
pub(crate) struct Bernstein<const N: usize> {
    degrees: [usize; 2],
    coefficients: Vec<SVector<f64, N>>,
}

impl<const N: usize> Bernstein<N> {
    pub(crate) fn new(degrees: [usize; 2], coefficients: Vec<SVector<f64, N>>) -> Self {
        debug_assert_eq!(coefficients.len(), (degrees[0] + 1) * (degrees[1] + 1), "net size");
        Bernstein { degrees, coefficients }
    }

    pub(crate) fn coefficients(&self) -> &[SVector<f64, N>] {
        &self.coefficients
    }

    pub(crate) fn degrees(&self) -> [usize; 2] {
        self.degrees
    }

    /// The same polynomial by its coefficients for higher degrees.
    pub(crate) fn raised_to(&self, degrees: [usize; 2]) -> Self {
        let by = [0, 1].map(|axis| degrees[axis] - self.degrees[axis]);
        let one = Bernstein::new(by, vec![SVector::from([1.0]); (by[0] + 1) * (by[1] + 1)]);
        self.times(&one)
    }

    /// Partial derivative along `axis` (0 is `u`); that of a constant is a constant.
    pub(crate) fn derivative(&self, axis: usize) -> Self {
        let [p, q] = self.degrees;
        let degree = self.degrees[axis];
        let mut degrees = self.degrees;
        degrees[axis] = degree.saturating_sub(1);
        let step = if axis == 0 { q + 1 } else { 1 };
        let difference = |i: usize, j: usize| {
            let k = i * (q + 1) + j;
            (self.coefficients[k + step] - self.coefficients[k]) * degree as f64
        };
        let coefficients = match degree {
            0 => vec![SVector::zeros(); (p + 1) * (q + 1)],
            _ => (0..=degrees[0])
                .flat_map(|i| (0..=degrees[1]).map(move |j| (i, j)))
                .map(|(i, j)| difference(i, j))
                .collect(),
        };
        Bernstein { degrees, coefficients }
    }

    /// Product with a scalar polynomial.
    pub(crate) fn times(&self, o: &Bernstein<1>) -> Self {
        self.product(o, |a, b| a * b.x)
    }

    /// The polynomial that `bilinear` makes of the values of two: binomially scaled coefficients multiply like
    /// those of powers.
    pub(crate) fn product<const M: usize, const K: usize>(
        &self,
        o: &Bernstein<M>,
        bilinear: impl Fn(&SVector<f64, N>, &SVector<f64, M>) -> SVector<f64, K>,
    ) -> Bernstein<K> {
        let degrees = [self.degrees[0] + o.degrees[0], self.degrees[1] + o.degrees[1]];
        let columns = degrees[1] + 1;
        let rows = |d: [usize; 2]| d.map(binomials);
        let ([su, sv], [ou, ov], [tu, tv]) = (rows(self.degrees), rows(o.degrees), rows(degrees));
        let mut coefficients = vec![SVector::zeros(); (degrees[0] + 1) * columns];
        for (i, bi) in su.iter().enumerate() {
            for (j, bj) in sv.iter().enumerate() {
                let mine = self.coefficients[i * sv.len() + j] * (bi * bj);
                for (k, bk) in ou.iter().enumerate() {
                    for (l, bl) in ov.iter().enumerate() {
                        let other = o.coefficients[k * ov.len() + l] * (bk * bl);
                        coefficients[(i + k) * columns + j + l] += bilinear(&mine, &other);
                    }
                }
            }
        }
        for (i, bi) in tu.iter().enumerate() {
            for (j, bj) in tv.iter().enumerate() {
                coefficients[i * columns + j] /= bi * bj;
            }
        }
        Bernstein { degrees, coefficients }
    }

    /// The polynomial on the lower and on the upper half of `axis`, each on the unit square again (de Casteljau).
    pub(crate) fn halves(&self, axis: usize) -> [Self; 2] {
        let [p, q] = self.degrees;
        let (degree, stride, lines, hop) =
            if axis == 0 { (p, q + 1, q + 1, 1) } else { (q, 1, p + 1, q + 1) };
        let (mut low, mut high) = (self.clone(), self.clone());
        for line in 0..lines {
            let at = |k: usize| line * hop + k * stride;
            for round in 1..=degree {
                for k in 0..=degree - round {
                    high.coefficients[at(k)] =
                        (high.coefficients[at(k)] + high.coefficients[at(k + 1)]) * 0.5;
                }
                low.coefficients[at(round)] = high.coefficients[at(0)];
            }
        }
        [low, high]
    }

    /// `self - o · factor`, for equal degrees.
    pub(crate) fn minus(mut self, o: &Self, factor: f64) -> Self {
        debug_assert_eq!(self.degrees, o.degrees, "degrees");
        let pairs = self.coefficients.iter_mut().zip(&o.coefficients);
        pairs.for_each(|(a, b)| *a -= b * factor);
        self
    }
}

/// The binomial coefficients of `n`.
pub(crate) fn binomials(n: usize) -> Vec<f64> {
    let mut row = vec![1.0];
    for k in 0..n {
        row.push(row[k] * (n - k) as f64 / (k + 1) as f64);
    }
    row
}

/// `[i][k]`: coefficient of `xᵏ` in the Bernstein polynomial `i` of degree `n` on `[-½, ½]`. All are exact up to
/// degree 25: whole numbers below 2⁵³ over powers of two.
pub(crate) fn centred_powers(n: usize) -> &'static [Vec<f64>] {
    static TABLES: LazyLock<Vec<Vec<Vec<f64>>>> = LazyLock::new(|| (0..=MAX_DEGREE).map(centred).collect());
    &TABLES[n]
}

fn centred(n: usize) -> Vec<Vec<f64>> {
    let binomial = binomials(n);
    let times = |poly: &[f64], slope: f64| -> Vec<f64> {
        let mut out = vec![0.0; poly.len() + 1];
        for (k, c) in poly.iter().enumerate() {
            out[k] += 0.5 * c;
            out[k + 1] += slope * c;
        }
        out
    };
    (0..=n)
        .map(|i| {
            let rising = (0..i).fold(vec![binomial[i]], |poly, _| times(&poly, 1.0));
            (i..n).fold(rising, |poly, _| times(&poly, -1.0))
        })
        .collect()
}
