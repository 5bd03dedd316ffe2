//! The passes of one part: what one setup cuts of one region.

use claymill_nurbs::{Curve3, FaceId, Point2, Point3};
use claymill_toolpath::{LengthByKind, LinkStyle, Move, MoveKind, round_to_written};
use rayon::prelude::*;

use crate::contact::{FlatPart, Stock};
use crate::crests::{Laid, missing_rows};
use crate::guide::{Guide, Line};
use crate::heights::Heights;
use crate::order::{Ends, Turn, order};
use crate::profile::{Chain, follow};
use crate::raster::{Patch, Raster, Row};
use crate::reach::Fate;
use crate::refit::{Fit, Over, fit};
use crate::step_over::row_distance_mm;
use crate::{Feeds, Frame, RowsAlong};

/// Rapids across keep at least this distance above everything within the tool's radius; rapids up and down
/// end this far above the ball's location, mm.
pub const CLEARANCE_MM: f64 = 5.0;
/// Passes shorter than this are left out: the neighbouring rows cover them.
const SHORTEST_PASS_MM: f64 = 1.0;
/// A stay-down link may be this long in lace, mm; it must also be quicker than lifting over.
const LONGEST_LINK_MM: f64 = 250.0;
/// One-way passes are linked down on the model only over this many flat step-overs.
const LINK_STEPS: f64 = 8.0;
/// What the stops of a retract cost, as path length.
const STOPS_MM: f64 = 40.0;
/// What a turn between two passes costs, as path length, when a direction is chosen.
const TURN_MM: f64 = 60.0;

/// A crest higher than this share of the scallop height is worth a further row.
const TOO_HIGH: f64 = 1.03;
/// Rounds of laying rows between rows: each halves their distance.
const ROUNDS: usize = 6;

/// What all parts of a setup share.
pub(crate) struct SetupContext<'a> {
    pub(crate) flat: &'a FlatPart,
    pub(crate) frame: Frame,
    pub(crate) index: usize,
    pub(crate) stock: &'a Stock<'a>,
    pub(crate) heights: &'a Heights,
    pub(crate) scallop_mm: f64,
    pub(crate) link: LinkStyle,
    pub(crate) feeds: Feeds,
}

/// Moves and totals of a part, from the start of its first pass to the end of its last one.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    pub(crate) moves: Vec<Move>,
    pub(crate) along: RowsAlong,
    pub(crate) passes: u32,
    pub(crate) retracts: u32,
    pub(crate) length: LengthByKind,
    pub(crate) lifted: u64,
}

/// The curves of one pass, in order.
struct Pass {
    curves: Vec<Curve3>,
}

impl SetupContext<'_> {
    /// Plans the part of the region made of `faces`; `None` when this setup cuts nothing of it.
    pub(crate) fn part(&self, faces: &[usize], fates: &[Vec<Fate>]) -> Option<Part> {
        let (along, raster, rows) = self.rows(faces, fates)?;
        let (laid, lifted) = self.lay(&raster, rows, along, fates);
        let passes: Vec<Pass> = laid.par_iter().flat_map_iter(|row| self.fit_row(row)).collect();
        if passes.is_empty() {
            return None;
        }
        let mut part = Part {
            moves: Vec::new(),
            along,
            passes: passes.len() as u32,
            retracts: 0,
            length: LengthByKind::default(),
            lifted,
        };
        self.link_passes(passes, &mut part);
        for m in &part.moves {
            part.length.add(m.kind, m.length_mm());
        }
        Some(part)
    }

    /// Rows over the part in the cheaper of the two directions.
    fn rows(&self, faces: &[usize], fates: &[Vec<Fate>]) -> Option<(RowsAlong, Raster, Vec<Row>)> {
        let cell = (0.5 * crate::step_over::flat_mm(self.stock.radius_mm(), self.scallop_mm)).clamp(0.3, 3.0);
        [RowsAlong::X, RowsAlong::Y]
            .into_par_iter()
            .filter_map(|along| {
                let patches = self.patches(faces, fates, along);
                let raster = Raster::new(&patches, cell)?;
                let rows = raster.rows();
                let cost: f64 = rows.iter().flat_map(|r| &r.stretches).map(|(a, b)| b - a + TURN_MM).sum();
                Some((cost, along, raster, rows))
            })
            .collect::<Vec<_>>()
            .into_iter()
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, along, raster, rows)| (along, raster, rows))
    }

    fn patches(&self, faces: &[usize], fates: &[Vec<Fate>], along: RowsAlong) -> Vec<Patch> {
        let r = self.stock.radius_mm();
        let pick = |p: &Point3| {
            if along == RowsAlong::X { [p.x, p.y] } else { [p.y, p.x] }
        };
        let mut patches = Vec::new();
        for &face in faces {
            let mesh = &self.flat.meshes[face];
            let surface = self.stock.surface(face);
            // Centre of the ball that touches the surface's upper side at these parameters.
            let centre = |uv: Point2| {
                let (n, _) = surface.normal(uv.x, uv.y)?;
                Some(surface.point(uv.x, uv.y) + n * (r * if n.z < 0.0 { -1.0 } else { 1.0 }))
            };
            for (t, fate) in mesh.triangles.iter().zip(&fates[face]) {
                if fate.setups & (1 << self.index) == 0 {
                    continue;
                }
                let uv = t.map(|i| mesh.uv[i as usize]);
                let Some(c) = uv.map(centre).into_iter().collect::<Option<Vec<_>>>() else {
                    continue;
                };
                let middle = (uv[0].coords + uv[1].coords + uv[2].coords) / 3.0;
                let jet = surface.jet(middle.x, middle.y);
                let Some(distance_mm) = row_distance_mm(&jet, along, r, self.scallop_mm) else {
                    continue;
                };
                patches.push(Patch { corners: [pick(&c[0]), pick(&c[1]), pick(&c[2])], distance_mm });
            }
        }
        patches
    }

    /// Follows the rows, and further ones between them until no crest is too high; sorted by position. Also
    /// tells how many locations rest on a proven bound.
    fn lay(
        &self,
        raster: &Raster,
        rows: Vec<Row>,
        along: RowsAlong,
        fates: &[Vec<Fate>],
    ) -> (Vec<Laid>, u64) {
        let mut laid: Vec<Laid> = Vec::new();
        let mut lifted = 0;
        let mut rows = rows;
        for _ in 0..ROUNDS {
            let followed: Vec<(Laid, u64)> = rows.par_iter().map(|row| self.follow_row(row, along)).collect();
            laid.iter_mut().for_each(|row| row.fresh = false);
            lifted += followed.iter().map(|f| f.1).sum::<u64>();
            laid.extend(followed.into_iter().map(|f| f.0).filter(|row| !row.chains.is_empty()));
            laid.sort_by(|a, b| a.q.total_cmp(&b.q));
            rows = missing_rows(
                self.stock,
                raster,
                &laid,
                TOO_HIGH * self.scallop_mm,
                |q| row_guide(along, q),
                |face, at| self.claims(face, at, fates),
            );
            if rows.is_empty() {
                break;
            }
        }
        (laid, lifted)
    }

    /// Whether this setup cuts a face at these parameters, or anywhere.
    fn claims(&self, face: FaceId, at: Option<Point2>, fates: &[Vec<Fate>]) -> bool {
        let mine = |fate: &Fate| fate.setups & (1 << self.index) != 0;
        let Some(p) = at else {
            return fates[face].iter().any(mine);
        };
        let mesh = &self.flat.meshes[face];
        let holds = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| mesh.uv[i as usize] - p);
            let turns = [a.perp(&b), b.perp(&c), c.perp(&a)];
            turns.iter().all(|t| *t >= 0.0) || turns.iter().all(|t| *t <= 0.0)
        };
        mesh.triangles.iter().zip(&fates[face]).any(|(t, fate)| mine(fate) && holds(t))
    }

    fn follow_row(&self, row: &Row, along: RowsAlong) -> (Laid, u64) {
        let mut laid = Laid { q: row.q, guide: row_guide(along, row.q), chains: Vec::new(), fresh: true };
        let mut lifted = 0;
        for &(s0, s1) in &row.stretches {
            let followed = follow(self.stock, &laid.guide, s0, s1);
            lifted += followed.lifted;
            laid.chains.extend(followed.chains);
        }
        laid.chains.retain(|c| c[c.len() - 1].end().s - c[0].start().s >= SHORTEST_PASS_MM);
        (laid, lifted)
    }

    fn fit_row(&self, row: &Laid) -> Vec<Pass> {
        row.chains.iter().filter_map(|chain| self.fit_chain(chain, &row.guide)).collect()
    }

    /// Fits a chain: the curves of one pass, end to end; `None` when nothing is left in the written digits.
    fn fit_chain(&self, chain: &Chain, guide: &Guide) -> Option<Pass> {
        let over = Over { guide, frame: &self.frame, radius_mm: self.stock.radius_mm() };
        let mut curves: Vec<Curve3> = Vec::new();
        for Fit { mut curve, .. } in chain.iter().flat_map(|profile| fit(profile, &over)) {
            join(curves.last_mut(), &mut curve);
            curves.push(curve);
        }
        (!curves.is_empty()).then_some(Pass { curves })
    }

    fn link_passes(&self, mut passes: Vec<Pass>, part: &mut Part) {
        let flat = |p: Point3| {
            let q = self.frame.to_setup(&p);
            [q.x, q.y]
        };
        let ends: Vec<Ends> =
            passes.iter().map(|p| Ends { start: flat(p.start()), end: flat(p.end()) }).collect();
        let turns = order(&ends, self.link);
        for turn in &turns {
            if turn.reversed {
                passes[turn.pass].reverse();
            }
        }
        // Links are independent of each other, so they are proven in parallel.
        let links: Vec<Option<Vec<Move>>> = turns
            .par_windows(2)
            .map(|w: &[Turn]| self.stay_down(passes[w[0].pass].end(), passes[w[1].pass].start()))
            .collect();
        let axis = self.frame.axis();
        for (k, turn) in turns.iter().enumerate() {
            let pass = &passes[turn.pass];
            let number = k as u32;
            let first = part.moves.len();
            match k.checked_sub(1).map(|before| &links[before]) {
                None => {}
                Some(Some(link)) => part.moves.extend(link.iter().cloned()),
                Some(None) => {
                    part.retracts += 1;
                    part.moves.extend(self.lift_over(passes[turns[k - 1].pass].end(), pass.start()));
                }
            }
            for curve in &pass.curves {
                part.moves.push(Move::along(MoveKind::Cut, curve, axis, self.feeds.cut_mm_per_min));
            }
            for m in &mut part.moves[first..] {
                m.pass = number;
            }
        }
    }

    /// A link that keeps the ball on the model: the exact path over the straight line between the two ends,
    /// refitted like a pass. `None` when the way is long, climbs far or is interrupted.
    fn stay_down(&self, from: Point3, to: Point3) -> Option<Vec<Move>> {
        let (a, b) = (self.frame.to_setup(&from), self.frame.to_setup(&to));
        let (dx, dy) = (b.x - a.x, b.y - a.y);
        let length = dx.hypot(dy);
        let longest_mm = match self.link {
            LinkStyle::Lace => LONGEST_LINK_MM,
            LinkStyle::Box => LINK_STEPS * crate::step_over::flat_mm(self.stock.radius_mm(), self.scallop_mm),
        };
        if length > longest_mm {
            return None;
        }
        let axis = self.frame.axis();
        let feed = self.feeds.cut_mm_per_min;
        if length < 0.05 {
            return ((b - a).norm() < 0.05)
                .then(|| vec![Move::straight(MoveKind::Link, from, to, axis, feed)]);
        }
        let guide = Guide::Straight(Line { origin: [a.x, a.y], direction: [dx / length, dy / length] });
        let followed = follow(self.stock, &guide, 0.0, length);
        let [chain] = followed.chains.as_slice() else {
            return None;
        };
        let whole = chain[0].start().s == 0.0 && chain[chain.len() - 1].end().s == length;
        let path_mm: f64 = chain.iter().map(crate::profile::Profile::length_mm).sum();
        if !whole || path_mm > self.retract_mm(from, to) {
            return None;
        }
        let mut curves = self.fit_chain(chain, &guide)?.curves;
        let last = curves.len() - 1;
        move_end(&mut curves[0], false, from);
        move_end(&mut curves[last], true, to);
        Some(curves.iter().map(|c| Move::along(MoveKind::Link, c, axis, feed)).collect())
    }

    /// What lifting over costs, as length of path at cutting feed.
    fn retract_mm(&self, from: Point3, to: Point3) -> f64 {
        let height = self.link_height(from, to);
        let (a, b) = (self.frame.to_setup(&from), self.frame.to_setup(&to));
        let feed = self.feeds.cut_mm_per_min;
        let lead_mm = (height - a.z).min(CLEARANCE_MM) + (height - b.z).min(CLEARANCE_MM);
        let rapid_mm = 2.0 * height - a.z - b.z - lead_mm + (b - a).xy().norm();
        lead_mm * feed / self.feeds.lead_mm_per_min + rapid_mm * feed / self.feeds.rapid_mm_per_min + STOPS_MM
    }

    /// Tip height in the setup at which a straight rapid between two places is proven clear.
    pub(crate) fn link_height(&self, from: Point3, to: Point3) -> f64 {
        let (a, b) = (self.frame.to_setup(&from), self.frame.to_setup(&to));
        let top = self.heights.over([a.x, a.y], [b.x, b.y], self.stock.radius_mm());
        let height = top.max(a.z).max(b.z) + CLEARANCE_MM;
        // Rounded up, so that what is written is not below what is proven.
        round_to_written((height * 10.0).ceil() / 10.0)
    }
}

impl Pass {
    fn start(&self) -> Point3 {
        self.curves[0].points()[0]
    }

    fn end(&self) -> Point3 {
        let points = self.curves[self.curves.len() - 1].points();
        points[points.len() - 1]
    }

    fn reverse(&mut self) {
        self.curves.reverse();
        for c in &mut self.curves {
            *c = reversed_from_zero(c);
        }
    }
}

/// The guide of a straight row.
fn row_guide(along: RowsAlong, q: f64) -> Guide {
    Guide::Straight(match along {
        RowsAlong::X => Line { origin: [0.0, q], direction: [1.0, 0.0] },
        RowsAlong::Y => Line { origin: [q, 0.0], direction: [0.0, 1.0] },
    })
}

/// Reversing mirrors the knots; rounding them again keeps the written digits.
fn reversed_from_zero(curve: &Curve3) -> Curve3 {
    let back = curve.reversed();
    let knots = back.knots().as_slice().iter().map(|&k| round_to_written(k)).collect();
    let rounded = claymill_nurbs::KnotVector::new(back.knots().degree(), knots)
        .and_then(|k| Curve3::new(k, back.points().to_vec(), None));
    rounded.unwrap_or(back)
}

/// Two stretches meet at a corner; the fit lifts each along its own normal, so the ends differ by the bias.
/// Both end at the higher of the two places.
fn join(before: Option<&mut Curve3>, after: &mut Curve3) {
    let Some(before) = before else { return };
    let (a, b) = (before.points()[before.points().len() - 1], after.points()[0]);
    let corner = nalgebra::center(&a, &b).map(round_to_written);
    move_end(before, true, corner);
    move_end(after, false, corner);
}

fn move_end(curve: &mut Curve3, last: bool, to: Point3) {
    let mut points = curve.points().to_vec();
    let index = if last { points.len() - 1 } else { 0 };
    points[index] = to;
    if let Ok(moved) = Curve3::new(curve.knots().clone(), points, None) {
        *curve = moved;
    }
}
