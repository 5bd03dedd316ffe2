//! Whether a ball may get behind the faces of a model, to the side of the material.
//!
//! ```text
//!    ──────╮  ╭──────     It has to pass an opening, and the border of that is at least as long as the ball's equator. Files
//!          │••│           leave gaps between faces that are far shorter: behind them nothing has to be looked for.
//! ```

use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, BoxTree, Model, Point3};
use rayon::prelude::*;

use crate::scene::Scene;

/// Borders are looked at in pieces of this length, in ball radii, and no longer than this, mm.
const PIECE_RADII: f64 = 0.25;
const PIECE_MM: f64 = 1.0;
/// Pieces of one edge at most.
const MOST_PIECES: usize = 10_000;
/// A piece is not open where another edge is this near, mm: chords of both included.
const JOINED_MM: f64 = 0.1;

/// A piece of the border of a face.
struct Piece {
    ends: [Point3; 2],
    /// Face, loop and edge.
    of: [usize; 3],
}

/// Whether the open borders of faces with a free side are as long in all as the equator of a ball.
pub(crate) fn let_through(scene: &Scene<'_>, radius_mm: f64) -> bool {
    let has_material = |face: usize| !scene.free_sides[face].is_both();
    open_mm(scene.model, (PIECE_RADII * radius_mm).min(PIECE_MM), &has_material)
        >= std::f64::consts::TAU * radius_mm
}

/// The length of all borders of chosen faces beside which there is no other edge, mm.
fn open_mm(model: &Model, piece_mm: f64, is_chosen: &(dyn Fn(usize) -> bool + Sync)) -> f64 {
    let pieces: Vec<Piece> =
        (0..model.faces.len()).into_par_iter().flat_map_iter(|face| pieces(model, face, piece_mm)).collect();
    if pieces.is_empty() {
        return 0.0;
    }
    let boxes: Vec<Aabb> = pieces.iter().map(|piece| Aabb::of(&piece.ends)).collect();
    let tree = BoxTree::new(&boxes);
    let is_open = |piece: &Piece| {
        let middle = nalgebra::center(&piece.ends[0], &piece.ends[1]);
        let mut is_joined = false;
        tree.visit(
            |boxes| boxes.each(|b| b.distance_squared(&middle) <= JOINED_MM * JOINED_MM),
            |k| {
                is_joined = pieces[k].of != piece.of && distance_mm(&middle, &pieces[k].ends) <= JOINED_MM;
                if is_joined { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            },
        );
        !is_joined
    };
    let length_mm = |piece: &Piece| match is_chosen(piece.of[0]) && is_open(piece) {
        true => (piece.ends[1] - piece.ends[0]).norm(),
        false => 0.0,
    };
    let lengths: Vec<f64> = pieces.par_iter().map(length_mm).collect();
    lengths.iter().sum()
}

/// The border of a face, in pieces of about a length.
fn pieces(model: &Model, face: usize, piece_mm: f64) -> Vec<Piece> {
    let surface = &model.faces[face].surface;
    let mut found = Vec::new();
    for (loop_index, of_loop) in model.faces[face].boundary().iter().enumerate() {
        for (edge, of_edge) in of_loop.edges.iter().enumerate() {
            let (from, to) = of_edge.pcurve.domain();
            let at = |share: f64| {
                let uv = of_edge.pcurve.point(from + (to - from) * share);
                surface.point(uv.x, uv.y)
            };
            let coarse: Vec<Point3> = (0..=8).map(|k| at(f64::from(k) / 8.0)).collect();
            let about_mm: f64 = coarse.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
            let count = ((about_mm / piece_mm).ceil() as usize).clamp(1, MOST_PIECES);
            let points: Vec<Point3> = (0..=count).map(|k| at(k as f64 / count as f64)).collect();
            found.extend(
                points.windows(2).map(|w| Piece { ends: [w[0], w[1]], of: [face, loop_index, edge] }),
            );
        }
    }
    found
}

fn distance_mm(p: &Point3, [a, b]: &[Point3; 2]) -> f64 {
    let along = b - a;
    let share = ((p - a).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (p - (a + along * share)).norm()
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::analytic::{Frame, plane_patch};
    use claymill_nurbs::{NurbsSurface, Vector3};

    use super::*;

    fn rectangle(corner: [f64; 3], x: Vector3, y: Vector3, sides: [f64; 2]) -> NurbsSurface {
        let frame = Frame::new(corner.into(), x.cross(&y), x).unwrap();
        plane_patch(&frame, (0.0, sides[0]), (0.0, sides[1])).unwrap()
    }

    /// A box of 20 × 12 × 8 mm with a lid that ends this far before one of its sides.
    fn boxed(gap_mm: f64) -> Model {
        let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
        let mut faces = vec![
            rectangle([0.0; 3], x, y, [20.0, 12.0]),
            rectangle([0.0; 3], x, z, [20.0, 8.0]),
            rectangle([0.0, 12.0, 0.0], x, z, [20.0, 8.0]),
            rectangle([0.0; 3], y, z, [12.0, 8.0]),
            rectangle([20.0, 0.0, 0.0], y, z, [12.0, 8.0]),
        ];
        // In two halves, whose common edge ends within the edges of sides.
        for half in [0.0, 0.5] {
            faces.push(rectangle([20.0 * half, 0.0, 8.0], x, y, [10.0, 12.0 - gap_mm]));
        }
        claymill_tests::model_of(faces)
    }

    #[test]
    fn what_is_not_beside_another_edge_is_open() {
        for (gap_mm, wanted_mm) in [(0.0, 0.0), (0.05, 0.0), (2.0, 40.0)] {
            let mm = open_mm(&boxed(gap_mm), 0.5, &|_| true);
            // The ends of the gap too, along two sides.
            let ends_mm = if wanted_mm > 0.0 { 2.0 * gap_mm } else { 0.0 };
            assert!((mm - wanted_mm - ends_mm).abs() < 1.1, "gap of {gap_mm} mm: {mm} mm");
        }
        assert!(open_mm(&boxed(2.0), 0.5, &|_| false) == 0.0);
    }
}
