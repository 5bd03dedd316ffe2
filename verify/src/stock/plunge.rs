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
        return below_stock_top(sweep, stock).into_iter().collect();
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
    parts.into_iter().filter_map(|part| below_stock_top(&part, stock)).collect()
}

/// A sweep without what is above all stock, along its axis, on the whole of its way.
fn below_stock_top(sweep: &Sweep, stock: &Aabb) -> Option<Sweep> {
    let half = 0.5 * sweep.axis.abs().dot(&(stock.max - stock.min));
    let above = (stock.centre() - sweep.start).dot(&sweep.axis) + half;
    let rise = sweep.way.dot(&sweep.axis);
    sweep.shape.below(above - rise.min(0.0)).map(|shape| Sweep { shape, ..*sweep })
}
