//! A block roughed by levels: regions, levels, strokes, moves.

use std::sync::atomic::{AtomicUsize, Ordering};

use claymill_contact::{Covering, Frame};
use claymill_nurbs::{Aabb, Model};
use claymill_toolpath::{Holder, Monitor, Move, Stage, Tool};
use rayon::prelude::*;
use tracing::info_span;

use crate::above::Above;
use crate::area::{Area, Cleared, clear_rooms};
use crate::engagement::EngagementLimit;
use crate::entry::Entry;
use crate::error::ClearingError;
use crate::holder::{HolderBody, KeptOut};
use crate::levels::{Depths, flats_mm, standing_flats_mm};
use crate::moves::{LevelFeeds, Pen};
use crate::order::Beside;
use crate::planar_set::{FARTHEST_MM, PlanarSet};
use crate::reach::{Reach, wider};
use crate::ridges::{Swept, ridges};
use crate::stairs::{Level, Slabs, disc_mm};

/// The tool's centre may be this far outside of the stock, in radii.
const OUTSIDE: f64 = 1.25;
/// Rapids are this far above everything, mm.
const CLEARANCE_MM: f64 = 5.0;
/// Levels that would cut less than this share of a tool's disc are left out.
const LEAST_CUT: f64 = 0.02;
/// A tool keeps this clear of what is beside it, mm: what borders lose where they are simplified, level after level, and drawn as
/// arcs comes to it and rarely to 3 µm more.
const KEPT_CLEAR_MM: f64 = 4e-3;
/// A part that is larger than the stock by less fits, mm.
const SLACK_MM: f64 = 1e-6;

/// How a block is roughed.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelOptions {
    /// What is left along the faces' normals, mm.
    pub allowance_mm: f64,
    /// Largest depth of a level, mm.
    pub step_mm: f64,
    /// Largest engagement, degrees.
    pub engagement_deg: f64,
    /// Stairs over slopes are no thicker than this, mm; `None` leaves them.
    pub band_mm: Option<f64>,
    /// What holds the tool, and the distance that it keeps from what stands, mm; `None` where that is not known.
    pub holder: Option<(Holder, f64)>,
    /// Ways into pockets.
    pub entry: Entry,
    /// Feeds.
    pub feeds: LevelFeeds,
}

/// What was found of a level.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelFound {
    /// Its height in the setup, mm.
    pub z_mm: f64,
    /// Area that was cut, mm².
    pub area_mm2: f64,
    /// What the tool would reach and does not cut, mm².
    pub left_mm2: f64,
    /// Length of what cuts, mm.
    pub cut_length_mm: f64,
    /// Rounds that it took.
    pub rounds: usize,
    /// Pockets into which there is no way.
    pub refused: Vec<String>,
}

/// A block roughed by levels.
#[derive(Debug, Clone)]
pub struct LevelPlan {
    /// In machining order, model coordinates.
    pub moves: Vec<Move>,
    /// Levels in machining order.
    pub levels: Vec<LevelFound>,
    /// What is not cut for shank or holder.
    pub kept_out: Option<KeptOut>,
    /// Height of rapids in the setup, mm.
    pub clearance_mm: f64,
}

/// What a part is cut from, in model coordinates.
#[derive(Clone, Copy)]
pub struct Workpiece<'a> {
    /// Box of the stock, mm.
    pub block: Aabb,
    /// Where stock is between two heights of the setup, mm; no less than there is. All of the block where nothing is known.
    pub left: Option<&'a (dyn Fn([f64; 2]) -> PlanarSet + Sync)>,
    /// What of it is thinner than this was cut before: it is there since no less is said than there is, mm.
    pub thin_mm: f64,
    /// Box that the tool's axis stays in, seen along it, in the setup's coordinates, as xmin, ymin, xmax, ymax, mm.
    pub within_mm: Option<[f64; 4]>,
}

/// A level that was cleared, if there was enough to do.
#[derive(Clone, Default)]
struct Done {
    cleared: Option<Cleared>,
    /// What there is, if it is too little to be cut.
    left_out: PlanarSet,
}

/// Plans a roughing by levels of a model in a workpiece.
///
/// # Errors
/// A number makes no sense, the block does not hold the model, the tool fits nowhere, or the monitor ends it.
pub fn plan_levels(
    model: &Model,
    covering: &Covering,
    frame: &Frame,
    tool: &Tool,
    piece: &Workpiece<'_>,
    options: &LevelOptions,
    monitor: &dyn Monitor,
) -> Result<LevelPlan, ClearingError> {
    let radius_mm = tool.radius_mm();
    let block = &piece.block;
    EngagementLimit::new(disc_mm(tool, options.step_mm), options.engagement_deg)?;
    let part = model.faces.iter().map(|f| f.bounds()).reduce(|a, b| a.union(&b));
    let Some(part) = part else {
        return Err(ClearingError::NoRoom { radius_mm, place: "on no face".into() });
    };
    let holds =
        (0..3).all(|k| block.min[k] <= part.min[k] + SLACK_MM && block.max[k] >= part.max[k] - SLACK_MM);
    if !holds {
        return Err(ClearingError::StockTooSmall { stock_mm: block.corners(), part_mm: part.corners() });
    }
    let [stock_box, part_box] = [block, &part].map(|b| frame.box_in_setup(b));
    let flutes_mm = tool.flute_length_mm.unwrap_or(f64::INFINITY);
    let depths = Depths {
        top_mm: stock_box.max.z,
        bottom_mm: part_box.min.z.max(stock_box.min.z),
        step_mm: options.step_mm,
        flutes_mm,
    };
    depths.levels_mm(&[])?;
    let outside_mm = OUTSIDE * radius_mm;
    let [x0, y0, x1, y1] = piece.within_mm.unwrap_or([-FARTHEST_MM, -FARTHEST_MM, FARTHEST_MM, FARTHEST_MM]);
    let around = [
        (stock_box.min.x - outside_mm).max(x0),
        (stock_box.min.y - outside_mm).max(y0),
        (stock_box.max.x + outside_mm).min(x1),
        (stock_box.max.y + outside_mm).min(y1),
    ];
    if !(around[0] < around[2] && around[1] < around[3]) {
        return Err(ClearingError::NoRoom { radius_mm, place: "in the box that it is kept in".into() });
    }
    let reach =
        Reach::new(model, covering, frame, &wider(tool, KEPT_CLEAR_MM), options.allowance_mm, around)?;
    let flats = flats_mm(model, frame, options.allowance_mm);
    let flats = standing_flats_mm(&reach, &flats, radius_mm, monitor)?;
    let heights = depths.levels_mm(&flats)?;
    let slice = PlanarSet::rectangle([stock_box.min.x, stock_box.min.y, stock_box.max.x, stock_box.max.y]);
    let whole = |_: [f64; 2]| slice.clone();
    let slabs = Slabs {
        reach: &reach,
        stock: piece.left.unwrap_or(&whole),
        tool,
        band_mm: options.band_mm,
        within: piece.within_mm.map(PlanarSet::rectangle),
    };
    let mut levels = slabs.levels(&heights, depths.top_mm, monitor)?;
    let holder = options.holder.as_ref().map(|(holder, clearance_mm)| (holder, *clearance_mm));
    let kept_out = HolderBody::of(tool, holder).keep_clear(&mut levels, monitor)?;
    let clearing =
        Clearing { options, monitor, thin_mm: piece.thin_mm, all: levels.len(), done: AtomicUsize::new(0) };
    let done = clearing.cleared(&mut levels, tool)?;
    let clearance_mm = stock_box.max.z.max(part_box.max.z) + CLEARANCE_MM;
    let mut pen = Pen::new(frame, options.feeds, clearance_mm);
    let mut found = Vec::new();
    let mut above = Above::flat(f64::NEG_INFINITY);
    for (level, Done { cleared, left_out }) in levels.iter().zip(&done) {
        let Some(cleared) = cleared else {
            if !left_out.is_empty() {
                above.leave(level.above, left_out, radius_mm);
            }
            continue;
        };
        above.cut_mm = level.above;
        let written = pen.strokes(&cleared.strokes, level.z, &above);
        written.map_err(|e| ClearingError::Curve { what: e.to_string() })?;
        found.push(LevelFound {
            z_mm: level.z,
            area_mm2: cleared.area_mm2,
            left_mm2: cleared.left.area_mm2(),
            cut_length_mm: cleared.cut_length_mm(),
            rounds: cleared.rounds,
            refused: cleared.refused.iter().map(ToString::to_string).collect(),
        });
    }
    if pen.moves.is_empty() {
        return Err(ClearingError::NoRoom { radius_mm, place: "in the stock".into() });
    }
    Ok(LevelPlan { moves: pen.moves, levels: found, kept_out, clearance_mm })
}

/// A slab whose stairs are cut from the bottom up.
#[derive(Default)]
struct Slab {
    /// The one of its levels that is cut next.
    next: usize,
    /// What the levels so far would reach and did not cut.
    left: PlanarSet,
    /// What of it is in pockets into which there was no way.
    refused: PlanarSet,
    /// What the last level does not cut since it stays out of these.
    given_up: PlanarSet,
    /// Where the tool was on the levels so far.
    swept: Vec<Swept>,
}

/// The clearing of all levels of a setup.
struct Clearing<'a> {
    options: &'a LevelOptions,
    monitor: &'a dyn Monitor,
    /// What is thinner than this was cut before, mm.
    thin_mm: f64,
    /// Levels.
    all: usize,
    /// How many of them are cleared.
    done: AtomicUsize,
}

impl Clearing<'_> {
    /// Clears all levels: first those that others come between, then these, which stay out of pockets into which there was no way.
    fn cleared(&self, levels: &mut [Level], tool: &Tool) -> Result<Vec<Done>, ClearingError> {
        let floors: Vec<usize> = (0..levels.len()).filter(|&k| !levels[k].is_stair).collect();
        let mut done = vec![Done::default(); levels.len()];
        for (k, of_floor) in floors.iter().zip(self.side_by_side(levels, &floors)?) {
            done[*k] = of_floor;
        }
        // The next stair of every slab in turn: it stands on what is left below it, and stays out of pockets that were refused there.
        let mut slabs: Vec<Slab> = floors.iter().map(|&k| Slab { next: k, ..Slab::default() }).collect();
        loop {
            slabs.iter_mut().for_each(|slab| slab.next += 1);
            slabs.retain(|slab| levels.get(slab.next).is_some_and(|level| level.is_stair));
            if slabs.is_empty() {
                break;
            }
            for slab in &mut slabs {
                let below = &levels[slab.next - 1];
                let cut = below.feasible.dilated(below.disc_mm);
                match &done[slab.next - 1].cleared {
                    Some(cleared) => {
                        let closed = cleared.closed.dilated(below.disc_mm).intersection(&cleared.left);
                        slab.refused = slab.refused.union(&closed);
                        slab.left = slab.left.minus(&cut).union(&cleared.left).union(&slab.given_up);
                        slab.swept.push(Swept { z: below.z, centres: cleared.swept.clone() });
                    }
                    None => {
                        slab.left = slab.left.union(&cut.intersection(&below.stock)).union(&slab.given_up);
                    }
                }
                let level = &mut levels[slab.next];
                level.stock = level.stock.union(&slab.left);
                slab.given_up = level.stay_out(&slab.refused.dilated(tool.radius_mm()));
            }
            let ridges_of = |slab: &Slab| ridges(tool, &levels[slab.next], &slab.swept);
            let ridges: Vec<PlanarSet> = slabs.par_iter().map(ridges_of).collect();
            for (slab, ridges) in slabs.iter().zip(ridges) {
                levels[slab.next].ridges = ridges;
            }
            let stairs: Vec<usize> = slabs.iter().map(|slab| slab.next).collect();
            for (k, of_stair) in stairs.iter().zip(self.side_by_side(levels, &stairs)?) {
                done[*k] = of_stair;
            }
        }
        Ok(done)
    }

    /// Clears levels side by side. Between upright walls many are alike, and are cleared once.
    fn side_by_side(&self, levels: &[Level], which: &[usize]) -> Result<Vec<Done>, ClearingError> {
        let Clearing { options, monitor, thin_mm, .. } = *self;
        let limit_of = |level: &Level| EngagementLimit::new(level.disc_mm, options.engagement_deg);
        let tasks = which.iter().map(|&k| Ok((&levels[k], limit_of(&levels[k])?)));
        let tasks: Vec<(&Level, EngagementLimit)> = tasks.collect::<Result<_, ClearingError>>()?;
        let are_alike = |(a, of_a): &(&Level, EngagementLimit), (b, of_b): &(&Level, EngagementLimit)| {
            let is_sure_alike = thin_mm <= 0.0 || a.taken == b.taken;
            of_a == of_b
                && a.feasible == b.feasible
                && a.stock == b.stock
                && a.ridges == b.ridges
                && is_sure_alike
        };
        let mut own: Vec<usize> = Vec::new();
        let mut alike = Vec::with_capacity(tasks.len());
        for k in 0..tasks.len() {
            let same = own.iter().position(|&other| are_alike(&tasks[other], &tasks[k]));
            alike.push(same.unwrap_or_else(|| {
                own.push(k);
                own.len() - 1
            }));
        }
        let one = |&k: &usize| {
            let (level, limit) = tasks[k];
            let _span = info_span!("clearing of a level", z_mm = level.z).entered();
            let cut = level.feasible.dilated(limit.radius_mm()).intersection(&level.stock);
            let [cut, doubtful] = level.told_apart(cut, thin_mm);
            let least_mm2 = LEAST_CUT * std::f64::consts::PI * limit.radius_mm().powi(2);
            let (cleared, left_out) = if cut.area_mm2() < least_mm2 {
                (None, cut)
            } else {
                let entry = options.entry.of_disc(limit.radius_mm());
                let stock = if thin_mm > 0.0 { &cut } else { &level.stock };
                let area = Area { feasible: &level.feasible, stock, limit, entry };
                let beside = Beside { ridges: &level.ridges, doubtful: &doubtful };
                (Some(clear_rooms(&area, beside, monitor)?), PlanarSet::default())
            };
            let alike = alike.iter().filter(|&&other| own[other] == k).count();
            let done = self.done.fetch_add(alike, Ordering::Relaxed) + alike;
            monitor.at(Stage::Paths, done as f64 / self.all as f64);
            Ok(Done { cleared, left_out })
        };
        let found: Vec<Done> = own.par_iter().map(one).collect::<Result<_, ClearingError>>()?;
        Ok(alike.into_iter().map(|k| found[k].clone()).collect())
    }
}
