//! Areas and boxes against closed forms.

use std::f64::consts::PI;

use crate::shapes::{
    backwards, circle, cylinder, ellipse, face, panel, plane, polygon, sphere, torus, trim_loop,
};
use claymill_nurbs::{Curve2, Face, Point2};

fn assert_area(face: &Face, expected: f64, accuracy: f64) {
    approx::assert_relative_eq!(face.area_mm2(), expected, max_relative = accuracy);
}

#[test]
fn whole_quadrics_have_their_area() {
    assert_area(&face(plane(3.0), vec![]), 36.0, 1e-14);
    assert_area(&face(cylinder(50.0, 100.0), vec![]), 2.0 * PI * 5000.0, 1e-9);
    assert_area(&face(sphere(40.0), vec![]), 4.0 * PI * 1600.0, 1e-9);
    assert_area(&face(torus(60.0, 20.0), vec![]), 4.0 * PI * PI * 1200.0, 1e-9);
}

#[test]
fn trimmed_faces_have_their_area() {
    assert_area(&face(plane(3.0), vec![circle((0.3, 0.1), 2.0)]), 4.0 * PI, 1e-9);
    let ring = vec![backwards(circle((0.0, 0.0), 2.0)), ellipse((0.5, 0.0), 0.7, 0.2)];
    assert_area(&face(plane(3.0), ring), PI * (4.0 - 0.14), 1e-9);
    let t = 2.0 * PI;
    let around = |v: f64| trim_loop([Curve2::line(Point2::new(1.0, v), Point2::new(1.0 + t, v))]);
    assert_area(&face(cylinder(5.0, 10.0), vec![around(2.0), around(7.0)]), t * 25.0, 1e-9);
    // Two quarter turns, where angle and parameter agree.
    let patch = polygon(&[(0.0, 2.0), (PI / 2.0, 2.0), (PI, 2.0), (PI, 5.0), (0.0, 5.0)]);
    assert_area(&face(cylinder(5.0, 10.0), vec![patch]), PI * 15.0, 1e-9);
}

#[test]
fn parts_of_a_panel_sum_to_the_whole() {
    let whole = face(panel(), vec![]).area_mm2();
    let hole = face(panel(), vec![ellipse((0.5, 0.5), 0.3, 0.2)]).area_mm2();
    let side = polygon(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]);
    let rest = face(panel(), vec![side, ellipse((0.5, 0.5), 0.3, 0.2)]).area_mm2();
    approx::assert_relative_eq!(hole + rest, whole, max_relative = 1e-9);
}

#[test]
fn boxes_are_tight() {
    let check = |face: &Face, min: [f64; 3], max: [f64; 3]| {
        let bounds = face.bounds();
        for k in 0..3 {
            assert!((bounds.min[k] - min[k]).abs() < 1e-4, "{bounds:?} {min:?}");
            assert!((bounds.max[k] - max[k]).abs() < 1e-4, "{bounds:?} {max:?}");
        }
    };
    check(&face(sphere(40.0), vec![]), [-40.0; 3], [40.0; 3]);
    check(&face(torus(60.0, 20.0), vec![]), [-80.0, -80.0, -20.0], [80.0, 80.0, 20.0]);
    check(
        &face(plane(300.0), vec![ellipse((10.0, 20.0), 100.0, 50.0)]),
        [-90.0, -30.0, 0.0],
        [110.0, 70.0, 0.0],
    );
    // Reaches over the top of the tube, which no vertex of its boundary does.
    let patch = polygon(&[(0.0, 1.0), (PI / 2.0, 1.0), (PI / 2.0, 2.0), (0.0, 2.0)]);
    assert!((face(torus(60.0, 20.0), vec![patch]).bounds().max.z - 20.0).abs() < 1e-4);
}
