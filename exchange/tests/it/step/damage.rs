//! Damaged files: a message, never a panic, never an endless run.

use claymill_exchange::ReadError;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::text::{face, polygon, ring, try_read};

fn square() -> String {
    polygon(200, &[[0.0, 0.0, 3.0], [9.0, 0.0, 3.0], [9.0, 9.0, 3.0], [0.0, 9.0, 3.0]])
}

/// The reason why the only face was skipped.
#[track_caller]
fn reason(text: &str) -> String {
    match try_read(text.as_bytes()) {
        Err(ReadError::NoFaces { report, .. }) => {
            assert_eq!((report.faces_in_file, report.skipped.len()), (1, 1));
            assert_eq!(report.skipped[0].entity, "#100");
            report.skipped[0].reason.clone()
        }
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("the face was read"),
    }
}

#[test]
fn a_damaged_face_says_which_entity_is_wrong() {
    let with = |surface: &str| reason(&face("(#200)", &format!("{surface}{}", square())));
    assert_eq!(with(""), "#50 is referred to but not in the file");
    assert_eq!(with("#50=PLANE('',#51);\n"), "#51 is referred to but not in the file");
    assert_eq!(with("#50=SURFACE_REPLICA('',#51,#10);\n"), "#50: SURFACE_REPLICA is not supported");
    assert!(with("#50=OFFSET_SURFACE('',#50,2.,.F.);\n").contains("refers to itself"));
    assert!(with("#50=PLANE('',#10;\n").starts_with("#50 cannot be parsed (line"));
    assert!(with("#50=CYLINDRICAL_SURFACE('',#10,-2.);\n").contains("a radius is -2"));
    assert!(
        with("#50=PLANE('',#200);\n").contains("#200 is FACE_OUTER_BOUND where AXIS2_PLACEMENT_3D is needed")
    );
    assert!(
        with("#50=RECTANGULAR_TRIMMED_SURFACE('',#50,0.,1.,0.,1.,.T.,.T.);\n").contains("refers to itself")
    );
    // The square lies three millimetres under this plane.
    let low =
        "#50=PLANE('',#51);\n#51=AXIS2_PLACEMENT_3D('',#52,$,$);\n#52=CARTESIAN_POINT('',(0.,0.,6.));\n";
    assert!(with(low).contains("3.000 mm off its surface"));
}

#[test]
fn an_open_loop_and_a_lonely_ring_are_refused() {
    let open = "#50=PLANE('',#10);\n#200=FACE_BOUND('',#201,.T.);\n#201=EDGE_LOOP('',(#202));\n\
        #202=ORIENTED_EDGE('',*,*,#203,.T.);\n#203=EDGE_CURVE('',#204,#205,#206,.T.);\n\
        #204=VERTEX_POINT('',#11);\n#205=VERTEX_POINT('',#207);\n#207=CARTESIAN_POINT('',(8.,2.,3.));\n\
        #206=CIRCLE('',#10,7.);\n";
    let text = face("(#200)", open);
    assert!(reason(&text).contains("#"));
    let ring = format!("#50=CYLINDRICAL_SURFACE('',#10,4.);\n{}", ring(200, 4.0, 0.0, true));
    assert!(reason(&face("(#200)", &ring)).contains("runs round the surface"));
}

#[test]
fn a_truncated_file_is_named_as_such() {
    let text = face("(#200)", &format!("#50=PLANE('',#10);\n{}", square()));
    for cut in [40, 400, text.len() / 2, text.len() - 20] {
        let error = try_read(&text.as_bytes()[..cut]).unwrap_err();
        assert!(matches!(error, ReadError::Truncated { .. }), "{cut}: {error}");
    }
}

#[test]
fn an_assembly_inside_itself_ends() {
    let text = face(
        "(#200)",
        &format!(
            "#50=PLANE('',#10);\n{}#60=SHAPE_REPRESENTATION('',(#10),#1);\n\
             #61=(REPRESENTATION_RELATIONSHIP('','',#7,#60)REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#63)\
             SHAPE_REPRESENTATION_RELATIONSHIP());\n\
             #62=(REPRESENTATION_RELATIONSHIP('','',#60,#7)REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#63)\
             SHAPE_REPRESENTATION_RELATIONSHIP());\n#63=ITEM_DEFINED_TRANSFORMATION('','',#10,#10);\n",
            square()
        ),
    );
    let import = try_read(text.as_bytes()).unwrap();
    assert_eq!(import.model.faces.len(), 1);
    assert_eq!(import.report.warnings.len(), 1);
}

/// Files that reach most of the reader.
fn specimens() -> Vec<String> {
    let rings = ring(200, 4.0, 0.0, true) + &ring(300, 4.0, 10.0, false);
    let spline = "#50=(BOUNDED_SURFACE()B_SPLINE_SURFACE(1,2,((#51,#52,#53),(#54,#55,#56)),.UNSPECIFIED.,.F.,.F.,.F.)\
        B_SPLINE_SURFACE_WITH_KNOTS((2,2),(3,3),(0.,1.),(0.,1.),.UNSPECIFIED.)GEOMETRIC_REPRESENTATION_ITEM()\
        RATIONAL_B_SPLINE_SURFACE(((1.,0.7,1.),(1.,0.7,1.)))REPRESENTATION_ITEM('')SURFACE());\n\
        #51=CARTESIAN_POINT('',(0.,0.,3.));\n#52=CARTESIAN_POINT('',(0.,5.,3.));\n#53=CARTESIAN_POINT('',(0.,10.,3.));\n\
        #54=CARTESIAN_POINT('',(10.,0.,3.));\n#55=CARTESIAN_POINT('',(10.,5.,3.));\n#56=CARTESIAN_POINT('',(10.,10.,3.));\n";
    let triangle = polygon(400, &[[1.0, 1.0, 3.0], [9.0, 1.0, 3.0], [1.0, 5.0, 3.0]]);
    let line = "#51=LINE('',#52,#53);\n#52=CARTESIAN_POINT('',(5.,2.,3.));\n#53=VECTOR('',#12,2.);\n";
    vec![
        face("(#200,#300)", &format!("#50=CYLINDRICAL_SURFACE('',#10,4.);\n{rings}")),
        face("(#400)", &format!("{spline}{triangle}")),
        face(
            "(#200,#300)",
            &format!(
                "#50=SURFACE_OF_REVOLUTION('',#51,#54);\n#54=AXIS1_PLACEMENT('',#11,#12);\n{line}{rings}"
            ),
        ),
        face("(#200)", &format!("#50=SPHERICAL_SURFACE('',#10,5.);\n{}", ring(200, 4.0, 3.0, true))),
    ]
}

#[test]
fn random_damage_never_panics() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for text in specimens() {
        assert_eq!(try_read(text.as_bytes()).unwrap().report.faces_read, 1);
        for _ in 0..150 {
            let mut bytes = text.clone().into_bytes();
            for _ in 0..rng.random_range(1..6) {
                let at = rng.random_range(0..bytes.len());
                match rng.random_range(0..4) {
                    0 => bytes[at] = rng.random(),
                    1 => bytes[at] = b"0123456789.-#(),;'$*E"[rng.random_range(0..21)],
                    2 => drop(bytes.drain(at..(at + rng.random_range(1..30)).min(bytes.len()))),
                    _ => bytes.insert(at, b"0123456789.-#(),;'$*E"[rng.random_range(0..21)]),
                }
            }
            // What comes out does not matter here, only that something does.
            let _ = try_read(&bytes);
        }
        for _ in 0..30 {
            let _ = try_read(&text.as_bytes()[..rng.random_range(0..text.len())]);
        }
    }
}
