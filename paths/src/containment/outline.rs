//! The borders of what is cut, seen along a tool axis.

use std::ops::ControlFlow;

use claymill_contact::{Covering, distance_from, larger_than_usual};
use claymill_nurbs::{Aabb, BoxTree, FaceMesh, Point2, Point3, Vector2};
use rayon::prelude::*;

use crate::Frame;
use crate::setup::in_triangle::contains;

/// Edges are looked at in pieces of this length, mm.
const PIECE_MM: f64 = 2.0;
/// A piece is a border if what is cut covers only one side of it, or none, so far away, mm: triangles leave trim curves by less, and
/// narrower gaps between faces do not count.
const ASIDE_MM: f64 = 0.3;

/// Pieces of edges, and of folds of faces, that have what is cut on one side only.
pub(crate) struct Outline {
    cover: Cover,
    aside_mm: f64,
    pieces: Vec<[Point2; 2]>,
    tree: BoxTree,
}

impl Outline {
    /// Of the faces that are not `excluded`, covered for a ball.
    pub(crate) fn new(covering: &Covering, excluded: &[bool], frame: &Frame, radius_mm: f64) -> Self {
        let cover = Cover::new(covering, excluded, frame);
        let aside_mm = ASIDE_MM * larger_than_usual(radius_mm);
        let is_cut = |face: usize| !excluded[face];
        let folds = covering.meshes().iter().enumerate().filter(|(face, _)| is_cut(*face));
        let folds = folds.flat_map(|(_, mesh)| folds_of(mesh, frame));
        let edges: Vec<[Point3; 2]> = covering.edges_of(is_cut).chain(folds).collect();
        let of_edge = |ends: &[Point3; 2]| {
            let [a, b] = ends.map(|p| frame.to_setup(&p).xy());
            let count = ((b - a).norm() / PIECE_MM).ceil().max(1.0) as u32;
            let place = move |k: u32| a + (b - a) * (f64::from(k) / f64::from(count));
            (0..count).map(move |k| [place(k), place(k + 1)])
        };
        let is_border = |[a, b]: &[Point2; 2]| {
            let middle = nalgebra::center(a, b);
            let Some(along) = (b - a).try_normalize(0.0) else { return false };
            let left = Vector2::new(-along.y, along.x) * aside_mm;
            !(cover.holds(&(middle + left)) && cover.holds(&(middle - left)))
        };
        let pieces: Vec<[Point2; 2]> =
            edges.par_iter().flat_map_iter(of_edge).filter(|piece| is_border(piece)).collect();
        let boxes: Vec<Aabb> = pieces.iter().map(|piece| flat_box(piece)).collect();
        Outline { cover, aside_mm, tree: BoxTree::new(&boxes), pieces }
    }

    /// Whether a place is over what is cut, or as near to it as the borders tell.
    pub(crate) fn is_over_cut(&self, at: &Point2) -> bool {
        let asides = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
        asides.iter().any(|&aside| self.cover.holds(&(at + Vector2::from(aside) * self.aside_mm)))
    }

    /// Whether a border is nearer to a place than this, mm.
    pub(crate) fn comes_within(&self, at: &Point2, mm: f64) -> bool {
        let low = Point2::new(at.x - mm, at.y - mm);
        let high = Point2::new(at.x + mm, at.y + mm);
        self.any([low, high], |piece| distance_from(piece, at) < mm)
    }

    /// Whether a border is crossed on the straight way between two places.
    pub(crate) fn is_crossed(&self, from: &Point2, to: &Point2) -> bool {
        self.any([from.inf(to), from.sup(to)], |[a, b]| {
            let side = |p: &Point2, q: &Point2, r: &Point2| (q - p).perp(&(r - p));
            side(a, b, from) * side(a, b, to) < 0.0 && side(from, to, a) * side(from, to, b) <= 0.0
        })
    }

    fn any(&self, range: [Point2; 2], is_met: impl Fn(&[Point2; 2]) -> bool) -> bool {
        any(&self.tree, &range, |piece| is_met(&self.pieces[piece]))
    }
}

/// Edges of a mesh at which it folds over, seen along a tool axis.
fn folds_of(mesh: &FaceMesh, frame: &Frame) -> Vec<[Point3; 2]> {
    let mut sides: Vec<([u32; 2], bool)> = Vec::with_capacity(3 * mesh.triangles.len());
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| frame.to_setup(&mesh.points[i as usize]).xy());
        let is_up = (b - a).perp(&(c - a)) > 0.0;
        sides.extend((0..3).map(|k| (t[k], t[(k + 1) % 3])).map(|(i, j)| ([i.min(j), i.max(j)], is_up)));
    }
    sides.sort_unstable();
    let folds = sides.windows(2).filter(|w| w[0].0 == w[1].0 && w[0].1 != w[1].1);
    folds.map(|w| w[0].0.map(|i| mesh.points[i as usize])).collect()
}

/// Triangles of what is cut, seen along a tool axis.
struct Cover {
    triangles: Vec<[Point2; 3]>,
    tree: BoxTree,
}

impl Cover {
    fn new(covering: &Covering, excluded: &[bool], frame: &Frame) -> Self {
        let cut = covering.meshes().iter().zip(excluded).filter(|(_, excluded)| !**excluded);
        let triangles: Vec<[Point2; 3]> = cut
            .flat_map(|(mesh, _)| {
                mesh.triangles.iter().map(|t| t.map(|i| frame.to_setup(&mesh.points[i as usize]).xy()))
            })
            .collect();
        let boxes: Vec<Aabb> = triangles.iter().map(|t| flat_box(t)).collect();
        Cover { tree: BoxTree::new(&boxes), triangles }
    }

    fn holds(&self, at: &Point2) -> bool {
        any(&self.tree, &[*at, *at], |triangle| contains(&self.triangles[triangle], *at))
    }
}

fn flat_box(corners: &[Point2]) -> Aabb {
    let corners: Vec<Point3> = corners.iter().map(|p| Point3::new(p.x, p.y, 0.0)).collect();
    Aabb::of(&corners)
}

/// Whether an item whose box meets a range in the plane is met.
fn any(tree: &BoxTree, [low, high]: &[Point2; 2], is_met: impl Fn(usize) -> bool) -> bool {
    let meets = |b: &Aabb| (0..2).all(|k| b.min[k] <= high[k] && low[k] <= b.max[k]);
    let mut found = false;
    let visit = |item: usize| {
        found = is_met(item);
        if found { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    tree.visit(|boxes| boxes.each(meets), visit);
    found
}
