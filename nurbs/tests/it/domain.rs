//! The inside test against analytic predicates.

use std::f64::consts::PI;

use crate::shapes::{
    backwards, circle, cylinder, ellipse, face, plane, polygon, random_points, sphere, trim_loop,
};
use claymill_nurbs::{Curve2, Domain, Face, Point2, TrimLoop};

/// Compares with `signed`, positive inside and of the size of the distance from the boundary, on a million random
/// points of the domain.
fn check(face: &Face, signed: impl Fn(f64, f64) -> f64) {
    let domain = Domain::new(face);
    let ((u0, u1), (v0, v1)) = face.surface.domain();
    let mut inside = 0;
    for (x, y) in random_points(1_000_000) {
        let (u, v) = (u0 + (u1 - u0) * x, v0 + (v1 - v0) * y);
        let expected = signed(u, v);
        if expected.abs() > 1e-9 {
            assert_eq!(domain.contains(u, v), expected > 0.0, "at ({u}, {v})");
            inside += i32::from(expected > 0.0);
        }
    }
    assert!(inside > 2500, "the test must see the inside");
}

fn in_circle(u: f64, v: f64, (x, y): (f64, f64), r: f64) -> f64 {
    r - (u - x).hypot(v - y)
}

#[test]
fn the_whole_surface_is_its_rectangle() {
    let domain = Domain::new(&face(plane(2.0), vec![]));
    assert!(domain.contains(0.0, 0.0) && domain.contains(2.0, -2.0) && !domain.contains(2.1, 0.0));
}

#[test]
fn circles_and_ellipses_are_exact() {
    check(&face(plane(2.0), vec![circle((0.2, -0.1), 1.3)]), |u, v| in_circle(u, v, (0.2, -0.1), 1.3));
    check(&face(plane(2.0), vec![ellipse((0.0, 0.0), 1.9, 0.01)]), |u, v| {
        (1.0 - (u / 1.9).hypot(v / 0.01)) * 0.01
    });
}

#[test]
fn points_within_a_billionth_of_the_curve_are_right() {
    let domain = Domain::new(&face(plane(2.0), vec![circle((0.2, -0.1), 1.3)]));
    for (x, _) in random_points(50_000) {
        let (sin, cos) = (x * 2.0 * PI).sin_cos();
        for (r, inside) in [(1.3 - 1e-12, true), (1.3 + 1e-12, false)] {
            assert_eq!(domain.contains(0.2 + r * cos, -0.1 + r * sin), inside, "{x} {r}");
        }
    }
}

#[test]
fn direction_does_not_matter() {
    for (outer, hole) in [(false, false), (false, true), (true, false), (true, true)] {
        let turn = |flag, ring| if flag { backwards(ring) } else { ring };
        let loops = vec![
            turn(hole, circle((0.5, 0.0), 0.4)),
            turn(outer, circle((0.0, 0.0), 1.5)),
            turn(outer, circle((0.5, 0.0), 0.1)),
        ];
        check(&face(plane(2.0), loops), |u, v| {
            let ring = in_circle(u, v, (0.0, 0.0), 1.5).min(-in_circle(u, v, (0.5, 0.0), 0.4));
            ring.max(in_circle(u, v, (0.5, 0.0), 0.1))
        });
    }
}

#[test]
fn a_hole_may_touch_or_cross_its_outer_loop() {
    for r in [0.5, 0.6] {
        let loops = vec![circle((0.0, 0.0), 1.5), circle((1.0, 0.0), r)];
        check(&face(plane(2.0), loops), |u, v| {
            in_circle(u, v, (0.0, 0.0), 1.5).min(-in_circle(u, v, (1.0, 0.0), r))
        });
    }
}

/// The control points of its arcs reach √2 times as far as a circle that begins aslant, beyond a tight outer loop.
#[test]
fn a_hole_is_one_however_far_its_control_points_reach() {
    let (sine, cosine) = (PI / 4.0).sin_cos();
    let aslant = |ring: TrimLoop| {
        let turned = |p: &Point2| Point2::new(cosine * p.x - sine * p.y, sine * p.x + cosine * p.y);
        trim_loop(ring.edges.iter().map(|e| {
            let c = &e.pcurve;
            let points = c.points().iter().map(turned).collect();
            Curve2::new(c.knots().clone(), points, c.weights().map(<[f64]>::to_vec)).unwrap()
        }))
    };
    let hole = || aslant(circle((0.0, 0.0), 1.0));
    let side = 1.02;
    let square = || polygon(&[(-side, -side), (side, -side), (side, side), (-side, side)]);
    for loops in
        [vec![square(), hole()], vec![backwards(hole()), square()], vec![hole(), backwards(square())]]
    {
        let plate = face(plane(2.0), loops);
        check(&plate, |u, v| (side - u.abs()).min(side - v.abs()).min(-in_circle(u, v, (0.0, 0.0), 1.0)));
        approx::assert_relative_eq!(plate.area_mm2(), 4.0 * side * side - PI, max_relative = 1e-9);
        assert!((plate.vector_area_mm2().z - plate.area_mm2()).abs() < 1e-6);
    }
}

#[test]
fn gaps_are_closed_by_straight_lines() {
    for gap in [1e-3, 1e-2, 1e-1] {
        let open = |a: (f64, f64), b: (f64, f64)| Curve2::line(Point2::new(a.0, a.1), Point2::new(b.0, b.1));
        let ring = trim_loop([
            open((-1.0, -1.0), (1.0 - gap, -1.0)),
            open((1.0, -1.0 + gap), (1.0, 1.0)),
            open((1.0 - gap, 1.0), (-1.0, 1.0)),
            open((-1.0, 1.0 - gap), (-1.0, -1.0 + gap)),
        ]);
        check(&face(plane(2.0), vec![ring]), |u, v| {
            // Three of the four gaps are closed along the sides; the one at (1, -1) cuts the corner.
            let square = (1.0 - u.abs()).min(1.0 - v.abs());
            square.min(2.0 - gap - (u - v))
        });
    }
}

#[test]
fn two_loops_around_a_cylinder_bound_the_band_between_them() {
    let level =
        |v: f64, from: f64, to: f64| trim_loop([Curve2::line(Point2::new(from, v), Point2::new(to, v))]);
    let t = 2.0 * PI;
    let band = |_: f64, v: f64| (v - 2.0).min(7.0 - v);
    for (low, high) in [
        (level(2.0, 0.0, t), level(7.0, t, 0.0)),
        (level(2.0, t, 0.0), level(7.0, 0.0, t)),
        (level(2.0, 0.0, t), level(7.0, 0.0, t)),
        (level(2.0, 1.0, 1.0 + t), level(7.0, 4.0, 4.0 - t)),
    ] {
        check(&face(cylinder(5.0, 10.0), vec![low.clone(), high.clone()]), band);
        check(&face(cylinder(5.0, 10.0), vec![high, low]), band);
    }
}

#[test]
fn a_loop_across_the_seam_is_seen_from_both_sides() {
    let t = 2.0 * PI;
    for centre in [0.0, t] {
        check(&face(cylinder(5.0, 10.0), vec![circle((centre, 5.0), 1.0)]), |u, v| {
            in_circle(u, v, (0.0, 5.0), 1.0).max(in_circle(u, v, (t, 5.0), 1.0))
        });
    }
}

#[test]
fn one_loop_around_a_sphere_bounds_a_cap() {
    let t = 2.0 * PI;
    let ring = trim_loop([Curve2::line(Point2::new(0.0, 0.3), Point2::new(t, 0.3))]);
    check(&face(sphere(5.0), vec![ring.clone()]), |_, v| v - 0.3);
    check(&face(sphere(5.0), vec![backwards(ring)]), |_, v| 0.3 - v);
}

#[test]
fn many_holes_are_all_found() {
    let mut loops = vec![polygon(&[(-1.9, -1.9), (1.9, -1.9), (1.9, 1.9), (-1.9, 1.9)])];
    let centre = |k: i32| -1.7 + 0.1 * f64::from(k);
    for i in 0..35 {
        loops.extend((0..35).map(|j| circle((centre(i), centre(j)), 0.04)));
    }
    let nearest = |c: f64| (((c + 1.7) / 0.1).round() * 0.1 - 1.7).clamp(-1.7, 1.7);
    check(&face(plane(2.0), loops), |u, v| {
        (1.9 - u.abs()).min(1.9 - v.abs()).min(-in_circle(u, v, (nearest(u), nearest(v)), 0.04))
    });
}
