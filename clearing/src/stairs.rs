//! Levels of slabs from the top down, each followed by thinner ones from the bottom up where stairs would be too thick.
//!
//! ```text
//!   above ────╮                 A stair of height H and width w is as thick, along the normal of the slope that it stands on, as
//!             │ H                              H w / √(H² + w²):
//!             ╰──── z                          where that is more than the band, a level comes between.
//!               w
//! ```

use std::sync::atomic::{AtomicUsize, Ordering};

use claymill_toolpath::{Monitor, Stage, Tool};
use rayon::prelude::*;

use crate::error::ClearingError;
use crate::levels::between_mm;
use crate::planar_set::PlanarSet;
use crate::reach::Reach;
use crate::rounds::{STRAIGHTEST, TEETH_MM};

/// A level before it is cleared.
pub(crate) struct Level {
    /// Its height, mm.
    pub(crate) z: f64,
    /// All above this was cut before, mm.
    pub(crate) above: f64,
    /// Radius of the disc with which the tool cuts all of it, mm.
    pub(crate) disc_mm: f64,
    pub(crate) feasible: PlanarSet,
    pub(crate) stock: PlanarSet,
    /// What else there was, and levels below count as having cut as wide as the tool is.
    pub(crate) taken: PlanarSet,
    /// Where the centre meets what they left of it: known once they are cleared.
    pub(crate) ridges: PlanarSet,
    /// Whether it comes between others, and is cut after the one below it.
    pub(crate) is_stair: bool,
}

impl Level {
    /// What of a cut is surely there, and what may not be: stock is said to be no smaller than it is, so that beside walls that were
    /// cut before some is there that is thin. What lies deeper in the stock is there however thin it is.
    pub(crate) fn told_apart(&self, cut: PlanarSet, thin_mm: f64) -> [PlanarSet; 2] {
        if thin_mm <= 0.0 {
            return [cut, PlanarSet::default()];
        }
        let opened = |set: &PlanarSet, mm: f64| set.eroded(0.5 * mm).dilated(0.5 * mm);
        let deep = self.stock.union(&self.taken).eroded(thin_mm).intersection(&cut);
        let sure = opened(&cut, thin_mm).union(&opened(&deep, TEETH_MM));
        let doubtful = opened(&cut.minus(&sure), TEETH_MM);
        [sure, doubtful]
    }

    /// Keeps the centre out of a set; returns what is not cut for that. Levels above count as standing where all of it was.
    pub(crate) fn stay_out(&mut self, of: &PlanarSet) -> PlanarSet {
        let lost = self.feasible.intersection(of);
        if lost.is_empty() {
            return lost;
        }
        self.feasible = self.feasible.minus(of);
        let cut = self.feasible.dilated(self.disc_mm);
        lost.dilated(self.disc_mm).intersection(&self.stock).minus(&cut)
    }
}

/// What levels are made from.
pub(crate) struct Slabs<'a> {
    pub(crate) reach: &'a Reach<'a>,
    /// Where stock is between two heights.
    pub(crate) stock: &'a (dyn Fn([f64; 2]) -> PlanarSet + Sync),
    pub(crate) tool: &'a Tool,
    pub(crate) band_mm: Option<f64>,
    /// Where the tool's axis stays, if it may not be anywhere.
    pub(crate) within: Option<PlanarSet>,
}

impl Slabs<'_> {
    /// All levels in the order of cutting.
    pub(crate) fn levels(
        &self,
        heights: &[f64],
        top_mm: f64,
        monitor: &dyn Monitor,
    ) -> Result<Vec<Level>, ClearingError> {
        monitor.at(Stage::Setups, 0.0);
        let all: Vec<f64> = std::iter::once(top_mm).chain(heights.iter().copied()).collect();
        let regions = self.reach.regions(&all, monitor)?.into_iter().map(|region| self.kept(region));
        let regions: Vec<PlanarSet> = regions.collect();
        let done = AtomicUsize::new(0);
        let slab = |k: usize| {
            let slab = self.slab([(all[k + 1], &regions[k + 1]), (all[k], &regions[k])], monitor)?;
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            monitor.at(Stage::Setups, done as f64 / heights.len() as f64);
            Ok(slab)
        };
        let levels: Vec<Vec<Level>> =
            (0..heights.len()).into_par_iter().map(slab).collect::<Result<_, ClearingError>>()?;
        Ok(levels.into_iter().flatten().collect())
    }

    fn kept(&self, region: PlanarSet) -> PlanarSet {
        match &self.within {
            Some(within) => region.intersection(within),
            None => region,
        }
    }

    /// The level at the bottom of a slab, and those between.
    fn slab(
        &self,
        [(z, feasible), (above, upper)]: [(f64, &PlanarSet); 2],
        monitor: &dyn Monitor,
    ) -> Result<Vec<Level>, ClearingError> {
        // Where the tool comes from outside, its circles need room there.
        let air = self.reach.air(2.0 * STRAIGHTEST * self.tool.radius_mm());
        let level = |z: f64, feasible: &PlanarSet, [stock, taken]: [PlanarSet; 2], is_stair: bool| Level {
            z,
            above,
            disc_mm: disc_mm(self.tool, above - z),
            feasible: self.kept(feasible.union(&air)),
            stock,
            taken,
            ridges: PlanarSet::default(),
            is_stair,
        };
        let disc_of = |z: f64| disc_mm(self.tool, above - z);
        let mut floor = feasible.dilated(disc_of(z));
        let stock = (self.stock)([z, above]);
        let mut levels = vec![level(z, feasible, [stock.clone(), PlanarSet::default()], false)];
        let Some(band_mm) = self.band_mm else { return Ok(levels) };
        let (mut lowest, mut before): (f64, Option<(f64, PlanarSet)>) = (z, None);
        // All stairs between are narrower and lower than one from the floor up to what was cut before.
        let all = upper.dilated(self.tool.radius_mm()).intersection(&stock).minus(&floor);
        if !is_too_thick(&all, above - z, band_mm) {
            return Ok(levels);
        }
        for next in between_mm(z, above, band_mm).into_iter().chain([above]) {
            monitor.go_on()?;
            let inner = before.as_ref().map_or(feasible, |(_, region)| region);
            let region = match next == above {
                true => upper.clone(),
                false => self.reach.region_between(next, [inner, upper], monitor)?,
            };
            let stairs = region.dilated(self.tool.radius_mm()).intersection(&stock).minus(&floor);
            if is_too_thick(&stairs, next - lowest, band_mm)
                && let Some((middle, feasible)) = before.take()
            {
                let stock = (self.stock)([middle, above]);
                let stock = [stock.minus(&floor), stock.intersection(&floor)];
                floor = floor.union(&feasible.dilated(disc_of(middle)));
                levels.push(level(middle, &feasible, stock, true));
                lowest = middle;
            }
            before = Some((next, region));
        }
        Ok(levels)
    }
}

/// The disc with which a tool cuts a level of a depth: one that is lower than the corner is high is cut by a narrower one.
pub(crate) fn disc_mm(tool: &Tool, depth_mm: f64) -> f64 {
    let (radius_mm, corner_mm) = (tool.radius_mm(), tool.corner_radius_mm());
    let deep_mm = depth_mm.min(corner_mm);
    let narrow_mm = corner_mm - (corner_mm * corner_mm - (corner_mm - deep_mm).powi(2)).max(0.0).sqrt();
    radius_mm - narrow_mm
}

/// Whether stairs of a height are thicker than a band somewhere.
fn is_too_thick(stairs: &PlanarSet, high_mm: f64, band_mm: f64) -> bool {
    if high_mm <= band_mm * (1.0 + 1e-9) {
        return false;
    }
    let widest_mm = band_mm * high_mm / (high_mm * high_mm - band_mm * band_mm).sqrt();
    !stairs.eroded(0.5 * widest_mm).is_empty()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Levels above count as standing on what a level would cut with all of its rooms.
    #[test]
    fn what_a_level_stays_out_of_is_left() {
        let room = |x: f64| PlanarSet::rectangle([x, 0.0, x + 2.0, 2.0]);
        let mut level = Level {
            z: 0.0,
            above: 5.0,
            disc_mm: 3.0,
            feasible: room(0.0).union(&room(6.0)),
            stock: PlanarSet::rectangle([-20.0, -20.0, 20.0, 20.0]),
            taken: PlanarSet::default(),
            ridges: PlanarSet::default(),
            is_stair: true,
        };
        let whole = level.feasible.dilated(level.disc_mm);
        assert!(level.stay_out(&room(-9.0)).is_empty());
        let left = level.stay_out(&room(6.0).dilated(1.0));
        assert_eq!(level.feasible, room(0.0));
        let cut = level.feasible.dilated(level.disc_mm);
        assert!((left.area_mm2() + cut.area_mm2() - whole.area_mm2()).abs() < 1e-3);
        assert!(left.intersection(&cut).area_mm2() < 1e-3);
    }

    /// A sliver at the border of the stock may be none; one that other levels left in its middle is there.
    #[test]
    fn thin_stock_is_doubted_only_at_its_border() {
        let level = Level {
            z: 0.0,
            above: 5.0,
            disc_mm: 3.0,
            feasible: PlanarSet::default(),
            stock: PlanarSet::rectangle([-20.0, -20.0, 20.0, 20.0]),
            taken: PlanarSet::default(),
            ridges: PlanarSet::default(),
            is_stair: true,
        };
        let bar = |y: f64, wide: f64| PlanarSet::rectangle([-20.0, y, 20.0, y + wide]);
        let cut = bar(19.8, 0.2).union(&bar(5.0, 0.2)).union(&bar(-15.0, 3.0));
        let [sure, doubtful] = level.told_apart(cut.clone(), 0.7);
        let of = |set: &PlanarSet, y: f64, wide: f64| set.intersection(&bar(y, wide)).area_mm2();
        assert!(of(&doubtful, 19.8, 0.2) > 7.9 && of(&sure, 19.8, 0.2) < 0.1);
        assert!(of(&sure, 5.0, 0.2) > 7.6 && of(&sure, -15.0, 3.0) > 119.0);
        assert_eq!(level.told_apart(cut.clone(), 0.0), [cut, PlanarSet::default()]);
    }
}
