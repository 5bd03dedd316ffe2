//! Discs that were cut out of a plane, in cells, and what of a circle lies outside of them.

use std::collections::BTreeMap;

/// Arcs shorter than this are rounding, degrees.
const SHORTEST_DEG: f64 = 1e-3;

/// A disc, with its radius.
#[derive(Debug, Clone, Copy)]
struct Disc {
    centre: [f64; 2],
    radius: f64,
}

/// Discs in cells as large as the largest of them.
#[derive(Debug)]
pub(super) struct Discs {
    cell_mm: f64,
    cells: BTreeMap<[i64; 2], Vec<Disc>>,
}

impl Discs {
    pub(super) fn new(largest_mm: f64) -> Self {
        Discs { cell_mm: largest_mm, cells: BTreeMap::new() }
    }

    fn cell(&self, p: [f64; 2]) -> [i64; 2] {
        p.map(|c| (c / self.cell_mm).floor() as i64)
    }

    /// Adds a disc; nothing if it has no radius.
    pub(super) fn push(&mut self, centre: [f64; 2], radius: f64) {
        if radius > 0.0 {
            self.cells.entry(self.cell(centre)).or_default().push(Disc { centre, radius });
        }
    }

    /// Arcs of the front half of a circle outside of all discs: degrees from the heading, anticlockwise.
    pub(super) fn uncovered(&self, centre: [f64; 2], heading: [f64; 2], radius: f64) -> Vec<[f64; 2]> {
        let [i, j] = self.cell(centre);
        let mut arcs = vec![[-90.0, 90.0]];
        let mut bounds = bounds_of(&arcs, centre, heading, radius);
        // Nearest cells first: they hold what was cut last, and most often settle it.
        let mut near: Vec<[i64; 2]> = (-2..=2).flat_map(|a| (-2..=2).map(move |b| [a, b])).collect();
        near.sort_unstable_by_key(|[a, b]| a * a + b * b);
        for [a, b] in near {
            let Some(discs) = self.cells.get(&[i + a, j + b]) else { continue };
            for disc in discs.iter().rev() {
                let d = [disc.centre[0] - centre[0], disc.centre[1] - centre[1]];
                let beside = (0..2).any(|k| {
                    disc.centre[k] + disc.radius < bounds[k] || disc.centre[k] - disc.radius > bounds[k + 2]
                });
                let apart = d[0].hypot(d[1]);
                if beside || apart >= radius + disc.radius || apart <= radius - disc.radius {
                    continue;
                }
                if apart <= disc.radius - radius {
                    return Vec::new();
                }
                let cosine =
                    (radius * radius + apart * apart - disc.radius * disc.radius) / (2.0 * radius * apart);
                let half = cosine.clamp(-1.0, 1.0).acos().to_degrees();
                let [hx, hy] = heading;
                let middle = (hx * d[1] - hy * d[0]).atan2(hx * d[0] + hy * d[1]).to_degrees();
                for turn in [-360.0, 0.0, 360.0] {
                    less(&mut arcs, [middle - half + turn, middle + half + turn]);
                }
                if arcs.is_empty() {
                    return arcs;
                }
                bounds = bounds_of(&arcs, centre, heading, radius);
            }
        }
        arcs.retain(|[a, b]| b - a > SHORTEST_DEG);
        arcs
    }
}

/// Arcs without an interval.
fn less(arcs: &mut Vec<[f64; 2]>, [from, to]: [f64; 2]) {
    if arcs.iter().all(|[a, b]| to <= *a || from >= *b) {
        return;
    }
    let cut = |[a, b]: [f64; 2]| [[a, b.min(from)], [a.max(to), b]];
    *arcs = arcs.iter().flat_map(|&arc| cut(arc)).filter(|[a, b]| b > a).collect();
}

/// A box around arcs: xmin, ymin, xmax, ymax.
fn bounds_of(arcs: &[[f64; 2]], centre: [f64; 2], [hx, hy]: [f64; 2], radius: f64) -> [f64; 4] {
    let start = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    let (from, to) = arcs.iter().fold((90.0_f64, -90.0_f64), |(f, t), [a, b]| (f.min(*a), t.max(*b)));
    // Corners of a polygon around the arc: its ends, and points outside of it every 30°.
    let count = ((to - from) / 30.0).ceil().max(1.0) as usize;
    let outside = radius / (0.5 * (to - from).max(0.0) / count as f64).to_radians().cos();
    (0..=2 * count).fold(start, |b, k| {
        let r = if k % 2 == 1 { outside } else { radius };
        let angle = (from + (to - from) * k as f64 / (2 * count) as f64).to_radians();
        let (sine, cosine) = angle.sin_cos();
        let p = [centre[0] + r * (cosine * hx - sine * hy), centre[1] + r * (sine * hx + cosine * hy)];
        [b[0].min(p[0]), b[1].min(p[1]), b[2].max(p[0]), b[3].max(p[1])]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disc_beside_takes_an_arc() {
        let mut discs = Discs::new(5.0);
        discs.push([0.0, 1.0], 5.0);
        let arcs = discs.uncovered([0.0, 0.0], [1.0, 0.0], 5.0);
        assert_eq!(arcs.len(), 1);
        // The circles meet where y = 0.5.
        assert!((arcs[0][1] - (0.1_f64).asin().to_degrees()).abs() < 1e-9, "{arcs:?}");
        assert!((arcs[0][0] + 90.0).abs() < 1e-12);
        discs.push([3.0, -3.0], 20.0);
        assert!(discs.uncovered([0.0, 0.0], [1.0, 0.0], 5.0).is_empty());
    }
}
