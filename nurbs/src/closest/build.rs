use super::net::{Direction, Net};
use super::piece::Piece;
use super::rim::{self, Chord, RimPiece};
use crate::{Curve2, Domain, Face, FaceId, KnotVector, NurbsSurface};

/// A piece is cut while its box is thicker than this part of its length.
const LARGEST_THICKNESS: f64 = 0.1;
/// A piece is cut while the distance may have several minima on it for a query this near, mm (or half its
/// own size, if that is less): the usual distance of a ball's centre.
const REACH_MM: f64 = 20.0;
/// Pieces that rims run through are cut down to about this size, so that little of them is outside, mm.
const MIXED_SIZE_MM: f64 = 5.0;
/// Cuts of one Bézier piece, at most.
const LARGEST_DEPTH: usize = 8;
/// A trim curve this near a side of the parameter rectangle (relative to its width) lies on it.
const ON_SIDE: f64 = 1e-12;

/// What the search needs to know of one face.
#[derive(Debug, Default)]
pub(super) struct Parts {
    pub(super) pieces: Vec<Piece>,
    pub(super) rims: Vec<RimPiece>,
    pub(super) trim: Trim,
}

/// The trimming of one face.
#[derive(Debug, Default)]
pub(super) struct Trim {
    /// `None` when the face is its whole surface.
    pub(super) domain: Option<Domain>,
    /// Trim curves, loop by loop.
    pub(super) edges: Vec<Curve2>,
    /// The surface has lines at which it is only continuous.
    pub(super) creased: bool,
}

/// Cuts a face into pieces and rims.
pub(super) fn parts(id: FaceId, face: &Face) -> Parts {
    let surface = &face.surface;
    let creases = [creases(surface.knots_u()), creases(surface.knots_v())];
    let edges: Vec<Curve2> = (face.loops.iter().flat_map(|l| &l.edges)).map(|e| e.pcurve.clone()).collect();
    let aside: Vec<bool> = edges.iter().map(|e| lies_on_a_side(surface, e)).collect();
    let mut parts = Parts::default();
    let mut chords = Vec::new();
    // Rims along the sides alone leave every piece wholly inside or outside, and the pieces' own sides do
    // for rims. Next to other rims they are needed: see `Search::visit_piece`.
    if aside.contains(&false) {
        for (k, edge) in edges.iter().enumerate() {
            for (piece, chord) in rim::cut(surface, edge, (id, k), &creases) {
                parts.rims.push(piece);
                if !aside[k] {
                    chords.push(chord);
                }
            }
        }
    }
    parts.trim = Trim {
        domain: (!edges.is_empty()).then(|| Domain::new(face)),
        edges,
        creased: creases.iter().any(|k| !k.is_empty()),
    };
    let chords: Vec<&Chord> = chords.iter().collect();
    for net in Net::pieces(surface) {
        refine(net, id, &chords, 0, &mut parts);
    }
    parts
}

fn refine(net: Net, face: FaceId, chords: &[&Chord], depth: usize, parts: &mut Parts) {
    let met: Vec<&Chord> = chords.iter().filter(|c| c.meets(net.u, net.v)).copied().collect();
    if met.is_empty()
        && let Some(domain) = &parts.trim.domain
        && !domain.contains(0.5 * (net.u.0 + net.u.1), 0.5 * (net.v.0 + net.v.1))
    {
        return;
    }
    let piece = Piece::new(net, face, !met.is_empty());
    match (depth < LARGEST_DEPTH).then(|| cut(&piece)).flatten() {
        Some(direction) => {
            for half in piece.net.cut(direction, 0.5) {
                refine(half, face, &met, depth + 1, parts);
            }
        }
        None => parts.pieces.push(piece),
    }
}

/// Where to cut a piece, if at all.
fn cut(piece: &Piece) -> Option<Direction> {
    let [x, y, thickness] = piece.extent();
    let size = x.max(y);
    if thickness > LARGEST_THICKNESS * size || !piece.is_tame_within(REACH_MM.min(0.5 * size)) {
        Some(piece.bent_direction())
    } else {
        (piece.mixed && size > MIXED_SIZE_MM).then(|| piece.longer_direction())
    }
}

/// Inner knots at which a surface is only continuous.
fn creases(knots: &KnotVector) -> Vec<f64> {
    let breaks = knots.breaks();
    (breaks[1..breaks.len() - 1].iter().copied())
        .filter(|&k| knots.multiplicity(k) >= knots.degree())
        .collect()
}

/// Whether the trim curve runs along one side of the surface's parameter rectangle.
fn lies_on_a_side(surface: &NurbsSurface, edge: &Curve2) -> bool {
    let (u, v) = surface.domain();
    [u, v].iter().enumerate().any(|(axis, &(a, b))| {
        let slack = ON_SIDE * (b - a);
        [a, b].iter().any(|side| edge.points().iter().all(|p| (p[axis] - side).abs() <= slack))
    })
}
