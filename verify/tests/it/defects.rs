//! Planted defects: each must be found with its size.

use crate::synthetic::{self, H, R, check, job, model, program, rectangle, straight};
use claymill_nurbs::analytic::{Frame, cylinder, sphere};
use claymill_nurbs::{KnotVector, NurbsSurface, Point3, Vector3};
use claymill_toolpath::MoveKind::{Cut, LeadOut, Rapid};
use claymill_toolpath::{Move, UncutReason};
use claymill_verify::{FindingCode, SurfaceState, Verification};

const STEP: f64 = 1.264_278_450_5;

/// Crest between two passes over a plane, `gap` apart.
fn crest(gap: f64) -> f64 {
    R - (R * R - gap * gap / 4.0).sqrt()
}

fn plate() -> NurbsSurface {
    rectangle((0.0, 60.0), (0.0, 30.0), 0.0)
}

/// Passes over the plate.
fn rows() -> Vec<Move> {
    let row = |k: u32| {
        let y = STEP * f64::from(k) - 0.5;
        straight(Cut, k, Point3::new(0.0, y, R), Point3::new(60.0, y, R))
    };
    (0..26).map(row).collect()
}

fn shift(m: &mut Move, axis: usize, by: f64) {
    for p in &mut m.points {
        p[axis] += by;
    }
}

fn has(v: &Verification, code: FindingCode) -> bool {
    v.verdict.findings.iter().any(|f| f.code == code)
}

fn plate_with(moves: Vec<Move>) -> Verification {
    let model = model([plate()]);
    check(&model, &job(&model), &program(moves))
}

#[test]
fn a_pass_beside_its_place() {
    let mut moves = rows();
    shift(&mut moves[12], 1, STEP / 2.0);
    let v = plate_with(moves);
    approx::assert_abs_diff_eq!(v.scallop.crests.max_mm, crest(1.5 * STEP), epsilon = 1e-8);
    assert!(has(&v, FindingCode::Scallop) && !synthetic::is_sound(&v));
    let at = v.scallop.crests.max_at.unwrap();
    approx::assert_abs_diff_eq!(at.point_mm[1], STEP * 11.75 - 0.5, epsilon = 1e-6);
    assert!(matches!(at.move_seq, Some(11 | 12)));
}

#[test]
fn a_missing_pass() {
    let mut moves = rows();
    moves.remove(12);
    let v = plate_with(moves);
    approx::assert_abs_diff_eq!(v.scallop.crests.max_mm, crest(2.0 * STEP), epsilon = 1e-8);
    // What is higher than 1.5 h counts as left: the strip where the profile exceeds it.
    let strip = 2.0 * (STEP - (R * R - (R - 1.5 * H).powi(2)).sqrt());
    let left = v.coverage.by_state_mm2[&SurfaceState::ReachableLeft];
    approx::assert_relative_eq!(left, 60.0 * strip, max_relative = 0.05);
    assert!(has(&v, FindingCode::ReachableLeft) && !synthetic::is_sound(&v));
}

#[test]
fn a_pass_missing_beside_a_wall() {
    let frame = Frame::new(Point3::origin(), Vector3::x(), Vector3::y()).unwrap();
    let wall = || claymill_nurbs::analytic::plane_patch(&frame, (0.0, 60.0), (0.0, 30.0)).unwrap();
    let level = |k: u32| {
        let z = STEP * f64::from(k) - 0.5;
        straight(Cut, k, Point3::new(R, 0.0, z), Point3::new(R, 60.0, z))
    };
    let levels = |missing: u32| (0..26).filter(move |&k| k != missing).map(level);
    let alone = model([wall()]);
    let v = check(&alone, &job(&alone), &program(levels(99)));
    assert!(!v.coverage.by_state_mm2.contains_key(&SurfaceState::ReachableLeft), "{:?}", v.verdict);

    let v = check(&alone, &job(&alone), &program(levels(12)));
    let strip = 2.0 * (STEP - (R * R - (R - 1.5 * H).powi(2)).sqrt());
    let left = v.coverage.by_state_mm2[&SurfaceState::ReachableLeft];
    approx::assert_relative_eq!(left, 60.0 * strip, max_relative = 0.05);
    assert!(has(&v, FindingCode::ReachableLeft) && !synthetic::is_sound(&v));

    // Under an eave that stands out by a little nothing of it is in reach.
    let eave = rectangle((0.0, 60.0), (-0.01, 0.01), 40.0);
    let eave = eave.mapped(|p| Point3::new(p.y, p.x, p.z));
    let sheltered = model([wall(), eave]);
    let v = check(&sheltered, &job(&sheltered), &program(levels(12)));
    let of_wall = &v.coverage.faces[0].by_state_mm2;
    assert!(!of_wall.contains_key(&SurfaceState::ReachableLeft), "{:?}", v.coverage);

    // But from the side it is, whether or not the job has a setup there.
    let mut job = job(&sheltered);
    job.request.length = "-x".into();
    let v = check(&sheltered, &job, &program(levels(12)));
    let left = v.coverage.faces[0].by_state_mm2[&SurfaceState::ReachableLeft];
    approx::assert_relative_eq!(left, 60.0 * strip, max_relative = 0.05);
}

#[test]
fn between_walls_that_the_ball_just_fits_into_there_is_no_room() {
    let side = |x: f64, normal: Vector3| {
        let frame = Frame::new(Point3::new(x, 0.0, 0.0), normal, Vector3::y()).unwrap();
        claymill_nurbs::analytic::plane_patch(&frame, (0.0, 60.0), (-30.0, 30.0)).unwrap()
    };
    for (room_mm, is_left) in [(0.0, false), (0.02, true)] {
        let width_mm = 2.0 * R + room_mm;
        // With others close behind, or their backs would be in reach.
        let at = [0.0, width_mm, -1.0, width_mm + 1.0];
        let slot = model(at.map(|x| side(x, Vector3::x())));
        let v = check(&slot, &job(&slot), &program([]));
        for of_wall in v.coverage.faces[..2].iter().map(|face| &face.by_state_mm2) {
            assert_eq!(
                of_wall.contains_key(&SurfaceState::ReachableLeft),
                is_left,
                "{width_mm}: {of_wall:?}"
            );
        }
    }
}

#[test]
fn a_pass_too_low() {
    for depth in [0.005, 0.0061] {
        let mut moves = rows();
        shift(&mut moves[7], 2, -depth);
        let v = plate_with(moves);
        approx::assert_abs_diff_eq!(v.gouge.deepest_mm, depth, epsilon = 1e-9);
        assert_eq!(v.gouge.deepest_at.as_ref().unwrap().move_seq, Some(7));
        assert!(v.gouge.deeper_than_2_um > 50);
    }
    let mut moves = rows();
    shift(&mut moves[7], 2, -0.0061);
    assert!(has(&plate_with(moves), FindingCode::Gouge));
}

#[test]
fn a_pass_too_high() {
    let mut moves = rows();
    shift(&mut moves[7], 2, 0.007);
    let v = plate_with(moves);
    approx::assert_abs_diff_eq!(v.contact.excess_max_mm, 0.007, epsilon = 1e-9);
    assert!(has(&v, FindingCode::Excess) && !synthetic::is_sound(&v));
}

#[test]
fn a_neighbour_in_the_way_is_gouged() {
    // A pin with a round head between two samples, high enough to touch by 3 µm at one place only.
    let (pin, depth) = (0.5, 0.003);
    let y = STEP * 10.0 - 0.5;
    let head = Point3::new(30.37, y + 4.0, 0.0);
    let z = R - ((R + pin - depth).powi(2) - 16.0).sqrt();
    let frame = Frame::new(Point3::new(head.x, head.y, z), Vector3::z(), Vector3::x()).unwrap();
    let ball = sphere(&frame, pin, (0.0, std::f64::consts::TAU), (0.0, 1.5)).unwrap();
    let mut moves = rows();
    moves.truncate(11);
    assert!(plate_with(moves.clone()).gouge.deepest_mm < 1e-9);

    let model = model([plate(), ball]);
    let v = check(&model, &job(&model), &program(moves));
    approx::assert_abs_diff_eq!(v.gouge.deepest_mm, depth, epsilon = 1e-5);
    let at = v.gouge.deepest_at.unwrap();
    assert_eq!((at.move_seq, at.face, at.entity.as_deref()), (Some(10), Some(1), Some("DE 3")));
    approx::assert_abs_diff_eq!(at.parameter.unwrap(), head.x, epsilon = 0.02);
}

#[test]
fn leads_are_looked_at_too() {
    let mut moves = rows();
    let (a, b) = (Point3::new(60.0, 15.0, R), Point3::new(50.0, 15.0, R - 0.5));
    moves.push(straight(LeadOut, 25, a, b));
    approx::assert_abs_diff_eq!(plate_with(moves).gouge.deepest_mm, 0.5, epsilon = 1e-9);
}

#[test]
fn rapids_high_and_low() {
    let model = model([plate(), rectangle((25.0, 35.0), (10.0, 20.0), 8.0)]);
    let rapid = |height: f64| {
        let at = |x: f64| Point3::new(x, 12.0, height + R);
        let v = check(&model, &job(&model), &program([straight(Rapid, 0, at(0.0), at(60.0))]));
        (v.rapids.clone(), has(&v, FindingCode::RapidTouches))
    };
    let (high, found) = rapid(12.0);
    approx::assert_abs_diff_eq!(high.clearance_min_mm.unwrap(), 4.0, epsilon = 0.05);
    assert!(!found && high.touching == 0);
    let (low, found) = rapid(5.0);
    approx::assert_abs_diff_eq!(low.clearance_min_mm.unwrap(), -3.0, epsilon = 0.05);
    assert!(found && low.touching == 1);
    let at = low.clearance_min_at.unwrap();
    assert!((15.0..=45.0).contains(&at.point_mm[0]), "{at:?}");
}

#[test]
fn reasons_for_what_is_not_cut() {
    // A plate, a roof over its right half, a groove that is too narrow, a plate that is left out.
    let frame = Frame::new(Point3::new(0.0, 100.0, 6.0), Vector3::x(), -Vector3::z()).unwrap();
    let model = model([
        plate(),
        rectangle((30.0, 90.0), (-30.0, 60.0), 60.0),
        cylinder(&frame, 6.0, (-1.0, 1.0), (0.0, 60.0)).unwrap(),
        rectangle((0.0, 60.0), (200.0, 230.0), 0.0),
    ]);
    let mut job = job(&model);
    let total = job.faces[3].area.total_mm2;
    job.faces[3].area.uncut_mm2.insert(UncutReason::Excluded, total);
    let v = check(&model, &job, &program([]));
    let area = |face: usize, state| {
        let by_state = &v.coverage.faces[face].by_state_mm2;
        by_state.get(&state).copied().unwrap_or(0.0)
    };
    // The shank touches the roof's edge up to R before it.
    approx::assert_relative_eq!(area(0, SurfaceState::ReachableLeft), 20.0 * 30.0, max_relative = 0.01);
    approx::assert_relative_eq!(area(0, SurfaceState::TooTight), 10.0 * 30.0, max_relative = 0.02);
    approx::assert_relative_eq!(area(0, SurfaceState::Hidden), 30.0 * 30.0, max_relative = 0.01);
    approx::assert_relative_eq!(area(1, SurfaceState::ReachableLeft), 60.0 * 90.0, max_relative = 1e-9);
    approx::assert_relative_eq!(area(2, SurfaceState::TooTight), 12.0 * 60.0, max_relative = 1e-6);
    approx::assert_relative_eq!(area(3, SurfaceState::Excluded), 1800.0, max_relative = 1e-9);
    let sum: f64 = v.coverage.by_state_mm2.values().sum();
    approx::assert_relative_eq!(sum, v.coverage.total_mm2, max_relative = 1e-9);
    assert!(has(&v, FindingCode::NothingCut) && has(&v, FindingCode::PlannerAccount));
}

#[test]
fn a_groove_says_how_wide_it_is_and_which_balls_fit() {
    // Walls rise by 30° on both sides of x = 0: the ball of 10 mm touches them 5 mm from there in plan, and one that touches a
    // wall at a distance s from the bottom fits if it is no larger than s·tan 60°.
    let rise = 30f64.to_radians().tan();
    let wall = |x: f64| {
        let knots = || KnotVector::clamped_uniform(1, 2);
        let corners = [(0.0, 0.0), (0.0, 60.0), (x, 0.0), (x, 60.0)];
        let points = corners.map(|(x, y)| Point3::new(x, y, x.abs() * rise)).to_vec();
        NurbsSurface::new(knots(), knots(), points, None).unwrap()
    };
    let model = model([wall(-30.0), wall(30.0)]);
    let v = check(&model, &job(&model), &program([]));
    let tight = v.coverage.too_tight.unwrap();
    let strip_mm = 2.0 * 5.0 / 30f64.to_radians().cos();
    // At the very bottom no pin is thin enough to see it.
    let unseen_mm2 = v.coverage.by_state_mm2[&SurfaceState::Hidden];
    approx::assert_relative_eq!(tight.area_mm2 + unseen_mm2, strip_mm * 60.0, max_relative = 0.01);
    assert!(unseen_mm2 < 0.1 * tight.area_mm2);
    for width_mm in [tight.width_median_mm, tight.width_p95_mm, tight.width_max_mm] {
        approx::assert_relative_eq!(width_mm, strip_mm, max_relative = 1e-6);
    }
    for ball in &tight.balls {
        approx::assert_abs_diff_eq!(ball.share, 1.0 - ball.radius_mm / R, epsilon = 0.03);
    }
}

#[test]
fn under_an_arch_everything_is_hidden() {
    let frame = Frame::new(Point3::new(-20.0, 15.0, -20.0), Vector3::x(), Vector3::z()).unwrap();
    let arch = cylinder(&frame, 80.0, (-0.8, 0.8), (0.0, 100.0)).unwrap();
    let model = model([plate(), arch]);
    let v = check(&model, &job(&model), &program([]));
    approx::assert_relative_eq!(v.coverage.faces[0].by_state_mm2[&SurfaceState::Hidden], 1800.0);
    approx::assert_relative_eq!(
        v.coverage.faces[1].by_state_mm2[&SurfaceState::ReachableLeft],
        v.coverage.faces[1].area_mm2
    );
}

#[test]
fn the_thread_count_changes_nothing() {
    let model = model([plate(), rectangle((25.0, 35.0), (10.0, 20.0), 8.0)]);
    let job = job(&model);
    let mut moves = rows();
    shift(&mut moves[9], 1, 0.3);
    let program = program(moves);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| format!("{:?}", check(&model, &job, &program)))
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn a_share_is_never_all_when_one_place_is_not() {
    // One place of one row is too high, by a hump that is narrower than the spacing of the samples.
    let hump = |y: f64, by: f64| {
        let (x, half) = (30.5, 0.4);
        let points = [0.0, 20.0, x - 2.0 * half, x - half, x, x + half, x + 2.0 * half, 40.0, 60.0];
        let points: Vec<Point3> =
            points.map(|at| Point3::new(at, y, R + if at == x { by } else { 0.0 })).to_vec();
        let (a, b) = (x - half, x + half);
        let knots = vec![0.0, 0.0, 0.0, 0.0, a - 0.1, a, x, b, b + 0.1, 60.0, 60.0, 60.0, 60.0];
        synthetic::along(
            Cut,
            7,
            &claymill_nurbs::Curve3::new(KnotVector::new(3, knots).unwrap(), points, None).unwrap(),
        )
    };
    for (by, is_outside) in [(0.004, false), (0.02, true)] {
        let mut moves = rows();
        let y = moves[7].points[0][1];
        moves[7] = hump(y, by);
        let v = plate_with(moves);
        let contact = &v.contact;
        assert_eq!(has(&v, FindingCode::Excess), is_outside, "{contact:?}");
        assert_eq!(contact.excess_max_mm > 0.005, is_outside, "{contact:?}");
        assert_eq!(contact.outside > 0, is_outside, "{contact:?}");
        assert_eq!(contact.within_limit_share < 1.0, is_outside, "{contact:?}");
        assert_eq!(
            contact.within_limits().starts_with("100.000 %"),
            !is_outside,
            "{}",
            contact.within_limits()
        );
        assert!(contact.within_limits().ends_with(" within ±5.0 µm"), "{}", contact.within_limits());
        let finding = v.verdict.findings.iter().find(|f| f.code == FindingCode::Excess);
        assert!(finding.is_none_or(|f| f.message.contains("99.9")), "{finding:?}");
    }
}

#[test]
fn a_pass_that_runs_out_over_an_open_rim_stands_off_it() {
    // Straight on at the height of the plate, the ball's side leaves the rim by `√(R² + d²) − R`; rolling over it, it does not.
    let out_mm = 1.7_f64;
    let lower_mm = R - (R * R - out_mm * out_mm).sqrt();
    for (drop_mm, off_mm) in [(0.0, (R * R + out_mm * out_mm).sqrt() - R), (lower_mm, 0.0)] {
        let mut moves = rows();
        moves.retain(|m| (0.0..30.0).contains(&m.points[0][1]));
        let end = moves[5].end();
        let last = Point3::new(end.x + out_mm, end.y, end.z - drop_mm);
        // Around the rim, in steps too small to matter.
        let at = |k: f64| {
            let d = out_mm * k / 50.0;
            let fall = if drop_mm > 0.0 { R - (R * R - d * d).sqrt() } else { 0.0 };
            Point3::new(end.x + d, end.y, R - fall)
        };
        assert!((at(50.0).z - R - last.z).abs() < 1e-9);
        moves.extend((0..50).map(|k| straight(Cut, 90, at(f64::from(k)), at(f64::from(k) + 1.0))));
        let v = plate_with(moves);
        let contact = &v.contact;
        assert!(contact.excess_max_mm < 1e-3 + 0.2 * off_mm && contact.on_edge_share > 0.0, "{contact:?}");
        approx::assert_abs_diff_eq!(contact.edge_excess_max_mm, off_mm, epsilon = 1e-4);
        assert_eq!(has(&v, FindingCode::Rim), off_mm > 0.0, "{:?}", v.verdict);
    }
}
