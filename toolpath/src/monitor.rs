//! Whoever waits for a long computation: what it is told, and how it ends the waiting.

use std::fmt;

use thiserror::Error;

/// A part of a long computation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Stage {
    /// Planning: what each setup reaches.
    Setups,
    /// Planning: meshes of the regions that are swept.
    RegionMeshes,
    /// Planning: the passes of all parts.
    Paths,
    /// Verifying: reading the job folder.
    Reading,
    /// Verifying: closest points and meshes of the model.
    PreparingModel,
    /// Verifying: the ball along the paths.
    GougeAndContact,
    /// Verifying: rapids above the model.
    Rapids,
    /// Verifying: distances from obstacles.
    Obstacles,
    /// Verifying: where the tool is to be kept.
    Bounds,
    /// Verifying: what of the tool is above its end.
    Shank,
    /// Verifying: what holds the tool.
    Holder,
    /// Verifying: what is left between passes.
    ScallopCrests,
    /// Verifying: what is left on the faces.
    Coverage,
    /// Verifying: the stock, move by move.
    Stock,
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Stage::Setups => "setups",
            Stage::RegionMeshes => "region meshes",
            Stage::Paths => "paths",
            Stage::Reading => "reading",
            Stage::PreparingModel => "preparing the model",
            Stage::GougeAndContact => "gouge and contact",
            Stage::Rapids => "rapids",
            Stage::Obstacles => "obstacles",
            Stage::Bounds => "bounds",
            Stage::Shank => "shank",
            Stage::Holder => "holder",
            Stage::ScallopCrests => "scallop crests",
            Stage::Coverage => "coverage",
            Stage::Stock => "stock",
        })
    }
}

/// Whoever waits for a long computation. All functions are called from several threads.
///
/// A function `|stage: Stage, share: f64|` is a monitor that never cancels, and `()` one that says nothing either.
///
/// ```
/// use claymill_toolpath::{Cancelled, Monitor, Stage};
/// use std::sync::atomic::{AtomicBool, Ordering};
///
/// struct Patience(AtomicBool);
///
/// impl Monitor for Patience {
///     fn at(&self, stage: Stage, share: f64) {
///         println!("{stage}: {:.0} %", 100.0 * share);
///     }
///     fn is_cancelled(&self) -> bool {
///         self.0.load(Ordering::Relaxed)
///     }
/// }
///
/// let ended = Patience(AtomicBool::new(true));
/// assert_eq!(ended.go_on(), Err(Cancelled));
/// assert_eq!(().go_on(), Ok(()));
/// ```
pub trait Monitor: Sync {
    /// A stage has come to this share of its work, from 0 to 1.
    fn at(&self, stage: Stage, share: f64);

    /// Whether the computation is to end without a result. It is asked between pieces of work, of which some take seconds.
    fn is_cancelled(&self) -> bool {
        false
    }

    /// Nothing, unless the computation is to end.
    ///
    /// # Errors
    /// It is.
    fn go_on(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }
}

impl<F: Fn(Stage, f64) + Sync> Monitor for F {
    fn at(&self, stage: Stage, share: f64) {
        self(stage, share);
    }
}

/// Nobody: nothing is said, and nothing is cancelled.
impl Monitor for () {
    fn at(&self, _: Stage, _: f64) {}
}

/// A computation ended without a result because its [`Monitor`] wanted it to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("cancelled")]
pub struct Cancelled;
