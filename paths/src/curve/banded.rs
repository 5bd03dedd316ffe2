//! Cholesky for symmetric positive definite band matrices: the normal equations of spline fits.

/// Solves `A·X = B` in place. `a[i][k]` is `A[i][i + k]` (upper band, `K − 1` off-diagonals); `b` becomes `X`.
///
/// `None` when the matrix is not positive definite.
pub(crate) fn solve_banded<const K: usize, const M: usize>(
    a: &mut [[f64; K]],
    b: &mut [[f64; M]],
) -> Option<()> {
    let n = a.len();
    for i in 0..n {
        // A = LᵀDL style elimination: subtract what earlier rows contribute.
        for j in i.saturating_sub(K - 1)..i {
            let offset = i - j;
            let factor = a[j][offset];
            let pivot = a[j][0];
            for k in 0..K - offset {
                a[i][k] -= factor / pivot * a[j][offset + k];
            }
            for m in 0..M {
                b[i][m] -= factor / pivot * b[j][m];
            }
        }
        if a[i][0] <= 0.0 || !a[i][0].is_finite() {
            return None;
        }
    }
    for i in (0..n).rev() {
        for m in 0..M {
            let mut sum = b[i][m];
            for k in 1..K.min(n - i) {
                sum -= a[i][k] * b[i + k][m];
            }
            b[i][m] = sum / a[i][0];
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_known_system() {
        // Second-difference matrix; x = i² solves A·x = right-hand side built from it.
        let n = 12;
        let x: Vec<f64> = (0..n).map(|i| f64::from(i * i)).collect();
        let mut a = vec![[2.5, -1.0]; n as usize];
        let mut b: Vec<[f64; 1]> = (0..n as usize)
            .map(|i| {
                let left = if i > 0 { x[i - 1] } else { 0.0 };
                let right = x.get(i + 1).copied().unwrap_or(0.0);
                [2.5 * x[i] - left - right]
            })
            .collect();
        a[n as usize - 1][1] = 0.0;
        solve_banded(&mut a, &mut b).unwrap();
        for i in 0..n as usize {
            approx::assert_abs_diff_eq!(b[i][0], x[i], epsilon = 1e-10);
        }
        assert!(solve_banded(&mut [[0.0, 1.0], [1.0, 0.0]], &mut [[1.0], [1.0]]).is_none());
    }
}
