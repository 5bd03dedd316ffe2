//! Bisection that ends for parameters of any size and offset, also where a tolerance is finer than
//! neighbouring numbers.

/// Halvings at most. From one end of the range of doubles to the smallest number beside zero takes 2100, and from there on
/// none is left between the two sides.
const MOST_HALVINGS: usize = 2200;

/// Narrows down where a condition changes, between a place where it `holds` and one where it `fails` (on either side of
/// each other), by halving; returns the last place known to hold and the first known to fail.
///
/// It ends when the two are within `resolution` of each other, and in any case when no number is left between them: a share
/// of a range, or a length, may be finer than parameters far from zero can tell apart. So it ends after a bounded number
/// of steps for parameters of any size and offset, and for a resolution of zero. What is not finite ends at once.
///
/// ```
/// let (low, high) = claymill_nurbs::bisect(1e9, 1e9 + 1.0, 1e-12, |t| t < 1e9 + 0.25);
/// assert_eq!((low, high), ((1e9 + 0.25_f64).next_down(), 1e9 + 0.25));
/// ```
pub fn bisect(
    mut holds: f64,
    mut fails: f64,
    resolution: f64,
    mut at: impl FnMut(f64) -> bool,
) -> (f64, f64) {
    for _ in 0..MOST_HALVINGS {
        let Some(middle) = between(holds, fails).filter(|_| (fails - holds).abs() > resolution) else {
            break;
        };
        *(if at(middle) { &mut holds } else { &mut fails }) = middle;
    }
    (holds, fails)
}

/// The number halfway between two; `None` where there is none that differs from both.
#[must_use]
pub fn between(a: f64, b: f64) -> Option<f64> {
    let middle = f64::midpoint(a, b);
    (a.min(b) < middle && middle < a.max(b)).then_some(middle)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Numbers of any size: uniform in the exponent.
    fn any_size() -> impl Strategy<Value = f64> {
        (proptest::num::f64::POSITIVE
            | proptest::num::f64::NEGATIVE
            | proptest::num::f64::SUBNORMAL
            | proptest::num::f64::ZERO)
            .prop_filter("finite", |x: &f64| x.is_finite())
    }

    proptest! {
        #[test]
        fn it_ends_on_the_change_for_parameters_of_any_size_and_offset(
            a in any_size(), b in any_size(), change in any_size(), resolution in any_size(),
        ) {
            let is_near_a = |t: f64| if a < b { t < change } else { t > change };
            let mut looks = 0;
            let (holds, fails) = bisect(a, b, resolution, |t| {
                looks += 1;
                is_near_a(t)
            });
            prop_assert!(looks <= MOST_HALVINGS);
            prop_assert!(holds == a || is_near_a(holds));
            prop_assert!(fails == b || !is_near_a(fails));
            prop_assert!((fails - holds).abs() <= resolution || between(holds, fails).is_none());
        }

        #[test]
        fn wide_windows_and_large_offsets_end_as_soon_as_no_number_is_left(
            offset in any_size(), ulps in 0u32..2000, share in 0.0..1.0f64, resolution in -1.0..1e-9f64,
        ) {
            let (mut end, mut steps) = (offset, Vec::new());
            for _ in 0..ulps {
                end = end.next_up();
                steps.push(end);
            }
            let change = steps.get((share * f64::from(ulps)) as usize).copied().unwrap_or(end);
            let mut looks = 0;
            bisect(offset, end, resolution * (end - offset), |t| {
                looks += 1;
                t < change
            });
            // As many as it takes to tell two thousand numbers apart.
            prop_assert!(looks <= 12);
        }
    }

    #[test]
    fn what_is_no_number_ends_at_once() {
        for (a, b, resolution) in [
            (f64::NAN, 1.0, 0.0),
            (0.0, f64::NAN, 0.0),
            (0.0, 1.0, f64::NAN),
            (0.0, f64::INFINITY, 0.0),
            (f64::NEG_INFINITY, f64::INFINITY, 0.0),
            (1.0, 1.0, 0.0),
        ] {
            bisect(a, b, resolution, |_| panic!("there is nothing to ask"));
        }
        let mut looks = 0;
        bisect(-f64::MAX, f64::MAX, 0.0, |t| {
            looks += 1;
            t < f64::from_bits(1)
        });
        assert!((1000..MOST_HALVINGS).contains(&looks));
    }
}
