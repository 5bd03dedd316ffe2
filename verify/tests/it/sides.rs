//! Cuts from the side of the material: each must be found with its area.

use crate::synthetic::{R, check, job, model, program, rectangle, straight};
use claymill_nurbs::{NurbsSurface, Point3};
use claymill_toolpath::MoveKind::Cut;
use claymill_toolpath::{FreeSide, Move};
use claymill_verify::{FindingCode, Severity, SurfaceState, Verification};

const STEP: f64 = 1.264_278_450_5;

/// Rows over the plate `z = 0`, the ball above it.
fn rows() -> Vec<Move> {
    let row = |k: u32| {
        let y = STEP * f64::from(k) - 0.5;
        straight(Cut, k, Point3::new(0.0, y, R), Point3::new(60.0, y, R))
    };
    (0..26).map(row).collect()
}

fn plate(free: FreeSide, surface: NurbsSurface) -> Verification {
    let model = model([surface]);
    let mut job = job(&model);
    job.faces[0].free_side = free;
    check(&model, &job, &program(rows()))
}

fn wrong_side(v: &Verification) -> Option<Severity> {
    v.verdict.findings.iter().find(|f| f.code == FindingCode::WrongSide).map(|f| f.severity)
}

#[test]
fn a_plate_that_is_cut_from_below_its_material_is_found_with_its_area() {
    for turned in [false, true] {
        let surface = || {
            let plate = rectangle((0.0, 60.0), (0.0, 30.0), 0.0);
            if turned { plate.reversed_u() } else { plate }
        };
        let points_up = surface().normal(30.0, 15.0).unwrap().0.z > 0.0;
        let (above, below) = (FreeSide::one(points_up), FreeSide::one(!points_up));

        let right = plate(above, surface());
        assert_eq!(wrong_side(&right), None, "{:?}", right.verdict);
        let sides = right.sides.unwrap();
        assert_eq!((sides.wrong_mm2, sides.wrong_length_mm, sides.inside_mm2), (0.0, 0.0, 0.0));
        approx::assert_relative_eq!(sides.one_sided_mm2, 1800.0, max_relative = 1e-9);

        let wrong = plate(below, surface());
        assert_eq!(wrong_side(&wrong), Some(Severity::Error));
        assert!(!wrong.verdict.passed);
        let sides = wrong.sides.unwrap();
        // All but a strip along the border, in which that is nearest to the ball, or hardly farther away.
        let strip_mm2 = 1800.0 - sides.wrong_mm2;
        assert!((0.2 * 180.0..0.4 * 180.0).contains(&strip_mm2), "{strip_mm2}");
        // 23 rows lie 0.2 mm and more inside of the plate, and all of each but its two ends.
        approx::assert_relative_eq!(sides.wrong_length_mm, 23.0 * 59.0, max_relative = 1e-3);
        assert_eq!(sides.wrong_at.unwrap().face, Some(0));
        assert!(!wrong.coverage.by_state_mm2.contains_key(&SurfaceState::Cut));

        let either = plate(FreeSide::Both, surface());
        assert_eq!(either.sides, None);
        assert!(either.coverage.by_state_mm2[&SurfaceState::Cut] > 1790.0);
    }
}

#[test]
fn a_ball_that_runs_past_a_sharp_edge_cuts_only_the_face_that_it_touches() {
    // Two plates that meet at x = 0 under 1°, with the material between them.
    let slope = 1f64.to_radians().tan();
    let lower = || {
        let corner = |x: f64, y: f64| Point3::new(x, y, -slope * x);
        let knots = || claymill_nurbs::KnotVector::clamped_uniform(1, 2);
        let corners = [(0.0, 0.0), (0.0, 30.0), (60.0, 0.0), (60.0, 30.0)].map(|(x, y)| corner(x, y));
        NurbsSurface::new(knots(), knots(), corners.to_vec(), None).unwrap()
    };
    let upper = || rectangle((0.0, 60.0), (0.0, 30.0), 0.0);
    let looks_up = |surface: NurbsSurface| surface.normal(30.0, 15.0).unwrap().0.z > 0.0;
    let sides = || {
        let model = model([upper(), lower()]);
        let mut job = job(&model);
        job.faces[0].free_side = FreeSide::one(looks_up(upper()));
        job.faces[1].free_side = FreeSide::one(!looks_up(lower()));
        check(&model, &job, &program(rows())).sides.unwrap()
    };
    // Near the edge the rows over the upper plate are less than what counts as cut above the lower one.
    let right = sides();
    assert_eq!((right.wrong_mm2, right.wrong_length_mm), (0.0, 0.0));
}

/// The six sides of a box around the rows.
fn around() -> Vec<NurbsSurface> {
    use claymill_nurbs::Vector3;
    use claymill_nurbs::analytic::{Frame, plane_patch};
    let wall = |origin: [f64; 3], z: Vector3, x: Vector3, u: (f64, f64), v: (f64, f64)| {
        plane_patch(&Frame::new(Point3::from(origin), z, x).unwrap(), u, v).unwrap()
    };
    let (x, y) = (Vector3::x(), Vector3::y());
    // The second direction of a frame around y is −z if the first is x, that of one around x is z if the first is y.
    vec![
        rectangle((-20.0, 80.0), (-20.0, 50.0), 0.0),
        rectangle((-20.0, 80.0), (-20.0, 50.0), 60.0),
        wall([0.0, -20.0, 0.0], y, x, (-20.0, 80.0), (-60.0, 0.0)),
        wall([0.0, 50.0, 0.0], y, x, (-20.0, 80.0), (-60.0, 0.0)),
        wall([-20.0, 0.0, 0.0], x, y, (-20.0, 50.0), (0.0, 60.0)),
        wall([80.0, 0.0, 0.0], x, y, (-20.0, 50.0), (0.0, 60.0)),
    ]
}

#[test]
fn the_inside_of_a_body_is_told_by_closedness_alone() {
    let inside = |surfaces: Vec<NurbsSurface>, asked: bool| {
        let model = model(surfaces);
        let mut job = job(&model);
        if asked {
            job.request.material_side = vec!["both".into()];
        }
        let v = check(&model, &job, &program(rows()));
        let errors = v.verdict.findings.iter();
        let found =
            errors.filter(|f| f.code == FindingCode::WrongSide && f.severity == Severity::Error).count();
        (found, v.sides.map_or(0.0, |s| s.inside_mm2))
    };
    let (found, mm2) = inside(around(), false);
    assert_eq!(found, 1);
    // 60 × 31.6 and a margin that the ends of the rows leave below the bar.
    assert!((1800.0..2100.0).contains(&mm2), "{mm2}");
    assert_eq!(inside(around(), true), (0, 0.0));
    let mut open = around();
    open.remove(1);
    assert_eq!(inside(open, false), (0, 0.0));
}
