//! Where sheets are cut into patches: rows with cuts of their own, so that many joints are
//! T-junctions. The patch size is found by bisection on the number of patches.

use std::collections::BTreeMap;

use claymill_nurbs::{KnotVector, NurbsSurface};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::network::{CurveId, Edge};
use crate::sheet::Sheet;

/// Cuts of neighbouring rows or sheets that would leave a shorter joint than this are made one cut, mm.
const SLIVER_MM: f64 = 8.0;
/// Chance that a row keeps the cuts of the row before, so that four patches meet in a point.
const ALIGNED: f64 = 0.6;
/// Samples along a parameter line to measure its length.
const LENGTH_SAMPLES: usize = 12;

/// One strip of patches across a sheet.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Row {
    /// Where it lies in `v`.
    pub(crate) v: (f64, f64),
    /// Where it is cut in `u`, both ends included.
    pub(crate) cuts: Vec<f64>,
}

/// The rows of each sheet.
pub(crate) type Layout = Vec<Vec<Row>>;

/// Number of patches.
pub(crate) fn patch_count(layout: &Layout) -> usize {
    layout.iter().flatten().map(|row| row.cuts.len() - 1).sum()
}

/// Plans how to cut the sheets into about `patches` patches of similar size. Rows are cut at their own
/// places, as surfaces of real vehicles are, so that many joints are T-junctions.
pub(crate) fn lay_out(sheets: &[Sheet], patches: usize, seed: u64) -> Layout {
    // Finer patches make more of them: halve the interval of the logarithm of their size.
    let (mut low, mut high) = (0.5f64.ln(), 1e4f64.ln());
    let mut best = lay_out_at(sheets, high.exp(), seed);
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        let candidate = lay_out_at(sheets, middle.exp(), seed);
        let off = |l: &Layout| patch_count(l).abs_diff(patches);
        if off(&candidate) < off(&best) {
            best = candidate.clone();
        }
        if patch_count(&candidate) > patches {
            low = middle;
        } else {
            high = middle;
        }
        if off(&best) * 200 <= patches {
            break;
        }
    }
    best
}

fn lay_out_at(sheets: &[Sheet], size_mm: f64, seed: u64) -> Layout {
    let mut taken = Taken::around(sheets);
    (sheets.iter().enumerate())
        .map(|(index, sheet)| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            // Both sides of the vehicle are cut alike, so that what spans them can suit both.
            rng.set_stream(1 + index as u64 - u64::from(sheet.is_mirror_image));
            rows(sheet, size_mm, &mut taken, &mut rng)
        })
        .collect()
}

fn rows(sheet: &Sheet, size_mm: f64, taken: &mut Taken, rng: &mut ChaCha8Rng) -> Vec<Row> {
    let surface = &sheet.surface;
    let [bottom, top, left, right] = sheet.edges;
    let fixed_u = smooth_breaks(surface.knots_u());
    let transposed = surface.transposed();
    let mut lines = vec![0.0];
    for band in smooth_breaks(surface.knots_v()).windows(2) {
        let mean =
            [0.15, 0.5, 0.85].map(|u| length(&transposed, (band[0], band[1]), u)).iter().sum::<f64>() / 3.0;
        let count = pieces(mean, size_mm, 1);
        for k in 1..count {
            let v = band[0] + (band[1] - band[0]) * k as f64 / count as f64;
            let share_mm = (band[1] - band[0]) / mean.max(1.0);
            lines.push(taken.settle(&[left, right], v, SLIVER_MM * share_mm));
        }
        lines.push(band[1]);
    }
    for edge in [left, right].into_iter().flatten() {
        taken.add(edge, &lines);
    }
    let mut rows: Vec<Row> = Vec::with_capacity(lines.len());
    for (index, v) in lines.windows(2).enumerate() {
        let middle = 0.5 * (v[0] + v[1]);
        let wall = [(0, bottom), (lines.len() - 2, top)].map(|(at, edge)| edge.filter(|_| index == at));
        let mut cuts = vec![0.0];
        for band in fixed_u.windows(2) {
            let band = (band[0], band[1]);
            let width = length(surface, band, middle);
            let before = rows.last().map_or(&[][..], |row| &row.cuts);
            let least = if sheet.closed { 3 } else { 1 };
            cuts.extend(cuts_of_band(band, width, pieces(width, size_mm, least), before, taken, &wall, rng));
            cuts.push(band.1);
        }
        for edge in wall.into_iter().flatten() {
            taken.add(edge, &cuts);
        }
        rows.push(Row { v: (v[0], v[1]), cuts });
    }
    rows
}

/// The cuts strictly inside one band of a row.
fn cuts_of_band(
    band: (f64, f64),
    width_mm: f64,
    count: usize,
    before: &[f64],
    taken: &Taken,
    wall: &[Option<Edge>],
    rng: &mut ChaCha8Rng,
) -> Vec<f64> {
    let aligned: Vec<f64> = before.iter().copied().filter(|&u| band.0 < u && u < band.1).collect();
    // Draw in any case, so that one row's choice does not change the next row's dice.
    let (keep, extra, shift) =
        (rng.random_bool(ALIGNED), rng.random_range(0..3), rng.random_range(-0.2..0.2));
    if keep && !before.is_empty() && (aligned.len() + 1).abs_diff(count) <= count / 4 {
        return aligned;
    }
    let count = if count >= 3 { count + extra - 1 } else { count };
    let spacing = (band.1 - band.0) / count as f64;
    let sliver = (SLIVER_MM * (band.1 - band.0) / width_mm.max(1.0)).min(0.2 * spacing);
    (1..count)
        .map(|k| {
            let u = band.0 + spacing * (k as f64 + shift);
            let near = before.iter().copied().find(|b| (b - u).abs() < sliver);
            near.unwrap_or_else(|| taken.settle(wall, u, sliver))
        })
        .collect()
}

/// In how many pieces of about `size_mm` a length is cut.
fn pieces(length_mm: f64, size_mm: f64, least: usize) -> usize {
    // At most a thousand: the search for the size starts far too fine.
    ((length_mm / size_mm).round() as usize).clamp(least, 1000)
}

/// The ends of the domain and the knots at which the surface is only once differentiable.
fn smooth_breaks(knots: &KnotVector) -> Vec<f64> {
    let mut breaks = knots.breaks();
    breaks.retain(|&k| knots.multiplicity(k) > 1);
    breaks
}

/// Length of the line `v = const` over a range of `u`, from chords, mm.
fn length(surface: &NurbsSurface, (u0, u1): (f64, f64), v: f64) -> f64 {
    let at = |i: usize| surface.point(u0 + (u1 - u0) * i as f64 / LENGTH_SAMPLES as f64, v);
    (0..LENGTH_SAMPLES).map(|i| (at(i + 1) - at(i)).norm()).sum()
}

/// Where feature curves are cut already, by curve.
struct Taken(BTreeMap<CurveId, Vec<f64>>);

impl Taken {
    /// The corners of all sheets.
    fn around(sheets: &[Sheet]) -> Taken {
        let mut taken = Taken(BTreeMap::new());
        for edge in sheets.iter().flat_map(|s| s.edges).flatten() {
            taken.add(edge, &[0.0, 1.0]);
        }
        taken
    }

    fn add(&mut self, edge: Edge, shares: &[f64]) {
        let cuts = self.0.entry(edge.curve).or_default();
        cuts.extend(shares.iter().map(|&s| edge.parameter(s)));
    }

    /// The share nearest to `share` at which one of the edges is cut already, if that is nearer than
    /// `sliver`; else `share`.
    fn settle(&self, edges: &[Option<Edge>], share: f64, sliver: f64) -> f64 {
        let cuts = |edge: &Edge| self.0.get(&edge.curve).cloned().unwrap_or_default();
        (edges.iter().flatten())
            .flat_map(|edge| cuts(edge).into_iter().map(|t| edge.share(t)))
            .filter(|s| (s - share).abs() < sliver && (1e-6..=1.0 - 1e-6).contains(s))
            .min_by(|a, b| (a - share).abs().total_cmp(&(b - share).abs()))
            .unwrap_or(share)
    }
}
