//! Pockets on which ways of clearing are compared.

use claymill_clearing::PlanarSet;

/// Multiplier and increment of Knuth's MMIX generator.
const MULTIPLIER: u64 = 6_364_136_223_846_793_005;
const INCREMENT: u64 = 1_442_695_040_888_963_407;

/// The five plain pockets, by name.
pub(crate) fn plain() -> Vec<(String, PlanarSet)> {
    let rectangle = PlanarSet::rectangle;
    let l_shape = rectangle([0.0, 0.0, 60.0, 60.0]).minus(&rectangle([25.0, 25.0, 61.0, 61.0]));
    let rooms = rectangle([0.0, 0.0, 30.0, 40.0]).union(&rectangle([55.0, 0.0, 85.0, 40.0]));
    let channel = rooms.union(&rectangle([29.0, 15.5, 56.0, 24.5]));
    let star = PlanarSet::of_polygons(&[(0..10).map(|k| polar(k, 10, [40.0, 17.0][k % 2])).collect()]);
    let base = rectangle([0.0, 0.0, 75.0, 20.0]);
    let comb = (0..4).fold(base, |set, k| {
        let left = 5.0 + 18.0 * f64::from(k);
        set.union(&rectangle([left, 19.0, left + 10.0, 50.0]))
    });
    let named = [
        ("square 60", rectangle([0.0, 0.0, 60.0, 60.0])),
        ("L-shape", l_shape),
        ("channel of 9 mm", channel),
        ("star", star),
        ("comb", comb),
    ];
    named.into_iter().map(|(name, set)| (name.to_string(), set)).collect()
}

fn polar(k: usize, count: usize, radius_mm: f64) -> [f64; 2] {
    let (sine, cosine) = (std::f64::consts::TAU * k as f64 / count as f64).sin_cos();
    [radius_mm * cosine, radius_mm * sine]
}

/// A pocket with a ragged outline and up to three round islands; the same for the same seed.
pub(crate) fn generated(seed: u64) -> PlanarSet {
    let mut state = seed.wrapping_mul(MULTIPLIER).wrapping_add(INCREMENT);
    let mut between = |low: f64, high: f64| {
        state = state.wrapping_mul(MULTIPLIER).wrapping_add(INCREMENT);
        low + (high - low) * ((state >> 11) as f64 / (1_u64 << 53) as f64)
    };
    let corners = between(6.0, 12.0) as usize;
    let outline = (0..corners).map(|k| polar(k, corners, between(24.0, 45.0))).collect();
    let mut pocket = PlanarSet::of_polygons(&[outline]);
    for _ in 0..between(0.0, 4.0) as usize {
        let [x, y] = polar((between(0.0, 360.0)) as usize, 360, between(0.0, 20.0));
        pocket = pocket.minus(&PlanarSet::disc([x, y], between(2.0, 7.0)));
    }
    pocket
}
