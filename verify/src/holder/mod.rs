//! Shank and holder over every move, from the written moves and the model.
//!
//! ```text
//!       │ spindle │          How much must the holder be raised for a point of the model at distance ρ from the axis
//!     ╭─┴─────────┴─╮        and height z to stay below it? On a straight stretch this is a convex question about two
//!     ╰──╮ flange╭──╯        convex bodies, the triangle as the moving tip sees it and a frustum of the holder,
//!         ╲ nose╱            and their distance answers it for all the stretch at once, with a bound at every step.
//!          ╲___╱   ▲
//!           │ │    │ stick-out
//!           ╰─╯ tip▼
//! ```

mod account;
mod aims;
mod body;
mod gap;
mod patch;
mod sweep;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, FaceMesh, Point3};
use claymill_toolpath::{Cancelled, Holder, Tool};
use rayon::prelude::*;

pub use account::{HolderClearance, RegionStickOut, ShankContact};
use aims::{Entry, Nearest, Raise, SAME_MM, Spot};
use body::Frustum;
use gap::Prism;
use patch::Patches;
use sweep::Sweep;

use crate::drop::DropMesh;
use crate::parts::{Numbers, Parts, Portable, Sees};
use crate::reach::Reach;
use crate::report::Place;
use crate::scene::{Scene, Stage};
use crate::track::Track;

/// Distances of the holder beyond this are not measured, mm.
const FAR_MM: f64 = 10.0;
/// Moves that are looked along side by side, knowing what those before them have found: fixed numbers, so that the
/// result does not depend on the number of threads. Few at first, when little is known.
const ABREAST: [usize; 2] = [16, 256];

/// A shank as thick as the ball runs along walls where the ball has been and was measured: it is in the way where it enters the
/// model by more than this, mm.
const ALONGSIDE_MM: f64 = 0.02;

/// Distances that are shorter by less than this are what was asked for, mm.
const SETTLED_MM: f64 = 1e-4;

/// What stands over the moves of a tool.
pub(crate) struct Held {
    body: Vec<Frustum>,
    stick_out_mm: f64,
}

impl Held {
    pub(crate) fn of(holder: &Holder) -> Self {
        Held { body: body::of_holder(holder), stick_out_mm: holder.stick_out_mm }
    }

    /// Whether it surely comes nearer to the model than this, mm, with the tip in one place of the view; of no more than triangles
    /// deviate, whether it meets one.
    pub(crate) fn comes_near(&self, view: &DropMesh<'_>, tip: &Point3, clearance_mm: f64) -> bool {
        let from = tip.z + self.stick_out_mm - clearance_mm;
        let widest_mm = self.body.iter().map(|f| f.outer).fold(0.0, f64::max) + clearance_mm;
        let mut is_near = false;
        view.visit(
            |b| b.max.z > from && beside_mm(b, tip) < widest_mm,
            |i| {
                let prism = Prism::new(&view.corners(i), tip, tip);
                let kept_mm = (clearance_mm - view.deviation(i)).max(f64::MIN_POSITIVE);
                is_near = self.body.iter().any(|f| !prism.keeps(f, self.stick_out_mm, kept_mm));
                if is_near { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            },
        );
        is_near
    }
}

/// How far a box of a view is beside the axis of a tool.
fn beside_mm(b: &Aabb, tip: &Point3) -> f64 {
    let beside = |k: usize| (b.min[k] - tip[k]).max(tip[k] - b.max[k]).max(0.0);
    beside(0).hypot(beside(1))
}

/// What one move has to say.
struct Along {
    /// More stick-out than any move of the region so far has asked for.
    more_mm: Option<(f64, Spot)>,
    /// A distance smaller than that asked for, or than any so far.
    nearer_mm: Option<(f64, Spot)>,
}

/// Carries the holders along all moves; `None` where no tool has one.
pub(crate) fn measure(
    scene: &Scene<'_>,
    meshes: &[Option<FaceMesh>],
    reach: &Reach<'_>,
    stage: &Stage<'_>,
) -> Result<Option<HolderClearance>, Cancelled> {
    let held_in = |setup: usize| -> Vec<Option<Held>> {
        let held = |tool| scene.holder(tool, setup).map(|holder| Held::of(&holder));
        (0..scene.job.tools.len()).map(held).collect()
    };
    let held: Vec<Vec<Option<Held>>> = (0..scene.job.setups.len()).map(held_in).collect();
    let tracks: Vec<&Track> = scene.tracks.iter().filter(|t| held[t.setup][t.tool].is_some()).collect();
    if tracks.is_empty() {
        return Ok(None);
    }
    let asked_mm = scene.holder_clearance_mm();
    let (upright, tilted): (Vec<&Track>, Vec<&Track>) =
        tracks.into_iter().partition(|t| t.stands_along(&scene.axis_of(t)));

    let mut needed: BTreeMap<(usize, usize, usize), (f64, Option<Place>)> = BTreeMap::new();
    let mut nearest: (f64, Option<Place>) = (FAR_MM.max(asked_mm), None);
    let (mut touching, mut near) = (0, 0);
    let (mut waiting, mut abreast) = (&upright[..], ABREAST[0]);
    while !waiting.is_empty() {
        let (batch, rest) = waiting.split_at(abreast.min(waiting.len()));
        (waiting, abreast) = (rest, (2 * abreast).min(ABREAST[1]));
        for track in batch {
            needed.entry(key(track)).or_insert((track.radius_mm - SAME_MM, None));
        }
        let look = |track: &&Track| {
            let held = held[track.setup][track.tool].as_ref()?;
            let found = along(
                scene,
                meshes,
                reach,
                track,
                held,
                needed[&key(track)].0,
                (nearest.0 - SAME_MM).max(asked_mm),
            );
            Some(found)
        };
        let part = |track| stage.part(upright.len(), || look(track));
        let found: Vec<Option<Along>> = batch.par_iter().map(part).collect::<Result<_, _>>()?;
        for (track, found) in batch.iter().zip(found) {
            let Some(found) = found else { continue };
            let place = |spot: &Spot| Some(spot.place(scene, reach.setup(track.setup), track.seq));
            if let (Some((mm, spot)), Some(most)) = (&found.more_mm, needed.get_mut(&key(track)))
                && *mm > most.0
            {
                *most = (*mm, place(spot));
            }
            if let Some((mm, spot)) = &found.nearer_mm {
                touching += u64::from(*mm <= SAME_MM);
                near += u64::from(*mm < asked_mm - SETTLED_MM);
                if *mm < nearest.0 {
                    nearest = (*mm, place(spot));
                }
            }
        }
    }
    let region = |((setup, region, tool), (mm, at)): ((usize, usize, usize), _)| RegionStickOut {
        region,
        setup: scene.job.setups[setup].name.clone(),
        tool: scene.job.tools[tool].id.clone(),
        stick_out_mm: held[setup][tool].as_ref().map_or(0.0, |h| h.stick_out_mm),
        stick_out_needed_mm: mm + SAME_MM,
        at,
    };
    let found_near = nearest.1.is_some();
    Ok(Some(HolderClearance {
        asked_mm,
        moves: upright.len() as u64,
        moves_not_checked: tilted.len() as u64,
        clearance_min_mm: found_near.then_some(if nearest.0 > SAME_MM { nearest.0 } else { 0.0 }),
        clearance_min_at: nearest.1,
        touching,
        near,
        regions: needed.into_iter().map(region).collect(),
    }))
}

/// Looks along one move for more stick-out than `known_mm`, and for distances below `within_mm`.
fn along(
    scene: &Scene<'_>,
    meshes: &[Option<FaceMesh>],
    reach: &Reach<'_>,
    track: &Track,
    held: &Held,
    known_mm: f64,
    within_mm: f64,
) -> Along {
    let patches = Patches { model: scene.model, meshes, view: reach.setup(track.setup) };
    let sweep = Sweep { patches, body: &held.body };
    let clearance_mm = scene.holder_clearance_mm();
    let mut raise = Raise { clearance_mm, raised_mm: known_mm, spot: None };
    sweep.along(track, &mut raise);
    let mut nearest =
        Nearest { raised_mm: held.stick_out_mm, within_mm, distance_mm: f64::INFINITY, spot: None };
    sweep.along(track, &mut nearest);
    Along {
        more_mm: raise.spot.map(|spot| (raise.raised_mm, spot)),
        nearer_mm: nearest.spot.map(|spot| (nearest.distance_mm, spot)),
    }
}

/// Carries flutes and shank along all moves but rapids.
pub(crate) fn measure_shank(
    scene: &Scene<'_>,
    meshes: &[Option<FaceMesh>],
    reach: &Reach<'_>,
    parts: &Parts<'_>,
    stage: &Stage<'_>,
) -> Result<ShankContact, Cancelled> {
    let checked = |t: &&Track| t.sweeps() && t.stands_along(&scene.axis_of(t));
    let tracks: Vec<&Track> = scene.tracks.iter().filter(checked).collect();
    let look = |track: &Track| {
        let view = reach.setup(track.setup);
        let tool = &scene.job.tools[track.tool].tool;
        let sunk_mm = if tool.is_straight() { ALONGSIDE_MM } else { scene.options.gouge_limit_mm };
        let body = body::of_sides(tool, sunk_mm);
        let sweep = Sweep { patches: Patches { model: scene.model, meshes, view }, body: &body };
        let mut entry = Entry { scene, view, tool, found: None };
        sweep.along(track, &mut entry);
        Entered(entry.found.map(|(mm, spot)| (mm, spot.place(scene, view, track.seq))))
    };
    let found: Vec<Entered> = parts.along(("shank", Sees::Along), &tracks, stage, look)?;
    let found = || found.iter().filter_map(|entered| entered.0.as_ref());
    let touching = found().count() as u64;
    let deepest = found().reduce(|a, b| if b.0 > a.0 { b } else { a });
    Ok(ShankContact {
        moves: tracks.len() as u64,
        touching,
        deepest_mm: deepest.map_or(0.0, |d| d.0),
        deepest_at: deepest.map(|d| d.1.clone()),
    })
}

/// How deep flutes and shank enter the model on a move, mm, and where; `None` where they do not.
struct Entered(Option<(f64, Place)>);

impl Portable for Entered {
    type Form = Option<(f64, Place)>;

    fn form(&self, numbers: &Numbers<'_>) -> Option<Self::Form> {
        numbers.own_at(self.0.as_ref())
    }

    fn of_form(form: Self::Form, numbers: &Numbers<'_>) -> Option<Self> {
        Some(Entered(numbers.at(form)?))
    }
}

/// How far flutes and shank, where they are not just as thick as the ball, could be lowered everywhere along a move before they
/// touch, and where; `None` when that is no less than `known_mm`.
pub(crate) fn clearance_of_sides(
    scene: &Scene<'_>,
    meshes: &[Option<FaceMesh>],
    reach: &Reach<'_>,
    track: &Track,
    known_mm: f64,
) -> Option<(f64, Place)> {
    let tool = &scene.job.tools[track.tool].tool;
    if tool.is_straight() || !track.stands_along(&scene.axis_of(track)) {
        return None;
    }
    let view = reach.setup(track.setup);
    let body = body::of_sides(tool, 0.0);
    let sweep = Sweep { patches: Patches { model: scene.model, meshes, view }, body: &body };
    let mut raise = Raise { clearance_mm: 0.0, raised_mm: -known_mm, spot: None };
    sweep.along(track, &mut raise);
    let spot = raise.spot?;
    Some((-raise.raised_mm, spot.place(scene, view, track.seq)))
}

/// Whether flutes or shank of a tool, where they are not just as thick as the ball, surely enter the model with the tip in one
/// place of the view.
pub(crate) fn sides_enter(view: &DropMesh<'_>, tool: &Tool, tip: &Point3) -> bool {
    if tool.is_straight() {
        return false;
    }
    let body = body::of_sides(tool, 0.0);
    let (low, widest) = body.iter().fold((f64::INFINITY, 0.0), |(l, w), f| (f.low.min(l), f.outer.max(w)));
    let mut entered = false;
    view.visit(
        |b| b.max.z > tip.z + low && beside_mm(b, tip) < widest,
        |i| {
            let prism = Prism::new(&view.corners(i), tip, tip);
            let meets = |f: &Frustum| prism.gap(f, 0.0, f64::MIN_POSITIVE).at_least <= 0.0;
            entered = body.iter().any(meets) && body::of_sides(tool, view.deviation(i)).iter().any(meets);
            if entered { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        },
    );
    entered
}

fn key(track: &Track) -> (usize, usize, usize) {
    (track.setup, track.region, track.tool)
}
