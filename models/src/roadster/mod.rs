//! The built-in vehicle: an open two-seat pickup of 37 smooth regions.

mod lines;
mod skin;
mod turned;

use crate::Sample;
use crate::network::Network;
use crate::sheet::Sheet;
use crate::shuffle::shuffled;
use lines::Lines;

/// How to cut and shuffle the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RoadsterOptions {
    /// About how many patches; at least a few hundred.
    pub patches: usize,
    /// Chooses where patches are cut, how they are parametrised and their order in the file.
    pub seed: u64,
}

impl Default for RoadsterOptions {
    fn default() -> Self {
        RoadsterOptions { patches: 2000, seed: 1 }
    }
}

/// Generates the vehicle: about 4.2 m long, x rearwards from the nose, y to the right, z up from the ground.
///
/// It has 37 smooth regions whatever the options: inside a region all patches have common tangent planes,
/// between regions there is a crease of more than 3° everywhere, or empty space (wheels, mirrors).
#[must_use]
pub fn roadster(options: &RoadsterOptions) -> Sample {
    shuffled("roadster", &sheets(), options.patches, options.seed)
}

fn sheets() -> Vec<Sheet> {
    let lines = Lines::new();
    let mut sheets = skin::skin(&lines);
    let mut pair = |right: Sheet, network: &Network| {
        let left = right.mirrored(&right.name.replace("right", "left"), network);
        sheets.extend([right, left]);
    };
    pair(turned::wheel("front wheel right", 850.0, 331.0), &lines.network);
    pair(turned::wheel("rear wheel right", 3400.0, 331.0), &lines.network);
    pair(turned::mirror("mirror right"), &lines.network);
    sheets
}
