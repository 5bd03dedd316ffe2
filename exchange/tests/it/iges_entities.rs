//! Each kind of entity from a tiny hand-made file with an answer known by heart.

use std::f64::consts::PI;

use crate::iges_text::{Entity, entity, file, file_in, flat, line};
use claymill_exchange::{Import, read_bytes};
use claymill_nurbs::{Face, Point2, Point3, SurfaceKind};

fn import(entities: &[Entity]) -> Import {
    read_bytes(file(entities).as_bytes(), "test.igs".as_ref()).unwrap()
}

fn only_face(entities: &[Entity]) -> Face {
    let mut import = import(entities);
    assert_eq!(import.report.skipped, []);
    assert_eq!(import.model.faces.len(), 1, "{:?}", import.report);
    import.model.faces.remove(0)
}

/// Area of the loops in the parameter plane, outer minus holes, by the shoelace formula.
fn flat_area(face: &Face) -> f64 {
    let mut area = 0.0;
    for l in &face.loops {
        let mut ring: Vec<Point2> = Vec::new();
        for e in &l.edges {
            let (a, b) = e.pcurve.domain();
            ring.extend((0..3000).map(|i| e.pcurve.point(a + (b - a) * f64::from(i) / 3000.0)));
        }
        for (p, q) in ring.iter().zip(ring.iter().cycle().skip(1)) {
            area += 0.5 * p.coords.perp(&q.coords);
        }
    }
    area
}

/// A face on a flat 10 × 8 surface whose outer loop is the space curve `DE 3`, further entities behind.
fn trimmed_by(curve: Vec<Entity>) -> Face {
    let mut entities = vec![flat(10.0, 8.0)];
    entities.extend(curve);
    let n = 2 * entities.len() + 1;
    entities.push(entity(142, "0,1,0,3,2"));
    entities.push(entity(144, format!("1,1,0,{n}")));
    only_face(&entities)
}

#[test]
fn a_bare_surface_is_a_face_and_a_trimmed_one_is_not_counted_twice() {
    let face = only_face(&[flat(10.0, 8.0)]);
    assert!(face.loops.is_empty());
    approx::assert_abs_diff_eq!(face.surface.point(2.0, 3.0), Point3::new(2.0, 3.0, 0.0), epsilon = 1e-12);
    let face = only_face(&[flat(10.0, 8.0), entity(144, "1,0,0,0")]);
    assert!(face.loops.is_empty());
    assert_eq!(face.source.entity, "DE 3");
}

#[test]
fn units_become_millimetres() {
    for (unit, mm) in [("1,2HIN", 25.4), ("6,1HM", 1000.0), ("3,2HFT", 304.8), ("10,2HCM", 10.0)] {
        let text = file_in(unit, &[flat(10.0, 8.0)]);
        let import = read_bytes(text.as_bytes(), "test.igs".as_ref()).unwrap();
        assert_eq!(import.report.units.mm_per_unit, mm);
        let corner = import.model.faces[0].surface.point(10.0, 8.0);
        approx::assert_abs_diff_eq!(corner, Point3::new(10.0 * mm, 8.0 * mm, 0.0), epsilon = 1e-9);
    }
}

#[test]
fn nested_matrices_act_from_the_inside_out() {
    // DE 3 turns by 90° about z and points to DE 5, which shifts by (100, 0, 0).
    let mut surface = flat(10.0, 8.0);
    surface.matrix = 3;
    let mut turn = entity(124, "0.,-1.,0.,0.,1.,0.,0.,0.,0.,0.,1.,0.");
    turn.matrix = 5;
    let shift = entity(124, "1.,0.,0.,100.,0.,1.,0.,0.,0.,0.,1.,0.");
    let face = only_face(&[surface, turn, shift]);
    approx::assert_abs_diff_eq!(
        face.surface.point(10.0, 0.0),
        Point3::new(100.0, 10.0, 0.0),
        epsilon = 1e-12
    );
}

#[test]
fn circles_ellipses_and_composites_trim_exactly() {
    let circle = trimmed_by(vec![entity(100, "0.,5.,4.,8.,4.,8.,4.")]);
    assert!((flat_area(&circle) - 9.0 * PI).abs() < 1e-4, "{}", flat_area(&circle));
    // x²/16 + y²/4 = 1 moved to (5, 4): x² + 4y² - 10x - 32y + 73 = 0.
    let mut ellipse = entity(104, "1.,0.,4.,-10.,-32.,73.,0.,9.,4.,9.,4.");
    ellipse.form = 1;
    let face = trimmed_by(vec![ellipse]);
    assert!((flat_area(&face) - 8.0 * PI).abs() < 1e-4, "{}", flat_area(&face));
    // A half disc: arc and line, the line given backwards.
    let face = trimmed_by(vec![
        entity(102, "2,5,7"),
        entity(100, "0.,5.,4.,8.,4.,2.,4."),
        line([8.0, 4.0, 0.0], [2.0, 4.0, 0.0]),
    ]);
    assert!((flat_area(&face) - 4.5 * PI).abs() < 1e-4);
}

#[test]
fn parabolas_and_hyperbolas_are_single_rational_pieces() {
    // y = 1 + x² / 8 from (0, 1) to (8, 9)... kept inside by taking y up to 3: x² - 8y + 8 = 0, (0,1)-(4,3).
    let closing = line([4.0, 3.0, 0.0], [0.0, 1.0, 0.0]);
    let mut parabola = entity(104, "1.,0.,0.,0.,-8.,8.,0.,0.,1.,4.,3.");
    parabola.form = 3;
    let face = trimmed_by(vec![entity(102, "2,5,7"), parabola, closing]);
    // Chord area minus area under the parabola: 8 - (4 + 64 / 24).
    let expected = 8.0 - (4.0 + 64.0 / 24.0);
    assert!((flat_area(&face) - expected).abs() < 1e-5, "{}", flat_area(&face));
    // x y = 4 from (1, 4) to (4, 1).
    let closing = line([4.0, 1.0, 0.0], [1.0, 4.0, 0.0]);
    let mut hyperbola = entity(104, "0.,1.,0.,0.,0.,-4.,0.,1.,4.,4.,1.");
    hyperbola.form = 2;
    let face = trimmed_by(vec![entity(102, "2,5,7"), hyperbola, closing]);
    let expected = 7.5 - 4.0 * 4.0_f64.ln();
    assert!((flat_area(&face) - expected).abs() < 1e-5, "{}", flat_area(&face));
}

#[test]
fn polylines_splines_and_parts_of_b_splines_trim() {
    let mut polyline = entity(106, "1,4,0.,1.,1.,5.,1.,5.,3.,1.,1.");
    polyline.form = 11;
    assert!((flat_area(&trimmed_by(vec![polyline])) - 4.0).abs() < 1e-9);
    // One cubic segment y = 1 + t², x = 1 + 2 t, t in 0..1, closed by a line.
    let spline = entity(112, "3,0,2,1,0.,1.,1.,2.,0.,0.,1.,0.,1.,0.,0.,0.,0.,0.");
    let face = trimmed_by(vec![entity(102, "2,5,7"), spline, line([3.0, 2.0, 0.0], [1.0, 1.0, 0.0])]);
    assert!((flat_area(&face) - (1.0 - 2.0 / 3.0)).abs() < 1e-6, "{}", flat_area(&face));
    // The middle half of a straight B-spline from (0, 2) to (8, 2), with three lines.
    let part = entity(126, "1,1,0,0,1,0,0.,0.,1.,1.,1.,1.,0.,2.,0.,8.,2.,0.,0.25,0.75,0.,0.,1.");
    let face = trimmed_by(vec![
        entity(102, "3,5,7,9"),
        part,
        line([6.0, 2.0, 0.0], [6.0, 4.0, 0.0]),
        line([6.0, 4.0, 0.0], [2.0, 2.0, 0.0]),
    ]);
    assert!((flat_area(&face) - 4.0).abs() < 1e-9);
}

#[test]
fn a_wrong_pcurve_is_not_believed_whatever_the_preference_flag_says() {
    let circle = entity(100, "0.,5.,4.,8.,4.,8.,4.");
    let wrong = entity(100, "0.,5.,4.,7.,4.,7.,4.");
    for preference in 0..=3 {
        let face = only_face(&[
            flat(10.0, 8.0),
            entity(100, "0.,5.,4.,8.,4.,8.,4."),
            entity(100, "0.,5.,4.,7.,4.,7.,4."),
            entity(142, format!("0,1,5,3,{preference}")),
            entity(144, "1,1,0,7"),
        ]);
        assert!((flat_area(&face) - 9.0 * PI).abs() < 1e-4);
    }
    // Without a curve in space there is only the pcurve.
    let face = only_face(&[flat(10.0, 8.0), circle, wrong, entity(142, "0,1,5,0,1"), entity(144, "1,1,0,7")]);
    assert!((flat_area(&face) - 4.0 * PI).abs() < 1e-4);
}

#[test]
fn holes_are_turned_and_the_whole_surface_can_be_the_outer_loop() {
    let face = only_face(&[
        flat(10.0, 8.0),
        entity(100, "0.,5.,4.,8.,4.,8.,4."),
        entity(142, "0,1,0,3,2"),
        entity(144, "1,0,1,0,5"),
    ]);
    assert_eq!(face.loops.len(), 2);
    assert!((flat_area(&face) - (80.0 - 9.0 * PI)).abs() < 1e-4);
}

#[test]
fn a_loop_along_the_sides_is_dropped() {
    let face = trimmed_by(vec![
        entity(102, "4,5,7,9,11"),
        line([0.0, 0.0, 0.0], [10.0, 0.0, 0.0]),
        line([10.0, 0.0, 0.0], [10.0, 8.0, 0.0]),
        line([10.0, 8.0, 0.0], [0.0, 8.0, 0.0]),
        line([0.0, 8.0, 0.0], [0.0, 0.0, 0.0]),
    ]);
    assert!(face.loops.is_empty());
}

#[test]
fn planes_get_the_size_of_their_loops() {
    for plane in [
        vec![entity(108, "0.,0.,2.,6.,0,0.,0.,0.,0.")],
        vec![entity(190, "9,11"), entity(116, "1.,1.,3.,0"), entity(123, "0.,0.,1.")],
    ] {
        let mut plane = plane.into_iter();
        let mut entities = vec![
            plane.next().unwrap(),
            entity(100, "3.,5.,4.,8.,4.,8.,4."),
            entity(142, "0,1,0,3,2"),
            entity(144, "1,1,0,5"),
        ];
        entities.extend(plane);
        let face = only_face(&entities);
        assert_eq!(face.kind, SurfaceKind::Plane);
        assert!((flat_area(&face).abs() - 9.0 * PI).abs() < 1e-4);
        let p = face.loops[0].edges[0].pcurve.start();
        approx::assert_abs_diff_eq!(face.surface.point(p.x, p.y).z, 3.0, epsilon = 1e-12);
    }
}

#[test]
fn revolved_extruded_and_ruled_surfaces() {
    let axis = || line([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let face =
        only_face(&[entity(120, "3,5,0.,3.141592653589793"), axis(), line([2.0, 0.0, 0.0], [2.0, 0.0, 5.0])]);
    // The file's `u` runs along the generatrix, its `v` about the axis.
    for (u, v) in [(0.0, 0.1), (0.5, 1.0), (1.0, 3.0)] {
        let p = face.surface.point(u, v);
        approx::assert_abs_diff_eq!(p.x.hypot(p.y), 2.0, epsilon = 1e-12);
        approx::assert_abs_diff_eq!(p.z, 5.0 * u, epsilon = 1e-12);
        assert!(p.y >= 0.0);
    }
    let face = only_face(&[entity(122, "3,0.,0.,9."), line([0.0, 0.0, 0.0], [4.0, 0.0, 0.0])]);
    approx::assert_abs_diff_eq!(face.surface.point(0.5, 1.0), Point3::new(2.0, 0.0, 9.0), epsilon = 1e-12);
    let face = only_face(&[
        entity(118, "3,5,1,0"),
        line([0.0, 0.0, 0.0], [4.0, 0.0, 0.0]),
        line([4.0, 3.0, 0.0], [0.0, 3.0, 2.0]),
    ]);
    approx::assert_abs_diff_eq!(face.surface.point(0.0, 1.0), Point3::new(0.0, 3.0, 2.0), epsilon = 1e-12);
}

#[test]
fn bounded_surfaces_and_b_reps_share_their_edges() {
    let square = |x: f64| {
        let c = [[x, 0.0, 0.0], [x + 5.0, 0.0, 0.0], [x + 5.0, 8.0, 0.0], [x, 8.0, 0.0]];
        (0..4).map(move |i| line(c[i], c[(i + 1) % 4]))
    };
    // 143 with 141: a triangle of lines, the second against its sense.
    let face = only_face(&[
        flat(10.0, 8.0),
        line([1.0, 1.0, 0.0], [5.0, 1.0, 0.0]),
        line([1.0, 4.0, 0.0], [5.0, 1.0, 0.0]),
        line([1.0, 4.0, 0.0], [1.0, 1.0, 0.0]),
        entity(141, "0,2,1,3,3,1,0,5,2,0,7,1,0"),
        entity(143, "0,1,1,9"),
    ]);
    assert!((flat_area(&face) - 6.0).abs() < 1e-9);
    // Two halves of a surface in a shell; the common edge is edge 2 of the first square.
    let mut entities = vec![
        entity(514, "2,3,1,5,0"),
        entity(510, "7,1,1,11"),
        entity(510, "9,1,1,13"),
        flat(10.0, 8.0),
        flat(10.0, 8.0),
        entity(508, "4,0,15,1,1,0,0,15,2,1,0,0,15,3,1,0,0,15,4,1,0"),
        entity(508, "4,0,15,5,1,0,0,15,6,1,0,0,15,7,1,0,0,15,2,0,0"),
        entity(
            504,
            "7,19,17,1,17,2,21,17,1,17,2,23,17,1,17,2,25,17,1,17,2,27,17,1,17,2,29,17,1,17,2,31,17,1,17,2",
        ),
        entity(502, "2,0.,0.,0.,1.,0.,0."),
    ];
    entities.extend(square(0.0));
    entities.extend(square(5.0).take(3));
    let import = import(&entities);
    assert_eq!((import.report.faces_in_file, import.report.skipped.len()), (2, 0));
    let shared = |f: usize| -> Vec<_> {
        import.model.faces[f].loops[0].edges.iter().filter_map(|e| e.shared).collect()
    };
    let common: Vec<_> = shared(0).into_iter().filter(|id| shared(1).contains(id)).collect();
    assert_eq!(common.len(), 1);
    assert!(!import.model.faces[0].reversed && import.model.faces[1].reversed);
    for face in &import.model.faces {
        assert!((flat_area(face) - 40.0).abs() < 1e-9);
    }
}

#[test]
fn subfigure_instances_place_copies() {
    let import = import(&[
        entity(308, "0,5Hwheel,1,3"),
        flat(10.0, 8.0),
        entity(408, "1,100.,0.,0.,1."),
        entity(408, "1,0.,0.,50.,2."),
    ]);
    assert_eq!(import.model.faces.len(), 2);
    let corner = |i: usize| import.model.faces[i].surface.point(10.0, 8.0);
    assert_eq!(corner(0), Point3::new(110.0, 8.0, 0.0));
    assert_eq!(corner(1), Point3::new(20.0, 16.0, 50.0));
    assert_eq!(import.model.faces[0].source.entity, "DE 3 in instance DE 5");
}

#[test]
fn a_declared_part_of_the_domain_is_a_trim() {
    let mut surface = flat(10.0, 8.0);
    surface.parameters = surface.parameters.replace(",0.,10.0,0.,8.0", ",2.,7.,0.,8.0");
    assert!((flat_area(&only_face(&[surface])) - 40.0).abs() < 1e-9);
}
