//! Passes of flat and bull-nosed ends whose answers are known, and faults planted into them.

use crate::synthetic::{H, check, is_sound, job, model, program};
use claymill_nurbs::analytic::{Frame, plane_patch};
use claymill_nurbs::{Model, Point3, Vector3};
use claymill_toolpath::{End, Job, Move, MoveKind, Tool};
use claymill_verify::{FindingCode, Verification};

const RADIUS: f64 = 10.0;
const SLOPE_DEG: f64 = 10.0;
/// Exact steps uphill at this slope for a scallop of 0.02 mm: a bull of 2 mm, and a flat end.
const CASES: [(f64, f64); 2] = [(2.0, 2.764_115_340), (0.0, 3.026_709_645)];

/// The plane, and directions on it: uphill and its normal.
fn ground() -> (Model, Vector3, Vector3) {
    let (sine, cosine) = SLOPE_DEG.to_radians().sin_cos();
    let (n, uphill) = (Vector3::new(-sine, 0.0, cosine), Vector3::new(cosine, 0.0, sine));
    let at = Frame::new(Point3::origin(), n, uphill).unwrap();
    (model([plane_patch(&at, (0.0, 60.0), (0.0, 30.0)).unwrap()]), uphill, n)
}

/// Passes uphill, so far apart, of a tool that touches the plane.
fn passes(corner_mm: f64, step_mm: f64) -> Vec<Move> {
    let (_, uphill, n) = ground();
    let outward = Vector3::new(n.x, 0.0, 0.0).normalize();
    let lift = n * corner_mm + outward * (RADIUS - corner_mm) - Vector3::z() * corner_mm;
    let count = (30.0 / step_mm).ceil() as u32;
    let pass = |k: u32| {
        let y = f64::from(k) * step_mm;
        let [a, b] = [0.0, 60.0].map(|along| Point3::new(0.0, y, 0.0) + uphill * along + lift);
        let mut m = Move::straight(MoveKind::Cut, a, b, Vector3::z(), 6000.0);
        (m.pass, m.setup, m.tool) = (k, "top".into(), "T1".into());
        m
    };
    (0..=count).map(pass).collect()
}

fn job_of(model: &Model, corner_mm: f64) -> Job {
    let end = match corner_mm {
        0.0 => End::Flat { radius_mm: RADIUS },
        corner_radius_mm => End::Bull { radius_mm: RADIUS, corner_radius_mm },
    };
    let mut job = job(model);
    job.request.tool = Tool::of(end);
    job.tools[0].tool = Tool::of(end);
    job
}

fn measured(corner_mm: f64, moves: Vec<Move>) -> Verification {
    let (model, ..) = ground();
    check(&model, &job_of(&model, corner_mm), &program(moves))
}

fn has(v: &Verification, code: FindingCode) -> bool {
    v.verdict.findings.iter().any(|f| f.code == code)
}

#[test]
fn exact_steps_leave_exact_crests() {
    for (corner_mm, step_mm) in CASES {
        let v = measured(corner_mm, passes(corner_mm, step_mm));
        assert!(is_sound(&v), "{:?}", v.verdict);
        // Crests are looked for between contacts that are known to a twentieth of a micrometre: a thousandth.
        approx::assert_relative_eq!(v.scallop.crests.p99_mm, H, max_relative = 1e-3);
        // The last pass runs beyond the border: where it begins the plane is some micrometres below its contact.
        assert!(v.gouge.deepest_mm < 1e-4, "{:?}", v.gouge);
        assert!(v.contact.within_limit_share == 1.0);
    }
}

#[test]
fn a_pass_lowered_by_20_um_gouges_by_that() {
    for (corner_mm, step_mm) in CASES {
        let mut moves = passes(corner_mm, step_mm);
        let middle = moves.len() / 2;
        for p in &mut moves[middle].points {
            p[2] -= 0.02;
        }
        let v = measured(corner_mm, moves);
        let depth = 0.02 * SLOPE_DEG.to_radians().cos();
        approx::assert_abs_diff_eq!(v.gouge.deepest_mm, depth, epsilon = 2e-4);
        assert!(has(&v, FindingCode::Gouge) && !is_sound(&v));
        assert_eq!(v.gouge.deepest_at.unwrap().move_seq, Some(middle as u64));
    }
}

#[test]
fn a_missing_pass_and_one_in_the_air_are_found() {
    for (corner_mm, step_mm) in CASES {
        let mut missing = passes(corner_mm, step_mm);
        missing.remove(5);
        let v = measured(corner_mm, missing);
        assert!(has(&v, FindingCode::ReachableLeft) && !is_sound(&v), "{:?}", v.verdict);
        let mut lifted = passes(corner_mm, step_mm);
        for p in &mut lifted[5].points {
            p[2] += 0.02;
        }
        assert!(has(&measured(corner_mm, lifted), FindingCode::Excess));
    }
}

#[test]
fn passes_of_one_end_are_not_those_of_another() {
    let (corner_mm, step_mm) = CASES[0];
    let (model, ..) = ground();
    let with = |end: End| {
        let mut other = job(&model);
        (other.request.tool, other.tools[0].tool) = (Tool::of(end), Tool::of(end));
        check(&model, &other, &program(passes(corner_mm, step_mm)))
    };
    let ball = with(End::Ball { radius_mm: RADIUS });
    // The ball touches where its own slope is: the bull's passes are in the air for it.
    assert!(has(&ball, FindingCode::NothingCut) && !is_sound(&ball), "{:?}", ball.verdict);
    let sharper = with(End::Bull { radius_mm: RADIUS, corner_radius_mm: 1.0 });
    assert!(has(&sharper, FindingCode::Gouge), "{:?}", sharper.verdict);
}
