//! Stock left over points of the surface: the largest distance along the normal at which there is
//! still stock, by exact roots against the pieces that the normal meets.

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

/// Gaps that are narrower are none, mm: ends of neighbouring pieces that meet are known to that.
const GAP_MM: f64 = 1e-8;

/// The thickness over `p` along the unit vector `n`, between `−reach_mm` and `reach_mm`.
pub(super) fn thickness(
    p: &Point3,
    n: &Vector3,
    reach_mm: f64,
    sweeps: &Sweeps,
    stock: &InitialStock<'_>,
) -> Thickness {
    let mut cut: Vec<[f64; 2]> = Vec::new();
    let limits = [-reach_mm, reach_mm];
    sweeps.along(p, n, limits, |piece| cut.extend(piece.along(p, n, limits)));
    cut.sort_unstable_by(|a, b| b[1].total_cmp(&a[1]).then(a[0].total_cmp(&b[0])));
    let mut top = reach_mm;
    let mut cuts = cut.into_iter().peekable();
    loop {
        // Whatever is cut down from here.
        while let Some([low, _]) = cuts.next_if(|c| c[1] >= top - GAP_MM) {
            top = top.min(low);
        }
        if top <= -reach_mm {
            return Thickness::Nothing;
        }
        let bottom = cuts.peek().map_or(-reach_mm, |c| c[1]);
        if let Some(d) = stock.last_inside(p, n, [bottom, top]) {
            return if d >= reach_mm { Thickness::Beyond } else { Thickness::Known(d) };
        }
        if bottom <= -reach_mm {
            return Thickness::Nothing;
        }
        top = bottom;
    }
}
