//! The heights of levels: step-downs, flats at their exact height, and levels between for slopes.
//!
//! ```text
//!     top ──────────────      Every flat where the tool can stand gets a level, so that nothing is left on it. Between flats,
//!          step-down          levels are as deep as allowed, and evenly so. Where stairs would leave more than a band over a
//!     ────────╮               slope, thinner steps follow, from the lowest up.
//!             ╰──── flat
//! ```

use claymill_nurbs::Model;
use claymill_toolpath::Monitor;

use claymill_contact::Frame;

use crate::error::{ClearingError, within};
use crate::planar_set::PlanarSet;
use crate::reach::Reach;

/// Control points of a flat face lie within this height, mm.
const FLAT_MM: f64 = 1e-5;
/// Flats that differ by less are one, mm.
const SAME_MM: f64 = 1e-3;
/// Regions just above and below a flat are this far from it, mm.
const BESIDE_MM: f64 = 2e-3;
/// Floors that the centre reaches over less width are no flats, in radii of the tool.
const NARROWEST_RADII: f64 = 0.05;
/// Levels of a setup at most.
pub const MOST_LEVELS: usize = 2_000;

/// How deep a tool may cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Depths {
    /// Where the stock ends above, mm.
    pub top_mm: f64,
    /// The lowest level, mm.
    pub bottom_mm: f64,
    /// Largest depth of a level, mm.
    pub step_mm: f64,
    /// Length of the flutes, mm.
    pub flutes_mm: f64,
}

impl Depths {
    fn checked(&self) -> Result<(), ClearingError> {
        let top = within("top of the stock, mm,", self.top_mm, -1e5, 1e5)?;
        within("lowest level, mm,", self.bottom_mm, -1e5, top)?;
        within("step down, mm,", self.step_mm, 1e-2, 1e3)?;
        if self.step_mm > self.flutes_mm {
            return Err(ClearingError::StepBelowFlutes { step_mm: self.step_mm, flutes_mm: self.flutes_mm });
        }
        let count = (self.top_mm - self.bottom_mm) / self.step_mm;
        within("number of levels", count, 0.0, MOST_LEVELS as f64)?;
        Ok(())
    }

    /// Levels from the top down: every flat, and as few as allowed between.
    ///
    /// # Errors
    /// A number is no size, or a step is deeper than the flutes.
    pub fn levels_mm(&self, flats_mm: &[f64]) -> Result<Vec<f64>, ClearingError> {
        self.checked()?;
        let mut ends: Vec<f64> = flats_mm
            .iter()
            .copied()
            .filter(|z| *z < self.top_mm - SAME_MM && *z > self.bottom_mm + SAME_MM)
            .chain([self.bottom_mm])
            .collect();
        ends.sort_unstable_by(|a, b| b.total_cmp(a));
        ends.dedup_by(|a, b| (*a - *b).abs() < SAME_MM);
        let (mut levels, mut above) = (Vec::new(), self.top_mm);
        for end in ends {
            let count = ((above - end) / self.step_mm - 1e-9).ceil().max(1.0);
            levels.extend((1..=count as usize).map(|k| above + (end - above) * k as f64 / count));
            above = end;
        }
        Ok(levels)
    }
}

/// Heights of all flat faces that look up, with the allowance, the highest first.
#[must_use]
pub fn flats_mm(model: &Model, frame: &Frame, allowance_mm: f64) -> Vec<f64> {
    let mut found: Vec<f64> = model
        .faces
        .iter()
        .filter_map(|face| {
            let (columns, rows) = face.surface.size();
            let all = (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j)));
            let heights = all.map(|(i, j)| frame.to_setup(&face.surface.control_point(i, j)).z);
            let (low, high) =
                heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
            (high - low <= FLAT_MM).then_some(low + allowance_mm)
        })
        .collect();
    found.sort_unstable_by(|a, b| b.total_cmp(a));
    found.dedup_by(|a, b| (*a - *b).abs() < SAME_MM);
    found
}

/// Those of the flats on which the tool can stand somewhere: what its centre reaches just above and not just below is as wide as
/// a cut. A step at the edge of a part is narrower than the tool, which stands out over it.
///
/// # Errors
/// As [`Reach::region`].
pub fn standing_flats_mm(
    reach: &Reach<'_>,
    flats_mm: &[f64],
    radius_mm: f64,
    monitor: &dyn Monitor,
) -> Result<Vec<f64>, ClearingError> {
    let mut standing = Vec::new();
    let beside: Vec<f64> = flats_mm.iter().flat_map(|z| [z + BESIDE_MM, z - BESIDE_MM]).collect();
    let regions = reach.regions(&beside, monitor)?;
    for (&z, regions) in flats_mm.iter().zip(regions.chunks(2)) {
        let jump = regions[0].minus(&regions[regions.len() - 1]);
        if !jump.eroded(0.5 * NARROWEST_RADII * radius_mm).is_empty() {
            standing.push(z);
        }
    }
    Ok(standing)
}

/// Heights between two levels, the lowest first, at which stairs on slopes are no thicker than a band.
#[must_use]
pub fn between_mm(low_mm: f64, high_mm: f64, band_mm: f64) -> Vec<f64> {
    let count = ((high_mm - low_mm) / band_mm - 1e-9).ceil().clamp(1.0, 100.0) as usize;
    (1..count).map(|k| low_mm + (high_mm - low_mm) * k as f64 / count as f64).collect()
}

/// What is left of a stock by a tool with a straight flank that goes down to levels: the sum of slices, each as the stock less what
/// is reached in it, mm³. `regions` are of the levels from the top down.
#[must_use]
pub fn left_mm3(stock: &PlanarSet, top_mm: f64, levels: &[(f64, PlanarSet)], radius_mm: f64) -> f64 {
    let mut above = top_mm;
    let mut left = 0.0;
    for (z, region) in levels {
        left += (above - z) * stock.minus(&region.dilated(radius_mm)).area_mm2();
        above = *z;
    }
    left
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn flats_get_their_level_and_steps_are_even() -> Result<(), ClearingError> {
        let depths = Depths { top_mm: 55.0, bottom_mm: 0.0, step_mm: 10.0, flutes_mm: 20.0 };
        let levels = depths.levels_mm(&[50.5, 20.5, 20.5, 60.0, -4.0])?;
        let wanted = [50.5, 40.5, 30.5, 20.5, 20.5 - 20.5 / 3.0, 20.5 / 3.0, 0.0];
        assert_eq!(levels.len(), wanted.len());
        assert!(levels.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-9), "{levels:?}");
        Ok(())
    }

    #[test]
    fn steps_deeper_than_the_flutes_are_named() {
        let depths = Depths { top_mm: 55.0, bottom_mm: 0.0, step_mm: 30.0, flutes_mm: 20.0 };
        assert!(matches!(depths.levels_mm(&[]), Err(ClearingError::StepBelowFlutes { .. })));
        let depths = Depths { step_mm: f64::NAN, ..depths };
        assert!(matches!(depths.levels_mm(&[]), Err(ClearingError::Number { .. })));
    }

    #[test]
    fn what_levels_leave_over_a_pyramid() {
        // Steps of 10 mm with sides of 90 … 10 mm under a block of 100 × 100 × 55; allowance 0.5 mm at sides and floors.
        let stock = PlanarSet::rectangle([-50.0, -50.0, 50.0, 50.0]);
        let radius_mm = 5.0;
        let around = PlanarSet::rectangle([-60.0, -60.0, 60.0, 60.0]);
        // The allowance rounds the corners.
        let part = |half: f64| PlanarSet::rectangle([-half, -half, half, half]).dilated(0.5);
        let mut levels = vec![(50.5, around.clone())];
        for k in 0..4 {
            let region = around.minus(&part(10.0 * k as f64 + 5.0).dilated(radius_mm));
            levels.push((40.5 - 10.0 * k as f64, region));
        }
        let steps_mm3: f64 = (0..5).map(|k| 10.0 * (10.0 + 20.0 * f64::from(k)).powi(2)).sum();
        levels.push((0.0, around.minus(&part(45.0).dilated(radius_mm))));
        let left = left_mm3(&stock, 55.0, &levels, radius_mm) - steps_mm3;
        // Rounded corners are inscribed polygons: a micrometre less along arcs of half a millimetre.
        let chords_mm3 = PI * 50.5 * crate::planar_set::CHORD_MM;
        assert!((left - 9_179.662_607_252).abs() < chords_mm3, "{left}");
    }
}
