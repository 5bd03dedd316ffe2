//! Boxes in a tree of eight branches, whose nodes also keep the smallest time below them.
//!
//! The order comes from splits at medians, ties by number: the same for any number of threads. Boxes are rounded
//! outwards to single precision.

use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, Point3, outward};
use rayon::prelude::*;

/// Children of a node.
pub(super) const BRANCHES: usize = 8;
/// Fewer items than this are ordered by one thread.
const TOGETHER: usize = 8192;

/// Eight boxes with the smallest time in each.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    low: [[f32; BRANCHES]; 3],
    high: [[f32; BRANCHES]; 3],
    time: [u32; BRANCHES],
}

const NOTHING: Node = Node {
    low: [[f32::INFINITY; BRANCHES]; 3],
    high: [[f32::NEG_INFINITY; BRANCHES]; 3],
    time: [u32::MAX; BRANCHES],
};

impl Node {
    fn set(&mut self, lane: usize, [low, high]: [[f32; 3]; 2], time: u32) {
        for k in 0..3 {
            (self.low[k][lane], self.high[k][lane]) = (low[k], high[k]);
        }
        self.time[lane] = time;
    }

    fn whole(&self) -> ([[f32; 3]; 2], u32) {
        let low = self.low.map(|l| l.into_iter().fold(f32::INFINITY, f32::min));
        let high = self.high.map(|h| h.into_iter().fold(f32::NEG_INFINITY, f32::max));
        ([low, high], self.time.into_iter().min().unwrap_or(u32::MAX))
    }

    /// Which boxes hold the box from `low` to `high`.
    pub(super) fn hold(&self, [low, high]: [[f32; 3]; 2]) -> [bool; BRANCHES] {
        let mut all = [true; BRANCHES];
        for k in 0..3 {
            for j in 0..BRANCHES {
                all[j] &= (self.low[k][j] <= low[k]) & (self.high[k][j] >= high[k]);
            }
        }
        all
    }

    /// Squared distances from a point, a little too small.
    fn distances_squared(&self, p: [f32; 3]) -> [f32; BRANCHES] {
        let mut sum = [0f32; BRANCHES];
        for k in 0..3 {
            for j in 0..BRANCHES {
                let d = (self.low[k][j] - p[k]).max(p[k] - self.high[k][j]).max(0.0);
                sum[j] += d * d;
            }
        }
        sum.map(|d| d * NEARER)
    }

    /// Which boxes the line from `from` along `along` meets between two limits, a little too many.
    pub(super) fn met(&self, from: &Point3, along: [f64; 3], [start, end]: [f64; 2]) -> [bool; BRANCHES] {
        let mut met = [true; BRANCHES];
        for j in 0..BRANCHES {
            let (mut t0, mut t1) = (start, end);
            for k in 0..3 {
                let (low, high) = (f64::from(self.low[k][j]), f64::from(self.high[k][j]));
                if along[k] == 0.0 {
                    met[j] &= (low..=high).contains(&from[k]);
                } else {
                    let (a, b) = ((low - from[k]) / along[k], (high - from[k]) / along[k]);
                    (t0, t1) = (t0.max(a.min(b)), t1.min(a.max(b)));
                }
            }
            met[j] &= t0 <= t1 + 1e-9;
        }
        met
    }
}

/// Makes up for the rounding of distances in single precision.
const NEARER: f32 = 1.0 - 1e-5;

/// The tree. Items are numbered in its own order: item `i` is number `order[i]` of what was given.
#[derive(Debug, Clone, Default)]
pub(super) struct Tree {
    /// From the items up to the root.
    levels: Vec<Vec<Node>>,
    items: usize,
}

#[derive(Clone, Copy)]
struct Entry {
    centre: [f32; 3],
    number: u32,
}

impl Tree {
    /// Of boxes with their times; returns the order too. At most `u32::MAX − 1` items.
    pub(super) fn new(boxes: &[Aabb], times: &[u32]) -> (Tree, Vec<u32>) {
        let mut entries: Vec<Entry> = boxes
            .par_iter()
            .enumerate()
            .map(|(i, b)| Entry { centre: b.centre().coords.map(|x| x as f32).into(), number: i as u32 })
            .collect();
        let mut chunk = BRANCHES;
        while chunk * BRANCHES < entries.len() {
            chunk *= BRANCHES;
        }
        arrange(&mut entries, chunk);
        let order: Vec<u32> = entries.par_iter().map(|e| e.number).collect();
        let mut levels: Vec<Vec<Node>> = Vec::new();
        let lowest = order.par_chunks(BRANCHES).map(|numbers| {
            let mut node = NOTHING;
            for (lane, &i) in numbers.iter().enumerate() {
                let b = &boxes[i as usize];
                let sides = [0, 1, 2].map(|k| outward([b.min[k], b.max[k]]));
                node.set(lane, [sides.map(|s| s[0]), sides.map(|s| s[1])], times[i as usize]);
            }
            node
        });
        levels.push(lowest.collect());
        while let Some(below) = levels.last().filter(|l| l.len() > 1) {
            let above = below.par_chunks(BRANCHES).map(|nodes| {
                let mut node = NOTHING;
                for (lane, child) in nodes.iter().enumerate() {
                    let (sides, time) = child.whole();
                    node.set(lane, sides, time);
                }
                node
            });
            let above = above.collect();
            levels.push(above);
        }
        (Tree { levels, items: order.len() }, order)
    }

    /// The box of all items.
    pub(super) fn bounds(&self) -> Aabb {
        let Some(root) = self.levels.last().and_then(|l| l.first()) else { return Aabb::empty() };
        let ([low, high], _) = root.whole();
        Aabb { min: Point3::from(low.map(f64::from)), max: Point3::from(high.map(f64::from)) }
    }

    /// Bytes in memory.
    pub(super) fn bytes(&self) -> usize {
        self.levels.iter().map(|l| l.len() * size_of::<Node>()).sum()
    }

    /// Calls `found` for every item before a time whose box, and all above it, are wanted.
    pub(super) fn visit(
        &self,
        before: u32,
        wanted: impl Fn(&Node) -> [bool; BRANCHES],
        mut found: impl FnMut(usize) -> ControlFlow<()>,
    ) {
        if self.items == 0 {
            return;
        }
        let mut open = vec![(self.levels.len() - 1, 0usize)];
        while let Some((level, k)) = open.pop() {
            let node = &self.levels[level][k];
            let lanes = wanted(node);
            for lane in 0..BRANCHES {
                if !lanes[lane] || node.time[lane] >= before {
                    continue;
                }
                if level > 0 {
                    open.push((level - 1, k * BRANCHES + lane));
                } else if found(k * BRANCHES + lane).is_break() {
                    return;
                }
            }
        }
    }

    /// The smallest time before another of an item that holds a box, or a point without size.
    pub(super) fn earliest(
        &self,
        place: &Aabb,
        before: u32,
        mut holds: impl FnMut(usize) -> bool,
    ) -> Option<u32> {
        if self.items == 0 {
            return None;
        }
        // Boxes are rounded outwards, so that a box around the rounded point may stick out of them by a rounding only.
        let low = [0, 1, 2].map(|k| outward([place.min[k]; 2])[1]);
        let high = [0, 1, 2].map(|k| outward([place.max[k]; 2])[0]);
        let place = [low, high];
        let mut best = before;
        let mut open: Vec<(u32, u32, u32)> = Vec::with_capacity(64);
        open.push((0, self.levels.len() as u32 - 1, 0));
        while let Some((time, level, k)) = open.pop() {
            if time >= best {
                continue;
            }
            let node = &self.levels[level as usize][k as usize];
            let lanes = node.hold(place);
            let first = open.len();
            for lane in 0..BRANCHES {
                let time = node.time[lane];
                if !lanes[lane] || time >= best {
                    continue;
                }
                let child = k * BRANCHES as u32 + lane as u32;
                if level > 0 {
                    open.push((time, level - 1, child));
                } else if holds(child as usize) {
                    best = time;
                }
            }
            // The earliest is looked at next.
            open[first..].sort_unstable_by(|a, b| b.cmp(a));
        }
        (best < before).then_some(best)
    }

    /// The least value before a time, if it is below the larger limit, with its item; a value below the smaller one will do.
    /// The value of an item is at least the distance of `p` from its box where `p` is outside.
    pub(super) fn least(
        &self,
        p: &Point3,
        [enough, limit]: [f64; 2],
        before: u32,
        mut value: impl FnMut(usize) -> f64,
    ) -> Option<(f64, usize)> {
        if self.items == 0 {
            return None;
        }
        let place: [f32; 3] = p.coords.map(|x| x as f32).into();
        // What rounding of the place may add to a distance.
        let blur = 2e-7 * p.coords.amax();
        let mut best: Option<(f64, usize)> = None;
        let mut open: Vec<(f64, u32, u32)> = vec![(0.0, self.levels.len() as u32 - 1, 0)];
        let bound = |best: &Option<(f64, usize)>| best.map_or(limit, |b| b.0).max(0.0);
        while let Some((distance, level, k)) = open.pop() {
            if distance > bound(&best) {
                continue;
            }
            let node = &self.levels[level as usize][k as usize];
            let distances = node.distances_squared(place);
            let first = open.len();
            for lane in 0..BRANCHES {
                let away = f64::from(distances[lane]).sqrt() - blur;
                if node.time[lane] >= before || away > bound(&best) {
                    continue;
                }
                let child = k * BRANCHES as u32 + lane as u32;
                if level > 0 {
                    open.push((away, level - 1, child));
                    continue;
                }
                let v = value(child as usize);
                if best.map_or(v < limit, |b| v < b.0) {
                    best = Some((v, child as usize));
                    if v <= enough {
                        return best;
                    }
                }
            }
            open[first..].sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(b.2.cmp(&a.2)));
        }
        best
    }
}

/// Orders entries so that runs of `chunk` and of all its eighths are close together.
fn arrange(entries: &mut [Entry], chunk: usize) {
    if entries.len() <= chunk {
        if chunk > BRANCHES {
            arrange(entries, chunk / BRANCHES);
        }
        return;
    }
    let half = entries.len().div_ceil(chunk) / 2 * chunk;
    let mut low = [f32::INFINITY; 3];
    let mut high = [f32::NEG_INFINITY; 3];
    for e in entries.iter() {
        for k in 0..3 {
            (low[k], high[k]) = (low[k].min(e.centre[k]), high[k].max(e.centre[k]));
        }
    }
    let wide = |k: usize| high[k] - low[k];
    let axis = (1..3).fold(0, |best, k| if wide(k) > wide(best) { k } else { best });
    entries.select_nth_unstable_by(half, |a, b| {
        a.centre[axis].total_cmp(&b.centre[axis]).then(a.number.cmp(&b.number))
    });
    let (left, right) = entries.split_at_mut(half);
    if left.len() + right.len() > TOGETHER {
        rayon::join(|| arrange(left, chunk), || arrange(right, chunk));
    } else {
        arrange(left, chunk);
        arrange(right, chunk);
    }
}
