//! The smallest clearance of ball and shank on rapids, by branch and bound along their polygons.

use claymill_nurbs::{FaceMesh, Point3};
use claymill_toolpath::{Cancelled, MoveKind};
use rayon::prelude::*;

use crate::drop::DropMesh;
use crate::end::EndBody;
use crate::holder;
use crate::reach::Reach;
use crate::report::{Place, Rapids};
use crate::scene::{Scene, Stage};
use crate::track::Track;

/// The smallest clearance along a rapid is located to this distance across the axis, mm.
const LOCATED_MM: f64 = 0.25;
/// Clearances that differ by less are not told apart, mm.
const SAME_CLEARANCE_MM: f64 = 0.01;
/// Where the ball has nothing below it, clearances of the shank beyond this are not measured, mm.
const FAR_MM: f64 = 1000.0;

/// Measures how far the tool could be lowered along its axis anywhere on the rapids before ball or shank
/// touch. Branch and bound: a stretch whose lowest tip is above the highest point of the model beside it needs
/// no closer look than that.
pub(crate) fn measure(
    scene: &Scene<'_>,
    meshes: &[Option<FaceMesh>],
    reach: &Reach<'_>,
    stage: &Stage<'_>,
) -> Result<Rapids, Cancelled> {
    let rapids: Vec<&Track> = scene.tracks.iter().filter(|t| t.kind == MoveKind::Rapid).collect();
    let look = |track: &&Track| {
        let mut search = Search {
            scene,
            view: reach.setup(track.setup),
            radius: track.radius_mm,
            end: track.end,
            least: None,
        };
        // Rapids are straight or nearly so: a coarse polygon is as good as the curve at this scale.
        let corners: Vec<Point3> =
            track.polygon(SAME_CLEARANCE_MM).into_iter().map(|t| track.centre(t).0).collect();
        for ends in corners.windows(2) {
            search.stretch(&ends[0], &ends[1]);
        }
        let by_ball = search.least.map(|(clearance, at)| {
            let place = Place { move_seq: Some(track.seq), ..scene.place(at, None) };
            (clearance, place)
        });
        let known_mm = by_ball.as_ref().map_or(FAR_MM, |(clearance, _)| *clearance);
        holder::clearance_of_sides(scene, meshes, reach, track, known_mm).or(by_ball)
    };
    let lowest: Vec<Option<(f64, Place)>> =
        rapids.par_iter().map(|track| stage.part(rapids.len(), || look(track))).collect::<Result<_, _>>()?;
    let touching = lowest.iter().flatten().filter(|l| l.0 <= 0.0).count() as u64;
    let least = lowest.into_iter().flatten().reduce(|a, b| if b.0 < a.0 { b } else { a });
    Ok(Rapids {
        moves: rapids.len() as u64,
        clearance_min_mm: least.as_ref().map(|l| l.0),
        clearance_min_at: least.map(|l| l.1),
        touching,
    })
}

struct Search<'a> {
    scene: &'a Scene<'a>,
    view: &'a DropMesh<'a>,
    radius: f64,
    /// The end, if it is no ball.
    end: Option<EndBody>,
    /// Smallest clearance so far and the ball's centre there.
    least: Option<(f64, Point3)>,
}

impl Search<'_> {
    /// Looks at the straight piece between two ball centres.
    fn stretch(&mut self, a: &Point3, b: &Point3) {
        self.look(a);
        self.look(b);
        self.divide(a, b);
    }

    fn divide(&mut self, a: &Point3, b: &Point3) {
        let (p, q) = (self.view.in_frame(a), self.view.in_frame(b));
        if (q - p).xy().norm() < LOCATED_MM {
            return;
        }
        let Some(top) = self.view.top_along(&p, &q, self.radius + self.view.worst_deviation_mm()) else {
            return;
        };
        let tip_mm = self.end.map_or(self.radius, |end| end.corner_mm);
        let bound = p.z.min(q.z) - tip_mm - top - self.view.worst_deviation_mm();
        if self.least.is_some_and(|(least, _)| bound > least - SAME_CLEARANCE_MM) {
            return;
        }
        let middle = nalgebra::center(a, b);
        self.look(&middle);
        self.divide(a, &middle);
        self.divide(&middle, b);
    }

    fn look(&mut self, centre: &Point3) {
        if let Some(clearance) = self.clearance(centre)
            && self.least.is_none_or(|(least, _)| clearance < least)
        {
            self.least = Some((clearance, *centre));
        }
    }

    /// How far the tool can be lowered here, on the safe side by the mesh's deviation; next to steep walls,
    /// where that says nothing, the exact distance of the ball from the faces.
    fn clearance(&self, centre: &Point3) -> Option<f64> {
        let c = self.view.in_frame(centre);
        if let Some(end) = self.end {
            return Some(c.z - end.corner_mm - self.view.highest_tip(&c, &end)?);
        }
        let lowered = c.z - self.view.highest(&c, self.radius)?;
        if lowered > 0.0 || self.view.blocks(&c, self.radius) {
            return Some(lowered);
        }
        let within = self.radius + 2.0 * self.view.worst_deviation_mm() + SAME_CLEARANCE_MM;
        let foot = self.scene.closest.closest(centre, within);
        Some(foot.map_or(within, |f| f.distance_mm) - self.radius)
    }
}
