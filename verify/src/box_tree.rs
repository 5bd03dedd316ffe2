use std::ops::ControlFlow;

use claymill_nurbs::Aabb;
use rayon::prelude::*;

/// Items under one leaf, on average: a box test costs about as much as an item test.
const ITEMS_PER_LEAF: usize = 6;
/// Below this many items a branch is sorted on the spot.
const PARALLEL_ABOVE: usize = 20_000;

/// A complete binary tree of boxes around items that the caller holds.
///
/// ```text
///   boxes (heap order)      1              leaves: a power of two, leaf k holds the items
///                        2     3           order[k·n/leaves .. (k+1)·n/leaves]
///                       4 5   6 7
/// ```
#[derive(Debug)]
pub(crate) struct BoxTree {
    boxes: Vec<Aabb>,
    order: Vec<u32>,
    leaves: usize,
}

impl BoxTree {
    /// Sorts items with the given boxes by halving along the longest side. Equal input gives an equal tree.
    pub(crate) fn new(items: &[Aabb]) -> Self {
        let leaves = items.len().div_ceil(ITEMS_PER_LEAF).max(1).next_power_of_two();
        let mut middles: Vec<Middle> = items
            .par_iter()
            .enumerate()
            .map(|(i, b)| Middle { at: b.centre().coords.cast::<f32>().into(), item: i as u32 })
            .collect();
        halve(&mut middles, items.len(), 0, leaves, leaves);
        let order: Vec<u32> = middles.into_iter().map(|m| m.item).collect();

        let mut boxes = vec![Aabb::empty(); 2 * leaves];
        let range = |leaf: usize| leaf * items.len() / leaves..(leaf + 1) * items.len() / leaves;
        boxes[leaves..].par_iter_mut().enumerate().for_each(|(leaf, b)| {
            for &i in &order[range(leaf)] {
                *b = b.union(&items[i as usize]);
            }
        });
        for node in (1..leaves).rev() {
            boxes[node] = boxes[2 * node].union(&boxes[2 * node + 1]);
        }
        BoxTree { boxes, order, leaves }
    }

    /// Calls `item` for every item in every leaf whose box and parents' boxes are `wanted`, until it breaks.
    pub(crate) fn visit(
        &self,
        mut wanted: impl FnMut(&Aabb) -> bool,
        mut item: impl FnMut(usize) -> ControlFlow<()>,
    ) {
        // Depth-first with the nearer-to-root sibling waiting: never more than one entry a level.
        let mut waiting = [0usize; 64];
        waiting[0] = 1;
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let node = waiting[count];
            if !wanted(&self.boxes[node]) {
                continue;
            }
            if node < self.leaves {
                waiting[count] = 2 * node + 1;
                waiting[count + 1] = 2 * node;
                count += 2;
                continue;
            }
            let (leaf, n) = (node - self.leaves, self.order.len());
            for &i in &self.order[leaf * n / self.leaves..(leaf + 1) * n / self.leaves] {
                if item(i as usize).is_break() {
                    return;
                }
            }
        }
    }
}

/// Where an item is, as far as sorting is concerned.
#[derive(Debug, Clone, Copy)]
struct Middle {
    at: [f32; 3],
    item: u32,
}

/// Distributes the items of leaves `first..first + count`, out of `leaves` for `n` items, over those leaves.
fn halve(order: &mut [Middle], n: usize, first: usize, count: usize, leaves: usize) {
    if count < 2 {
        return;
    }
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for m in order.iter() {
        for k in 0..3 {
            (low[k], high[k]) = (low[k].min(m.at[k]), high[k].max(m.at[k]));
        }
    }
    let size = |k: usize| high[k] - low[k];
    let axis = (0..3).rev().max_by(|&a, &b| size(a).total_cmp(&size(b))).unwrap_or(0);
    let split = (first + count / 2) * n / leaves - first * n / leaves;
    if split > 0 && split < order.len() {
        order.select_nth_unstable_by(split, |a, b| {
            a.at[axis].total_cmp(&b.at[axis]).then(a.item.cmp(&b.item))
        });
    }
    let parallel = order.len() > PARALLEL_ABOVE;
    let (low, high) = order.split_at_mut(split);
    let mut left = || halve(low, n, first, count / 2, leaves);
    let mut right = || halve(high, n, first + count / 2, count / 2, leaves);
    if parallel {
        rayon::join(left, right);
    } else {
        left();
        right();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::Point3;

    #[test]
    fn finds_exactly_what_a_linear_search_finds() {
        let mut seed = 1u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 40) as f64 / (1u64 << 24) as f64 * 100.0
        };
        for count in [0, 1, 5, 6, 7, 100, 1777] {
            let items: Vec<Aabb> = (0..count)
                .map(|_| Aabb::of([&Point3::new(random(), random(), random())]).inflated(1.0))
                .collect();
            let tree = BoxTree::new(&items);
            for _ in 0..20 {
                let p = Point3::new(random(), random(), random());
                let near = |b: &Aabb| b.distance_squared(&p) < 400.0;
                let mut found = Vec::new();
                tree.visit(near, |i| {
                    if near(&items[i]) {
                        found.push(i);
                    }
                    ControlFlow::Continue(())
                });
                found.sort_unstable();
                let expected: Vec<usize> = (0..count).filter(|&i| near(&items[i])).collect();
                assert_eq!(found, expected);
            }
        }
    }
}
