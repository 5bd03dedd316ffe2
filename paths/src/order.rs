//! The order in which the passes of a part are cut.

use claymill_toolpath::LinkStyle;

/// A pass as the orderer sees it: where it starts and ends (horizontally, in the setup).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ends {
    pub(crate) start: [f64; 2],
    pub(crate) end: [f64; 2],
}

/// A pass in the order of cutting.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Turn {
    pub(crate) pass: usize,
    /// Cut from end to start.
    pub(crate) reversed: bool,
}

/// Always goes on with the pass that can be reached over the shortest way: with rows in order this gives
/// lace passes cell by cell (`lace`), or one-way passes row by row (`box`). Ties go to the lower number.
pub(crate) fn order(passes: &[Ends], style: LinkStyle) -> Vec<Turn> {
    let mut left: Vec<usize> = (0..passes.len()).collect();
    let mut turns = Vec::with_capacity(passes.len());
    let Some(first) = passes.first() else { return turns };
    let mut here = first.start;
    while !left.is_empty() {
        let mut best = (f64::INFINITY, 0, false);
        for (slot, &pass) in left.iter().enumerate() {
            let ends = &passes[pass];
            let way = |to: [f64; 2]| (to[0] - here[0]).powi(2) + (to[1] - here[1]).powi(2);
            let mut consider = |distance: f64, reversed: bool| {
                if distance < best.0 {
                    best = (distance, slot, reversed);
                }
            };
            match style {
                LinkStyle::Lace => {
                    consider(way(ends.start), false);
                    consider(way(ends.end), true);
                }
                // One-way passes all run forwards; the next row is the one that starts nearest to where
                // this one started.
                LinkStyle::Box => consider(way(ends.start), false),
            }
        }
        let (_, slot, reversed) = best;
        // Keeps the order of what is left, so that ties stay with the lower row.
        let pass = left.remove(slot);
        let ends = &passes[pass];
        here = match (style, reversed) {
            (LinkStyle::Lace, false) => ends.end,
            (LinkStyle::Lace, true) | (LinkStyle::Box, _) => ends.start,
        };
        turns.push(Turn { pass, reversed });
    }
    turns
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(count: usize) -> Vec<Ends> {
        (0..count).map(|k| Ends { start: [0.0, k as f64 * 3.0], end: [100.0, k as f64 * 3.0] }).collect()
    }

    #[test]
    fn lace_alternates_and_box_does_not() {
        let lace = order(&rows(5), LinkStyle::Lace);
        assert_eq!(lace.iter().map(|t| t.pass).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
        assert_eq!(lace.iter().map(|t| t.reversed).collect::<Vec<_>>(), [false, true, false, true, false]);
        let one_way = order(&rows(5), LinkStyle::Box);
        assert_eq!(one_way.iter().map(|t| t.pass).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
        assert!(one_way.iter().all(|t| !t.reversed));
    }
}
