//! A bounding-box hierarchy over the chords of all edges. Boxes are grown by the distance of each
//! edge from its chords, so that no neighbour is missed.

use claymill_nurbs::{Aabb, Point3};

use crate::edge::Edge;

/// A chord of an edge's polyline.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Chord {
    pub(crate) edge: usize,
    pub(crate) a: Point3,
    pub(crate) b: Point3,
}

/// A hierarchy of boxes over all chords of all edges, each box grown by the distance of the edge from its
/// chord: what it does not find is not there.
#[derive(Debug)]
pub(crate) struct ChordTree {
    chords: Vec<Chord>,
    nodes: Vec<Node>,
}

#[derive(Debug)]
struct Node {
    bounds: Aabb,
    /// A leaf holds chords `first .. first + count`; an inner node (`count == 0`) has its left child next
    /// to it and its right child at `first`.
    first: usize,
    count: usize,
}

const LEAF: usize = 4;

impl ChordTree {
    pub(crate) fn new(edges: &[Edge<'_>]) -> Self {
        let mut chords: Vec<Chord> = Vec::new();
        for (i, edge) in edges.iter().enumerate() {
            let ends = edge.stations.windows(2);
            chords.extend(ends.map(|w| Chord { edge: i, a: w[0].point, b: w[1].point }));
        }
        let mut tree = ChordTree { nodes: Vec::with_capacity(chords.len()), chords };
        if !tree.chords.is_empty() {
            tree.build(edges, 0, tree.chords.len());
        }
        tree
    }

    fn build(&mut self, edges: &[Edge<'_>], from: usize, to: usize) {
        let mut bounds = Aabb::empty();
        let mut middles = Aabb::empty();
        for chord in &self.chords[from..to] {
            let grown = Aabb::of([&chord.a, &chord.b]).inflated(edges[chord.edge].sagitta_mm);
            bounds = bounds.union(&grown);
            middles.add(&nalgebra::center(&chord.a, &chord.b));
        }
        let node = self.nodes.len();
        let leaf = to - from <= LEAF;
        self.nodes.push(Node { bounds, first: from, count: if leaf { to - from } else { 0 } });
        if leaf {
            return;
        }
        let axis = (middles.max - middles.min).imax();
        let half = (to - from) / 2;
        let key = |c: &Chord| c.a[axis] + c.b[axis];
        self.chords[from..to].select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)));
        self.build(edges, from, from + half);
        self.nodes[node].first = self.nodes.len();
        self.build(edges, from + half, to);
    }

    /// Calls `found` with every chord whose box touches `query`.
    pub(crate) fn touching(&self, query: &Aabb, mut found: impl FnMut(&Chord)) {
        let apart = |b: &Aabb| (0..3).any(|k| b.min[k] > query.max[k] || b.max[k] < query.min[k]);
        let mut stack = vec![0];
        while let Some(index) = stack.pop() {
            let Some(node) = self.nodes.get(index) else {
                continue;
            };
            if apart(&node.bounds) {
                continue;
            }
            if node.count > 0 {
                self.chords[node.first..node.first + node.count].iter().for_each(&mut found);
            } else {
                stack.extend([node.first, index + 1]);
            }
        }
    }
}
