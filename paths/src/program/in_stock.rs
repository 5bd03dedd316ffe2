//! Passes on which the shank would run into stock that is still there.
//!
//! ```text
//!        │shank│▒▒▒▒         The flutes clear a way as wide as they are, and no higher than they are long. Where stock
//!        ╞═════╡▒▒▒▒ ◄─ hit   stands higher beside the tool, and no pass before has taken it away, a thicker holder or shank
//!        │flute│              runs into it. Such passes come last; where stock is in the way even
//!                            then they are left out. Such links lift over.
//!        ╰──◡──╯
//! ```
//!
//! A row is left out as a whole, and the next one is a step-over away. So a part of which passes are left out is laid again, up
//! to where the shank stands clear when its setup is done ([`ShankRoom`]).

use std::collections::{BTreeMap, BTreeSet};

use claymill_stock::{Chords, Stock, StockError, Sweep, ToolBody};
use claymill_toolpath::{Cancelled, Monitor, Move, MoveKind, raise_tips};
use rayon::prelude::*;

use crate::Frame;
use crate::containment::room::ShankRoom;
use crate::plan::options::InProcess;
use crate::program::part::Part;
use crate::setup::context::SetupContext;

/// Chords deviate from moves by so many pitches of the stock at most.
const CHORD_PITCHES: f64 = 0.02;
/// The shank keeps so many pitches of the stock away from it.
const MARGIN_PITCHES: f64 = 0.5;
/// A pass that is left out leaves its stock to others: the program is looked at so many times.
const ROUNDS: usize = 4;
/// So many moves are looked at side by side.
const BATCH: usize = 512;

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
        let struck = shank.struck(moves(parts), monitor)?;
        if struck.is_empty() {
            break;
        }
        for (setup, region, part) in parts.iter_mut() {
            let context = &contexts[*setup];
            let own = struck.iter().filter(|s| s.region == *region && s.setup == context.frame.name.as_str());
            let (links, passes): (Vec<&Struck>, Vec<&Struck>) = own.partition(|s| s.on_a_link);
            let numbers = |all: Vec<&Struck>| all.into_iter().map(|s| s.pass).collect::<BTreeSet<u32>>();
            let (links, passes) = (numbers(links), numbers(passes));
            if !(links.is_empty() && passes.is_empty()) {
                // At first they come last: others may clear their way.
                let last = round == 0;
                if !(last || passes.is_empty()) {
                    left_out.count += passes.len() as u32;
                    left_out.parts.insert((*setup, *region));
                }
                context.link_again(part, &passes, &links, last);
            }
        }
    }
    Ok(left_out)
}

/// A move on which the shank runs into stock.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Struck {
    setup: String,
    region: usize,
    /// The pass, or the one that a link leads to.
    pass: u32,
    on_a_link: bool,
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

    /// The moves on which it runs into stock, each cut before the next one is looked at.
    fn struck(&self, mut moves: Vec<Move>, monitor: &dyn Monitor) -> Result<BTreeSet<Struck>, Cancelled> {
        let mut stock = self.stock.clone();
        let mut struck = BTreeSet::new();
        moves.retain(|m| m.kind != MoveKind::Rapid);
        raise_tips(&mut moves, self.raised_mm);
        for batch in moves.chunks(BATCH) {
            monitor.go_on()?;
            // What the stock cannot take for a curve is left to the verifier.
            let all: Vec<Option<Ways<'_>>> = batch.par_iter().map(|m| self.ways(m).ok()).collect();
            let is_clear = |ways: &Option<Ways<'_>>| ways.as_ref().is_none_or(|w| Self::is_clear(&stock, w));
            // Stock only goes: what was clear before the batch is clear.
            let clear: Vec<bool> = all.par_iter().map(is_clear).collect();
            let mut waiting = Vec::new();
            for ((m, ways), clear) in batch.iter().zip(&all).zip(clear) {
                let Some(ways) = ways else { continue };
                waiting.extend_from_slice(&ways.cutting);
                if clear {
                    continue;
                }
                stock.cut_all(&std::mem::take(&mut waiting));
                if !Self::is_clear(&stock, ways) {
                    let on_a_link = m.kind == MoveKind::Link;
                    let (setup, region, pass) = (m.setup.clone(), m.region, m.pass);
                    struck.insert(Struck { setup, region, pass, on_a_link });
                }
            }
            stock.cut_all(&waiting);
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

    fn is_clear(stock: &Stock, ways: &Ways<'_>) -> bool {
        let margin_mm = MARGIN_PITCHES * stock.grid().pitch_mm();
        ways.above.iter().all(|sweep| stock.is_clear(sweep, margin_mm).unwrap_or(true))
    }
}

/// What flutes and shank sweep on a move.
struct Ways<'a> {
    cutting: Vec<Sweep<'a>>,
    above: Vec<Sweep<'a>>,
}
