//! Every tolerance of this crate that is not an option, named and with its unit.

/// An edge turning by more than this at a knot is two edges, degrees.
pub(crate) const CORNER_DEG: f64 = 3.0;
/// Edges that run along each other differ in direction by less than this, degrees.
pub(crate) const ALONG_DEG: f64 = 10.0;
/// Edges shorter than this are collapsed sides (poles), mm.
pub(crate) const COLLAPSED_MM: f64 = 1e-5;
/// A foot point may overshoot the end of an edge by this much, mm.
pub(crate) const OVERSHOOT_MM: f64 = 1e-6;
/// Ends of runs are located to this share of the edge.
pub(crate) const RUN_END_SHARE: f64 = 1e-9;
/// Gaps below this are one class for the automatic tolerance, mm.
pub(crate) const SMALLEST_GAP_MM: f64 = 1e-4;
/// The automatic tolerance when all gaps are of one kind, mm (the G0 limit of VDA 4955).
pub(crate) const USUAL_TOLERANCE_MM: f64 = 0.02;
/// The automatic tolerance never exceeds this, mm.
pub(crate) const LARGEST_TOLERANCE_MM: f64 = 0.1;
/// Edges farther apart than this are never one joint, mm, unless the file's tolerance is coarse.
pub(crate) const SEARCH_RADIUS_MM: f64 = 0.5;
/// Laps are looked for at places this far apart, mm.
pub(crate) const LAP_STEP_MM: f64 = 5.0;
/// Longest chord of an edge's polyline, mm.
pub(crate) const LONGEST_CHORD_MM: f64 = 50.0;
/// Largest turn of an edge within one chord, radians.
pub(crate) const CHORD_TURN: f64 = 0.15;
/// Fewest chords of an edge's polyline.
pub(crate) const FEWEST_CHORDS: usize = 8;
/// A chord is halved at most this often.
pub(crate) const MOST_HALVINGS: usize = 8;
/// Curvature differences below this are noise whatever the file says, 1/mm (a radius of 100 m).
pub(crate) const CURVATURE_FLOOR_PER_MM: f64 = 1e-5;
