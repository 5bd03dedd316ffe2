//! An operation that roughs its stock by levels: setup after setup, each on what those before it left.
//!
//! ```text
//!   stock ── setup 1 ──► less ── setup 2 ──► less …      a block is known exactly before its first cut; after that stock is what
//!                                                        the rays of the in-process stock say, a pitch wider
//! ```

use std::collections::{BTreeMap, BTreeSet};

use claymill_clearing::{
    ClearingError, Entry, FARTHEST_MM, LevelFeeds, LevelOptions, LevelPlan, PlanarSet, TEETH_MM, Workpiece,
    plan_levels,
};
use claymill_nurbs::{Aabb, Vector3};
use claymill_paths::{Covered, Frame, Plan, PlanError, times_s};
use claymill_stock::{Slice, Stock as InProcess};
use claymill_toolpath::{
    Area, Bounds, FaceAccount, FreeSide, Levels, Monitor, MoveKind, Program, Setup, Stock, Totals,
    UncutReason,
};

use crate::error::Error;
use crate::in_process::InProcessStock;
use crate::job_error::JobError;
use crate::planned::Planned;
use crate::prepared::Prepared;

/// Less than this that is not cut for a holder is not told, mm².
const LEAST_KEPT_OUT_MM2: f64 = 1.0;
/// Slope of a helix into a pocket, degrees: what end mills for metal are made for.
const RAMP_DEG: f64 = 3.0;
/// Between rays across, material may reach this much farther than its outline, in their pitches.
const WIDER: f64 = 0.15;
/// The same of cells, where the tool is not along an axis.
const WIDER_CELLS: f64 = 1.0;
/// What is no thicker than this is what the outline was made wider by, in pitches.
const THIN: f64 = 0.35;
/// And so much more, in what levels leave on walls.
const TEETH: f64 = 2.0;
/// Stock that stands no higher than this above the foot of a level is none: what was cut to that height before is known to
/// rounding, mm. On a slope that begins there it would be more than [`WIDER`] makes up for.
const SKIN_MM: f64 = 0.005;
/// The same of stock from a file, where edges of floors may be rounded, mm.
const SKIN_OF_FILES_MM: f64 = 0.05;
/// Nor is what stands no higher than this share of the height of the level.
const SKIN: f64 = 0.1;
/// Sheets with more open border than this have no inside, mm.
const OPEN_MM: f64 = 1.0;
/// A side of a box is along an axis of the setup if no more of it is along another (1 − cosine).
const SAME_AXIS: f64 = 1e-9;

impl<'m> Prepared<'m> {
    /// Plans levels in a stock, of which nothing was cut yet if it is `fresh`.
    ///
    /// # Errors
    /// What is asked for cannot be done by levels, a face cannot be covered, the tool fits nowhere, or the monitor ends it.
    pub(crate) fn plan_by_levels(
        self,
        levels: Levels,
        (record, state): (&Stock, &InProcessStock),
        fresh: bool,
        monitor: &dyn Monitor,
    ) -> Result<Planned<'m>, Error> {
        let options = &self.options;
        let area_mm2: f64 = self.file.face_area_mm2.iter().sum();
        let covered = Covered::new(self.file.model(), &self.excluded, area_mm2, options.tool.radius_mm());
        let covered = covered.map_err(|(face, source)| {
            let entity = self.file.model().faces[face].source.entity.clone();
            PlanError::Face { face, entity, source }
        })?;
        let frames = options.frames()?;
        let is_open = self.merged.record.sheets.iter().any(|sheet| sheet.open_mm > OPEN_MM);
        let mut rough =
            Rough { prepared: &self, covered: &covered, levels, state: state.clone(), notes: Vec::new() };
        let (mut program, mut seconds, mut setups) = (Program::default(), Vec::new(), Vec::new());
        let mut nothing: Option<ClearingError> = None;
        for (k, frame) in frames.iter().enumerate() {
            if k > 0 && is_open {
                rough.notes.push(format!(
                    "no levels from {}: the faces are open, and what is behind them is not known",
                    frame.name
                ));
                continue;
            }
            let is_whole = fresh && program.moves.is_empty() && !frame.is_tilted();
            let plan = match rough.setup(frame, record, is_whole, monitor) {
                Ok(plan) => plan,
                Err(Error::Clearing(error @ ClearingError::NoRoom { .. })) => {
                    nothing.get_or_insert(error);
                    continue;
                }
                Err(error) => return Err(error),
            };
            let times = times_s(&plan.moves, &options.machine);
            setups.push(Setup {
                name: frame.name.to_string(),
                axis: frame.axis().into(),
                quaternion: frame.quaternion(),
                clearance_mm: plan.clearance_mm,
                area_mm2: 0.0,
                time_s: times.iter().sum(),
            });
            seconds.extend(times);
            let own = Program { moves: plan.moves };
            if k + 1 < frames.len() {
                rough.state.cut(&own, self.job.tool(), monitor)?;
            }
            program.moves.extend(own.moves);
        }
        if let Some(error) = nothing.filter(|_| program.moves.is_empty()) {
            return Err(error.into());
        }
        for (seq, m) in program.moves.iter_mut().enumerate() {
            m.seq = seq as u64;
        }
        let notes = std::mem::take(&mut rough.notes);
        let totals = totals(&program, &seconds);
        let faces = self.accounts();
        let plan = Plan {
            seconds,
            setups,
            regions: Vec::new(),
            totals,
            area: sum(&faces),
            faces,
            region_setup_area_mm2: Vec::new(),
            tolerances: BTreeMap::new(),
            left_out: covered.left_out.clone(),
            struck_passes: 0,
            notes,
            program,
        };
        drop(covered);
        Ok(Planned::new(self, plan))
    }

    /// Levels cut no face; what they leave over it is measured as stock.
    fn accounts(&self) -> Vec<FaceAccount> {
        let model = self.file.model();
        let account = |(face, of): (usize, &claymill_nurbs::Face)| {
            let total_mm2 = self.file.face_area_mm2[face];
            let reason = if self.excluded[face] { UncutReason::Excluded } else { UncutReason::Roughed };
            FaceAccount {
                face,
                entity: of.source.entity.clone(),
                region: self.merged.found.region_of_face[face],
                free_side: self.options.free_sides.get(face).copied().unwrap_or(FreeSide::Both),
                area: Area { total_mm2, cut_mm2: 0.0, uncut_mm2: BTreeMap::from([(reason, total_mm2)]) },
            }
        };
        model.faces.iter().enumerate().map(account).collect()
    }
}

/// The stock while levels are planned.
struct Rough<'a, 'm> {
    prepared: &'a Prepared<'m>,
    covered: &'a Covered<'a>,
    levels: Levels,
    state: InProcessStock,
    notes: Vec<String>,
}

impl Rough<'_, '_> {
    /// Levels from one setup, and what they leave.
    fn setup(
        &mut self,
        frame: &Frame,
        record: &Stock,
        is_whole: bool,
        monitor: &dyn Monitor,
    ) -> Result<LevelPlan, Error> {
        let options = &self.prepared.options;
        let tool = self.prepared.job.tool();
        let stock = self.state.stock().clone();
        let bounds = match *record {
            Stock::Block { box_mm } => Aabb::of_corners(box_mm),
            // The rays know where it is.
            Stock::Bar { .. } | Stock::Layer { .. } | Stock::File(_) => {
                let boxes = self.prepared.file.model().faces.iter().map(|face| face.bounds());
                boxes.fold(stock.grid().bounds(), |all, face| all.union(&face))
            }
        };
        let axes = frame.axes();
        let across = frame.box_in_setup(&bounds);
        let pitch_mm = stock.grid().pitch_mm();
        let skin_mm = if matches!(record, Stock::File(_)) { SKIN_OF_FILES_MM } else { SKIN_MM };
        let left = |heights: [f64; 2]| standing(&stock, axes, (heights, skin_mm), &across);
        let is_block = is_whole && matches!(record, Stock::Block { .. });
        let piece = Workpiece {
            block: bounds,
            left: if is_block { None } else { Some(&left) },
            thin_mm: if is_block || frame.is_tilted() { 0.0 } else { THIN * pitch_mm + TEETH * TEETH_MM },
            within_mm: within(options.bounds.centre_within_mm.as_ref(), frame)?,
        };
        let asked = LevelOptions {
            allowance_mm: options.allowance_mm,
            step_mm: self.levels.step_down_mm,
            engagement_deg: self.levels.engagement_deg,
            band_mm: Some(self.levels.band_mm),
            holder: options.holder.clone().map(|holder| (holder, options.holder_clearance_mm)),
            entry: match self.levels.dead_centre_mm {
                Some(mm) => Entry::with_dead_centre(tool.radius_mm(), mm),
                None => Entry::usual(tool.radius_mm()),
            },
            feeds: LevelFeeds {
                cut_mm_per_min: options.feeds.cut_mm_per_min,
                lead_mm_per_min: options.feeds.lead_mm_per_min,
                rapid_mm_per_min: options.feeds.rapid_mm_per_min,
                ramp_deg: self.levels.ramp_deg.unwrap_or(RAMP_DEG),
            },
        };
        let (model, covering) = (&self.covered.model, &self.covered.covering);
        let plan = plan_levels(model, covering, frame, tool, &piece, &asked, monitor)?;
        let refused: Vec<&String> = plan.levels.iter().flat_map(|level| &level.refused).collect();
        if let Some(first) = refused.first() {
            self.notes.push(format!(
                "{}: {} pockets of levels are left as they are: {first}",
                frame.name,
                refused.len()
            ));
        }
        self.notes.extend(plan.kept_out.filter(|of| of.area_mm2 > LEAST_KEPT_OUT_MM2).map(|of| {
            format!(
                "{}: shank or holder keep the tool out of {:.0} mm² of the levels from {:.2} mm down: a stick-out of {:.0} mm \
                 would reach all of them",
                frame.name,
                of.area_mm2,
                of.below_mm,
                (of.deep_mm + options.holder_clearance_mm).ceil()
            )
        }));
        Ok(plan)
    }
}

/// Where stock is between two heights of a setup with these axes, but for a skin at the lower one, no less than there is; all of its
/// box where it cannot be asked.
fn standing(
    stock: &InProcess,
    axes: [Vector3; 3],
    ([low, high], skin_mm): ([f64; 2], f64),
    across: &Aabb,
) -> PlanarSet {
    let pitch_mm = stock.grid().pitch_mm();
    let low = low + skin_mm.min(SKIN * (high - low));
    if let Some(polygons) = stock.outline(axes, low, high) {
        return PlanarSet::covered_by(&polygons).dilated(WIDER * pitch_mm);
    }
    match stock.slice(axes, low, high) {
        Ok(slice) => cells(&slice).dilated(WIDER_CELLS * pitch_mm),
        Err(_) => PlanarSet::rectangle([across.min.x, across.min.y, across.max.x, across.max.y]),
    }
}

/// The box that the tool's axis stays in, across a setup's axis: the sides that it has are along the setup's coordinates.
fn within(asked: Option<&[f64; 6]>, frame: &Frame) -> Result<Option<[f64; 4]>, Error> {
    let Some(sides) = asked else { return Ok(None) };
    let mut within = [-FARTHEST_MM, -FARTHEST_MM, FARTHEST_MM, FARTHEST_MM];
    let axes = frame.axes();
    for k in (0..3).filter(|&k| sides[k] > -Bounds::FAR_MM || sides[k + 3] < Bounds::FAR_MM) {
        let along = (0..2).find(|&j| axes[j][k].abs() > 1.0 - SAME_AXIS);
        let Some(j) = along else {
            return Err(JobError::NotByLevels { what: "a box that is tilted in its setup" }.into());
        };
        let (low, high) = (sides[k] * axes[j][k].signum(), sides[k + 3] * axes[j][k].signum());
        (within[j], within[j + 2]) = (low.min(high), low.max(high));
    }
    Ok(Some(within))
}

/// The cells of a slice that have material, row by row.
fn cells(slice: &Slice) -> PlanarSet {
    let ([u0, v0], mm) = (slice.origin_mm, slice.cell_mm);
    let [columns, rows] = slice.counts;
    let mut rectangles = Vec::new();
    for row in 0..rows {
        let mut from = None;
        for column in 0..=columns {
            match (slice.has_material([column, row]), from) {
                (true, None) => from = Some(column),
                (false, Some(first)) => {
                    let at = |i: u32, j: u32| [u0 + f64::from(i) * mm, v0 + f64::from(j) * mm];
                    let (low, high) = (at(first, row), at(column, row + 1));
                    rectangles.push(vec![low, [high[0], low[1]], high, [low[0], high[1]]]);
                    from = None;
                }
                _ => {}
            }
        }
    }
    PlanarSet::of_polygons(&rectangles)
}

fn totals(program: &Program, seconds: &[f64]) -> Totals {
    let mut totals =
        Totals { moves: program.moves.len() as u64, time_s: seconds.iter().sum(), ..Totals::default() };
    let mut passes = BTreeSet::new();
    for m in &program.moves {
        totals.length.add(m.kind, m.length_mm());
        totals.control_points += m.points.len() as u64;
        passes.insert((&m.setup, m.pass));
    }
    totals.passes = passes.len() as u32;
    let is_retract =
        |w: &&[claymill_toolpath::Move]| w[0].kind == MoveKind::LeadOut && w[1].kind == MoveKind::Rapid;
    totals.retracts = program.moves.windows(2).filter(is_retract).count() as u32;
    totals
}

fn sum(faces: &[FaceAccount]) -> Area {
    faces.iter().fold(Area::default(), |mut sum, face| {
        sum.total_mm2 += face.area.total_mm2;
        for (reason, mm2) in &face.area.uncut_mm2 {
            *sum.uncut_mm2.entry(*reason).or_default() += mm2;
        }
        sum
    })
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::Point3;
    use claymill_stock::Family;

    use super::*;

    /// A slope that begins at the foot of a level is flat there: what is left out of its height is wide.
    #[test]
    fn all_of_a_slope_above_a_level_is_standing() {
        let bar = InProcess::cylinder(Family::X, Point3::origin(), 20.0, 30.0, 0.5).unwrap();
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        for low in [5.0, 12.0, 19.0, 19.5] {
            let half_mm = (400.0_f64 - low * low).sqrt();
            let above = PlanarSet::rectangle([0.5, -half_mm, 29.5, half_mm]);
            let standing = standing(&bar, axes, ([low, 20.0], SKIN_MM), &bar.grid().bounds());
            assert!(above.minus(&standing).area_mm2() < 1e-3, "{low}: {:?}", above.minus(&standing));
            assert!(standing.area_mm2() < 31.2 * (2.0 * half_mm + 1.2), "{low}");
        }
    }
}
