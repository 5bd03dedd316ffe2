//! A packed bounding-box tree with eight boxes to a node, in single precision rounded outward.
//! Queries go by promise, by distance or by a condition; the caller holds the items.

use std::ops::ControlFlow;

use rayon::prelude::*;

use crate::{Aabb, Point3};

/// Boxes of a node.
pub const BRANCHES: usize = 8;
/// A number for each box of a node.
pub type Eight = [f32; BRANCHES];

/// Levels at most: eight to the power of twelve is more than there can be items.
const LEVELS: usize = 12;
/// Branches that wait: seven more at each level.
const WAITING: usize = LEVELS * (BRANCHES - 1) + 1;
/// Below this many items a branch is sorted on the spot.
const PARALLEL_ABOVE: usize = 20_000;

/// A packed tree of boxes around items `0..n` that the caller holds: eight boxes to a node, side by side.
///
/// ```text
///   levels[2]              ▣                 node k of a level has nodes 8k .. 8k+8 of the one below;
///   levels[1]      ▣       ▣       ▣         of the lowest, items[8k .. 8k+8]:
///   levels[0]    ▣ ▣ ▣   ▣ ▣ ▣   ▣ ▣         all are full but the last of each level
///   items       ········ ········ ······
/// ```
#[derive(Debug)]
pub struct BoxTree {
    items: Vec<u32>,
    levels: Vec<Vec<Boxes>>,
}

/// The boxes of a node's branches, in single precision and rounded outward; empty ones are inside out.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub struct Boxes {
    /// Lowest coordinates, axis by axis.
    pub min: [Eight; 3],
    /// Highest coordinates, axis by axis.
    pub max: [Eight; 3],
}

/// A node, by its level and number there; or an item, below all levels.
#[derive(Debug, Clone, Copy)]
struct Branch {
    /// Levels from here down, its own included.
    height: u32,
    number: u32,
}

impl BoxTree {
    /// Packs items with these boxes, halving along the longest side of their middles. Equal input gives an equal tree.
    #[must_use]
    pub fn new(boxes: &[Aabb]) -> Self {
        let middle = |(item, b): (usize, &Aabb)| Middle {
            at: b.centre().coords.cast::<f32>().into(),
            item: item as u32,
        };
        let mut middles: Vec<Middle> = boxes.par_iter().enumerate().map(middle).collect();
        sort(&mut middles);
        let items: Vec<u32> = middles.into_par_iter().map(|m| m.item).collect();
        let mut levels: Vec<Vec<Boxes>> = Vec::new();
        if !items.is_empty() {
            let lowest =
                items.par_chunks(BRANCHES).map(|items| Boxes::of(items.iter().map(|&i| boxes[i as usize])));
            levels.push(lowest.collect());
        }
        while let Some(below) = levels.last().filter(|level| level.len() > 1) {
            let node = |nodes: &[Boxes]| Boxes::of(nodes.iter().map(Boxes::all));
            levels.push(below.par_chunks(BRANCHES).map(node).collect());
        }
        BoxTree { items, levels }
    }

    /// Items that lie close together, so many at a time and the rest; a power of two makes them closest.
    pub fn groups(&self, size: usize) -> impl Iterator<Item = &[u32]> {
        self.items.chunks(size)
    }

    /// One of the groups.
    #[must_use]
    pub fn group(&self, k: usize, size: usize) -> &[u32] {
        let end = self.items.len().min(size * (k + 1));
        &self.items[size * k..end]
    }

    /// Visits items in the order of promise. `keys` gives each box of a node a number, no larger for an item's box
    /// than for those around it; smaller ones are looked at earlier, and none once it is `surpassed`. Both may use
    /// what is `known`, to which a visit may add.
    #[inline]
    pub fn search<K>(
        &self,
        known: &mut K,
        keys: impl Fn(&K, &Boxes) -> Eight,
        surpassed: impl Fn(&K, f32) -> bool,
        mut visit: impl FnMut(&mut K, usize),
    ) {
        let mut waiting = [(Branch { height: 0, number: 0 }, 0.0f32); WAITING];
        let mut count = 0;
        let mut open = self.root();
        loop {
            if let Some((node, boxes)) = open.take() {
                let first = count;
                let branches = self.branches(node);
                for (k, key) in keys(known, boxes).into_iter().take(branches).enumerate() {
                    if surpassed(known, key) {
                        continue;
                    }
                    let mut at = count;
                    while at > first && waiting[at - 1].1 < key {
                        waiting[at] = waiting[at - 1];
                        at -= 1;
                    }
                    waiting[at] = (node.branch(k), key);
                    count += 1;
                }
            }
            if count == 0 {
                return;
            }
            count -= 1;
            let (branch, key) = waiting[count];
            if !surpassed(known, key) {
                match self.boxes(branch) {
                    Some(boxes) => open = Some((branch, boxes)),
                    None => visit(known, self.items[branch.number as usize] as usize),
                }
            }
        }
    }

    /// Visits items nearest box first, while the squared distance of their box is below the `bound`, which follows from
    /// what is `known` so far.
    #[inline]
    pub fn nearest_first<K>(
        &self,
        p: &Point3,
        known: &mut K,
        bound: impl Fn(&K) -> f64,
        visit: impl FnMut(&mut K, usize),
    ) {
        let place = [p.x, p.y, p.z].map(|x| outward([x, x]));
        let keys = |_: &K, boxes: &Boxes| boxes.distances_squared(&place);
        self.search(known, keys, |known, distance| f64::from(distance) >= bound(known), visit);
    }

    /// Visits every item whose box and the boxes around it are `wanted`, until it breaks.
    #[inline]
    pub fn visit(
        &self,
        mut wanted: impl FnMut(&Boxes) -> [bool; BRANCHES],
        mut item: impl FnMut(usize) -> ControlFlow<()>,
    ) {
        let Some((root, _)) = self.root() else { return };
        let mut waiting = [root; WAITING];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let node = waiting[count];
            let Some(boxes) = self.boxes(node) else { continue };
            for (k, wanted) in wanted(boxes).into_iter().take(self.branches(node)).enumerate() {
                match node.branch(k) {
                    _ if !wanted => {}
                    Branch { height: 0, number } => {
                        if item(self.items[number as usize] as usize).is_break() {
                            return;
                        }
                    }
                    branch => {
                        waiting[count] = branch;
                        count += 1;
                    }
                }
            }
        }
    }

    fn root(&self) -> Option<(Branch, &Boxes)> {
        let root = self.levels.last()?.first()?;
        Some((Branch { height: self.levels.len() as u32, number: 0 }, root))
    }

    /// The boxes of a node; `None` for an item.
    #[inline]
    fn boxes(&self, branch: Branch) -> Option<&Boxes> {
        let level = branch.height.checked_sub(1)?;
        Some(&self.levels[level as usize][branch.number as usize])
    }

    /// How many branches a node has.
    #[inline]
    fn branches(&self, node: Branch) -> usize {
        let below = match node.height {
            1 => self.items.len(),
            height => self.levels[height as usize - 2].len(),
        };
        below - BRANCHES * node.number as usize
    }
}

impl Branch {
    #[inline]
    fn branch(self, k: usize) -> Branch {
        Branch { height: self.height - 1, number: BRANCHES as u32 * self.number + k as u32 }
    }
}

impl Boxes {
    fn of(boxes: impl Iterator<Item = Aabb>) -> Self {
        let mut all = Boxes { min: [[f32::INFINITY; BRANCHES]; 3], max: [[f32::NEG_INFINITY; BRANCHES]; 3] };
        for (k, b) in boxes.enumerate() {
            for axis in 0..3 {
                [all.min[axis][k], all.max[axis][k]] = outward([b.min[axis], b.max[axis]]);
            }
        }
        all
    }

    /// One of the boxes.
    #[inline]
    #[must_use]
    pub fn get(&self, k: usize) -> Aabb {
        let corner = |ends: &[Eight; 3]| [0, 1, 2].map(|axis| f64::from(ends[axis][k])).into();
        Aabb { min: corner(&self.min), max: corner(&self.max) }
    }

    /// Asks the same of each box.
    #[inline]
    pub fn each(&self, mut wanted: impl FnMut(&Aabb) -> bool) -> [bool; BRANCHES] {
        std::array::from_fn(|k| wanted(&self.get(k)))
    }

    /// A box around all.
    fn all(&self) -> Aabb {
        (0..BRANCHES).fold(Aabb::empty(), |all, k| all.union(&self.get(k)))
    }

    /// Squared distances from a place, given as [`outward`] ranges of coordinates, no larger than they are.
    #[inline(always)]
    #[must_use]
    pub fn distances_squared(&self, from: &[[f32; 2]; 3]) -> Eight {
        /// Single precision takes no more than this from a squared distance.
        const ROUNDING: f32 = 1.0 - 1e-6;
        let mut sum = [0.0; BRANCHES];
        for axis in 0..3 {
            let (min, max, [low, high]) = (&self.min[axis], &self.max[axis], from[axis]);
            for k in 0..BRANCHES {
                let outside = larger(larger(min[k] - high, low - max[k]), 0.0);
                sum[k] += outside * outside;
            }
        }
        sum.map(|d| d * ROUNDING)
    }
}

/// A range in single precision that holds the one in double.
#[inline]
#[must_use]
pub fn outward([low, high]: [f64; 2]) -> [f32; 2] {
    [(low as f32).next_down(), (high as f32).next_up()]
}

/// The larger one; unlike `f32::max` without a thought for what is no number.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Where an item is, as far as sorting is concerned.
#[derive(Debug, Clone, Copy)]
struct Middle {
    at: [f32; 3],
    item: u32,
}

/// Sorts items so that every whole run of eight, sixty-four, ... lies together.
fn sort(items: &mut [Middle]) {
    let Some(last) = items.len().checked_sub(1).filter(|&last| last >= BRANCHES) else { return };
    let mut run = BRANCHES;
    while last / run >= BRANCHES {
        run *= BRANCHES;
    }
    // A number of whole runs on the near side, about half.
    let split = items.len().div_ceil(run).div_ceil(2) * run;
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for m in items.iter() {
        for k in 0..3 {
            (low[k], high[k]) = (low[k].min(m.at[k]), high[k].max(m.at[k]));
        }
    }
    let size = |k: usize| high[k] - low[k];
    let axis = (0..3).rev().max_by(|&a, &b| size(a).total_cmp(&size(b))).unwrap_or(0);
    items.select_nth_unstable_by(split, |a, b| a.at[axis].total_cmp(&b.at[axis]).then(a.item.cmp(&b.item)));
    let parallel = items.len() > PARALLEL_ABOVE;
    let (near, far) = items.split_at_mut(split);
    if parallel {
        rayon::join(|| sort(near), || sort(far));
    } else {
        sort(near);
        sort(far);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_exactly_what_a_linear_search_finds() {
        let mut seed = 1u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 40) as f64 / (1u64 << 24) as f64 * 100.0
        };
        for count in [0, 1, 7, 8, 9, 63, 64, 65, 100, 513, 1777, 30_000] {
            let items: Vec<Aabb> = (0..count)
                .map(|_| Aabb::of([&Point3::new(random(), random(), random())]).inflated(1.0))
                .collect();
            let tree = BoxTree::new(&items);
            for _ in 0..20 {
                let p = Point3::new(random(), random(), random());
                let near = |b: &Aabb| b.distance_squared(&p) < 400.0;
                let mut found = Vec::new();
                tree.visit(
                    |boxes| boxes.each(near),
                    |i| {
                        found.extend(near(&items[i]).then_some(i));
                        ControlFlow::Continue(())
                    },
                );
                found.sort_unstable();
                let expected: Vec<usize> = (0..count).filter(|&i| near(&items[i])).collect();
                assert_eq!(found, expected);

                let mut nearest = f64::INFINITY;
                tree.nearest_first(
                    &p,
                    &mut nearest,
                    |d| *d,
                    |d, i| *d = d.min(items[i].distance_squared(&p)),
                );
                let expected = items.iter().map(|b| b.distance_squared(&p)).fold(f64::INFINITY, f64::min);
                assert_eq!(nearest, expected);
            }
        }
    }
}
