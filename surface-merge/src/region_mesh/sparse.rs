//! Sparse symmetric systems, solved by Cholesky factorisation: fields with fixed values, and bicubic splines.

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::Llt;
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Side};

use super::FieldError;
use crate::disjoint_sets::DisjointSets;

/// The system `d_i·x_i − Σ_j w_ij·x_j = load_i` for all `i` that are not fixed, factorised.
pub(super) struct System {
    factor: Option<Llt<usize, f64>>,
    /// Number of each value in the factorised system, if it is unknown.
    unknown: Vec<Option<usize>>,
    /// Values that are known; NaN for those that no fixed value reaches.
    known: Vec<f64>,
    /// What the fixed values add to the load.
    pull: Vec<f64>,
}

impl System {
    /// That of a function on vertices that pull on each other by `weights`, each pair once.
    pub(super) fn laplace(weights: &[(u32, u32, f64)], fixed: &[Option<f64>]) -> Result<Self, FieldError> {
        let mut diagonal = vec![0.0; fixed.len()];
        for &(i, j, w) in weights {
            diagonal[i as usize] += w;
            diagonal[j as usize] += w;
        }
        System::new(&diagonal, weights, fixed)
    }

    /// `couplings` are the `w_ij`, each pair once.
    pub(super) fn new(
        diagonal: &[f64],
        couplings: &[(u32, u32, f64)],
        fixed: &[Option<f64>],
    ) -> Result<Self, FieldError> {
        let singular = |reason: String| FieldError::Singular { reason };
        let reached = reached(couplings, fixed);
        let mut count = 0;
        let mut number = |i: usize| {
            let is_unknown = fixed[i].is_none() && reached[i];
            count += usize::from(is_unknown);
            is_unknown.then(|| count - 1)
        };
        let unknown: Vec<Option<usize>> = (0..fixed.len()).map(&mut number).collect();
        let known: Vec<f64> = fixed.iter().map(|f| f.unwrap_or(f64::NAN)).collect();
        let mut pull = vec![0.0; count];
        let mut entries = Vec::with_capacity(count + couplings.len());
        for (i, k) in unknown.iter().enumerate() {
            entries.extend(k.map(|k| Triplet::new(k, k, diagonal[i])));
        }
        for &(i, j, w) in couplings {
            match (unknown[i as usize], unknown[j as usize]) {
                (Some(a), Some(b)) => entries.push(Triplet::new(a.max(b), a.min(b), -w)),
                (Some(a), None) => pull[a] += w * known[j as usize],
                (None, Some(b)) => pull[b] += w * known[i as usize],
                (None, None) => {}
            }
        }
        let factor = if count > 0 {
            let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(count, count, &entries)
                .map_err(|e| singular(format!("{e:?}")))?;
            Some(matrix.sp_cholesky(Side::Lower).map_err(|e| singular(format!("{e:?}")))?)
        } else {
            None
        };
        Ok(System { factor, unknown, known, pull })
    }

    /// The values for one load; NaN where no fixed value reaches.
    pub(super) fn solve(&self, load: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut right = Mat::from_fn(self.pull.len(), 1, |k, _| self.pull[k]);
        for (i, unknown) in self.unknown.iter().enumerate() {
            if let Some(k) = unknown {
                right[(*k, 0)] += load(i);
            }
        }
        if let Some(factor) = &self.factor {
            factor.solve_in_place(&mut right);
        }
        let value = |(i, k): (usize, &Option<usize>)| k.map_or(self.known[i], |k| right[(k, 0)]);
        self.unknown.iter().enumerate().map(value).collect()
    }
}

/// Which values hang together with a fixed one.
fn reached(couplings: &[(u32, u32, f64)], fixed: &[Option<f64>]) -> Vec<bool> {
    let mut sets = DisjointSets::new(fixed.len());
    for &(i, j, _) in couplings {
        sets.join(i as usize, j as usize);
    }
    let mut holds = vec![false; fixed.len()];
    for i in (0..fixed.len()).filter(|&i| fixed[i].is_some()) {
        holds[sets.root(i)] = true;
    }
    (0..fixed.len()).map(|i| holds[sets.root(i)]).collect()
}

/// Places near each other in one direction act on each other up to this many control points away.
const REACH: usize = 3;
const BAND: usize = 2 * REACH + 1;

/// Factors of control points some rows and columns away.
type Stencil = &'static [([usize; 2], f64)];

/// What one place asks of a bicubic spline: the first control point that acts there in both directions, the basis,
/// a weight and the point.
pub(super) type Wanted = ([usize; 2], [[f64; 4]; 4], f64, [f64; 3]);

/// The control points, row by row, of the bicubic spline that comes nearest to all `wanted` points, with
/// `stiffness` times the squares of second differences of control points added.
pub(super) fn solve_spline(
    counts: [usize; 2],
    stiffness: f64,
    wanted: impl Iterator<Item = Wanted>,
) -> Result<Vec<[f64; 3]>, FieldError> {
    let [rows, columns] = counts;
    let unknowns = rows * columns;
    let mut bands = vec![[0.0; BAND * BAND]; unknowns];
    let mut right = Mat::<f64>::zeros(unknowns, 3);
    let mut couple = |[i, j]: [usize; 2], [k, l]: [usize; 2], value: f64| {
        bands[i * columns + j][(k + REACH - i) * BAND + l + REACH - j] += value;
    };
    for ([i, j], basis, weight, point) in wanted {
        for (a, b) in (0..16).map(|n| (n / 4, n % 4)) {
            let act = weight * basis[a][b];
            (0..3).for_each(|x| right[((i + a) * columns + j + b, x)] += act * point[x]);
            for (c, d) in (0..16).map(|n| (n / 4, n % 4)) {
                couple([i + a, j + b], [i + c, j + d], act * basis[c][d]);
            }
        }
    }
    // Thin plate: the second differences along both directions, and twice the mixed one.
    let stencils: [(f64, Stencil); 3] = [
        (1.0, &[([0, 0], 1.0), ([1, 0], -2.0), ([2, 0], 1.0)]),
        (1.0, &[([0, 0], 1.0), ([0, 1], -2.0), ([0, 2], 1.0)]),
        (2.0, &[([0, 0], 1.0), ([1, 0], -1.0), ([0, 1], -1.0), ([1, 1], 1.0)]),
    ];
    for (factor, stencil) in stencils {
        let reach = |k: usize| stencil.iter().map(|(o, _)| o[k]).max().unwrap_or(0);
        for (i, j) in (0..rows - reach(0)).flat_map(|i| (0..columns - reach(1)).map(move |j| (i, j))) {
            for (p, x) in stencil {
                for (q, y) in stencil {
                    couple([i + p[0], j + p[1]], [i + q[0], j + q[1]], factor * stiffness * x * y);
                }
            }
        }
    }
    let mut entries = Vec::with_capacity(unknowns * BAND * BAND / 2);
    for (n, band) in bands.iter().enumerate() {
        for (k, &value) in band.iter().enumerate().filter(|(_, v)| **v != 0.0) {
            let (i, j) = (n / columns + k / BAND, n % columns + k % BAND);
            let other = (i - REACH) * columns + j - REACH;
            if other <= n {
                entries.push(Triplet::new(n, other, value));
            }
        }
    }
    let singular = |reason: String| FieldError::Singular { reason };
    let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(unknowns, unknowns, &entries)
        .map_err(|e| singular(format!("{e:?}")))?;
    let factor = matrix.sp_cholesky(Side::Lower).map_err(|e| singular(format!("{e:?}")))?;
    factor.solve_in_place(&mut right);
    Ok((0..unknowns).map(|n| std::array::from_fn(|x| right[(n, x)])).collect())
}
