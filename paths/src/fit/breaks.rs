//! Where a fitted spline has its breaks: more where it misses too much, two in one where the curvature jumps, none where
//! it does as well without.

use claymill_nurbs::Vector3;
use claymill_toolpath::round_to_written;

use crate::fit::refit::{LONGEST_SPAN_MM, Spline};
use crate::fit::target::Target;

/// Rounds of taking out knots, and how much worse than the tolerance a prediction may be to be tried.
const THIN_ROUNDS: usize = 8;
const HOPEFUL: f64 = 1.5;
/// Without a break between two spans `h` long a cubic misses a jump `j` of its third derivative by about `j·h³` over
/// this, and one of its second by `j·h²` over that (best approximation of truncated powers).
const THIRD_SHARE: f64 = 160.0;
const SECOND_SHARE: f64 = 60.0;
/// Breaks that are not the same are at least this far apart, mm; and what is so near to a jump, in spans, is moved there.
const CLOSEST_MM: f64 = 0.005;
const NEAR: f64 = 0.04;

/// A jump of curvature: breaks near it are moved there.
struct Jump {
    at: f64,
    near_mm: f64,
}

impl Jump {
    fn is_near(&self, at: f64) -> bool {
        (self.at - at).abs() < self.near_mm
    }
}

impl Spline {
    /// The breaks, with more of them where too much is missed: two at once where the curvature jumps, for there the
    /// spline may bend as sharply as its target.
    pub(crate) fn finer(&self, target: &Target) -> Vec<f64> {
        let mut jumps: Vec<Jump> = Vec::new();
        let mut cuts = Vec::new();
        for (i, span) in self.breaks.windows(2).enumerate() {
            let miss_mm = self.miss_mm(i);
            if miss_mm <= self.tolerance.fit_mm {
                continue;
            }
            if let Some(jump) = self.jump(span, target) {
                jumps.extend(jumps.iter().all(|j| !j.is_near(jump.at)).then_some(jump));
                continue;
            }
            let parts = (miss_mm / self.tolerance.aim_mm()).powf(0.25).ceil().clamp(2.0, 6.0) as usize;
            let cut = |k: usize| round_to_written(span[0] + (span[1] - span[0]) * k as f64 / parts as f64);
            let inside = |b: &f64| b - span[0] > CLOSEST_MM && span[1] - b > CLOSEST_MM;
            cuts.extend((1..parts).map(cut).filter(inside));
        }
        let whole = [self.breaks[0], self.breaks[self.breaks.len() - 1]];
        let stays = |b: &f64| whole.contains(b) || jumps.iter().all(|j| !j.is_near(*b));
        let mut finer: Vec<f64> = self.breaks.iter().copied().chain(cuts).filter(stays).collect();
        finer.extend(jumps.iter().flat_map(|j| [j.at; 2]));
        finer.sort_by(f64::total_cmp);
        finer
    }

    /// A jump of curvature in a span, where there are not yet two breaks in one.
    fn jump(&self, span: &[f64], target: &Target) -> Option<Jump> {
        let at = round_to_written(target.jump([span[0], span[1]])?);
        let jump = Jump { at, near_mm: (NEAR * (span[1] - span[0])).max(CLOSEST_MM) };
        let ends = [self.breaks[0], self.breaks[self.breaks.len() - 1]];
        let inside = at > ends[0] && at < ends[1] && !ends.iter().any(|end| jump.is_near(*end));
        let known = self.breaks.windows(2).any(|two| two[0] == two[1] && jump.is_near(two[0]));
        (inside && !known).then_some(jump)
    }

    /// Breaks that may not be needed, none next to another: what the spline would miss without one grows with the jump
    /// of its third derivative there, or of its second where there are two.
    fn spare(&self, needed: &[f64]) -> Vec<usize> {
        let bends: Vec<[Vector3; 2]> = self.breaks.windows(2).map(|span| self.bend(span)).collect();
        let width = |i: usize| self.breaks[i + 1] - self.breaks[i];
        let predicted_mm = |k: usize| {
            let two = self.breaks[k + 1] == self.breaks[k];
            let (before, after) = (k - 1, if two { k + 1 } else { k });
            let (a, b) = (width(before), width(after));
            let shorter = 2.0 * a * b / (a + b);
            let [[second, third], [next_second, next_third]] = [bends[before], bends[after]];
            let rise_mm = if two {
                (next_second - second - third * a).norm() * shorter.powi(2) / SECOND_SHARE
            } else {
                (next_third - third).norm() * shorter.powi(3) / THIRD_SHARE
            };
            self.miss_mm(before).max(self.miss_mm(after)) + rise_mm
        };
        let mut spare: Vec<(f64, usize)> = (1..self.breaks.len() - 1)
            .filter(|&k| self.breaks[k] > self.breaks[k - 1] && !needed.contains(&self.breaks[k]))
            .filter(|&k| width(k - 1) + width(k) <= LONGEST_SPAN_MM)
            .map(|k| (predicted_mm(k), k))
            .filter(|(miss_mm, _)| *miss_mm <= HOPEFUL * self.tolerance.fit_mm)
            .collect();
        spare.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut chosen = vec![false; self.breaks.len()];
        for (_, k) in spare {
            chosen[k] = !chosen[k - 1] && !chosen[k + 1];
        }
        (0..chosen.len()).filter(|&k| chosen[k]).collect()
    }

    /// Second derivative at the beginning of a span, and third.
    fn bend(&self, span: &[f64]) -> [Vector3; 2] {
        let width = span[1] - span[0];
        if width == 0.0 {
            return [Vector3::zeros(); 2];
        }
        let second = |share: f64| self.curve.derivatives(span[0] + share * width)[2];
        let [early, late] = [second(0.25), second(0.75)];
        let third = (late - early) / (0.5 * width);
        [early - third * (0.25 * width), third]
    }
}

/// Takes out breaks as long as the spline stays within tolerance. Splitting halves spans around a jump of curvature
/// from whatever place they happen to begin at, which leaves more breaks than the jump needs.
pub(crate) fn thinned(
    mut good: Spline,
    spline: impl Fn(Vec<f64>, Option<&Spline>) -> Option<Spline>,
) -> Spline {
    let mut needed: Vec<f64> = Vec::new();
    for _ in 0..THIN_ROUNDS {
        let mut out = good.spare(&needed);
        while !out.is_empty() {
            let kept = good.breaks.iter().enumerate().filter(|(k, _)| !out.contains(k)).map(|(_, b)| *b);
            let Some(trial) = spline(kept.collect(), Some(&good)) else { return good };
            let missed: Vec<[f64; 2]> = (0..trial.errors.len())
                .filter(|&span| trial.miss_mm(span) > trial.tolerance.fit_mm)
                .map(|span| [trial.breaks[span], trial.breaks[span + 1]])
                .collect();
            if missed.is_empty() {
                good = trial;
                break;
            }
            // What was taken out of a span that now misses, or else next to it, was needed.
            let back = |wide: f64| -> Vec<usize> {
                let near = |b: f64| {
                    missed.iter().any(|[from, to]| {
                        let margin = wide * (to - from);
                        b > from - margin && b < to + margin
                    })
                };
                out.iter().copied().filter(|&k| near(good.breaks[k])).collect()
            };
            let restored =
                [0.0, 1.0].into_iter().map(back).find(|b| !b.is_empty()).unwrap_or_else(|| out.clone());
            needed.extend(restored.iter().map(|&k| good.breaks[k]));
            out.retain(|k| !restored.contains(k));
        }
    }
    good
}
