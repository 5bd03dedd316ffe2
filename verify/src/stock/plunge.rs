//! A body that moves along its own axis as a few that stand still: that is simpler to hold against
//! what was cut before.
//!
//! Moved up by `h`, a body that grows wider upwards is its lower place and a cylinder on top of it; one that grows thinner
//! its upper place and a cylinder below; and a swollen disc both of its places and a cylinder between their middles.

use claymill_nurbs::{Aabb, Vector3};

use super::body::Shape;
use super::piece::Sweep;

/// Ways that leave the axis by less are along it, mm.
const ASIDE_MM: f64 = 1e-9;

/// Bodies at rest that together are the sweep, where its way is along its axis; the sweep itself where it is not. What is above
/// the stock is left out.
pub(super) fn at_rest(sweep: &Sweep, stock: &Aabb) -> Vec<Sweep> {
    let rise = sweep.way.dot(&sweep.axis);
    if (sweep.way - sweep.axis * rise).norm() > ASIDE_MM {
        return vec![*sweep];
    }
    let lower = sweep.start + sweep.axis * rise.min(0.0);
    let upper = lower + sweep.axis * rise.abs();
    let rest = |start, shape| Sweep { start, way: Vector3::zeros(), axis: sweep.axis, shape };
    let h = rise.abs();
    let mut parts = Vec::with_capacity(3);
    match sweep.shape {
        Shape::Frustum { low, high, radius, slope, .. } => {
            let top = radius + slope * (high - low);
            if slope == 0.0 {
                parts.push(rest(lower, Shape::frustum([low, radius], [high + h, radius])));
            } else if slope > 0.0 {
                parts.push(rest(lower, sweep.shape));
                parts.push(rest(lower, Shape::frustum([high, top], [high + h, top])));
            } else {
                parts.push(rest(lower, Shape::frustum([low, radius], [low + h, radius])));
                parts.push(rest(upper, sweep.shape));
            }
        }
        Shape::End { disc, corner, centre, .. } => {
            let radius = disc + corner;
            parts.push(rest(lower, sweep.shape));
            if h > 0.0 {
                parts.push(rest(lower, Shape::frustum([centre, radius], [centre + h, radius])));
                parts.push(rest(upper, sweep.shape));
            }
        }
    }
    // The height of the stock above the tip, along the axis.
    let half = 0.5 * sweep.axis.abs().dot(&(stock.max - stock.min));
    parts
        .into_iter()
        .filter_map(|part| {
            let above = (stock.centre() - part.start).dot(&part.axis) + half;
            part.shape.below(above).map(|shape| Sweep { shape, ..part })
        })
        .collect()
}
