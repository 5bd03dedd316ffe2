//! What keeps a tool off a place: whether, and how far, on a sphere and beside a trimmed rim.

use std::f64::consts::{FRAC_PI_2, TAU};

use claymill_nurbs::{Face, KnotVector, NurbsSurface, Point3, Vector3, analytic};

use super::tests::{Bench, face, placed, round_trim, top};
use crate::{BallDrop, KeptOff};

#[test]
fn what_keeps_a_tool_off_a_sphere_tells_how_far() {
    let rho = 40.0;
    let sphere =
        analytic::sphere(&placed(Point3::origin(), Vector3::z()), rho, (0.0, TAU), (-FRAC_PI_2, FRAC_PI_2))
            .unwrap();
    let bench = Bench::surfaces(vec![sphere]);
    let mut all_steps = 0;
    for (tool, flat, r) in [("flat:10", 10.0_f64, 0.0_f64), ("bull:10:2", 8.0, 2.0)] {
        let end = BallDrop::of_tool(&bench.model, &bench.covering, &top(), &tool.parse().unwrap());
        for k in 0..200 {
            let share = |prime: f64| (f64::from(k) * prime).fract();
            let (turn, height) = (TAU * share(0.618_034), 38.0 * share(0.754_878));
            // At this distance from the middle it is clear.
            let clear = flat + ((rho + r).powi(2) - height * height).sqrt();
            let beside = 0.7 * clear * share(0.324_718);
            let (sine, cosine) = turn.sin_cos();
            let along = [cosine, sine];
            let at = |mm: f64| [mm * cosine - beside * sine, mm * sine + beside * cosine];
            let exact = (clear * clear - beside * beside).sqrt();
            let ahead = exact - 2.0 * share(0.569_840);
            // On and on past what keeps it off, and a little further each time.
            let (mut mm, mut steps) = (ahead, 0);
            while let KeptOff::Until { along_mm } = end.kept_off(at(mm), along, height) {
                (mm, steps) = (mm + along_mm, steps + 1);
                assert!(mm <= exact + 1e-6, "{tool} {k}: {mm} is beyond {exact}");
                mm += 1e-4;
            }
            assert_eq!(end.kept_off(at(mm), along, height), KeptOff::No, "{tool} {k}");
            assert!(mm >= exact - 1e-3, "{tool} {k}: {mm} instead of {exact}");
            all_steps += steps;
        }
    }
    // Most take the first point that is found and the last one that is touched.
    assert!(all_steps < 400 * 3, "{all_steps}");
}

/// z = −(x² + y²) / 200 over a disc of 30 mm. The sheet goes on beyond it.
fn trimmed_dome() -> Bench {
    let bezier = |k: usize| [-50.0, 0.0, 50.0][k];
    let square = |k: usize| [2500.0, -2500.0, 2500.0][k];
    let at = |k: usize| {
        let (i, j) = (k / 3, k % 3);
        Point3::new(bezier(i), bezier(j), -(square(i) + square(j)) / 200.0)
    };
    let knots = KnotVector::new(2, vec![-50.0, -50.0, -50.0, 50.0, 50.0, 50.0]).unwrap();
    let dome = NurbsSurface::new(knots.clone(), knots, (0..9).map(at).collect(), None).unwrap();
    Bench::of(vec![Face { loops: vec![round_trim()], ..face(dome) }])
}

#[test]
fn a_tool_close_to_a_rim_is_soon_known_to_be_free() {
    let bench = trimmed_dome();
    let end = BallDrop::of_tool(&bench.model, &bench.covering, &top(), &"flat:10".parse().unwrap());
    for k in 0..40 {
        let (sine, cosine) = (0.157 * f64::from(k) + 0.05).sin_cos();
        let beside = |mm: f64| [(40.0 + mm) * cosine, (40.0 + mm) * sine];
        assert_eq!(end.is_kept_off(beside(2e-3), -6.0), Some(false), "{k}");
        assert_eq!(end.is_kept_off_at_a_glance(beside(0.02), -6.0), Some(false), "{k}");
        let held = end.kept_off(beside(-1e-3), [cosine, sine], -6.0);
        assert!(
            matches!(held, KeptOff::Until { along_mm } if (along_mm - 1e-3).abs() < 1e-3),
            "{k}: {held:?}"
        );
    }
}

#[test]
fn a_tool_beside_a_rim_is_held_where_the_sheet_inside_the_trims_holds_it() {
    let bench = trimmed_dome();
    let mut counts = [0; 3];
    for (tool, flat, corner) in [("flat:10", 10.0, 0.0), ("bull:10:3", 7.0, 3.0), ("bull:10:9", 1.0, 9.0_f64)]
    {
        let end = BallDrop::of_tool(&bench.model, &bench.covering, &top(), &tool.parse().unwrap());
        for k in 0..3000 {
            let share = |prime: f64| (f64::from(k) * prime).fract();
            let (away, tip) = (38.0 + 2.5 * share(0.618_034), -12.0 + 9.0 * share(0.754_878));
            let (sine, cosine) = (TAU * share(0.569_840)).sin_cos();
            // Everything is round about the dome's axis: the tool is held highest on the line to it.
            let held_mm = (0..=40_000).map(|i| 18.0 + 12.0 * f64::from(i) / 40_000.0).map(|r| {
                let out: f64 = (away - r - flat).max(0.0);
                let rise = corner - (corner * corner - out * out).max(0.0).sqrt();
                if out <= corner { -r * r / 200.0 - rise } else { f64::NEG_INFINITY }
            });
            let held_mm = held_mm.fold(f64::NEG_INFINITY, f64::max);
            let is_close = (away - 40.0).abs() < 2e-3 || (held_mm - tip).abs() < 2e-3;
            let at = [away * cosine, away * sine];
            for found in [end.is_kept_off(at, tip + corner), end.is_kept_off_at_a_glance(at, tip + corner)] {
                match found {
                    None => counts[0] += 1,
                    _ if is_close => {}
                    Some(is_held) => {
                        counts[if is_held { 2 } else { 1 }] += 1;
                        assert_eq!(held_mm > tip, is_held, "{tool} {away} {tip}: held at {held_mm}");
                    }
                }
            }
        }
    }
    // Both happen often, and little is left open.
    assert!(counts[1] > 3000 && counts[2] > 3000 && counts[0] < 200, "{counts:?}");
}

/// A countersink of 15 mm at its mouth, which is at the height 0. Its triangles swell above that, and all of it is below.
#[test]
fn a_tool_stands_over_a_countersink_at_a_glance() {
    let at = placed(Point3::new(0.0, 0.0, -10.0), Vector3::z());
    let sink = analytic::cone(&at, 5.0, std::f64::consts::FRAC_PI_4, (0.0, TAU), (0.0, 10.0)).unwrap();
    let bench = Bench::surfaces(vec![sink]);
    for tool in ["flat:20", "bull:20:3"] {
        let end = BallDrop::of_tool(&bench.model, &bench.covering, &top(), &tool.parse().unwrap());
        let corner_mm = if tool.starts_with("bull") { 3.0 } else { 0.0 };
        for k in 0..50 {
            let (sine, cosine) = (TAU * f64::from(k) / 50.0).sin_cos();
            let place = [0.4 * f64::from(k) * cosine, 0.4 * f64::from(k) * sine];
            assert_eq!(end.is_kept_off_at_a_glance(place, corner_mm + 1e-6), Some(false), "{tool} {place:?}");
            assert_eq!(end.is_kept_off_at_a_glance([3.0, 1.0], corner_mm - 0.2), Some(true), "{tool}");
        }
    }
}
