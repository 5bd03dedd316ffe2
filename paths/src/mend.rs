//! Rows over what a sweep leaves out.
//!
//! A field may hardly change over a part of its region, as towards the end of a long arm: no level is asked for there, and
//! so no two neighbours are that could be held against the model. What is claimed is therefore looked at once more.

use claymill_nurbs::{FaceId, Point2, Vector3};
use rayon::prelude::*;

use crate::contact::Location;
use crate::crests::Laid;
use crate::ground::Ground;
use crate::near::{LaidNear, Touch};
use crate::part::SetupContext;
use crate::proofs::Proofs;
use crate::reach::LEAST_FACING;

/// A place is left out where no pass cuts down to this many scallop heights: the nearest is a step-over away.
const LEFT_OUT: f64 = 4.0;
/// Less than this is not worth passes of its own, in flat step-overs squared.
const LEAST_STEPS2: f64 = 6.0;

impl SetupContext<'_> {
    /// Rows over what the laid passes leave out, if anything.
    pub(crate) fn mend(&self, laid: &[Laid], ground: &Ground) -> (Vec<Laid>, Proofs) {
        let near = LaidNear::new(laid, self.flat_step_mm());
        let of_face = |&face: &FaceId| -> Vec<bool> {
            let triangles = self.covering.meshes[face].triangles.len();
            if !self.claims.any(face) {
                return vec![false; triangles];
            }
            (0..triangles).map(|t| self.is_left_out(face, t, &near)).collect()
        };
        let left_out: Vec<Vec<bool>> = ground.faces.par_iter().map(of_face).collect();
        let area_mm2 = |(&face, left_out): (&FaceId, &Vec<bool>)| -> f64 {
            let areas = self.covering.areas_mm2(face).zip(left_out);
            areas.filter(|(_, left_out)| **left_out).map(|(area_mm2, _)| area_mm2).sum()
        };
        let all_mm2: f64 = ground.faces.iter().zip(&left_out).map(area_mm2).sum();
        let mut rows = (Vec::new(), Proofs::default());
        if all_mm2 < LEAST_STEPS2 * self.flat_step_mm().powi(2) {
            return rows;
        }
        let is_left =
            |face: FaceId, t: usize| ground.faces.binary_search(&face).is_ok_and(|k| left_out[k][t]);
        let Some(mut rounds) = self.begin_rows(ground, is_left) else { return rows };
        while rounds.go_on() {
            rows.1 += self.lay_rows(&mut rounds, &mut rows.0, ground);
        }
        rows
    }

    /// Whether the setup cuts a triangle of the covering, but no pass comes past its middle, though the ball gets there.
    fn is_left_out(&self, face: FaceId, triangle: usize, near: &LaidNear) -> bool {
        let fate = &self.fates[face][triangle];
        if !fate.is_cut_by(self.index) {
            return false;
        }
        let mesh = &self.covering.meshes[face];
        let [a, b, c] = mesh.triangles[triangle].map(|i| mesh.uv[i as usize].coords);
        let uv = Point2::from((a + b + c) / 3.0);
        let jet = self.ball.surface(face).jet(uv.x, uv.y);
        let Some(normal) = jet.normal().map(|n| n * fate.side(self.index)) else { return false };
        if normal.z < LEAST_FACING || !self.slopes.hold(&jet) {
            return false;
        }
        let centre = jet.p + normal * self.ball.radius_mm();
        // Whichever way the passes run: what counts is where they come nearest.
        let touch = Touch { point: jet.p, normal, centre, feed: Vector3::zeros() };
        let reached = || {
            let touching = Location::touching(centre, normal, face, uv.into());
            !self.ball.is_held_from(&touching, self.scallop_mm)
        };
        !near.is_cut(&touch, self.ball.radius_mm(), LEFT_OUT * self.scallop_mm) && reached()
    }
}
