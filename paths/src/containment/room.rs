//! Where passes keep the shank out of stock.

use claymill_nurbs::{Point3, Vector3};
use claymill_stock::{Stock, Sweep, ToolBody};

use crate::Frame;

/// Where what of the tool is above its flutes stands clear of the stock that is there when a setup is done.
pub(crate) struct ShankRoom {
    stock: Stock,
    above: ToolBody,
    frame: Frame,
    /// The tip is this far below the ball's centre, mm.
    tip_mm: f64,
}

impl ShankRoom {
    /// For a body, larger by the distance that it keeps, whose tip is `tip_mm` below the centre for which is asked.
    pub(crate) fn new(stock: Stock, above: ToolBody, frame: Frame, tip_mm: f64) -> Self {
        ShankRoom { stock, above, frame, tip_mm }
    }

    /// Whether it stands clear with the ball's centre in a place, in the setup's coordinates.
    pub(crate) fn holds(&self, centre: &Point3) -> bool {
        let tip = self.frame.to_model(&(centre - Vector3::z() * self.tip_mm));
        let stands = Sweep::new(&self.above, self.frame.axis(), tip, tip);
        stands.is_ok_and(|stands| self.stock.is_clear(&stands, 0.0).unwrap_or(false))
    }
}
