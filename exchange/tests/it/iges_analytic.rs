//! Surfaces with a frame, sweeps, offsets and splines of IGES against their areas and formulas.

use std::f64::consts::{PI, TAU};

use crate::iges_text::{self, Entity, entity, file, line};
use claymill_exchange::{Import, read_bytes};
use claymill_nurbs::{Face, Point3, SurfaceKind};

fn import(entities: &[Entity]) -> Import {
    let import = read_bytes(file(entities).as_bytes(), "test.igs".as_ref()).unwrap();
    assert_eq!(import.report.skipped, []);
    import
}

/// The only face; it has this kind and area.
#[track_caller]
fn one(entities: &[Entity], kind: SurfaceKind, area: f64) -> (Face, Import) {
    let mut import = import(entities);
    assert_eq!(import.model.faces.len(), 1, "{:?}", import.report);
    let face = import.model.faces.remove(0);
    assert_eq!(face.kind, kind);
    approx::assert_relative_eq!(face.area_mm2(), area, max_relative = 2e-6);
    (face, import)
}

/// An entity under the matrix at `DE matrix`.
fn under(matrix: u32, mut entity: Entity) -> Entity {
    entity.matrix = matrix;
    entity
}

fn form(form: u32, mut entity: Entity) -> Entity {
    entity.form = form;
    entity
}

/// A circle about the z axis at height `z`, as an arc (100).
fn ring(radius: f64, z: f64) -> Entity {
    entity(100, format!("{z:?},0.,0.,{radius:?},0.,{radius:?},0."))
}

/// A B-rep face (510) at `DE 1` on the surface at `DE 3`, whose loops are single closed edges: the curves behind.
fn b_rep(surface: Entity, parts: Vec<Entity>, rings: &[Entity]) -> Vec<Entity> {
    let count = rings.len();
    let first_loop = 5 + 2 * parts.len();
    let (edges, vertices) = (first_loop + 2 * count, first_loop + 2 * count + 2);
    let loops: Vec<String> = (0..count).map(|i| (first_loop + 2 * i).to_string()).collect();
    let mut all = vec![entity(510, format!("3,{count},1,{}", loops.join(","))), surface];
    all.extend(parts);
    all.extend((1..=count).map(|i| entity(508, format!("1,0,{edges},{i},1,0,0"))));
    let list: Vec<String> =
        (0..count).map(|i| format!("{},{vertices},1,{vertices},1", vertices + 2 + 2 * i)).collect();
    all.push(entity(504, format!("{count},{}", list.join(","))));
    all.push(entity(502, "1,0.,0.,0."));
    all.extend(rings.iter().map(|r| Entity { parameters: r.parameters.clone(), ..entity(r.kind, "") }));
    all
}

fn origin_and_axis() -> Vec<Entity> {
    vec![entity(116, "0.,0.,0.,0"), entity(123, "0.,0.,1.")]
}

#[test]
fn cylinders_and_cones_between_rings() {
    let cylinder = b_rep(entity(192, "5,7,4."), origin_and_axis(), &[ring(4.0, 1.0), ring(4.0, 11.0)]);
    let (face, import) = one(&cylinder, SurfaceKind::Cylinder, 80.0 * PI);
    assert_eq!(import.report.repairs, []);
    assert!(face.surface.is_rational() && face.surface.knots_u().degree() == 2);
    // 30° from the axis: the radius grows from 4 to 4 + 6 tan 30° over a height of 6.
    let tan = PI.to_radians().mul_add(0.0, (PI / 6.0).tan());
    let (r, top) = (4.0, 4.0 + 6.0 * tan);
    let cone = b_rep(entity(194, "5,7,4.,30."), origin_and_axis(), &[ring(r, 0.0), ring(top, 6.0)]);
    one(&cone, SurfaceKind::Cone, PI * (r + top) * 6.0 / (PI / 6.0).cos());
}

#[test]
fn spheres_and_tori_whole_and_in_part() {
    one(&[entity(196, "3,5."), entity(116, "1.,2.,3.,0")], SurfaceKind::Sphere, 100.0 * PI);
    let torus = |radii: &str| {
        let mut all = vec![entity(198, format!("3,5,{radii}"))];
        all.extend(origin_and_axis());
        all
    };
    one(&torus("10.,3."), SurfaceKind::Torus, 4.0 * PI * PI * 30.0);
    // The outer sheet of a torus that crosses itself: ∫ 2π (R + r cos v) r dv over |v| < acos(−R / r).
    let (big, small) = (3.0_f64, 5.0_f64);
    let apex = (-big / small).acos();
    let outer = 4.0 * PI * small * (big * apex + small * apex.sin());
    one(&torus("3.,5."), SurfaceKind::Torus, outer);
    // A cap of height 2: the ring of radius 4 at height 3, anticlockwise seen from above.
    let parts = vec![entity(116, "0.,0.,0.,0")];
    let cap = b_rep(entity(196, "5,5."), parts, &[ring(4.0, 3.0)]);
    one(&cap, SurfaceKind::Sphere, 20.0 * PI);
    let parts = || vec![entity(116, "0.,0.,0.,0"), entity(123, "0.,0.,1.")];
    let upper = b_rep(entity(198, "5,7,10.,3."), parts(), &[ring(13.0, 0.0), ring(10.0, 3.0)]);
    let area = TAU * 3.0 * (10.0 * PI / 2.0 + 3.0);
    let found = import(&upper).model.faces[0].area_mm2();
    // Without the orientation of the second ring either part of the tube may be meant.
    let rest = 4.0 * PI * PI * 30.0 - area;
    assert!((found / area - 1.0).abs().min((found / rest - 1.0).abs()) < 1e-6, "{found}");
}

#[test]
fn matrices_move_scale_and_mirror_quadrics() {
    // Twice as large, mirrored in x, moved by 100 along y.
    let matrix = entity(124, "-2.,0.,0.,0.,0.,2.,0.,100.,0.,0.,2.,0.");
    let sphere = under(5, entity(196, "3,5."));
    let (face, _) = one(&[sphere, entity(116, "1.,2.,3.,0"), matrix], SurfaceKind::Sphere, 400.0 * PI);
    let ((u0, u1), (v0, v1)) = face.surface.domain();
    let centre = Point3::new(-2.0, 104.0, 6.0);
    for (x, y) in [(0.1, 0.2), (0.7, 0.6), (0.5, 0.9)] {
        let p = face.surface.point(u0 + (u1 - u0) * x, v0 + (v1 - v0) * y);
        approx::assert_relative_eq!((p - centre).norm(), 10.0, epsilon = 1e-12);
    }
    let uneven = entity(124, "1.,0.,0.,0.,0.,2.,0.,0.,0.,0.,1.,0.");
    let stretched =
        [iges_text::flat(1., 1.), under(7, entity(196, "5,5.")), entity(116, "0.,0.,0.,0"), uneven];
    let import = read_bytes(file(&stretched).as_bytes(), "test.igs".as_ref()).unwrap();
    assert!(import.report.skipped[0].reason.contains("unevenly"), "{:?}", import.report.skipped);
}

#[test]
fn a_surface_of_revolution_cut_by_two_rings_only() {
    // The generatrix runs over heights 0 to 20, the face over 5 to 9: neither ring closes in the parameter plane.
    let surface = entity(120, "5,7,0.,6.283185307179586");
    let parts = vec![line([0., 0., 0.], [0., 0., 1.]), line([4., 0., 0.], [4., 0., 20.])];
    let tube = b_rep(surface, parts, &[ring(4.0, 5.0), ring(4.0, 9.0)]);
    one(&tube, SurfaceKind::Revolution, TAU * 4.0 * 4.0);
}

/// A loop that goes round a closed surface and back along its seam: a ring, the seam, the other ring, the seam again.
/// One of the rings ends a rounding error from its start, which says nothing about the way that it runs.
#[test]
fn rings_keep_their_way_round_where_a_loop_follows_the_seam() {
    let frustum = |last: f64| {
        vec![
            entity(144, "3,1,0,9"),
            entity(120, "5,7,0.,6.283185307179586"),
            line([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
            line([2.0, 0.0, 0.0], [5.0, 0.0, 4.0]),
            entity(142, "0,3,0,11,2"),
            entity(102, "4,13,15,17,21"),
            ring(2.0, 0.0),
            line([2.0, 0.0, 0.0], [5.0, 0.0, 4.0]),
            under(19, entity(100, format!("-4.,0.,0.,5.,0.,5.,{last:?}"))),
            entity(124, "1.,0.,0.,0.,0.,-1.,0.,0.,0.,0.,-1.,0."),
            line([5.0, 0.0, 4.0], [2.0, 0.0, 0.0]),
        ]
    };
    for last in [0.0, 1e-14, -1e-14] {
        one(&frustum(last), SurfaceKind::Revolution, 35.0 * PI);
    }
}

/// Lines in the parameter plane, by angles.
fn flat(lines: &[[f64; 4]]) -> impl Iterator<Item = Entity> {
    lines.iter().map(|[a, b, c, d]| line([*a, *b, 0.0], [*c, *d, 0.0]))
}

/// An arc (100) in the plane `xz`, by the matrix at `DE 9`.
fn meridian(arc: &str) -> Entity {
    under(9, entity(100, arc))
}

/// A face at `DE 1` whose surface is a meridian turned once about the z axis. Its loop has the pcurves and the curves in
/// space of two lists (102); what these point to stands from `DE 17` on.
fn turned(arc: &str, pcurves: &str, curves: &str) -> Vec<Entity> {
    vec![
        entity(144, "3,1,0,11"),
        entity(120, "5,7,0.,6.283185307179586"),
        line([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
        meridian(arc),
        entity(124, "1.,0.,0.,0.,0.,0.,-1.,0.,0.,1.,0.,0."),
        entity(142, "0,3,13,15,3"),
        entity(102, pcurves),
        entity(102, curves),
    ]
}

#[test]
fn a_sphere_by_revolution_is_whole_by_its_pcurves() {
    const ARC: &str = "0.,0.,0.,0.,-5.,0.,5.";
    // The meridian runs by angle, from 270° to 450° or as well from −90° to 90°; both poles have pcurves only, or none.
    for (low, high) in [(1.5 * PI, 2.5 * PI), (-0.5 * PI, 0.5 * PI)] {
        let sides =
            [[low, 0.0, high, 0.0], [high, 0.0, high, TAU], [high, TAU, low, TAU], [low, TAU, low, 0.0]];
        for (sides, list) in [(&sides[..], "4,17,19,21,23"), (&sides[..3], "2,17,21")] {
            let mut all = turned(ARC, list, "2,25,27");
            all.extend(flat(sides));
            all.extend((sides.len()..6).map(|_| meridian(ARC)));
            one(&all, SurfaceKind::Revolution, 100.0 * PI);
        }
    }
}

#[test]
fn sides_of_a_torus_in_any_order_are_its_rectangle() {
    const ARC: &str = "0.,10.,0.,13.,0.,13.,0.";
    // All four corners are one point in space: only the pcurves tell how the sides meet.
    let sides = [[0.0, 0.0, TAU, 0.0], [0.0, TAU, TAU, TAU], [0.0, 0.0, 0.0, TAU], [TAU, 0.0, TAU, TAU]];
    let mut all = turned(ARC, "4,17,19,21,23", "4,25,27,29,31");
    all.extend(flat(&sides));
    all.extend([meridian(ARC), meridian(ARC)]);
    all.extend([ring(13.0, 0.0), ring(13.0, 0.0)]);
    one(&all, SurfaceKind::Revolution, 4.0 * PI * PI * 30.0);
}

#[test]
fn a_hole_across_the_seam_of_a_closed_surface() {
    // A window of 60° × 3 around the seam of a cylinder of radius 4, as its edges on it.
    let surface = entity(120, "5,7,0.,6.283185307179586");
    let parts = vec![line([0., 0., 0.], [0., 0., 1.]), line([4., 0., 0.], [4., 0., 20.])];
    let (c, s) = ((PI / 6.0).cos() * 4.0, (PI / 6.0).sin() * 4.0);
    let mut all = vec![entity(144, "3,1,0,9"), surface];
    all.extend(parts);
    all.push(entity(142, "0,3,0,11,2"));
    all.push(entity(102, "4,13,15,17,19"));
    all.push(entity(100, format!("5.,0.,0.,{c:?},{:?},{c:?},{s:?}", -s)));
    all.push(line([c, s, 5.], [c, s, 8.]));
    all.push(entity(100, format!("8.,0.,0.,{c:?},{:?},{c:?},{s:?}", -s)));
    all.push(line([c, -s, 8.], [c, -s, 5.]));
    one(&all, SurfaceKind::Revolution, 4.0 * PI / 3.0 * 3.0);
}

#[test]
fn offset_planes_quadrics_and_splines() {
    // A sphere of 5 offset outwards by 2, the indicator at the equator's start.
    let parts = vec![entity(196, "5,5."), entity(116, "0.,0.,0.,0")];
    let mut all = vec![entity(140, "1.,0.,0.,2.,3")];
    all.extend(parts);
    one(&all, SurfaceKind::Sphere, 4.0 * PI * 49.0);
    let inwards = [entity(140, "-1.,0.,0.,2.,3"), entity(196, "5,5."), entity(116, "0.,0.,0.,0")];
    one(&inwards, SurfaceKind::Sphere, 4.0 * PI * 9.0);
    // A half cylinder about z as a sweep, radius 4 and height 5, offset to radius 6.
    let swept = |side: &str| {
        let axis = line([0., 0., 0.], [0., 0., 1.]);
        let sweep = entity(120, "5,7,0.,3.141592653589793");
        [entity(140, format!("{side},2.,3")), sweep, axis, line([4., 0., 0.], [4., 0., 5.])]
    };
    let (_, import) = one(&swept("0.,1.,0."), SurfaceKind::Offset, PI * 6.0 * 5.0);
    let [repair] = import.report.repairs.as_slice() else { panic!("{:?}", import.report.repairs) };
    assert!(repair.what.contains("approximated") && repair.size_mm <= 1e-4, "{repair:?}");
    one(&swept("0.,-1.,0."), SurfaceKind::Offset, PI * 2.0 * 5.0);
}

#[test]
fn parametric_spline_surfaces() {
    // Two pieces in u, one in v: x = u, y = v, z = u² v over [0, 1, 3] × [2, 3]; u and v count from each piece.
    let piece = |u0: f64| {
        let mut c = [[0.0; 16]; 3];
        (c[0][0], c[0][1]) = (u0, 1.0);
        (c[1][0], c[1][4]) = (2.0, 1.0);
        // (u0 + s)² (2 + t)
        for (k, v) in [(0, 2.0), (4, 1.0)] {
            (c[2][k], c[2][k + 1], c[2][k + 2]) = (u0 * u0 * v, 2.0 * u0 * v, v);
        }
        c.concat()
    };
    let nothing = vec![7.0; 48];
    let values: Vec<f64> =
        [piece(0.0), nothing.clone(), piece(1.0), nothing.clone(), nothing.clone(), nothing].concat();
    let text: Vec<String> = values.iter().map(|v| format!("{v:?}")).collect();
    let surface = entity(114, format!("3,1,2,1,0.,1.,3.,2.,3.,{}", text.join(",")));
    let import = import(&[surface]);
    let s = &import.model.faces[0].surface;
    assert_eq!(import.model.faces[0].kind, SurfaceKind::Spline);
    for (u, v) in [(0.3, 2.2), (1.0, 3.0), (2.4, 2.9), (3.0, 2.0)] {
        approx::assert_abs_diff_eq!(s.point(u, v), Point3::new(u, v, u * u * v), epsilon = 1e-12);
    }
}

#[test]
fn ruled_surfaces_between_unlike_curves() {
    // From a half circle of radius 4 at z = 0 to a line at z = 3.
    let arc = || entity(100, "0.,0.,0.,4.,0.,-4.,0.");
    let rail = || line([4., 0., 3.], [-4., 0., 3.]);
    // Form 1 joins equal parameters: the arc's knots are joined to the line's, exactly.
    let import_1 = import(&[form(1, entity(118, "3,5,0,0")), arc(), rail()]);
    let s = &import_1.model.faces[0].surface;
    approx::assert_abs_diff_eq!(s.point(0.5, 0.0), Point3::new(0., 4., 0.), epsilon = 1e-12);
    approx::assert_abs_diff_eq!(s.point(0.5, 1.0), Point3::new(0., 0., 3.), epsilon = 1e-12);
    assert_eq!(import_1.report.repairs, []);
    // Form 0 joins equal lengths: a third of the line to 60° of the arc.
    let import_0 = import(&[form(0, entity(118, "3,5,0,0")), arc(), rail()]);
    let s = &import_0.model.faces[0].surface;
    for share in [0.1, 1.0 / 3.0, 0.8] {
        let angle = PI * share;
        let on_arc = Point3::new(4.0 * angle.cos(), 4.0 * angle.sin(), 0.0);
        approx::assert_abs_diff_eq!(s.point(share, 0.0), on_arc, epsilon = 2e-4);
        approx::assert_abs_diff_eq!(
            s.point(share, 1.0),
            Point3::new(4. - 8. * share, 0., 3.),
            epsilon = 2e-4
        );
    }
    assert_eq!(import_0.report.repairs.len(), 1);
}

#[test]
fn a_composite_directrix_is_swept_as_one() {
    // A line of length 3 and a quarter circle of radius 2, moved by 5 along z.
    let all = [
        entity(122, "3,0.,0.,5."),
        entity(102, "2,5,7"),
        line([0., 0., 0.], [3., 0., 0.]),
        entity(100, "0.,3.,2.,3.,0.,5.,2."),
    ];
    one(&all, SurfaceKind::Extrusion, 5.0 * (3.0 + PI));
}

#[test]
fn offset_curves_trim() {
    // A circle of radius 3 offset inwards by 1 on a plane: V × T of an anticlockwise circle points to the centre.
    let all = [
        iges_text::flat(10.0, 8.0),
        entity(144, "1,1,0,5"),
        entity(142, "0,1,0,7,2"),
        entity(130, "9,1,0,0,0,1.,0.,0.,0.,0.,0.,1.,0.,0."),
        entity(100, "0.,5.,4.,8.,4.,8.,4."),
    ];
    one(&all, SurfaceKind::Nurbs, 4.0 * PI);
    // A line along x from (2, 1), offset to the left by 2 at its start and 4 at its end; the rest are lines.
    let all = [
        iges_text::flat(10.0, 8.0),
        entity(144, "1,1,0,5"),
        entity(142, "0,1,0,7,2"),
        entity(102, "4,9,11,13,15"),
        line([2., 1., 0.], [6., 1., 0.]),
        line([6., 1., 0.], [6., 5., 0.]),
        entity(130, "17,2,0,0,2,2.,0.,4.,1.,0.,0.,1.,0.,1."),
        line([2., 3., 0.], [2., 1., 0.]),
        line([2., 1., 0.], [6., 1., 0.]),
    ];
    one(&all, SurfaceKind::Nurbs, 12.0);
}

#[test]
fn the_compressed_form_is_read() {
    let card = |body: &str, letter: char, number: usize| format!("{body:<72}{letter}{number:>7}\n");
    let mut text = card("compressed", 'C', 1) + &card("start", 'S', 1);
    text += &card("1H,,1H;,4Htest,5Ha.igs,4Htest,1H1,32,38,6,308,15,4Htest,", 'G', 1);
    text += &card("1.,2,2HMM,1,0.1,15H20000101.000000,1D-3,100.,,,11,0;", 'G', 2);
    // A plane figure: the second line takes all fields but the type from the first entity.
    text += "D1@1_118@5_7@9_00000000@15_1\n118,3,5,0,0;\n";
    text += "D3@1_110@9_00010000@15_0\n110,0.,0.,0.,\n4.,0.,0.;\n";
    text += "D5\n110,0.,3.,0.,4.,3.,0.;\n";
    text += &card("S0000001G0000002D0000006P0000003", 'T', 1);
    let import = read_bytes(text.as_bytes(), "c.igs".as_ref()).unwrap();
    assert_eq!(import.report.faces_read, 1, "{:?}", import.report);
    approx::assert_relative_eq!(import.model.faces[0].area_mm2(), 12.0, epsilon = 1e-9);
    assert_eq!(import.model.faces[0].source.layer.as_deref(), Some("7"));
}

#[test]
fn doubtful_frames_and_sizes_are_warned_about() {
    let text = file(&[iges_text::flat(1000.0, 800.0)]);
    let warnings = |text: &str| read_bytes(text.as_bytes(), "w.igs".as_ref()).unwrap().report.warnings;
    assert_eq!(warnings(&text), Vec::<String>::new());
    let miscounted = text.replace("D      2P", "D      4P");
    assert_ne!(miscounted, text);
    assert!(warnings(&miscounted)[0].contains("terminate section"), "{:?}", warnings(&miscounted));
    let tiny = file(&[iges_text::flat(1.0, 0.8)]);
    assert!(warnings(&tiny)[0].contains("implausible"), "{:?}", warnings(&tiny));
    let in_metres = iges_text::file_in("6,1HM", &[iges_text::flat(1000.0, 800.0)]);
    assert!(warnings(&in_metres)[0].contains("implausible"));
}
