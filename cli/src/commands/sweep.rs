//! `claymill merge --sweep`: merge trees over the limits on angle and curvature, as `sweep.json`,
//! `sweep.svg` and text.

use claymill_surface_merge::{Merge, MergeOptions, MergeTree, Step, SweptLimit, sweep};
use claymill_toolpath::FolderWriter;
use serde::Serialize;

use super::sweep_plot;
use crate::console::outln;
use crate::failure::Failure;

/// Limits on the angle at which regions are counted, degrees.
const ANGLES_DEG: [f64; 12] = [0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0];
/// Limits on `R·|Δκ|` at which regions are counted.
const CURVATURES: [f64; 11] = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0];

/// A merge tree with what can be read off it, as `sweep.json` has it.
#[derive(Debug, Serialize)]
pub(super) struct Tree {
    #[serde(flatten)]
    pub(super) tree: MergeTree,
    /// Number of regions of the tree, one step for each limit at which it changes.
    pub(super) curve: Vec<Step>,
}

/// The merge trees over angle and curvature.
pub(super) fn trees(merged: &Merge, options: &MergeOptions) -> Vec<Tree> {
    let swept = [(SweptLimit::Angle, &ANGLES_DEG[..]), (SweptLimit::CurvatureMachining, &CURVATURES[..])];
    swept
        .into_iter()
        .map(|(limit, at)| {
            let tree = sweep(merged, options, limit, at);
            Tree { curve: tree.curve(), tree }
        })
        .collect()
}

/// Writes `sweep.json` and `sweep.svg`.
pub(super) fn save(folder: &FolderWriter, trees: &[Tree]) -> Result<(), Failure> {
    folder.json("sweep.json", &trees)?;
    Ok(folder.text("sweep.svg", &sweep_plot::svg(trees))?)
}

/// Prints how many regions there are at each limit.
pub(super) fn print(tree: &Tree) {
    let (what, unit) = match tree.tree.limit {
        SweptLimit::Angle => ("angle", "°"),
        SweptLimit::CurvatureMachining => ("R·|Δκ|", ""),
        SweptLimit::CurvatureRelative => ("relative curvature difference", ""),
    };
    let at = |s: &Step| format!("{} at {}{unit}", s.regions, s.at);
    let counts: Vec<String> = tree.tree.grown.iter().map(at).collect();
    outln!("regions by {what}: {}", counts.join(", "));
}
