//! The stock of a job: as it is asked for, or as usual for the material.

use claymill_nurbs::Aabb;
use claymill_tooling::Material;
use claymill_toolpath::Stock;

use crate::choice::{StockWish, Wish};
use crate::error::Error;

/// The stock, which has to hold the model.
///
/// # Errors
/// It does not, or no layer is as thick.
pub(super) fn stock(wish: &Wish, material: &Material, bounds: &Aabb) -> Result<Stock, Error> {
    let layer_mm =
        material.layer_mm.map(|[low, _]| low.max(material.armature_mm.map_or(low, |[low, _]| low)));
    let chosen = match (&wish.stock, layer_mm) {
        (Some(StockWish::Layer(mm)), _) => Stock::Layer { thickness_mm: *mm },
        (Some(StockWish::BlockAround(mm)), _) => block_around(bounds, *mm),
        (Some(StockWish::Block(box_mm)), _) => Stock::Block { box_mm: *box_mm },
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
        Stock::Layer { .. } => Ok(chosen),
    }
}

/// A block around a model, larger than it by this much on every side.
fn block_around(bounds: &Aabb, margin_mm: f64) -> Stock {
    let [low, high] = [(bounds.min, -margin_mm), (bounds.max, margin_mm)].map(|(p, mm)| p.map(|c| c + mm));
    Stock::Block { box_mm: [low.x, low.y, low.z, high.x, high.y, high.z] }
}
