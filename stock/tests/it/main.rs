//! The stock against closed forms and brute force.

mod membership;
mod oracle;
mod reading;
mod reference;
mod starting;
mod state;

use claymill_nurbs::{Aabb, Vector3};
use claymill_stock::{Stock, Sweep, ToolBody};
use claymill_toolpath::Tool;

fn tool(text: &str) -> Tool {
    text.parse().unwrap()
}

fn end(text: &str) -> ToolBody {
    ToolBody::end(&tool(text)).unwrap()
}

fn cutting(text: &str) -> ToolBody {
    ToolBody::cutting(&tool(text)).unwrap()
}

fn bounds(min: [f64; 3], max: [f64; 3]) -> Aabb {
    Aabb { min: min.into(), max: max.into() }
}

fn block(min: [f64; 3], max: [f64; 3], pitch_mm: f64) -> Stock {
    Stock::block(&bounds(min, max), pitch_mm).unwrap()
}

/// A sweep with the axis along z.
fn upright(body: &ToolBody, from: [f64; 3], to: [f64; 3]) -> Sweep<'_> {
    Sweep::new(body, Vector3::z(), from.into(), to.into()).unwrap()
}
