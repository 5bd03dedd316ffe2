//! A coarse height map of a setup: upper bounds of all faces, cell by cell, by which rapids are
//! proven to run above the model.

use claymill_contact::BallDrop;

/// A coarse map of the model's height in a setup: proves that a rapid runs above everything.
#[derive(Debug)]
pub(crate) struct Heights {
    origin: [f64; 2],
    cell_mm: f64,
    columns: usize,
    lines: usize,
    top: Vec<f64>,
    highest: f64,
}

/// Size of a cell, mm.
const CELL_MM: f64 = 10.0;
/// Cells at most: over more than 2000 m² they are larger.
const MOST_CELLS: f64 = 2e7;

impl Heights {
    /// Each cell holds an upper bound of all faces over it (their covering triangles and edge pieces with
    /// their deviation).
    pub(crate) fn new(ball: &BallDrop) -> Self {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 3];
        ball.for_each_box(|b| {
            for k in 0..2 {
                low[k] = low[k].min(b.min[k]);
            }
            for k in 0..3 {
                high[k] = high[k].max(b.max[k]);
            }
        });
        if !low[0].is_finite() {
            return Heights {
                origin: [0.0; 2],
                cell_mm: CELL_MM,
                columns: 0,
                lines: 0,
                top: Vec::new(),
                highest: 0.0,
            };
        }
        let size = |k: usize| high[k] - low[k];
        let cell_mm =
            CELL_MM.max((size(0) * size(1) / MOST_CELLS).sqrt()).max(size(0).max(size(1)) / MOST_CELLS);
        // Cells lie where they lie whatever the model ends at: a change at one end moves none at the other.
        let origin = low.map(|mm| (mm / cell_mm).floor() * cell_mm);
        let count = |k: usize| ((high[k] - origin[k]) / cell_mm) as usize + 1;
        let (columns, lines) = (count(0), count(1));
        let mut map = Heights {
            origin,
            cell_mm,
            columns,
            lines,
            top: vec![f64::NEG_INFINITY; columns * lines],
            highest: high[2],
        };
        ball.for_each_box(|b| {
            let (i, j) = (map.cells(0, b.min.x, b.max.x), map.cells(1, b.min.y, b.max.y));
            for line in j {
                for cell in &mut map.top[line * map.columns..][i.clone()] {
                    *cell = cell.max(b.max.z);
                }
            }
        });
        map
    }

    /// What the map holds over a rectangle, as numbers: the cells over which there is something, by their place.
    pub(crate) fn within(&self, [x, y]: [[f64; 2]; 2]) -> impl Iterator<Item = f64> + '_ {
        let cells =
            self.cells(1, y[0], y[1]).flat_map(move |j| self.cells(0, x[0], x[1]).map(move |i| (i, j)));
        let held =
            cells.map(|(i, j)| (i, j, self.top[j * self.columns + i])).filter(|cell| cell.2.is_finite());
        let place = |k: usize, cell: usize| self.origin[k] + cell as f64 * self.cell_mm;
        std::iter::once(self.cell_mm).chain(held.flat_map(move |(i, j, top)| [place(0, i), place(1, j), top]))
    }

    /// Above every face.
    pub(crate) fn highest(&self) -> f64 {
        self.highest
    }

    fn cells(&self, k: usize, from: f64, to: f64) -> std::ops::Range<usize> {
        let count = if k == 0 { self.columns } else { self.lines };
        let first = ((from - self.origin[k]) / self.cell_mm).floor().max(0.0) as usize;
        let last = ((to - self.origin[k]) / self.cell_mm).floor();
        if last < 0.0 { 0..0 } else { first.min(count)..(last as usize + 1).min(count) }
    }

    /// Upper bound of all faces within `radius` of the segment from `a` to `b` (horizontally);
    /// −∞ where there are none.
    pub(crate) fn over(&self, a: [f64; 2], b: [f64; 2], radius: f64) -> f64 {
        let low = [0, 1].map(|k| a[k].min(b[k]) - radius);
        let high = [0, 1].map(|k| a[k].max(b[k]) + radius);
        // A cell counts when its centre is no further than the tool's radius and the cell's half diagonal.
        let reach = radius + self.cell_mm * std::f64::consts::FRAC_1_SQRT_2;
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let l2 = dx * dx + dy * dy;
        let mut top = f64::NEG_INFINITY;
        for j in self.cells(1, low[1], high[1]) {
            let y = self.origin[1] + (j as f64 + 0.5) * self.cell_mm - a[1];
            for i in self.cells(0, low[0], high[0]) {
                let x = self.origin[0] + (i as f64 + 0.5) * self.cell_mm - a[0];
                let t = if l2 > 0.0 { ((x * dx + y * dy) / l2).clamp(0.0, 1.0) } else { 0.0 };
                if (x - t * dx).hypot(y - t * dy) <= reach {
                    top = top.max(self.top[j * self.columns + i]);
                }
            }
        }
        top
    }
}
