//! Gauss–Legendre quadrature with an error estimate from two orders.

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
/// Differences below this part of the integral are rounding.
const ROUNDING: f64 = 1e-13;

fn rule(half: &[(f64, f64)], (a, b): (f64, f64), f: &mut impl FnMut(f64) -> f64) -> f64 {
    let (middle, reach) = (0.5 * (a + b), 0.5 * (b - a));
    let pair = |&(x, w): &(f64, f64)| match x {
        0.0 => w * f(middle),
        x => w * (f(middle - x * reach) + f(middle + x * reach)),
    };
    reach * half.iter().map(pair).sum::<f64>()
}

/// Integral of `f` over `[a, b]` to the absolute accuracy `tolerance`.
pub(crate) fn integral(range: (f64, f64), tolerance: f64, f: &mut impl FnMut(f64) -> f64) -> f64 {
    adaptive(range, tolerance, DEEPEST, f)
}

fn adaptive((a, b): (f64, f64), tolerance: f64, depth: u32, f: &mut impl FnMut(f64) -> f64) -> f64 {
    let fine = rule(&EIGHT, (a, b), f);
    if depth == 0 || (fine - rule(&FIVE, (a, b), f)).abs() <= tolerance.max(ROUNDING * fine.abs()) {
        return fine;
    }
    let middle = 0.5 * (a + b);
    let half = 0.5 * tolerance;
    adaptive((a, middle), half, depth - 1, f) + adaptive((middle, b), half, depth - 1, f)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_and_kinked_integrands_are_exact() {
        let octic = integral((0.0, 2.0), 1e-12, &mut |x| x.powi(15));
        approx::assert_relative_eq!(octic, 4096.0, max_relative = 1e-13);
        let kink = integral((-1.0, 2.0), 1e-10, &mut |x: f64| x.abs());
        approx::assert_relative_eq!(kink, 2.5, max_relative = 1e-10);
    }
}
