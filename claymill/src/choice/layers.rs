//! Layers of roughing: offsets of the surface, from what there is down to the allowance.
//!
//! ```text
//!   stock ─────────────  thickest_mm        a layer leaves e₁, the next one e₂, the last one the allowance e;
//!          ──── e₁                          each takes no more than `depth_mm`
//!          ──── e₂
//!          ──── e
//!   ━━━━━━ surface
//! ```

use claymill_nurbs::{ClosedMesh, ClosestPoints, Model, Point3};
use claymill_toolpath::Stock;
use rayon::prelude::*;

use crate::stock_file::ReadStock;

/// A side of a block is looked at in so many places along each edge.
const ALONG: usize = 12;
/// Places on a body that are looked at, at most.
const MOST_PLACES: usize = 20_000;
/// No more layers than this.
const MOST_LAYERS: usize = 40;

/// What each layer leaves, from the first to the last.
pub(crate) fn allowances_mm(thickest_mm: f64, allowance_mm: f64, depth_mm: f64) -> Vec<f64> {
    let whole_mm = thickest_mm - allowance_mm;
    if !(whole_mm > 0.0 && depth_mm > 0.0) {
        return Vec::new();
    }
    let count = ((whole_mm / depth_mm).ceil() as usize).clamp(1, MOST_LAYERS);
    // A tenth of a millimetre is a figure that people read.
    let rounded = |mm: f64| (10.0 * mm).round() / 10.0;
    let layer = |k: usize| allowance_mm + whole_mm * (count - k) as f64 / count as f64;
    (1..=count).map(|k| if k == count { allowance_mm } else { rounded(layer(k)) }).collect()
}

/// How far the stock's outside lies from the surface at most, mm.
pub(crate) fn thickest_mm(read: &ReadStock, model: &Model) -> f64 {
    let stock = &read.record;
    if let Some(solid) = &read.solid {
        return thickest_of(solid, model);
    }
    let box_mm = match (stock, stock.box_mm()) {
        (Stock::Layer { thickness_mm }, _) => return *thickness_mm,
        (_, box_mm) => box_mm.unwrap_or_default(),
    };
    let bar = match *stock {
        Stock::Bar { from_mm, diameter_mm, .. } => stock.bar_axis().map(|k| (k, from_mm, 0.5 * diameter_mm)),
        _ => None,
    };
    // On the box around a bar towards its axis.
    let onto_bar = |mut p: Point3| {
        if let Some((k, middle, radius_mm)) = bar {
            let across = [(k + 1) % 3, (k + 2) % 3];
            let out_mm = across.iter().map(|&a| p[a] - middle[a]).fold(0.0, f64::hypot);
            across
                .into_iter()
                .for_each(|a| p[a] = middle[a] + (p[a] - middle[a]) * (radius_mm / out_mm).min(1.0));
        }
        p
    };
    let [low, high] = [[0, 1, 2], [3, 4, 5]].map(|side| Point3::from(side.map(|k| box_mm[k])));
    let closest = ClosestPoints::new(model);
    let farthest = (high - low).norm();
    let share = |i: usize| i as f64 / ALONG as f64;
    let places = (0..=ALONG).flat_map(|i| (0..=ALONG).map(move |j| (i, j)));
    let of_side = |k: usize| {
        let [a, b] = [(k + 1) % 3, (k + 2) % 3];
        places.clone().flat_map(move |(i, j)| {
            [low[k], high[k]].map(|c| {
                let mut p = low;
                (p[k], p[a], p[b]) =
                    (c, low[a] + (high[a] - low[a]) * share(i), low[b] + (high[b] - low[b]) * share(j));
                p
            })
        })
    };
    let all: Vec<Point3> = (0..3).flat_map(of_side).collect();
    all.into_par_iter()
        .filter_map(|p| closest.closest(&onto_bar(p), farthest))
        .map(|foot| foot.distance_mm)
        .reduce(|| 0.0, f64::max)
}

/// The same of a body: at corners and in the middles of triangles.
fn thickest_of(solid: &ClosedMesh, model: &Model) -> f64 {
    let middle = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| solid.points[i as usize].coords);
        Point3::from((a + b + c) / 3.0)
    };
    let all: Vec<Point3> = solid.points.iter().copied().chain(solid.triangles.iter().map(middle)).collect();
    let every = all.len().div_ceil(MOST_PLACES).max(1);
    let closest = ClosestPoints::new(model);
    let asked: Vec<&Point3> = all.iter().step_by(every).collect();
    asked
        .into_par_iter()
        .filter_map(|p| closest.closest(p, f64::INFINITY))
        .map(|foot| foot.distance_mm)
        .reduce(|| 0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_take_no_more_than_their_depth_and_end_at_the_allowance() {
        for (thickest, allowance, depth) in [(25.0, 3.0, 15.0), (25.0, 3.0, 22.0), (300.0, 2.0, 20.0)] {
            let all = allowances_mm(thickest, allowance, depth);
            assert_eq!(all.last(), Some(&allowance));
            let mut above = thickest;
            for left in &all {
                assert!(above - left <= depth + 0.11 && above > *left, "{all:?}");
                above = *left;
            }
        }
        assert_eq!(allowances_mm(25.0, 3.0, 15.0), [14.0, 3.0]);
        assert!(allowances_mm(2.0, 3.0, 15.0).is_empty());
        assert!(allowances_mm(f64::NAN, 3.0, 15.0).is_empty());
    }
}
