//! How far the tool keeps away from what it is not to touch.

use claymill_paths::CLEARANCE_MM;
use claymill_toolpath::CHECK_CLEARANCE_MM;

use super::JobOptions;
use crate::failure::Failure;

/// No more than this is kept from obstacles or by rapids, mm.
const LARGEST_MM: f64 = 1000.0;
/// Rapids keep at least this: their heights are known to some tenths, mm.
const LEAST_RAPID_MM: f64 = 0.5;

impl JobOptions {
    /// Distance that the ball keeps from obstacles, mm.
    pub(crate) fn check_clearance_mm(&self) -> Result<f64, Failure> {
        if self.check_clearance.is_some() && self.check.is_empty() {
            return Err(Failure::usage(
                "--check-clearance is for what --check names",
                "For example: --check fixture.stl --check-clearance 2.",
            ));
        }
        Ok(check_clearance(self.check_clearance)?.unwrap_or(CHECK_CLEARANCE_MM))
    }

    /// Distance that rapids keep from the finished model along the tool axis, mm.
    pub(crate) fn rapid_clearance_mm(&self) -> Result<f64, Failure> {
        let mm = self.rapid_clearance.unwrap_or(CLEARANCE_MM);
        if !(LEAST_RAPID_MM..=LARGEST_MM).contains(&mm) {
            return Err(Failure::usage(
                format!("rapids cannot keep {mm} mm: it is between {LEAST_RAPID_MM} and {LARGEST_MM}"),
                "For example: --rapid-clearance 10.",
            ));
        }
        Ok(mm)
    }
}

/// A distance from obstacles that can be kept.
pub(crate) fn check_clearance(asked_mm: Option<f64>) -> Result<Option<f64>, Failure> {
    match asked_mm {
        Some(mm) if !(0.0..=LARGEST_MM).contains(&mm) => Err(Failure::usage(
            format!("the ball cannot keep {mm} mm from obstacles: it is between 0 and {LARGEST_MM}"),
            "For example: --check-clearance 2.",
        )),
        asked => Ok(asked),
    }
}
