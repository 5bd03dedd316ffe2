//! Small STEP files, written by hand.

use std::path::Path;

use claymill_exchange::{Import, ReadError, read_bytes};

/// A file around data lines. `#1` is the context in millimetres, degrees and 0.001 mm.
pub(crate) fn file(data: &str) -> String {
    format!(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'writer','','');\n\
         FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n\
         #1=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#5))\
         GLOBAL_UNIT_ASSIGNED_CONTEXT((#2,#3))REPRESENTATION_CONTEXT('',''));\n\
         #2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n\
         #3=(CONVERSION_BASED_UNIT('DEGREE',#4)NAMED_UNIT(*)PLANE_ANGLE_UNIT());\n\
         #4=PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.0174532925199433),#6);\n\
         #5=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.001),#2,'','');\n\
         #6=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\n\
         {data}ENDSEC;\nEND-ISO-10303-21;\n"
    )
}

/// A file with the face `#100` on the surface `#50`, outside where the surface's is: `bounds` is the face's list of
/// bounds. `#10` is the placement of everything: origin (1, 2, 3), axis z, angles from x.
pub(crate) fn face(bounds: &str, data: &str) -> String {
    file(&format!(
        "#7=SHAPE_REPRESENTATION('',(#8),#1);\n#8=SHELL_BASED_SURFACE_MODEL('',(#9));\n\
         #9=OPEN_SHELL('',(#100));\n\
         #10=AXIS2_PLACEMENT_3D('',#11,#12,#13);\n#11=CARTESIAN_POINT('',(1.,2.,3.));\n\
         #12=DIRECTION('',(0.,0.,1.));\n#13=DIRECTION('',(1.,0.,0.));\n\
         #100=ADVANCED_FACE('skin',{bounds},#50,.T.);\n{data}"
    ))
}

/// A full circle of radius `r` about the axis of [`face`] at height `z` over its origin, as the bound `#id` (its
/// parts take the numbers up to `id + 9`); anticlockwise seen from above when `forward`.
pub(crate) fn ring(id: u64, r: f64, z: f64, forward: bool) -> String {
    let [edge_loop, oriented, edge, vertex, point, circle, placement, centre] =
        [1, 2, 3, 4, 5, 6, 7, 8].map(|k| id + k);
    let flag = if forward { "T" } else { "F" };
    let z = 3.0 + z;
    format!(
        "#{id}=FACE_BOUND('',#{edge_loop},.T.);\n#{edge_loop}=EDGE_LOOP('',(#{oriented}));\n\
         #{oriented}=ORIENTED_EDGE('',*,*,#{edge},.{flag}.);\n#{edge}=EDGE_CURVE('',#{vertex},#{vertex},#{circle},.T.);\n\
         #{vertex}=VERTEX_POINT('',#{point});\n#{point}=CARTESIAN_POINT('',({:?},2.,{z:?}));\n\
         #{circle}=CIRCLE('',#{placement},{r:?});\n#{placement}=AXIS2_PLACEMENT_3D('',#{centre},#12,#13);\n\
         #{centre}=CARTESIAN_POINT('',(1.,2.,{z:?}));\n",
        1.0 + r
    )
}

/// A polygon as the bound `#id`; parts take the numbers up to `id + 2 + corners`.
pub(crate) fn polygon(id: u64, corners: &[[f64; 3]]) -> String {
    let points: String = (corners.iter().zip(id + 2..))
        .map(|([x, y, z], id)| format!("#{id}=CARTESIAN_POINT('',({x:?},{y:?},{z:?}));\n"))
        .collect();
    let list: Vec<String> = (0..corners.len() as u64).map(|k| format!("#{}", id + 2 + k)).collect();
    let (list, poly_loop) = (list.join(","), id + 1);
    format!("#{id}=FACE_OUTER_BOUND('',#{poly_loop},.T.);\n#{poly_loop}=POLY_LOOP('',({list}));\n{points}")
}

pub(crate) fn try_read(text: &[u8]) -> Result<Import, ReadError> {
    read_bytes(text, Path::new("hand.stp"))
}

#[track_caller]
pub(crate) fn read(text: &str) -> Import {
    match try_read(text.as_bytes()) {
        Ok(import) => import,
        Err(error) => panic!("{error}"),
    }
}
