//! Samples trim curves so that edges between samples keep to the curve and to the surface within
//! given deviations.

use crate::arc::Arc;
use crate::curvedness::Curvedness;
use crate::{NurbsSurface, Point2, Point3};

/// A point on a trim curve.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    pub(crate) uv: Point2,
    pub(crate) point: Point3,
    /// Distance between the trim curve and the straight edge from here to the next sample, mm.
    pub(crate) sagitta_mm: f64,
}

/// How coarse a sampling may be.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    /// Distance between the trim curve and the edge between two samples.
    pub(crate) sagitta_mm: f64,
    /// Distance between the surface over the straight parameter segment and the edge.
    pub(crate) facet_mm: f64,
    /// Length of an edge.
    pub(crate) edge_mm: f64,
}

/// Halvings of one arc at most; 2^16 edges are more than any tolerance asks of a sound curve.
const DEEPEST: u32 = 16;
/// Samples on the loops of one face, at most: ten kilometres of edges of 25 mm.
pub(crate) const MOST_SAMPLES: usize = 400_000;

/// Samples an arc so densely that the edges between samples keep to the curve and to the surface. The end
/// belongs to the next arc and is left out. Where that takes more than there is `room` for, edges stay as coarse as they
/// are, and say so.
pub(crate) fn sample(
    surface: &NurbsSurface,
    curved: &Curvedness,
    arc: &Arc,
    limits: &Limits,
    room: usize,
) -> Vec<Sample> {
    let lift = |t: f64| {
        // The ends are those of the arc to the last bit, so that neighbours share them.
        let uv = match t {
            0.0 => arc.start(),
            1.0 => arc.end(),
            t => arc.point(t),
        };
        let (u, v) = surface.clamp(uv.x, uv.y);
        (Point2::new(u, v), surface.point(u, v))
    };
    let mut samples = Vec::new();
    let mut open = vec![(0.0, lift(0.0), 1.0, lift(1.0), 0)];
    while let Some((t0, a, t1, b, depth)) = open.pop() {
        let chord_distance = |p: Point3| {
            let (along, from) = (b.1 - a.1, p - a.1);
            let share = from.dot(&along) / along.norm_squared();
            let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
            (from - along * share).norm()
        };
        let inner = [0.25, 0.5, 0.75].map(|s| t0 + (t1 - t0) * s);
        // Three samples of a smooth bow see at least nine tenths of its height; the fifth is for bows that
        // are not.
        let sagitta_mm = 1.2 * inner.map(|t| chord_distance(lift(t).1)).into_iter().fold(0.0, f64::max);
        let (low, high) = (a.0.inf(&b.0), a.0.sup(&b.0));
        let facet_mm = curved.over(low, high).deviation_mm(high.x - low.x, high.y - low.y);
        let coarse = sagitta_mm > limits.sagitta_mm
            || facet_mm > limits.facet_mm
            || (b.1 - a.1).norm() > limits.edge_mm;
        if coarse && depth < DEEPEST && samples.len() + open.len() < room {
            let t = inner[1];
            let middle = lift(t);
            open.push((t, middle, t1, b, depth + 1));
            open.push((t0, a, t, middle, depth + 1));
        } else {
            samples.push(Sample { uv: a.0, point: a.1, sagitta_mm });
        }
    }
    samples
}
