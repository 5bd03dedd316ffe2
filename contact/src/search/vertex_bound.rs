//! Points that stand in the ball's way for sure.

use claymill_nurbs::Point3;

/// Cells are this share of a ball radius wide.
const CELL: f64 = 0.5;
/// Cells, at most: thinly spread models have larger ones.
const MOST_CELLS: f64 = 4e6;

/// The highest known point of the model in each cell of the ground.
#[derive(Debug)]
pub(crate) struct VertexBound {
    low: [f64; 2],
    cell_mm: f64,
    columns: i64,
    lines: i64,
    top: Vec<Option<Point3>>,
}

impl VertexBound {
    /// Of points on the model.
    pub(crate) fn new<'a>(points: impl Iterator<Item = &'a Point3> + Clone, radius_mm: f64) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in points.clone() {
            for k in 0..2 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let size = [0, 1].map(|k| (high[k] - low[k]).max(0.0));
        let cell_mm = (CELL * radius_mm).max((size[0] * size[1] / MOST_CELLS).sqrt());
        let [columns, lines] = size.map(|mm| (mm / cell_mm) as i64 + 1);
        let mut vertex_bound =
            VertexBound { low, cell_mm, columns, lines, top: vec![None; (columns * lines) as usize] };
        for p in points {
            let [i, j] = vertex_bound.cell(p.x, p.y);
            if let Some(cell) = vertex_bound.index(i, j)
                && vertex_bound.top[cell].is_none_or(|top| top.z < p.z)
            {
                vertex_bound.top[cell] = Some(*p);
            }
        }
        vertex_bound
    }

    fn cell(&self, x: f64, y: f64) -> [i64; 2] {
        [x - self.low[0], y - self.low[1]].map(|mm| (mm / self.cell_mm).floor() as i64)
    }

    fn index(&self, i: i64, j: i64) -> Option<usize> {
        let inside = (0..self.columns).contains(&i) && (0..self.lines).contains(&j);
        inside.then(|| (j * self.columns + i) as usize)
    }

    /// Whether one of the points holds a ball up to this height or higher.
    pub(crate) fn hold(&self, x: f64, y: f64, radius_mm: f64, height: f64) -> bool {
        let [i, j] = self.cell(x, y);
        let around = (-1..=1).flat_map(|b| (-1..=1).map(move |a| (i + a, j + b)));
        around.filter_map(|(i, j)| self.top[self.index(i, j)?]).any(|q| {
            let left = radius_mm * radius_mm - (q.x - x).powi(2) - (q.y - y).powi(2);
            left > 0.0 && q.z + left.sqrt() >= height
        })
    }
}
