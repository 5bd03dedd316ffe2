//! What counts as the shape of a part: nothing is read twice because a second representation names it.

use claymill_exchange::Import;

use super::text::{file, polygon, read};

/// A part of one face (`#100`, 4 mm²) with its product, whose shape is the representation `#20`.
fn part(data: &str) -> Import {
    let square = polygon(200, &[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0]]);
    read(&file(&format!(
        "#10=AXIS2_PLACEMENT_3D('',#11,#12,#13);\n#11=CARTESIAN_POINT('',(0.,0.,0.));\n\
         #12=DIRECTION('',(0.,0.,1.));\n#13=DIRECTION('',(1.,0.,0.));\n#50=PLANE('',#10);\n\
         #100=ADVANCED_FACE('skin',(#200),#50,.T.);\n{square}\
         #8=SHELL_BASED_SURFACE_MODEL('',(#9));\n#9=OPEN_SHELL('',(#100));\n\
         #30=PRODUCT_DEFINITION('','',$,$);\n#31=PRODUCT_DEFINITION_SHAPE('','',#30);\n\
         #32=SHAPE_DEFINITION_REPRESENTATION(#31,#20);\n{data}"
    )))
}

#[track_caller]
fn one_face(import: &Import, repeated: bool) {
    assert_eq!(
        (import.report.faces_in_file, import.model.faces.len()),
        (1, 1),
        "{:?}",
        import.report.warnings
    );
    let told = import.report.warnings.iter().any(|w| w.contains("again"));
    assert_eq!(told, repeated, "{:?}", import.report.warnings);
}

const SHAPE: &str = "#20=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#8,#10),#1);\n";

#[test]
fn a_shape_alone_is_one_part() {
    one_face(&part(SHAPE), false);
}

/// The solid that validation properties belong to is named once more, before or after the shape itself.
#[test]
fn what_properties_are_associated_with_is_no_second_part() {
    for id in [15, 25] {
        let aspect = format!(
            "{SHAPE}#{id}=SHAPE_REPRESENTATION('',(#8),#1);\n\
             #40=SHAPE_ASPECT('','solid data associated with a part',#31,.F.);\n\
             #41=PROPERTY_DEFINITION('','shape for solid data with which properties are associated',#40);\n\
             #42=SHAPE_DEFINITION_REPRESENTATION(#41,#{id});\n"
        );
        one_face(&part(&aspect), true);
    }
}

/// Placing the shape in the representation of a property does not take it from its product.
#[test]
fn a_property_that_holds_the_part_does_not_move_it() {
    let moved = format!(
        "{SHAPE}#21=SHAPE_REPRESENTATION('',(#22),#1);\n#22=MAPPED_ITEM('',#23,#24);\n\
         #23=REPRESENTATION_MAP(#10,#20);\n#24=AXIS2_PLACEMENT_3D('',#26,#12,#13);\n\
         #26=CARTESIAN_POINT('',(500.,0.,0.));\n#40=SHAPE_ASPECT('','',#31,.F.);\n\
         #41=PROPERTY_DEFINITION('','',#40);\n#42=PROPERTY_DEFINITION_REPRESENTATION(#41,#21);\n"
    );
    let import = part(&moved);
    one_face(&import, true);
    assert_eq!(import.model.faces[0].bounds().min.x, 0.0);
}

/// A solid and its shell, or two representations of one product, name the same face.
#[test]
fn two_representations_of_one_part_do_not_double_its_faces() {
    let tied = format!(
        "{SHAPE}#21=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#22),#1);\n#22=MANIFOLD_SOLID_BREP('',#9);\n\
         #40=SHAPE_REPRESENTATION_RELATIONSHIP('','',#20,#21);\n"
    );
    one_face(&part(&tied), true);
    let loose = format!("{SHAPE}#21=SHAPE_REPRESENTATION('',(#8),#1);\n");
    one_face(&part(&loose), true);
}

/// A face that only the representation of a property has is not lost.
#[test]
fn what_only_a_property_names_is_read() {
    let only = "#20=SHAPE_REPRESENTATION('',(#10),#1);\n#21=SHAPE_REPRESENTATION('',(#8),#1);\n\
                #40=SHAPE_ASPECT('','',#31,.F.);\n#41=PROPERTY_DEFINITION('','',#40);\n\
                #42=SHAPE_DEFINITION_REPRESENTATION(#41,#21);\n";
    one_face(&part(only), false);
}

/// The same part in two places is two parts; twice in one place it is one.
#[test]
fn instances_in_different_places_stay() {
    for (x, faces) in [(7.0, 2), (0.0, 1)] {
        let assembly = format!(
            "#19=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#8,#10),#1);\n\
             #20=SHAPE_REPRESENTATION('',(#22,#27),#1);\n#22=MAPPED_ITEM('',#23,#24);\n\
             #23=REPRESENTATION_MAP(#10,#19);\n#24=AXIS2_PLACEMENT_3D('',#26,#12,#13);\n\
             #26=CARTESIAN_POINT('',({x:?},0.,0.));\n#27=MAPPED_ITEM('',#23,#10);\n"
        );
        assert_eq!(part(&assembly).model.faces.len(), faces);
    }
}
