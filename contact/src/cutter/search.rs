//! Branch and bound for any cutter shape: pieces of the model are cut, the highest bound first,
//! until none can hold the tool higher than a contact that is found.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use claymill_nurbs::{Boxes, FaceId, Point2, Point3, Vector3};

use super::body::Rested;
use super::rim::{Rims, halves};
use super::{Body, CUTTER_EPSILON_MM, ToolPart};
use crate::covering::EdgePiece;
use crate::drop::{Triangle, weighted};
use crate::exact::shape::{Flat, Shape};
use crate::{BallDrop, CONTACT_EPSILON_MM};

/// A triangle at the rim is enlarged by this many times its own size at most, to take in what bulges beyond its chord; of
/// slivers more than that is left to the edge itself.
const LARGEST_GROWTH: f64 = 2.0;
/// Triangles cut this often that are outside the trims wherever they are looked at are outside.
const OUTSIDE_LEVEL: u32 = 4;
/// More than rounding takes from a bound, mm.
const ROUNDING_MM: f64 = 1e-9;

/// What holds a tool up.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Touch {
    /// Height of the tip, free of gouges.
    pub(crate) tip: f64,
    /// Too high by no more than this, mm.
    pub(crate) gap_mm: f64,
    pub(crate) contact: Point3,
    pub(crate) normal: Vector3,
    pub(crate) face: FaceId,
    /// Where on the face, if its inside is known to touch; or that its border does.
    pub(crate) uv: Option<[f64; 2]>,
    pub(crate) is_edge: bool,
    /// Index of the body that touches.
    pub(crate) body: usize,
}

impl Touch {
    /// Which part of a tool touches whose first body is its end.
    pub(crate) fn part(&self) -> ToolPart {
        if self.body == 0 { ToolPart::End } else { ToolPart::Side }
    }
}

/// A piece of the model and what it cannot hold the tool above.
struct Waiting<'a> {
    bound: f64,
    /// Pieces as high as each other come in the order in which they were met.
    number: usize,
    piece: Piece<'a>,
}

enum Piece<'a> {
    Sheet(Sheet<'a>),
    Edge(EdgePiece),
}

/// A triangle of the parameter plane and its corners on the surface.
#[derive(Clone, Copy)]
struct Sheet<'a> {
    of: &'a Triangle,
    uv: [Point2; 3],
    p: [Point3; 3],
    /// The surface is no further than this from the triangle's plane, and from the triangle.
    off_plane: f64,
    off_triangle: f64,
    /// Where the highest body would touch.
    at: [f64; 3],
    level: u32,
}

impl PartialEq for Waiting<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Waiting<'_> {}

impl PartialOrd for Waiting<'_> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Waiting<'_> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound).then(other.number.cmp(&self.number))
    }
}

/// How far a search goes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Effort {
    /// What would hold the tool no more than half of this above the floor does not count, mm.
    pub(crate) epsilon: f64,
    /// Once it is known to be held, its height is looked for to this, mm.
    pub(crate) known_to: f64,
    /// Pieces that are cut, at most: beside walls a height that hardly changes costs very many.
    pub(crate) cuts: usize,
}

impl Effort {
    /// For the height of an end.
    pub(crate) const FULL: Effort =
        Effort { epsilon: CUTTER_EPSILON_MM, known_to: CUTTER_EPSILON_MM, cuts: 4000 };
    /// For the heights of passes, as exact as those of balls. Where that takes long, beside walls, the search is ended early.
    pub(crate) const OF_PASS: Effort =
        Effort { epsilon: CONTACT_EPSILON_MM, known_to: CONTACT_EPSILON_MM, cuts: 250 };
    /// The same, ended late.
    pub(crate) const AT_LENGTH: Effort = Effort { cuts: 4000, ..Effort::OF_PASS };
    /// For borders of where a tool gets down, all but in touch with what keeps it off.
    pub(crate) const OF_BORDER: Effort = Effort { cuts: 2000, ..Effort::OF_PASS };
    /// For cells, of which most are far from all.
    pub(crate) const AT_A_GLANCE: Effort = Effort { cuts: 100, ..Effort::OF_PASS };
    /// For whether something is in the way of a side: how high it holds it matters little, and what grazes it, as a wall
    /// along a shank, may be taken to hold it.
    pub(crate) const IN_THE_WAY: Effort = Effort { epsilon: CUTTER_EPSILON_MM, known_to: 0.1, cuts: 60 };
}

/// What holds `bodies`, which make a tool together, with its tip above `floor`; `None` if nothing does.
pub(crate) fn held_above(
    sheets: &BallDrop,
    bodies: &[Body],
    at: [f64; 2],
    floor: f64,
    effort: Effort,
) -> Option<Touch> {
    let mut search = Search::new(sheets, bodies, at, floor, effort);
    search.gather();
    search.settle();
    let left = search.waiting.pop().filter(|left| left.bound > search.low + search.step);
    let above = search.held.filter(|_| search.low > floor + 0.5 * effort.epsilon);
    let touched = above.or_else(|| left.as_ref().map(|left| search.supposed(&left.piece)))?;
    let high = left.map_or(f64::NEG_INFINITY, |left| left.bound);
    let tip = (high + search.step).max(search.low + 2.0 * search.step);
    Some(Touch { tip, gap_mm: tip - search.low, ..touched })
}

/// What is known of a tool that stands with its tip on a floor.
pub(crate) enum Stand {
    Free,
    /// The first point that was found in its way.
    Held(Touch),
    Unknown,
}

/// Whether a tool can stand with its tip on a floor.
pub(crate) fn stand(sheets: &BallDrop, bodies: &[Body], at: [f64; 2], floor: f64, effort: Effort) -> Stand {
    let mut search = Search::new(sheets, bodies, at, floor, effort);
    search.enough = floor + 0.5 * effort.epsilon;
    search.gather();
    search.settle();
    match search.held.filter(|_| search.low == f64::INFINITY) {
        Some(touch) => Stand::Held(touch),
        None if search.waiting.peek().is_some_and(|left| left.bound > search.low + search.step) => {
            Stand::Unknown
        }
        None => Stand::Free,
    }
}

struct Search<'a> {
    sheets: &'a BallDrop<'a>,
    bodies: &'a [Body],
    at: [f64; 2],
    effort: Effort,
    /// What is higher than what is touched by less than this is not looked into: half of what is asked for.
    step: f64,
    /// The tool is held at least here.
    low: f64,
    /// What holds it above this ends the search.
    enough: f64,
    held: Option<Touch>,
    waiting: BinaryHeap<Waiting<'a>>,
    met: usize,
    /// The last flat face that was looked at.
    flat: Option<u32>,
    rims: Rims<'a>,
}

/// Where a touched point is.
enum Place {
    Face { u: f64, v: f64 },
    Edge { along: Vector3 },
}

impl<'a> Search<'a> {
    fn new(sheets: &'a BallDrop, bodies: &'a [Body], at: [f64; 2], floor: f64, effort: Effort) -> Self {
        Search {
            sheets,
            bodies,
            at,
            effort,
            step: 0.5 * effort.epsilon,
            low: floor,
            enough: f64::INFINITY,
            held: None,
            waiting: BinaryHeap::new(),
            met: 0,
            flat: None,
            rims: Rims::new(sheets, bodies, at),
        }
    }

    fn gather(&mut self) {
        let sheets = self.sheets;
        let (bodies, at, step) = (self.bodies, self.at, self.step);
        let heights = |_: &&mut Self, boxes: &Boxes| {
            std::array::from_fn(|k| {
                let beside = |axis: usize| {
                    let [min, max] = [boxes.min[axis][k], boxes.max[axis][k]].map(f64::from);
                    (min - at[axis]).max(at[axis] - max).max(0.0)
                };
                let top = f64::from(boxes.max[2][k]);
                let (x, y) = (beside(0), beside(1));
                let from_axis = (x * x + y * y).sqrt();
                let tips = bodies.iter().filter_map(|b| b.rise(from_axis, 0.0).map(|rise| top - rise));
                let tip = tips.fold(f64::NEG_INFINITY, f64::max);
                if tip.is_finite() { -(tip as f32).next_up() } else { f32::INFINITY }
            })
        };
        let mut search = self;
        sheets.tree.0.search(
            &mut search,
            heights,
            |search, key| -f64::from(key) <= search.low + step,
            |search, item| search.meet(item),
        );
    }

    /// Whether all of a face is too low to hold the tool. Under a tool that stands on a floor, pieces of what goes down from there
    /// swell above it: without this, walls of holes and countersinks are cut to the last.
    fn is_below(&self, face: u32) -> bool {
        self.sheets.faces[face as usize].top_mm + ROUNDING_MM <= self.low + self.step
    }

    fn meet(&mut self, item: usize) {
        let sheets = self.sheets;
        let Some(of) = sheets.triangles.get(item) else {
            let piece = sheets.edges[item - sheets.triangles.len()].clone();
            if self.is_below(piece.face) {
                return;
            }
            for (p, t) in [(piece.a, piece.t.0), (piece.b, piece.t.1)] {
                self.touch_edge(&piece, p, t);
            }
            return self.wait_for_edge(piece);
        };
        if self.is_below(of.face) {
            return;
        }
        match &sheets.faces[of.face as usize].shape {
            Shape::Upright => return,
            Shape::Flat(flat) => return self.meet_flat(of.face, flat),
            Shape::Free => {}
        }
        let mesh = &sheets.covering.meshes[of.face as usize];
        let mut uv = mesh.triangles[of.index as usize].map(|i| mesh.uv[i as usize]);
        let mut p = of.p;
        for k in 0..3 {
            self.touch(of, &p[k], uv[k]);
        }
        let mut off_plane = f64::from(of.deviation_mm);
        let mut off_triangle = f64::from(mesh.deviation_mm[of.index as usize]).max(off_plane);
        if of.rimmed {
            let growth = 1.0 + growth(&p, off_triangle);
            let middle = Point2::from((uv[0].coords + uv[1].coords + uv[2].coords) / 3.0);
            uv = uv.map(|c| middle + (c - middle) * growth);
            let leaves = &sheets.faces[of.face as usize].leaves;
            p = uv.map(|c| leaves.point(c.x, c.y));
            off_plane *= growth * growth;
            off_triangle *= growth * growth;
        }
        let sheet = Sheet { of, uv, p, off_plane, off_triangle, at: [1.0 / 3.0; 3], level: 0 };
        self.wait_for(sheet);
        self.meet_beside_pole(&sheet);
    }

    /// All of a flat face. Where a body would rest on its plane outside the trims, the way there from any place inside does not
    /// lead down: the border, which is crossed, holds the body as high.
    fn meet_flat(&mut self, face: u32, flat: &Flat) {
        if self.flat.replace(face) == Some(face) {
            return;
        }
        let (start, normal) = flat.plane();
        for (k, body) in self.bodies.iter().enumerate() {
            let rest = body.on_plane_of(start, normal, self.at, 0.0).filter(|rest| rest.tip > self.low);
            let Some((tip, contact)) = rest.map(|rest| (rest.tip, flat.over(rest.at))) else { continue };
            let [u, v] = flat.parameters(&contact);
            if self.sheets.faces[face as usize].holds(u, v) {
                let (normal, face, uv) = (*normal, face as usize, Some([u, v]));
                self.hold(Touch { tip, gap_mm: 0.0, contact, normal, face, uv, is_edge: false, body: k });
            }
        }
    }

    /// In space a triangle with a corner in a pole covers the sector up to there; in the parameter plane the other side of
    /// the sector is triangles that have shrunk to lines.
    fn meet_beside_pole(&mut self, sheet: &Sheet<'a>) {
        let face = &self.sheets.faces[sheet.of.face as usize];
        let poles = face.poles();
        if poles == [false; 4] {
            return;
        }
        let ((u0, u1), (v0, v1)) = face.leaves.domain();
        let sides = [(0, u0), (0, u1), (1, v0), (1, v1)];
        for ((axis, side), _) in sides.into_iter().zip(poles).filter(|(_, pole)| *pole) {
            for k in 0..3 {
                let pole = sheet.uv[k];
                let others = [(k + 1) % 3, (k + 2) % 3];
                if pole[axis] != side || others.iter().any(|&j| sheet.uv[j][axis] == side) {
                    continue;
                }
                for j in others {
                    let mut beside = pole;
                    beside[1 - axis] = sheet.uv[j][1 - axis];
                    let uv = [pole, beside, sheet.uv[j]];
                    self.wait_for(Sheet { uv, p: [sheet.p[k], sheet.p[k], sheet.p[j]], ..*sheet });
                }
            }
        }
    }

    /// Takes in that a point of the model is there.
    fn take(&mut self, p: &Point3, face: FaceId, place: impl FnOnce() -> Option<Place>) {
        let [x, y] = self.at;
        let (dx, dy) = (p.x - x, p.y - y);
        let from_axis = (dx * dx + dy * dy).sqrt();
        let mut highest: Option<(f64, usize)> = None;
        for (k, body) in self.bodies.iter().enumerate() {
            if let Some(rise) = body.rise(from_axis, 0.0)
                && highest.is_none_or(|(tip, _)| p.z - rise > tip)
            {
                highest = Some((p.z - rise, k));
            }
        }
        let Some((tip, body)) = highest.filter(|(tip, _)| *tip > self.low) else { return };
        let Some(place) = place() else { return };
        let normal = self.normal(p, &self.bodies[body], face, &place);
        let (uv, is_edge) = match place {
            Place::Face { u, v } => (Some([u, v]), false),
            Place::Edge { .. } => (None, true),
        };
        self.hold(Touch { tip, gap_mm: 0.0, contact: *p, normal, face, uv, is_edge, body });
    }

    /// Takes in what holds the tool higher than all before.
    fn hold(&mut self, touch: Touch) {
        if touch.tip > self.low + self.step {
            self.step = self.step.max(0.5 * self.effort.known_to);
        }
        self.low = if touch.tip > self.enough { f64::INFINITY } else { touch.tip };
        self.held = Some(touch);
    }

    /// A point of a triangle's surface: it has to lie inside the trims.
    fn touch(&mut self, of: &Triangle, p: &Point3, uv: Point2) {
        let face = of.face as usize;
        let domain = self.sheets.faces[face].domain.as_ref().filter(|_| of.rimmed);
        self.take(p, face, || {
            domain.is_none_or(|d| d.contains(uv.x, uv.y)).then_some(Place::Face { u: uv.x, v: uv.y })
        });
    }

    fn touch_edge(&mut self, piece: &EdgePiece, p: Point3, t: f64) {
        let face = &self.sheets.faces[piece.face as usize];
        self.take(&p, piece.face as usize, || {
            let [_, along, _] = face.leaves.lift(&face.boundary[piece.pcurve as usize], t);
            Some(Place::Edge { along })
        });
    }

    /// Unit vector into the tool where it touches.
    fn normal(&self, p: &Point3, body: &Body, face: FaceId, place: &Place) -> Vector3 {
        let own = body.normal_at(p, self.at);
        let sharp = body.corner == 0.0 && (p.x - self.at[0]).hypot(p.y - self.at[1]) > 0.999 * body.flat;
        match *place {
            Place::Face { u, v } => {
                let normal = self.sheets.faces[face].leaves.jet(u, v).normal();
                normal.map_or(own, |n| n * if n.z < 0.0 { -1.0 } else { 1.0 })
            }
            // A sharp rim leaves the direction to the edge: across it, as flat as may be.
            Place::Edge { along } if sharp && body.slope.is_infinite() => {
                let inward = Vector3::new(self.at[0] - p.x, self.at[1] - p.y, 0.0);
                let across = Vector3::z() * along.dot(&inward) - inward * along.z;
                let across = across * if across.z < 0.0 { -1.0 } else { 1.0 };
                across.try_normalize(0.0).filter(|n| n.dot(&inward) >= 0.0).unwrap_or(own)
            }
            Place::Edge { .. } => own,
        }
    }

    fn wait_for(&mut self, mut sheet: Sheet<'a>) {
        let n = (sheet.p[1] - sheet.p[0]).cross(&(sheet.p[2] - sheet.p[0]));
        let mut bound = f64::NEG_INFINITY;
        for (k, body) in self.bodies.iter().enumerate() {
            let by_plane =
                body.on_plane_of(&sheet.p[0], &n, self.at, sheet.off_plane).map_or(f64::INFINITY, |t| t.tip);
            let least = bound.max(self.low + self.step) - ROUNDING_MM;
            if by_plane <= least {
                continue;
            }
            let rested = body.on_triangle(&sheet.p, &n, self.at, sheet.off_triangle, least);
            let Some(rested) = rested else { continue };
            let tip = by_plane.min(rested.tip) + ROUNDING_MM;
            if tip > bound && !self.is_left_to_the_rim(&sheet, &n, k, &rested) {
                bound = tip;
                sheet.at = rested.weights;
            }
        }
        self.push(bound, Piece::Sheet(sheet));
    }

    /// Whether what a triangle has inside the trims does not hold the body, or no higher than the rim does, by half a step.
    ///
    /// ```text
    ///     trims ┊                 The flat triangle would hold the swollen body in a place `m` outside the trims. On the way
    ///        q ─┼─ m              there from a place `q` inside that does, the height is concave: the rim is crossed where
    ///           ┊                 it is high enough, too. The surface is `off_triangle` from the flat one in `q` and on the rim:
    /// ```
    ///
    /// where the rim is clear of the body swollen by both, nothing inside the trims is high enough. Or else, where swelling
    /// the body changes little, the rim holds it as high.
    fn is_left_to_the_rim(&mut self, sheet: &Sheet<'a>, n: &Vector3, k: usize, swollen: &Rested) -> bool {
        let (sheets, bodies) = (self.sheets, self.bodies);
        let face = &sheets.faces[sheet.of.face as usize];
        let Some(domain) = face.domain.as_ref().filter(|_| sheet.of.rimmed) else { return false };
        let is_outside = |weights: [f64; 3]| {
            let at = weighted(&sheet.uv, weights);
            !domain.contains(at.x, at.y)
        };
        if sheet.level >= OUTSIDE_LEVEL
            && self.rims.is_clear(
                sheet.of.face,
                k,
                2.0 * sheet.off_triangle,
                self.low + self.step - ROUNDING_MM,
            )
            && is_outside(swollen.weights)
        {
            return true;
        }
        let flat = bodies[k].on_triangle(&sheet.p, n, self.at, 0.0, f64::NEG_INFINITY);
        flat.is_some_and(|flat| swollen.tip - flat.tip <= 0.5 * self.step && is_outside(flat.weights))
    }

    fn wait_for_edge(&mut self, piece: EdgePiece) {
        let least = self.low + self.step - ROUNDING_MM;
        let on_edge = |b: &Body| b.on_segment(&piece.a, &piece.b, self.at, piece.deviation_mm, least);
        let highest = self.bodies.iter().filter_map(on_edge).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((tip, share)) = highest.filter(|(tip, _)| *tip > least) else { return };
        // Where it would be touched, at once: of a level face all places are as high, and those on its border are told apart.
        let face = &self.sheets.faces[piece.face as usize];
        let t = piece.t.0 + share * (piece.t.1 - piece.t.0);
        self.touch_edge(&piece, face.leaves.point_on(&face.boundary[piece.pcurve as usize], t), t);
        self.push(tip + ROUNDING_MM, Piece::Edge(piece));
    }

    fn push(&mut self, bound: f64, piece: Piece<'a>) {
        if bound > self.low + self.step {
            self.met += 1;
            self.waiting.push(Waiting { bound, number: self.met, piece });
        }
    }

    /// Cuts the highest piece until none is higher than what is touched, as long as it may.
    fn settle(&mut self) {
        for _ in 0..self.effort.cuts {
            if self.waiting.peek().is_none_or(|w| w.bound <= self.low + self.step) {
                return;
            }
            match self.waiting.pop().map(|w| w.piece) {
                Some(Piece::Sheet(sheet)) => self.quarter(&sheet),
                Some(Piece::Edge(piece)) => self.halve(&piece),
                None => {}
            }
        }
    }

    /// What may hold the tool, where that has not been found out.
    fn supposed(&self, piece: &Piece) -> Touch {
        let (contact, face) = match piece {
            Piece::Sheet(sheet) => (weighted(&sheet.p, sheet.at), sheet.of.face),
            Piece::Edge(piece) => (nalgebra::center(&piece.a, &piece.b), piece.face),
        };
        let (normal, face) = (Vector3::z(), face as usize);
        Touch { tip: 0.0, gap_mm: 0.0, contact, normal, face, uv: None, is_edge: false, body: 0 }
    }

    fn quarter(&mut self, sheet: &Sheet<'a>) {
        let Sheet { of, uv, p, level, .. } = *sheet;
        let face = &self.sheets.faces[of.face as usize];
        let middle = |i: usize, j: usize| nalgebra::center(&uv[i], &uv[j]);
        let m = [middle(0, 1), middle(1, 2), middle(2, 0)];
        let q = m.map(|c| face.leaves.point(c.x, c.y));
        let touched = weighted(&uv, sheet.at);
        self.touch(of, &face.leaves.point(touched.x, touched.y), touched);
        for k in 0..3 {
            self.touch(of, &q[k], m[k]);
        }
        // Second derivatives make the distance a quarter.
        let (off_plane, off_triangle, level) = (0.25 * sheet.off_plane, 0.25 * sheet.off_triangle, level + 1);
        for (uv, p) in [
            ([uv[0], m[0], m[2]], [p[0], q[0], q[2]]),
            ([m[0], uv[1], m[1]], [q[0], p[1], q[1]]),
            ([m[2], m[1], uv[2]], [q[2], q[1], p[2]]),
            ([m[0], m[1], m[2]], [q[0], q[1], q[2]]),
        ] {
            if of.rimmed
                && level >= OUTSIDE_LEVEL
                && let Some(domain) = &face.domain
            {
                let middle = weighted(&uv, [1.0 / 3.0; 3]);
                if [uv[0], uv[1], uv[2], middle].iter().all(|c| !domain.contains(c.x, c.y)) {
                    continue;
                }
            }
            self.wait_for(Sheet { of, uv, p, off_plane, off_triangle, at: sheet.at, level });
        }
    }

    fn halve(&mut self, piece: &EdgePiece) {
        let halves = halves(self.sheets, piece);
        self.touch_edge(piece, halves[0].b, halves[0].t.1);
        halves.into_iter().for_each(|half| self.wait_for_edge(half));
    }
}

/// By how much a triangle has to be enlarged about its middle for its sides to move outwards by `by_mm`.
fn growth(p: &[Point3; 3], by_mm: f64) -> f64 {
    let sides = [p[1] - p[0], p[2] - p[1], p[0] - p[2]];
    let longest = sides.iter().map(Vector3::norm).fold(0.0, f64::max);
    let lowest_height = sides[0].cross(&sides[1]).norm() / longest;
    // The middle is a third of the height away from each side.
    (3.0 * by_mm / lowest_height).min(LARGEST_GROWTH)
}
