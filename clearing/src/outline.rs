//! The contours of a set as segments in a grid of cells: what lies near, what crosses, what is inside.

use crate::planar_set::PlanarSet;

/// Cells along the longer side at most.
const MOST_CELLS: usize = 256;

pub(crate) type Place = [f64; 2];

pub(crate) fn distance(a: Place, b: Place) -> f64 {
    let (x, y) = (a[0] - b[0], a[1] - b[1]);
    (x * x + y * y).sqrt()
}

/// The distance of a point from a segment.
pub(crate) fn distance_from_segment(p: Place, a: Place, b: Place) -> f64 {
    let (wx, wy) = (b[0] - a[0], b[1] - a[1]);
    let length2 = wx * wx + wy * wy;
    let s = if length2 > 0.0 { ((p[0] - a[0]) * wx + (p[1] - a[1]) * wy) / length2 } else { 0.0 };
    let s = s.clamp(0.0, 1.0);
    distance(p, [a[0] + s * wx, a[1] + s * wy])
}

/// Segments of contours, found by place.
#[derive(Debug)]
pub(crate) struct Outline {
    segments: Vec<[Place; 2]>,
    low: Place,
    cell_mm: f64,
    columns: usize,
    rows: usize,
    /// First entry of each cell in `members`, and one more.
    first: Vec<u32>,
    members: Vec<u32>,
}

impl Outline {
    pub(crate) fn new(set: &PlanarSet) -> Self {
        let contours = set.contours();
        let segments: Vec<[Place; 2]> = contours
            .iter()
            .flat_map(|c| c.iter().zip(c.iter().cycle().skip(1)).map(|(&a, &b)| [a, b]))
            .collect();
        let [x0, y0, x1, y1] = set.bounds().unwrap_or([0.0; 4]);
        let cells = ((segments.len() as f64).sqrt().ceil() as usize).clamp(1, MOST_CELLS);
        let cell_mm = ((x1 - x0).max(y1 - y0) / cells as f64).max(1e-6);
        let count = |from: f64, to: f64| (((to - from) / cell_mm).floor() as usize + 1).min(MOST_CELLS + 1);
        let mut outline = Outline {
            segments,
            low: [x0, y0],
            cell_mm,
            columns: count(x0, x1),
            rows: count(y0, y1),
            first: Vec::new(),
            members: Vec::new(),
        };
        let mut lists: Vec<Vec<u32>> = vec![Vec::new(); outline.columns * outline.rows];
        for (k, [a, b]) in outline.segments.iter().enumerate() {
            let [i0, j0] = outline.cell([a[0].min(b[0]), a[1].min(b[1])]);
            let [i1, j1] = outline.cell([a[0].max(b[0]), a[1].max(b[1])]);
            for j in j0..=j1 {
                for i in i0..=i1 {
                    lists[j * outline.columns + i].push(k as u32);
                }
            }
        }
        outline.first.push(0);
        for list in lists {
            outline.members.extend(list);
            outline.first.push(outline.members.len() as u32);
        }
        outline
    }

    fn cell(&self, p: Place) -> [usize; 2] {
        let index = |k: usize, count: usize| {
            (((p[k] - self.low[k]) / self.cell_mm).floor().max(0.0) as usize).min(count - 1)
        };
        [index(0, self.columns), index(1, self.rows)]
    }

    /// Segments of the cells that a box meets; some twice.
    fn of_box(&self, low: Place, high: Place) -> impl Iterator<Item = [Place; 2]> + '_ {
        let ([i0, j0], [i1, j1]) = (self.cell(low), self.cell(high));
        (j0..=j1).flat_map(move |j| {
            let from = self.first[j * self.columns + i0] as usize;
            let to = self.first[j * self.columns + i1 + 1] as usize;
            self.members[from..to].iter().map(|&k| self.segments[k as usize])
        })
    }

    /// The distance from the contours, at most a limit.
    pub(crate) fn distance(&self, p: Place, limit_mm: f64) -> f64 {
        let low = [p[0] - limit_mm, p[1] - limit_mm];
        let high = [p[0] + limit_mm, p[1] + limit_mm];
        self.of_box(low, high).map(|[a, b]| distance_from_segment(p, a, b)).fold(limit_mm, f64::min)
    }

    /// Whether a contour is nearer than a distance.
    pub(crate) fn is_within(&self, p: Place, mm: f64) -> bool {
        let (low, high) = ([p[0] - mm, p[1] - mm], [p[0] + mm, p[1] + mm]);
        self.of_box(low, high).any(|[a, b]| distance_from_segment(p, a, b) < mm)
    }

    /// Whether a point is inside.
    pub(crate) fn contains(&self, p: Place) -> bool {
        let beyond = [self.low[0] + self.cell_mm * self.columns as f64, p[1]];
        let [i0, j] = self.cell(p);
        let mut inside = false;
        // A segment is counted in the first of the row's cells that it is listed in, from the point on.
        let mut counted = Vec::new();
        let (from, to) = (self.first[j * self.columns + i0], self.first[(j + 1) * self.columns]);
        if p[1] < self.low[1] || p[0] < self.low[0] || p[0] > beyond[0] {
            return false;
        }
        for &k in &self.members[from as usize..to as usize] {
            let [a, b] = self.segments[k as usize];
            if (a[1] > p[1]) == (b[1] > p[1]) {
                continue;
            }
            let x = a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
            if x > p[0] && !counted.contains(&k) {
                counted.push(k);
                inside = !inside;
            }
        }
        inside
    }

    /// How much of the front half of a circle lies inside, radians. The front is where it moves to.
    pub(crate) fn front_inside(&self, centre: Place, radius_mm: f64, [hx, hy]: Place) -> f64 {
        let (low, high) = (centre.map(|x| x - radius_mm), centre.map(|x| x + radius_mm));
        let quarter = std::f64::consts::FRAC_PI_2;
        // Angles from the heading on.
        let angle = |p: Place| {
            let [x, y] = [p[0] - centre[0], p[1] - centre[1]];
            (hx * y - hy * x).atan2(hx * x + hy * y)
        };
        let met = self.of_box(low, high).flat_map(|[a, b]| circle_crossings(a, b, centre, radius_mm));
        let met = met.map(angle).filter(|angle| angle.abs() < quarter);
        let mut ends: Vec<f64> = met.chain([-quarter, quarter]).collect();
        ends.sort_unstable_by(f64::total_cmp);
        let is_inside = |angle: f64| {
            let (sine, cosine) = angle.sin_cos();
            let out = [hx * cosine - hy * sine, hy * cosine + hx * sine];
            self.contains([0, 1].map(|k| centre[k] + radius_mm * out[k]))
        };
        let arcs = ends.windows(2).filter(|w| w[1] > w[0] && is_inside(0.5 * (w[0] + w[1])));
        arcs.map(|w| w[1] - w[0]).sum()
    }

    /// Whether a segment meets a contour.
    pub(crate) fn crosses(&self, a: Place, b: Place) -> bool {
        let low = [a[0].min(b[0]), a[1].min(b[1])];
        let high = [a[0].max(b[0]), a[1].max(b[1])];
        self.of_box(low, high).any(|[c, d]| do_cross(a, b, c, d))
    }
}

/// Where a segment meets a circle.
fn circle_crossings(a: Place, b: Place, centre: Place, radius_mm: f64) -> impl Iterator<Item = Place> {
    let (w, v) = ([b[0] - a[0], b[1] - a[1]], [a[0] - centre[0], a[1] - centre[1]]);
    let length2 = w[0] * w[0] + w[1] * w[1];
    let half = (v[0] * w[0] + v[1] * w[1]) / length2;
    let root = half * half - (v[0] * v[0] + v[1] * v[1] - radius_mm * radius_mm) / length2;
    let shares = if root >= 0.0 { [-half - root.sqrt(), -half + root.sqrt()] } else { [f64::NAN; 2] };
    let is_on = |s: &f64| (0.0..=1.0).contains(s);
    shares.into_iter().filter(is_on).map(move |s| [a[0] + s * w[0], a[1] + s * w[1]])
}

fn side(a: Place, b: Place, p: Place) -> f64 {
    (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
}

fn do_cross(a: Place, b: Place, c: Place, d: Place) -> bool {
    side(a, b, c) * side(a, b, d) <= 0.0
        && side(c, d, a) * side(c, d, b) <= 0.0
        && a[0].min(b[0]) <= c[0].max(d[0])
        && c[0].min(d[0]) <= a[0].max(b[0])
        && a[1].min(b[1]) <= c[1].max(d[1])
        && c[1].min(d[1]) <= a[1].max(b[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inside_near_and_across() {
        let frame =
            PlanarSet::rectangle([0.0, 0.0, 10.0, 10.0]).minus(&PlanarSet::rectangle([4.0, 4.0, 6.0, 6.0]));
        let outline = Outline::new(&frame);
        for (p, inside) in [
            ([1.0, 1.0], true),
            ([5.0, 5.0], false),
            ([3.9, 5.0], true),
            ([-1.0, 5.0], false),
            ([11.0, 5.0], false),
        ] {
            assert_eq!(outline.contains(p), inside, "{p:?}");
        }
        assert!((outline.distance([5.0, 4.5], 3.0) - 0.5).abs() < 1e-9);
        assert!((outline.distance([2.0, 2.0], 1.0) - 1.0).abs() < 1e-12);
        assert!(outline.crosses([3.0, 5.0], [7.0, 5.0]));
        // Along the right side, 1 mm deep: acos(1 − 1/3).
        let engaged = outline.front_inside([12.0, 5.0], 3.0, [0.0, 1.0]);
        assert!((engaged - (2.0_f64 / 3.0).acos()).abs() < 1e-12, "{engaged}");
        assert!(outline.front_inside([13.0, 5.0], 3.0, [0.0, 1.0]) < 1e-12);
        // In the middle of the frame nothing is behind the walls of the hole.
        assert!((outline.front_inside([5.0, 5.0], 2.0, [1.0, 0.0]) - std::f64::consts::PI).abs() < 1e-12);
        assert!(!outline.crosses([1.0, 1.0], [9.0, 1.0]));
    }
}
