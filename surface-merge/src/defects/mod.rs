//! Defects of surface models, in the manner of VDA 4955 and the SASIG PDQ guideline: each with a code, the faces
//! concerned, a place and a size.
//!
//! ```text
//!   each face alone ── surfaces, loops ─┐
//!   faces pair by pair ── overlaps ─────┼─► Defects, by code and face
//!   joints and naked edges ── borders ──┘
//! ```
//!
//! Limits are those of VDA 4955 as CAD systems ship them: gaps, tiny edges and knot distances of 0.02 mm, patches
//! of 0.2 mm, degrees up to 11, radii down to 0.5 mm.

mod borders;
mod loops;
mod overlaps;
mod surfaces;

use claymill_nurbs::{FaceId, Model, Point3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::Merge;

/// Neighbours farther apart than this gape, edges shorter than this are tiny, knots nearer than this are one, mm.
pub const GAP_MM: f64 = 0.02;
/// Faces narrower than this are tiny, mm.
pub const TINY_FACE_MM: f64 = 0.2;
/// Surfaces of a higher degree travel badly between systems.
pub const HIGHEST_DEGREE: usize = 11;
/// Radii smaller than this are hardly meant, mm.
pub const SMALLEST_RADIUS_MM: f64 = 0.5;

/// What is wrong. The codes are built like those of the SASIG PDQ guideline: geometry, element, fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum DefectCode {
    /// A joint gapes.
    #[serde(rename = "G-SH-LG")]
    Gap,
    /// More than two faces meet along an edge.
    #[serde(rename = "G-SH-NM")]
    NonManifold,
    /// Neighbours point to different sides.
    #[serde(rename = "G-SH-IN")]
    InconsistentNormals,
    /// Two faces are the same.
    #[serde(rename = "G-FA-DU")]
    Duplicate,
    /// Two faces share a part of their area.
    #[serde(rename = "G-FA-OV")]
    Overlap,
    /// A face that is all but nothing.
    #[serde(rename = "G-FA-TI")]
    TinyFace,
    /// An edge that is all but a point.
    #[serde(rename = "G-ED-TI")]
    TinyEdge,
    /// A trim loop crosses itself or another loop of its face.
    #[serde(rename = "G-LO-IS")]
    CrossingLoop,
    /// The surface turns over.
    #[serde(rename = "G-SU-FO")]
    Folded,
    /// A side of the surface is a point, or its parametrisation vanishes inside.
    #[serde(rename = "G-SU-DP")]
    Degenerate,
    /// Knots lie so close that the patch between them is a hair.
    #[serde(rename = "G-SU-IK")]
    CloseKnots,
    /// The degree is too high.
    #[serde(rename = "G-SU-HD")]
    HighDegree,
    /// The surface bends more tightly than a part does.
    #[serde(rename = "G-SU-CR")]
    SmallRadius,
}

impl DefectCode {
    /// The code, as in the JSON.
    #[must_use]
    pub fn code(self) -> &'static str {
        use DefectCode as D;
        match self {
            D::Gap => "G-SH-LG",
            D::NonManifold => "G-SH-NM",
            D::InconsistentNormals => "G-SH-IN",
            D::Duplicate => "G-FA-DU",
            D::Overlap => "G-FA-OV",
            D::TinyFace => "G-FA-TI",
            D::TinyEdge => "G-ED-TI",
            D::CrossingLoop => "G-LO-IS",
            D::Folded => "G-SU-FO",
            D::Degenerate => "G-SU-DP",
            D::CloseKnots => "G-SU-IK",
            D::HighDegree => "G-SU-HD",
            D::SmallRadius => "G-SU-CR",
        }
    }

    /// In words, with what the size of the defect means.
    #[must_use]
    pub fn words(self) -> &'static str {
        use DefectCode as D;
        match self {
            D::Gap => "gap between neighbours, mm",
            D::NonManifold => "edge of more than two faces, length in mm",
            D::InconsistentNormals => "neighbours point to different sides, length in mm",
            D::Duplicate => "face is there twice, area in mm²",
            D::Overlap => "faces overlap, distance in mm",
            D::TinyFace => "tiny face, width in mm",
            D::TinyEdge => "tiny edge, length in mm",
            D::CrossingLoop => "trim loop crosses itself or another",
            D::Folded => "folded surface, turn in degrees",
            D::Degenerate => "degenerate side of a surface, length in mm",
            D::CloseKnots => "knots too close, distance in mm",
            D::HighDegree => "degree too high, degree",
            D::SmallRadius => "small radius, mm",
        }
    }
}

/// A defect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Defect {
    /// What is wrong.
    pub code: DefectCode,
    /// The faces concerned.
    pub faces: Vec<FaceId>,
    /// Where it is worst, mm.
    pub at: Point3,
    /// How bad: see [`DefectCode::words`].
    pub size: f64,
}

/// Finds the defects of `model`, of which `merged` tells how the faces meet; sorted by code and face.
/// `areas_mm2` are those of the faces.
#[must_use]
pub fn defects(model: &Model, merged: &Merge, areas_mm2: &[f64]) -> Vec<Defect> {
    let alone = |(id, face): (FaceId, &claymill_nurbs::Face)| {
        let mut found = surfaces::of(id, face, areas_mm2.get(id).copied().unwrap_or(f64::INFINITY));
        found.extend(loops::of(id, face));
        found
    };
    let mut found: Vec<Defect> = model.faces.par_iter().enumerate().flat_map_iter(alone).collect();
    found.extend(borders::of(model, merged));
    found.extend(overlaps::of(model, areas_mm2));
    found.sort_by(|a, b| (a.code, &a.faces).cmp(&(b.code, &b.faces)).then(b.size.total_cmp(&a.size)));
    found
}
