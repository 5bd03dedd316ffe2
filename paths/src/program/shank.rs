//! What of the tool is above its flutes, shank and holder, on its way through the stock: where it stands clear, and where it is struck.

use claymill_nurbs::Curve3;
use claymill_stock::{Chords, Stock, StockError, Sweep, ToolBody};
use claymill_toolpath::{Cancelled, Monitor, Move, MoveKind};

use crate::fit::written::polygon_mm;
use crate::plan::options::InProcess;
use crate::program::part::{Piece, Stretch};

/// Chords deviate from moves by so many pitches of the stock at most.
const CHORD_PITCHES: f64 = 0.02;
/// The shank keeps so many pitches of the stock away from it.
const MARGIN_PITCHES: f64 = 1.0;
/// A pass is cut into pieces at places this far apart, in tool radii.
const STRETCH_RADII: f64 = 0.25;

/// What of a tool is above its flutes, and the stock that it comes into. The holder counts as a part of the shank.
pub(crate) struct Shank<'a> {
    stock: &'a Stock,
    cutting: ToolBody,
    above: ToolBody,
    chord_mm: f64,
    stretch_mm: f64,
    /// Tips of the tool are this far above those of the plan, along the axis, mm.
    raised_mm: f64,
}

impl<'a> Shank<'a> {
    /// `None` for a tool of which only flutes are known, and no holder. One that has no body is refused elsewhere.
    pub(crate) fn of(in_process: &'a InProcess) -> Option<Self> {
        let is_bare = in_process.tool.sides().len() < 2 && in_process.holder.is_none();
        if is_bare { None } else { Shank::new(in_process).ok() }
    }

    fn new(in_process: &'a InProcess) -> Result<Self, StockError> {
        let InProcess { stock, tool, holder, allowance_mm } = in_process;
        let pitch_mm = stock.grid().pitch_mm();
        let chord_mm = CHORD_PITCHES * pitch_mm;
        let cutting = ToolBody::cutting(tool)?.offset(-chord_mm)?;
        let above = ToolBody::above(tool, holder.as_ref())?.offset(chord_mm)?;
        let stretch_mm = (STRETCH_RADII * tool.radius_mm()).max(pitch_mm);
        Ok(Shank { stock, cutting, above, chord_mm, stretch_mm, raised_mm: *allowance_mm })
    }

    /// Before anything of the program is cut.
    pub(crate) fn stock(&self) -> &Stock {
        self.stock
    }

    /// What is above the flutes, larger by the distance that it keeps.
    pub(crate) fn with_margin(&self) -> Option<ToolBody> {
        self.above.offset(MARGIN_PITCHES * self.stock.grid().pitch_mm()).ok()
    }

    pub(crate) fn raised_mm(&self) -> f64 {
        self.raised_mm
    }

    /// What the stock cannot take for a curve is left to the verifier.
    pub(crate) fn pass_ways<'m>(&self, moves: &'m [Move]) -> PassWays<'m, '_> {
        let ways = |is_link: bool| {
            let own = moves.iter().filter(move |m| (m.kind == MoveKind::Link) == is_link);
            own.filter_map(|m| self.ways(m).ok()).collect()
        };
        PassWays { moves, link: ways(true), cut: ways(false) }
    }

    /// Cuts into stock what of a pass the shank can follow, piece by piece.
    pub(crate) fn cut_pieces(
        &self,
        pass: &PassWays<'_, '_>,
        stock: &mut Stock,
        monitor: &dyn Monitor,
    ) -> Result<Vec<Piece>, Cancelled> {
        let cuts: Vec<&Move> = pass.moves.iter().filter(|m| m.kind == MoveKind::Cut).collect();
        let mut leads = pass.moves.split(|m| m.kind == MoveKind::Cut);
        let follows = |moves: Option<&[Move]>, stock: &Stock| {
            let ways = moves.unwrap_or_default().iter().filter(|m| m.kind != MoveKind::Link);
            after(stock, &ways.filter_map(|m| self.ways(m).ok()).collect::<Vec<_>>(), false).is_some()
        };
        let (lead_in, lead_out) = (leads.next(), leads.next_back());
        let is_led_in = follows(lead_in, stock);
        let mut stretches: Vec<(Stretch, bool)> = Vec::new();
        for (index, m) in cuts.iter().enumerate() {
            let Ok(curve) = m.curve() else { continue };
            for between in stretches_of(&curve, self.stretch_mm) {
                monitor.go_on()?;
                let part = curve.between(between[0], between[1]);
                let along = |part| self.ways(&Move::along(MoveKind::Cut, &part, m.axis_start.into(), m.feed));
                let Some(Ok(ways)) = part.map(along) else { continue };
                let is_clear = match after(stock, std::slice::from_ref(&ways), false) {
                    Some(cut) => {
                        *stock = cut;
                        true
                    }
                    None => false,
                };
                stretches.push((Stretch { curve: index, between }, is_clear));
            }
        }
        let is_led_out = follows(lead_out, stock);
        // Where no lead gets to an end, it is another one.
        let is_whole = stretches.iter().all(|(_, is_clear)| *is_clear);
        let last = stretches.len().saturating_sub(1);
        if let Some((_, is_clear)) = stretches.first_mut() {
            *is_clear &= is_led_in && !(is_whole && is_led_out);
        }
        if let Some((_, is_clear)) = stretches.get_mut(last) {
            *is_clear &= is_led_out;
        }
        let runs = stretches.chunk_by(|a, b| a.1 == b.1).filter(|run| run[0].1);
        Ok(runs.map(|run| joined(run.iter().map(|(stretch, _)| *stretch))).collect())
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
pub(crate) struct PassWays<'m, 'a> {
    /// The moves of the pass.
    pub(crate) moves: &'m [Move],
    link: Vec<Ways<'a>>,
    cut: Vec<Ways<'a>>,
}

impl<'a> PassWays<'_, 'a> {
    /// What its flutes sweep.
    pub(crate) fn cutting(&self) -> Vec<Sweep<'a>> {
        self.cut.iter().flat_map(|ways| ways.cutting.iter().copied()).collect()
    }

    /// The same with the link to it.
    pub(crate) fn cutting_with_link(&self) -> impl Iterator<Item = Sweep<'a>> {
        self.link.iter().chain(&self.cut).flat_map(|ways| ways.cutting.iter().copied())
    }

    /// The stock after the link to it, where the shank is clear.
    pub(crate) fn after_link(&self, stock: &Stock) -> Option<Stock> {
        after(stock, &self.link, false)
    }

    /// The stock after the pass, where the shank is clear.
    pub(crate) fn after(&self, stock: &Stock) -> Option<Stock> {
        after(stock, &self.cut, false)
    }

    /// Whether the shank is clear of stock as the pass runs, `false`, or turned, `true`.
    pub(crate) fn turn_for(&self, stock: &Stock, may_turn: bool) -> Option<bool> {
        let turns = if may_turn { &[false, true][..] } else { &[false] };
        turns.iter().copied().find(|turn| after(stock, &self.cut, *turn).is_some())
    }

    /// Whether it is clear before anything of the pass is cut.
    pub(crate) fn is_clear(&self, stock: &Stock) -> bool {
        self.link.iter().chain(&self.cut).all(|ways| ways.are_clear(stock))
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

/// Parameters between which a curve is about so long.
fn stretches_of(curve: &Curve3, length_mm: f64) -> Vec<[f64; 2]> {
    let mut stretches = Vec::new();
    for piece in curve.bezier_pieces() {
        let ((from, to), count) = (piece.domain(), (polygon_mm(&piece) / length_mm).ceil().max(1.0));
        let at = |k: usize| if k as f64 == count { to } else { from + (to - from) * k as f64 / count };
        stretches.extend((0..count as usize).map(|k| [at(k), at(k + 1)]));
    }
    stretches
}

/// Stretches that follow each other, those of one curve in one.
fn joined(stretches: impl Iterator<Item = Stretch>) -> Piece {
    let mut piece: Piece = Vec::new();
    for stretch in stretches {
        match piece.last_mut() {
            Some(last) if last.curve == stretch.curve => last.between[1] = stretch.between[1],
            _ => piece.push(stretch),
        }
    }
    piece
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use claymill_nurbs::{Aabb, Point3, Vector3};
    use claymill_toolpath::Tool;

    use super::*;

    #[test]
    fn a_curve_falls_into_stretches_that_join_again() {
        let curve = Curve3::line(Point3::origin(), Point3::new(10.0, 0.0, 0.0));
        let stretches = stretches_of(&curve, 3.0);
        assert_eq!(stretches, [[0.0, 0.25], [0.25, 0.5], [0.5, 0.75], [0.75, 1.0]]);
        let of = |curve, between| Stretch { curve, between };
        let all = stretches.iter().map(|&between| of(4, between)).chain([of(5, [0.0, 1.0])]);
        assert_eq!(joined(all), [of(4, [0.0, 1.0]), of(5, [0.0, 1.0])]);
    }

    /// A block 30 mm high is cut down to 14 mm but for a ridge at x = 100 mm. Along y = 30 mm flutes of 15 mm with a shank of 12 mm
    /// radius go 5 mm above its ground.
    #[test]
    fn a_pass_is_left_out_only_where_the_shank_is_struck() {
        let bounds = Aabb { min: Point3::new(0.0, 0.0, 0.0), max: Point3::new(200.0, 60.0, 30.0) };
        let mut stock = Stock::block(&bounds, 0.5).unwrap();
        let wide = ToolBody::cutting(&"flat:100,length:80".parse::<Tool>().unwrap()).unwrap();
        for (from, to) in [(-150.0, -5.0), (205.0, 350.0)] {
            let [from, to] = [from, to].map(|x| Point3::new(x, 30.0, 14.0));
            stock.cut_all(&[Sweep::new(&wide, Vector3::z(), from, to).unwrap()]);
        }
        let at = |x: f64| Point3::new(x, 30.0, 5.0);
        let moves = [Move::straight(MoveKind::Cut, at(0.0), at(200.0), Vector3::z(), 1000.0)];
        let tool = "flat:10,length:15,shank:24".parse().unwrap();
        let in_process = InProcess { stock: Arc::new(stock.clone()), tool, holder: None, allowance_mm: 0.0 };
        let shank = Shank::of(&in_process).unwrap();
        let pass = shank.pass_ways(&moves);
        assert!(pass.after(&stock).is_none());
        let pieces = shank.cut_pieces(&pass, &mut stock, &()).unwrap();
        let [[first], [second]] = [&pieces[0][..], &pieces[1][..]] else { panic!("{pieces:?}") };
        // The shank keeps a pitch away from the ridge, and a piece is no longer than 2.5 mm.
        let most = 95.0 - 12.0 - 0.5;
        assert!(first.between[0] == 0.0 && (most - 3.0..most).contains(&first.between[1]), "{first:?}");
        assert_eq!(second.between, [200.0 - first.between[1], 200.0]);
        assert_eq!(pieces.len(), 2);
        // The pieces are cut.
        let pass = |[from, to]: [f64; 2]| Sweep::new(&shank.cutting, Vector3::z(), at(from), at(to)).unwrap();
        assert!(stock.is_clear(&pass([0.0, 75.0]), 0.0).unwrap());
        assert!(!stock.is_clear(&pass([90.0, 92.0]), 0.0).unwrap());
    }

    #[test]
    fn a_pass_loses_the_end_that_no_lead_gets_to() {
        let bounds = Aabb { min: Point3::new(100.0, 0.0, 0.0), max: Point3::new(300.0, 60.0, 60.0) };
        let mut stock = Stock::block(&bounds, 0.5).unwrap();
        let [start, end, in_the_block] =
            [[0.0, 30.0, 5.0], [50.0, 30.0, 5.0], [120.0, 30.0, 40.0]].map(Point3::from);
        let straight = |kind, from, to| Move::straight(kind, from, to, Vector3::z(), 1000.0);
        let moves = [straight(MoveKind::LeadIn, in_the_block, start), straight(MoveKind::Cut, start, end)];
        let tool = "flat:10,length:15,shank:24".parse().unwrap();
        let in_process = InProcess { stock: Arc::new(stock.clone()), tool, holder: None, allowance_mm: 0.0 };
        let shank = Shank::of(&in_process).unwrap();
        let pieces = shank.cut_pieces(&shank.pass_ways(&moves), &mut stock, &()).unwrap();
        assert_eq!(pieces, [vec![Stretch { curve: 0, between: [2.5, 50.0] }]]);
    }
}
