//! Patterns of passes: functions on faces by their level curves. They say where passes run, and nothing of what is safe.

use claymill_nurbs::FaceId;

/// Gaps in what a setup claims of a line are crossed when they are no longer than this, mm.
pub(crate) const BRIDGE_MM: f64 = 30.0;
/// Lines of constant height run at most this share of the flat step-over beside their places on the mesh.
pub(crate) const ASIDE: f64 = 0.5;

/// A place on a level curve.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spot {
    pub(crate) face: FaceId,
    pub(crate) u: f64,
    pub(crate) v: f64,
    /// How far the curves lie apart here for a unit of level, mm on the surface.
    pub(crate) per_level_mm: f64,
}

/// A function on faces, by its level curves.
pub(crate) trait Levels: Sync {
    /// Lowest and highest level.
    fn range(&self) -> (f64, f64);
    /// Whether a unit of level is a step-over.
    fn in_steps(&self) -> bool {
        false
    }
    /// How many levels there are, where that does not depend on what they leave.
    fn count(&self) -> Option<usize> {
        None
    }
    /// The curves at a level, each as places that follow each other closely.
    fn whole_lines(&self, level: f64) -> Vec<Vec<Spot>>;
    /// The same, but for what is far from anything that the setup cuts.
    fn lines(&self, level: f64) -> Vec<Vec<Spot>> {
        self.whole_lines(level)
    }
    /// The height that the ball's centre keeps along the curves at a level, if it does.
    fn height_mm(&self, _level: f64) -> Option<f64> {
        None
    }
}
