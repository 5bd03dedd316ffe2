//! Scallop heights of passes whose step-over is known in closed form: the tables of the design study.

use std::f64::consts::FRAC_PI_2;

use crate::synthetic::{self, H, R, check, job, model, program, rectangle, straight};
use claymill_nurbs::analytic::{Frame, circle_arc, cylinder, sphere};
use claymill_nurbs::{Curve3, KnotVector, Point3, Vector3};
use claymill_toolpath::MoveKind::Cut;
use claymill_toolpath::Tool;
use claymill_verify::{FindingCode, SurfaceState, Verification};

/// Exact step-over on a plane for R = 10, h = 0.02.
const PLANE_STEP: f64 = 1.264_278_450_5;

fn assert_crests_are_h(v: &Verification) {
    let crests = &v.scallop.crests;
    assert!(crests.samples > 500, "{crests:?}");
    approx::assert_abs_diff_eq!(crests.max_mm, H, epsilon = 1e-6);
    approx::assert_abs_diff_eq!(crests.p99_mm, H, epsilon = 1e-6);
    approx::assert_abs_diff_eq!(crests.mean_mm, H, epsilon = 1e-6);
    assert!(v.gouge.deepest_mm < 1e-9, "{:?}", v.gouge);
    assert!(v.contact.excess_max_mm < 1e-9, "{:?}", v.contact);
    assert_eq!(v.contact.within_limit_share, 1.0);
}

#[test]
fn a_plane_at_the_exact_step_over() {
    let model = model([rectangle((0.0, 60.0), (0.0, 30.0), 0.0)]);
    let rows = (0..26).map(|k| {
        let y = PLANE_STEP * f64::from(k) - 0.5;
        straight(Cut, k as u32, Point3::new(0.0, y, R), Point3::new(60.0, y, R))
    });
    let v = check(&model, &job(&model), &program(rows));
    assert_crests_are_h(&v);
    approx::assert_relative_eq!(v.coverage.total_mm2, 1800.0, max_relative = 1e-9);
    approx::assert_relative_eq!(v.coverage.by_state_mm2[&SurfaceState::Cut], 1800.0, max_relative = 1e-9);
    // The profile between two passes is a parabola: a third of the crest on average.
    approx::assert_relative_eq!(v.scallop.surface.mean_mm, H / 3.0, max_relative = 0.02);
    assert!(v.scallop.surface.p99_mm < H && v.scallop.surface.p99_mm > 0.95 * H);
    assert_eq!(v.scallop.surface.above_limit_share, 0.0);
    // The outer rows run beside the plate at its height, and so stand off its rim.
    let codes: Vec<FindingCode> = synthetic::findings(&v).iter().map(|f| f.code).collect();
    assert_eq!(codes, [FindingCode::Rim], "{:?}", v.verdict);
}

/// Passes parallel to the axis of a cylinder of radius `rho`, `step` radians apart, on its outside or inside.
fn cylinder_job(rho: f64, step: f64, outside: bool) -> Verification {
    let toward_top = if outside { 1.0 } else { -1.0 };
    let frame = Frame::new(Point3::origin(), Vector3::x(), Vector3::z() * toward_top).unwrap();
    let half = 12.0 * step;
    let model = model([cylinder(&frame, rho, (-half, half), (0.0, 60.0)).unwrap()]);
    let reach = rho + R * toward_top;
    let rows = (-12..=12).map(|k| {
        let angle = step * f64::from(k);
        let at = |x: f64| Point3::new(x, reach * angle.sin(), reach * angle.cos() * toward_top);
        straight(Cut, (k + 12) as u32, at(0.0), at(60.0))
    });
    check(&model, &job(&model), &program(rows))
}

#[test]
fn cylinders_of_both_signs() {
    for (rho, step, outside) in [
        (1000.0, 0.001_257_992, true),
        (1000.0, 0.001_270_660, false),
        (100.0, 0.012_053_24, true),
        (100.0, 0.013_328_02, false),
        (25.0, 0.042_724_14, true),
        (25.0, 0.065_316_09, false),
    ] {
        let v = cylinder_job(rho, step, outside);
        assert_crests_are_h(&v);
        assert!(synthetic::is_sound(&v), "radius {rho} outside {outside}: {:?}", v.verdict);
    }
}

#[test]
fn parallels_of_a_sphere() {
    // Parallels crowd in arc length but not in angle: the plane of two neighbouring balls holds the axis.
    let (rho, step) = (100.0, 0.012_053_24);
    let frame = Frame::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    let band = (0.9, 0.9 + 16.0 * step);
    let model = model([sphere(&frame, rho, (0.2, 0.8), band).unwrap()]);
    let rows = (0..=16).map(|k| {
        let latitude = band.0 + step * f64::from(k);
        let mut frame = frame;
        frame.origin.z = (rho + R) * latitude.sin();
        let arc = circle_arc(&frame, (rho + R) * latitude.cos(), (0.2, 0.8)).unwrap();
        synthetic::along(Cut, k as u32, &arc)
    });
    assert!(band.1 < FRAC_PI_2);
    let v = check(&model, &job(&model), &program(rows));
    assert_crests_are_h(&v);
    assert!(synthetic::is_sound(&v), "{:?}", v.verdict);
}

#[test]
fn the_turns_of_a_spiral_are_neighbours() {
    // A square one, inwards: each turn a step-over inside of the one before, all of it one pass.
    let model = model([rectangle((0.0, 40.0), (0.0, 40.0), 0.0)]);
    let (mut at, mut side_mm, mut moves) = (Point3::new(0.0, 0.0, R), 40.0, Vec::new());
    let ways = [Vector3::x(), Vector3::y(), -Vector3::x(), -Vector3::y()];
    for k in 0.. {
        let to = at + ways[k % 4] * side_mm;
        moves.push((at, to));
        at = to;
        // Three sides are whole, then each second one is shorter.
        if k >= 2 && k % 2 == 0 {
            side_mm -= PLANE_STEP;
        }
        if side_mm < PLANE_STEP {
            break;
        }
    }
    let v = check(&model, &job(&model), &program(moves.into_iter().map(|(a, b)| straight(Cut, 0, a, b))));
    let crests = &v.scallop.crests;
    assert!(crests.samples > 500, "{crests:?}");
    approx::assert_abs_diff_eq!(crests.p95_mm, H, epsilon = 1e-6);
    approx::assert_relative_eq!(crests.mean_mm, H, max_relative = 0.01);
    assert!(crests.inside_share > 0.7 && crests.even_inside_share > 0.98, "{crests:?}");
}

#[test]
fn crossing_passes_only_lower_the_crests() {
    let model = model([rectangle((0.0, 30.0), (0.0, 30.0), 0.0)]);
    let along_x = (0..26).map(|k| {
        let y = PLANE_STEP * f64::from(k) - 0.5;
        straight(Cut, k as u32, Point3::new(0.0, y, R), Point3::new(30.0, y, R))
    });
    let along_y = (0..26).map(|k| {
        let x = PLANE_STEP * f64::from(k) - 0.5;
        straight(Cut, 100 + k as u32, Point3::new(x, 0.0, R), Point3::new(x, 30.0, R))
    });
    let v = check(&model, &job(&model), &program(along_x.chain(along_y)));
    assert!(v.scallop.crests.max_mm <= H + 1e-6);
    assert!(v.scallop.surface.mean_mm < 0.25 * H);
}

/// An arc about the x axis, up to `half` on both sides of the top, as sixteen cubics (off by less than 1e-7 mm).
fn cubic_arc(x: f64, radius: f64, half: f64) -> Curve3 {
    let spans = 16;
    let turn = 2.0 * half / f64::from(spans);
    let arm = 4.0 / 3.0 * (turn / 4.0).tan() * radius;
    let at = |k: f64| {
        let angle = turn * k - half;
        let along = Vector3::new(0.0, angle.cos(), -angle.sin()) * arm;
        (Point3::new(x, radius * angle.sin(), radius * angle.cos()), along)
    };
    let mut points = vec![at(0.0).0];
    let mut knots = vec![0.0; 4];
    for k in 0..spans {
        let ((a, leaves), (b, comes)) = (at(f64::from(k)), at(f64::from(k + 1)));
        points.extend([a + leaves, b - comes, b]);
        knots.extend([radius * turn * f64::from(k + 1); 3]);
    }
    knots.push(2.0 * radius * half);
    Curve3::new(KnotVector::new(3, knots).unwrap(), points, None).unwrap()
}

#[test]
fn no_crest_of_large_balls_is_taken_for_cut_away() {
    // Arcs over a barrel: chords of the paths lie below them.
    let (rho, r, h) = (1000.0, 50.0, 0.5);
    let step = 2.0 * f64::sqrt(2.0 * r * h - h * h);
    let (rows, half) = (12, 0.4);
    let frame = |x: f64| Frame::new(Point3::new(x, 0.0, 0.0), Vector3::x(), Vector3::z()).unwrap();
    let length = step * f64::from(rows - 1);
    let model = model([cylinder(&frame(0.0), rho, (-half, half), (0.0, length)).unwrap()]);
    let mut job = job(&model);
    job.request.scallop_mm = h;
    job.request.tool = Tool::ball(r);
    job.tools[0].tool = Tool::ball(r);
    let along = |k: u32| {
        let mut pass = synthetic::along(Cut, k, &cubic_arc(step * f64::from(k), rho + r, half));
        for p in &mut pass.points {
            p[2] += R - r;
        }
        pass
    };
    let v = check(&model, &job, &program((0..rows).map(along)));
    let crests = &v.scallop.crests;
    for height_mm in [crests.max_mm, crests.mean_mm] {
        approx::assert_abs_diff_eq!(height_mm, h, epsilon = 1e-6);
    }
    // On both sides of every pass, but one of the first and the last.
    let sides = f64::from(2 * rows - 2);
    let spacing_mm = 2.0 * f64::sqrt(r / R);
    let expected = sides * 2.0 * half * (rho + r) / spacing_mm;
    assert!(crests.samples as f64 > 0.99 * expected, "{} samples, {expected:.0} expected", crests.samples);
}
