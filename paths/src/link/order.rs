//! The order in which the passes of a part are cut: from each to the nearest, then improved.

use claymill_nurbs::Point3;
use claymill_toolpath::LinkStyle;

use crate::link::tour;

/// A pass as the orderer sees it: where it starts and ends. In space, since a row that falls off one sheet onto
/// another goes on there only after a retract.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ends {
    pub(crate) start: Point3,
    pub(crate) end: Point3,
}

/// A pass in the order of cutting.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Turn {
    pub(crate) pass: usize,
    /// Cut from end to start.
    pub(crate) reversed: bool,
}

impl Turn {
    /// Where the pass starts and ends when it is cut this way.
    pub(crate) fn ends(&self, passes: &[Ends]) -> Ends {
        let Ends { start, end } = passes[self.pass];
        if self.reversed { Ends { start: end, end: start } } else { Ends { start, end } }
    }
}

/// Zigzag passes cell by cell, or one-way passes row by row.
pub(crate) fn order(passes: &[Ends], style: LinkStyle) -> Vec<Turn> {
    match style {
        LinkStyle::Zigzag => {
            let mut turns = nearest_first(passes, true, |ends| ends.end);
            tour::shorten(passes, &mut turns, true);
            turns
        }
        // The next row is the one that starts nearest to where this one started.
        LinkStyle::OneWay => nearest_first(passes, false, |ends| ends.start),
    }
}

/// The order of whole parts, each cut from its start to its end.
pub(crate) fn order_parts(parts: &[Ends]) -> Vec<usize> {
    let mut turns = nearest_first(parts, false, |ends| ends.end);
    tour::shorten(parts, &mut turns, false);
    turns.into_iter().map(|t| t.pass).collect()
}

/// Always goes on with the pass that can be reached over the shortest way, the first one first. Ties go to the lower
/// number. `leave` is the place from where the way on is measured.
fn nearest_first(passes: &[Ends], reversible: bool, leave: impl Fn(&Ends) -> Point3) -> Vec<Turn> {
    let mut left: Vec<usize> = (0..passes.len()).collect();
    let mut turns = Vec::with_capacity(passes.len());
    let Some(first) = passes.first() else { return turns };
    let mut here = first.start;
    while !left.is_empty() {
        let mut best = (f64::INFINITY, 0, false);
        for (slot, &pass) in left.iter().enumerate() {
            let Ends { start, end } = passes[pass];
            for (to, reversed) in [(start, false), (end, true)].into_iter().take(1 + usize::from(reversible))
            {
                let distance = (to - here).norm_squared();
                if distance < best.0 {
                    best = (distance, slot, reversed);
                }
            }
        }
        let (_, slot, reversed) = best;
        // Keeps the order of what is left, so that ties stay with the lower row.
        let pass = left.remove(slot);
        let turn = Turn { pass, reversed };
        here = leave(&turn.ends(passes));
        turns.push(turn);
    }
    turns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_sheet_is_finished_before_the_other_below() {
        // Every row falls off the upper sheet at x = 100 and goes on 50 mm below.
        let at = |x: f64, k: usize, z: f64| Point3::new(x, 3.0 * k as f64, z);
        let passes: Vec<Ends> = (0..6)
            .flat_map(|k| {
                [
                    Ends { start: at(0.0, k, 50.0), end: at(100.0, k, 50.0) },
                    Ends { start: at(100.5, k, 0.0), end: at(200.0, k, 0.0) },
                ]
            })
            .collect();
        let turns = order(&passes, LinkStyle::Zigzag);
        let falls = turns.windows(2).filter(|w| w[0].pass % 2 != w[1].pass % 2).count();
        assert_eq!(falls, 1);
    }

    fn rows(count: usize) -> Vec<Ends> {
        let at = |x: f64, k: usize| Point3::new(x, 3.0 * k as f64, 0.0);
        (0..count).map(|k| Ends { start: at(0.0, k), end: at(100.0, k) }).collect()
    }

    #[test]
    fn lace_alternates_and_box_does_not() {
        let zigzag = order(&rows(5), LinkStyle::Zigzag);
        assert_eq!(zigzag.iter().map(|t| t.pass).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
        assert_eq!(zigzag.iter().map(|t| t.reversed).collect::<Vec<_>>(), [false, true, false, true, false]);
        let one_way = order(&rows(5), LinkStyle::OneWay);
        assert_eq!(one_way.iter().map(|t| t.pass).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
        assert!(one_way.iter().all(|t| !t.reversed));
    }
}
