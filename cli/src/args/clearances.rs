//! How far the tool keeps away from what it is not to touch.

use claymill_toolpath::CHECK_CLEARANCE_MM;

use super::JobOptions;
use crate::failure::Failure;

impl JobOptions {
    /// Distance that the ball keeps from obstacles, mm.
    pub(crate) fn check_clearance_mm(&self) -> Result<f64, Failure> {
        if self.check_clearance.is_some() && self.check.is_empty() {
            return Err(Failure::usage(
                "--check-clearance is for what --check names",
                "For example: --check fixture.stl --check-clearance 2.",
            ));
        }
        Ok(self.check_clearance.unwrap_or(CHECK_CLEARANCE_MM))
    }
}

/// A distance from obstacles that can be kept.
pub(crate) fn check_clearance(asked_mm: Option<f64>) -> Result<Option<f64>, Failure> {
    asked_mm.map_or(Ok(()), claymill::check_obstacle_clearance)?;
    Ok(asked_mm)
}
