//! The golden section.

const SHARE: f64 = 0.618_033_988_749_894_9;

/// Narrows a range down about its highest place, in so many steps; right where the height rises and falls once. Whoever wants the
/// height keeps it as it is asked.
pub(crate) fn golden_section(
    [mut low, mut high]: [f64; 2],
    steps: u32,
    mut height: impl FnMut(f64) -> f64,
) -> [f64; 2] {
    let (mut c, mut d) = (high - SHARE * (high - low), low + SHARE * (high - low));
    let (mut at_c, mut at_d) = (height(c), height(d));
    for _ in 0..steps {
        if at_c > at_d {
            (high, d, at_d) = (d, c, at_c);
            c = high - SHARE * (high - low);
            at_c = height(c);
        } else {
            (low, c, at_c) = (c, d, at_d);
            d = low + SHARE * (high - low);
            at_d = height(d);
        }
    }
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_highest_place_is_found_with_one_look_a_step() {
        let mut looks = 0;
        let [low, high] = golden_section([-3.0, 5.0], 30, |x| {
            looks += 1;
            -(x - 1.25).abs()
        });
        assert!(low <= 1.25 && 1.25 <= high && high - low < 1e-5, "{low} {high}");
        assert_eq!(looks, 32);
    }
}
