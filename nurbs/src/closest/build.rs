//! Prepares faces for closest-point queries: cuts them into small Bézier pieces and rims on which
//! the distance mostly has one minimum, and drops pieces outside of the trims.

use super::net::{Direction, Net};
use super::piece::Piece;
use super::rim::{self, Chord, RimPiece};
use crate::{Curve2, Domain, Face, FaceId, KnotVector, NurbsSurface, Point3};

/// A piece is cut while its box is thicker than this part of its length.
const LARGEST_THICKNESS: f64 = 0.1;
/// A piece is cut while the distance may have several minima on it for a query this near, mm (or half its
/// own size, if that is less): the usual distance of a ball's centre.
const REACH_MM: f64 = 20.0;
/// Pieces that rims run through are cut down to about this size, so that little of them is outside, mm.
const MIXED_SIZE_MM: f64 = 5.0;
/// Cuts of one Bézier piece, at most; where it remains longer than [`REACH_MM`], twice that (a rim of a small radius
/// along the whole of a long surface).
const LARGEST_DEPTH: usize = 8;
/// A face that has so many pieces is cut no further: queries do so where they have to.
const MOST_PIECES: usize = 200_000;
/// A trim curve this near a side of the parameter rectangle (relative to its width) lies on it.
const ON_SIDE: f64 = 1e-12;
/// Sides nearer to each other, or shorter, than this are a seam or a pole, mm.
const CLOSED_MM: f64 = 1e-5;
/// Places of a side at which that is looked at.
const SIDE_PLACES: usize = 7;

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
    /// Parameters, sorted, of lines where a nearest point need not be a critical point of the distance: those
    /// at which the surface is only continuous, and sides of the parameter rectangle that no rim covers.
    pub(super) open: [Vec<f64>; 2],
}

impl Trim {
    /// Whether a line at `at` is among the open ones of `axis`.
    pub(super) fn is_open(&self, axis: usize, at: f64) -> bool {
        self.open[axis].binary_search_by(|x| x.total_cmp(&at)).is_ok()
    }

    /// The piece with this net, given the chords it may meet; `None` when it is outside of the trims.
    fn piece(&self, net: Net, face: FaceId, chords: &[Chord]) -> Option<Piece> {
        let met = self.met(&net, chords)?;
        Some(Piece::new(net, face, met, None))
    }

    /// The same for a part of a piece that is only needed for a moment.
    pub(super) fn part(&self, net: Net, of: &Piece) -> Option<Piece> {
        let met = self.met(&net, &of.chords)?;
        Some(Piece::new(net, of.face, met, Some(of)))
    }

    /// The chords that a net meets; `None` when it is outside of the trims.
    fn met(&self, net: &Net, chords: &[Chord]) -> Option<Box<[Chord]>> {
        let met: Box<[Chord]> = chords.iter().filter(|c| c.meets(net.u, net.v)).copied().collect();
        let middle = (0.5 * (net.u.0 + net.u.1), 0.5 * (net.v.0 + net.v.1));
        let outside = |d: &Domain| !d.contains(middle.0, middle.1);
        (!met.is_empty() || !self.domain.as_ref().is_some_and(outside)).then_some(met)
    }
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
    let rimmed = aside.contains(&false);
    if rimmed {
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
        open: open_lines(surface, &creases, rimmed),
    };
    for net in Net::pieces(surface) {
        let piece = parts.trim.piece(net, id, &chords);
        refine(piece, 0, &mut parts);
    }
    parts
}

fn refine(piece: Option<Piece>, depth: usize, parts: &mut Parts) {
    let Some(piece) = piece else { return };
    match cut(&piece, depth).filter(|_| parts.pieces.len() < MOST_PIECES) {
        Some(direction) => {
            for half in piece.net.cut(direction, 0.5) {
                let half = parts.trim.piece(half, piece.face, &piece.chords);
                refine(half, depth + 1, parts);
            }
        }
        None => parts.pieces.push(piece),
    }
}

/// Where to cut a piece that comes from `depth` cuts, if at all.
fn cut(piece: &Piece, depth: usize) -> Option<Direction> {
    let [x, y, thickness] = piece.extent();
    let size = x.max(y);
    if depth >= LARGEST_DEPTH && size <= REACH_MM || depth >= 2 * LARGEST_DEPTH {
        None
    } else if thickness > LARGEST_THICKNESS * size || !piece.is_tame_within(REACH_MM.min(0.5 * size)) {
        Some(if depth < LARGEST_DEPTH { piece.bent_direction() } else { piece.longer_direction() })
    } else {
        (!piece.chords.is_empty() && size > MIXED_SIZE_MM).then(|| piece.longer_direction())
    }
}

/// See [`Trim::open`]. Where rims cover the boundary, sides are still open that meet each other (a seam may
/// have a kink) or collapse to a point (an apex).
fn open_lines(surface: &NurbsSurface, creases: &[Vec<f64>; 2], rimmed: bool) -> [Vec<f64>; 2] {
    let ((u0, u1), (v0, v1)) = surface.domain();
    let sides = [[u0, u1], [v0, v1]];
    [0, 1].map(|axis| {
        let places = (0..SIDE_PLACES).map(|i| (i as f64 + 0.31) / SIDE_PLACES as f64);
        let along = |end: usize| -> Vec<Point3> {
            let at = |x: f64| {
                let across = sides[1 - axis];
                let other = across[0] + (across[1] - across[0]) * x;
                if axis == 0 {
                    surface.point(sides[0][end], other)
                } else {
                    surface.point(other, sides[1][end])
                }
            };
            places.clone().map(at).collect()
        };
        let (low, high) = (along(0), along(1));
        let meets = low.iter().zip(&high).all(|(p, q)| (p - q).norm() < CLOSED_MM);
        let collapses = |side: &[Point3]| side.iter().all(|p| (p - side[0]).norm() < CLOSED_MM);
        let mut open = creases[axis].clone();
        for (side, at) in [low, high].iter().zip(sides[axis]) {
            if !rimmed || meets || collapses(side) {
                open.push(at);
            }
        }
        open.sort_by(f64::total_cmp);
        open
    })
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
