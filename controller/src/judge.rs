//! Validates the records of a stream: layout, number, and that each path begins where the one
//! before it ended. Both ends of a queue use it.

use claymill_nurbs::{Point3, Vector3};

use crate::route::GAP_MM;
use crate::{Path, Record, RecordError};

/// Judges the records of a stream one after the other: each by itself, by its number, and by where the one before it ended.
///
/// Both ends do: a sender's records before they are taken into a queue, and again when they come out of it, for nobody
/// knows who else has written there.
#[derive(Debug, Clone, Default)]
pub(crate) struct Judge {
    /// Number that the next record has; `None` where any may come first.
    next: Option<u64>,
    /// Where the last path ended: tip and tool axis.
    end: Option<(Point3, Vector3)>,
}

impl Judge {
    /// A judge of a stream from record `next` on, where the machine will stand at `end` before it.
    pub(crate) fn from(next: Option<u64>, end: Option<(Point3, Vector3)>) -> Self {
        Judge { next, end }
    }

    /// A judge from record `next` on who knows what this one knows of the place.
    pub(crate) fn at(self, next: u64) -> Self {
        Judge { next: Some(next), ..self }
    }

    /// Reads a record. One that is refused changes nothing.
    pub(crate) fn judge(&mut self, bytes: &[u8]) -> Result<(u64, Record), RecordError> {
        let (seq, record) = Record::decode(bytes)?;
        if let Some(expected) = self.next.filter(|n| *n != seq) {
            return Err(RecordError::Order { expected });
        }
        if let Record::Path(path) = &record {
            let gap_mm = self.gap_mm(path);
            if gap_mm > GAP_MM {
                return Err(RecordError::Gap { gap_mm });
            }
            self.end = Some((path.curve.end(), path.axis_end));
        }
        // What follows an end is another stream, which begins where its own program says.
        (self.next, self.end) = match record {
            Record::End => (Some(0), None),
            _ => (Some(seq.wrapping_add(1)), self.end),
        };
        Ok((seq, record))
    }

    /// How far from the end of the last path another one begins; where the axis is another one, the part is turned between.
    fn gap_mm(&self, path: &Path) -> f64 {
        match &self.end {
            Some((end, axis)) if (axis - path.axis_start).norm() < 1e-6 => (end - path.curve.start()).norm(),
            _ => 0.0,
        }
    }
}
