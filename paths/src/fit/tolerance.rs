//! How closely passes are fitted.

use claymill_toolpath::WRITTEN_STEP_MM;

/// Largest and smallest tolerance, mm.
const FIT_MM: (f64, f64) = (4e-4, 1.8e-3);
/// Crests rise with the pass beside them: by this share of the scallop height at most, which leaves them below 1.05
/// times the height asked for.
const SHARE_OF_SCALLOP: f64 = 0.045;
/// The bias in tolerances: what is written lies above the exact locations in any case.
const BIAS: f64 = 10.0 / 9.0;

/// How far written passes may lie from the exact locations: between [`Self::bias_mm`] less and more [`Self::fit_mm`]
/// above them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitTolerance {
    /// Passes are fitted this far above the exact locations, so that the fit cannot gouge, mm.
    pub bias_mm: f64,
    /// Largest distance of the written curve from the biased path, mm.
    pub fit_mm: f64,
}

impl FitTolerance {
    /// For passes that leave this scallop height, mm: 2.0 ± 1.8 µm from 0.04 mm on, proportionally less below.
    #[must_use]
    pub fn of_scallop(scallop_mm: f64) -> Self {
        let fit_mm = (SHARE_OF_SCALLOP * scallop_mm).clamp(FIT_MM.0, FIT_MM.1);
        FitTolerance { bias_mm: BIAS * fit_mm, fit_mm }
    }

    /// The fit aims this low, to leave room for rounding to the written digits, mm.
    pub(crate) fn aim_mm(&self) -> f64 {
        self.fit_mm - 2.0 * WRITTEN_STEP_MM
    }

    /// The scallop height for which passes are laid, mm: what is written runs above the exact passes, and so do the
    /// crests between.
    #[must_use]
    pub fn to_lay_mm(&self, scallop_mm: f64) -> f64 {
        (scallop_mm - self.bias_mm).max(0.5 * scallop_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crests_stay_below_what_is_judged() {
        for scallop_mm in [0.01, 0.02, 0.05, 0.1, 1.0] {
            let FitTolerance { bias_mm, fit_mm } = FitTolerance::of_scallop(scallop_mm);
            assert!(bias_mm > fit_mm && bias_mm + fit_mm <= 3.8e-3 + 1e-12);
            let highest_mm = FitTolerance::of_scallop(scallop_mm).to_lay_mm(scallop_mm) + bias_mm + fit_mm;
            assert!(highest_mm <= 1.05 * scallop_mm, "{scallop_mm}: {highest_mm}");
        }
    }
}
