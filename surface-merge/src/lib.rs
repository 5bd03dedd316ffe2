//! From thousands of patches to a few regions, with a reason for every border.
//!
//! ```text
//!   faces ─► edges ─► pairs of edges side by side ─► tolerance ─► joints (also partial ones: T-junctions)
//!                                                                   │
//!   regions ◄─ growing ◄─ verdict by preset ◄─ gap, angle and curvature along each whole joint
//! ```
//!
//! Adjacency is found by geometry alone, so that files without topology (plain IGES surfaces), gaps and
//! T-junctions need no special treatment. Continuity is judged along the whole of each joint, not at its
//! mid-point. A region may wrap around the vehicle; what one tool direction can reach of it is decided
//! later. Merging decides where strokes run, never whether they gouge.
//!
//! ```
//! use claymill_nurbs::{Face, KnotVector, Model, NurbsSurface, Point3, Source, SurfaceKind};
//! use claymill_surface_merge::{MergeOptions, merge};
//!
//! let square = |x: f64| {
//!     let corners = [(x, 0.0), (x, 10.0), (x + 10.0, 0.0), (x + 10.0, 10.0)];
//!     let k = || KnotVector::clamped_uniform(1, 2);
//!     let points = corners.iter().map(|&(x, y)| Point3::new(x, y, 0.0)).collect();
//!     Face {
//!         surface: NurbsSurface::new(k(), k(), points, None).unwrap(),
//!         loops: Vec::new(),
//!         reversed: false,
//!         kind: SurfaceKind::Nurbs,
//!         source: Source::default(),
//!     }
//! };
//! let model = Model { faces: vec![square(0.0), square(10.0), square(50.0)], ..Model::default() };
//! let merged = merge(&model, &MergeOptions::default())?;
//! assert_eq!(merged.regions.len(), 2);
//! assert_eq!(merged.regions[0].faces, [0, 1]);
//! assert!((merged.account.naked_mm - 100.0).abs() < 1e-9);
//! # Ok::<(), claymill_surface_merge::MergeError>(())
//! ```

// What is to be said is returned: only the command prints.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod absorption;
mod account;
mod chord_tree;
mod constraints;
mod continuity;
pub mod defects;
mod disjoint_sets;
mod duplicates;
mod edge;
mod gaps;
mod growing;
mod joint;
mod laps;
mod lone;
mod matching;
mod options;
mod quality;
mod quotient;
mod region;
mod region_mesh;
mod sheets;
mod sweep;
mod tolerance;
mod verdict;
mod wide_gaps;

use std::sync::OnceLock;

use claymill_nurbs::{FaceId, Model};
use rayon::prelude::*;
use thiserror::Error;
use tracing::info_span;

use absorption::Surroundings;
use growing::Grown;

pub use absorption::{Absorption, SmallRegion};
pub use account::{BoundaryAccount, NakedStretch};
pub use constraints::Constraints;
pub use duplicates::Duplicate;
pub use gaps::{GapBin, Tolerance, ToleranceOrigin};
pub use joint::{Continuity, EdgeStretch, Failing, Joint, JointSample, Measure, Spread};
pub use laps::Lap;
pub use options::{CurvatureLimit, Judged, Limits, MergeOptions, Preset};
pub use quality::{RegionQuality, quality};
pub use region::Region;
pub use region_mesh::{
    BoundaryLoop, DriveSurface, Field, FieldError, GuideKind, Guides, IsoPoint, NoDriveSurface, Polyline,
    RegionMesh, SurfacePoint,
};
pub use sheets::{Evidence, Sheet, SheetOptions, sheets};
pub use sweep::{Join, MergeTree, Step, SweptLimit, sweep};
pub use verdict::Verdict;
pub use wide_gaps::WideGap;

/// The regions of a model, and why they are what they are.
#[derive(Debug, Clone, PartialEq)]
pub struct Merge {
    /// Every joint, by faces and place on their boundaries.
    pub joints: Vec<Joint>,
    /// The regions, largest first. Every face belongs to one.
    pub regions: Vec<Region>,
    /// The region of each face.
    pub region_of_face: Vec<usize>,
    /// Where the boundary length goes.
    pub account: BoundaryAccount,
    /// Stretches without a neighbour, longer than the tolerance.
    pub naked: Vec<NakedStretch>,
    /// Stretches that lie on the inside of another face, longer than the tolerance.
    pub laps: Vec<Lap>,
    /// Where a stretch without a neighbour has one after all, but farther away than the tolerance. It stays
    /// naked in the account.
    pub wide_gaps: Vec<WideGap>,
    /// Faces that are there twice.
    pub duplicates: Vec<Duplicate>,
    /// What was too small to stand alone, in the order of absorption, and what still is.
    pub small: Vec<SmallRegion>,
    /// The area of each face, mm²; 0 for copies.
    pub area_of_face_mm2: Vec<f64>,
    /// How near neighbours had to be.
    pub tolerance: Tolerance,
}

/// Why merging failed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum MergeError {
    /// An option is not a positive number.
    #[error("option {option} is {value}: it must be positive")]
    Option {
        /// The option.
        option: &'static str,
        /// Its value.
        value: f64,
    },
    /// The classes of the constraints are those of another model.
    #[error("there are {classes} classes for {faces} faces")]
    Classes {
        /// Number of classes.
        classes: usize,
        /// Number of faces.
        faces: usize,
    },
    /// A face to be kept together with others does not exist.
    #[error("face {face} does not exist: there are {faces}, counted from 0")]
    NoSuchFace {
        /// The face.
        face: FaceId,
        /// Number of faces.
        faces: usize,
    },
    /// Faces are to be kept together and apart at once.
    #[error("faces {} and {} are to be kept together, and apart too", faces[0], faces[1])]
    Contradiction {
        /// Two of them.
        faces: [FaceId; 2],
    },
    /// A face's boundary cannot be evaluated.
    #[error("the boundary of face {face} is not finite")]
    NotFinite {
        /// The face.
        face: FaceId,
    },
}

/// Finds the joints of `model`, measures them, and grows regions across the smooth ones.
///
/// The result depends on the geometry alone: not on the order of faces, nor on how their parameters run,
/// nor on the number of threads.
///
/// # Errors
/// Options that make no sense; surfaces that evaluate to non-finite points.
pub fn merge(model: &Model, options: &MergeOptions) -> Result<Merge, MergeError> {
    let _span = info_span!("merging", faces = model.faces.len()).entered();
    options.check(model.faces.len())?;
    let given = options.tolerance_mm.unwrap_or(0.0);
    let radius_mm = tolerance::SEARCH_RADIUS_MM.max(20.0 * model.tolerance_mm).max(given);
    let edges = edge::edges(model, 0.1 * radius_mm);
    if let Some(edge) = edges.iter().find(|e| !e.length_mm().is_finite()) {
        return Err(MergeError::NotFinite { face: edge.face });
    }
    let pairs = matching::pairs(&edges, radius_mm);
    let tolerance = Tolerance::find(&edges, &pairs, options.tolerance_mm, model.tolerance_mm, radius_mm);
    let tolerance_mm = tolerance.value_mm;
    let mut runs: Vec<_> =
        pairs.par_iter().flat_map_iter(|pair| matching::runs(&edges, pair, tolerance_mm)).collect();
    let cells: Vec<OnceLock<Model>> = model.faces.iter().map(|_| OnceLock::new()).collect();
    let lone = lone::LoneFaces::new(model, &cells);
    let duplicates = duplicates::find(model, &edges, &runs, &lone, tolerance_mm);
    let mut is_copy = vec![false; model.faces.len()];
    duplicates.iter().for_each(|d| is_copy[d.copy] = true);
    runs.retain(|r| !is_copy[edges[r.a].face] && !is_copy[edges[r.b].face]);
    let runs = account::imprint(&edges, &runs, tolerance_mm);
    let coverage = account::Coverage::new(&edges, &runs);
    let rivals = coverage.rivals(runs.len(), tolerance_mm);
    let (mut account, bare) = coverage.account(&edges, &is_copy, tolerance_mm);
    let (laps, bare) = laps::find(&edges, &bare, &lone, &is_copy, tolerance_mm);
    let lapped_mm: f64 = laps.iter().map(|l| l.length_mm).sum();
    account.lapped_mm += lapped_mm;
    account.naked_mm -= lapped_mm;
    let wide_gaps = wide_gaps::find(&edges, &pairs, &bare, &lone, &is_copy, radius_mm, tolerance_mm);
    let naked: Vec<NakedStretch> = bare.iter().map(|b| b.naked(&edges)).collect();
    let mut joints: Vec<Joint> = runs
        .par_iter()
        .zip(&rivals)
        .map(|(run, rivals)| continuity::measure(model, &edges, run, !rivals.is_empty(), options))
        .collect();
    growing::mark_outdone(&mut joints, &rivals);
    let facts = region::facts(model, &edges, &duplicates);
    let area_of_face_mm2: Vec<f64> = facts.iter().map(|f| f.area_mm2).collect();
    let around = Surroundings { area_of_face_mm2: &area_of_face_mm2, naked: &naked, laps: &laps };
    let Grown { labels, standings, mut small } = growing::grow(&joints, &duplicates, around, options);
    joints
        .par_iter_mut()
        .zip(standings)
        .for_each(|(joint, standing)| verdict::judge(joint, standing, options));
    let borders = region::Borders { joints: &joints, naked: &naked, laps: &laps, duplicates: &duplicates };
    let (regions, region_of_face) = region::regions(model, &facts, &labels, &borders, tolerance_mm);
    absorption::number(&mut small, &region_of_face);
    Ok(Merge {
        joints,
        regions,
        region_of_face,
        account,
        naked,
        laps,
        wide_gaps,
        duplicates,
        small,
        area_of_face_mm2,
        tolerance,
    })
}
