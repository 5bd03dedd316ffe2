//! Closed forms from rest to rest, and every limit on random ways.

use claymill_motion::{Chain, Joint, Limits, Place};
use proptest::prelude::*;

const LIMITS: Limits = Limits { acceleration_mm_per_s2: 1000.0, jerk_mm_per_s3: 10_000.0 };

fn straight(length_mm: f64, speed: f64) -> (Joint, Place) {
    (Joint::SMOOTH, Place { length_mm, speed, bend: 0.0, twist: 0.0 })
}

fn time(places: &[(Joint, Place)]) -> f64 {
    Chain::plan(places.to_vec(), LIMITS).time_s()
}

#[test]
fn from_rest_to_rest_the_closed_forms_hold() {
    // The full acceleration is reached: L/v + v/a + a/j.
    let v = 10_000.0 / 60.0;
    approx::assert_relative_eq!(time(&[straight(500.0, v)]), 3.0 + v / 1000.0 + 0.1, max_relative = 1e-12);
    // Not reached, but the speed is: L/v + 2 √(v/j).
    let v = 50.0;
    approx::assert_relative_eq!(
        time(&[straight(500.0, v)]),
        10.0 + 2.0 * (v / 1e4f64).sqrt(),
        max_relative = 1e-9
    );
    // Neither: four phases of jerk, 4 (L / 2j)^⅓.
    for length in [1e-3, 0.1, 2.0] {
        let t = 4.0 * (length / 2e4f64).cbrt();
        approx::assert_relative_eq!(time(&[straight(length, v)]), t, max_relative = 1e-6);
    }
    // The acceleration but not the speed: v (v/a + a/j) = L.
    let (a, j, length) = (1000.0f64, 1e4f64, 60.0f64);
    let top = 0.5 * (-a * a / j + ((a * a / j).powi(2) + 4.0 * a * length).sqrt());
    let t = 2.0 * (top / a + a / j);
    approx::assert_relative_eq!(time(&[straight(length, 500.0)]), t, max_relative = 1e-4);
}

#[test]
fn cut_in_pieces_a_way_takes_as_long() {
    let whole = time(&[straight(300.0, 120.0)]);
    let pieces: Vec<_> = (0..300).map(|_| straight(1.0, 120.0)).collect();
    approx::assert_relative_eq!(time(&pieces), whole, max_relative = 1e-9);
}

#[test]
fn a_slow_place_is_passed_at_its_speed() {
    let slow = Joint { speed: 20.0, jerk_per_speed: 0.0 };
    let chain = Chain::plan(vec![straight(200.0, 100.0), (slow, straight(200.0, 100.0).1)], LIMITS);
    let (s, v) = chain.at(chain.time_of(200.0));
    approx::assert_abs_diff_eq!(s, 200.0, epsilon = 1e-7);
    approx::assert_relative_eq!(v, 20.0, max_relative = 1e-9);
}

#[test]
fn a_slow_corner_beside_a_short_way_slows_nothing_else() {
    let corner = Joint { speed: 5.6, jerk_per_speed: 0.0 };
    let with = |first: f64| {
        let mut places = vec![straight(first, 100.0), straight(580.0, 100.0)];
        places[1].0 = corner;
        let backwards: Vec<(Joint, Place)> = vec![straight(580.0, 100.0), (corner, straight(first, 100.0).1)];
        assert!((time(&places) - time(&backwards)).abs() < 1e-6, "{}", time(&backwards));
        time(&places)
    };
    let alone = time(&[straight(580.0, 100.0)]);
    for first in [0.1, 0.3, 0.49, 0.6, 1.0, 3.0] {
        assert!(with(first) < alone + 0.5, "{first}: {} instead of about {alone}", with(first));
    }
}

#[test]
fn without_a_limit_of_jerk_it_is_a_trapezium() {
    let limits = Limits { jerk_mm_per_s3: f64::INFINITY, ..LIMITS };
    let slow = Joint { speed: 20.0, jerk_per_speed: 0.0 };
    let one = Chain::plan(vec![straight(500.0, 100.0)], limits);
    approx::assert_relative_eq!(one.time_s(), 5.1, max_relative = 1e-12);
    let two = Chain::plan(vec![straight(250.0, 100.0), (slow, straight(250.0, 100.0).1)], limits);
    // From 100 to 20 mm/s and back: 0.16 s over 9.6 mm, in place of 0.096 s.
    approx::assert_relative_eq!(two.time_s(), 5.1 + 0.064, max_relative = 1e-6);
}

fn places() -> impl Strategy<Value = Vec<(Joint, Place)>> {
    let place = (0.01..30.0f64, 1.0..300.0f64, 0..3u8, 0..4u8, 0.5..200.0f64).prop_map(
        |(l, v, bent, jointed, slow)| {
            let bend = [0.0, 0.002, 0.1][usize::from(bent)];
            let joint = match jointed {
                0 => Joint { speed: slow, jerk_per_speed: 0.25 * LIMITS.jerk_mm_per_s3 / slow },
                1 => Joint { speed: slow, jerk_per_speed: 0.0 },
                _ => Joint::SMOOTH,
            };
            (joint, Place { length_mm: l, speed: v, bend, twist: bend * bend })
        },
    );
    prop::collection::vec(place, 1..40)
}

/// Holds every limit at `at` against the places; `end` is where the motion ends.
fn check(places: &[(Joint, Place)], at: &dyn Fn(f64) -> (f64, f64), time_s: f64, end: f64) {
    let dt = 1e-4;
    let samples: Vec<(f64, f64)> = (0..=(time_s / dt) as usize + 1).map(|i| at(i as f64 * dt)).collect();
    let mut starts = vec![0.0];
    for p in places {
        starts.push(starts[starts.len() - 1] + p.1.length_mm);
    }
    assert!((samples[samples.len() - 1].0 - end).abs() < 1e-7);
    for w in samples.windows(3) {
        let (s, v) = w[1];
        let a = (w[2].1 - w[0].1) / (2.0 * dt);
        let j = (w[2].1 - 2.0 * w[1].1 + w[0].1) / (dt * dt);
        assert!(w[2].0 >= w[1].0 - 1e-9, "backwards");
        let i = (starts.partition_point(|b| *b <= s).max(1) - 1).min(places.len() - 1);
        let place = places[i].1;
        assert!(v <= place.speed * (1.0 + 1e-9) + 1e-9, "{v} in place {i} of {}", place.speed);
        assert!(a.hypot(v * v * place.bend) <= 1000.0 * (1.0 + 1e-6), "{a} {v}");
        let whole = j.abs() + 3.0 * v * a.abs() * place.bend + v.powi(3) * place.twist;
        assert!(whole <= 1e4 * (1.0 + 1e-3) + 5e-8 / (dt * dt), "{whole} {j} at {s}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn every_limit_is_kept(places in places()) {
        let chain = Chain::plan(places.clone(), LIMITS);
        check(&places, &|t| chain.at(t), chain.time_s(), chain.length_mm());
        let mut at = 0.0;
        for (joint, place) in &places {
            if at > 0.0 {
                let (s, v) = chain.at(chain.time_of(at));
                prop_assert!((s - at).abs() < 1e-6);
                prop_assert!(v <= joint.speed * (1.0 + 1e-6));
            }
            at += place.length_mm;
        }
        approx::assert_relative_eq!(chain.length_mm(), at, max_relative = 1e-9);
    }

    #[test]
    fn a_hold_keeps_them_too(places in places(), when in 0.0..1.0f64) {
        let mut chain = Chain::plan(places.clone(), LIMITS);
        let t = when * chain.time_s();
        let before = chain.at(t);
        chain.hold(t);
        let after = chain.at(t);
        prop_assert!((before.0 - after.0).abs() < 1e-9 && (before.1 - after.1).abs() < 1e-9);
        check(&places, &|t| chain.at(t), chain.time_s(), chain.length_mm());
    }

    #[test]
    fn what_arrives_later_is_run_without_a_stop(places in places(), more in places(), when in 0.0..1.0f64) {
        let mut chain = Chain::plan(places.clone(), LIMITS);
        let t = when * chain.time_s();
        let mut all = places;
        if chain.extend(t, &more) {
            all.extend(more);
            check(&all, &|t| chain.at(t), chain.time_s(), chain.length_mm());
            approx::assert_relative_eq!(chain.length_mm(), all.iter().map(|p| p.1.length_mm).sum(), max_relative = 1e-9);
        }
    }
}
