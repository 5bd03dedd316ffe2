//! The tolerance that tells neighbours from strangers, read off the gaps themselves.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::edge::Edge;
use crate::matching::Pair;
use crate::tolerance::{LARGEST_TOLERANCE_MM, SMALLEST_GAP_MM, USUAL_TOLERANCE_MM};

/// How near two edges must be to count as neighbours, and why.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tolerance {
    /// The tolerance used, mm.
    pub value_mm: f64,
    /// Where it comes from.
    pub origin: ToleranceOrigin,
    /// Edges farther apart than this were not looked at, mm.
    pub search_radius_mm: f64,
    /// Length of edge pairs by gap, smallest gap first; the first bin holds all smaller gaps too.
    pub histogram: Vec<GapBin>,
}

/// Where a tolerance comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ToleranceOrigin {
    /// Given by the user.
    Given,
    /// The valley between small gaps (neighbours) and large ones (strangers).
    Valley,
    /// All gaps are of one kind: the usual tolerance of the trade.
    Usual,
}

/// A bin of the gap histogram.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GapBin {
    /// Largest gap of this bin, mm.
    pub gap_mm: f64,
    /// Length of edges with such a gap to a parallel one, mm.
    pub length_mm: f64,
}

const BINS_PER_DECADE: f64 = 10.0;

impl Tolerance {
    pub(crate) fn find(
        edges: &[Edge<'_>],
        pairs: &[Pair],
        given_mm: Option<f64>,
        file_mm: f64,
        search_radius_mm: f64,
    ) -> Self {
        let histogram = histogram(edges, pairs, search_radius_mm);
        let (value_mm, origin) = match (given_mm, valley(&histogram)) {
            (Some(given), _) => (given, ToleranceOrigin::Given),
            (None, Some(valley)) => (valley, ToleranceOrigin::Valley),
            (None, None) => (USUAL_TOLERANCE_MM, ToleranceOrigin::Usual),
        };
        let value_mm = match origin {
            ToleranceOrigin::Given => value_mm,
            // A model of exact joints and small gaps has a valley too, below what any trade calls a gap.
            _ => value_mm.clamp(USUAL_TOLERANCE_MM, LARGEST_TOLERANCE_MM).max(2.0 * file_mm),
        };
        Tolerance { value_mm, origin, search_radius_mm, histogram }
    }
}

fn bin(gap_mm: f64) -> usize {
    ((gap_mm / SMALLEST_GAP_MM).log10() * BINS_PER_DECADE).ceil().max(0.0) as usize
}

fn histogram(edges: &[Edge<'_>], pairs: &[Pair], radius_mm: f64) -> Vec<GapBin> {
    let parts: Vec<Vec<(usize, f64)>> = pairs
        .par_iter()
        .map(|pair| {
            let length = |t: f64| edges[pair.a].arc_length(t);
            let ends = pair.points.windows(2);
            ends.filter(|w| w.iter().all(|o| o.along && o.gap_mm <= radius_mm))
                .map(|w| (bin(w[0].gap_mm.max(w[1].gap_mm)), length(w[1].ta) - length(w[0].ta)))
                .collect()
        })
        .collect();
    let edge_of_bin = |i: usize| SMALLEST_GAP_MM * 10f64.powf(i as f64 / BINS_PER_DECADE);
    let mut bins: Vec<GapBin> =
        (0..=bin(radius_mm)).map(|i| GapBin { gap_mm: edge_of_bin(i), length_mm: 0.0 }).collect();
    for (i, length) in parts.into_iter().flatten() {
        let last = bins.len() - 1;
        bins[i.min(last)].length_mm += length;
    }
    bins
}

/// The middle of the empty or thinnest stretch between the two classes of gaps that Otsu's criterion
/// (largest variance between the classes, by length, on the logarithm of the gap) tells apart; `None` when
/// one of the classes is negligible.
fn valley(bins: &[GapBin]) -> Option<f64> {
    const SMALLEST_CLASS: f64 = 0.001;
    let total: f64 = bins.iter().map(|b| b.length_mm).sum();
    let moment: f64 = bins.iter().enumerate().map(|(i, b)| i as f64 * b.length_mm).sum();
    let (mut below, mut moment_below) = (0.0, 0.0);
    let mut best: Option<(f64, usize, usize)> = None;
    for (i, b) in bins.iter().enumerate() {
        below += b.length_mm;
        moment_below += i as f64 * b.length_mm;
        let above = total - below;
        if below.min(above) <= SMALLEST_CLASS * total {
            continue;
        }
        let between = below * above * (moment_below / below - (moment - moment_below) / above).powi(2);
        match &mut best {
            // An empty stretch gives the same value again and again: its whole width is the valley.
            Some((value, _, last)) if (between - *value).abs() <= 1e-9 * *value => *last = i,
            Some((value, ..)) if between <= *value => {}
            _ => best = Some((between, i, i)),
        }
    }
    best.map(|(_, first, last)| (bins[first].gap_mm * bins[last].gap_mm).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bins(lengths: &[(f64, f64)]) -> Vec<GapBin> {
        let mut all: Vec<GapBin> = (0..=bin(0.5))
            .map(|i| GapBin { gap_mm: 1e-4 * 10f64.powf(i as f64 / 10.0), length_mm: 0.0 })
            .collect();
        for (gap, length) in lengths {
            all[bin(*gap)].length_mm += length;
        }
        all
    }

    #[test]
    fn the_valley_lies_between_two_kinds_of_gaps() {
        let found = valley(&bins(&[(0.002, 500.0), (0.004, 300.0), (0.3, 40.0)])).unwrap();
        assert!(found > 0.01 && found < 0.2, "{found}");
        assert!(valley(&bins(&[(1e-9, 100.0)])).is_none());
    }
}
