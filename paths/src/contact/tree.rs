use claymill_nurbs::Aabb;

use super::floor::Floor;

/// Boxes in a tree of eight branches, to find what a ball dropped at `(x, y)` could rest on.
///
/// A node holds the boxes of its branches side by side in single precision, rounded outwards; a branch is another node
/// or one item.
#[derive(Debug)]
pub(crate) struct DropTree {
    nodes: Vec<Node>,
}

const BRANCHES: usize = 8;
type Eight = [f32; BRANCHES];

#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Node {
    x: [Eight; 2],
    y: [Eight; 2],
    top: Eight,
    /// Number of the node or, with [`ITEM`], of the item.
    branch: [u32; BRANCHES],
}

/// Marks a branch that is an item.
const ITEM: u32 = 1 << 31;
/// Single precision is off by a few millionths at most; a ball this much larger makes up for it.
const ROUNDING: f32 = 1e-5;
/// Branches that wait: seven more at each level, and eight to the power of twelve is more than there can be items.
const WAITING: usize = 12 * (BRANCHES - 1) + 1;

impl DropTree {
    pub(crate) fn new(boxes: &[Aabb]) -> Self {
        let mut items: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = Vec::with_capacity(boxes.len() / 4);
        if !items.is_empty() {
            build(boxes, &mut items, &mut nodes);
        }
        DropTree { nodes }
    }

    /// Visits every item whose box could carry a ball of radius `r` above `floor`, most promising first; the
    /// visitor returns the new floor.
    pub(crate) fn descend(
        &self,
        x: f64,
        y: f64,
        r: f64,
        mut floor: Floor,
        mut visit: impl FnMut(u32) -> Floor,
    ) {
        let place = [outwards([x, x]), outwards([y, y])];
        let mut waiting = [(0u32, f32::NEG_INFINITY); WAITING];
        let mut depth = 0;
        let mut open = self.nodes.first();
        loop {
            if let Some(node) = open.take() {
                let first = depth;
                let cleared = floor.clears_boxes(&node.x, &node.y, &node.top);
                for (k, bound) in node.bounds(place, r as f32 * (1.0 + ROUNDING)).into_iter().enumerate() {
                    if f64::from(bound) <= floor.z || cleared[k] {
                        continue;
                    }
                    let mut at = depth;
                    while at > first && waiting[at - 1].1 > bound {
                        waiting[at] = waiting[at - 1];
                        at -= 1;
                    }
                    waiting[at] = (node.branch[k], bound);
                    depth += 1;
                }
            }
            if depth == 0 {
                return;
            }
            depth -= 1;
            match waiting[depth] {
                (_, bound) if f64::from(bound) <= floor.z => {}
                (item, _) if item & ITEM != 0 => floor = visit(item & !ITEM),
                (node, _) => open = Some(&self.nodes[node as usize]),
            }
        }
    }

    /// Visits every item on which a ball of radius `r` somewhere over the rectangle could rest with its centre
    /// above `low`.
    pub(crate) fn over(&self, [x, y]: [[f64; 2]; 2], r: f64, low: f64, mut visit: impl FnMut(u32)) {
        let Some(root) = self.nodes.first() else { return };
        let rectangle = [outwards(x), outwards(y)];
        let (r, low) = (r as f32 * (1.0 + ROUNDING), (low as f32).next_down());
        let mut waiting = [root; WAITING];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let node = waiting[depth];
            for (k, room) in node.room(rectangle, r, low).into_iter().enumerate() {
                if room > 0.0 {
                    match node.branch[k] {
                        item if item & ITEM != 0 => visit(item & !ITEM),
                        child => {
                            waiting[depth] = &self.nodes[child as usize];
                            depth += 1;
                        }
                    }
                }
            }
        }
    }
}

fn outwards([low, high]: [f64; 2]) -> [f32; 2] {
    [(low as f32).next_down(), (high as f32).next_up()]
}

impl Node {
    const EMPTY: Node = Node {
        x: [[f32::INFINITY; BRANCHES], [f32::NEG_INFINITY; BRANCHES]],
        y: [[f32::INFINITY; BRANCHES], [f32::NEG_INFINITY; BRANCHES]],
        top: [f32::NEG_INFINITY; BRANCHES],
        branch: [ITEM; BRANCHES],
    };

    fn put(&mut self, k: usize, aabb: &Aabb, branch: u32) {
        let [x, y, [_, top]] = [0, 1, 2].map(|axis| outwards([aabb.min[axis], aabb.max[axis]]));
        for end in 0..2 {
            (self.x[end][k], self.y[end][k]) = (x[end], y[end]);
        }
        (self.top[k], self.branch[k]) = (top, branch);
    }

    /// What is left of `r²` beyond the squared distance over the ground.
    #[inline(always)]
    fn left(&self, [x, y]: [[f32; 2]; 2], r: f32) -> Eight {
        std::array::from_fn(|k| {
            let dx = larger(larger(self.x[0][k] - x[1], x[0] - self.x[1][k]), 0.0);
            let dy = larger(larger(self.y[0][k] - y[1], y[0] - self.y[1][k]), 0.0);
            r * r - (dx * dx + dy * dy)
        })
    }

    /// No ball somewhere over the rectangle can rest on anything in the boxes with its centre above these.
    #[inline(always)]
    fn bounds(&self, rectangle: [[f32; 2]; 2], r: f32) -> Eight {
        let left = self.left(rectangle, r);
        std::array::from_fn(|k| {
            let height = (self.top[k] + larger(left[k], 0.0).sqrt()).next_up();
            if left[k] > 0.0 { height } else { f32::NEG_INFINITY }
        })
    }

    /// Positive where a ball somewhere over the rectangle could rest on something in the box with its centre above
    /// `low`.
    #[inline(always)]
    fn room(&self, rectangle: [[f32; 2]; 2], r: f32, low: f32) -> Eight {
        let left = self.left(rectangle, r);
        std::array::from_fn(|k| {
            let needed = larger(low - self.top[k], 0.0);
            left[k] - needed * needed
        })
    }
}

/// The larger one; unlike `f32::max` without a thought for what is no number.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Adds the node of these items, cut at medians along the longest sides of their centres into eight parts.
fn build(boxes: &[Aabb], items: &mut [u32], nodes: &mut Vec<Node>) -> u32 {
    let number = nodes.len();
    nodes.push(Node::EMPTY);
    let mut parts = vec![items];
    while parts.len() < BRANCHES {
        // The first of the largest, so that the tree is the same everywhere.
        let largest = (0..parts.len()).rev().max_by_key(|&k| parts[k].len()).unwrap_or(0);
        if parts[largest].len() < 2 {
            break;
        }
        let part = parts.swap_remove(largest);
        let [low, high] = halves(boxes, part);
        parts.extend([low, high]);
    }
    for (k, part) in parts.into_iter().enumerate() {
        let all = part.iter().fold(Aabb::empty(), |b, &i| b.union(&boxes[i as usize]));
        let branch = match part {
            [item] => *item | ITEM,
            part => build(boxes, part, nodes),
        };
        nodes[number].put(k, &all, branch);
    }
    number as u32
}

fn halves<'a>(boxes: &[Aabb], part: &'a mut [u32]) -> [&'a mut [u32]; 2] {
    let mut centres = Aabb::empty();
    part.iter().for_each(|&i| centres.add(&boxes[i as usize].centre()));
    let axis = (centres.max - centres.min).imax();
    let key = |i: u32| boxes[i as usize].min[axis] + boxes[i as usize].max[axis];
    let middle = part.len() / 2;
    part.select_nth_unstable_by(middle, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
    part.split_at_mut(middle).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_nurbs::{Point3, Vector3};

    #[test]
    fn nothing_that_could_carry_the_ball_is_missed() {
        let share = |k: u32, prime: u32| (f64::from(k) * 0.618_033_988_75 * f64::from(prime)).fract();
        let boxes: Vec<Aabb> = (0..3000)
            .map(|k| {
                let at = Point3::new(4000.0 + 300.0 * share(k, 1), -90.0 * share(k, 3), 30.0 * share(k, 7));
                Aabb::of([&at, &(at + Vector3::new(share(k, 11), share(k, 13), share(k, 17)) * 5.0)])
            })
            .collect();
        let tree = DropTree::new(&boxes);
        let r = 7.0;
        let height = |b: &Aabb, [x, y]: [[f64; 2]; 2]| {
            let dx = (b.min.x - x[1]).max(x[0] - b.max.x).max(0.0);
            let dy = (b.min.y - y[1]).max(y[0] - b.max.y).max(0.0);
            let left = r * r - dx * dx - dy * dy;
            if left > 0.0 { b.max.z + left.sqrt() } else { f64::NEG_INFINITY }
        };
        let mut missed_none = 0;
        for k in 0..200 {
            let (x, y) = (4000.0 + 300.0 * share(k, 19), -90.0 * share(k, 23));
            let rectangle = [[x, x + share(k, 29)], [y, y + 3.0 * share(k, 31)]];
            let low = 40.0 * share(k, 37);
            let mut found = vec![false; boxes.len()];
            tree.over(rectangle, r, low, |i| found[i as usize] = true);
            for (b, found) in boxes.iter().zip(&found) {
                let needed = height(b, rectangle) > low;
                assert!(*found || !needed);
                missed_none += u32::from(needed);
            }
            // By order of promise, the first one is the highest; with a floor below it, all above are met.
            let place = [[x, x], [y, y]];
            let mut best = f64::NEG_INFINITY;
            tree.descend(x, y, r, Floor::NONE, |i| {
                best = best.max(height(&boxes[i as usize], place));
                let mut floor = Floor::NONE;
                floor.z = best;
                floor
            });
            let highest = boxes.iter().map(|b| height(b, place)).fold(f64::NEG_INFINITY, f64::max);
            assert!(best == highest, "{best} {highest}");
        }
        assert!(missed_none > 1000, "{missed_none}");
        DropTree::new(&[]).over([[0.0; 2]; 2], r, 0.0, |_| unreachable!());
    }
}
