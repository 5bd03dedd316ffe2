//! The known properties of a generated model, as `NAME.answers.json` holds them: regions, joints
//! with their continuity, and planted flaws.

use claymill_nurbs::FaceId;
use serde::{Deserialize, Serialize};

use crate::flaw::PlantedFlaw;

/// What is known about a generated model by construction: the answers that its readers are to find.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answers {
    /// What generated it.
    #[serde(default = "generator")]
    pub generator: String,
    /// Name of the sample.
    pub name: String,
    /// The seed it was shuffled with.
    pub seed: u64,
    /// Totals.
    pub totals: Totals,
    /// The smooth regions.
    pub regions: Vec<Region>,
    /// For each face, in the file's order: index into [`Self::regions`].
    pub region_of_face: Vec<usize>,
    /// All joints between patches, ordered by faces.
    pub joints: Vec<Joint>,
    /// The flaws planted on request.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub flaws: Vec<PlantedFlaw>,
}

/// Known again as one of ours.
pub(crate) fn generator() -> String {
    "claymill".to_owned()
}

/// Totals of a generated model.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Totals {
    /// Faces (patches).
    pub faces: usize,
    /// Smooth regions.
    pub regions: usize,
    /// Joints that are creases.
    pub joints_c0: usize,
    /// Joints with a common tangent plane and a jump in curvature.
    pub joints_g1: usize,
    /// Joints with common curvature.
    pub joints_g2: usize,
    /// Length of all joints, mm.
    pub joint_length_mm: f64,
    /// The least crease angle anywhere along any crease, degrees.
    pub least_crease_deg: f64,
}

/// A smooth region: faces connected by joints with a common tangent plane.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Region {
    /// What it is on the vehicle.
    pub name: String,
    /// Its faces, ascending.
    pub faces: Vec<FaceId>,
}

/// A stretch that two faces have in common.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// The two faces, the smaller first.
    pub faces: [FaceId; 2],
    /// Length, mm.
    pub length_mm: f64,
    /// How smooth it is, a gap or shift aside.
    pub class: Continuity,
    /// Largest angle between the faces' tangent planes along it, degrees; 0 where they agree.
    pub angle_deg: f64,
}

/// How smoothly two faces meet along a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Continuity {
    /// Positions agree: a crease.
    C0,
    /// Tangent planes agree too, curvatures do not.
    G1,
    /// Curvatures agree too.
    G2,
}
