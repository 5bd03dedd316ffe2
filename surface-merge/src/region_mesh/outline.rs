//! The boundaries of faces as polygons whose corners neighbours share.

use std::collections::BTreeMap;

use claymill_nurbs::{FaceId, Model, Point2, Point3};
use rayon::prelude::*;

use crate::disjoint_sets::DisjointSets;
use crate::edge::{self, Edge};
use crate::joint::{EdgeStretch, Joint};
use crate::tolerance::LARGEST_TOLERANCE_MM;

/// A straight side of a polygon in the parameter plane stays this near to the boundary, mm.
const BORDER_MM: f64 = 0.01;
/// A chord's largest bow as a part of its length: that of an arc of 30°.
const BOW: f64 = 0.066;
/// A stretch is halved at most this often.
const MOST_HALVINGS: usize = 6;
/// Parts of one edge to begin with, at most.
const MOST_PARTS: f64 = 1e5;
/// Corners of a polygon on a side of the parameter rectangle that is one point, a pole.
const POLE_PARTS: usize = 16;
/// Points of a polygon nearer to each other than this are one point, mm.
pub(super) const SAME_MM: f64 = 2e-5;

/// A corner of a face's polygon.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    pub(super) uv: Point2,
    pub(super) point: Point3,
    /// Corners of equal number are one vertex of the mesh.
    pub(super) node: usize,
}

/// The polygons of one face, one for each loop.
pub(super) type Polygons = Vec<Vec<Corner>>;

/// A place on a piece of boundary that becomes a corner.
#[derive(Debug, Clone, Copy)]
struct Mark {
    s: f64,
    t: f64,
    node: usize,
    is_end: bool,
}

struct Outlines<'m> {
    pieces: Vec<Edge<'m>>,
    marks: Vec<Vec<Mark>>,
    /// Parts of each piece along which a joint has set marks already, as arc lengths.
    covered: Vec<Vec<[f64; 2]>>,
    same: Vec<[usize; 2]>,
    nodes: usize,
    edge_mm: f64,
    near_mm: f64,
}

/// The polygons of `faces`, whose sides are about `edge_mm` long. Along a joint both faces have the same
/// corners: points of the first side, with the nearest points on the second.
pub(super) fn polygons(model: &Model, faces: &[FaceId], joints: &[&Joint], edge_mm: f64) -> Vec<Polygons> {
    // As fine as merging has it, so that lengths along a joint agree with what it recorded.
    let pieces = edge::edges_of(model, faces, 0.1 * crate::tolerance::SEARCH_RADIUS_MM);
    let widest = joints.iter().map(|j| j.gap_normal_mm.max.hypot(j.gap_lateral_mm.max));
    let near_mm = 2.0 * widest.fold(LARGEST_TOLERANCE_MM, f64::max);
    let mut outlines = Outlines {
        marks: vec![Vec::new(); pieces.len()],
        covered: vec![Vec::new(); pieces.len()],
        same: Vec::new(),
        nodes: 0,
        pieces,
        edge_mm,
        near_mm,
    };
    outlines.mark_ends();
    outlines.mark_joints(joints);
    outlines.gather_marks();
    outlines.fill();
    outlines.link_pieces();
    outlines.assemble(model, faces)
}

impl Outlines<'_> {
    fn node(&mut self) -> usize {
        self.nodes += 1;
        self.nodes - 1
    }

    fn mark(&mut self, piece: usize, t: f64, node: usize, is_end: bool) {
        let s = self.pieces[piece].arc_length(t);
        self.marks[piece].push(Mark { s, t, node, is_end });
    }

    fn mark_ends(&mut self) {
        for piece in 0..self.pieces.len() {
            let (t0, t1) = self.pieces[piece].ends();
            for t in [t0, t1] {
                let node = self.node();
                self.mark(piece, t, node, true);
            }
        }
    }

    fn mark_joints(&mut self, joints: &[&Joint]) {
        let mut by_edge: BTreeMap<(FaceId, usize, usize), Vec<usize>> = BTreeMap::new();
        for (k, p) in self.pieces.iter().enumerate() {
            by_edge.entry((p.face, p.loop_index, p.edge_index)).or_default().push(k);
        }
        let piece_of = |s: &EdgeStretch| {
            let middle = 0.5 * (s.from + s.to);
            let on = |k: &&usize| {
                let (t0, t1) = self.pieces[**k].ends();
                t0 <= middle && middle <= t1
            };
            by_edge.get(&(s.face, s.loop_index, s.edge_index))?.iter().find(on).copied()
        };
        let shared: Vec<_> = joints
            .par_iter()
            .filter_map(|joint| {
                let pieces = [piece_of(&joint.sides[0])?, piece_of(&joint.sides[1])?];
                let [a, b] = joint.sides.map(|s| [s.from, s.to]);
                Some((pieces, self.shared(pieces, a, b)))
            })
            .collect();
        for (pieces, pairs) in shared {
            for pair in &pairs {
                let node = self.node();
                (0..2).for_each(|side| self.mark(pieces[side], pair[side], node, false));
            }
            for side in 0..2 {
                let ends = [pairs[0], pairs[pairs.len() - 1]];
                let [s0, s1] = ends.map(|p| self.pieces[pieces[side]].arc_length(p[side]));
                self.covered[pieces[side]].push([s0.min(s1), s0.max(s1)]);
            }
        }
    }

    /// Parameters on both sides of a joint, from end to end.
    fn shared(&self, pieces: [usize; 2], on_a: [f64; 2], on_b: [f64; 2]) -> Vec<[f64; 2]> {
        let [a, b] = pieces.map(|p| &self.pieces[p]);
        let [a0, a1] = on_a.map(|t| a.arc_length(t));
        let [b0, b1] = on_b.map(|t| b.arc_length(t));
        let opposite = |x: f64| match x {
            0.0 => [on_a[0], on_b[0]],
            1.0 => [on_a[1], on_b[1]],
            x => {
                let t = a.at_length(a0 + x * (a1 - a0));
                [t, b.foot(&Point3::from(a.lift(t)[0])).t]
            }
        };
        let fine = |p: &[f64; 2], q: &[f64; 2]| is_fine(a, p[0], q[0]) && is_fine(b, p[1], q[1]);
        let pairs = self.divided((a1 - a0).abs(), opposite, fine);
        let heading = on_b[1] - on_b[0];
        if pairs.windows(2).all(|w| (w[1][1] - w[0][1]) * heading > 0.0) {
            return pairs;
        }
        // Where the nearest points do not advance, the edge is about as short as the gap is wide.
        let even = |x: f64| [a.at_length(a0 + x * (a1 - a0)), b.at_length(b0 + x * (b1 - b0))];
        vec![[on_a[0], on_b[0]], even(0.5), [on_a[1], on_b[1]]]
    }

    /// `at` for shares from 0 to 1 of a length, so close that what lies between two is `fine`.
    fn divided<T: Copy>(
        &self,
        length_mm: f64,
        at: impl Fn(f64) -> T,
        fine: impl Fn(&T, &T) -> bool,
    ) -> Vec<T> {
        let parts = (length_mm / self.edge_mm).ceil().clamp(1.0, MOST_PARTS);
        let mut found = vec![at(0.0)];
        for k in 0..parts as usize {
            let mut open = vec![(k as f64 / parts, (k as f64 + 1.0) / parts, 0)];
            while let Some((x, y, halvings)) = open.pop() {
                let (first, last) = (found[found.len() - 1], at(y));
                let short = (y - x) * length_mm < 4.0 * self.near_mm;
                if short || halvings == MOST_HALVINGS || fine(&first, &last) {
                    found.push(last);
                } else {
                    let middle = 0.5 * (x + y);
                    open.push((middle, y, halvings + 1));
                    open.push((x, middle, halvings + 1));
                }
            }
        }
        found
    }

    /// Marks that nearly coincide become one, at an end of the piece if one of them is.
    fn gather_marks(&mut self) {
        for marks in &mut self.marks {
            marks.sort_by(|a, b| a.s.total_cmp(&b.s).then(b.is_end.cmp(&a.is_end)));
            let mut kept: Vec<Mark> = Vec::with_capacity(marks.len());
            let mut last = f64::NEG_INFINITY;
            for mark in marks.iter() {
                match kept.last_mut() {
                    Some(before) if mark.s - last <= self.near_mm => {
                        self.same.push([before.node, mark.node]);
                        if mark.is_end && !before.is_end {
                            *before = *mark;
                        }
                    }
                    _ => kept.push(*mark),
                }
                last = mark.s;
            }
            *marks = kept;
        }
    }

    /// Sets marks where no joint has.
    fn fill(&mut self) {
        for piece in 0..self.pieces.len() {
            let marks = std::mem::take(&mut self.marks[piece]);
            let mut filled = Vec::with_capacity(marks.len());
            for w in marks.windows(2) {
                filled.push(w[0]);
                let middle = 0.5 * (w[0].s + w[1].s);
                if self.covered[piece].iter().any(|c| c[0] <= middle && middle <= c[1]) {
                    continue;
                }
                let edge = &self.pieces[piece];
                let at = |x: f64| edge.at_length(w[0].s + x * (w[1].s - w[0].s));
                let inner = self.divided(w[1].s - w[0].s, at, |p, q| is_fine(edge, *p, *q));
                let [_, inner @ .., _] = &inner[..] else { continue };
                for &t in inner {
                    let node = self.nodes;
                    self.nodes += 1;
                    filled.push(Mark { s: self.pieces[piece].arc_length(t), t, node, is_end: false });
                }
            }
            filled.extend(marks.last());
            self.marks[piece] = filled;
        }
    }

    /// The end of a piece is the start of the next one on its loop.
    fn link_pieces(&mut self) {
        let ring = |p: &Edge<'_>| (p.face, p.loop_index);
        let mut first = 0;
        while first < self.pieces.len() {
            let rest = &self.pieces[first..];
            let count = rest.iter().take_while(|p| ring(p) == ring(&rest[0])).count();
            for k in 0..count {
                let (this, next) = (first + k, first + (k + 1) % count);
                let (Some(end), Some(start)) = (self.marks[this].last(), self.marks[next].first()) else {
                    continue;
                };
                let place = |piece: usize, m: &Mark| self.pieces[piece].lift(m.t)[0];
                if (place(this, end) - place(next, start)).norm() <= self.near_mm {
                    self.same.push([end.node, start.node]);
                }
            }
            first += count;
        }
    }

    fn assemble(self, model: &Model, faces: &[FaceId]) -> Vec<Polygons> {
        let mut sets = DisjointSets::new(self.nodes);
        self.same.iter().for_each(|&[a, b]| {
            sets.join(a, b);
        });
        let roots: Vec<usize> = (0..self.nodes).map(|n| sets.root(n)).collect();
        let mut first = 0;
        let ranges: Vec<_> = faces
            .iter()
            .map(|&face| {
                let count = self.pieces[first..].iter().take_while(|p| p.face == face).count();
                first += count;
                (face, first - count..first)
            })
            .collect();
        let polygon = |(face, range): (FaceId, std::ops::Range<usize>)| -> Polygons {
            let f = &model.faces[face];
            let mut next = range.start;
            let mut loops = Vec::new();
            for (loop_index, ring) in f.boundary().iter().enumerate() {
                let mut corners: Vec<Corner> = Vec::new();
                for (edge_index, trim) in ring.edges.iter().enumerate() {
                    let mine = |k: usize| {
                        let p = &self.pieces[k];
                        p.loop_index == loop_index && p.edge_index == edge_index
                    };
                    let begin = next;
                    while next < range.end && mine(next) {
                        next += 1;
                    }
                    let corner = |t: f64, node: usize| {
                        let c = trim.pcurve.point(t);
                        let (u, v) = f.surface.clamp(c.x, c.y);
                        Corner { uv: Point2::new(u, v), point: f.surface.point(u, v), node }
                    };
                    for k in begin..next {
                        corners.extend(self.marks[k].iter().map(|m| corner(m.t, roots[m.node])));
                    }
                    if begin == next {
                        let (t0, t1) = trim.pcurve.domain();
                        let node = corners.last().map_or(usize::MAX, |c| c.node);
                        let at = |k: usize| t0 + (t1 - t0) * k as f64 / POLE_PARTS as f64;
                        corners.extend((0..=POLE_PARTS).map(|k| corner(at(k), node)));
                    }
                }
                let pole = corners.iter().rev().find(|c| c.node != usize::MAX).map(|c| c.node);
                corners.iter_mut().filter(|c| c.node == usize::MAX).for_each(|c| c.node = pole.unwrap_or(0));
                loops.push(without_repeats(corners, f.surface.domain()));
            }
            loops
        };
        ranges.into_par_iter().map(polygon).collect()
    }
}

/// Whether the boundary between two parameters may become one side of a polygon.
fn is_fine(edge: &Edge<'_>, t0: f64, t1: f64) -> bool {
    let t = 0.5 * (t0 + t1);
    let [a, b, c] = [t0, t1, t].map(|t| edge.pcurve.point(t));
    let [p, q, m] = [a, b, c].map(|at| edge.surface.point(at.x, at.y));
    let chord = q - p;
    let bow = (m - p).cross(&chord).norm();
    if bow > BOW * chord.norm_squared() && bow > BORDER_MM * chord.norm() {
        return false;
    }
    let (along, from) = (b - a, c - a);
    let share = from.dot(&along) / along.norm_squared();
    if !share.is_finite() {
        return true;
    }
    let foot = a + along * share;
    (edge.surface.point(foot.x, foot.y) - m).norm() <= BORDER_MM
}

/// Leaves out corners that are the vertex before them again, unless they are the same point seen at other
/// parameters (a pole).
fn without_repeats(corners: Vec<Corner>, ((u0, u1), (v0, v1)): ((f64, f64), (f64, f64))) -> Vec<Corner> {
    let repeats = |a: &Corner, b: &Corner| {
        let step = b.uv - a.uv;
        let moved = (step.x / (u1 - u0)).abs().max((step.y / (v1 - v0)).abs());
        a.node == b.node && ((b.point - a.point).norm() > SAME_MM || moved < 1e-7)
    };
    let mut kept: Vec<Corner> = Vec::with_capacity(corners.len());
    for corner in corners {
        if kept.last().is_none_or(|last| !repeats(last, &corner)) {
            kept.push(corner);
        }
    }
    while kept.len() > 1 && repeats(&kept[kept.len() - 1], &kept[0]) {
        kept.pop();
    }
    kept
}
