//! The stock of a job: as it is asked for, or as usual for the material.

use claymill_nurbs::{Aabb, Point3};
use claymill_tooling::Material;
use claymill_toolpath::Stock;

use crate::choice::{StockWish, Wish};
use crate::error::Error;

/// Whether a bar holds the model is asked of points within this of its faces, mm.
pub(super) const BAR_DEVIATION_MM: f64 = 0.01;

/// The stock, which has to hold the model, of which box and points on its faces are given.
///
/// # Errors
/// It does not, or no layer is as thick.
pub(super) fn stock(
    wish: &Wish,
    material: &Material,
    (bounds, points): (&Aabb, &[Point3]),
) -> Result<Stock, Error> {
    let layer_mm =
        material.layer_mm.map(|[low, _]| low.max(material.armature_mm.map_or(low, |[low, _]| low)));
    let chosen = match (&wish.stock, layer_mm) {
        (Some(StockWish::Layer(mm)), _) => Stock::Layer { thickness_mm: *mm },
        (Some(StockWish::BlockAround(mm)), _) => block_around(bounds, *mm),
        (Some(StockWish::Block(box_mm)), _) => Stock::Block { box_mm: *box_mm },
        (Some(StockWish::Round(diameter_mm, axis)), _) => bar_around(bounds, *diameter_mm, *axis),
        (Some(StockWish::File(file)), _) => Stock::File(file.clone()),
        (None, Some(mm)) => Stock::Layer { thickness_mm: mm },
        (None, None) => block_around(bounds, 0.0),
    };
    let wrong = |what: String, advice: &str| Err(Error::Choice { what, advice: advice.to_owned() });
    match &chosen {
        Stock::Layer { thickness_mm } if !(*thickness_mm > 0.0 && *thickness_mm <= 1e3) => wrong(
            format!("a layer of {thickness_mm} mm"),
            "A layer is from 0 to 1000 mm thick: --stock layer:25.",
        ),
        Stock::Block { box_mm } => {
            let slack_mm = 1e-6;
            let holds = (0..3)
                .all(|k| box_mm[k] <= bounds.min[k] + slack_mm && box_mm[k + 3] >= bounds.max[k] - slack_mm);
            let model = bounds.corners();
            if holds {
                return Ok(chosen);
            }
            wrong(
                format!("the block {box_mm:?} does not hold the model, whose box is {model:?}"),
                "Take a larger block, or let it follow the model: --stock block:5.",
            )
        }
        Stock::Bar { from_mm, diameter_mm, .. } => {
            let along = chosen.bar_axis().unwrap_or(0);
            let across = [(along + 1) % 3, (along + 2) % 3];
            let out_mm = |p: &Point3| across.iter().map(|&k| p[k] - from_mm[k]).fold(0.0, f64::hypot);
            let needed_mm = 2.0 * points.iter().map(out_mm).fold(0.0, f64::max);
            if needed_mm <= *diameter_mm {
                return Ok(chosen);
            }
            wrong(
                format!("a bar of {diameter_mm} mm does not hold the model, which needs {needed_mm:.3} mm"),
                "Take a thicker bar, or one along another axis: --stock round:60:x.",
            )
        }
        // Where it does not hold the model is told when it has been read.
        Stock::Layer { .. } | Stock::File(_) => Ok(chosen),
    }
}

/// A block around a model, larger than it by this much on every side.
fn block_around(bounds: &Aabb, margin_mm: f64) -> Stock {
    let [low, high] = [(bounds.min, -margin_mm), (bounds.max, margin_mm)].map(|(p, mm)| p.map(|c| c + mm));
    Stock::Block { box_mm: [low.x, low.y, low.z, high.x, high.y, high.z] }
}

/// A bar about the middle of a model's box, as long as that is.
fn bar_around(bounds: &Aabb, diameter_mm: f64, axis: Option<usize>) -> Stock {
    let size = bounds.max - bounds.min;
    let along = axis.unwrap_or_else(|| size.imax());
    let middle = nalgebra::center(&bounds.min, &bounds.max);
    let end = |at_mm: f64| std::array::from_fn(|k| if k == along { at_mm } else { middle[k] });
    Stock::Bar { from_mm: end(bounds.min[along]), to_mm: end(bounds.max[along]), diameter_mm }
}
