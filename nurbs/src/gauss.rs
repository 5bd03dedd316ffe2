//! The Gauss–Legendre rule of order 8, for integrands that are smooth between knots.

/// Nodes and weights of the Gauss–Legendre rule of order 8 on `[-1, 1]`, one half (Abramowitz and Stegun, table 25.4).
const EIGHT: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_27),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Nodes and weights on `[0, 1]`, for what is known to be smooth.
pub(crate) fn nodes() -> impl Iterator<Item = (f64, f64)> {
    EIGHT.iter().flat_map(|&(x, w)| [0.5 - 0.5 * x, 0.5 + 0.5 * x].map(|t| (t, 0.5 * w)))
}
