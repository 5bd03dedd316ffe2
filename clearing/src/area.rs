//! One level cleared: rounds, and the strokes in order.

use claymill_toolpath::Monitor;

use crate::arcs::{PathPiece, pieces};
use crate::engagement::EngagementLimit;
use crate::entry::{Entry, WayIn, way_in};
use crate::error::{ClearingError, within};
use crate::fronts::{Lead, without_steps};
use crate::order::{Beside, Floor, Ordered, order};
use crate::outline::Place;
use crate::planar_set::{CHORD_MM, FARTHEST_MM, PlanarSet};
use crate::rounds::{SHARPEST, STRAIGHTEST, State, TEETH_MM, THINNEST_MM, run};

/// Entries of a level at most.
const MOST_ENTRIES: usize = 500;
/// A way in has to gain this share of the square of the tool's radius.
const WORTH_ENTERING: f64 = 0.01;

/// A level that is to be cleared.
#[derive(Debug, Clone, Copy)]
pub struct Area<'a> {
    /// Where the tool's centre may be.
    pub feasible: &'a PlanarSet,
    /// Where there is stock.
    pub stock: &'a PlanarSet,
    /// The limit of engagement.
    pub limit: EngagementLimit,
    /// The way in.
    pub entry: Entry,
}

/// How the tool comes to a stroke.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Approach {
    /// Along from the stroke before, over ground that is cleared.
    Along,
    /// From above, where nothing is left.
    Over,
    /// Down on a helix, or straight down if its radius is 0.
    Helix {
        /// Its middle, mm.
        centre: [f64; 2],
        /// Its radius, mm.
        radius_mm: f64,
    },
    /// Down along the pass, which is closed, and once around it on the level.
    Ramp,
}

impl Approach {
    /// Whether all of the stroke is a way into the full.
    fn is_entry(&self) -> bool {
        matches!(self, Approach::Helix { .. } | Approach::Ramp)
    }
}

/// A stroke: the tool comes, cuts along a pass and leaves it.
#[derive(Debug, Clone, PartialEq)]
pub struct Stroke {
    /// How the tool comes to its start.
    pub approach: Approach,
    /// Where the way along from the stroke before bends, mm.
    pub via: Vec<[f64; 2]>,
    /// The way into a closed pass.
    pub lead_in: Vec<PathPiece>,
    /// The pass.
    pub cut: Vec<PathPiece>,
    /// The way out of it.
    pub lead_out: Vec<PathPiece>,
}

/// A level that is cleared.
#[derive(Debug, Clone)]
pub struct Cleared {
    /// In machining order.
    pub strokes: Vec<Stroke>,
    /// What the tool would reach and does not cut.
    pub left: PlanarSet,
    /// Area that was to be cut, mm².
    pub area_mm2: f64,
    /// Rounds that it took.
    pub rounds: usize,
    /// Pockets into which there is no way.
    pub refused: Vec<ClearingError>,
    /// Where the tool's centre would have to be in them.
    pub(crate) closed: PlanarSet,
    /// What the tool's centre has reached by its own passes.
    pub(crate) swept: PlanarSet,
}

impl Cleared {
    /// Length of all that cuts, mm: passes and ways in, without entries.
    #[must_use]
    pub fn cut_length_mm(&self) -> f64 {
        let passes = self.strokes.iter().filter(|s| !s.approach.is_entry());
        passes.flat_map(|s| s.lead_in.iter().chain(&s.cut)).map(PathPiece::length_mm).sum()
    }
}

/// Clears a level at an engagement that nowhere exceeds the limit, entries aside.
///
/// # Errors
/// The tool fits nowhere or gets in nowhere, the level is too large or takes too many rounds, or the monitor ends it.
pub fn clear(area: &Area<'_>, monitor: &dyn Monitor) -> Result<Cleared, ClearingError> {
    let nothing = PlanarSet::default();
    let cleared = clear_rooms(area, Beside { ridges: &nothing, doubtful: &nothing }, monitor)?;
    match cleared.refused.first() {
        Some(error) if cleared.strokes.is_empty() => Err(error.clone()),
        _ => Ok(cleared),
    }
}

/// The same where it is no error that the tool gets in nowhere, and something is beside what it cuts.
pub(crate) fn clear_rooms(
    area: &Area<'_>,
    beside: Beside<'_>,
    monitor: &dyn Monitor,
) -> Result<Cleared, ClearingError> {
    let radius_mm = area.limit.radius_mm();
    within("radius of the helix, mm,", area.entry.helix_mm, 0.0, radius_mm)?;
    within("least radius of a helix, mm,", area.entry.least_helix_mm, 0.0, radius_mm)?;
    // Air may end anywhere; circles about what is to be cut may not.
    let reach_mm = area.stock.bounds().into_iter().flatten().map(f64::abs).fold(0.0, f64::max);
    let reach_mm = reach_mm + 1.1 * STRAIGHTEST * radius_mm;
    if reach_mm > FARTHEST_MM {
        return Err(ClearingError::TooFar { reach_mm });
    }
    if area.feasible.is_empty() {
        return Err(ClearingError::NoRoom { radius_mm, place: "on the level".into() });
    }
    let wanted = area.feasible.dilated(radius_mm).intersection(area.stock).without_slivers(THINNEST_MM);
    let mut cleared = Cleared {
        strokes: Vec::new(),
        area_mm2: wanted.area_mm2(),
        left: wanted,
        rounds: 0,
        refused: Vec::new(),
        closed: PlanarSet::default(),
        swept: PlanarSet::default(),
    };
    // Rooms that the tool cannot get to from each other share nothing but what both reach of their walls.
    let mut at = [0.0, 0.0];
    for room in area.feasible.parts() {
        at = clear_room(area, (&room, beside), &mut cleared, at, monitor)?;
    }
    Ok(cleared)
}

/// Clears a connected room, coming from a place; says where the tool is then.
fn clear_room(
    area: &Area<'_>,
    (room, beside): (&PlanarSet, Beside<'_>),
    cleared: &mut Cleared,
    mut at: Place,
    monitor: &dyn Monitor,
) -> Result<Place, ClearingError> {
    let radius_mm = area.limit.radius_mm();
    // Borders of stock and of what the tool reaches run along each other: noise between them would be hundreds of parts.
    let wanted = room.dilated(radius_mm).intersection(&cleared.left).without_slivers(THINNEST_MM);
    if wanted.is_empty() {
        return Ok(at);
    }
    let reached = room.minus(&wanted.dilated(radius_mm + 2.0 * CHORD_MM));
    let mut state = State::new(room, reached.clone(), &wanted);
    let (mut closed, mut is_new) = (PlanarSet::default(), true);
    let before = cleared.strokes.len();
    for _ in 0..MOST_ENTRIES {
        if is_new {
            let fronts = run(room, &mut state, &area.limit, monitor)?;
            let is_here = cleared.strokes.len() > before;
            let floor = Floor { reached: &state.reached, beside, limit: &area.limit };
            for ordered in order(&fronts, &floor, (at, is_here)) {
                cleared.strokes.push(stroke(&ordered));
                at = ordered.pass.end();
            }
        }
        let Some(part) = next_entry(area, room, &state, &closed) else { break };
        let way_in = way_in(area, room, &part);
        // A part without a way in leaves everything as it was.
        is_new = way_in.is_ok();
        match way_in {
            Ok(WayIn { stroke, reached, bored }) => {
                state.take(&reached, &bored);
                at = stroke.cut.last().map_or(at, |piece| piece.to);
                state.ends = vec![at];
                cleared.strokes.push(stroke);
            }
            Err(error) => {
                cleared.refused.push(error);
                closed = closed.union(&part.dilated(radius_mm * SHARPEST));
            }
        }
    }
    cleared.swept = cleared.swept.union(&state.reached.minus(&reached));
    cleared.closed = cleared.closed.union(&closed);
    cleared.rounds += state.rounds;
    let left = state.uncut.dilated(TEETH_MM + 2.0 * CHORD_MM).minus(&state.reached.dilated(radius_mm));
    cleared.left = cleared.left.minus(&wanted.minus(&left));
    Ok(at)
}

fn stroke(ordered: &Ordered<'_>) -> Stroke {
    let pass = ordered.pass;
    let approach = if ordered.link.is_some() { Approach::Along } else { Approach::Over };
    let mut way = ordered.through.clone();
    way.push(pass.start());
    let mut lead_in: Vec<PathPiece> = way.windows(2).map(|w| PathPiece::line(w[0], w[1])).collect();
    let mut lead_out = Vec::new();
    match &pass.lead {
        Some(Lead::Circle { centre, from, to }) => {
            lead_in.push(PathPiece::anticlockwise(*from, pass.points[0], *centre));
            lead_out.push(PathPiece::anticlockwise(pass.points[0], *to, *centre));
        }
        Some(Lead::Spiral(points)) => lead_in.extend(pieces(points)),
        None => {}
    }
    let via = ordered.link.clone().unwrap_or_default();
    Stroke { approach, via, lead_in, cut: pieces(&without_steps(&pass.points)), lead_out }
}

/// A part of what the centre has not reached, if it is worth going there: behind necks that are narrower than the smallest circle, or
/// with no way in at all.
fn next_entry(area: &Area<'_>, room: &PlanarSet, state: &State, closed: &PlanarSet) -> Option<PlanarSet> {
    let radius_mm = area.limit.radius_mm();
    let rest = room.minus(&state.reached.dilated(4.0 * CHORD_MM)).minus(closed);
    let least_mm = SHARPEST * radius_mm;
    let cut_mm2 = |part: &PlanarSet| {
        part.dilated(radius_mm).intersection(&state.uncut).area_mm2() / (radius_mm * radius_mm)
    };
    let is_worth = |part: &PlanarSet| !part.eroded(least_mm).is_empty() && cut_mm2(part) > WORTH_ENTERING;
    rest.parts().into_iter().find(is_worth)
}
