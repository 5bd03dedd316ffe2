//! Objects in an archive: a class identity and the class's data.

use super::archive::{Reader, Uuid};
use super::fault::Fault;

const OBJECT: u32 = 0x0002_7ffa;
const OBJECT_CLASS: u32 = 0x0002_fffb;
const OBJECT_DATA: u32 = 0x0002_fffc;

/// What an object is (identities as in `ON_OBJECT_IMPLEMENT` of the openNURBS toolkit).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Class {
    Brep,
    Extrusion,
    NurbsSurface,
    PlaneSurface,
    RevolutionSurface,
    SumSurface,
    NurbsCurve,
    PolyCurve,
    PolylineCurve,
    LineCurve,
    ArcCurve,
    CurveOnSurface,
    Mesh,
    SubD,
    Block,
    BlockReference,
    Layer,
    Point,
    PointCloud,
    Light,
    Hatch,
    ClippingPlane,
    Annotation,
    Other,
}

const CLASSES: [(u128, Class); 43] = [
    // Rhino's own variants of the toolkit's classes, and old names of them; the data are the same.
    (0xf06fc243_a32a_4608_9dd8_a7d2c4ce2a36, Class::Brep),
    (0x2d4cfedb_3e2a_11d4_800e_0010830122f0, Class::Brep),
    (0x0705fdef_3e2a_11d4_800e_0010830122f0, Class::Brep),
    (0x4760c817_0be3_11d4_bffe_0010830122f0, Class::NurbsSurface),
    (0xfa4fd4b5_1613_11d4_8000_0010830122f0, Class::NurbsSurface),
    (0x0a8401b6_4d34_4b99_8615_1b4e723dc4e5, Class::RevolutionSurface),
    (0x665f6331_2a66_4cce_81d0_b5eebd9b5417, Class::SumSurface),
    (0x5eaf1119_0b51_11d4_bffe_0010830122f0, Class::NurbsCurve),
    (0x76a709d5_1550_11d4_8000_0010830122f0, Class::NurbsCurve),
    (0xef638317_154b_11d4_8000_0010830122f0, Class::PolyCurve),
    (0x60b5dbc5_e660_11d3_bfe4_0010830122f0, Class::Brep),
    (0x36f53175_72b8_4d47_bf1f_b4e6fc24f4b9, Class::Extrusion),
    (0x4ed7d4de_e947_11d3_bfe5_0010830122f0, Class::NurbsSurface),
    (0x4ed7d4df_e947_11d3_bfe5_0010830122f0, Class::PlaneSurface),
    (0xa16220d3_163b_11d4_8000_0010830122f0, Class::RevolutionSurface),
    (0xc4cd5359_446d_4690_9ff5_29059732472b, Class::SumSurface),
    (0x4ed7d4dd_e947_11d3_bfe5_0010830122f0, Class::NurbsCurve),
    (0x4ed7d4e0_e947_11d3_bfe5_0010830122f0, Class::PolyCurve),
    (0x4ed7d4e6_e947_11d3_bfe5_0010830122f0, Class::PolylineCurve),
    (0x4ed7d4db_e947_11d3_bfe5_0010830122f0, Class::LineCurve),
    (0xcf33be2a_09b4_11d4_bffb_0010830122f0, Class::ArcCurve),
    (0x4ed7d4d8_e947_11d3_bfe5_0010830122f0, Class::CurveOnSurface),
    (0x4ed7d4e4_e947_11d3_bfe5_0010830122f0, Class::Mesh),
    (0xf09ba4d9_455b_42c3_ba3b_e6ccacef853b, Class::SubD),
    (0x26f8bff6_2618_417f_a158_153d64a94989, Class::Block),
    (0xf9cfb638_b9d4_4340_87e3_c56e7865d96a, Class::BlockReference),
    (0x95809813_e985_11d3_bfe5_0010830122f0, Class::Layer),
    (0xc3101a1d_f157_11d3_bfe7_0010830122f0, Class::Point),
    (0x2488f347_f8fa_11d3_bfec_0010830122f0, Class::PointCloud),
    (0x85a08513_f383_11d3_bfe7_0010830122f0, Class::Light),
    (0x0559733b_5332_49d1_a936_0532ac76ade5, Class::Hatch),
    (0xdbc5a584_ce3f_4170_98a8_497069ca5c36, Class::ClippingPlane),
    (0x74198302_cdf4_4f95_9609_6d684f22ab37, Class::Annotation),
    (0x57376349_62a9_4a16_b411_a46bcd544790, Class::Annotation),
    (0x945bf594_6ff9_4f5c_bfc0_b3af528f29d2, Class::Annotation),
    (0xe550882b_f44d_4154_a1ef_6e50cbbbf543, Class::Annotation),
    (0xd417786b_f6cd_4f12_9e1f_063f414dbeb6, Class::Annotation),
    (0xfc749c2f_4c00_41fd_9840_26d94f047ad3, Class::Annotation),
    (0x03124828_4c9b_4d28_9a82_664ddde7a14f, Class::Annotation),
    (0xbd57f33b_a1b2_46e9_9c6e_af09d30ffdde, Class::Annotation),
    (0xb2b683fc_7964_4e96_b1f9_9b356a76b08b, Class::Annotation),
    (0x46f75541_f46b_48be_aa7e_b353bbe068a7, Class::Annotation),
    (0x14922b7a_5b65_4f11_8345_d415a9637129, Class::Annotation),
];

impl Class {
    fn of(id: Uuid) -> Class {
        CLASSES.iter().find(|(known, _)| Uuid::new(*known) == id).map_or(Class::Other, |(_, class)| *class)
    }

    /// What a user of Rhino calls it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Class::Brep => "polysurface",
            Class::Extrusion => "extrusion",
            Class::NurbsSurface => "NURBS surface",
            Class::PlaneSurface => "plane surface",
            Class::RevolutionSurface => "surface of revolution",
            Class::SumSurface => "sum surface",
            Class::NurbsCurve | Class::PolyCurve | Class::PolylineCurve => "curve",
            Class::LineCurve | Class::ArcCurve | Class::CurveOnSurface => "curve",
            Class::Mesh => "mesh",
            Class::SubD => "SubD",
            Class::Block => "block",
            Class::BlockReference => "block instance",
            Class::Layer => "layer",
            Class::Point => "point",
            Class::PointCloud => "point cloud",
            Class::Light => "light",
            Class::Hatch => "hatch",
            Class::ClippingPlane => "clipping plane",
            Class::Annotation => "annotation",
            Class::Other => "object of unknown class",
        }
    }
}

/// An object's class and the reader of its data.
#[derive(Debug, Clone)]
pub(super) struct Object<'a> {
    pub(super) class: Class,
    pub(super) data: Reader<'a>,
}

/// Opens the object that comes next; the reader moves behind it. `None` where an empty one was written.
pub(super) fn optional<'a>(reader: &mut Reader<'a>) -> Result<Option<Object<'a>>, Fault> {
    let mut object = reader.chunk_of(OBJECT, "an object")?;
    let mut class = object.chunk_of(OBJECT_CLASS, "the class of an object")?;
    let id = class.uuid()?;
    class.finish()?;
    if id.is_nil() {
        return Ok(None);
    }
    let data = object.chunk_of(OBJECT_DATA, "the data of an object")?;
    Ok(Some(Object { class: Class::of(id), data }))
}

/// As [`optional`], where there must be one.
pub(super) fn object<'a>(reader: &mut Reader<'a>) -> Result<Object<'a>, Fault> {
    let at = reader.position();
    let wanted = "an object";
    optional(reader)?.ok_or_else(|| Fault::Found { at, found: "an empty object".into(), wanted })
}
