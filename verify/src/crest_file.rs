//! Measured crests as a file of the job folder, so that maps of them need not be measured again.
//!
//! ```text
//!   claymill crests 1\n
//!   SHA-256 of toolpaths.jsonl\n
//!   SHA-256 of the model\n
//!   number of places\n
//!   x y z height, mm, four little-endian f32 a place
//! ```

use std::path::Path;

use claymill_nurbs::Point3;
use claymill_toolpath::{FolderError, Job, Judged, LONGEST_MADE, read_plain, write_whole};

use crate::CrestSample;

/// Name of the file.
pub const CRESTS_FILE: &str = "crests.bin";

/// Bytes of a place.
const PLACE: usize = 16;

/// What the crests were measured on: moves and model.
fn header(judged: &Judged, count: usize) -> String {
    format!("claymill crests 1\n{}\n{}\n{count}\n", judged.toolpaths_sha256, judged.model_sha256)
}

/// Writes what was measured on these moves into a folder.
///
/// # Errors
/// The file cannot be written.
pub fn write_crests(folder: &Path, judged: &Judged, crests: &[CrestSample]) -> Result<(), FolderError> {
    let mut bytes = header(judged, crests.len()).into_bytes();
    bytes.reserve(PLACE * crests.len());
    for c in crests {
        for x in [c.foot.x, c.foot.y, c.foot.z, c.height_mm] {
            bytes.extend((x as f32).to_le_bytes());
        }
    }
    let path = folder.join(CRESTS_FILE);
    write_whole(&path, &bytes).map_err(|source| FolderError::Io { path, source })
}

/// Reads what was measured on the very moves in the folder; `None` where that is not there, or damaged: it can be measured
/// again.
#[must_use]
pub fn read_crests(folder: &Path, job: &Job) -> Option<Vec<CrestSample>> {
    let bytes = read_plain(&folder.join(CRESTS_FILE), LONGEST_MADE).ok()?;
    let end = bytes.iter().enumerate().filter(|(_, b)| **b == b'\n').nth(3)?.0 + 1;
    let (head, places) = bytes.split_at(end);
    let count = places.len() / PLACE;
    if places.len() % PLACE != 0 || head != header(&Judged::of(folder, job).ok()?, count).as_bytes() {
        return None;
    }
    let place = |place: &[u8]| {
        let [x, y, z, height] = [0, 4, 8, 12]
            .map(|k| f64::from(f32::from_le_bytes([place[k], place[k + 1], place[k + 2], place[k + 3]])));
        CrestSample { foot: Point3::new(x, y, z), height_mm: height }
    };
    let crests: Vec<CrestSample> = places.chunks_exact(PLACE).map(place).collect();
    let sound = |c: &CrestSample| c.foot.iter().all(|x| x.is_finite()) && c.height_mm.is_finite();
    crests.iter().all(sound).then_some(crests)
}
