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

/// Cells are so much of the largest disc's radius wide.
const CELL_RADII: f64 = 0.5;
/// Discs that reach the circle are in so many cells on each side: it and they are two cells large.
const CELLS: i64 = 4;

/// Discs in cells.
#[derive(Debug)]
pub(super) struct Discs {
    largest_mm: f64,
    cells: BTreeMap<[i64; 2], Vec<Disc>>,
    /// The cells around one, nearest first: they hold what was cut last, and most often settle it.
    near: Vec<[i64; 2]>,
}

/// A part of a circle that no disc has covered yet.
struct Left {
    /// Degrees from the heading, anticlockwise; half a circle at most.
    arc: [f64; 2],
    /// Directions of its ends.
    ends: [[f64; 2]; 2],
}

/// A unit heading turned anticlockwise.
pub(super) fn turned([hx, hy]: [f64; 2], deg: f64) -> [f64; 2] {
    let (sine, cosine) = deg.to_radians().sin_cos();
    [cosine * hx - sine * hy, sine * hx + cosine * hy]
}

impl Left {
    fn new(arc: [f64; 2], heading: [f64; 2]) -> Self {
        Left { arc, ends: arc.map(|deg| turned(heading, deg)) }
    }

    /// Whether a disc with its centre at `d` from the circle's covers any of it: an end, or what is nearest to the disc.
    fn meets(&self, d: [f64; 2], radius: f64, of_disc: f64) -> bool {
        let covers = |[x, y]: [f64; 2]| {
            let [dx, dy] = [radius * x - d[0], radius * y - d[1]];
            dx * dx + dy * dy < of_disc * of_disc
        };
        let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        let [from, to] = self.ends;
        covers(from) || covers(to) || (cross(from, d) > 0.0 && cross(d, to) > 0.0)
    }
}

impl Discs {
    pub(super) fn new(largest_mm: f64) -> Self {
        let beside = || -CELLS..=CELLS;
        let mut near: Vec<[i64; 2]> = beside().flat_map(|a| beside().map(move |b| [a, b])).collect();
        near.sort_unstable_by_key(|[a, b]| a * a + b * b);
        Discs { largest_mm, cells: BTreeMap::new(), near }
    }

    fn cell_mm(&self) -> f64 {
        CELL_RADII * self.largest_mm
    }

    fn cell(&self, p: [f64; 2]) -> [i64; 2] {
        p.map(|c| (c / self.cell_mm()).floor() as i64)
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
        let mut left = vec![Left::new([-90.0, 90.0], heading)];
        let mut bounds = bounds_of(&left, centre, heading, radius);
        for [a, b] in &self.near {
            let cell = [i + a, j + b];
            let is_far = (0..2).any(|k| {
                let low = cell[k] as f64 * self.cell_mm();
                low - self.largest_mm > bounds[k + 2] || low + self.cell_mm() + self.largest_mm < bounds[k]
            });
            if is_far {
                continue;
            }
            for disc in self.cells.get(&cell).into_iter().flatten().rev() {
                let d = [disc.centre[0] - centre[0], disc.centre[1] - centre[1]];
                if !left.iter().any(|left| left.meets(d, radius, disc.radius)) {
                    continue;
                }
                let apart = (d[0] * d[0] + d[1] * d[1]).sqrt();
                if apart >= radius + disc.radius || apart <= radius - disc.radius {
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
                let mut arcs: Vec<[f64; 2]> = left.iter().map(|left| left.arc).collect();
                for turn in [-360.0, 0.0, 360.0] {
                    less(&mut arcs, [middle - half + turn, middle + half + turn]);
                }
                if arcs.is_empty() {
                    return arcs;
                }
                left = arcs.into_iter().map(|arc| Left::new(arc, heading)).collect();
                bounds = bounds_of(&left, centre, heading, radius);
            }
        }
        left.into_iter().map(|left| left.arc).filter(|[a, b]| b - a > SHORTEST_DEG).collect()
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
fn bounds_of(left: &[Left], centre: [f64; 2], heading: [f64; 2], radius: f64) -> [f64; 4] {
    let start = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    let ends = left.iter().map(|left| left.arc);
    let (from, to) = ends.fold((90.0_f64, -90.0_f64), |(f, t), [a, b]| (f.min(a), t.max(b)));
    // Corners of a polygon around the arc: its ends, and points outside of it every 30°.
    let count = ((to - from) / 30.0).ceil().max(1.0) as usize;
    let outside = radius / (0.5 * (to - from).max(0.0) / count as f64).to_radians().cos();
    (0..=2 * count).fold(start, |b, k| {
        let r = if k % 2 == 1 { outside } else { radius };
        let d = turned(heading, from + (to - from) * k as f64 / (2 * count) as f64);
        let p = [centre[0] + r * d[0], centre[1] + r * d[1]];
        [b[0].min(p[0]), b[1].min(p[1]), b[2].max(p[0]), b[3].max(p[1])]
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Every direction is in an arc that is left, or in a disc.
        #[test]
        fn what_is_left_is_in_no_disc(
            placed in proptest::collection::vec(([-9.0..9.0, -9.0..9.0], 0.2..5.0), 0..30),
            turn in 0.0..std::f64::consts::TAU,
            radius in 1.0..5.0,
        ) {
            let mut discs = Discs::new(5.0);
            placed.iter().for_each(|(centre, radius)| discs.push(*centre, *radius));
            let arcs = discs.uncovered([0.3, -0.2], [turn.cos(), turn.sin()], radius);
            for k in 0..180 {
                let deg = f64::from(k) - 89.5;
                let angle = turn + deg.to_radians();
                let p = [0.3 + radius * angle.cos(), -0.2 + radius * angle.sin()];
                let depth = |(c, r): &([f64; 2], f64)| r - (p[0] - c[0]).hypot(p[1] - c[1]);
                let depth = placed.iter().map(depth).fold(f64::NEG_INFINITY, f64::max);
                let is_left = arcs.iter().any(|[a, b]| (*a..=*b).contains(&deg));
                prop_assert!(depth.abs() < 1e-4 || is_left == (depth < 0.0), "{deg} {depth} {arcs:?}");
            }
        }
    }

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
