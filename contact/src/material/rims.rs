//! Open borders of faces, over which a ball must not roll to the side of the material.

use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, BoxTree, FaceId, Model, Point3, Vector3};

use crate::Frame;
use crate::material::free_sides::FreeSides;

/// Rims are looked at in pieces of this length, mm, and a ball that touches an edge this near to one rolls over it.
const PIECE_MM: f64 = 2.0;
const NEAR_MM: f64 = 0.1;
/// Pieces of one stretch at most.
const MOST_PIECES: f64 = 20_000.0;
/// Open borders may be of the same opening where they are no farther from each other than this, in ball radii.
const NEXT_RADII: f64 = 0.5;
/// A ball may lean over a rim by this much (sine), where the piece's normal is not exactly that of the place.
const LEANS: f64 = 0.02;

/// A stretch of a face's border beside which there is no other face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpenStretch {
    /// Index of the face.
    pub face: FaceId,
    /// Index of the loop in the face's boundary.
    pub loop_index: usize,
    /// Index of the edge in the loop.
    pub edge_index: usize,
    /// Where the stretch begins and ends, as parameters of the edge's pcurve.
    pub range: [f64; 2],
    /// Its length, mm.
    pub length_mm: f64,
}

/// The free borders of faces with a material side, as a setup sees them.
#[derive(Debug, Default)]
pub struct Rims {
    /// Ends of each piece, and the normal on the free side.
    pieces: Vec<([Point3; 2], Vector3)>,
    tree: Option<BoxTree>,
}

impl Rims {
    /// The rims among the open borders of a model: those of faces of which one side only is free.
    #[must_use]
    pub fn new(model: &Model, open: &[OpenStretch], free: FreeSides, frame: &Frame) -> Self {
        let mut pieces = Vec::new();
        for &OpenStretch { face, loop_index, edge_index, range: [from, to], length_mm } in open {
            if free.of(face).is_both() {
                continue;
            }
            let (surface, boundary) = (&model.faces[face].surface, model.faces[face].boundary());
            let Some(edge) = boundary.get(loop_index).and_then(|l| l.edges.get(edge_index)) else { continue };
            let count = (length_mm / PIECE_MM).ceil().clamp(1.0, MOST_PIECES);
            let at = |k: f64| edge.pcurve.point(from + (to - from) * k / count);
            for k in 0..count as u32 {
                let k = f64::from(k);
                let middle = at(k + 0.5);
                let Some((n, _)) = surface.normal(middle.x, middle.y) else { continue };
                let n = if free.allow(face, true) { n } else { -n };
                let ends = [at(k), at(k + 1.0)].map(|p| frame.to_setup(&surface.point(p.x, p.y)));
                pieces.push((ends, frame.to_setup(&n.into()).coords));
            }
        }
        let boxes: Vec<Aabb> = pieces.iter().map(|(ends, _)| Aabb::of(ends).inflated(NEAR_MM)).collect();
        Rims { tree: (!boxes.is_empty()).then(|| BoxTree::new(&boxes)), pieces }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Whether a ball may get through an opening: the border of one that it passes is at least as long as its equator. Files leave
    /// gaps of which the borders are shorter.
    #[must_use]
    pub fn let_through(&self, radius_mm: f64) -> bool {
        let length_mm = |k: usize| (self.pieces[k].0[1] - self.pieces[k].0[0]).norm();
        let equator_mm = std::f64::consts::TAU * radius_mm;
        let Some(tree) = &self.tree else { return false };
        if (0..self.pieces.len()).map(length_mm).sum::<f64>() < equator_mm {
            return false;
        }
        // Pieces of the border of one opening follow each other.
        let mut met = vec![false; self.pieces.len()];
        (0..self.pieces.len()).any(|first| {
            let (mut border_mm, mut open) = (0.0, Vec::new());
            if !std::mem::replace(&mut met[first], true) {
                open.push(first);
            }
            while let Some(piece) = open.pop().filter(|_| border_mm < equator_mm) {
                border_mm += length_mm(piece);
                let around = Aabb::of(&self.pieces[piece].0).inflated(NEXT_RADII * radius_mm);
                let visit = |next: usize| {
                    if !std::mem::replace(&mut met[next], true) {
                        open.push(next);
                    }
                    ControlFlow::Continue(())
                };
                tree.visit(|boxes| boxes.each(|b| b.meets(&around)), visit);
            }
            border_mm >= equator_mm
        })
    }

    /// Whether a ball that touches an edge at a place, and is in this direction from there, has rolled over a rim.
    pub(crate) fn is_rolled_over(&self, at: &Point3, away: &Vector3) -> bool {
        let Some(tree) = &self.tree else { return false };
        let holds = |b: &Aabb| (0..3).all(|k| b.min[k] <= at[k] && at[k] <= b.max[k]);
        let (mut nearest_mm, mut leans) = (NEAR_MM, 0.0);
        let visit = |piece: usize| {
            let ([a, b], normal) = &self.pieces[piece];
            let along = b - a;
            let share = ((at - a).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            let mm = (at - (a + along * share)).norm();
            // At a corner of the rim the piece that the ball leans over least speaks.
            if mm <= nearest_mm {
                (nearest_mm, leans) = (mm, normal.dot(away));
            }
            ControlFlow::Continue(())
        };
        tree.visit(|boxes| boxes.each(holds), visit);
        leans < -LEANS
    }
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::analytic::{Frame as Placement, plane_patch};
    use claymill_toolpath::FreeSide;

    use super::*;

    #[test]
    fn a_ball_rolls_over_the_rim_of_an_upright_plate_and_not_over_that_of_its_free_side() {
        let placement = Placement::new(Point3::origin(), Vector3::x(), Vector3::y()).unwrap();
        let plate = plane_patch(&placement, (0.0, 40.0), (0.0, 30.0)).unwrap();
        let free_x = plate.normal(20.0, 15.0).unwrap().0.x;
        let model = claymill_tests::model_of([plate]);
        let edges = model.faces[0].boundary()[0].edges.clone();
        let open: Vec<OpenStretch> = (edges.iter().enumerate())
            .map(|(edge_index, edge)| {
                let (from, to) = edge.pcurve.domain();
                OpenStretch { face: 0, loop_index: 0, edge_index, range: [from, to], length_mm: 40.0 }
            })
            .collect();
        let top = Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap()[0];
        let on_rim = |side: FreeSide, away: Vector3| {
            let sides = [side];
            let rims = Rims::new(&model, &open, FreeSides::new(&sides), &top);
            let at = top.to_setup(&Point3::new(0.0, 20.0, 30.0));
            rims.is_rolled_over(&at, &top.to_setup(&away.normalize().into()).coords)
        };
        let outward = Vector3::new(free_x, 0.0, 1.0);
        let inward = Vector3::new(-free_x, 0.0, 1.0);
        assert!(on_rim(FreeSide::Along, inward) && !on_rim(FreeSide::Along, outward));
        assert!(on_rim(FreeSide::Against, outward) && !on_rim(FreeSide::Against, inward));
        assert!(!on_rim(FreeSide::Both, inward) && !on_rim(FreeSide::Along, Vector3::z()));
    }

    #[test]
    fn a_ball_gets_through_what_has_a_border_as_long_as_its_equator() {
        let placement = Placement::new(Point3::origin(), Vector3::x(), Vector3::y()).unwrap();
        let plate = plane_patch(&placement, (0.0, 400.0), (0.0, 300.0)).unwrap();
        let model = claymill_tests::model_of([plate]);
        let ends: Vec<(f64, f64)> =
            model.faces[0].boundary()[0].edges.iter().map(|edge| edge.pcurve.domain()).collect();
        let sides = [FreeSide::Along];
        let top = Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap()[0];
        // Of sides of 400 or 300 mm the first and the last so many hundredths are open.
        let lets_through = |edges: &[usize], [first, last]: [f64; 2], radius_mm: f64| {
            let stretch = |edge_index: usize, [a, b]: [f64; 2]| {
                let (from, to) = ends[edge_index];
                let at = |share: f64| from + (to - from) * share;
                let (range, length_mm) = ([at(a), at(b)], 400.0 * (b - a));
                OpenStretch { face: 0, loop_index: 0, edge_index, range, length_mm }
            };
            let open: Vec<OpenStretch> = (edges.iter())
                .flat_map(|&k| [stretch(k, [0.0, first]), stretch(k, [1.0 - last, 1.0])])
                .collect();
            Rims::new(&model, &open, FreeSides::new(&sides), &top).let_through(radius_mm)
        };
        assert!(
            lets_through(&[0, 1, 2, 3], [0.5, 0.5], 200.0) && !lets_through(&[0, 1, 2, 3], [0.5, 0.5], 230.0)
        );
        // Two gaps at the ends of a side are two openings, those on both sides of a corner are one.
        assert!(lets_through(&[0], [0.06, 0.02], 3.0) && !lets_through(&[0], [0.04, 0.04], 3.0));
        assert!(lets_through(&[0, 1], [0.04, 0.04], 3.0));
        assert!(!lets_through(&[], [0.0, 0.0], 1e-3));
    }
}
