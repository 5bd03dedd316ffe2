//! Flat and bull-nosed ends: their distance from the exact faces, and what they leave where they sweep past.
//!
//! ```text
//!      │        │      the distance of a point from the tool is a convex function, and a closed one: no closest point
//!      │        │      of a ball's centre says where such an end touches
//!      ╰╮      ╭╯
//!       ╰──────╯ ·  p
//! ```
//!
//! Balls are measured elsewhere, by the closest point to their centre. Nothing here is shared with the planner, which knows
//! heights of the tip, while here distances are asked for.

pub(crate) mod body;
pub(crate) mod contact;
pub(crate) mod crest;
mod edges;
pub(crate) mod faces;
mod flats;
mod lowered;
pub(crate) mod sweep;

pub(crate) use body::EndBody;
pub(crate) use faces::EndFaces;

use claymill_toolpath::Job;

use crate::VerifyError;
use crate::track::Track;

/// Whether what is asked of the tracks of ends can be measured.
///
/// # Errors
/// It is measured of balls only.
pub(crate) fn check_alone(tracks: &[Track], job: &Job, has_obstacles: bool) -> Result<(), VerifyError> {
    let Some(track) = tracks.iter().find(|track| track.end.is_some()) else { return Ok(()) };
    let leans = |track: &Track| {
        let (from, to) = track.domain();
        track.end.is_some() && (track.axis_at(from) - track.axis_at(to)).norm() > STILL
    };
    // Of levels it is measured whether the tool's axis stays in its box.
    let bounds = &job.request.bounds;
    let is_bound_by_axis =
        bounds.is_none() || (job.request.levels.is_some() && bounds.is_centre_box_at_most());
    let refused = [
        (has_obstacles, "obstacles are kept clear of by moves"),
        (!is_bound_by_axis, "bounds are kept by moves"),
        (tracks.iter().any(leans), "the axis turns along moves"),
        (job.request.rest_of.is_some(), "what an earlier tool left is cut by moves"),
    ];
    match refused.into_iter().find(|(asked, _)| *asked) {
        Some((_, what)) => Err(VerifyError::End { tool: job.tools[track.tool].tool.to_string(), what }),
        None => Ok(()),
    }
}

/// Axes that differ by less are one.
const STILL: f64 = 1e-9;
