//! Sparse symmetric systems with fixed values, solved by Cholesky factorisation.

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
