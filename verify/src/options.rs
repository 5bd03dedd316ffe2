//! How closely the verifier samples, and its limits for gouges, excess and crests; spacings grow
//! with larger balls and scallop heights.

use std::path::PathBuf;

use claymill_toolpath::{Holder, Job, Request};

/// How closely the verifier looks, and where its bars are.
#[derive(Debug, Clone, PartialEq)]
pub struct VerifyOptions {
    /// The model file, when it is not where `job.json` says.
    pub model: Option<PathBuf>,
    /// The job folder, as seen from which its obstacles are found.
    pub folder: PathBuf,
    /// Obstacles besides those that the job was planned around: STL, OBJ or glTF files.
    pub obstacles: Vec<PathBuf>,
    /// Millimetres in one unit of those whose format has no unit.
    pub obstacle_unit_mm: f64,
    /// Distance that the ball has to keep from obstacles, mm; as the job asks if nothing is said here.
    pub check_clearance_mm: Option<f64>,
    /// Distance between samples along the paths for gouges and contact, mm; for larger balls than [`USUAL_RADIUS_MM`] it
    /// grows with the root of the radius, so that a ball sinks no deeper between two samples.
    pub path_spacing_mm: f64,
    /// Distance between samples along the passes for scallop crests, mm; grows likewise.
    pub crest_spacing_mm: f64,
    /// Area that one sample of the surfaces stands for, mm²; where radius times scallop height is larger than usual, it grows
    /// with that, as the square of a step-over does.
    pub area_per_sample_mm2: f64,
    /// Distance of the paths from the chords that replace them in the swept volume, mm; above [`USUAL_SCALLOP_MM`] it grows
    /// with the scallop height.
    pub chord_mm: f64,
    /// Distance of the surfaces from the triangles that stand for them above the tool, mm.
    pub mesh_deviation_mm: f64,
    /// Longest edge of those triangles, mm.
    pub mesh_edge_mm: f64,
    /// A surface point counts as cut when no more than this many scallop heights are left on it.
    pub cut_limit: f64,
    /// Bar for the 99th percentile of the crests, in scallop heights.
    pub scallop_limit: f64,
    /// Bar for gouges, mm.
    pub gouge_limit_mm: f64,
    /// Bar for material left under a pass where the ball rests on a face, mm.
    pub excess_limit_mm: f64,
    /// A holder to look at instead of those of the job's tools.
    pub holder: Option<Holder>,
    /// Distance that holders have to keep from model and obstacles, mm; as the job asks if nothing is said here.
    pub holder_clearance_mm: Option<f64>,
    /// Surfaces that lean further than this from a setup's axis, degrees, count as within its reach only as walls: where nothing
    /// stands out over them, down to 19 ball radii, and if they do not look down into the open.
    pub steepest_deg: f64,
}

impl VerifyOptions {
    /// Distance that holders have to keep in what was asked for, mm.
    pub(crate) fn holder_clearance_of_mm(&self, request: &Request) -> f64 {
        self.holder_clearance_mm.unwrap_or(request.holder_clearance_mm)
    }
}

impl Default for VerifyOptions {
    fn default() -> Self {
        VerifyOptions {
            model: None,
            folder: PathBuf::from("."),
            obstacles: Vec::new(),
            obstacle_unit_mm: 1.0,
            check_clearance_mm: None,
            path_spacing_mm: 1.0,
            crest_spacing_mm: 2.0,
            area_per_sample_mm2: 40.0,
            chord_mm: 3e-4,
            mesh_deviation_mm: 0.1,
            mesh_edge_mm: 40.0,
            cut_limit: 1.5,
            scallop_limit: SCALLOP_BAR,
            gouge_limit_mm: 5e-3,
            excess_limit_mm: 5e-3,
            holder: None,
            holder_clearance_mm: None,
            steepest_deg: 80.0,
        }
    }
}

/// Neighbouring passes are looked for within this many nominal step-overs of the ball's centre, so that the
/// gap of a missing pass is still seen.
pub(crate) const REACH_STEPS: f64 = 3.0;

/// Usual bar for scallop crests, in the height asked for.
pub const SCALLOP_BAR: f64 = 1.05;
/// The ball and the scallop height whose spacings the options tell, mm.
pub const USUAL_RADIUS_MM: f64 = 10.0;
/// See [`USUAL_RADIUS_MM`].
pub const USUAL_SCALLOP_MM: f64 = 0.1;

impl VerifyOptions {
    /// With the spacings that suit the job's smallest tool.
    pub(crate) fn suited_to(&self, job: &Job) -> VerifyOptions {
        let radii = job.tools.iter().map(|t| t.tool.radius_mm());
        let larger = radii.reduce(f64::min).unwrap_or(USUAL_RADIUS_MM) / USUAL_RADIUS_MM;
        let higher = job.request.scallop_mm / USUAL_SCALLOP_MM;
        let wider = larger.max(1.0).sqrt();
        VerifyOptions {
            path_spacing_mm: self.path_spacing_mm * wider,
            crest_spacing_mm: self.crest_spacing_mm * wider,
            area_per_sample_mm2: self.area_per_sample_mm2 * (larger * higher).max(1.0),
            chord_mm: self.chord_mm * higher.max(1.0),
            ..self.clone()
        }
    }
}
