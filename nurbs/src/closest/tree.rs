use crate::{Aabb, Point3, Vector3};

/// A hierarchy of boxes over items `0..n`: eight branches to a node, whose boxes lie side by side in it, in single
/// precision rounded outward. A branch is another node or one item.
#[derive(Debug)]
pub(super) struct Tree {
    nodes: Vec<Node>,
}

const BRANCHES: usize = 8;
type Eight = [f32; BRANCHES];

#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Node {
    min: [Eight; 3],
    max: [Eight; 3],
    /// Number of the node or, with [`ITEM`], of the item.
    branch: [u32; BRANCHES],
}

/// Set in a branch that is an item.
const ITEM: u32 = 1 << 31;
/// Levels of surface-area splits before halving by count; bounds the stack of a search.
const LARGEST_SAH_DEPTH: usize = 40;
const STACK: usize = 80 * (BRANCHES - 1);
const BINS: usize = 16;
/// Single precision takes no more than this from a squared distance.
const ROUNDING: f32 = 1.0 - 1e-6;

impl Tree {
    pub(super) fn new(boxes: &[Aabb]) -> Self {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = Vec::with_capacity(boxes.len() / 4);
        if !order.is_empty() {
            build(boxes, &mut order, 0, &mut nodes);
        }
        Tree { nodes }
    }

    /// Visits items nearest box first, while the squared distance of their box is below the bound that
    /// `visit` returns; `visit` gets the item and answers with the new bound.
    pub(super) fn search(&self, p: &Point3, mut bound: f64, mut visit: impl FnMut(usize) -> f64) {
        let place = [0, 1, 2].map(|k| [(p[k] as f32).next_down(), (p[k] as f32).next_up()]);
        let mut waiting = [(0u32, 0.0f32); STACK];
        let mut count = 0;
        let mut open = self.nodes.first();
        loop {
            if let Some(node) = open.take() {
                let first = count;
                for (k, distance) in node.distances_squared(&place).into_iter().enumerate() {
                    if f64::from(distance) >= bound {
                        continue;
                    }
                    let mut at = count;
                    while at > first && waiting[at - 1].1 < distance {
                        waiting[at] = waiting[at - 1];
                        at -= 1;
                    }
                    waiting[at] = (node.branch[k], distance);
                    count += 1;
                }
            }
            if count == 0 {
                return;
            }
            count -= 1;
            match waiting[count] {
                (_, distance) if f64::from(distance) >= bound => {}
                (item, _) if item & ITEM != 0 => bound = visit((item & !ITEM) as usize),
                (node, _) => open = Some(&self.nodes[node as usize]),
            }
        }
    }

    /// Visits the items whose boxes meet the line from `origin` along a unit vector.
    pub(super) fn along(&self, origin: &Point3, unit: &Vector3, length: f64, mut visit: impl FnMut(usize)) {
        let mut waiting: Vec<&Node> = self.nodes.first().into_iter().collect();
        while let Some(node) = waiting.pop() {
            for k in 0..BRANCHES {
                match node.branch[k] {
                    _ if !node.meets(k, origin, unit, length) => {}
                    item if item & ITEM != 0 => visit((item & !ITEM) as usize),
                    child => waiting.push(&self.nodes[child as usize]),
                }
            }
        }
    }
}

impl Node {
    const EMPTY: Node = Node {
        min: [[f32::INFINITY; BRANCHES]; 3],
        max: [[f32::NEG_INFINITY; BRANCHES]; 3],
        branch: [ITEM; BRANCHES],
    };

    fn put(&mut self, k: usize, b: &Aabb, branch: u32) {
        for axis in 0..3 {
            self.min[axis][k] = (b.min[axis] as f32).next_down();
            self.max[axis][k] = (b.max[axis] as f32).next_up();
        }
        self.branch[k] = branch;
    }

    /// Squared distances of the boxes from a point, no larger than they are.
    #[inline]
    fn distances_squared(&self, p: &[[f32; 2]; 3]) -> Eight {
        let larger = |a: f32, b: f32| if a > b { a } else { b };
        let mut sum = [0.0; BRANCHES];
        for axis in 0..3 {
            let (min, max, [low, high]) = (&self.min[axis], &self.max[axis], p[axis]);
            for k in 0..BRANCHES {
                let outside = larger(larger(min[k] - high, low - max[k]), 0.0);
                sum[k] += outside * outside;
            }
        }
        sum.map(|d| d * ROUNDING)
    }

    /// Whether a line meets a box, by its stretches between opposite sides.
    fn meets(&self, k: usize, origin: &Point3, unit: &Vector3, length: f64) -> bool {
        let (mut from, mut to) = (0.0f64, length);
        for axis in 0..3 {
            let low = f64::from(self.min[axis][k]) - origin[axis];
            let high = f64::from(self.max[axis][k]) - origin[axis];
            if unit[axis].abs() < f64::MIN_POSITIVE {
                if low > 0.0 || high < 0.0 {
                    return false;
                }
                continue;
            }
            let (a, b) = (low / unit[axis], high / unit[axis]);
            (from, to) = (from.max(a.min(b)), to.min(a.max(b)));
        }
        // The boxes are rounded outward by more than this rounds.
        from <= to + 1e-9
    }
}

/// Adds the node of these items, cut again and again where most of them are; returns its number.
fn build(boxes: &[Aabb], items: &mut [u32], depth: usize, nodes: &mut Vec<Node>) -> u32 {
    let number = nodes.len();
    nodes.push(Node::EMPTY);
    let mut parts = vec![(items, depth)];
    while parts.len() < BRANCHES {
        let Some(largest) = (0..parts.len()).rev().max_by_key(|&k| parts[k].0.len()) else { break };
        if parts[largest].0.len() < 2 {
            break;
        }
        let (part, depth) = parts.swap_remove(largest);
        let middle = split(boxes, part, depth);
        let (low, high) = part.split_at_mut(middle);
        parts.extend([(low, depth + 1), (high, depth + 1)]);
    }
    for (k, (part, depth)) in parts.into_iter().enumerate() {
        let all = part.iter().fold(Aabb::empty(), |b, &i| b.union(&boxes[i as usize]));
        let branch = match part {
            [item] => *item | ITEM,
            part => build(boxes, part, depth, nodes),
        };
        nodes[number].put(k, &all, branch);
    }
    number as u32
}

/// Orders `items` into two non-empty groups by the binned surface-area heuristic; returns the size of the first.
fn split(boxes: &[Aabb], items: &mut [u32], depth: usize) -> usize {
    let centre = |i: u32| boxes[i as usize].centre();
    let spread = items.iter().fold(Aabb::empty(), |mut b, &i| {
        b.add(&centre(i));
        b
    });
    let size = spread.max - spread.min;
    let axis = size.imax();
    if size[axis] > 0.0 && depth < LARGEST_SAH_DEPTH {
        let bin = |i: u32| {
            let x = (centre(i)[axis] - spread.min[axis]) / size[axis];
            ((x * BINS as f64) as usize).min(BINS - 1)
        };
        let mut bins = [(Aabb::empty(), 0usize); BINS];
        for &i in items.iter() {
            let (b, n) = &mut bins[bin(i)];
            (*b, *n) = (b.union(&boxes[i as usize]), *n + 1);
        }
        let cost = |bins: &[(Aabb, usize)]| {
            let (b, n) = (bins.iter()).fold((Aabb::empty(), 0), |(b, n), (c, m)| (b.union(c), n + m));
            if n == 0 {
                return None;
            }
            let d = b.max - b.min;
            Some((d.x * d.y + d.y * d.z + d.z * d.x) * n as f64)
        };
        let best = (1..BINS)
            .filter_map(|cut| Some((cost(&bins[..cut])? + cost(&bins[cut..])?, cut)))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, cut)) = best {
            items.sort_by_key(|&i| bin(i) >= cut);
            return items.iter().filter(|&&i| bin(i) < cut).count();
        }
    }
    items.sort_by(|&a, &b| centre(a)[axis].total_cmp(&centre(b)[axis]));
    items.len() / 2
}
