//! Pieces of the borders of trimmed faces: what their triangles cut off beside a bent border lies on these.

use claymill_nurbs::{Curve2, Face, FaceId, Leaves, Model, Point3};
use rayon::prelude::*;

/// Pieces bow out by no more than this, mm, unless they have been halved so often.
const SAG_MM: f64 = 0.02;
const HALVINGS: u32 = 10;
/// How much more than halfway a piece may bow out elsewhere.
const MARGIN: f64 = 1.3;

/// A piece of a border.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EdgePiece {
    pub(crate) face: FaceId,
    /// Which of the face's borders, and where on it.
    pub(crate) curve: usize,
    pub(crate) t: [f64; 2],
    /// Its ends on the model, mm.
    pub(crate) ends: [Point3; 2],
    /// How far it bows out, mm.
    pub(crate) sag_mm: f64,
}

/// The borders of trimmed faces, face by face; other faces end where their triangles do.
pub(crate) fn borders(model: &Model) -> Vec<Vec<Curve2>> {
    let of_face = |face: &Face| -> Vec<Curve2> {
        if face.loops.is_empty() {
            return Vec::new();
        }
        face.boundary().into_iter().flat_map(|l| l.edges).map(|e| e.pcurve).collect()
    };
    model.faces.par_iter().map(of_face).collect()
}

/// Both halves of a piece.
pub(crate) fn halves(leaves: &Leaves, curve: &Curve2, piece: &EdgePiece) -> [EdgePiece; 2] {
    let t = 0.5 * (piece.t[0] + piece.t[1]);
    let middle = leaves.point_on(curve, t);
    let half = |t: [f64; 2], ends: [Point3; 2]| {
        let bow = leaves.point_on(curve, 0.5 * (t[0] + t[1]));
        let sag_mm = MARGIN * (bow - nalgebra::center(&ends[0], &ends[1])).norm();
        EdgePiece { t, ends, sag_mm, ..*piece }
    };
    [half([piece.t[0], t], [piece.ends[0], middle]), half([t, piece.t[1]], [middle, piece.ends[1]])]
}

/// All pieces of the borders of a face.
pub(crate) fn pieces(face: FaceId, leaves: &Leaves, curves: &[Curve2]) -> Vec<EdgePiece> {
    let mut found = Vec::new();
    for (curve, pcurve) in curves.iter().enumerate() {
        let mut knots: Vec<f64> = pcurve.knots().as_slice().to_vec();
        let (from, to) = pcurve.domain();
        knots.retain(|k| (from..=to).contains(k));
        knots.dedup();
        for span in knots.windows(2) {
            let t = [span[0], span[1]];
            let ends = t.map(|t| leaves.point_on(pcurve, t));
            let whole = EdgePiece { face, curve, t, ends, sag_mm: f64::INFINITY };
            let mut open = vec![(whole, HALVINGS)];
            while let Some((piece, halvings)) = open.pop() {
                if piece.sag_mm <= SAG_MM || halvings == 0 {
                    found.push(piece);
                } else {
                    open.extend(halves(leaves, pcurve, &piece).map(|half| (half, halvings - 1)));
                }
            }
        }
    }
    found
}
