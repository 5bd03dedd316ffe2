//! Stock left over points of the surface: the largest distance along the normal at which there is
//! still stock, by going down from where stock begins through one piece after the other.

use claymill_nurbs::{Point3, Vector3};

use super::initial::InitialStock;
use super::sweeps::Sweeps;

/// A point of the surface.
#[derive(Debug, Clone, Copy)]
pub struct StockSample {
    /// The point, mm.
    pub point: Point3,
    /// Unit normal towards the tool.
    pub normal: Vector3,
    /// Area that it stands for, mm².
    pub area_mm2: f64,
    /// Stock is looked for no farther along the normal than this, mm: what stands beyond it is not over this place.
    pub ahead_mm: f64,
}

/// What is left over a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Thickness {
    /// The highest stock is so far along the normal, mm; negative where the surface itself was cut away.
    Known(f64),
    /// There is stock as far as was looked.
    Beyond,
    /// There is none as far as was looked, on either side.
    Nothing,
}

/// Stock that is thinner between two pieces is none, mm: their ends are known to that.
const SKIN_MM: f64 = 1e-8;
/// Pieces gone through one after the other. Beyond that what is left is taken to be there, which is too much rather than too
/// little.
const MOST_PIECES: u32 = 100_000;

/// The thickness over `p` along the unit vector `n`, between `−reach_mm` and `reach_mm`.
pub(super) fn thickness(
    p: &Point3,
    n: &Vector3,
    reach_mm: f64,
    sweeps: &Sweeps,
    stock: &InitialStock<'_>,
) -> Thickness {
    let (mut top, mut left_at) = (reach_mm, None);
    for _ in 0..MOST_PIECES {
        let Some(t) = stock.last_inside(p, n, [-reach_mm, top]) else { return Thickness::Nothing };
        let Some(down) = sweeps.cut_down_to(p, n, t, -reach_mm) else {
            // Right below a piece its end is what was looked for.
            let height = left_at.filter(|_| t == top).unwrap_or(t);
            return if t >= reach_mm { Thickness::Beyond } else { Thickness::Known(height) };
        };
        (top, left_at) = (down - SKIN_MM, Some(down));
        if top < -reach_mm {
            return Thickness::Nothing;
        }
    }
    Thickness::Known(top)
}
