//! Where a tool's centre may be on a level: the region in which nothing holds the tool above it, complete.
//!
//! ```text
//!    ┌───────┬───┬─┬─┐   A tool that is wider by half the diagonal of a cell and gets down in its middle gets down with its own
//!    │  in   │ in├─┼─┤   size everywhere in the cell; one that is narrower by as much and is held up is held up everywhere.
//!    │       ├─┬─┼─┼─┤   Only other cells are divided, down to a sixteenth of the tool's radius. There the border is
//!    ├───┬───┤ │o│u│t│   bisected on the sides of the cells.
//!    └───┴───┴─┴─┴─┴─┘
//! ```
//!
//! What is wider than the smallest cell is not missed.

use claymill_contact::{BallDrop, Covering, Frame, KeptOff};
use claymill_nurbs::Model;
use claymill_toolpath::{End, Monitor, Tool};
use rayon::prelude::*;

use crate::error::{ClearingError, within};
use crate::outline::{Outline, Place, distance};
use crate::planar_set::PlanarSet;

/// Cells are not divided below this share of the tool's radius.
const SMALLEST_CELL: f64 = 1.0 / 16.0;
/// Borders on the sides of cells are known to this, mm, in a few steps; where those do not get on, by halvings.
const BORDER_MM: f64 = 2e-5;
const TOLD_STEPS: usize = 12;
const MOST_STEPS: usize = 40;
/// Where it is not found out whether the tool is kept off, the next place is so many times as far away, up to this, mm.
const PERHAPS: f64 = 32.0;
const UNKNOWN_MM: f64 = 0.05;
/// Chords of borders that cut into what is to be left by less stay, mm; they are halved so often at most.
const BOW_MM: f64 = 1e-3;
const MOST_BOWS: u32 = 4;
/// Cells are divided so often at most.
const MOST_DEPTHS: usize = 16;
/// Regions whose borders are this close on the mean are the same, mm.
const SAME_MM: f64 = 0.005;
/// Cells of a level at most.
const MOST_CELLS: usize = 4_000_000;

/// A model as a tool with an allowance sees it, ready to be asked for its levels.
#[derive(Debug)]
pub struct Reach<'a> {
    own: BallDrop<'a>,
    /// Wider and narrower tools by the depth of the cells.
    around: Vec<[Option<BallDrop<'a>>; 2]>,
    corner_mm: f64,
    allowance_mm: f64,
    /// Lower corner and side of the square that is looked at.
    low: Place,
    side_mm: f64,
}

/// A square cell by its depth and place.
#[derive(Debug, Clone, Copy)]
struct Cell {
    depth: usize,
    at: [u32; 2],
}

/// How a cell lies.
enum Standing {
    In,
    Out,
    /// A part of it may be in the region.
    Unknown,
}

/// A disc of `disc_mm` swollen by `corner_mm`: flat, bull-nosed or ball.
fn end_of(disc_mm: f64, corner_mm: f64) -> Option<Tool> {
    const LEAST_MM: f64 = 1e-6;
    let end = if corner_mm <= LEAST_MM {
        (disc_mm > LEAST_MM).then_some(End::Flat { radius_mm: disc_mm })
    } else if disc_mm <= LEAST_MM {
        Some(End::Ball { radius_mm: corner_mm })
    } else {
        Some(End::Bull { radius_mm: disc_mm + corner_mm, corner_radius_mm: corner_mm })
    };
    end.map(Tool::of)
}

/// The same end on a wider disc; a ball, which has none, stays one.
pub(crate) fn wider(tool: &Tool, mm: f64) -> Tool {
    let (radius_mm, corner_mm) = (tool.radius_mm(), tool.corner_radius_mm());
    let disc_mm = radius_mm - corner_mm;
    let wide = if disc_mm > 0.0 { end_of(disc_mm + mm, corner_mm) } else { None };
    wide.unwrap_or(*tool)
}

impl<'a> Reach<'a> {
    /// Looks at a covered model from a setup, with a tool that leaves an allowance along the normals. `within_mm` is where its centre
    /// may be: xmin, ymin, xmax, ymax of the setup.
    ///
    /// # Errors
    /// A number is no size.
    pub fn new(
        model: &Model,
        covering: &'a Covering,
        frame: &Frame,
        tool: &Tool,
        allowance_mm: f64,
        within_mm: [f64; 4],
    ) -> Result<Self, ClearingError> {
        within("allowance, mm,", allowance_mm, 0.0, 100.0)?;
        let [x0, y0, x1, y1] = within_mm;
        let wide_mm = within("width of the area, mm,", x1 - x0, 1e-3, crate::FARTHEST_MM)?;
        let high_mm = within("height of the area, mm,", y1 - y0, 1e-3, crate::FARTHEST_MM)?;
        let (radius_mm, corner_mm) = (tool.radius_mm(), tool.corner_radius_mm());
        let (disc_mm, swollen_mm) = (radius_mm - corner_mm, corner_mm + allowance_mm);
        let of = |disc_mm: f64, corner_mm: f64| {
            end_of(disc_mm, corner_mm).map(|tool| BallDrop::of_tool(model, covering, frame, &tool))
        };
        let own = of(disc_mm, swollen_mm).ok_or(ClearingError::Radius { radius_mm })?;
        let smallest_mm = SMALLEST_CELL * radius_mm;
        let depths = ((wide_mm.max(high_mm) / smallest_mm).log2().ceil().max(1.0) as usize).min(MOST_DEPTHS);
        let side_mm = smallest_mm * f64::from(1_u32 << depths);
        let around = (0..=depths)
            .map(|depth| {
                let half_mm = 0.5 * side_mm / f64::from(1_u32 << depth) * std::f64::consts::SQRT_2;
                let narrow = if disc_mm >= half_mm {
                    of(disc_mm - half_mm, swollen_mm)
                } else {
                    of(0.0, (swollen_mm - (half_mm - disc_mm)).max(0.0))
                };
                // Cells much larger than the tool are divided anyway.
                if half_mm > 8.0 * radius_mm {
                    [None, None]
                } else {
                    [of(disc_mm + half_mm, swollen_mm), narrow]
                }
            })
            .collect();
        Ok(Reach { own, around, corner_mm, allowance_mm, low: [x0, y0], side_mm })
    }

    /// Whether the tool's tip gets down to a height (setup coordinates, mm).
    #[must_use]
    pub fn is_free(&self, [x, y]: [f64; 2], z: f64) -> bool {
        self.own.is_kept_off([x, y], z + self.corner_mm) == Some(false)
    }

    /// The allowance, mm.
    #[must_use]
    pub fn allowance_mm(&self) -> f64 {
        self.allowance_mm
    }

    /// The corners of a cell, in turn.
    fn corners(&self, Cell { depth, at: [i, j] }: Cell) -> [Place; 4] {
        [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map(|at| self.at_depth(depth, at))
    }

    fn at_depth(&self, depth: usize, at: [u32; 2]) -> Place {
        let size = self.side_mm / f64::from(1_u32 << depth);
        [0, 1].map(|k| self.low[k] + size * f64::from(at[k]))
    }

    /// A corner of smallest cells.
    fn place(&self, at: [u32; 2]) -> Place {
        self.at_depth(self.around.len() - 1, at)
    }

    /// The region of a level: where the tip gets down to a height.
    ///
    /// # Errors
    /// Too many cells, or the monitor ends it.
    pub fn region(&self, z: f64, monitor: &dyn Monitor) -> Result<PlanarSet, ClearingError> {
        self.region_where(z, &|_, _| true, monitor)
    }

    /// Regions of many heights. They are nested: the higher the larger. So between two that are the same nothing is looked at.
    ///
    /// # Errors
    /// As [`Reach::region`].
    pub fn regions(&self, heights: &[f64], monitor: &dyn Monitor) -> Result<Vec<PlanarSet>, ClearingError> {
        let mut order: Vec<usize> = (0..heights.len()).collect();
        order.sort_by(|&a, &b| heights[a].total_cmp(&heights[b]).then(a.cmp(&b)));
        let sorted: Vec<f64> = order.iter().map(|&k| heights[k]).collect();
        let found = match &sorted[..] {
            [] => Vec::new(),
            [z] => vec![self.region(*z, monitor)?],
            [low, between @ .., high] => {
                let (low, high) = (self.region(*low, monitor)?, self.region(*high, monitor)?);
                let between = self.nested(between, [&low, &high], monitor)?;
                std::iter::once(low).chain(between).chain([high]).collect()
            }
        };
        let mut all = vec![PlanarSet::default(); heights.len()];
        order.into_iter().zip(found).for_each(|(k, region)| all[k] = region);
        Ok(all)
    }

    /// Regions of ascending heights between those of a lower and a higher one.
    fn nested(
        &self,
        heights: &[f64],
        [inner, outer]: [&PlanarSet; 2],
        monitor: &dyn Monitor,
    ) -> Result<Vec<PlanarSet>, ClearingError> {
        let (below, above) = heights.split_at(heights.len() / 2);
        let Some((&z, above)) = above.split_first() else { return Ok(Vec::new()) };
        let middle = self.region_between(z, [inner, outer], monitor)?;
        let (below, above) = rayon::join(
            || self.nested(below, [inner, &middle], monitor),
            || self.nested(above, [&middle, outer], monitor),
        );
        let mut all = below?;
        all.push(middle.clone());
        all.extend(above?);
        Ok(all)
    }

    /// The region of a level between those of a lower and a higher one: only what these do not agree on is looked at.
    ///
    /// # Errors
    /// As [`Reach::region`].
    pub(crate) fn region_between(
        &self,
        z: f64,
        [inner, outer]: [&PlanarSet; 2],
        monitor: &dyn Monitor,
    ) -> Result<PlanarSet, ClearingError> {
        let doubtful = outer.minus(inner).without_slivers(SAME_MM);
        if doubtful.is_empty() {
            return Ok(inner.clone());
        }
        let outline = Outline::new(&doubtful);
        let is_doubtful =
            |middle: Place, half_mm: f64| outline.contains(middle) || outline.is_within(middle, half_mm);
        Ok(inner.union(&self.region_where(z, &is_doubtful, monitor)?).simplified())
    }

    /// The part of a region in wanted cells, each by its middle and half of its diagonal.
    fn region_where(
        &self,
        z: f64,
        is_wanted: &(dyn Fn(Place, f64) -> bool + Sync),
        monitor: &dyn Monitor,
    ) -> Result<PlanarSet, ClearingError> {
        let mut cells = vec![Cell { depth: 0, at: [0, 0] }];
        let (mut polygons, mut smallest): (Vec<Vec<Place>>, Vec<[u32; 2]>) = (Vec::new(), Vec::new());
        let mut count = 0;
        while !cells.is_empty() {
            monitor.go_on()?;
            count += cells.len();
            if count > MOST_CELLS {
                return Err(ClearingError::Cells { most: MOST_CELLS });
            }
            let found: Vec<Standing> = cells.par_iter().map(|cell| self.look(*cell, z, is_wanted)).collect();
            let mut divided = Vec::new();
            for (cell, standing) in cells.iter().zip(found) {
                match standing {
                    Standing::Out => {}
                    Standing::In => polygons.push(self.corners(*cell).to_vec()),
                    Standing::Unknown if cell.depth + 1 < self.around.len() => {
                        let [i, j] = cell.at.map(|at| 2 * at);
                        let quarters = [[i, j], [i + 1, j], [i, j + 1], [i + 1, j + 1]];
                        divided.extend(quarters.map(|at| Cell { depth: cell.depth + 1, at }));
                    }
                    Standing::Unknown => smallest.push(cell.at),
                }
            }
            cells = divided;
        }
        monitor.go_on()?;
        polygons.extend(self.cut(&smallest, z));
        Ok(PlanarSet::of_disjoint(&polygons).simplified())
    }

    /// How a cell lies.
    fn look(&self, cell: Cell, z: f64, is_wanted: &(dyn Fn(Place, f64) -> bool + Sync)) -> Standing {
        let height = z + self.corner_mm;
        let [a, _, c, _] = self.corners(cell);
        let middle = [0.5 * (a[0] + c[0]), 0.5 * (a[1] + c[1])];
        if !is_wanted(middle, 0.5 * distance(a, c)) {
            return Standing::Out;
        }
        let Some([wide, narrow]) = self.around.get(cell.depth) else { return Standing::Out };
        let is_kept_off = |tool: &BallDrop| tool.is_kept_off_at_a_glance(middle, height);
        if wide.as_ref().and_then(is_kept_off) == Some(false) {
            return Standing::In;
        }
        if narrow.as_ref().and_then(is_kept_off) == Some(true) {
            return Standing::Out;
        }
        Standing::Unknown
    }

    /// The parts of smallest cells that are in the region. Corners and sides of cells are looked at once, whatever cells they are of.
    fn cut(&self, cells: &[[u32; 2]], z: f64) -> Vec<Vec<Place>> {
        let around = |[i, j]: [u32; 2]| [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
        let mut corners: Vec<[u32; 2]> = cells.iter().flat_map(|cell| around(*cell)).collect();
        corners.sort_unstable();
        corners.dedup();
        let free: Vec<bool> = corners.par_iter().map(|at| self.is_free(self.place(*at), z)).collect();
        let is_free = |at: [u32; 2]| corners.binary_search(&at).is_ok_and(|k| free[k]);
        // From the free end to the other.
        let crossed = |cell: &[u32; 2]| {
            let corners = around(*cell);
            let sides = (0..4).map(|k| [corners[k], corners[(k + 1) % 4]]).collect::<Vec<_>>();
            let ends = sides.into_iter().map(|[a, b]| (is_free(a), is_free(b), a, b));
            ends.filter(|(a, b, ..)| a != b).map(|(first, _, a, b)| if first { [a, b] } else { [b, a] })
        };
        let mut sides: Vec<[[u32; 2]; 2]> = cells.iter().flat_map(crossed).collect();
        sides.sort_unstable();
        sides.dedup();
        let border =
            |[inside, outside]: &[[u32; 2]; 2]| self.border(self.place(*inside), self.place(*outside), z);
        let borders: Vec<Place> = sides.par_iter().map(border).collect();
        let polygon = |cell: &[u32; 2]| {
            let corners = around(*cell);
            let mut polygon = Vec::new();
            // Where the polygon leaves the region, until it comes back.
            let first = corners.iter().position(|at| is_free(*at))?;
            let mut left: Option<Place> = None;
            for k in (first..first + 4).map(|k| k % 4) {
                let (at, next) = (corners[k], corners[(k + 1) % 4]);
                let (is_in, goes_on) = (is_free(at), is_free(next));
                if is_in {
                    polygon.push(self.place(at));
                }
                if is_in != goes_on {
                    let side = if is_in { [at, next] } else { [next, at] };
                    let border = borders[sides.binary_search(&side).ok()?];
                    if let Some(left) = left.take() {
                        self.bow([left, border], z, MOST_BOWS, &mut polygon);
                    } else {
                        left = Some(border);
                    }
                    polygon.push(border);
                }
            }
            (polygon.len() > 2).then_some(polygon)
        };
        cells.par_iter().filter_map(polygon).collect()
    }

    /// Points of the border between two, where the chord would cut into what is to be left. The region is on the left.
    fn bow(&self, [a, b]: [Place; 2], z: f64, halvings: u32, found: &mut Vec<Place>) {
        let long_mm = distance(a, b);
        if halvings == 0 || long_mm < 2.0 * BOW_MM {
            return;
        }
        let inward = [(a[1] - b[1]) / long_mm, (b[0] - a[0]) / long_mm];
        let at = |mm: f64| [0, 1].map(|k| 0.5 * (a[k] + b[k]) + mm * inward[k]);
        let is_free = |mm: &f64| self.is_free(at(*mm), z);
        if is_free(&BOW_MM) {
            return;
        }
        // In a slit the other wall is no farther than the border may be.
        let wider = std::iter::successors(Some(2.0 * BOW_MM), |mm| Some(2.0 * mm));
        let Some(far_mm) = wider.take_while(|mm| *mm <= 0.5 * long_mm).find(is_free) else { return };
        let border = self.border(at(far_mm), at(BOW_MM), z);
        self.bow([a, border], z, halvings - 1, found);
        found.push(border);
        self.bow([border, b], z, halvings - 1, found);
    }

    /// Where the border is between a free place and another, on the free side.
    ///
    /// What keeps the tool off says how far it has to go at least: from there on most borders are found in two steps. Beside walls,
    /// where that takes long to find out, a border is known less exactly.
    fn border(&self, inside: Place, outside: Place, z: f64) -> Place {
        let length_mm = distance(inside, outside);
        let way = [0, 1].map(|k| (inside[k] - outside[k]) / length_mm);
        let at = |mm: f64| [outside[0] + way[0] * mm, outside[1] + way[1] * mm];
        // From the outer end.
        let (mut kept_off_mm, mut free_mm, mut next_mm) = (0.0, length_mm, 0.0);
        let mut beyond_mm = 0.5 * BORDER_MM;
        for step in 0..MOST_STEPS {
            let mut is_told = false;
            match self.own.kept_off(at(next_mm), way, z + self.corner_mm) {
                KeptOff::No => free_mm = next_mm,
                KeptOff::Until { along_mm } => {
                    kept_off_mm = (next_mm + along_mm).min(free_mm);
                    is_told = along_mm > 0.0;
                }
                KeptOff::Perhaps => {
                    kept_off_mm = next_mm;
                    beyond_mm = (PERHAPS * beyond_mm).min(UNKNOWN_MM);
                    is_told = true;
                }
            }
            if free_mm - kept_off_mm <= 2.0 * beyond_mm {
                break;
            }
            next_mm = match is_told && step < TOLD_STEPS {
                true => kept_off_mm + beyond_mm,
                false => 0.5 * (kept_off_mm + free_mm),
            };
        }
        at(free_mm)
    }

    /// All around the square that is looked at, as far as this: nothing is there.
    #[must_use]
    pub(crate) fn air(&self, far_mm: f64) -> PlanarSet {
        let [x, y] = self.low;
        let inner = [x, y, x + self.side_mm, y + self.side_mm];
        let outer = [x - far_mm, y - far_mm, inner[2] + far_mm, inner[3] + far_mm];
        PlanarSet::rectangle(outer).minus(&PlanarSet::rectangle(inner))
    }

    /// The height at which the tip rests over a place; `None` where nothing is below.
    #[must_use]
    pub fn rest_mm(&self, [x, y]: [f64; 2]) -> Option<f64> {
        self.own.drop(x, y).map(|rest| rest.centre.z - self.corner_mm)
    }
}
