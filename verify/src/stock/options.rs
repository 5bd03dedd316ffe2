//! What the check of stock is asked for: accuracies, and bounds on its work.

use super::error::{StockError, sized};
use super::proof::Limits;

/// Accuracies of a check of stock, and bounds on its work.
#[derive(Debug, Clone, PartialEq)]
pub struct StockOptions {
    /// Curved moves become chords within this distance, mm. What is cut is taken too small by it, what collides too large.
    pub chord_mm: f64,
    /// Where the axis turns, poses are so close that nothing of tool and holder moves away from the nearest by more than this, mm.
    pub turn_mm: f64,
    /// Stock in the way of a move is found if one body of the tool holds, at one time, a ball of it of this diameter, mm. Less need not
    /// be found.
    pub narrowest_mm: f64,
    /// Boxes of a proof are not divided below this side, mm. With more than 1/√3 of the narrowest stock, boxes at a wall along
    /// which a tool has cut remain undecided.
    pub smallest_box_mm: f64,
    /// Boxes looked at for one move.
    pub most_boxes: u64,
    /// Boxes looked at for a whole report: every move that is to be proven has an equal share, if that is less than the bound for one
    /// move, but 200 at least.
    pub most_boxes_in_all: u64,
    /// Whether a report is to prove links and lead-ins clear of stock, as rapids. It costs most of all where they run along what was
    /// just cut.
    pub links_clear: bool,
    /// Quasi-random points for volumes, in 16 independent sets.
    pub volume_points: u64,
    /// Poses at which the engagement is measured, spread evenly over what is cut.
    pub engagement_poses: u64,
}

impl Default for StockOptions {
    fn default() -> Self {
        StockOptions {
            chord_mm: 3e-4,
            turn_mm: 0.02,
            narrowest_mm: 0.09,
            smallest_box_mm: 0.05,
            most_boxes: 200_000,
            most_boxes_in_all: 50_000_000,
            links_clear: true,
            volume_points: 1 << 20,
            engagement_poses: 2000,
        }
    }
}

impl StockOptions {
    /// Refuses what makes no sense.
    pub(super) fn checked(&self) -> Result<&Self, StockError> {
        sized("chord error, mm,", self.chord_mm, 1e-6, 10.0)?;
        sized("error by turning, mm,", self.turn_mm, 1e-5, 10.0)?;
        sized("narrowest stock, mm,", self.narrowest_mm, 1e-3, 100.0)?;
        sized("smallest box, mm,", self.smallest_box_mm, 1e-3, 100.0)?;
        sized("number of boxes", self.most_boxes as f64, 1.0, 1e9)?;
        sized("number of boxes", self.most_boxes_in_all as f64, 1.0, 1e12)?;
        sized("number of points", self.volume_points as f64, 16.0, 1e9)?;
        sized("number of poses", self.engagement_poses as f64, 0.0, 1e7)?;
        Ok(self)
    }

    pub(super) fn limits(&self, most_boxes: u64) -> Limits {
        Limits { radius_mm: 0.5 * self.narrowest_mm, smallest_mm: self.smallest_box_mm, most_boxes }
    }

    /// Boxes for one of so many proofs.
    pub(super) fn share(&self, proofs: usize) -> u64 {
        (self.most_boxes_in_all / proofs.max(1) as u64).max(200).min(self.most_boxes)
    }
}
