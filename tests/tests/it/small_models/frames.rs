//! Setups in any direction, and allowances: what is known of a job does not change when model and setup are turned, or when
//! another ball has the same centres.

use claymill_nurbs::{ClosestPoints, Face, KnotVector, Model, NurbsSurface, Point3, SurfaceKind};
use claymill_paths::{Frame, PlanOptions, Strategy};
use claymill_toolpath::{MoveKind, raise_tips};
use claymill_verify::{VerifyOptions, verify_program};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::planned_with;

const RADIUS_MM: f64 = 5.0;
const SCALLOP_MM: f64 = 0.1;

/// A sheet of about 80 mm by 60 mm with hills and valleys.
fn sheet() -> Model {
    let knots = |n: usize| {
        let inner = (1..n - 3).map(|k| k as f64);
        let end = (n - 3) as f64;
        KnotVector::new(3, [0.0; 4].into_iter().chain(inner).chain([end; 4]).collect()).unwrap()
    };
    let (rows, columns) = (7, 6);
    let mut net = Vec::new();
    for i in 0..rows {
        for j in 0..columns {
            let (x, y) = (83.3 * i as f64 / 6.0 - 40.0, 61.7 * j as f64 / 5.0 - 30.0);
            net.push(Point3::new(x, y, 6.0 * (x / 14.0).sin() + 4.0 * (y / 16.0).cos()));
        }
    }
    let surface = NurbsSurface::new(knots(rows), knots(columns), net, None).unwrap();
    let face = Face {
        surface,
        loops: Vec::new(),
        reversed: false,
        kind: SurfaceKind::Spline,
        source: claymill_nurbs::Source::default(),
    };
    Model { faces: vec![face], ..Model::default() }
}

fn cut_mm(moves: &[claymill_toolpath::Move]) -> f64 {
    moves.iter().filter(|m| m.kind == MoveKind::Cut).map(claymill_toolpath::Move::length_mm).sum()
}

#[test]
fn a_model_that_is_turned_with_its_setup_is_cut_alike() {
    let model = sheet();
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    for strategy in [Strategy::Planar, Strategy::Scallop, Strategy::SteepShallow] {
        let upright = Frame::turned("odd", [1, 0, 0, 0]).unwrap();
        let cut_in = |model: &Model, frame: Frame| {
            let turned = |usual| PlanOptions { setups: vec![frame], ..usual };
            planned_with(model, strategy, RADIUS_MM, SCALLOP_MM, turned).unwrap()
        };
        let (_, plan) = cut_in(&model, upright);
        let upright_mm = cut_mm(&plan.program.moves);
        for _ in 0..4 {
            let quaternion = std::array::from_fn(|_| rng.random_range(-(1 << 20)..1 << 20));
            let frame = Frame::turned("odd", quaternion).unwrap();
            let faces = model
                .faces
                .iter()
                .map(|f| Face { surface: f.surface.mapped(|p| frame.to_model(&p)), ..f.clone() });
            let turned = Model { faces: faces.collect(), ..Model::default() };
            let (job, plan) = cut_in(&turned, frame);
            assert_eq!(job.setups[0].quaternion, Some(quaternion));
            let found = verify_program(&turned, &job, &plan.program, &VerifyOptions::default(), &()).unwrap();
            let turned_mm = cut_mm(&plan.program.moves);
            let what = format!("{strategy} {quaternion:?}: {turned_mm} mm of {upright_mm} mm");
            assert!(found.verdict.passed, "{what}: {:?}", found.verdict);
            assert!(found.gouge.deepest_mm < 1e-3, "{what}: {}", found.gouge.deepest_mm);
            assert!(
                found.scallop.crests.p99_mm < 1.05 * SCALLOP_MM,
                "{what}: {}",
                found.scallop.crests.p99_mm
            );
            assert!((turned_mm / upright_mm - 1.0).abs() < 1e-3, "{what}");
        }
    }
}

/// Every cutter location of a job with an allowance keeps it from the exact surface, and touches there somewhere.
#[test]
fn an_allowance_is_what_is_left() {
    let model = sheet();
    for (allowance_mm, strategy) in
        [(2.0, Strategy::Planar), (0.3, Strategy::Scallop), (-0.25, Strategy::Planar)]
    {
        let change = |usual| PlanOptions { allowance_mm, ..usual };
        let (job, plan) = planned_with(&model, strategy, RADIUS_MM, SCALLOP_MM, change).unwrap();
        let found = verify_program(&model, &job, &plan.program, &VerifyOptions::default(), &()).unwrap();
        assert!(found.verdict.passed, "{allowance_mm}: {:?}", found.verdict);
        assert_eq!(found.allowance_mm, allowance_mm);
        let closest = ClosestPoints::new(&model);
        let (mut least_mm, mut most_mm) = (f64::INFINITY, f64::NEG_INFINITY);
        for m in plan.program.moves.iter().filter(|m| m.kind == MoveKind::Cut) {
            let curve = m.curve().unwrap();
            let (a, b) = curve.domain();
            for k in 0..=20 {
                let tip = curve.point(a + (b - a) * f64::from(k) / 20.0);
                let centre = tip + claymill_nurbs::Vector3::from(m.axis_start) * RADIUS_MM;
                let left_mm = closest.closest(&centre, 3.0 * RADIUS_MM).unwrap().distance_mm - RADIUS_MM;
                (least_mm, most_mm) = (least_mm.min(left_mm), most_mm.max(left_mm));
            }
        }
        assert!((least_mm - allowance_mm).abs() < 5e-3, "{allowance_mm}: {least_mm}");
        assert!(most_mm < allowance_mm + 5e-3, "{allowance_mm}: {most_mm}");
    }
}

/// The verifier finds that the moves are lower, or the allowance larger, than the job says.
#[test]
fn an_allowance_that_is_not_left_is_found() {
    let model = sheet();
    let change = |usual| PlanOptions { allowance_mm: 1.0, ..usual };
    let (job, mut plan) = planned_with(&model, Strategy::Planar, RADIUS_MM, SCALLOP_MM, change).unwrap();
    raise_tips(&mut plan.program.moves, -0.02);
    let found = verify_program(&model, &job, &plan.program, &VerifyOptions::default(), &()).unwrap();
    assert!(!found.verdict.passed);
    assert!((found.gouge.deepest_mm - 0.02).abs() < 2e-3, "{}", found.gouge.deepest_mm);
}
