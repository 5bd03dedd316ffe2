//! Gauss–Legendre quadrature with an error estimate from two orders.

use std::cell::Cell;

/// Nodes and weights of order 5 and 8 on `[-1, 1]`, one half (Abramowitz and Stegun, table 25.4).
const FIVE: [(f64, f64); 3] = [
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];
const EIGHT: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_27),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Halvings at most: beyond them the integrand is not smooth, and what is left is below rounding.
const DEEPEST: u32 = 24;
/// Differences below this part of the integral are rounding; below the second, where what is integrated is an integral
/// itself, with as much of it.
const ROUNDING: f64 = 1e-13;
const ROUNDING_OF_INTEGRALS: f64 = 2e-12;

fn rule(half: &[(f64, f64)], (a, b): (f64, f64), f: &mut impl FnMut(f64) -> f64) -> f64 {
    let (middle, reach) = (0.5 * (a + b), 0.5 * (b - a));
    let pair = |&(x, w): &(f64, f64)| match x {
        0.0 => w * f(middle),
        x => w * (f(middle - x * reach) + f(middle + x * reach)),
    };
    reach * half.iter().map(pair).sum::<f64>()
}

/// Halvings that integrals which belong together may make before they stay as accurate as they are.
#[derive(Debug)]
pub(crate) struct Budget {
    left: Cell<u64>,
    refused: Cell<bool>,
}

impl Budget {
    pub(crate) fn of(halvings: u64) -> Self {
        Budget { left: Cell::new(halvings), refused: Cell::new(false) }
    }

    /// Whether all halvings that were asked for could be made.
    pub(crate) fn sufficed(&self) -> bool {
        !self.refused.get()
    }

    fn allows_one(&self) -> bool {
        let left = self.left.get();
        self.left.set(left.saturating_sub(1));
        if left == 0 {
            self.refused.set(true);
        }
        left > 0
    }
}

/// Integral of `f` over `[a, b]` to the absolute accuracy `tolerance`, as far as the budget goes.
pub(crate) fn integral(
    range: (f64, f64),
    tolerance: f64,
    budget: &Budget,
    f: &mut impl FnMut(f64) -> f64,
) -> f64 {
    adaptive(range, (tolerance, ROUNDING), DEEPEST, budget, f)
}

/// The same where `f` is an integral.
pub(crate) fn integral_of_integrals(
    range: (f64, f64),
    tolerance: f64,
    budget: &Budget,
    f: &mut impl FnMut(f64) -> f64,
) -> f64 {
    adaptive(range, (tolerance, ROUNDING_OF_INTEGRALS), DEEPEST, budget, f)
}

fn adaptive(
    (a, b): (f64, f64),
    (tolerance, rounding): (f64, f64),
    depth: u32,
    budget: &Budget,
    f: &mut impl FnMut(f64) -> f64,
) -> f64 {
    let fine = rule(&EIGHT, (a, b), f);
    let mut is_near = || (fine - rule(&FIVE, (a, b), f)).abs() <= tolerance.max(rounding * fine.abs());
    if depth == 0 || is_near() || !budget.allows_one() {
        return fine;
    }
    let middle = 0.5 * (a + b);
    let half = (0.5 * tolerance, rounding);
    adaptive((a, middle), half, depth - 1, budget, f) + adaptive((middle, b), half, depth - 1, budget, f)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_and_kinked_integrands_are_exact() {
        let budget = Budget::of(1000);
        let octic = integral((0.0, 2.0), 1e-12, &budget, &mut |x| x.powi(15));
        approx::assert_relative_eq!(octic, 4096.0, max_relative = 1e-13);
        let kink = integral((-1.0, 2.0), 1e-10, &budget, &mut |x: f64| x.abs());
        approx::assert_relative_eq!(kink, 2.5, max_relative = 1e-10);
        assert!(budget.sufficed());
    }

    #[test]
    fn what_never_converges_ends_with_the_budget_and_says_so() {
        let (budget, mut looks) = (Budget::of(100), 0u64);
        let mut noise = |x: f64| {
            looks += 1;
            (x.to_bits() % 97) as f64
        };
        assert!(integral((0.0, 1.0), 1e-9, &budget, &mut noise).is_finite());
        assert!(!budget.sufficed());
        assert!(looks <= 13 * (2 * 100 + 1));
    }
}
