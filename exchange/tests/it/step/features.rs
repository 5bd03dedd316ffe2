//! Each feature of the reader on a small file with a known answer.

use std::f64::consts::PI;

use claymill_exchange::Import;
use claymill_nurbs::SurfaceKind;

use super::green::green_area;
use super::text::{face, file, polygon, read, ring};

/// The only face has this kind and area. Fitted pcurves may miss their edges by 1e-4 mm.
#[track_caller]
fn one(text: &str, kind: SurfaceKind, area: f64) -> Import {
    let import = read(text);
    assert_eq!(import.report.skipped, []);
    let [face] = import.model.faces.as_slice() else {
        panic!("{} faces", import.model.faces.len());
    };
    assert_eq!(face.kind, kind);
    approx::assert_relative_eq!(green_area(face), area, max_relative = 5e-6);
    import
}

#[test]
fn a_plane_with_a_round_hole() {
    let square = [[-9.0, -8.0, 3.0], [11.0, -8.0, 3.0], [11.0, 12.0, 3.0], [-9.0, 12.0, 3.0]];
    // Both loops run the same way round: containment decides, not direction.
    let text = face(
        "(#200,#300)",
        &format!("#50=PLANE('',#10);\n{}{}", polygon(200, &square), ring(300, 4.0, 0.0, true)),
    );
    let import = one(&text, SurfaceKind::Plane, 400.0 - 16.0 * PI);
    let source = &import.model.faces[0].source;
    assert_eq!((source.entity.as_str(), source.name.as_deref()), ("#100", Some("skin")));
    assert_eq!(import.report.system.as_deref(), Some("writer"));
    assert_eq!(import.model.tolerance_mm, 0.001);
}

#[test]
fn a_cylinder_between_two_rings_is_cut_open() {
    let rings = ring(200, 4.0, 0.0, true) + &ring(300, 4.0, 10.0, false);
    let text = face("(#200,#300)", &format!("#50=CYLINDRICAL_SURFACE('',#10,4.);\n{rings}"));
    let import = one(&text, SurfaceKind::Cylinder, 80.0 * PI);
    let ids: Vec<_> = import.model.faces[0].loops[0].edges.iter().map(|e| e.shared).collect();
    assert_eq!(ids.iter().filter(|id| id.is_some()).count(), 2);
}

#[test]
fn a_cylinder_with_a_seam_edge() {
    let (low, high) = (ring(200, 4.0, 0.0, true), ring(300, 4.0, 10.0, true));
    // One loop: lower ring, seam up, upper ring backwards, seam down.
    let seam = "#400=FACE_OUTER_BOUND('',#401,.T.);\n#401=EDGE_LOOP('',(#202,#402,#403,#404));\n\
        #402=ORIENTED_EDGE('',*,*,#405,.T.);\n#403=ORIENTED_EDGE('',*,*,#303,.F.);\n\
        #404=ORIENTED_EDGE('',*,*,#405,.F.);\n#405=EDGE_CURVE('',#204,#304,#406,.T.);\n\
        #406=LINE('',#205,#407);\n#407=VECTOR('',#12,1.);\n";
    let data = format!("#50=CYLINDRICAL_SURFACE('',#10,4.);\n{low}{high}{seam}");
    let import = one(&face("(#400)", &data), SurfaceKind::Cylinder, 80.0 * PI);
    let edges = &import.model.faces[0].loops[0].edges;
    assert_eq!(edges.iter().filter(|e| e.shared == Some(405)).count(), 2);
    assert_eq!(edges.len(), 4);
}

#[test]
fn a_cone_runs_to_its_apex_and_angles_are_in_the_files_unit() {
    // Half-angle 30°, radius 6 at the origin: the apex is 6/tan 30° below, the slant height 12.
    let text =
        face("(#200)", &format!("#50=CONICAL_SURFACE('',#10,6.,30.);\n{}", ring(200, 6.0, 0.0, false)));
    one(&text, SurfaceKind::Cone, PI * 6.0 * 12.0);
}

#[test]
fn spheres_whole_capped_and_pierced() {
    let sphere = "#50=SPHERICAL_SURFACE('',#10,5.);\n";
    let vertex = "#200=FACE_BOUND('',#201,.T.);\n#201=VERTEX_LOOP('',#202);\n#202=VERTEX_POINT('',#11);\n";
    let whole = 100.0 * PI;
    one(&face("(#200)", &format!("{sphere}{vertex}")), SurfaceKind::Sphere, whole);
    one(&face("()", sphere), SurfaceKind::Sphere, whole);
    // The circle of radius 4 at height 3: a cap of height 2 above it, the rest below.
    let up = face("(#200)", &format!("{sphere}{}", ring(200, 4.0, 3.0, true)));
    one(&up, SurfaceKind::Sphere, 2.0 * PI * 5.0 * 2.0);
    let down = face("(#200)", &format!("{sphere}{}", ring(200, 4.0, 3.0, false)));
    one(&down, SurfaceKind::Sphere, 2.0 * PI * 5.0 * 8.0);
    // The same circle about the x axis does not go round the sphere's own axis.
    let aside = "#209=CARTESIAN_POINT('',(4.,2.,3.));\n#206=CIRCLE('',#207,4.);\n#207=AXIS2_PLACEMENT_3D('',#209,#13,#12);\n\
        #205=CARTESIAN_POINT('',(4.,2.,7.));\n#204=VERTEX_POINT('',#205);\n#203=EDGE_CURVE('',#204,#204,#206,.T.);\n\
        #200=FACE_BOUND('',#201,.T.);\n#201=EDGE_LOOP('',(#202));\n";
    let loops = |flag: &str| format!("{sphere}{aside}#202=ORIENTED_EDGE('',*,*,#203,.{flag}.);\n");
    one(&face("(#200)", &loops("T")), SurfaceKind::Sphere, 20.0 * PI);
    let pierced = one(&face("(#200)", &loops("F")), SurfaceKind::Sphere, 80.0 * PI);
    // The hole lies inside the outer boundary, clear of the seam.
    let range = |k: usize| {
        let ends = pierced.model.faces[0].loops[k].edges.iter().flat_map(|e| e.pcurve.points());
        ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p.x), b.max(p.x)))
    };
    let (outer, hole) = (range(0), range(1));
    assert!(outer.0 < hole.0 - 1.0 && hole.1 + 1.0 < outer.1, "{outer:?} {hole:?}");
}

#[test]
fn tori_whole_and_halved() {
    let torus = "#50=TOROIDAL_SURFACE('',#10,10.,3.);\n";
    one(&face("()", torus), SurfaceKind::Torus, 4.0 * PI * PI * 30.0);
    // The upper half between the top and… the outer equator: v from 0 to π/2.
    let rings = ring(200, 13.0, 0.0, true) + &ring(300, 10.0, 3.0, false);
    let area = 2.0 * PI * 3.0 * (10.0 * PI / 2.0 + 3.0);
    one(&face("(#200,#300)", &format!("{torus}{rings}")), SurfaceKind::Torus, area);
    // Reversed rings bound the other three quarters.
    let rings = ring(200, 13.0, 0.0, false) + &ring(300, 10.0, 3.0, true);
    let rest = 4.0 * PI * PI * 30.0 - area;
    one(&face("(#200,#300)", &format!("{torus}{rings}")), SurfaceKind::Torus, rest);
}

/// A writer of much use gives fillets the way round that their own flag then turns: the seam tells where the face is.
#[test]
fn a_torus_with_a_seam_edge_is_inside_of_its_loop_whichever_way_that_runs() {
    let (low, high) = (ring(200, 13.0, 0.0, true), ring(300, 10.0, 3.0, true));
    let area = 2.0 * PI * 3.0 * (10.0 * PI / 2.0 + 3.0);
    for flag in ["T", "F"] {
        let seam = format!(
            "#400=FACE_BOUND('',#401,.{flag}.);\n#401=EDGE_LOOP('',(#202,#402,#403,#404));\n\
             #402=ORIENTED_EDGE('',*,*,#405,.T.);\n#403=ORIENTED_EDGE('',*,*,#303,.F.);\n\
             #404=ORIENTED_EDGE('',*,*,#405,.F.);\n#405=EDGE_CURVE('',#204,#304,#406,.T.);\n\
             #406=CIRCLE('',#407,3.);\n#407=AXIS2_PLACEMENT_3D('',#408,#409,#13);\n\
             #408=CARTESIAN_POINT('',(11.,2.,3.));\n#409=DIRECTION('',(0.,-1.,0.));\n"
        );
        let data = format!("#50=TOROIDAL_SURFACE('',#10,10.,3.);\n{low}{high}{seam}");
        one(&face("(#400)", &data), SurfaceKind::Torus, area);
    }
}

#[test]
fn sweeps() {
    let line = "#51=LINE('',#52,#53);\n#52=CARTESIAN_POINT('',(5.,2.,3.));\n#53=VECTOR('',#12,2.);\n";
    let rings = ring(200, 4.0, 0.0, true) + &ring(300, 4.0, 10.0, false);
    let turned =
        format!("#50=SURFACE_OF_REVOLUTION('',#51,#54);\n#54=AXIS1_PLACEMENT('',#11,#12);\n{line}{rings}");
    one(&face("(#200,#300)", &turned), SurfaceKind::Revolution, 80.0 * PI);
    let square = [[5.0, 0.0, 0.0], [5.0, 10.0, 0.0], [5.0, 10.0, 10.0], [5.0, 0.0, 10.0]];
    let swept = format!(
        "#50=SURFACE_OF_LINEAR_EXTRUSION('',#51,#54);\n#54=VECTOR('',#55,3.);\n\
         #55=DIRECTION('',(0.,1.,1.));\n{line}{}",
        polygon(200, &square)
    );
    one(&face("(#200)", &swept), SurfaceKind::Extrusion, 100.0);
    let tube = format!("#50=SURFACE_OF_LINEAR_EXTRUSION('',#206,#54);\n#54=VECTOR('',#12,1.);\n{rings}");
    one(&face("(#200,#300)", &tube), SurfaceKind::Extrusion, 80.0 * PI);
}

#[test]
fn a_bezier_patch_without_bounds_is_whole_and_a_polygon_trims_it() {
    let patch = "#50=BEZIER_SURFACE('',1,1,((#51,#52),(#53,#54)),.UNSPECIFIED.,.F.,.F.,.F.);\n\
        #51=CARTESIAN_POINT('',(0.,0.,0.));\n#52=CARTESIAN_POINT('',(0.,10.,0.));\n\
        #53=CARTESIAN_POINT('',(20.,0.,0.));\n#54=CARTESIAN_POINT('',(20.,10.,0.));\n";
    one(&face("()", patch), SurfaceKind::Nurbs, 200.0);
    let triangle = polygon(200, &[[1.0, 1.0, 0.0], [9.0, 1.0, 0.0], [1.0, 5.0, 0.0]]);
    one(&face("(#200)", &format!("{patch}{triangle}")), SurfaceKind::Nurbs, 16.0);
}

#[test]
fn parts_of_an_assembly_are_placed_in_their_own_units() {
    // A 1 × 1 inch square, placed twice: as a mapped item and by a relationship, 100 mm and 200 mm along x.
    let square = polygon(200, &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    let data = format!(
        "#20=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#21))REPRESENTATION_CONTEXT('',''));\n\
         #21=(CONVERSION_BASED_UNIT('INCH',#22)LENGTH_UNIT()NAMED_UNIT(*));\n\
         #22=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#2);\n\
         #30=SHAPE_REPRESENTATION('part',(#31,#40),#20);\n#31=SHELL_BASED_SURFACE_MODEL('',(#32));\n\
         #32=OPEN_SHELL('',(#100));\n#100=ADVANCED_FACE('',(#200),#50,.T.);\n#50=PLANE('',#40);\n\
         #40=AXIS2_PLACEMENT_3D('',#41,$,$);\n#41=CARTESIAN_POINT('',(0.,0.,0.));\n\
         #60=SHAPE_REPRESENTATION('whole',(#61,#63,#40),#1);\n\
         #61=MAPPED_ITEM('',#62,#64);\n#62=REPRESENTATION_MAP(#40,#30);\n\
         #64=AXIS2_PLACEMENT_3D('',#65,$,$);\n#65=CARTESIAN_POINT('',(100.,0.,0.));\n\
         #63=AXIS2_PLACEMENT_3D('',#66,$,$);\n#66=CARTESIAN_POINT('',(200.,0.,0.));\n\
         #70=(REPRESENTATION_RELATIONSHIP('','',#30,#60)REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#71)\
         SHAPE_REPRESENTATION_RELATIONSHIP());\n#71=ITEM_DEFINED_TRANSFORMATION('','',#40,#63);\n{square}"
    );
    let import = read(&file(&data));
    let mut corners: Vec<f64> = import.model.faces.iter().map(|f| f.surface.point(0.0, 0.0).x).collect();
    corners.sort_by(f64::total_cmp);
    approx::assert_relative_eq!(corners.as_slice(), [100.0, 200.0].as_slice(), epsilon = 1e-9);
    for face in &import.model.faces {
        approx::assert_relative_eq!(green_area(face), 25.4 * 25.4, max_relative = 1e-12);
    }
    assert_eq!((import.report.units.declared.as_str(), import.report.units.mm_per_unit), ("INCH", 25.4));
}

#[test]
fn colours_and_layers_reach_the_face_from_its_shell() {
    let square = polygon(200, &[[0.0, 0.0, 3.0], [1.0, 0.0, 3.0], [1.0, 1.0, 3.0], [0.0, 1.0, 3.0]]);
    let text = face(
        "(#200)",
        &format!(
            "#50=PLANE('',#10);\n{square}#80=STYLED_ITEM('',(#81),#9);\n\
             #81=PRESENTATION_STYLE_ASSIGNMENT((#82));\n#82=SURFACE_STYLE_USAGE(.BOTH.,#83);\n\
             #83=SURFACE_SIDE_STYLE('',(#84));\n#84=SURFACE_STYLE_FILL_AREA(#85);\n\
             #85=FILL_AREA_STYLE('',(#86));\n#86=FILL_AREA_STYLE_COLOUR('',#87);\n\
             #87=COLOUR_RGB('',1.,0.5,0.);\n#90=PRESENTATION_LAYER_ASSIGNMENT('body','',(#100));\n"
        ),
    );
    let import = one(&text, SurfaceKind::Plane, 1.0);
    let source = &import.model.faces[0].source;
    assert_eq!(source.colour, Some([255, 128, 0]));
    assert_eq!(source.layer.as_deref(), Some("body"));
}
