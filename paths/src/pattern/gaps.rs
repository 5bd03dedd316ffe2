//! Rows over what the passes of a pattern leave out.
//!
//! A field may hardly change over a part of its region, as towards the end of a long arm: no level is asked for there, and
//! so no two neighbours are that could be held against the model. And a fillet as tight as the ball is touched all over from
//! one line, which the rows or levels on both sides can miss. What is claimed is therefore looked at once more.

use std::collections::BTreeSet;

use claymill_contact::Location;
use claymill_nurbs::{FaceId, Point2, Point3, Vector3};
use rayon::prelude::*;

use crate::follow::proofs::Proofs;
use crate::pattern::near::{PassIndex, Touch};
use crate::pattern::part_region::PartRegion;
use crate::pattern::rows::RowRounds;
use crate::pattern::rows::crests::PlannedPass;
use crate::pattern::together::together;
use crate::setup::context::SetupContext;

/// A place is left out where no pass cuts down to this many scallop heights: the nearest is a step-over away.
const LEFT_OUT: f64 = 2.0;
/// Less than this is not worth passes of its own, in flat step-overs squared.
const LEAST_STEPS2: f64 = 1.0;

/// Places closer together than this, in flat step-overs, are cut together.
const TOGETHER_STEPS: f64 = 3.0;

/// A triangle of the covering that is left out.
struct LeftOut {
    face: FaceId,
    triangle: usize,
    centre: Point3,
    area_mm2: f64,
}

impl SetupContext<'_> {
    /// Rows over what the laid passes leave out, if anything.
    pub(crate) fn mend(&self, laid: &[PlannedPass], ground: &PartRegion) -> (Vec<PlannedPass>, Proofs) {
        let near = PassIndex::new(laid, self.come_by_mm());
        let of_face = |&face: &FaceId| -> Vec<LeftOut> {
            let areas = self.covering.areas_mm2(face).enumerate().filter(|_| self.claims.any(face));
            let left_out = |(triangle, area_mm2)| {
                let centre = self.left_out(face, triangle, &near)?;
                Some(LeftOut { face, triangle, centre, area_mm2 })
            };
            areas.filter_map(left_out).collect()
        };
        let left_out: Vec<LeftOut> = ground.faces.par_iter().flat_map_iter(of_face).collect();
        let mut mended = (Vec::new(), Proofs::default());
        for places in together(left_out, TOGETHER_STEPS * self.flat_step_mm(), |p| p.centre) {
            let area_mm2: f64 = places.iter().map(|p| p.area_mm2).sum();
            if area_mm2 < LEAST_STEPS2 * self.flat_step_mm().powi(2) {
                continue;
            }
            let triangles: BTreeSet<(FaceId, usize)> = places.iter().map(|p| (p.face, p.triangle)).collect();
            let rounds = self.begin_rows(ground, |face, t| triangles.contains(&(face, t)));
            let Some(mut rounds) = rounds.map(RowRounds::anywhere) else { continue };
            let mut rows = Vec::new();
            while rounds.go_on() {
                mended.1 += self.lay_rows(&mut rounds, &mut rows, ground);
            }
            mended.0.extend(rows);
        }
        mended
    }

    /// Where the ball would touch the middle of a triangle of the covering, if the setup cuts it and the ball gets there,
    /// but no pass comes past.
    fn left_out(&self, face: FaceId, triangle: usize, near: &PassIndex) -> Option<Point3> {
        let assignment = &self.assignments[face][triangle];
        if !assignment.is_cut_by(self.index) {
            return None;
        }
        let mesh = &self.covering.meshes()[face];
        let [a, b, c] = mesh.triangles[triangle].map(|i| mesh.uv[i as usize].coords);
        let uv = Point2::from((a + b + c) / 3.0);
        if !self.claims.holds(face, uv) {
            return None;
        }
        let jet = self.ball.surface(face).jet(uv.x, uv.y);
        let normal = jet.normal().map(|n| n * assignment.side(self.index))?;
        if normal.z < self.least_facing || !self.slopes.hold(&jet) {
            return None;
        }
        let centre = jet.p + self.ball.end().to_middle(&normal);
        // Whichever way the passes run: what counts is where they come nearest.
        let touch = Touch { point: jet.p, normal, centre, feed: Vector3::zeros() };
        if near.is_cut(&touch, &self.ball.end(), LEFT_OUT * self.scallop_mm) {
            return None;
        }
        let touching = Location::touching(centre, normal, face, uv.into());
        (!self.ball.is_blocked_from(&touching, self.scallop_mm)).then_some(centre)
    }
}
