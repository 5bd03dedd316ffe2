//! The passes of one part: what one setup cuts of one region.

use std::collections::{BTreeMap, BTreeSet};

use claymill_nurbs::{Curve3, Point3};
use claymill_toolpath::{Considered, LinkStyle, Move, MoveKind};
use rayon::prelude::*;
use tracing::info_span;

use crate::curve::drive::{DriveCurve, Line};
use crate::fit::refit::{Fit, Over, fit_chain};
use crate::fit::written::{join, move_end, polygon_mm, reversed_from_zero, straightened, written_between};
use crate::follow::profile::{Chain, Profile, follow};
use crate::follow::proofs::Proofs;
use crate::link::leads::End;
use crate::link::order::{Ends, Turn, order};
use crate::pattern::levels::sweeps::Sweeps;
use crate::pattern::near::PassIndex;
use crate::pattern::part_region::PartRegion;
use crate::pattern::rows::crests::PlannedPass;
use crate::setup::context::SetupContext;
use crate::{RowsAlong, Strategy};

/// A stay-down link may be this long in zigzag, mm; it must also be quicker than lifting over.
const LONGEST_LINK_MM: f64 = 250.0;
/// One-way passes are linked down on the model only over this many flat step-overs.
const LINK_STEPS: f64 = 8.0;
/// What the stops of a retract cost, as path length.
const STOPS_MM: f64 = 40.0;
/// Between corners this near to each other a pass goes straight, mm.
const TINY_MM: f64 = 0.05;
/// Moves and totals of a part, from the start of its first pass to the end of its last one.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    /// Those of passes that were never put off, then of those that were once, and so on, see [`Pass::put_off`].
    pub(crate) moves: Vec<Vec<Move>>,
    pub(crate) strategy: Strategy,
    pub(crate) considered: Vec<Considered>,
    /// Direction of straight rows.
    pub(crate) along: Option<RowsAlong>,
    pub(crate) passes: u32,
    pub(crate) retracts: u32,
    pub(crate) proofs: Proofs,
    /// What the moves are of.
    pub(crate) laid: Vec<Pass>,
    /// Passes to which no link may lead.
    pub(crate) lifted_to: BTreeSet<u32>,
}

/// The curves of one pass, in order.
#[derive(Debug, Clone)]
pub(crate) struct Pass {
    pub(crate) curves: Vec<Curve3>,
    pub(crate) beside_walls: bool,
    /// How often it was put off: a pass comes when all passes of the setup are done that were put off less often.
    pub(crate) put_off: usize,
}

/// When a pass comes that was put off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Later {
    /// See [`Pass::put_off`].
    pub(crate) times: usize,
    /// It runs the other way: the flutes clear a way for the shank as they come down.
    pub(crate) is_reversed: bool,
}

/// What of a curve of a pass is between two parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stretch {
    /// Which curve of the pass.
    pub(crate) curve: usize,
    pub(crate) between: [f64; 2],
}

/// What of a pass is cut without a break.
pub(crate) type Piece = Vec<Stretch>;

/// Passes of which something was left out.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct CutShort {
    /// How many they are.
    pub(crate) passes: u32,
    /// How much was left out of them, mm.
    pub(crate) left_out_mm: f64,
}

/// What becomes of a pass on which the shank is struck.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Amendment {
    /// It comes later.
    Later(Later),
    /// Of it these pieces are left, which come when all is done that was put off less often than this.
    Pieces(usize, Vec<Piece>),
}

impl Part {
    /// How often those of its passes were put off that come last.
    pub(crate) fn last_put_off(&self) -> usize {
        self.laid.last().map_or(0, |pass| pass.put_off)
    }
}

impl SetupContext<'_> {
    /// Plans the part of the region made of `faces`, of which this setup cuts `area_mm2`, with its mesh where there is one;
    /// `None` when nothing of it is cut.
    pub(crate) fn part(&self, faces: &[usize], area_mm2: f64, sweeps: Option<&Sweeps>) -> Option<Part> {
        let (valleys, mut proofs) =
            if self.pencil { self.valleys(faces) } else { (Vec::new(), Proofs::default()) };
        let in_valleys = PassIndex::new(&valleys, self.flat_step_mm());
        let ground = PartRegion { faces, area_mm2, sweeps, in_valleys };
        let is_cut = faces.iter().any(|&face| self.claims.any(face));
        let chosen = if is_cut { info_span!("pattern").in_scope(|| self.choose(&ground)) } else { None };
        let (walls, of_walls) = info_span!("walls").in_scope(|| self.lay_walls(&ground));
        let fitting = info_span!("fit").entered();
        let fit_all =
            |laid: &Vec<PlannedPass>| laid.par_iter().flat_map_iter(|row| self.fit_row(row)).collect();
        let beside = |pass: Pass| Pass { beside_walls: true, ..pass };
        let chosen_groups = chosen.iter().flat_map(|(layout, _)| &layout.groups);
        let mut groups: Vec<Vec<Pass>> = chosen_groups.chain([&valleys]).map(fit_all).collect();
        groups.extend(walls.iter().map(|laid| fit_all(laid).into_iter().map(beside).collect()));
        drop(fitting);
        let passes: Vec<Pass> = groups.into_iter().flat_map(|passes| self.in_order(passes)).collect();
        if passes.is_empty() {
            return None;
        }
        let (strategy, along) = match &chosen {
            Some((layout, _)) => (layout.strategy, layout.along),
            None => (Strategy::Waterline, None),
        };
        proofs += [of_walls].into_iter().chain(chosen.iter().map(|(layout, _)| layout.proofs)).sum();
        let mut part = Part {
            moves: Vec::new(),
            strategy,
            considered: chosen.map_or_else(Vec::new, |(_, considered)| considered),
            along,
            passes: passes.len() as u32,
            retracts: 0,
            proofs,
            laid: passes,
            lifted_to: BTreeSet::new(),
        };
        info_span!("link").in_scope(|| self.link_passes(&mut part));
        Some(part)
    }

    /// Links the passes of a part again, without links that lead to some of them, and with amendments of those that are struck.
    pub(crate) fn link_again(
        &self,
        part: &mut Part,
        struck: &BTreeMap<u32, &Amendment>,
        links: &BTreeSet<u32>,
    ) -> CutShort {
        let lifted_to = &part.lifted_to | links;
        let mut cut_short = CutShort::default();
        let mut laid: Vec<(Pass, bool)> = Vec::new();
        for (number, mut pass) in (0..).zip(std::mem::take(&mut part.laid)) {
            match struck.get(&number) {
                None => laid.push((pass, lifted_to.contains(&number))),
                Some(Amendment::Later(Later { times, is_reversed })) => {
                    pass.put_off = *times;
                    if *is_reversed {
                        pass.reverse();
                    }
                    laid.push((pass, false));
                }
                Some(Amendment::Pieces(times, pieces)) => {
                    let pieces = pieces.iter().filter_map(|piece| pass.piece(piece, *times));
                    let long = pieces.filter(|piece| piece.length_mm() >= self.shortest_pass_mm());
                    let pieces: Vec<Pass> = long.flat_map(|piece| self.proven_passes(piece)).collect();
                    cut_short.passes += 1;
                    cut_short.left_out_mm +=
                        pass.length_mm() - pieces.iter().map(Pass::length_mm).sum::<f64>();
                    laid.extend(pieces.into_iter().map(|piece| (piece, false)));
                }
            }
        }
        laid.sort_by_key(|(pass, _)| pass.put_off);
        part.lifted_to = (0..).zip(&laid).filter(|(_, (_, lifted))| *lifted).map(|(k, _)| k).collect();
        part.laid = laid.into_iter().map(|(pass, _)| pass).collect();
        part.passes = part.laid.len() as u32;
        self.link_passes(part);
        cut_short
    }

    /// The passes over a row, without what of them enters anything as written.
    fn fit_row(&self, row: &PlannedPass) -> Vec<Pass> {
        let fitted = row.chains.iter().filter_map(|chain| self.fit_chain(chain, &row.drive));
        fitted.flat_map(|pass| self.proven_passes(pass)).collect()
    }

    fn proven_passes(&self, pass: Pass) -> Vec<Pass> {
        let whole_mm = pass.length_mm();
        let runs = self.proven_runs(pass.curves).into_iter().map(|curves| Pass { curves, ..pass });
        let mut passes: Vec<Pass> = runs.collect();
        // What something was cut out of has to be worth a pass still.
        passes.retain(|part| part.length_mm() >= self.shortest_pass_mm().min(whole_mm));
        passes
    }

    /// Fits a chain: the curves of one pass, end to end; `None` when nothing is left in the written digits.
    fn fit_chain(&self, chain: &Chain, drive: &DriveCurve) -> Option<Pass> {
        let tip_mm = self.ball.end().corner_mm;
        let over = Over { drive, frame: &self.frame, radius_mm: tip_mm, tolerance: self.tolerance };
        let mut curves: Vec<Curve3> = Vec::new();
        for Fit { mut curve, .. } in fit_chain(chain, &over) {
            join(curves.last_mut(), &mut curve);
            curves.push(curve);
        }
        curves.iter_mut().filter(|c| polygon_mm(c) < TINY_MM).for_each(|c| *c = straightened(c));
        (!curves.is_empty()).then_some(Pass { curves, beside_walls: false, put_off: 0 })
    }

    /// The passes as they are to be cut, one after the other.
    fn in_order(&self, passes: Vec<Pass>) -> Vec<Pass> {
        let ends: Vec<Ends> = passes.iter().map(|p| Ends { start: p.start(), end: p.end() }).collect();
        let mut passes: Vec<Option<Pass>> = passes.into_iter().map(Some).collect();
        let turned = |turn: Turn| {
            let mut pass = passes[turn.pass].take()?;
            if turn.reversed {
                pass.reverse();
            }
            Some(pass)
        };
        order(&ends, self.link).into_iter().filter_map(turned).collect()
    }

    fn link_passes(&self, part: &mut Part) {
        let Part { laid: passes, lifted_to, .. } = &*part;
        let (mut all, mut retracts) = (vec![Vec::new(); part.last_put_off() + 1], 0);
        let is_first = |k: usize| k == 0 || passes[k].put_off > passes[k - 1].put_off;
        let run_outs: Vec<[Option<Point3>; 2]> = passes
            .par_iter()
            .map(|pass| [pass.before(), pass.behind()].map(|end| self.extend_pass(end)))
            .collect();
        let ends = |k: usize| {
            let ends = [passes[k].before(), passes[k].behind()];
            [0, 1].map(|side| End { at: run_outs[k][side].unwrap_or(ends[side].at), ..ends[side] })
        };
        // Ways are independent of each other, so they are proven in parallel.
        let way = |k: usize| {
            let ([_, from], [to, _]) = (ends(k), ends(k + 1));
            let beside_walls = passes[k..k + 2].iter().any(|pass| pass.beside_walls);
            let in_the_open = run_outs[k][1].is_some() && run_outs[k + 1][0].is_some();
            let link = match () {
                () if is_first(k + 1) || lifted_to.contains(&(k as u32 + 1)) => None,
                () if in_the_open => self.link_in_the_open(from, to),
                () if beside_walls => self.link_beside(from.at, to.at),
                () => self.stay_down(from.at, to.at),
            };
            link.map_or_else(|| (self.lift_over(from, to), 1), |link| (link, 0))
        };
        let ways: Vec<(Vec<Move>, u32)> =
            (0..passes.len().saturating_sub(1)).into_par_iter().map(way).collect();
        let (axis, feed) = (self.frame.axis(), self.feeds.cut_mm_per_min);
        for (k, pass) in passes.iter().enumerate() {
            let number = k as u32;
            let moves = &mut all[pass.put_off];
            let first = moves.len();
            if let Some((way, lifts)) = k.checked_sub(1).filter(|_| !is_first(k)).map(|before| &ways[before])
            {
                retracts += lifts;
                moves.extend(way.iter().cloned());
            }
            let [run_in, extend_pass] = run_outs[k];
            let run_in = run_in.map(|from| Move::straight(MoveKind::LeadIn, from, pass.start(), axis, feed));
            let extend_pass =
                extend_pass.map(|to| Move::straight(MoveKind::LeadOut, pass.end(), to, axis, feed));
            moves.extend(run_in);
            moves.extend(pass.curves.iter().map(|curve| Move::along(MoveKind::Cut, curve, axis, feed)));
            moves.extend(extend_pass);
            for m in &mut moves[first..] {
                m.pass = number;
            }
        }
        (part.moves, part.retracts) = (all, retracts);
    }

    /// A link that keeps the ball on the model: the exact path over the straight line between the two ends,
    /// refitted like a pass. `None` when the way is long, climbs far or is interrupted.
    fn stay_down(&self, from: Point3, to: Point3) -> Option<Vec<Move>> {
        let (a, b) = (self.frame.to_setup(&from), self.frame.to_setup(&to));
        let (dx, dy) = (b.x - a.x, b.y - a.y);
        let length = dx.hypot(dy);
        if length > self.longest_link_mm() {
            return None;
        }
        let axis = self.frame.axis();
        let feed = self.feeds.cut_mm_per_min;
        if length < 0.05 {
            let straight = || vec![Move::straight(MoveKind::Link, from, to, axis, feed)];
            return ((b - a).norm() < 0.05).then(straight).and_then(|link| self.proven(link));
        }
        let drive = DriveCurve::Straight(Line { origin: [a.x, a.y], direction: [dx / length, dy / length] });
        let followed = follow(self.ball, &drive, 0.0, length);
        let chains = self.kept_of_link(followed.chains, &drive);
        let [chain] = chains.as_slice() else {
            return None;
        };
        let whole = chain[0].start().s == 0.0 && chain[chain.len() - 1].end().s == length;
        let path_mm: f64 = chain.iter().map(Profile::length_mm).sum();
        if !whole || path_mm > self.retract_mm(from, to) {
            return None;
        }
        let mut curves = self.fit_chain(chain, &drive)?.curves;
        let last = curves.len() - 1;
        move_end(&mut curves[0], false, from);
        move_end(&mut curves[last], true, to);
        self.proven(curves.iter().map(|c| Move::along(MoveKind::Link, c, axis, feed)).collect())
    }

    /// How long a link may be, mm.
    pub(crate) fn longest_link_mm(&self) -> f64 {
        match self.link {
            LinkStyle::Zigzag => LONGEST_LINK_MM,
            LinkStyle::OneWay => LINK_STEPS * self.flat_step_mm(),
        }
    }

    /// What lifting over costs, as length of path at cutting feed.
    fn retract_mm(&self, from: Point3, to: Point3) -> f64 {
        let height = self.link_height(from, to);
        let (a, b) = (self.frame.to_setup(&from), self.frame.to_setup(&to));
        let feed = self.feeds.cut_mm_per_min;
        let lead_mm = (height - a.z).min(self.clearance_mm) + (height - b.z).min(self.clearance_mm);
        let rapid_mm = 2.0 * height - a.z - b.z - lead_mm + (b - a).xy().norm();
        lead_mm * feed / self.feeds.lead_mm_per_min + rapid_mm * feed / self.feeds.rapid_mm_per_min + STOPS_MM
    }
}

impl Pass {
    /// About how long it is.
    fn length_mm(&self) -> f64 {
        self.curves.iter().map(polygon_mm).sum()
    }

    fn start(&self) -> Point3 {
        self.curves[0].points()[0]
    }

    fn end(&self) -> Point3 {
        let points = self.curves[self.curves.len() - 1].points();
        points[points.len() - 1]
    }

    /// A piece of it, as written.
    fn piece(&self, piece: &Piece, put_off: usize) -> Option<Pass> {
        let mut curves: Vec<Curve3> = Vec::with_capacity(piece.len());
        for stretch in piece {
            let mut curve = written_between(self.curves.get(stretch.curve)?, stretch.between)?;
            if let Some(before) = curves.last() {
                move_end(&mut curve, false, before.end());
            }
            curves.push(curve);
        }
        (!curves.is_empty()).then_some(Pass { curves, put_off, ..*self })
    }

    /// Where leads take over.
    fn before(&self) -> End {
        End::before(&self.curves[0])
    }

    fn behind(&self) -> End {
        End::behind(&self.curves[self.curves.len() - 1])
    }

    fn reverse(&mut self) {
        self.curves.reverse();
        for c in &mut self.curves {
            *c = reversed_from_zero(c);
        }
    }
}
