//! Leads no longer than stock asks: the rapid down goes on to a clearance above what stands there before the operation.
//!
//! ```text
//!            │ rapid            │ rapid       How much stock may stand above the surface is one number for all places. Most of
//!     ─ ─ ─ ─│─ ─ may stand ─ ─ │ ─ ─ ─       it is gone once a model has been roughed, and a lead is slow.
//!            ┆ lead             │
//!            ┆                  ┆ lead
//!     ▒▒▒▒▒▒▒┆▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒┆▒▒▒▒▒▒       before, and with the stock known
//! ```

use claymill_nurbs::{Point3, Vector3};
use claymill_stock::{Family, HeightMap, Upwards};
use claymill_toolpath::{Move, MoveKind, round_to_written};
use rayon::prelude::*;

use crate::plan::options::InProcess;
use crate::setup::context::SetupContext;

/// Leads that would become shorter by less are left as they are, mm.
const WORTH_MM: f64 = 1.0;
/// A lead that goes no further aside is upright, mm.
const UPRIGHT_MM: f64 = 1e-6;

/// How high stock stands before an operation, along the axis of a setup.
pub(crate) struct Standing {
    map: HeightMap,
    radius_mm: f64,
    corner_mm: f64,
    /// No part of the tool is wider.
    widest_mm: f64,
    /// Tips of the tool are this far above those of the plan, along the axis, mm.
    raised_mm: f64,
}

impl Standing {
    /// `None` where the tool is not along an axis of the model.
    pub(crate) fn of(in_process: &InProcess, axis: Vector3) -> Option<Self> {
        let InProcess { stock, tool, allowance_mm, .. } = in_process;
        let family = Family::ALL.into_iter().find(|family| axis[family.index()].abs() == 1.0)?;
        let up = Upwards { family, is_reversed: axis[family.index()] < 0.0 };
        Some(Standing {
            map: stock.height_map(up, 1),
            radius_mm: tool.radius_mm(),
            corner_mm: tool.corner_radius_mm(),
            widest_mm: tool.widest_mm(),
            raised_mm: *allowance_mm,
        })
    }

    /// The least height of a tip of the plan over a place at which the tool is above all stock, minus infinity over nothing, mm.
    fn tip_mm(&self, p: &Point3) -> f64 {
        let [a, b] = self.map.up.family.across();
        let at = [p[a], p[b]];
        // From anywhere in a cell to its middle.
        let half_mm = std::f64::consts::FRAC_1_SQRT_2 * self.map.cell_mm;
        let reach_mm = self.widest_mm + half_mm;
        let over = |([x, y], height_mm): ([f64; 2], f64)| {
            let aside_mm = ((x - at[0]).hypot(y - at[1]) - half_mm).max(0.0);
            if aside_mm < self.widest_mm { height_mm - self.rise_mm(aside_mm) } else { f64::NEG_INFINITY }
        };
        let cells = self.map.cells_in(at.map(|c| c - reach_mm), at.map(|c| c + reach_mm));
        cells.map(over).fold(f64::NEG_INFINITY, f64::max) - self.raised_mm
    }

    /// How far the end of the tool is above its tip at a distance from the axis, mm: beyond its corner, no less.
    fn rise_mm(&self, aside_mm: f64) -> f64 {
        let on_corner_mm = (aside_mm - (self.radius_mm - self.corner_mm)).clamp(0.0, self.corner_mm);
        self.corner_mm - (self.corner_mm * self.corner_mm - on_corner_mm * on_corner_mm).sqrt()
    }
}

impl SetupContext<'_> {
    /// Lets rapids up and down end nearer to their passes, where stock and model allow it. The moves are those of this setup.
    pub(crate) fn shorten_leads(&self, moves: &mut [Move], standing: &Standing) {
        let clear = SetupContext { stock: None, ..*self };
        let ends: Vec<(usize, Point3)> = (0..moves.len().saturating_sub(1))
            .into_par_iter()
            .filter_map(|k| {
                let [first, second] = [&moves[k], &moves[k + 1]];
                let lead = match (first.kind, second.kind) {
                    (MoveKind::Rapid, MoveKind::LeadIn) => second,
                    (MoveKind::LeadOut, MoveKind::Rapid) => first,
                    _ => return None,
                };
                let ends = |m: &Move| -> Option<[Point3; 2]> {
                    let [from, to] = m.points[..] else { return None };
                    Some([from, to].map(|p| self.frame.to_setup(&Point3::from(p))))
                };
                let is_upright = |[from, to]: &[Point3; 2]| (to - from).xy().norm() <= UPRIGHT_MM;
                if ![first, second].iter().all(|m| ends(m).as_ref().is_some_and(is_upright)) {
                    return None;
                }
                let [from, to] = ends(lead)?;
                let (foot, place) = if from.z < to.z { (from, to) } else { (to, from) };
                let over_stock_mm = standing.tip_mm(&self.frame.to_model(&foot)) + self.clearance_mm;
                let height_mm = round_to_written(clear.clear_height(&foot).max(over_stock_mm));
                let end = self.frame.to_model(&Point3::new(place.x, place.y, height_mm));
                (height_mm < place.z - WORTH_MM).then_some((k, end))
            })
            .collect();
        for (k, end) in ends {
            moves[k] = straight(&moves[k], moves[k].points[0].into(), end);
            moves[k + 1] = straight(&moves[k + 1], end, moves[k + 1].points[1].into());
        }
    }
}

/// A straight move with other ends.
fn straight(m: &Move, from: Point3, to: Point3) -> Move {
    let Move { knots, points, .. } = Move::straight(m.kind, from, to, m.axis_start.into(), m.feed);
    Move { knots, points, ..m.clone() }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use claymill_nurbs::Aabb;
    use claymill_stock::Stock;

    use super::*;

    /// Beside a block 10 mm high a ball stands lower by as much as its end is round, and no lower; a flat end as high as the block.
    #[test]
    fn a_tip_is_above_what_is_below_the_tool() {
        let bounds = Aabb { min: Point3::origin(), max: Point3::new(40.0, 40.0, 10.0) };
        let stock = Arc::new(Stock::block(&bounds, 0.25).unwrap());
        let standing = |tool: &str, axis: Vector3| {
            let tool = tool.parse().unwrap();
            Standing::of(&InProcess { stock: stock.clone(), tool, holder: None, allowance_mm: 0.0 }, axis)
                .unwrap()
        };
        let (ball, flat) = (standing("ball:5", Vector3::z()), standing("flat:5", Vector3::z()));
        for aside in [0.0, 2.0, 4.0, 4.8] {
            let p = Point3::new(-aside, 20.0, 0.0);
            let exact = 10.0 - (5.0 - (25.0_f64 - aside * aside).sqrt());
            let lower = f64::max(aside - 0.5, 0.0);
            let most = 10.0 - (5.0 - (25.0 - lower * lower).sqrt());
            assert!((exact..=most + 1e-3).contains(&ball.tip_mm(&p)), "{aside}: {}", ball.tip_mm(&p));
            assert!((flat.tip_mm(&p) - 10.0).abs() < 1e-3);
        }
        assert!(ball.tip_mm(&Point3::new(-5.6, 20.0, 0.0)) == f64::NEG_INFINITY);
        // From the other side its lower end is 0 mm high, and along x the block is 40 mm long.
        let below = standing("flat:5", -Vector3::z()).tip_mm(&Point3::new(20.0, 20.0, 0.0));
        let along_x = standing("flat:5", Vector3::x()).tip_mm(&Point3::new(0.0, 20.0, 5.0));
        assert!(below.abs() < 1e-3 && (along_x - 40.0).abs() < 1e-3, "{below}, {along_x}");
        // A shank that is wider than the end counts as low as the end is round.
        let shank = standing("ball:5,length:20,shank:14", Vector3::z()).tip_mm(&Point3::new(-6.0, 20.0, 0.0));
        assert!((shank - 5.0).abs() < 1e-3, "{shank}");
        let tilted = Vector3::new(0.6, 0.0, 0.8);
        let tool = "ball:5".parse().unwrap();
        assert!(Standing::of(&InProcess { stock, tool, holder: None, allowance_mm: 0.0 }, tilted).is_none());
    }
}
