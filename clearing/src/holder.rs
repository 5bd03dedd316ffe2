//! Where shank and holder keep a tool out of levels: what the levels above leave stands beside them.
//!
//! ```text
//!    │ holder │▒▒▒▒      At the height of its lower end, and above, a section keeps its radius and a distance away from all that
//!    └──┐  ┌──┘▒▒▒▒      stands. That is the stock less what the levels of the slab have cut, each as wide as the tool is so far
//!       │  │  ▒▒▒▒▒      above its tip. What is not cut for that stands beside the levels below.
//!       ╰──╯ ▒▒▒▒▒▒
//! ```
//!
//! Levels are nested, the lower the smaller. So the stock about the lower end of a section is all that it can meet.

use claymill_toolpath::{Cancelled, Holder, Monitor, Tool};

use crate::planar_set::PlanarSet;
use crate::stairs::{Level, disc_mm};

/// Cones count as cylinders whose radii differ by no more than this, mm.
const STEP_MM: f64 = 2.0;
/// No more of them stand for a cone.
const MOST_STEPS: f64 = 16.0;

/// A cylinder above the end of a tool, without end upwards.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Section {
    /// Its lower end above the tip, mm.
    height_mm: f64,
    radius_mm: f64,
}

/// What of a tool is above its flutes and wider than they are, as cylinders that keep a distance.
#[derive(Debug)]
pub(crate) struct HolderBody<'t> {
    tool: &'t Tool,
    sections: Vec<Section>,
}

/// Where levels are not cut for a holder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeptOut {
    /// Area of the levels that is not cut, in the sum over all of them, mm².
    pub area_mm2: f64,
    /// Height of the highest of these levels in the setup, mm.
    pub below_mm: f64,
    /// How deep the lowest of them is in the stock, mm: a tool that sticks out farther reaches all of them.
    pub deep_mm: f64,
}

impl<'t> HolderBody<'t> {
    /// Shank and holder; the holder keeps a distance, mm.
    pub(crate) fn of(tool: &'t Tool, holder: Option<(&Holder, f64)>) -> Self {
        let up_to_mm = holder.map_or(f64::INFINITY, |(holder, _)| holder.stick_out_mm);
        let shank = tool.sides().into_iter().skip(1).filter(|[low, _]| low[0] < up_to_mm);
        let shank = shank.map(|frustum| (frustum, 0.0));
        let held = holder.into_iter().flat_map(|(holder, mm)| holder.profile().map(move |f| (f, mm)));
        let mut sections: Vec<Section> = Vec::new();
        for ([[low_mm, low_radius_mm], [high_mm, high_radius_mm]], kept_mm) in shank.chain(held) {
            let grown_mm = (high_radius_mm - low_radius_mm).max(0.0);
            let steps = (grown_mm / STEP_MM).ceil().clamp(1.0, MOST_STEPS);
            for k in 0..steps as usize {
                let share = |k: usize| k as f64 / steps;
                // A shank without end has one step.
                let height_mm = if k == 0 { low_mm } else { low_mm + (high_mm - low_mm) * share(k) };
                let radius_mm = low_radius_mm + grown_mm * share(k + 1) + kept_mm;
                let height_mm = height_mm - kept_mm;
                // What is no wider than what is below it is in its shadow.
                let widest_mm = sections.last().map_or(tool.radius_mm(), |section| section.radius_mm);
                if radius_mm > widest_mm {
                    sections.push(Section { height_mm, radius_mm });
                }
            }
        }
        HolderBody { tool, sections }
    }

    /// Takes out of levels in machining order what shank and holder are in the way of.
    ///
    /// # Errors
    /// The monitor ends it.
    pub(crate) fn keep_clear(
        &self,
        levels: &mut [Level],
        monitor: &dyn Monitor,
    ) -> Result<Option<KeptOut>, Cancelled> {
        if self.sections.is_empty() {
            return Ok(None);
        }
        let top_mm = levels.iter().map(|level| level.above).fold(f64::NEG_INFINITY, f64::max);
        let mut all: Option<KeptOut> = None;
        let mut slabs: Vec<Slab> = Vec::new();
        let mut first = 0;
        while first < levels.len() {
            let stairs = levels[first + 1..].iter().take_while(|level| level.is_stair).count();
            let (done, rest) = levels.split_at_mut(first);
            let of_slab = &mut rest[..=stairs];
            let mut lost = PlanarSet::default();
            for level in &mut *of_slab {
                monitor.go_on()?;
                // What lower levels of the slab do not cut is there for this one.
                level.taken = level.taken.minus(&lost);
                level.stock = level.stock.union(&lost);
                let in_the_way = self.in_the_way(level.z, done, &slabs);
                let own = level.stay_out(&in_the_way);
                if !lost.is_empty() {
                    lost = lost.minus(&level.feasible.dilated(level.disc_mm));
                }
                if !own.is_empty() {
                    let none = KeptOut { area_mm2: 0.0, below_mm: level.z, deep_mm: 0.0 };
                    let kept_out = all.get_or_insert(none);
                    kept_out.area_mm2 += own.area_mm2();
                    kept_out.deep_mm = kept_out.deep_mm.max(top_mm - level.z);
                    lost = lost.union(&own);
                }
            }
            let floor = &of_slab[0];
            let own = floor.stock.minus(&floor.feasible.dilated(self.tool.radius_mm()));
            let standing = slabs.last().map_or_else(PlanarSet::default, |slab| slab.standing.clone());
            let slab = Slab {
                range: [first, first + stairs + 1],
                above_mm: floor.above,
                standing: standing.union(&own).simplified(),
            };
            slabs.push(slab);
            first += stairs + 1;
        }
        Ok(all)
    }

    /// Where the centre would bring a section to what stands, with the tip at a height.
    fn in_the_way(&self, z: f64, levels: &[Level], slabs: &[Slab]) -> PlanarSet {
        let of_section = |section: &Section| {
            let low_mm = z + section.height_mm;
            let met = slabs.iter().rposition(|slab| slab.above_mm > low_mm)?;
            let above = met.checked_sub(1).map(|k| &slabs[k].standing);
            let [from, to] = slabs[met].range;
            let (floor, stairs) = levels[from..to].split_first()?;
            let mut standing = floor.stock.minus(&self.cut_at(floor, low_mm.max(floor.z))?);
            for stair in stairs {
                match self.cut_at(stair, low_mm) {
                    Some(cut) => standing = standing.minus(&cut),
                    None => break,
                }
            }
            let standing = above.map_or_else(|| standing.clone(), |above| standing.union(above));
            Some(standing.dilated(section.radius_mm))
        };
        let sections = self.sections.iter().filter_map(of_section);
        sections.fold(PlanarSet::default(), |all, section| all.union(&section))
    }

    /// What a level has cut at a height; `None` below it.
    fn cut_at(&self, level: &Level, height_mm: f64) -> Option<PlanarSet> {
        let up_mm = height_mm - level.z;
        (up_mm >= 0.0).then(|| level.feasible.dilated(disc_mm(self.tool, up_mm)))
    }
}

/// Levels that cut what is between two heights.
struct Slab {
    /// The first of its levels, and the first of the next slab.
    range: [usize; 2],
    above_mm: f64,
    /// What stands in it and in those above.
    standing: PlanarSet,
}

#[cfg(test)]
mod tests {
    use super::*;

    const RADIUS_MM: f64 = 5.0;
    const STEP_MM: f64 = 10.0;
    const LEVELS: usize = 6;

    fn square(half_mm: f64) -> PlanarSet {
        PlanarSet::rectangle([-half_mm, -half_mm, half_mm, half_mm])
    }

    /// A pocket of 60 mm in a block of 200 mm, level by level.
    fn pocket() -> Vec<Level> {
        let level = |k: usize| Level {
            z: -STEP_MM * (k + 1) as f64,
            above: -STEP_MM * k as f64,
            disc_mm: RADIUS_MM,
            feasible: square(30.0 - RADIUS_MM),
            stock: square(100.0),
            taken: PlanarSet::default(),
            ridges: PlanarSet::default(),
            is_stair: false,
        };
        (0..LEVELS).map(level).collect()
    }

    /// A holder of 12 mm that keeps 1 mm sticks out 25 mm; from 10 mm above its lower end on it is 18 mm wide.
    #[test]
    fn in_a_pocket_a_holder_keeps_away_from_the_walls() {
        let tool = "flat:5,length:15".parse().unwrap();
        let holder = Holder::parse("25:24-24x10,36-36x50", &tool).unwrap();
        let mut levels = pocket();
        let kept_out =
            HolderBody::of(&tool, Some((&holder, 1.0))).keep_clear(&mut levels, &()).unwrap().unwrap();
        // What the levels above have left of the pocket is as far in as they were kept.
        let halves_mm: Vec<f64> = levels.iter().map(|l| 0.5 * l.feasible.area_mm2().sqrt()).collect();
        let mut expected_mm: Vec<f64> = Vec::new();
        for k in 0..LEVELS {
            let (z, own_mm) = (levels[k].z, 30.0 - RADIUS_MM);
            let kept_mm = [(24.0, 13.0), (34.0, 19.0)].map(|(height_mm, radius_mm)| {
                let met = (0..k).rev().find(|&above| levels[above].above > z + height_mm);
                met.map_or(own_mm, |above| expected_mm[above] + RADIUS_MM - radius_mm)
            });
            expected_mm.push(kept_mm.into_iter().fold(own_mm, f64::min));
        }
        assert!(expected_mm[1] == 25.0 && expected_mm[2] < 25.0 && expected_mm[4] < expected_mm[2]);
        for (found_mm, expected_mm) in halves_mm.iter().zip(&expected_mm) {
            assert!((found_mm - expected_mm).abs() < 0.01, "{halves_mm:?} for {expected_mm:?}");
        }
        assert_eq!((kept_out.below_mm, kept_out.deep_mm), (levels[2].z, 60.0));
        let lost_mm2: f64 = expected_mm.iter().map(|mm| 3600.0 - 4.0 * (mm + RADIUS_MM).powi(2)).sum();
        assert!((kept_out.area_mm2 / lost_mm2 - 1.0).abs() < 0.02, "{kept_out:?} for {lost_mm2}");
    }

    #[test]
    fn a_holder_above_the_stock_changes_nothing() {
        let tool = "flat:5,length:15".parse().unwrap();
        let holder = Holder::parse("62:24-60x50", &tool).unwrap();
        let mut levels = pocket();
        assert_eq!(HolderBody::of(&tool, Some((&holder, 1.0))).keep_clear(&mut levels, &()).unwrap(), None);
        assert!(levels.iter().zip(pocket()).all(|(a, b)| a.feasible == b.feasible && a.stock == b.stock));
        assert_eq!(HolderBody::of(&tool, None).keep_clear(&mut levels, &()).unwrap(), None);
    }
}
