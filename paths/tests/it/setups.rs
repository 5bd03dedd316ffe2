//! Setups are a list of frames: what they see is cut, and nothing else.

use crate::few_faces::planned;
use claymill_nurbs::analytic::{Frame as Placement, plane_patch};
use claymill_nurbs::{NurbsSurface, Point3, Vector3};
use claymill_paths::{Orientation, PlanOptions};
use claymill_toolpath::MoveKind;

const SIDE_MM: f64 = 40.0;

/// The upper and the lower side of a slab.
fn slab() -> [NurbsSurface; 2] {
    [(0.0, -Vector3::z()), (10.0, Vector3::z())].map(|(z, out)| {
        let at = Placement::new(Point3::new(0.0, 0.0, z), out, Vector3::x()).unwrap();
        let half = 0.5 * SIDE_MM;
        plane_patch(&at, (-half, half), (-half, half)).unwrap()
    })
}

/// Area cut and not cut, mm²; all cuts must run with the tool along one of the axes.
fn in_setups(names: &[&str], axes: &[Vector3]) -> [f64; 2] {
    let upright = Orientation::new("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap();
    let setups = names.iter().map(|name| upright.setup(name).unwrap()).collect();
    let plan = planned(slab(), 5.0, 0.1, |usual| PlanOptions { setups, ..usual });
    for cut in plan.program.moves.iter().filter(|m| m.kind == MoveKind::Cut) {
        assert!(axes.contains(&cut.axis_start.into()), "{:?}", cut.axis_start);
    }
    [plan.area.cut_mm2, plan.area.uncut_mm2.values().sum()]
}

#[test]
fn the_bottom_is_cut_only_by_a_setup_that_sees_it() {
    let (up, side_mm2) = (Vector3::z(), SIDE_MM * SIDE_MM);
    for (names, axes, expected) in [
        (&[][..], &[up][..], [side_mm2, side_mm2]),
        (&["top"], &[up], [side_mm2, side_mm2]),
        (&["bottom"], &[-up], [side_mm2, side_mm2]),
        (&["bottom", "left", "top"], &[up, -up], [2.0 * side_mm2, 0.0]),
    ] {
        let found = in_setups(names, axes);
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6 * side_mm2, "{names:?}: {found} of {expected} mm²");
        }
    }
}
