//! The built-in vehicle: an open two-seat pickup of 37 smooth regions.

mod lines;
mod skin;
mod turned;

use claymill_nurbs::{NurbsSurface, Vector3};

use crate::Sample;
use crate::network::Network;
use crate::sheet::Sheet;
use crate::shuffle::{shuffled, shuffled_as};
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

/// The panel that [`roadster_edited`] moves.
const EDITED: &str = "front wing right";
/// So many rows of control points along the rim stay, so that curvature there does too.
const KEPT_ROWS: usize = 3;

/// The same vehicle after a change of its designer's: the middle of the right front wing lies `moved_mm` further out, falling
/// off smoothly to nothing before the wing's rim. All other patches are those of [`roadster`], in the same order.
#[must_use]
pub fn roadster_edited(options: &RoadsterOptions, moved_mm: f64) -> Sample {
    let sheets = sheets();
    let mut edited = sheets.clone();
    for sheet in edited.iter_mut().filter(|sheet| sheet.name == EDITED) {
        sheet.surface = moved_inside(&sheet.surface, Vector3::new(0.0, moved_mm, 0.0));
    }
    shuffled_as("roadster", &edited, &sheets, options.patches, options.seed)
}

/// A surface whose control points are moved by up to `by`, those near the rim not at all.
fn moved_inside(surface: &NurbsSurface, by: Vector3) -> NurbsSurface {
    let (across, along) = surface.size();
    // From 0 at the last row that stays to 1 in the middle, level at both.
    let weight = |k: usize, count: usize| {
        let first = KEPT_ROWS as f64 - 1.0;
        let t = ((k as f64 - first) / (count as f64 - 1.0 - 2.0 * first)).clamp(0.0, 1.0);
        (4.0 * t * (1.0 - t)).powi(3)
    };
    let moved =
        |(i, j): (usize, usize)| surface.control_point(i, j) + by * weight(i, across) * weight(j, along);
    let net = (0..across).flat_map(|i| (0..along).map(move |j| (i, j))).map(moved).collect();
    let (knots_u, knots_v) = (surface.knots_u().clone(), surface.knots_v().clone());
    // A net of the same size on the same knots is a surface.
    NurbsSurface::new(knots_u, knots_v, net, None).unwrap_or_else(|_| surface.clone())
}
