use crate::NurbsSurface;
use crate::arc::Arc;
use crate::quadrature::integral;

/// Relative accuracy asked of the quadrature; the error estimate is far on the safe side.
const ACCURACY: f64 = 1e-8;
/// The part of a tolerance that the inner of two nested integrals may use: its error must not look like a
/// feature of the outer integrand.
const INNER: f64 = 0.1;

/// Area that closed chains of arcs in the parameter plane enclose on the surface, by winding number, mm².
/// Level arcs may be left out.
///
/// By Green's theorem it is `∮ F dv` with `F(u, v) = ∫ |Su × Sv| du`. The knots cut the plane into cells.
/// An arc contributes the integral from the left side of its own cell to itself, and, over its range of `v`,
/// all cells left of it in its row. Summed over all arcs these ranges cancel, except inside, where each cell is
/// counted once: so the cost is that of the cells inside and of the arcs, not of their product.
pub(crate) fn enclosed_mm2(surface: &NurbsSurface, arcs: &[Arc]) -> f64 {
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
            Part { row: cell(&vs, middle.y), column: cell(&us, middle.x), arc }
        })
        .collect();
    // Right to left in each row.
    parts.sort_by_key(|p| (p.row, usize::MAX - p.column));
    let element = |u: f64, v: f64| {
        let jet = surface.jet(u, v);
        jet.su.cross(&jet.sv).norm()
    };
    let cells = cells(&parts);
    let total = |tolerance: f64| -> f64 {
        let whole = |c: &Cell| {
            let columns = (us[c.column], us[c.column + 1]);
            let inner = INNER * tolerance / (c.v.1 - c.v.0);
            let strip = &mut |v: f64| integral(columns, inner, &mut |u| element(u, v));
            f64::from(c.times) * integral(c.v, tolerance, strip)
        };
        let border = |p: &Part| {
            let left = us[p.column];
            let inner = INNER * tolerance / (p.arc.end().y - p.arc.start().y).abs();
            integral((0.0, 1.0), tolerance, &mut |t| {
                let (at, slope) = p.arc.jet(t);
                integral((left, at.x), inner, &mut |u| element(u, at.y)) * slope.y
            })
        };
        cells.iter().map(whole).sum::<f64>() + parts.iter().map(border).sum::<f64>()
    };
    // Relative to the whole, as a cell at a pole may hold nothing but rounding errors.
    let rough = total(f64::INFINITY).abs();
    total(rough * ACCURACY / (cells.len() + parts.len()).max(1) as f64)
}

/// The cells left of the arcs, with the ranges of `v` that do not cancel.
fn cells(parts: &[Part]) -> Vec<Cell> {
    let mut cells = Vec::new();
    for row in parts.chunk_by(|a, b| a.row == b.row) {
        let (mut steps, mut rest) = (Vec::new(), row);
        for column in (0..=row[0].column).rev() {
            cells.extend(counted(&steps).map(|(v, times)| Cell { column, v, times }));
            let (now, later) = rest.split_at(rest.iter().take_while(|p| p.column == column).count());
            rest = later;
            steps.extend(now.iter().flat_map(|p| [(p.arc.start().y, 1), (p.arc.end().y, -1)]));
            merge(&mut steps);
            if rest.is_empty() && steps.is_empty() {
                break;
            }
        }
    }
    cells
}

/// A cell over a range of `v`, counted `times` times.
struct Cell {
    column: usize,
    v: (f64, f64),
    times: i32,
}

/// A part of a trim curve inside one cell.
struct Part {
    row: usize,
    column: usize,
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
