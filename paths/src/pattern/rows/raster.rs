//! Where the passes of a part run: a raster over the ball's positions that knows how close rows must be.
//!
//! The raster only decides where rows run; every location on them is computed exactly afterwards.

use std::ops::Range;

/// Rows of a part: position across and stretches along.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Row {
    /// Position across the rows, in the setup.
    pub(crate) q: f64,
    /// Stretches along the row.
    pub(crate) stretches: Vec<(f64, f64)>,
}

/// Triangle of ball positions with the row distance it asks for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Patch {
    /// Ball centres above the triangle's corners: (along, across).
    pub(crate) corners: [[f64; 2]; 3],
    /// Largest row distance that keeps the scallop height, mm.
    pub(crate) distance_mm: f64,
    /// Length of path per length along the row: `√(1 + slope²)`.
    pub(crate) stretch: f64,
}

/// Stretches closer than this along a row are cut as one: crossing costs less than lifting.
const BRIDGE_MM: f64 = 30.0;
/// Positions that lie within this share of a cell across the rows are as good as on one line: a fillet as tight as the ball
/// is touched all over from there.
const ON_LINE: f64 = 0.5;
/// So close to such a line rows run on either side, mm: on the line itself it is chance which end of the fillet carries the
/// ball.
const BESIDE_MM: f64 = 0.01;
/// Rows are refined by at most this factor where the surface asks for closer ones.
const FINEST: u32 = 16;

#[derive(Debug)]
pub(crate) struct Raster {
    cell: f64,
    origin: [f64; 2],
    /// Where all positions lie across the rows, if that is nearly on a line.
    on_line: Option<f64>,
    columns: usize,
    lines: Vec<CellLine>,
    /// Of all lines, one after the other: smallest row distance asked for; infinite where the part has no positions.
    need: Vec<f32>,
    /// The same: length of path per length along the row.
    stretch: Vec<f32>,
}

/// The cells of a raster that lie beside each other along the rows. Only those between its first and last positions are
/// kept: seen aslant, a long slender part covers little of the rectangle around it.
#[derive(Debug, Clone, Copy)]
struct CellLine {
    /// The columns that are kept: from the first to before the last.
    columns: (usize, usize),
    /// Where the first one's cell is.
    start: usize,
}

impl CellLine {
    const EMPTY: CellLine = CellLine { columns: (usize::MAX, 0), start: 0 };

    fn widen(&mut self, from: usize, to: usize) {
        self.columns = (self.columns.0.min(from), self.columns.1.max(to));
    }

    fn count(&self) -> usize {
        self.columns.1.saturating_sub(self.columns.0)
    }

    /// Where the cells of these columns are, as far as they are kept.
    fn cells(&self, from: usize, to: usize) -> Range<usize> {
        let (from, to) = (from.max(self.columns.0), to.min(self.columns.1));
        if from < to { self.start + from - self.columns.0..self.start + to - self.columns.0 } else { 0..0 }
    }
}

impl Raster {
    /// The lowest corner lies on the border of a cell, up to rounding; `inset`, a share of a cell, moves the cells down by so
    /// much that rounding does not decide which one it is in.
    pub(crate) fn new(patches: &[Patch], cell: f64, inset: f64) -> Option<Self> {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for c in patches.iter().flat_map(|p| p.corners) {
            for k in 0..2 {
                low[k] = low[k].min(c[k]);
                high[k] = high[k].max(c[k]);
            }
        }
        if patches.is_empty() {
            return None;
        }
        let origin = low.map(|v| v - cell - inset * cell);
        let count = |k: usize| ((high[k] - origin[k]) / cell).ceil() as usize + 2;
        let columns = count(0);
        let on_line = (high[1] - low[1] < ON_LINE * cell).then_some(0.5 * (low[1] + high[1]));
        let lines = vec![CellLine::EMPTY; count(1)];
        let mut raster =
            Raster { cell, origin, on_line, columns, lines, need: Vec::new(), stretch: Vec::new() };
        for p in patches {
            let [columns, lines] = raster.reach(&raster.corners(p));
            raster.lines[lines].iter_mut().for_each(|line| line.widen(columns.start, columns.end));
        }
        let mut cells = 0;
        for line in &mut raster.lines {
            line.start = cells;
            cells += line.count();
        }
        (raster.need, raster.stretch) = (vec![f32::INFINITY; cells], vec![1.0; cells]);
        for p in patches {
            raster.mark(p);
        }
        Some(raster)
    }

    /// The triangle's corners in cells.
    fn corners(&self, p: &Patch) -> [[f64; 2]; 3] {
        p.corners.map(|c| [0, 1].map(|k| (c[k] - self.origin[k]) / self.cell))
    }

    /// The columns and lines around a triangle.
    fn reach(&self, c: &[[f64; 2]; 3]) -> [Range<usize>; 2] {
        [(0, self.columns), (1, self.lines.len())].map(|(k, count)| {
            let low = c.iter().map(|v| v[k]).fold(f64::INFINITY, f64::min);
            let high = c.iter().map(|v| v[k]).fold(f64::NEG_INFINITY, f64::max);
            low.floor().max(0.0) as usize..(high.floor() as usize + 1).min(count)
        })
    }

    /// Marks every cell that the triangle touches, or nearly touches.
    fn mark(&mut self, p: &Patch) {
        let c = self.corners(p);
        let [columns, lines] = self.reach(&c);
        let (need, stretch) = (p.distance_mm as f32, p.stretch as f32);
        for j in lines {
            for (i, cell) in columns.clone().zip(self.lines[j].cells(columns.start, columns.end)) {
                if touches(&c, i as f64 + 0.5, j as f64 + 0.5) {
                    self.need[cell] = self.need[cell].min(need);
                    self.stretch[cell] = self.stretch[cell].max(stretch);
                }
            }
        }
    }

    /// The line that a position across lies on.
    fn line(&self, q: f64) -> usize {
        (((q - self.origin[1]) / self.cell).floor().max(0.0) as usize).min(self.lines.len() - 1)
    }

    /// Per column, the smallest row distance asked for between `q0` and `q1`.
    fn band(&self, q0: f64, q1: f64) -> Vec<f32> {
        let mut needs = vec![f32::INFINITY; self.columns];
        for line in &self.lines[self.line(q0)..=self.line(q1)] {
            let cells = &self.need[line.cells(0, self.columns)];
            for (need, &cell) in needs.iter_mut().skip(line.columns.0).zip(cells) {
                *need = need.min(cell);
            }
        }
        needs
    }

    /// The lines' range that holds anything, as positions across.
    fn extent(&self) -> Option<(f64, f64)> {
        let occupied = |line: &CellLine| self.need[line.cells(0, self.columns)].iter().any(|n| n.is_finite());
        let first = self.lines.iter().position(occupied)?;
        let last = self.lines.iter().rposition(occupied)?;
        let centre = |j: usize| self.origin[1] + (j as f64 + 0.5) * self.cell;
        Some((centre(first), centre(last)))
    }

    /// Number of columns across the rows.
    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    /// Middle of a column, as a position along the rows.
    pub(crate) fn middle(&self, column: usize) -> f64 {
        self.origin[0] + (column as f64 + 0.5) * self.cell
    }

    /// The middle of what the part claims of a column between two positions across, if anything.
    pub(crate) fn claimed_between(&self, column: usize, q0: f64, q1: f64) -> Option<f64> {
        let claimed = |j: &usize| {
            let cell = self.lines[*j].cells(column, column + 1);
            self.need[cell].iter().any(|need| need.is_finite())
        };
        let first = (self.line(q0)..=self.line(q1)).find(claimed)?;
        let last = (self.line(q0)..=self.line(q1)).rfind(claimed)?;
        let edge = |j: usize| self.origin[1] + j as f64 * self.cell;
        let middle = 0.5 * (edge(first).max(q0) + edge(last + 1).min(q1));
        Some(claymill_toolpath::round_to_written(middle))
    }

    /// A row over these columns (in ascending order) and one beyond on either side.
    pub(crate) fn row_over(&self, q: f64, columns: &[usize]) -> Row {
        let mut stretches: Vec<(f64, f64)> = Vec::new();
        for &i in columns {
            let (a, b) = (self.middle(i) - 1.5 * self.cell, self.middle(i) + 1.5 * self.cell);
            match stretches.last_mut() {
                Some(open) if a - open.1 <= BRIDGE_MM => open.1 = b,
                _ => stretches.push((a, b)),
            }
        }
        Row { q, stretches }
    }

    /// About how long the path over a row is, mm.
    pub(crate) fn path_mm(&self, row: &Row) -> f64 {
        let index = |v: f64| ((v - self.origin[0]) / self.cell).round().max(0.0) as usize;
        let line = self.lines[self.line(row.q)];
        let sums = row.stretches.iter().map(|&(a, b)| {
            let (from, to) = (index(a).min(self.columns), index(b).min(self.columns));
            let kept = &self.stretch[line.cells(from, to)];
            // Where there are no positions the row is level.
            kept.iter().map(|&v| f64::from(v)).sum::<f64>() + (to.max(from) - from - kept.len()) as f64
        });
        sums.sum::<f64>() * self.cell
    }

    /// Lays rows over the part: main rows at a distance chosen to waste least, and further rows between them
    /// (halving again and again) over the columns that ask for closer ones.
    pub(crate) fn rows(&self) -> Vec<Row> {
        if let Some(line) = self.on_line {
            let mut rows = Vec::new();
            let columns = self.band(line - self.cell, line + self.cell);
            for q in [line - BESIDE_MM, line + BESIDE_MM] {
                self.push(&mut rows, q, &columns, |n| n.is_finite());
            }
            return rows;
        }
        let Some((first, last)) = self.extent() else {
            return Vec::new();
        };
        let widest = f64::from(self.need.iter().filter(|n| n.is_finite()).fold(0.0f32, |a, &b| a.max(b)));
        let mut rows: Vec<Row> = Vec::new();
        let (mut q, mut before) = (first, 0.0);
        loop {
            let ahead = (last - q).min(widest);
            let needs = self.band(q, q + ahead);
            let step = if ahead <= 0.0 { 0.0 } else { cheapest_step(&needs, widest).min(last - q) };
            self.push(&mut rows, q, &self.band(q - 0.5 * before, q + 0.5 * step), |n| n.is_finite());
            // A step that rounding takes away leads nowhere.
            if step <= 0.0 || q + step == q {
                return rows;
            }
            let needs = self.band(q, q + step);
            let parts = refinement(&needs, step, (2.0 * widest / self.cell).ceil() as usize);
            let finest = parts.iter().copied().max().unwrap_or(1);
            for k in 1..finest {
                // Row k of `finest` belongs to every column whose own refinement includes it.
                let level = finest >> k.trailing_zeros();
                let at: Vec<f32> =
                    parts.iter().map(|&m| if m >= level { 1.0 } else { f32::INFINITY }).collect();
                self.push(&mut rows, q + step * f64::from(k) / f64::from(finest), &at, |n| n.is_finite());
            }
            before = step;
            q += step;
        }
    }

    fn push(&self, rows: &mut Vec<Row>, q: f64, needs: &[f32], present: impl Fn(f32) -> bool) {
        let mut stretches: Vec<(f64, f64)> = Vec::new();
        let left = |i: usize| self.origin[0] + i as f64 * self.cell;
        for (i, _) in needs.iter().enumerate().filter(|(_, n)| present(**n)) {
            match stretches.last_mut() {
                Some(open) if left(i) - open.1 <= BRIDGE_MM => open.1 = left(i + 1),
                _ => stretches.push((left(i), left(i + 1))),
            }
        }
        if !stretches.is_empty() {
            rows.push(Row { q: claymill_toolpath::round_to_written(q), stretches });
        }
    }
}

/// How many times closer than `step` the rows must be in each column: 1, 2, 4, …; 0 where the part is not.
/// A refinement is kept up over `margin` columns beyond the place that asks for it.
fn refinement(needs: &[f32], step: f64, margin: usize) -> Vec<u32> {
    let own: Vec<u32> = needs.iter().map(|&n| parts_for(n, step)).collect();
    (0..own.len())
        .map(|i| {
            if own[i] == 0 {
                return 0;
            }
            let window = i.saturating_sub(margin)..(i + margin + 1).min(own.len());
            own[window].iter().copied().max().unwrap_or(own[i])
        })
        .collect()
}

fn parts_for(need: f32, step: f64) -> u32 {
    if !need.is_finite() {
        return 0;
    }
    let ratio = (step / f64::from(need) - 1e-6).ceil().max(1.0);
    (ratio as u32).min(FINEST).next_power_of_two()
}

/// The row distance with the least path per advance: `Σ parts / step` over the columns; of equals the widest.
pub(crate) fn cheapest_step(needs: &[f32], widest: f64) -> f64 {
    let mut sorted: Vec<f32> = needs.iter().copied().filter(|n| n.is_finite()).collect();
    if sorted.is_empty() {
        return widest;
    }
    sorted.sort_by(f32::total_cmp);
    let mut best = (f64::INFINITY, widest);
    // A good step is a need that occurs, or a multiple of one that its columns then halve.
    let quantiles = (0..=20).map(|k| f64::from(sorted[(sorted.len() - 1) * k / 20]));
    let steps = quantiles.flat_map(|need| [1.0, 2.0, 4.0, 8.0].map(|m| need * m));
    for step in steps.filter(|&s| s <= widest) {
        let path: f64 = sorted.iter().map(|&n| f64::from(parts_for(n, step))).sum();
        if path / step < best.0 * 0.999 {
            best = (path / step, step);
        }
    }
    best.1
}

/// Whether a unit cell centred at `(x, y)` comes near the triangle (its circumscribed circle does).
fn touches(c: &[[f64; 2]; 3], x: f64, y: f64) -> bool {
    const REACH_SQUARED: f64 = 0.5;
    let side = |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
    let s = [side(c[0], c[1]), side(c[1], c[2]), side(c[2], c[0])];
    if s.iter().all(|&v| v >= 0.0) || s.iter().all(|&v| v <= 0.0) {
        return true;
    }
    (0..3).any(|i| {
        let (a, b) = (c[i], c[(i + 1) % 3]);
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let l2 = dx * dx + dy * dy;
        let t = if l2 > 0.0 { (((x - a[0]) * dx + (y - a[1]) * dy) / l2).clamp(0.0, 1.0) } else { 0.0 };
        (x - a[0] - t * dx).powi(2) + (y - a[1] - t * dy).powi(2) <= REACH_SQUARED
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_asks_for_no_distance_at_all_is_cut_as_fine_as_any() {
        assert_eq!([0.0, 1e-12, 0.3].map(|need| parts_for(need, 1.0)), [FINEST, FINEST, 4]);
        assert_eq!(cheapest_step(&[0.0, 1e-12, 1.0, 1.0], 1.0), 1.0);
    }

    fn rectangle(x: f64, y: f64, need: impl Fn(f64) -> f64) -> Vec<Patch> {
        let mut patches = Vec::new();
        for i in 0..(x / 10.0) as usize {
            let (a, b) = (i as f64 * 10.0, i as f64 * 10.0 + 10.0);
            let distance_mm = need(a + 5.0);
            patches.push(Patch { corners: [[a, 0.0], [b, 0.0], [b, y]], distance_mm, stretch: 1.0 });
            patches.push(Patch { corners: [[a, 0.0], [b, y], [a, y]], distance_mm, stretch: 1.0 });
        }
        patches
    }

    #[test]
    fn a_flat_rectangle_gets_equal_rows_from_side_to_side() {
        let raster = Raster::new(&rectangle(300.0, 100.0, |_| 2.8), 1.4, 0.0).unwrap();
        let rows = raster.rows();
        assert!((36..=39).contains(&rows.len()), "{} rows", rows.len());
        assert!(rows.windows(2).all(|w| w[1].q - w[0].q <= 2.8 + 1e-4));
        assert!(rows[0].q <= 0.75 && rows[rows.len() - 1].q >= 99.25);
        assert!(
            rows.iter()
                .all(|r| r.stretches.len() == 1 && r.stretches[0].0 <= 0.0 && r.stretches[0].1 >= 300.0)
        );
    }

    #[test]
    fn positions_on_a_line_get_a_row_on_either_side() {
        let on_line =
            |x: f64| Patch { corners: [[x, 7.0], [x + 9.0, 7.0], [x, 7.0]], distance_mm: 2.8, stretch: 1.0 };
        let rows = Raster::new(&[on_line(0.0), on_line(9.0)], 1.4, 0.0).unwrap().rows();
        let [left, right] = &rows[..] else { panic!("{rows:?}") };
        assert!(left.q < 7.0 && right.q > 7.0 && right.q - left.q < 0.05, "{rows:?}");
        assert!(
            rows.iter()
                .all(|r| r.stretches.len() == 1 && r.stretches[0].0 <= 0.0 && r.stretches[0].1 >= 18.0)
        );
    }

    #[test]
    fn a_steep_half_gets_further_rows_only_there() {
        let raster =
            Raster::new(&rectangle(300.0, 100.0, |x| if x < 100.0 { 1.3 } else { 2.8 }), 1.4, 0.0).unwrap();
        let rows = raster.rows();
        // At every place the rows that pass it are close enough.
        for (x, need) in [(50.0, 1.3), (250.0, 2.8)] {
            let q: Vec<f64> = rows
                .iter()
                .filter(|r| r.stretches.iter().any(|s| s.0 <= x && x <= s.1))
                .map(|r| r.q)
                .collect();
            let widest = q.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
            assert!(widest <= need + 1e-3, "at {x}: {widest}");
            assert!(q.len() as f64 <= 100.0 / need * 1.25 + 3.0, "at {x}: {} rows", q.len());
        }
    }
}
