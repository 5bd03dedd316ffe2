//! Offset, spindle, conic and composite geometry, and surfaces that are faces by themselves.

use std::f64::consts::PI;

use claymill_exchange::Import;
use claymill_nurbs::SurfaceKind;

use super::text::{face, file, polygon, read, ring};

/// The only face has this kind and area.
#[track_caller]
fn one(text: &str, kind: SurfaceKind, area: f64) -> Import {
    let import = read(text);
    assert_eq!(import.report.skipped, []);
    let [face] = import.model.faces.as_slice() else {
        panic!("{} faces", import.model.faces.len());
    };
    assert_eq!(face.kind, kind);
    approx::assert_relative_eq!(face.area_mm2(), area, max_relative = 5e-6);
    import
}

#[test]
fn both_sheets_of_a_torus_that_crosses_itself() {
    let (big, small) = (3.0_f64, 5.0_f64);
    let apex = (-big / small).acos();
    let sheet = |low: f64, high: f64| {
        2.0 * PI * small * (big * (high - low) + small * (high.sin() - low.sin())).abs()
    };
    let torus =
        |outer: &str| face("()", &format!("#50=DEGENERATE_TOROIDAL_SURFACE('',#10,3.,5.,.{outer}.);\n"));
    one(&torus("T"), SurfaceKind::Torus, sheet(-apex, apex));
    one(&torus("F"), SurfaceKind::Torus, sheet(apex, 2.0 * PI - apex));
    // The upper half of the outer sheet: above its widest ring.
    let half = format!("#50=DEGENERATE_TOROIDAL_SURFACE('',#10,3.,5.,.T.);\n{}", ring(200, 8.0, 0.0, true));
    one(&face("(#200)", &half), SurfaceKind::Torus, 0.5 * sheet(-apex, apex));
}

#[test]
fn offsets_of_quadrics_are_exact_and_those_of_sweeps_fitted() {
    let rings = ring(200, 6.0, 0.0, true) + &ring(300, 6.0, 10.0, false);
    let tube = format!("#50=OFFSET_SURFACE('',#51,2.,.F.);\n#51=CYLINDRICAL_SURFACE('',#10,4.);\n{rings}");
    let import = one(&face("(#200,#300)", &tube), SurfaceKind::Cylinder, 120.0 * PI);
    assert_eq!(import.report.repairs, []);
    // The same tube as the offset of an extruded circle.
    let swept = format!(
        "#50=OFFSET_SURFACE('',#51,2.,.F.);\n#51=SURFACE_OF_LINEAR_EXTRUSION('',#52,#54);\n\
         #52=CIRCLE('',#10,4.);\n#54=VECTOR('',#12,1.);\n{rings}"
    );
    let import = one(&face("(#200,#300)", &swept), SurfaceKind::Offset, 120.0 * PI);
    assert!(import.report.repairs[0].size_mm <= 1e-4, "{:?}", import.report.repairs);
    // A cone of 30° and radius 6 − 2 / cos 30° at the origin, moved out by 2.
    let radius = 6.0 - 2.0 / (PI / 6.0).cos();
    let cone = format!(
        "#50=OFFSET_SURFACE('',#51,2.,.F.);\n#51=CONICAL_SURFACE('',#10,{radius:?},30.);\n{}",
        ring(200, 6.0, 0.0, false)
    );
    one(&face("(#200)", &cone), SurfaceKind::Cone, PI * 6.0 * 12.0);
}

/// A bound `#id` of a curve `#curve` from `a` to `b` and the line back.
fn segment_of(id: u64, curve: u64, a: [f64; 3], b: [f64; 3]) -> String {
    let k = |n: u64| id + n;
    let d: Vec<f64> = (0..3).map(|i| a[i] - b[i]).collect();
    format!(
        "#{id}=FACE_BOUND('',#{},.T.);\n#{}=EDGE_LOOP('',(#{},#{}));\n\
         #{}=ORIENTED_EDGE('',*,*,#{},.T.);\n#{}=ORIENTED_EDGE('',*,*,#{},.T.);\n\
         #{}=EDGE_CURVE('',#{},#{},#{curve},.T.);\n#{}=EDGE_CURVE('',#{},#{},#{},.T.);\n\
         #{}=VERTEX_POINT('',#{});\n#{}=VERTEX_POINT('',#{});\n\
         #{}=CARTESIAN_POINT('',({:?},{:?},{:?}));\n#{}=CARTESIAN_POINT('',({:?},{:?},{:?}));\n\
         #{}=LINE('',#{},#{});\n#{}=VECTOR('',#{},1.);\n#{}=DIRECTION('',({:?},{:?},{:?}));\n",
        k(1),
        k(1),
        k(2),
        k(3),
        k(2),
        k(4),
        k(3),
        k(5),
        k(4),
        k(6),
        k(7),
        k(5),
        k(7),
        k(6),
        k(10),
        k(6),
        k(8),
        k(7),
        k(9),
        k(8),
        a[0],
        a[1],
        a[2],
        k(9),
        b[0],
        b[1],
        b[2],
        k(10),
        k(9),
        k(11),
        k(11),
        k(12),
        k(12),
        d[0],
        d[1],
        d[2],
    )
}

#[test]
fn parabolas_and_hyperbolas_bound_planes_and_are_swept() {
    let plane = "#50=PLANE('',#10);\n";
    // x = f t², y = 2 f t with f = 1 about (1, 2, 3), from t = −2 to 3: a chord cuts off (t2 − t1)³ f / 3.
    let (a, b) = ([5.0, -2.0, 3.0], [10.0, 8.0, 3.0]);
    let text = face("(#200)", &format!("{plane}#60=PARABOLA('',#10,1.);\n{}", segment_of(200, 60, a, b)));
    one(&text, SurfaceKind::Plane, 125.0 / 3.0);
    // x = 4 cosh t, y = 3 sinh t from t = −1 to 1: the sector is a b t, the triangle a b cosh t sinh t.
    let (x, y) = (4.0 * 1.0_f64.cosh(), 3.0 * 1.0_f64.sinh());
    let (a, b) = ([1.0 + x, 2.0 - y, 3.0], [1.0 + x, 2.0 + y, 3.0]);
    let text = face("(#200)", &format!("{plane}#60=HYPERBOLA('',#10,4.,3.);\n{}", segment_of(200, 60, a, b)));
    one(&text, SurfaceKind::Plane, x * y - 12.0);
    // The parabola extruded along z by 4; its boundary as four edges of a polygon would leave the surface, so the
    // face is cut from it by a plane figure seen along x: the rectangle 0 ≤ y ≤ 4, 0 ≤ z ≤ 4 on the sheet.
    let trimmed = "#51=TRIMMED_CURVE('',#60,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(2.)),.T.,.PARAMETER.);\n\
        #60=PARABOLA('',#10,1.);\n#54=VECTOR('',#12,1.);\n";
    let set = file(&format!(
        "#7=GEOMETRICALLY_BOUNDED_SURFACE_SHAPE_REPRESENTATION('',(#8),#1);\n#8=GEOMETRIC_SET('',(#50));\n\
         #10=AXIS2_PLACEMENT_3D('',#11,#12,#13);\n#11=CARTESIAN_POINT('',(1.,2.,3.));\n\
         #12=DIRECTION('',(0.,0.,1.));\n#13=DIRECTION('',(1.,0.,0.));\n\
         #50=RECTANGULAR_TRIMMED_SURFACE('',#52,0.,6.283185307179586,0.,2.,.T.,.T.);\n\
         #52=SURFACE_OF_REVOLUTION('',#51,#53);\n#53=AXIS1_PLACEMENT('',#11,#13);\n{trimmed}"
    ));
    // The parabola about its own axis: a paraboloid, 8/3 π f² ((1 + t²)^{3/2} − 1).
    let area = 8.0 / 3.0 * PI * (5.0_f64.powf(1.5) - 1.0);
    one(&set, SurfaceKind::Revolution, area);
}

#[test]
fn composite_curves_bound_and_sweep() {
    // A half circle of radius 4 about (1, 2, 3), extended at its end by a straight piece of 3 down.
    let curve = "#60=COMPOSITE_CURVE('',(#61,#62),.F.);\n\
        #61=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#63);\n#62=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.F.,#64);\n\
        #63=TRIMMED_CURVE('',#65,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(180.)),.T.,.PARAMETER.);\n\
        #65=CIRCLE('',#10,4.);\n#64=POLYLINE('',(#66,#67));\n#66=CARTESIAN_POINT('',(-3.,-1.,3.));\n\
        #67=CARTESIAN_POINT('',(-3.,2.,3.));\n";
    let text = face(
        "(#200)",
        &format!("#50=PLANE('',#10);\n{curve}{}", segment_of(200, 60, [5.0, 2.0, 3.0], [-3.0, -1.0, 3.0])),
    );
    one(&text, SurfaceKind::Plane, 8.0 * PI + 12.0);
}

#[test]
fn surfaces_of_a_geometric_set_are_faces() {
    let set = |data: &str| {
        file(&format!(
            "#7=GEOMETRICALLY_BOUNDED_SURFACE_SHAPE_REPRESENTATION('',(#8),#1);\n#8=GEOMETRIC_SET('',(#50));\n\
             #10=AXIS2_PLACEMENT_3D('',#11,#12,#13);\n#11=CARTESIAN_POINT('',(1.,2.,3.));\n\
             #12=DIRECTION('',(0.,0.,1.));\n#13=DIRECTION('',(1.,0.,0.));\n{data}"
        ))
    };
    let part = |basis: &str, range: &str| {
        set(&format!("#50=RECTANGULAR_TRIMMED_SURFACE('skin',#51,{range},.T.,.T.);\n#51={basis};\n"))
    };
    // Angles are degrees here.
    let import =
        one(&part("CYLINDRICAL_SURFACE('',#10,4.)", "30.,90.,-1.,5."), SurfaceKind::Cylinder, 8.0 * PI);
    assert_eq!(import.model.faces[0].source.name.as_deref(), Some("skin"));
    // Across the seam.
    one(&part("CYLINDRICAL_SURFACE('',#10,4.)", "330.,30.,-1.,5."), SurfaceKind::Cylinder, 8.0 * PI);
    one(&part("SPHERICAL_SURFACE('',#10,5.)", "0.,90.,0.,90."), SurfaceKind::Sphere, 100.0 * PI / 8.0);
    one(&part("PLANE('',#10)", "-1.,2.,3.,8."), SurfaceKind::Plane, 15.0);
    one(&set("#50=SPHERICAL_SURFACE('',#10,5.);\n"), SurfaceKind::Sphere, 100.0 * PI);
    // A disc bounded by a composite of two half circles.
    let disc = "#50=CURVE_BOUNDED_SURFACE('',#51,(#60),.F.);\n#51=PLANE('',#10);\n\
        #60=OUTER_BOUNDARY_CURVE('',(#61,#62),.F.);\n\
        #61=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#63);\n#62=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#64);\n\
        #63=TRIMMED_CURVE('',#65,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(180.)),.T.,.PARAMETER.);\n\
        #64=TRIMMED_CURVE('',#65,(PARAMETER_VALUE(180.)),(PARAMETER_VALUE(360.)),.T.,.PARAMETER.);\n\
        #65=CIRCLE('',#10,4.);\n";
    one(&set(disc), SurfaceKind::Plane, 16.0 * PI);
    let patch = "#50=(BOUNDED_SURFACE()B_SPLINE_SURFACE(1,1,((#51,#52),(#53,#54)),.UNSPECIFIED.,.F.,.F.,.F.)\
        B_SPLINE_SURFACE_WITH_KNOTS((2,2),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED.)GEOMETRIC_REPRESENTATION_ITEM()\
        REPRESENTATION_ITEM('')SURFACE());\n\
        #51=CARTESIAN_POINT('',(0.,0.,0.));\n#52=CARTESIAN_POINT('',(0.,10.,0.));\n\
        #53=CARTESIAN_POINT('',(20.,0.,0.));\n#54=CARTESIAN_POINT('',(20.,10.,0.));\n";
    one(&set(patch), SurfaceKind::Nurbs, 200.0);
}

#[test]
fn a_face_without_bounds_takes_those_of_its_surface() {
    let text = face(
        "()",
        "#50=RECTANGULAR_TRIMMED_SURFACE('',#51,0.,90.,0.,5.,.T.,.T.);\n#51=CYLINDRICAL_SURFACE('',#10,4.);\n",
    );
    one(&text, SurfaceKind::Cylinder, 10.0 * PI);
}

#[test]
fn an_offset_curve_bounds_a_plane() {
    // A circle of radius 5 as an offset of 1 outwards: V × T points inwards, so the distance is negative.
    let circle = "#60=OFFSET_CURVE_3D('',#61,-1.,.F.,#12);\n#61=CIRCLE('',#10,4.);\n";
    let bound = ring(200, 5.0, 0.0, true);
    let bound = bound.replace("#206,.T.", "#60,.T.");
    one(&face("(#200)", &format!("#50=PLANE('',#10);\n{circle}{bound}")), SurfaceKind::Plane, 25.0 * PI);
}

#[test]
fn several_data_sections_comments_and_long_lines() {
    let square = polygon(200, &[[0.0, 0.0, 3.0], [9.0, 0.0, 3.0], [9.0, 9.0, 3.0], [0.0, 9.0, 3.0]]);
    let text =
        face("(#200)", &format!("#50=PLANE('',#10);\nENDSEC;\n/* more; */\nDATA('two',('X'));\n{square}"));
    one(&text, SurfaceKind::Plane, 81.0);
    // Everything on one line, with comments in odd places.
    let long = text.replace(",.T.)", ",/* ' ; */.T.)").replace('\n', " ");
    one(&long, SurfaceKind::Plane, 81.0);
}
