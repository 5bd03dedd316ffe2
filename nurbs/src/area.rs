//! Area within trim curves by Green's theorem: `∮ F dv` with `F = ∫ |Su × Sv| du`, integrated cell
//! by cell between the knots, with adaptive accuracy.

use nalgebra::Vector4;

use crate::NurbsSurface;
use crate::arc::Arc;
use crate::knots::for_degree;
use crate::quadrature::{Budget, integral, integral_of_integrals};

/// Relative accuracy asked of the quadrature; the error estimate is far on the safe side. Where that takes too long, the next.
const ACCURACIES: [f64; 3] = [FaceArea::USUAL, 1e-6, 1e-4];
/// The part of a tolerance that the inner of two nested integrals may use: its error must not look like a
/// feature of the outer integrand.
const INNER: f64 = 0.1;
/// Arcs whose extent is less than this share of their distance from the left side of their cell count from the leftmost.
const APART: f64 = 0.25;
/// Halvings of all integrals of a face together: what is smooth between its knots takes about ten for each part, a pole some
/// thousands.
const HALVINGS: u64 = 10_000;
const HALVINGS_FOR_EACH_PART: u64 = 30;

/// The area of a trimmed face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaceArea {
    /// The area, mm².
    pub mm2: f64,
    /// Relative accuracy to which it was integrated: 1e-8, or less where the surface is so uneven (folded over, or with one
    /// weight a million times as large as its neighbours) that this took too long; infinite where nothing is known.
    pub accuracy: f64,
}

impl FaceArea {
    /// The accuracy of most areas.
    pub const USUAL: f64 = 1e-8;
}

/// Area that closed chains of arcs in the parameter plane enclose on the surface, by winding number, mm².
/// Level arcs may be left out.
///
/// By Green's theorem it is `∮ F dv` with `F(u, v) = ∫ |Su × Sv| du`. The knots cut the plane into cells.
/// An arc contributes the integral from the left side of its own cell to itself, and, over its range of `v`,
/// all cells left of it in its row. Summed over all arcs these ranges cancel, except inside, where each cell is
/// counted once: so the cost is that of the cells inside and of the arcs, not of their product.
///
/// Where all arcs of a cell are close together and far from its left side, they count from the leftmost of them instead,
/// and what is left of that is one more cell: the difference of large integrals would be no more than their rounding.
pub(crate) fn enclosed(surface: &NurbsSurface, arcs: &[Arc]) -> FaceArea {
    let (us, vs) = (surface.knots_u().breaks(), surface.knots_v().breaks());
    let cell = |breaks: &[f64], x: f64| {
        breaks.partition_point(|&k| k <= x).saturating_sub(1).min(breaks.len().saturating_sub(2))
    };
    let mut parts: Vec<Part> = (arcs.iter().flat_map(Arc::monotone))
        .flat_map(|a| cut(a, 0, &us))
        .flat_map(|a| cut(a, 1, &vs))
        .filter(|a| a.start().y != a.end().y)
        .map(|arc| {
            let middle = nalgebra::center(&arc.start(), &arc.end());
            Part { row: cell(&vs, middle.y), column: cell(&us, middle.x), left: 0.0, arc }
        })
        .collect();
    // Right to left in each row.
    parts.sort_by_key(|p| (p.row, usize::MAX - p.column));
    for cell in parts.chunk_by_mut(|a, b| (a.row, a.column) == (b.row, b.column)) {
        let left = us[cell[0].column];
        let from = leftmost(left, cell).unwrap_or(left);
        cell.iter_mut().for_each(|p| p.left = from);
    }
    let cells = cells(&parts, &us);
    let count = (cells.len() + parts.len()).max(1);
    let halvings = HALVINGS.saturating_add(HALVINGS_FOR_EACH_PART.saturating_mul(count as u64));
    let total = |tolerance: f64, budget: &Budget| -> f64 {
        let whole = |c: &Cell| {
            let inner = INNER * tolerance / (c.v.1 - c.v.0);
            let strip = &mut |v: f64| strip(surface, c.u, v, inner, budget);
            f64::from(c.times) * integral_of_integrals(c.v, tolerance, budget, strip)
        };
        let border = |p: &Part| {
            let inner = INNER * tolerance / (p.arc.end().y - p.arc.start().y).abs();
            integral_of_integrals((0.0, 1.0), tolerance, budget, &mut |t| {
                let (at, slope) = p.arc.jet(t);
                strip(surface, (p.left, at.x), at.y, inner, budget) * slope.y
            })
        };
        cells.iter().map(whole).sum::<f64>() + parts.iter().map(border).sum::<f64>()
    };
    // Relative to the whole, as a cell at a pole may hold nothing but rounding errors.
    let rough = total(f64::INFINITY, &Budget::of(0));
    let integrated = ACCURACIES.into_iter().find_map(|accuracy| {
        let budget = Budget::of(halvings);
        let mm2 = total(rough.abs() * accuracy / count as f64, &budget);
        budget.sufficed().then_some(FaceArea { mm2, accuracy })
    });
    integrated.unwrap_or(FaceArea { mm2: rough, accuracy: f64::INFINITY })
}

/// `∫ |Su × Sv| du` at a fixed `v`, over a range of `u` between two neighbouring knots.
fn strip(surface: &NurbsSurface, u: (f64, f64), v: f64, tolerance: f64, budget: &Budget) -> f64 {
    let degree = surface.knots_u().degree().max(surface.knots_v().degree());
    let strip = Strip { surface, u, v };
    for_degree!(degree, strip.integral_sized(tolerance, budget))
}

struct Strip<'a> {
    surface: &'a NurbsSurface,
    u: (f64, f64),
    v: f64,
}

impl Strip<'_> {
    fn integral_sized<const N: usize>(&self, tolerance: f64, budget: &Budget) -> f64 {
        let Strip { surface, u, v } = *self;
        let (knots, net, columns) = (surface.knots_u(), surface.net(), surface.size().1);
        let span = knots.span(0.5 * (u.0 + u.1));
        let (first, rows) = (span - knots.degree(), knots.degree() + 1);
        // What is constant along the strip: the curve of constant v and its derivative across, homogeneous.
        let across = surface.knots_v().basis_in::<N, 1>(surface.knots_v().span(v), v);
        let (mut on, mut over) = ([Vector4::zeros(); N], [Vector4::zeros(); N]);
        for i in 0..rows {
            let row = &net[(first + i) * columns + across.first..];
            for j in 0..=surface.knots_v().degree() {
                on[i] += row[j] * across.n[0][j];
                over[i] += row[j] * across.n[1][j];
            }
        }
        integral(u, tolerance, budget, &mut |u| {
            let along = knots.basis_in::<N, 1>(span, u);
            let (mut p, mut pu, mut pv) = (Vector4::zeros(), Vector4::zeros(), Vector4::zeros());
            for i in 0..rows {
                p += on[i] * along.n[0][i];
                pu += on[i] * along.n[1][i];
                pv += over[i] * along.n[0][i];
            }
            let (su, sv) = if surface.is_rational() {
                let at = p.xyz() / p.w;
                ((pu.xyz() - at * pu.w) / p.w, (pv.xyz() - at * pv.w) / p.w)
            } else {
                (pu.xyz(), pv.xyz())
            };
            su.cross(&sv).norm()
        })
    }
}

/// Where the arcs of a cell begin, if they are far from its left side for their extent.
fn leftmost(left: f64, parts: &[Part]) -> Option<f64> {
    let ends = || parts.iter().flat_map(|p| [p.arc.start().x, p.arc.end().x]);
    let (low, high) = (ends().fold(f64::INFINITY, f64::min), ends().fold(f64::NEG_INFINITY, f64::max));
    (high - low < APART * (low - left)).then_some(low)
}

/// The cells left of the arcs, with the ranges of `v` that do not cancel.
fn cells(parts: &[Part], us: &[f64]) -> Vec<Cell> {
    let mut cells = Vec::new();
    for row in parts.chunk_by(|a, b| a.row == b.row) {
        let (mut steps, mut rest) = (Vec::new(), row);
        for column in (0..=row[0].column).rev() {
            let whole = (us[column], us[column + 1]);
            cells.extend(counted(&steps).map(|(v, times)| Cell { u: whole, v, times }));
            let (now, later) = rest.split_at(rest.iter().take_while(|p| p.column == column).count());
            rest = later;
            let mut own: Vec<(f64, i32)> =
                now.iter().flat_map(|p| [(p.arc.start().y, 1), (p.arc.end().y, -1)]).collect();
            steps.extend(&own);
            merge(&mut steps);
            if let Some(part) = now.first().filter(|p| p.left > whole.0) {
                merge(&mut own);
                cells.extend(counted(&own).map(|(v, times)| Cell { u: (whole.0, part.left), v, times }));
            }
            if rest.is_empty() && steps.is_empty() {
                break;
            }
        }
    }
    cells
}

/// A cell, or the left part of one, over a range of `v`, counted `times` times.
struct Cell {
    u: (f64, f64),
    v: (f64, f64),
    times: i32,
}

/// A part of a trim curve inside one cell.
struct Part {
    row: usize,
    column: usize,
    /// Where its integrals over `u` begin.
    left: f64,
    arc: Arc,
}

/// The parts of a monotone arc between the sorted `knots`.
fn cut(arc: Arc, axis: usize, knots: &[f64]) -> Vec<Arc> {
    let (a, b) = (arc.start()[axis], arc.end()[axis]);
    let first = knots.partition_point(|&k| k <= a.min(b));
    let end = knots.partition_point(|&k| k < a.max(b)).max(first);
    let (mut parts, mut rest) = (Vec::with_capacity(end - first + 1), arc);
    for step in 0..end - first {
        let knot = knots[if a < b { first + step } else { end - 1 - step }];
        if let Some(t) = rest.crossing(axis, knot) {
            let (before, after) = rest.split(t);
            parts.push(before);
            rest = after;
        }
    }
    parts.push(rest);
    parts
}

/// Sorts the steps of a piecewise constant function and joins those at one place.
fn merge(steps: &mut Vec<(f64, i32)>) {
    steps.sort_by(|a, b| a.0.total_cmp(&b.0));
    steps.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1 += next.1;
        }
        same
    });
    steps.retain(|s| s.1 != 0);
}

/// The ranges where the function is not zero, and its value there.
fn counted(steps: &[(f64, i32)]) -> impl Iterator<Item = ((f64, f64), i32)> + '_ {
    let mut times = 0;
    steps.windows(2).filter_map(move |w| {
        times += w[0].1;
        (times != 0).then_some(((w[0].0, w[1].0), times))
    })
}
