use crate::{Aabb, Point3, Vector3};

/// A binary hierarchy of boxes over items `0..n`, children's boxes stored with the parent.
#[derive(Debug)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// The only child, when there are fewer than two items.
    root: Option<u32>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    boxes: [Box32; 2],
    children: [u32; 2],
}

/// A box in single precision, rounded outward.
#[derive(Debug, Clone, Copy)]
struct Box32 {
    min: [f32; 3],
    max: [f32; 3],
}

/// Set in a child that is an item.
const ITEM: u32 = 1 << 31;
/// Levels of surface-area splits before halving by count; bounds the stack of a search.
const LARGEST_SAH_DEPTH: usize = 40;
const STACK: usize = 80;
const BINS: usize = 16;

impl Tree {
    pub(super) fn new(boxes: &[Aabb]) -> Self {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = Vec::with_capacity(boxes.len());
        let root = (!order.is_empty()).then(|| build(boxes, &mut order, 0, &mut nodes));
        Tree { nodes, root }
    }

    /// Visits items nearest box first, while the squared distance of their box is below the bound that
    /// `visit` returns; `visit` gets the item and answers with the new bound.
    pub(super) fn search(&self, p: &Point3, mut bound: f64, mut visit: impl FnMut(usize) -> f64) {
        let Some(root) = self.root else { return };
        let mut stack = [(0u32, 0.0f64); STACK];
        stack[0] = (root, 0.0);
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (mut child, distance) = stack[height];
            if distance >= bound {
                continue;
            }
            loop {
                if child & ITEM != 0 {
                    bound = visit((child & !ITEM) as usize);
                    break;
                }
                let node = &self.nodes[child as usize];
                let (a, b) = (node.boxes[0].distance_squared(p), node.boxes[1].distance_squared(p));
                let (near, far) = if a <= b { (0, 1) } else { (1, 0) };
                let (d_near, d_far) = if a <= b { (a, b) } else { (b, a) };
                if d_far < bound {
                    stack[height] = (node.children[far], d_far);
                    height += 1;
                }
                if d_near >= bound {
                    break;
                }
                child = node.children[near];
            }
        }
    }

    /// Visits the items whose boxes meet the line from `origin` along a unit vector.
    pub(super) fn along(&self, origin: &Point3, unit: &Vector3, length: f64, mut visit: impl FnMut(usize)) {
        let mut stack: Vec<u32> = self.root.into_iter().collect();
        while let Some(child) = stack.pop() {
            if child & ITEM != 0 {
                visit((child & !ITEM) as usize);
                continue;
            }
            let node = &self.nodes[child as usize];
            let met = node.boxes.iter().zip(node.children).filter(|(b, _)| b.meets(origin, unit, length));
            stack.extend(met.map(|(_, child)| child));
        }
    }
}

impl Box32 {
    /// Whether a line meets the box, by its stretches between opposite sides.
    fn meets(&self, origin: &Point3, unit: &Vector3, length: f64) -> bool {
        let (mut from, mut to) = (0.0f64, length);
        for k in 0..3 {
            let (low, high) = (f64::from(self.min[k]) - origin[k], f64::from(self.max[k]) - origin[k]);
            if unit[k].abs() < f64::MIN_POSITIVE {
                if low > 0.0 || high < 0.0 {
                    return false;
                }
                continue;
            }
            let (a, b) = (low / unit[k], high / unit[k]);
            (from, to) = (from.max(a.min(b)), to.min(a.max(b)));
        }
        // The boxes are rounded outward by more than this rounds.
        from <= to + 1e-9
    }

    fn around(b: &Aabb) -> Self {
        let down = |x: f64| (x as f32).next_down();
        let up = |x: f64| (x as f32).next_up();
        Box32 {
            min: [down(b.min.x), down(b.min.y), down(b.min.z)],
            max: [up(b.max.x), up(b.max.y), up(b.max.z)],
        }
    }

    #[inline]
    fn distance_squared(&self, p: &Point3) -> f64 {
        let outside = |k: usize| (f64::from(self.min[k]) - p[k]).max(p[k] - f64::from(self.max[k])).max(0.0);
        let (x, y, z) = (outside(0), outside(1), outside(2));
        x * x + y * y + z * z
    }
}

/// Builds the subtree over `items`; returns its child word.
fn build(boxes: &[Aabb], items: &mut [u32], depth: usize, nodes: &mut Vec<Node>) -> u32 {
    if let [item] = items {
        return *item | ITEM;
    }
    let middle = split(boxes, items, depth);
    let around = |items: &[u32]| {
        let union = items.iter().fold(Aabb::empty(), |b, &i| b.union(&boxes[i as usize]));
        Box32::around(&union)
    };
    let index = nodes.len();
    let (low, high) = items.split_at_mut(middle);
    nodes.push(Node { boxes: [around(low), around(high)], children: [0; 2] });
    let children = [build(boxes, low, depth + 1, nodes), build(boxes, high, depth + 1, nodes)];
    nodes[index].children = children;
    index as u32
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
