//! Parallel rows over a part: planar cuts.

use claymill_nurbs::{Point2, Point3};
use rayon::prelude::*;

use crate::RowsAlong;
use crate::crests::{Laid, missing_rows};
use crate::guide::{Guide, Line};
use crate::part::{ROUNDS, SetupContext, TOO_HIGH, TURN_MM};
use crate::profile::follow;
use crate::raster::{Patch, Raster, Row};
use crate::step_over::row_distance_mm;

impl SetupContext<'_> {
    /// Rows over the part in the cheaper of the two directions.
    pub(crate) fn rows(&self, faces: &[usize]) -> Option<(RowsAlong, Raster, Vec<Row>)> {
        let cell = (0.5 * crate::step_over::flat_mm(self.stock.radius_mm(), self.scallop_mm)).clamp(0.3, 3.0);
        [RowsAlong::X, RowsAlong::Y]
            .into_par_iter()
            .filter_map(|along| {
                let patches = self.patches(faces, along);
                let raster = Raster::new(&patches, cell)?;
                let rows = raster.rows();
                let cost: f64 = rows.iter().flat_map(|r| &r.stretches).map(|(a, b)| b - a + TURN_MM).sum();
                Some((cost, along, raster, rows))
            })
            .collect::<Vec<_>>()
            .into_iter()
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, along, raster, rows)| (along, raster, rows))
    }

    fn patches(&self, faces: &[usize], along: RowsAlong) -> Vec<Patch> {
        let r = self.stock.radius_mm();
        let pick = |p: &Point3| {
            if along == RowsAlong::X { [p.x, p.y] } else { [p.y, p.x] }
        };
        let mut patches = Vec::new();
        for &face in faces {
            let mesh = &self.flat.meshes[face];
            let surface = self.stock.surface(face);
            // Centre of the ball that touches the surface's upper side at these parameters.
            let centre = |uv: Point2| {
                let (n, _) = surface.normal(uv.x, uv.y)?;
                Some(surface.point(uv.x, uv.y) + n * (r * if n.z < 0.0 { -1.0 } else { 1.0 }))
            };
            for (t, fate) in mesh.triangles.iter().zip(&self.fates[face]) {
                if fate.setups & (1 << self.index) == 0 {
                    continue;
                }
                let uv = t.map(|i| mesh.uv[i as usize]);
                let Some(c) = uv.map(centre).into_iter().collect::<Option<Vec<_>>>() else {
                    continue;
                };
                let middle = (uv[0].coords + uv[1].coords + uv[2].coords) / 3.0;
                let jet = surface.jet(middle.x, middle.y);
                let Some(distance_mm) = row_distance_mm(&jet, along, r, self.scallop_mm) else {
                    continue;
                };
                patches.push(Patch { corners: [pick(&c[0]), pick(&c[1]), pick(&c[2])], distance_mm });
            }
        }
        patches
    }

    /// Follows the rows, and further ones between them until no crest is too high; sorted by position. Also
    /// tells how many locations rest on a proven bound.
    pub(crate) fn lay_rows(&self, raster: &Raster, rows: Vec<Row>, along: RowsAlong) -> (Vec<Laid>, u64) {
        let mut laid: Vec<Laid> = Vec::new();
        let mut lifted = 0;
        let mut rows = rows;
        for _ in 0..ROUNDS {
            let followed: Vec<(Laid, u64)> = rows.par_iter().map(|row| self.follow_row(row, along)).collect();
            laid.iter_mut().for_each(|row| row.fresh = false);
            lifted += followed.iter().map(|f| f.1).sum::<u64>();
            laid.extend(followed.into_iter().map(|f| f.0).filter(|row| !row.chains.is_empty()));
            laid.sort_by(|a, b| a.q.total_cmp(&b.q));
            rows = missing_rows(
                self.stock,
                raster,
                &laid,
                TOO_HIGH * self.scallop_mm,
                |q| row_guide(along, q),
                |face, at| at.map_or(self.claims.any(face), |at| self.claims.holds(face, at)),
            );
            if rows.is_empty() {
                break;
            }
        }
        (laid, lifted)
    }

    fn follow_row(&self, row: &Row, along: RowsAlong) -> (Laid, u64) {
        let mut laid = Laid { q: row.q, guide: row_guide(along, row.q), chains: Vec::new(), fresh: true };
        let mut lifted = 0;
        for &(s0, s1) in &row.stretches {
            let followed = follow(self.stock, &laid.guide, s0, s1);
            lifted += followed.lifted;
            laid.chains.extend(followed.passes());
        }
        (laid, lifted)
    }
}

/// The guide of a straight row.
fn row_guide(along: RowsAlong, q: f64) -> Guide {
    Guide::Straight(match along {
        RowsAlong::X => Line { origin: [0.0, q], direction: [1.0, 0.0] },
        RowsAlong::Y => Line { origin: [q, 0.0], direction: [0.0, 1.0] },
    })
}
