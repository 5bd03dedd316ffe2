//! What a corner leaves of a level where the levels above it count as much cut as the tool is wide.
//!
//! ```text
//!     ╲              ╱     At the height h above its tip a tool with a corner of radius c is no wider than
//!      ╲    ╱╲      ╱      r(h) = R − c + √(c² − (c − h)²). Between two passes whose discs R meet, a ridge stays
//!       ╲__╱  ╲____╱       that is no higher than c. A level above runs over it, and cuts it on its way.
//!        F      F
//! ```
//!
//! At a height, stock is what no disc `r` about the places of the lower tips holds. Grown by the tool of a level at that
//! height, it is where the centre meets it.

use claymill_toolpath::Tool;

use crate::planar_set::PlanarSet;
use crate::stairs::{Level, disc_mm};

/// Heights at which ridges are looked at are this far apart, mm.
const SLICE_MM: f64 = 1.0;
/// There are no more of them: ridges of large balls are high.
const MOST_SLICES: f64 = 4.0;
/// Links are lifted over lower ridges, mm.
const LOWEST_MM: f64 = 0.2;
/// Ridges that are thinner than twice this are noise of borders, mm.
const HAIR_MM: f64 = 0.05;

/// Where the centre of a tool was on a level.
pub(crate) struct Swept {
    pub(crate) z: f64,
    pub(crate) centres: PlanarSet,
}

/// Where the centre meets what levels below have left, if it moves on a level. What the level itself cuts is not taken off.
pub(crate) fn ridges(tool: &Tool, level: &Level, below: &[Swept]) -> PlanarSet {
    let last = below.iter().map(|swept| swept.z).fold(f64::NEG_INFINITY, f64::max);
    let (step_mm, deep_mm) = (level.z - last, level.above - level.z);
    // Above the slab other levels have cut.
    let high_mm = (tool.corner_radius_mm() - step_mm).min(deep_mm);
    if level.taken.is_empty() || !step_mm.is_finite() || high_mm < LOWEST_MM {
        return PlanarSet::default();
    }
    let width_mm = |up_mm: f64| disc_mm(tool, up_mm);
    let taken = level.taken.minus(&level.stock);
    let count = (high_mm / SLICE_MM).ceil().min(MOST_SLICES);
    let slice_mm = high_mm / count;
    // Along a wall the level may be this much wider than the one below, and has nothing to cut there.
    let beside_mm = width_mm(step_mm + deep_mm) - width_mm(deep_mm);
    let met = |k: usize| {
        let up_mm = (k as f64 + 0.5) * slice_mm;
        let cut = below.iter().fold(PlanarSet::default(), |cut, swept| {
            cut.union(&swept.centres.dilated(width_mm(level.z + up_mm - swept.z)))
        });
        let grown_mm = width_mm(up_mm + 0.5 * slice_mm).min(width_mm(up_mm + step_mm) - beside_mm - HAIR_MM);
        taken.minus(&cut).eroded(HAIR_MM).dilated(HAIR_MM + grown_mm)
    };
    let met = (0..count as usize).fold(PlanarSet::default(), |all, k| all.union(&met(k)));
    met.intersection(&level.feasible)
}

#[cfg(test)]
mod tests {
    use claymill_contact::Frame;
    use claymill_toolpath::{Move, MoveKind};

    use super::*;
    use crate::area::{Area, clear_rooms};
    use crate::engagement::EngagementLimit;
    use crate::entry::Entry;
    use crate::moves::{LevelFeeds, level_moves};
    use crate::order::Beside;

    const RADIUS_MM: f64 = 6.0;
    const CORNER_MM: f64 = 3.0;
    /// Half of what is between two parts of the level at 0 mm.
    const APART_MM: f64 = 5.75;
    const STAIR_MM: f64 = 0.75;
    const ABOVE_MM: f64 = 6.0;
    const CELL_MM: f64 = 0.25;
    const HALF_MM: [f64; 2] = [3.0, 26.0];

    /// Height of the tool over its tip, so far from its axis.
    fn height_mm(off_mm: f64) -> f64 {
        let beside_mm = (off_mm - (RADIUS_MM - CORNER_MM)).max(0.0);
        CORNER_MM - (CORNER_MM.powi(2) - beside_mm.powi(2)).max(0.0).sqrt()
    }

    /// Heights of stock, mm.
    struct Heights(Vec<(f64, [f64; 2])>);

    impl Heights {
        /// What the level at 0 mm has left about its two parts, and blocks.
        fn after(sides: [[f64; 4]; 2], blocks: &[[f64; 4]]) -> Self {
            let off_mm = |[x, y]: [f64; 2], [x0, y0, x1, y1]: &[f64; 4]| {
                (x0 - x).max(x - x1).max(0.0).hypot((y0 - y).max(y - y1).max(0.0))
            };
            let height = |p: [f64; 2]| {
                let nearest_mm = off_mm(p, &sides[0]).min(off_mm(p, &sides[1]));
                let is_block = blocks.iter().any(|b| off_mm(p, b) <= 0.0);
                if is_block || nearest_mm > RADIUS_MM { ABOVE_MM } else { height_mm(nearest_mm) }
            };
            let [columns, rows] = HALF_MM.map(|half| (2.0 * half / CELL_MM) as usize);
            let all = (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j)));
            let place =
                |(i, j)| [i as f64 * CELL_MM - HALF_MM[0], j as f64 * CELL_MM - HALF_MM[1]].map(|c| c + 0.1);
            Heights(all.map(place).map(|p| (height(p), p)).collect())
        }

        /// Takes away what a move sweeps, and finds how high that was.
        fn cut(&mut self, m: &Move) -> f64 {
            let (curve, [dx, dy, dz]) = (m.curve().unwrap(), (m.end() - m.start()).into());
            let (from, to) = curve.domain();
            let count = (2.0 * f64::hypot(dx, dy).hypot(dz) / CELL_MM).ceil().max(20.0);
            let before = self.0.clone();
            for k in 0..=count as u32 {
                let tip = curve.point(from + (to - from) * f64::from(k) / count);
                for (height, [x, y]) in &mut self.0 {
                    let off_mm = (*x - tip.x).hypot(*y - tip.y);
                    if off_mm < RADIUS_MM {
                        *height = height.min(tip.z + height_mm(off_mm));
                    }
                }
            }
            before.iter().zip(&self.0).map(|(before, after)| before.0 - after.0).fold(0.0, f64::max)
        }
    }

    /// The most that links, and ways straight down, run into, mm.
    fn most_in_the_way_mm(with_ridges: bool) -> f64 {
        let tool: Tool = "bull:6:3".parse().unwrap();
        let sides = [[-40.0, -20.0, -APART_MM, 20.0], [APART_MM, -20.0, 40.0, 20.0]];
        let blocks = [[-34.0, 14.0, -14.0, 26.0], [14.0, 16.0, 34.0, 26.0]];
        let joined = |all: &[[f64; 4]]| {
            all.iter().fold(PlanarSet::default(), |set, b| set.union(&PlanarSet::rectangle(*b)))
        };
        let stock = joined(&blocks);
        let level = Level {
            z: STAIR_MM,
            above: ABOVE_MM,
            disc_mm: RADIUS_MM,
            feasible: PlanarSet::rectangle([-40.0, -20.0, 40.0, 20.0]),
            taken: joined(&sides).dilated(RADIUS_MM).minus(&stock),
            stock,
            ridges: PlanarSet::default(),
            is_stair: true,
        };
        let below = [Swept { z: 0.0, centres: joined(&sides) }];
        let met = if with_ridges { ridges(&tool, &level, &below) } else { PlanarSet::default() };
        let limit = EngagementLimit::new(RADIUS_MM, 60.0).unwrap();
        let entry = Entry::usual(RADIUS_MM);
        let area = Area { feasible: &level.feasible, stock: &level.stock, limit, entry };
        let beside = Beside { ridges: &met, doubtful: &PlanarSet::default() };
        let cleared = clear_rooms(&area, beside, &()).unwrap();
        let [top, ..] = Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap();
        let feeds =
            LevelFeeds { cut_mm_per_min: 1e3, lead_mm_per_min: 500.0, rapid_mm_per_min: 1e4, ramp_deg: 3.0 };
        let moves = level_moves(&cleared.strokes, [STAIR_MM, ABOVE_MM, 10.0], &top, feeds).unwrap();
        // A lead-in follows a link or a rapid.
        let is_order = |w: &[Move]| (w[0].kind, w[1].kind) != (MoveKind::Cut, MoveKind::LeadIn);
        assert!(moves.windows(2).all(is_order));
        let mut heights = Heights::after(sides, &blocks);
        let mut most_mm = 0.0_f64;
        for m in &moves {
            let cut_mm = heights.cut(m);
            let goes_down = m.kind == MoveKind::LeadIn && m.end().z < m.start().z;
            if goes_down || matches!(m.kind, MoveKind::Link | MoveKind::Rapid) {
                most_mm = most_mm.max(cut_mm);
            }
        }
        most_mm
    }

    #[test]
    fn links_do_not_run_into_the_ridge_between_two_sides() {
        let (before_mm, mm) = (most_in_the_way_mm(false), most_in_the_way_mm(true));
        assert!(before_mm > 0.5, "{before_mm}");
        assert!(mm < 0.05, "{mm}");
    }

    /// The tool is as wide above as below, and passes beside a wall on both levels.
    #[test]
    fn a_wall_has_no_ridges() {
        let tool: Tool = "bull:6:3".parse().unwrap();
        let region = PlanarSet::rectangle([0.0, 0.0, 40.0, 30.0]);
        let level = Level {
            z: STAIR_MM,
            above: ABOVE_MM,
            disc_mm: RADIUS_MM,
            feasible: region.clone(),
            taken: region.dilated(RADIUS_MM),
            stock: PlanarSet::default(),
            ridges: PlanarSet::default(),
            is_stair: true,
        };
        assert!(ridges(&tool, &level, &[Swept { z: 0.0, centres: region }]).is_empty());
    }
}
