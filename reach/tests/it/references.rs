//! Cases with answers worked out by hand.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use claymill_contact::{Axis, Frame};
use claymill_nurbs::analytic::{Frame as Placement, cylinder, sphere as ball};
use claymill_nurbs::{Point3, Vector3};
use claymill_reach::{Cover, Direction, Pose, Reach, Reacher, Sample, Seen, circle, cover, sphere};

use crate::shapes::{Shape, block, rectangle};

fn axis(text: &str) -> Axis {
    text.parse().unwrap()
}

fn reacher(steepest_deg: f64) -> Reacher {
    Reacher { steepest_deg, walls: false, ..Reacher::of("ball:2".parse().unwrap()) }
}

/// The fewest of some directions, proven.
fn fewest(shape: &Shape, reacher: &Reacher, directions: &[Direction], forced: &[usize]) -> (Reach, Cover) {
    let reach = Reach::new(&shape.part(), reacher, directions, &()).unwrap();
    let found = cover(&reach.table, forced, &()).unwrap();
    assert!(found.is_optimal(), "{} of at least {}", found.columns.len(), found.certificate.least);
    assert_eq!(found.certificate.check(&reach.table, forced), Ok(()));
    (reach, found)
}

#[test]
fn a_cube_takes_six_three_or_two_directions_by_how_far_it_may_lean() {
    let cube = Shape::around(Point3::new(20.0, 20.0, 20.0), block([40.0; 3]));
    let directions = sphere(&cube.part(), &[], 180.0, 2, (axis("+z"), axis("-y"))).unwrap();
    for (tilt_deg, count) in [(44.9, 6), (45.1, 3), (54.73, 3), (54.74, 2), (80.0, 2)] {
        let (reach, found) = fewest(&cube, &reacher(tilt_deg), &directions, &[]);
        assert_eq!(found.columns.len(), count, "{tilt_deg}");
        assert!(reach.unreached().is_empty());
    }
}

#[test]
fn a_sphere_takes_four_five_six_or_twelve() {
    let at = Placement::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    let sphere_of = ball(&at, 20.0, (0.0, TAU), (-FRAC_PI_2, FRAC_PI_2)).unwrap();
    let shape = Shape::around(Point3::origin(), vec![sphere_of]);
    let directions = sphere(&shape.part(), &[], 180.0, 1, (axis("+z"), axis("-y"))).unwrap();
    for (tilt_deg, count) in [(70.6, 4), (63.5, 5), (54.8, 6)] {
        let (_, found) = fewest(&shape, &reacher(tilt_deg), &directions, &[]);
        assert_eq!(found.columns.len(), count, "{tilt_deg}");
    }
    // The corners of an icosahedron and the cube's directions: no fewer than twelve of them do.
    let few = sphere(&shape.part(), &[], 180.0, 0, (axis("+z"), axis("-y"))).unwrap();
    let reach = Reach::new(&shape.part(), &reacher(37.5), &few, &()).unwrap();
    let found = cover(&reach.table, &[], &()).unwrap();
    assert_eq!(found.columns.len(), 12);
    assert_eq!(found.certificate.check(&reach.table, &[]), Ok(()));
}

#[test]
fn a_cylinder_on_a_rotary_axis_takes_as_many_angles_as_arcs_fit() {
    let at = Placement::new(Point3::origin(), Vector3::x(), Vector3::y()).unwrap();
    let round = cylinder(&at, 15.0, (0.0, TAU), (0.0, 60.0)).unwrap();
    let shape = Shape::free_where(vec![round], |p, n| n.dot(&Vector3::new(0.0, p.y, p.z)) > 0.0);
    let directions = circle(axis("+x"), 1.0, axis("+z"), axis("-y")).unwrap();
    for (tilt_deg, count) in [(80.0, 3), (60.0, 3), (45.0, 4), (30.0, 6), (10.0, 18)] {
        let (_, found) = fewest(&shape, &reacher(tilt_deg), &directions, &[]);
        assert_eq!(found.columns.len(), count, "{tilt_deg}");
    }
    // Forced angles are kept, and the rest is the fewest that there can be with them.
    let (_, found) = fewest(&shape, &reacher(60.0), &directions, &[0, 180]);
    assert_eq!((&found.columns[..2], found.chosen().len()), (&[0, 180][..], 2));
}

#[test]
fn a_slice_that_shows_four_directions_takes_two() {
    // Square: its four sides ask for four directions, two over opposite edges see all of it.
    let bar = Shape::around(Point3::new(30.0, 10.0, 10.0), block([60.0, 20.0, 20.0])[..4].to_vec());
    let directions = circle(axis("+x"), 1.0, axis("+z"), axis("-y")).unwrap();
    let (reach, found) = fewest(&bar, &reacher(80.0), &directions, &[]);
    assert_eq!(found.columns.len(), 2);
    assert!(reach.unreached().is_empty());
    for (tilt_deg, count) in [(44.0, 4), (45.0, 2)] {
        assert_eq!(fewest(&bar, &reacher(tilt_deg), &directions, &[]).1.columns.len(), count);
    }
}

#[test]
fn a_hexagon_takes_six_three_or_two() {
    let corner = |k: usize| {
        let (sine, cosine) = (k as f64 * PI / 3.0).sin_cos();
        Vector3::new(0.0, 12.0 * cosine, 12.0 * sine)
    };
    let side = |k: usize| {
        let (a, b) = (corner(k), corner(k + 1));
        rectangle([a.x, a.y, a.z], (b - a).into(), [50.0, 0.0, 0.0])
    };
    let shape =
        Shape::free_where((0..6).map(side).collect(), |p, n| n.dot(&Vector3::new(0.0, p.y, p.z)) > 0.0);
    let directions = circle(axis("+x"), 1.0, axis("+z"), axis("-y")).unwrap();
    for (tilt_deg, count) in [(29.0, 6), (30.0, 3), (59.0, 3), (60.0, 2)] {
        assert_eq!(fewest(&shape, &reacher(tilt_deg), &directions, &[]).1.columns.len(), count, "{tilt_deg}");
    }
}

#[test]
fn a_tool_tilts_in_a_slot_until_its_side_meets_the_rim() {
    const WIDTH: f64 = 30.0;
    for (below, most_deg) in [(40.0, 13.834_675_880), (20.0, 25.332_938_613)] {
        let (depth, half) = (below + 5.0, 0.5 * WIDTH);
        let slot = Shape::free_where(
            vec![
                rectangle([-100.0, -half, 0.0], [200.0, 0.0, 0.0], [0.0, WIDTH, 0.0]),
                rectangle([-100.0, -half, 0.0], [200.0, 0.0, 0.0], [0.0, 0.0, depth]),
                rectangle([-100.0, half, 0.0], [200.0, 0.0, 0.0], [0.0, 0.0, depth]),
                rectangle([-100.0, half, depth], [200.0, 0.0, 0.0], [0.0, 80.0, 0.0]),
                rectangle([-100.0, -half - 80.0, depth], [200.0, 0.0, 0.0], [0.0, 80.0, 0.0]),
            ],
            |p, n| n.dot(&(Point3::new(p.x, 0.0, depth) - p)) > 0.0 || (p.z > 0.9 * depth && n.z > 0.5),
        );
        let reacher = Reacher { allowed_mm: 1e-4, ..Reacher::of("ball:5".parse().unwrap()) };
        let part = slot.part();
        let covering = part.covering(5.0).unwrap();
        let floor = &slot.model.faces[0].surface;
        let ((u0, u1), (v0, v1)) = floor.domain();
        let uv = claymill_nurbs::Point2::new(0.5 * (u0 + u1), 0.5 * (v0 + v1));
        let (point, (normal, _)) = (floor.point(uv.x, uv.y), floor.normal(uv.x, uv.y).unwrap());
        let sample = Sample { face: 0, uv, point, normal, area_mm2: 1.0 };
        let gets_there = |deg: f64| {
            let (sine, cosine) = deg.to_radians().sin_cos();
            let frame = Frame::tilted("t", [0.0, sine, cosine], axis("+z"), axis("+x")).unwrap();
            Pose::new(&part, &reacher, &covering, &frame, None).seen(&sample) == Seen::Reached
        };
        let (mut low, mut high) = (0.0, 60.0);
        assert!(gets_there(low) && !gets_there(high));
        while high - low > 1e-7 {
            let middle = 0.5 * (low + high);
            if gets_there(middle) { low = middle } else { high = middle }
        }
        approx::assert_abs_diff_eq!(low, most_deg, epsilon = 1e-4);
    }
}

#[test]
fn a_holder_keeps_a_tool_out_that_would_reach_without_it() {
    // A floor 60 below the rim of a slot: a tool that sticks out 50 mm does not get down, one of 70 does.
    let slot = Shape::free_where(
        vec![
            rectangle([-100.0, -15.0, 0.0], [200.0, 0.0, 0.0], [0.0, 30.0, 0.0]),
            rectangle([-100.0, 15.0, 60.0], [200.0, 0.0, 0.0], [0.0, 80.0, 0.0]),
            rectangle([-100.0, -95.0, 60.0], [200.0, 0.0, 0.0], [0.0, 80.0, 0.0]),
        ],
        |_, n| n.z > 0.0,
    );
    let up = [Direction {
        frame: Frame::tilted("t", [0.0, 0.0, 1.0], axis("+z"), axis("+x")).unwrap(),
        origin: claymill_reach::Origin::Forced,
    }];
    let tool: claymill_toolpath::Tool = "ball:5".parse().unwrap();
    let reached = |stick_out_mm: Option<f64>| -> Vec<(f64, bool)> {
        let holder = stick_out_mm.map(|mm| claymill_toolpath::Holder::usual(mm, &tool));
        let reacher = Reacher { holder, ..Reacher::of(tool) };
        let reach = Reach::new(&slot.part(), &reacher, &up, &()).unwrap();
        let of_floor = reach.samples.iter().zip(&reach.best).filter(|(s, _)| s.face == 0);
        of_floor.map(|(s, seen)| (s.point.y.abs(), *seen == Seen::Reached)).collect()
    };
    // The side of the tool meets the rim 10 from the middle. The holder's nose goes down by 10 mm into the slot, where its
    // radius is 12 + 4 · 10 / 54 at the rim.
    let nose = 15.0 - (12.0 + 4.0 * 10.0 / 54.0);
    for (stick_out_mm, most) in [(None, 10.0), (Some(70.0), 10.0), (Some(50.0), nose)] {
        for (aside, is_reached) in reached(stick_out_mm) {
            if (aside - most).abs() > 0.01 {
                assert_eq!(is_reached, aside < most, "{stick_out_mm:?} {aside}");
            }
        }
    }
}

#[test]
fn the_quaternion_3_1_0_0_tilts_by_the_angle_worked_out_by_hand() {
    let frame = Frame::turned("t", [3, 1, 0, 0]).unwrap();
    assert_eq!(frame.axis(), Vector3::new(0.0, -0.6, 0.8));
    approx::assert_abs_diff_eq!(frame.axis().z.acos().to_degrees(), 36.869_897_646, epsilon = 1e-9);
}

#[test]
fn what_no_direction_reaches_is_named_with_the_reason() {
    // A closed box inside of a box: nothing gets in.
    let mut surfaces = block([40.0; 3]);
    let inner: Vec<_> =
        block([20.0; 3]).into_iter().map(|s| s.mapped(|p| p + Vector3::new(10.0, 10.0, 10.0))).collect();
    surfaces.extend(inner);
    let middle = Point3::new(20.0, 20.0, 20.0);
    let shape = Shape::free_where(surfaces, |p, n| {
        let is_outer = (p - middle).amax() > 15.0;
        (n.dot(&(p - middle)) > 0.0) == is_outer
    });
    let directions = sphere(&shape.part(), &[], 180.0, 1, (axis("+z"), axis("-y"))).unwrap();
    let reach = Reach::new(&shape.part(), &reacher(80.0), &directions, &()).unwrap();
    let faces: Vec<(usize, Seen)> = reach.unreached().iter().map(|u| (u.0, u.2)).collect();
    assert_eq!(faces, (6..12).map(|face| (face, Seen::Hidden)).collect::<Vec<_>>());
}
