//! Passes on which the shank would run into stock that is still there.
//!
//! ```text
//!        │shank│▒▒▒▒         The flutes clear a way as wide as they are, and no higher than they are long. Where stock
//!        ╞═════╡▒▒▒▒ ◄─ hit   stands higher beside the tool, and no pass before has taken it away, a thicker holder or shank
//!        │flute│              runs into it. Such passes are put off to the end of the setup, as
//!                            often as it takes; where stock is in the way still, they are left out.
//!        ╰──◡──╯              Such links lift over.
//! ```
//!
//! A row is left out as a whole, and the next one is a step-over away. So a part of which passes are left out is laid again, up
//! to where the shank stands clear when its setup is done ([`ShankRoom`]).

use std::collections::{BTreeMap, BTreeSet};

use claymill_stock::{Chords, Stock, StockError, Sweep, ToolBody};
use claymill_toolpath::{Cancelled, LinkStyle, Monitor, Move, MoveKind, raise_tips};
use rayon::prelude::*;

use crate::Frame;
use crate::containment::room::ShankRoom;
use crate::plan::options::InProcess;
use crate::program::part::{Later, Part};
use crate::setup::context::SetupContext;

/// Chords deviate from moves by so many pitches of the stock at most.
const CHORD_PITCHES: f64 = 0.02;
/// The shank keeps so many pitches of the stock away from it.
const MARGIN_PITCHES: f64 = 1.0;
/// After a change the ways between passes are others, and so the program is looked at until nothing is struck, so many times at most.
const ROUNDS: usize = 12;
/// In rounds after these, passes are left out and no longer put off.
const ROUNDS_TO_PUT_OFF: usize = 8;
/// So many passes are looked at side by side.
const BATCH: usize = 128;

/// Passes that were left out.
#[derive(Debug, Default)]
pub(crate) struct LeftOutPasses {
    /// How many they are.
    pub(crate) count: u32,
    /// The parts they are of, by setup and region.
    pub(crate) parts: BTreeSet<(usize, usize)>,
}

/// Takes out of the parts of a program what the shank cannot follow into the stock. `moves` are those of the program.
pub(crate) fn leave_out_struck(
    shank: &Shank,
    contexts: &[SetupContext],
    parts: &mut [(usize, usize, Part)],
    moves: impl Fn(&[(usize, usize, Part)]) -> Vec<Move>,
    monitor: &dyn Monitor,
) -> Result<LeftOutPasses, Cancelled> {
    let mut left_out = LeftOutPasses::default();
    for round in 0..ROUNDS {
        let known = PutOff::of(contexts, parts);
        let mut struck = shank.struck(moves(parts), &known, monitor)?;
        if struck.is_empty() {
            break;
        }
        if round >= ROUNDS_TO_PUT_OFF {
            struck.passes.values_mut().for_each(|when| *when = None);
        }
        for (setup, region, part) in parts.iter_mut() {
            let context = &contexts[*setup];
            let is_own = |of: &PassOf| of.region == *region && of.setup == context.frame.name.as_str();
            let passes = struck.passes.iter().filter(|(of, _)| is_own(of)).map(|(of, when)| (of.pass, *when));
            let links = struck.links.iter().filter(|of| is_own(of)).map(|of| of.pass);
            let (passes, links) = (passes.collect::<BTreeMap<_, _>>(), links.collect::<BTreeSet<_>>());
            if !(links.is_empty() && passes.is_empty()) {
                let count = context.link_again(part, &passes, &links);
                if count > 0 {
                    left_out.count += count;
                    left_out.parts.insert((*setup, *region));
                }
            }
        }
    }
    Ok(left_out)
}

/// A pass of a program.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct PassOf {
    setup: String,
    region: usize,
    pass: u32,
}

impl PassOf {
    fn of(m: &Move) -> Self {
        PassOf { setup: m.setup.clone(), region: m.region, pass: m.pass }
    }
}

/// Passes that were put off.
struct PutOff {
    /// How often those that come last, by setup.
    last: BTreeMap<String, usize>,
    passes: BTreeSet<PassOf>,
    is_zigzag: bool,
}

impl PutOff {
    fn of(contexts: &[SetupContext], parts: &[(usize, usize, Part)]) -> Self {
        let is_zigzag = contexts.iter().all(|context| context.link == LinkStyle::Zigzag);
        let mut all = PutOff { last: BTreeMap::new(), passes: BTreeSet::new(), is_zigzag };
        for &(setup, region, ref part) in parts {
            let setup = contexts[setup].frame.name.to_string();
            for (pass, laid) in (0..).zip(&part.laid).filter(|(_, laid)| laid.put_off > 0) {
                let last = all.last.entry(setup.clone()).or_default();
                *last = laid.put_off.max(*last);
                all.passes.insert(PassOf { setup: setup.clone(), region, pass });
            }
        }
        all
    }

    /// Once is enough: its leads change with it, and it might turn for ever.
    fn may_turn(&self, pass: &PassOf) -> bool {
        self.is_zigzag && !self.passes.contains(pass)
    }
}

/// What the shank cannot follow.
#[derive(Debug, Default)]
struct Struck {
    /// Passes with when it can; `None` where it never can.
    passes: BTreeMap<PassOf, Option<Later>>,
    /// Passes to which no link may lead.
    links: BTreeSet<PassOf>,
}

impl Struck {
    fn is_empty(&self) -> bool {
        self.passes.is_empty() && self.links.is_empty()
    }
}

/// What of a tool is above its flutes, and the stock that it comes into.
pub(crate) struct Shank<'a> {
    stock: &'a Stock,
    cutting: ToolBody,
    above: ToolBody,
    chord_mm: f64,
    /// Tips of the tool are this far above those of the plan, along the axis, mm.
    raised_mm: f64,
}

impl<'a> Shank<'a> {
    /// `None` for a tool of which only flutes are known. One that has no body is refused elsewhere.
    pub(crate) fn of(in_process: &'a InProcess) -> Option<Self> {
        if in_process.tool.sides().len() < 2 { None } else { Shank::new(in_process).ok() }
    }

    fn new(in_process: &'a InProcess) -> Result<Self, StockError> {
        let InProcess { stock, tool, allowance_mm } = in_process;
        let chord_mm = CHORD_PITCHES * stock.grid().pitch_mm();
        let cutting = ToolBody::cutting(tool)?.offset(-chord_mm)?;
        let above = ToolBody::above(tool, None)?.offset(chord_mm)?;
        Ok(Shank { stock, cutting, above, chord_mm, raised_mm: *allowance_mm })
    }

    /// What the shank cannot follow, each pass cut before the next one is looked at: a pass on which it is struck is put off until all
    /// others of its setup are done. `known` are those that were put off before.
    fn struck(
        &self,
        mut moves: Vec<Move>,
        known: &PutOff,
        monitor: &dyn Monitor,
    ) -> Result<Struck, Cancelled> {
        moves.retain(|m| m.kind != MoveKind::Rapid);
        raise_tips(&mut moves, self.raised_mm);
        lead_outs_to_their_passes(&mut moves);
        let (mut stock, mut struck) = (self.stock.clone(), Struck::default());
        for of_setup in moves.chunk_by(|a, b| a.setup == b.setup) {
            let passes: Vec<&[Move]> =
                of_setup.chunk_by(|a, b| (a.region, a.pass) == (b.region, b.pass)).collect();
            let mut put_off = Vec::new();
            for batch in passes.chunks(BATCH) {
                monitor.go_on()?;
                let all: Vec<PassWays<'_>> = batch.par_iter().map(|moves| self.pass_ways(moves)).collect();
                // Stock only goes: what was clear before the batch is clear.
                let clear: Vec<bool> = all.par_iter().map(|pass| pass.is_clear(&stock)).collect();
                let mut waiting = Vec::new();
                for (pass, is_clear) in all.into_iter().zip(clear) {
                    if is_clear {
                        waiting.extend(
                            pass.link.iter().chain(&pass.cut).flat_map(|ways| &ways.cutting).copied(),
                        );
                        continue;
                    }
                    stock.cut_all(&std::mem::take(&mut waiting));
                    let after_link = after(&stock, &pass.link, false);
                    if after_link.is_none() {
                        struck.links.insert(pass.of.clone());
                    }
                    match after(after_link.as_ref().unwrap_or(&stock), &pass.cut, false) {
                        Some(after_pass) => stock = after_pass,
                        None => put_off.push(pass),
                    }
                }
                stock.cut_all(&waiting);
            }
            let mut times = known.last.get(&of_setup[0].setup).copied().unwrap_or_default();
            while !put_off.is_empty() {
                monitor.go_on()?;
                times += 1;
                // In whatever order those come that were put off as often.
                let found: Vec<Option<bool>> =
                    put_off.par_iter().map(|pass| pass.turn_for(&stock, known.may_turn(&pass.of))).collect();
                let is_stuck = found.iter().all(Option::is_none);
                let mut left = Vec::new();
                for (pass, found) in put_off.into_iter().zip(found) {
                    match found {
                        Some(is_reversed) => {
                            stock.cut_all(&pass.cutting());
                            struck.passes.insert(pass.of, Some(Later { times, is_reversed }));
                        }
                        None if is_stuck => {
                            struck.passes.insert(pass.of, None);
                        }
                        None => left.push(pass),
                    }
                }
                put_off = left;
            }
        }
        Ok(struck)
    }

    /// What the stock cannot take for a curve is left to the verifier.
    fn pass_ways(&self, moves: &[Move]) -> PassWays<'_> {
        let ways = |is_link: bool| {
            let own = moves.iter().filter(move |m| (m.kind == MoveKind::Link) == is_link);
            own.filter_map(|m| self.ways(m).ok()).collect()
        };
        PassWays { of: PassOf::of(&moves[0]), link: ways(true), cut: ways(false) }
    }

    /// Where the shank stands clear when setups are done, by their names; `radius_mm` is that of the tool as the moves are planned.
    pub(crate) fn rooms(
        &self,
        mut moves: Vec<Move>,
        frames: &[Frame],
        radius_mm: f64,
        monitor: &dyn Monitor,
    ) -> Result<BTreeMap<String, ShankRoom>, Cancelled> {
        let margin_mm = MARGIN_PITCHES * self.stock.grid().pitch_mm();
        let Ok(above) = self.above.offset(margin_mm) else { return Ok(BTreeMap::new()) };
        moves.retain(|m| m.kind != MoveKind::Rapid);
        raise_tips(&mut moves, self.raised_mm);
        let (mut stock, mut rooms) = (self.stock.clone(), BTreeMap::new());
        for of_setup in moves.chunk_by(|a, b| a.setup == b.setup) {
            for batch in of_setup.chunks(BATCH) {
                monitor.go_on()?;
                let all: Vec<Ways<'_>> = batch.par_iter().filter_map(|m| self.ways(m).ok()).collect();
                stock.cut_all(&all.iter().flat_map(|ways| ways.cutting.iter().copied()).collect::<Vec<_>>());
            }
            let Some(frame) = frames.iter().find(|frame| frame.name.as_str() == of_setup[0].setup) else {
                continue;
            };
            let tip_mm = radius_mm - self.raised_mm;
            let room = ShankRoom::new(stock.clone(), above.clone(), *frame, tip_mm);
            rooms.insert(of_setup[0].setup.clone(), room);
        }
        Ok(rooms)
    }

    fn ways(&self, m: &Move) -> Result<Ways<'_>, StockError> {
        let chords = Chords::of_move(m, self.chord_mm)?;
        let axis = m.axis_start.into();
        Ok(Ways { cutting: chords.sweeps(&self.cutting, axis)?, above: chords.sweeps(&self.above, axis)? })
    }
}

/// What flutes and shank sweep on a move.
struct Ways<'a> {
    cutting: Vec<Sweep<'a>>,
    above: Vec<Sweep<'a>>,
}

impl Ways<'_> {
    fn are_clear(&self, stock: &Stock) -> bool {
        let margin_mm = MARGIN_PITCHES * stock.grid().pitch_mm();
        self.above.iter().all(|sweep| stock.is_clear(sweep, margin_mm).unwrap_or(true))
    }
}

/// The same on a pass: the link to it, and all else.
struct PassWays<'a> {
    of: PassOf,
    link: Vec<Ways<'a>>,
    cut: Vec<Ways<'a>>,
}

impl PassWays<'_> {
    fn cutting(&self) -> Vec<Sweep<'_>> {
        self.cut.iter().flat_map(|ways| ways.cutting.iter().copied()).collect()
    }

    /// Whether the shank is clear of stock as the pass runs, `false`, or turned, `true`.
    fn turn_for(&self, stock: &Stock, may_turn: bool) -> Option<bool> {
        let turns = if may_turn { &[false, true][..] } else { &[false] };
        turns.iter().copied().find(|turn| after(stock, &self.cut, *turn).is_some())
    }

    fn is_clear(&self, stock: &Stock) -> bool {
        self.link.iter().chain(&self.cut).all(|ways| ways.are_clear(stock))
    }
}

/// A program numbers the way to a pass like the pass. What leads off the one before is struck where that one ends.
fn lead_outs_to_their_passes(moves: &mut [Move]) {
    for k in 1..moves.len() {
        let (before, rest) = moves.split_at_mut(k);
        let (last, next) = (&before[k - 1], &mut rest[0]);
        if next.kind == MoveKind::LeadOut && next.setup == last.setup {
            (next.region, next.pass) = (last.region, last.pass);
        }
    }
}

/// The stock after moves, where the shank is clear on all of them. On its way the tool clears its own shank's.
fn after(stock: &Stock, moves: &[Ways<'_>], are_reversed: bool) -> Option<Stock> {
    let mut stock = stock.clone();
    let is_clear = |ways: &Ways<'_>| {
        stock.cut_all(&ways.cutting);
        ways.are_clear(&stock)
    };
    let is_clear = if are_reversed { moves.iter().rev().all(is_clear) } else { moves.iter().all(is_clear) };
    is_clear.then_some(stock)
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::{Point3, Vector3};

    use super::*;

    #[test]
    fn what_leads_off_a_pass_is_struck_on_that_pass() {
        let straight = |kind, pass, region| {
            let (from, to) = (Point3::origin(), Point3::new(1.0, 0.0, 0.0));
            Move { pass, region, ..Move::straight(kind, from, to, Vector3::z(), 1.0) }
        };
        use MoveKind::{Cut, LeadIn, LeadOut, Link};
        let mut moves = vec![
            straight(Cut, 4, 1),
            straight(LeadOut, 0, 2),
            straight(LeadOut, 0, 2),
            straight(LeadIn, 0, 2),
            straight(Cut, 0, 2),
            straight(Link, 1, 2),
        ];
        lead_outs_to_their_passes(&mut moves);
        let of: Vec<(usize, u32)> = moves.iter().map(|m| (m.region, m.pass)).collect();
        assert_eq!(of, [(1, 4), (1, 4), (1, 4), (2, 0), (2, 0), (2, 1)]);
    }
}
