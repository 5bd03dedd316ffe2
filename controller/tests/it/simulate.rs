//! Virtual controls against closed forms.

use claymill_controller::{ControlFacts, Dialect, Dynamics, Machine, Simulation, post, simulate};
use claymill_nurbs::{Curve3, Point3};

use crate::job;

fn run(curve: Curve3, dialect: Dialect, machine: &Machine) -> Simulation {
    let folder = tempfile::tempdir().unwrap();
    let job = job::job(&[("top", curve)], machine);
    let out = folder.path().join("part.nc");
    let written = post(&job, dialect, machine, &out, &|_| ()).unwrap();
    let files: Vec<_> = written.files.into_iter().map(|f| f.path).collect();
    simulate(&job, &files, dialect, machine).unwrap()
}

fn line(length: f64) -> Curve3 {
    Curve3::line(Point3::new(0.0, 0.0, 5.0), Point3::new(length, 0.0, 5.0))
}

/// A quarter of a circle in XY.
fn quarter(r: f64) -> Curve3 {
    let s = std::f64::consts::FRAC_1_SQRT_2;
    job::curve(2, &[[r, 0.0, 5.0], [r, r, 5.0], [0.0, r, 5.0]], Some(&[1.0, s, 1.0]))
}

#[test]
fn a_straight_cut_takes_its_closed_form() {
    // 6000 mm/min is a²/j: L/v + v/a + a/j, and without a limit of jerk L/v + v/a.
    let machine = Machine::default();
    for (dialect, time_s) in [(Dialect::Siemens, 5.2), (Dialect::Heidenhain, 5.2), (Dialect::LinuxCnc29, 5.1)]
    {
        let s = run(line(500.0), dialect, &machine);
        approx::assert_relative_eq!(s.cut_time_s, time_s, max_relative = 2e-3);
        approx::assert_relative_eq!(s.feed.mean_mm_per_min, 60.0 * 500.0 / s.cut_time_s, max_relative = 1e-6);
        assert!((s.feed.programmed_mm_per_min - 6000.0).abs() < 1e-6);
        // While it gains and loses speed: v²/2a at either end without jerk.
        if dialect == Dialect::LinuxCnc29 {
            assert!((0.0..0.03).contains(&s.feed.below_share), "{:?}", s.feed);
        }
        assert!(s.cut_error_mm < 1e-6, "{}", s.cut_error_mm);
    }
}

#[test]
fn chords_between_interpolation_steps_have_their_sagitta() {
    let dynamics = Dynamics { acceleration_mm_per_s2: 1e4, jerk_mm_per_s3: 1e6, cycle_s: 0.008 };
    let machine = Machine { dynamics, ..Machine::default() };
    // 100 mm/s on a radius of 60 mm: chords of 0.8 mm, (v·dt)²/8r = 1.333 µm; curvature is taken 1.1 times as large.
    let s = run(quarter(60.0), Dialect::Siemens, &machine);
    let sagitta = 0.8f64.powi(2) / (8.0 * 60.0);
    assert!(s.cut_error_mm >= sagitta && s.cut_error_mm <= 1.1 * sagitta + 2e-4, "{}", s.cut_error_mm);
    let slower = Machine { dynamics: Dynamics { cycle_s: 0.004, ..dynamics }, ..machine.clone() };
    let half = run(quarter(60.0), Dialect::Siemens, &slower);
    assert!(half.cut_error_mm < 0.4 * s.cut_error_mm, "{} {}", half.cut_error_mm, s.cut_error_mm);
}

#[test]
fn bends_slow_a_control_down_to_what_its_acceleration_allows() {
    // v² / r = 0.8 a on a radius of 5 mm: 63.2 mm/s, with the margin of 1.1 on curvature 60.3 mm/s.
    let s = run(quarter(5.0), Dialect::LinuxCnc29, &Machine::default());
    assert!(s.feed.mean_mm_per_min < 60.0 * 63.2 && s.feed.below_share > 0.99, "{:?}", s.feed);
}

#[test]
fn short_blocks_are_read_one_after_the_other() {
    // Straight moves of the quarter circle, 0.002 mm off at most: 0.98 mm long, 20 ms to read each.
    let machine = |block_s| Machine {
        arcs: false,
        nurbs: false,
        control: ControlFacts { block_s, look_ahead_blocks: Some(10), corner_mm: Some(0.05) },
        ..Machine::default()
    };
    let quick = run(quarter(60.0), Dialect::G1, &machine(Some(1e-6)));
    let slow = run(quarter(60.0), Dialect::G1, &machine(Some(0.02)));
    let blocks = slow.read_back.elements as f64;
    assert!(slow.cut_time_s > 0.8 * 0.02 * (blocks - 20.0), "{} s for {blocks} blocks", slow.cut_time_s);
    assert!(quick.cut_time_s < 0.8 * slow.cut_time_s, "{} {}", quick.cut_time_s, slow.cut_time_s);
}
