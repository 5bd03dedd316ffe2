//! Ways into pockets that have none from outside: a helix, a ramp along a ring where that is long enough, or straight down.
//!
//! ```text
//!      ╭───────────────────╮     What a tool does not cut in its middle is cut once it has moved by as much: so a helix is as wide
//!      │ ╭───────────────╮ │     as that, or a ring as long. A ring halfway to the walls of a slot leaves them for passes that
//!      │ ╰───────────────╯ │     keep to the engagement.
//!      ╰───────────────────╯
//! ```

use claymill_toolpath::Levels;

use crate::arcs::{PathPiece, pieces};
use crate::area::{Approach, Area, Stroke};
use crate::error::ClearingError;
use crate::fronts::without_steps;
use crate::outline::{Place, distance};
use crate::planar_set::{CHORD_MM, PlanarSet};

/// The radius of a helix is found to this share.
const FITTED: f64 = 0.01;
/// What the first turn of an entry leaves uncut, mm.
const ENTRY_MARGIN_MM: f64 = 2e-3;
/// Helices are no wider than this share of the tool's radius.
const WIDEST_HELIX: f64 = 0.9;
/// Helices are no narrower than this share of the tool's radius.
const LEAST_HELIX: f64 = 0.05;
/// A ring keeps this share of the room that there is from what is beside it, and is rounded by so much.
const RING_INSET: f64 = 0.5;
const RING_ROUNDED: f64 = 0.25;

/// How a tool may get into a pocket that has no way in from outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// Radius of the helix of the tool's centre where there is room, mm.
    pub helix_mm: f64,
    /// The least radius that leaves no core, mm.
    pub least_helix_mm: f64,
    /// Whether it may go straight down where not even that has room.
    pub may_plunge: bool,
}

impl Entry {
    /// The usual one of a tool: a helix as wide as the tool, and no plunging.
    #[must_use]
    pub fn usual(radius_mm: f64) -> Self {
        let least_helix_mm = Levels::USUAL_DEAD_CENTRE * radius_mm;
        Entry { helix_mm: WIDEST_HELIX * radius_mm, least_helix_mm, may_plunge: false }
    }

    /// That of a tool that does not cut within a diameter about its axis, mm. One that cuts everywhere may go straight down, but
    /// does so only where there is next to no room.
    #[must_use]
    pub fn with_dead_centre(radius_mm: f64, dead_centre_mm: f64) -> Self {
        let least_helix_mm = (0.5 * dead_centre_mm).max(LEAST_HELIX * radius_mm);
        let helix_mm = f64::max(WIDEST_HELIX * radius_mm, least_helix_mm);
        Entry { helix_mm, least_helix_mm, may_plunge: dead_centre_mm <= 0.0 }
    }

    /// The same for a depth at which no more of the tool cuts than a disc of this radius: the tip of its corner.
    pub(crate) fn of_disc(self, radius_mm: f64) -> Self {
        let least_helix_mm = self.least_helix_mm.min(radius_mm);
        let helix_mm = self.helix_mm.min(least_helix_mm.max(WIDEST_HELIX * radius_mm));
        Entry { helix_mm, least_helix_mm, ..self }
    }
}

/// A way in, and what there is after it.
pub(crate) struct WayIn {
    pub(crate) stroke: Stroke,
    /// Where the tool's centre may be then without cutting.
    pub(crate) reached: PlanarSet,
    /// What is cut then.
    pub(crate) bored: PlanarSet,
}

/// The way into a part of a room.
pub(crate) fn way_in(area: &Area<'_>, room: &PlanarSet, part: &PlanarSet) -> Result<WayIn, ClearingError> {
    let (centre, room_mm) = widest(part);
    let entry = &area.entry;
    let helix_mm = room_mm.min(entry.helix_mm);
    if helix_mm >= entry.least_helix_mm {
        return Ok(helix(area, room, centre, helix_mm));
    }
    match ramp(area, part, room_mm) {
        Some(ramp) => Ok(ramp),
        None if entry.may_plunge => Ok(helix(area, room, centre, 0.0)),
        None => Err(ClearingError::NoEntry { at_mm: centre, room_mm, least_mm: entry.least_helix_mm }),
    }
}

/// A helix, or straight down if it has no radius.
fn helix(area: &Area<'_>, room: &PlanarSet, centre: Place, helix_mm: f64) -> WayIn {
    let cut = if helix_mm > 0.0 { PathPiece::circle(centre, helix_mm).to_vec() } else { Vec::new() };
    let approach = Approach::Helix { centre, radius_mm: helix_mm };
    WayIn {
        stroke: Stroke { approach, via: Vec::new(), lead_in: Vec::new(), cut, lead_out: Vec::new() },
        reached: PlanarSet::disc(centre, helix_mm.max(CHORD_MM)).intersection(room),
        bored: PlanarSet::disc(centre, helix_mm + area.limit.radius_mm() - ENTRY_MARGIN_MM),
    }
}

/// A ramp along a ring in a part whose widest disc has a radius of `room_mm`; `None` if it is too short.
fn ramp(area: &Area<'_>, part: &PlanarSet, room_mm: f64) -> Option<WayIn> {
    let (inset_mm, round_mm) = (RING_INSET * room_mm, RING_ROUNDED * room_mm);
    let inner = part.eroded(inset_mm + round_mm).dilated(round_mm);
    let size = |set: &PlanarSet| {
        let [x0, y0, x1, y1] = set.bounds().unwrap_or([0.0; 4]);
        (x1 - x0).max(y1 - y0)
    };
    let ring = inner.parts().into_iter().max_by(|a, b| size(a).total_cmp(&size(b)))?;
    if size(&ring) < 2.0 * area.entry.least_helix_mm {
        return None;
    }
    let contours = ring.contours();
    let mut points = contours.first()?.clone();
    points.push(*points.first()?);
    // All within a ring is no farther from it than the tool is wide; about an island it may be.
    let reached = if contours.len() == 1 {
        ring
    } else {
        let outline = PlanarSet::of_polygons(&contours[..1]);
        outline.minus(&outline.eroded(4.0 * CHORD_MM))
    };
    let bored = reached.dilated(area.limit.radius_mm() - ENTRY_MARGIN_MM);
    let cut = pieces(&without_steps(&points));
    let stroke =
        Stroke { approach: Approach::Ramp, via: Vec::new(), lead_in: Vec::new(), cut, lead_out: Vec::new() };
    Some(WayIn { stroke, reached, bored })
}

/// The middle of the largest disc in a set, about, and its radius.
fn widest(set: &PlanarSet) -> (Place, f64) {
    let [x0, y0, x1, y1] = set.bounds().unwrap_or([0.0; 4]);
    let (mut low, mut high) = (0.0, 0.5 * (x1 - x0).min(y1 - y0) + 1e-3);
    let mut centre = set.contours().first().map_or([x0, y0], |c| c[0]);
    while high - low > FITTED * high && high > 1e-3 {
        let middle = 0.5 * (low + high);
        let inner = set.eroded(middle);
        match inner.contours().first() {
            Some(contour) => {
                low = middle;
                let n = contour.len() as f64;
                let sum = contour.iter().fold([0.0, 0.0], |s, p| [s[0] + p[0], s[1] + p[1]]);
                let mean = [sum[0] / n, sum[1] / n];
                // The mean of a bent sliver may lie outside of it.
                let nearest =
                    contour.iter().min_by(|a, b| distance(**a, mean).total_cmp(&distance(**b, mean)));
                centre = *nearest.unwrap_or(&contour[0]);
            }
            None => high = middle,
        }
    }
    (centre, low)
}
