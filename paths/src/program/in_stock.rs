//! Passes on which the shank would run into stock that is still there.
//!
//! ```text
//!        │shank│▒▒▒▒         The flutes clear a way as wide as they are, and no higher than they are long. Where stock
//!        ╞═════╡▒▒▒▒ ◄─ hit   stands higher beside the tool, and no pass before has taken it away, a thicker holder or shank
//!        │flute│              runs into it. Such passes are put off to the end of the setup, as
//!                            often as it takes. Where stock is in the way still, what of them is struck is left
//!        ╰──◡──╯              out. Such links lift over.
//! ```
//!
//! The next pass beside one that is left out is a step-over away. So a part of which much is left out is laid again, up to where the
//! shank stands clear when its setup is done ([`ShankRoom`]).

use std::collections::{BTreeMap, BTreeSet};

use claymill_stock::Stock;
use claymill_toolpath::{Cancelled, LinkStyle, Monitor, Move, MoveKind, raise_tips};
use rayon::prelude::*;

use crate::Frame;
use crate::containment::room::ShankRoom;
use crate::program::part::{Amendment, CutShort, Later, Part};
use crate::program::shank::{PassWays, Shank};
use crate::setup::context::SetupContext;

/// After a change the ways between passes are others, and so the program is looked at until nothing is struck, so many times at most.
const ROUNDS: usize = 12;
/// In rounds after these, passes are left out and no longer put off.
const ROUNDS_TO_PUT_OFF: usize = 9;
/// So many passes are looked at side by side.
const BATCH: usize = 128;

/// Takes out of the parts of a program what the shank cannot follow into the stock; the passes that are not whole any more, by setup
/// and region. `moves` are those of the program.
pub(crate) fn leave_out_struck(
    shank: &Shank,
    contexts: &[SetupContext],
    parts: &mut [(usize, usize, Part)],
    moves: impl Fn(&[(usize, usize, Part)]) -> Vec<Move>,
    monitor: &dyn Monitor,
) -> Result<BTreeMap<(usize, usize), CutShort>, Cancelled> {
    let mut all: BTreeMap<_, CutShort> = BTreeMap::new();
    for round in 0..ROUNDS {
        let known = PutOff::of(contexts, parts);
        let mut struck = shank.struck(moves(parts), &known, monitor)?;
        if struck.is_empty() {
            break;
        }
        if round >= ROUNDS_TO_PUT_OFF {
            struck.passes.values_mut().for_each(|pass| *pass = Amendment::Pieces(0, Vec::new()));
        }
        for (setup, region, part) in parts.iter_mut() {
            let context = &contexts[*setup];
            let is_own = |of: &PassOf| of.region == *region && of.setup == context.frame.name.as_str();
            let passes = struck.passes.iter().filter(|(of, _)| is_own(of));
            let passes: BTreeMap<_, _> = passes.map(|(of, pass)| (of.pass, pass)).collect();
            let links = struck.links.iter().filter(|of| is_own(of)).map(|of| of.pass);
            let links: BTreeSet<_> = links.collect();
            if !(links.is_empty() && passes.is_empty()) {
                let found = context.link_again(part, &passes, &links);
                let cut_short = all.entry((*setup, *region)).or_default();
                cut_short.passes += found.passes;
                cut_short.left_out_mm += found.left_out_mm;
            }
        }
    }
    Ok(all)
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
    /// Passes with what becomes of them.
    passes: BTreeMap<PassOf, Amendment>,
    /// Passes to which no link may lead.
    links: BTreeSet<PassOf>,
}

impl Struck {
    fn is_empty(&self) -> bool {
        self.passes.is_empty() && self.links.is_empty()
    }
}

impl Shank<'_> {
    /// What the shank cannot follow, each pass cut before the next one is looked at: a pass on which it is struck is put off until all
    /// others of its setup are done. `known` are those that were put off before.
    fn struck(
        &self,
        mut moves: Vec<Move>,
        known: &PutOff,
        monitor: &dyn Monitor,
    ) -> Result<Struck, Cancelled> {
        moves.retain(|m| m.kind != MoveKind::Rapid);
        raise_tips(&mut moves, self.raised_mm());
        lead_outs_to_their_passes(&mut moves);
        let (mut stock, mut struck) = (self.stock().clone(), Struck::default());
        for of_setup in moves.chunk_by(|a, b| a.setup == b.setup) {
            let passes: Vec<&[Move]> =
                of_setup.chunk_by(|a, b| (a.region, a.pass) == (b.region, b.pass)).collect();
            let mut put_off = Vec::new();
            for batch in passes.chunks(BATCH) {
                monitor.go_on()?;
                let all: Vec<PassWays> = batch.par_iter().map(|moves| self.pass_ways(moves)).collect();
                // Stock only goes: what was clear before the batch is clear.
                let clear: Vec<bool> = all.par_iter().map(|pass| pass.is_clear(&stock)).collect();
                let mut waiting = Vec::new();
                for (pass, is_clear) in all.into_iter().zip(clear) {
                    if is_clear {
                        waiting.extend(pass.cutting_with_link());
                        continue;
                    }
                    stock.cut_all(&std::mem::take(&mut waiting));
                    let after_link = pass.after_link(&stock);
                    if after_link.is_none() {
                        struck.links.insert(PassOf::of(&pass.moves[0]));
                    }
                    match pass.after(after_link.as_ref().unwrap_or(&stock)) {
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
                let turn = |pass: &PassWays, stock: &Stock| {
                    pass.turn_for(stock, known.may_turn(&PassOf::of(&pass.moves[0])))
                };
                let found: Vec<Option<bool>> = put_off.par_iter().map(|pass| turn(pass, &stock)).collect();
                let is_stuck = found.iter().all(Option::is_none);
                let mut left = Vec::new();
                for (pass, found) in put_off.into_iter().zip(found) {
                    monitor.go_on()?;
                    // What was left of others may be out of its way now.
                    let found = if is_stuck { turn(&pass, &stock) } else { found };
                    let amendment = match found {
                        Some(is_reversed) => {
                            stock.cut_all(&pass.cutting());
                            Amendment::Later(Later { times, is_reversed })
                        }
                        None if is_stuck => {
                            Amendment::Pieces(times, self.cut_pieces(&pass, &mut stock, monitor)?)
                        }
                        None => {
                            left.push(pass);
                            continue;
                        }
                    };
                    struck.passes.insert(PassOf::of(&pass.moves[0]), amendment);
                }
                put_off = left;
            }
        }
        Ok(struck)
    }

    /// Where the shank stands clear when setups are done, by their names; `radius_mm` is that of the tool as the moves are planned.
    pub(crate) fn rooms(
        &self,
        mut moves: Vec<Move>,
        frames: &[Frame],
        radius_mm: f64,
        monitor: &dyn Monitor,
    ) -> Result<BTreeMap<String, ShankRoom>, Cancelled> {
        let Some(above) = self.with_margin() else { return Ok(BTreeMap::new()) };
        moves.retain(|m| m.kind != MoveKind::Rapid);
        raise_tips(&mut moves, self.raised_mm());
        let (mut stock, mut rooms) = (self.stock().clone(), BTreeMap::new());
        for of_setup in moves.chunk_by(|a, b| a.setup == b.setup) {
            for batch in of_setup.chunks(BATCH) {
                monitor.go_on()?;
                let all: Vec<PassWays> =
                    batch.par_iter().map(|m| self.pass_ways(std::slice::from_ref(m))).collect();
                stock.cut_all(&all.iter().flat_map(PassWays::cutting_with_link).collect::<Vec<_>>());
            }
            let Some(frame) = frames.iter().find(|frame| frame.name.as_str() == of_setup[0].setup) else {
                continue;
            };
            let tip_mm = radius_mm - self.raised_mm();
            let room = ShankRoom::new(stock.clone(), above.clone(), *frame, tip_mm);
            rooms.insert(of_setup[0].setup.clone(), room);
        }
        Ok(rooms)
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
