//! Pencil passes in valleys whose bottom is known exactly.

use std::f64::consts::TAU;

use claymill_nurbs::analytic::{Frame as Placement, cone, plane_patch};
use claymill_nurbs::{Face, NurbsSurface, Point3, Vector3};
use claymill_paths::{Orientation, PlanOptions, Regions, plan};
use claymill_surface_merge::{MergeOptions, merge};
use claymill_toolpath::{MoveKind, Tool};

const R: f64 = 10.0;

/// Length of the cuts from above on which the ball's centre is everywhere within 6 µm above `height`, and at most 2 µm
/// beside where `beside` is 0, mm.
fn in_the_valley_mm(
    surfaces: Vec<NurbsSurface>,
    pencil: bool,
    height: f64,
    beside: impl Fn(&Point3) -> f64,
) -> f64 {
    let model = claymill_tests::model_of(surfaces);
    let areas: Vec<f64> = model.faces.iter().map(Face::area_mm2).collect();
    let merged = merge(&model, &MergeOptions::default()).unwrap();
    let excluded = vec![false; areas.len()];
    let regions = Regions {
        merged: &merged,
        of_face: &merged.region_of_face,
        excluded: &excluded,
        face_area_mm2: &areas,
    };
    let top = Orientation::new("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap();
    let options =
        PlanOptions { pencil, row_angle_deg: Some(30.0), ..PlanOptions::new(Tool::ball(R), 0.1, top) };
    let plan = plan(&model, &regions, &options, &()).unwrap();
    let from_above =
        |m: &&claymill_toolpath::Move| m.kind == MoveKind::Cut && m.axis_start == [0.0, 0.0, 1.0];
    let mut length = 0.0;
    for cut in plan.program.moves.iter().filter(from_above) {
        let curve = cut.curve().unwrap();
        let (a, b) = curve.domain();
        let places: Vec<Point3> =
            (0..=200).map(|k| curve.point(a + (b - a) * f64::from(k) / 200.0) + Vector3::z() * R).collect();
        if places.iter().all(|p| beside(p).abs() < 2e-3 && (0.0..6e-3).contains(&(p.z - height))) {
            length += places.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>();
        }
    }
    length
}

fn upright() -> Placement {
    Placement::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap()
}

#[test]
fn around_a_cone_on_a_plane() {
    let model = || {
        let floor = plane_patch(&upright(), (-60.0, 60.0), (-60.0, 60.0)).unwrap();
        let side = cone(&upright(), 30.0, -(30f64.to_radians()), (0.0, TAU), (0.0, 20.0)).unwrap();
        vec![floor, side]
    };
    // On a floor beside a wall that leans by 60°, the ball is R·tan 30° away from the wall's foot.
    let radius = 30.0 + R * 30f64.to_radians().tan();
    let beside = |p: &Point3| p.x.hypot(p.y) - radius;
    let around = in_the_valley_mm(model(), true, R, beside);
    assert!((around - TAU * radius).abs() < 2.0, "{around} mm instead of {}", TAU * radius);
    assert_eq!(in_the_valley_mm(model(), false, R, beside), 0.0);
}

#[test]
fn along_a_groove() {
    // Walls that lean by 30°: the ball hangs R·sec 30° above the bottom.
    let wall = |lean: f64| {
        let across = Vector3::new(lean.cos(), 0.0, lean.sin().abs());
        let normal = Vector3::new(-across.z * lean.cos().signum(), 0.0, across.x.abs());
        let placement = Placement::new(Point3::origin(), normal, Vector3::y()).unwrap();
        plane_patch(&placement, (-50.0, 50.0), if lean.cos() > 0.0 { (-40.0, 0.0) } else { (0.0, 40.0) })
    };
    let lean = 30f64.to_radians();
    let walls = vec![wall(lean).unwrap(), wall(std::f64::consts::PI - lean).unwrap()];
    let along = in_the_valley_mm(walls, true, R / lean.cos(), |p| p.x);
    assert!((along - 100.0).abs() < 2.0, "{along} mm instead of 100");
}
