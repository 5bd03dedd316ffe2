//! Parallel rows over a part: planar cuts.

pub(crate) mod crests;
pub(crate) mod raster;

use claymill_nurbs::FaceId;
use rayon::prelude::*;

use crate::RowsAlong;
use crate::curve::drive::{DriveCurve, Line};
use crate::follow::profile::{STEEPEST_NZ, follow};
use crate::follow::proofs::Proofs;
use crate::pattern::end_step;
use crate::pattern::part_region::PartRegion;
use crate::pattern::rows::crests::{PlannedPass, missing_rows};
use crate::pattern::rows::raster::{Patch, Raster, Row};
use crate::pattern::step_over::row_distance_mm;
use crate::setup::context::{ROUNDS, SetupContext, TURN_MM};
use crate::setup::cuts::Cut;

/// Cells of tilted setups lie so much, as a share of one, below the lowest position.
const TILTED_INSET: f64 = 1e-4;
/// Directions that are tried for rows, this far apart.
const TURN_DEG: f64 = 15.0;

/// Rows that are still to be followed: every round adds some where the last one left too much.
pub(crate) struct RowRounds {
    pub(crate) along: RowsAlong,
    raster: Raster,
    rows: Vec<Row>,
    /// Also where the ball rests on what is not of the ground: in a fillet as tight as the ball it touches both.
    anywhere: bool,
    round: usize,
}

impl RowRounds {
    pub(crate) fn go_on(&self) -> bool {
        !self.rows.is_empty()
    }

    /// The same rows, also where the ball rests on what is not of the ground.
    pub(crate) fn anywhere(self) -> Self {
        RowRounds { anywhere: true, ..self }
    }
}

impl SetupContext<'_> {
    /// Rows over what is cut in the cheapest direction, by length of path and turns, or in the one asked for.
    fn rows(&self, cuts: &[Cut]) -> Option<(RowsAlong, Raster, Vec<Row>)> {
        let asked = self.rows_along.map(|along| vec![along]);
        let turns = (0..(180.0 / TURN_DEG) as u32).map(|k| RowsAlong::at_deg(TURN_DEG * f64::from(k)));
        // Of a huge part no more rasters than needed are kept at a time.
        let (_, along, raster, rows) = asked
            .unwrap_or_else(|| turns.collect())
            .into_par_iter()
            .filter_map(|along| {
                let raster = self.raster(&self.patches(cuts, along))?;
                let rows = raster.rows();
                let turns = rows.iter().map(|r| r.stretches.len()).sum::<usize>() as f64;
                let cost_mm = rows.iter().map(|r| raster.path_mm(r)).sum::<f64>() + TURN_MM * turns;
                Some((cost_mm, along, raster, rows))
            })
            .reduce_with(|a, b| if b.0 < a.0 { b } else { a })?;
        Some((along, raster, rows))
    }

    /// Cells of a raster that is fine enough for the step-over, mm.
    pub(crate) fn raster_mm(&self) -> f64 {
        0.5 * self.flat_step_mm()
    }

    pub(crate) fn raster(&self, patches: &[Patch]) -> Option<Raster> {
        // Coordinates in a tilted setup are rounded, and differ in the last digit from those of the same model in another one.
        let inset = if self.frame.is_tilted() { TILTED_INSET } else { 0.0 };
        Raster::new(patches, self.raster_mm(), inset)
    }

    pub(crate) fn patches(&self, cuts: &[Cut], along: RowsAlong) -> Vec<Patch> {
        let of_cut = |cut: &Cut| {
            let distance_mm = match self.ball.end() {
                end if end.is_ball() => row_distance_mm(&cut.jet, along, end.radius_mm(), self.scallop_mm)?,
                end => end_step::row_distance_mm(&cut.jet, along, &end, self.scallop_mm)?,
            };
            let (n, [ex, ey]) = (cut.jet.normal()?, along.unit());
            let slope = (n.x * ex + n.y * ey) / n.z;
            let stretch = slope.hypot(1.0).min(1.0 / STEEPEST_NZ);
            Some(Patch { corners: cut.centres.map(|c| along.place([c.x, c.y])), distance_mm, stretch })
        };
        cuts.iter().filter_map(of_cut).collect()
    }

    /// The first round of rows over those triangles of the ground (by face and number) that are to be `kept`.
    pub(crate) fn begin_rows(
        &self,
        ground: &PartRegion,
        kept: impl Fn(FaceId, usize) -> bool + Sync,
    ) -> Option<RowRounds> {
        let (along, raster, rows) = self.rows(&self.cuts(ground.faces, kept))?;
        Some(RowRounds { along, raster, rows, anywhere: false, round: 0 })
    }

    /// Follows the rows of a round, adding them to those laid so far (sorted by position), and finds where further ones
    /// are missing between them: until no crest is too high. Tells what the locations are proven by.
    pub(crate) fn lay_rows(
        &self,
        rounds: &mut RowRounds,
        laid: &mut Vec<PlannedPass>,
        ground: &PartRegion,
    ) -> Proofs {
        let along = rounds.along;
        let rows = std::mem::take(&mut rounds.rows);
        let is_own = |face: FaceId| rounds.anywhere || ground.owns(face);
        let followed: Vec<(PlannedPass, Proofs)> =
            rows.par_iter().map(|row| self.follow_row(row, along, is_own)).collect();
        laid.iter_mut().for_each(|row| row.fresh = false);
        let proofs = followed.iter().map(|f| f.1).sum();
        laid.extend(followed.into_iter().map(|f| f.0));
        laid.sort_by(|a, b| a.q.total_cmp(&b.q));
        rounds.round += 1;
        if rounds.round < ROUNDS {
            rounds.rows = missing_rows(
                self.ball,
                &rounds.raster,
                laid,
                &ground.in_valleys,
                self.too_high_mm(ground.area_mm2),
                |q| row_guide(along, q),
                |face, at| {
                    ground.owns(face)
                        && at.map_or(self.claims.any(face), |at| self.claims_at(face, at.x, at.y))
                },
            );
        }
        proofs
    }

    fn follow_row(
        &self,
        row: &Row,
        along: RowsAlong,
        is_own: impl Fn(FaceId) -> bool,
    ) -> (PlannedPass, Proofs) {
        let (drive, planned) = (row_guide(along, row.q), row.stretches.clone());
        let mut laid = PlannedPass { q: row.q, drive, planned, chains: Vec::new(), fresh: true };
        let mut proofs = Proofs::default();
        for &(s0, s1) in &row.stretches {
            let followed = follow(self.ball, &laid.drive, s0, s1);
            proofs += followed.proofs;
            laid.chains.extend(self.kept(followed.passes(self.shortest_pass_mm(), &is_own), &laid.drive));
        }
        (laid, proofs)
    }
}

/// The drive curve of a straight row.
fn row_guide(along: RowsAlong, q: f64) -> DriveCurve {
    DriveCurve::Straight(Line { origin: along.at([0.0, q]), direction: along.unit() })
}
