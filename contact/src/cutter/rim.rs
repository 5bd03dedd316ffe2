//! Rims of trimmed faces beside a tool: whether they are clear of it, and by how much.
//!
//! A sheet goes on beyond its trims. Where its rim is clear of a tool that is swollen by twice the distance of a triangle from the
//! sheet, nothing of that triangle inside the trims holds the tool (docs/theory.md §6.6).

use super::Body;
use crate::BallDrop;
use crate::covering::EdgePiece;

/// Pieces of a rim are halved until they are within this share of what a body is swollen by, and so often at most.
const SHARE: f64 = 0.25;
const MOST_HALVINGS: usize = 200;

/// What is known of rims beside some bodies that make a tool together.
pub(super) struct Rims<'a> {
    sheets: &'a BallDrop<'a>,
    bodies: &'a [Body],
    at: [f64; 2],
    seen: Vec<Rim>,
}

/// The rim of a face beside one body.
struct Rim {
    face: u32,
    body: usize,
    /// Swollen by so much the body is clear of it, mm.
    clear_mm: f64,
    /// Swollen by so much it is not, as far as has been looked, mm.
    held_mm: f64,
    /// Pieces that may hold it swollen by so much, or by less, mm.
    near: Option<(f64, Vec<EdgePiece>)>,
}

impl<'a> Rims<'a> {
    pub(super) fn new(sheets: &'a BallDrop, bodies: &'a [Body], at: [f64; 2]) -> Self {
        Rims { sheets, bodies, at, seen: Vec::new() }
    }

    /// Whether the rim of a face holds a swollen body no higher than this, which from question to question may only rise.
    pub(super) fn is_clear(&mut self, face: u32, body: usize, swollen_mm: f64, high: f64) -> bool {
        let known = self.seen.iter().position(|rim| (rim.face, rim.body) == (face, body));
        let known = known.unwrap_or_else(|| {
            let (clear_mm, held_mm) = (f64::NEG_INFINITY, f64::INFINITY);
            self.seen.push(Rim { face, body, clear_mm, held_mm, near: None });
            self.seen.len() - 1
        });
        let Rim { clear_mm, held_mm, .. } = self.seen[known];
        if swollen_mm <= clear_mm || swollen_mm >= held_mm {
            return swollen_mm <= clear_mm;
        }
        let may_hold = |piece: &EdgePiece| self.may_hold(piece, body, swollen_mm, high);
        let near: Vec<EdgePiece> = match &self.seen[known].near {
            Some((most_mm, near)) if swollen_mm <= *most_mm => {
                near.iter().filter(|piece| may_hold(piece)).cloned().collect()
            }
            _ => self.rim_of(face).filter(|piece| may_hold(piece)).cloned().collect(),
        };
        let mut open = near.clone();
        let mut is_clear = false;
        for _ in 0..MOST_HALVINGS {
            is_clear = open.is_empty();
            let Some(piece) = open.pop().filter(|piece| piece.deviation_mm > SHARE * swollen_mm) else {
                break;
            };
            open.extend(halves(self.sheets, &piece).into_iter().filter(may_hold));
        }
        let rim = &mut self.seen[known];
        rim.near = Some((swollen_mm, near));
        *if is_clear { &mut rim.clear_mm } else { &mut rim.held_mm } = swollen_mm;
        is_clear
    }

    /// The pieces of the rim of a face, which lie one after the other.
    fn rim_of(&self, face: u32) -> impl Iterator<Item = &'a EdgePiece> + use<'a> {
        let edges = &self.sheets.edges;
        let first = edges.partition_point(|piece| piece.face < face);
        edges[first..].iter().take_while(move |piece| piece.face == face)
    }

    fn may_hold(&self, piece: &EdgePiece, body: usize, swollen_mm: f64, high: f64) -> bool {
        let by_mm = piece.deviation_mm + swollen_mm;
        let held = self.bodies[body].on_segment(&piece.a, &piece.b, self.at, by_mm, high);
        held.is_some_and(|(tip, _)| tip > high)
    }
}

/// Both halves of a piece of a rim.
pub(super) fn halves(sheets: &BallDrop, piece: &EdgePiece) -> [EdgePiece; 2] {
    let face = &sheets.faces[piece.face as usize];
    let (t0, t1) = piece.t;
    let t = 0.5 * (t0 + t1);
    let m = face.leaves.point_on(&face.boundary[piece.pcurve as usize], t);
    // Second derivatives make the distance a quarter.
    let deviation_mm = 0.25 * piece.deviation_mm;
    [
        EdgePiece { t: (t0, t), b: m, deviation_mm, ..*piece },
        EdgePiece { t: (t, t1), a: m, deviation_mm, ..*piece },
    ]
}
