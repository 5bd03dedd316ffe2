use claymill_nurbs::Aabb;

use super::floor::Floor;

/// Boxes in a binary tree, to find what a ball dropped at `(x, y)` could rest on.
#[derive(Debug)]
pub(crate) struct DropTree {
    nodes: Vec<Node>,
    /// Item numbers, leaf by leaf.
    items: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    x: [f64; 2],
    y: [f64; 2],
    top: f64,
    /// Leaf: first item. Inner: index of the second child (the first one follows its parent).
    at: u32,
    /// Number of items; 0 for an inner node.
    count: u32,
}

const LEAF_ITEMS: usize = 4;

impl DropTree {
    pub(crate) fn new(boxes: &[Aabb]) -> Self {
        let mut items: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = Vec::with_capacity(boxes.len());
        if !items.is_empty() {
            split(boxes, &mut items, 0, &mut nodes);
        }
        DropTree { nodes, items }
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
        let mut stack = [(0u32, 0.0f64); 96];
        let mut depth = 0;
        if let Some(root) = self.nodes.first() {
            stack[0] = (0, root.bound(x, y, r));
            depth = 1;
        }
        while depth > 0 {
            depth -= 1;
            let (index, bound) = stack[depth];
            let node = &self.nodes[index as usize];
            if bound <= floor.z || floor.clears_box(node.x, node.y, node.top) {
                continue;
            }
            if node.count > 0 {
                let first = node.at as usize;
                for &item in &self.items[first..first + node.count as usize] {
                    floor = visit(item);
                }
                continue;
            }
            let (a, b) = (index + 1, node.at);
            let (za, zb) = (self.nodes[a as usize].bound(x, y, r), self.nodes[b as usize].bound(x, y, r));
            let (low, high) = if za <= zb { ((a, za), (b, zb)) } else { ((b, zb), (a, za)) };
            for child in [low, high] {
                if child.1 > floor.z {
                    stack[depth] = child;
                    depth += 1;
                }
            }
        }
    }

    /// Visits every item on which a ball of radius `r` somewhere over the rectangle could rest with its centre
    /// above `low`.
    pub(crate) fn over(&self, [x, y]: [[f64; 2]; 2], r: f64, low: f64, mut visit: impl FnMut(u32)) {
        let mut stack = vec![0u32];
        while let Some(index) = stack.pop() {
            let Some(node) = self.nodes.get(index as usize) else { continue };
            let (dx, dy) = (apart(node.x, x), apart(node.y, y));
            if node.highest(dx * dx + dy * dy, r) <= low {
                continue;
            }
            if node.count > 0 {
                let first = node.at as usize;
                self.items[first..first + node.count as usize].iter().for_each(|&item| visit(item));
            } else {
                stack.extend([node.at, index + 1]);
            }
        }
    }
}

/// Distance between two ranges.
fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[1]).max(b[0] - a[1]).max(0.0)
}

impl Node {
    /// No ball of radius `r` at `(x, y)` can rest on anything in the box with its centre above this.
    fn bound(&self, x: f64, y: f64, r: f64) -> f64 {
        let (dx, dy) = (apart(self.x, [x, x]), apart(self.y, [y, y]));
        self.highest(dx * dx + dy * dy, r)
    }

    /// Where the centre of a ball is at most that rests on the box from this far (horizontally, squared).
    fn highest(&self, distance2: f64, r: f64) -> f64 {
        if distance2 >= r * r { f64::NEG_INFINITY } else { self.top + (r * r - distance2).sqrt() }
    }
}

/// Median split along the longer side of the centres; the tree's depth is at most log₂ of the items.
fn split(boxes: &[Aabb], items: &mut [u32], offset: u32, nodes: &mut Vec<Node>) {
    let all = items.iter().fold(Aabb::empty(), |b, &i| b.union(&boxes[i as usize]));
    let node = nodes.len();
    nodes.push(Node {
        x: [all.min.x, all.max.x],
        y: [all.min.y, all.max.y],
        top: all.max.z,
        at: offset,
        count: items.len() as u32,
    });
    if items.len() <= LEAF_ITEMS {
        return;
    }
    let centres = Aabb::of(&items.iter().map(|&i| boxes[i as usize].centre()).collect::<Vec<_>>());
    let size = centres.max - centres.min;
    let axis = size.imax();
    let middle = items.len() / 2;
    let key = |i: u32| boxes[i as usize].min[axis] + boxes[i as usize].max[axis];
    items.select_nth_unstable_by(middle, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
    let (low, high) = items.split_at_mut(middle);
    split(boxes, low, offset, nodes);
    let second = nodes.len() as u32;
    split(boxes, high, offset + middle as u32, nodes);
    nodes[node].at = second;
    nodes[node].count = 0;
}
