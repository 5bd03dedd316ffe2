//! The NURBS kernel of claymill: curves, surfaces, trimmed faces and the model they form.
//!
//! ```text
//!   knots ─► curve, surface ─► jet (point, derivatives, normal, curvature)
//!                 │  └► leaves (the same, many points at a time)
//!               face = surface + trim loops ─► boundary, domain (inside test), mesh, area
//!                 │
//!               model ─► closest (exact closest point over all faces)
//! ```
//!
//! The kernel does no input or output and knows no machine. Lengths are millimetres; parameters `u`, `v`
//! are those of the surface's knot vectors.
//!
//! ```
//! use claymill_nurbs::{KnotVector, NurbsSurface, Point3};
//! let bilinear = NurbsSurface::new(
//!     KnotVector::clamped_uniform(1, 2),
//!     KnotVector::clamped_uniform(1, 2),
//!     vec![
//!         Point3::new(0.0, 0.0, 0.0), Point3::new(0.0, 10.0, 0.0),
//!         Point3::new(20.0, 0.0, 0.0), Point3::new(20.0, 10.0, 0.0),
//!     ],
//!     None,
//! )?;
//! assert_eq!(bilinear.point(0.5, 0.5), Point3::new(10.0, 5.0, 0.0));
//! assert_eq!(bilinear.jet(0.5, 0.5).normal().unwrap().z, 1.0);
//! # Ok::<(), claymill_nurbs::NurbsError>(())
//! ```

// What is to be said is returned: only the command prints.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

// The same bits on every machine, in all that is built upon this crate.
use claymill_elementary as _;

pub mod analytic;
mod arc;
mod area;
mod bernstein;
mod bisect;
mod boundary;
mod box_set;
mod box_tree;
mod closest;
mod curve;
mod curvedness;
mod domain;
mod error;
mod face;
mod flatness;
mod gauss;
mod insertion;
mod jet;
mod knots;
mod leaf;
mod measure;
mod mesh;
mod model;
mod nesting;
mod quadrature;
mod refine;
mod rings;
mod surface;
pub mod tolerance;
mod vector_area;
mod winding;

pub use area::FaceArea;
pub use bisect::{between, bisect};
pub use box_set::BoxSet;
pub use box_tree::{BRANCHES, BoxTree, Boxes, Eight, outward};
pub use closest::{ClosestPoints, Crossing, Crossings, Foot, Hint, Nearest};
pub use curve::{Curve2, Curve3, NurbsCurve};
pub use domain::Domain;
pub use error::NurbsError;
pub use face::{Face, Source, SurfaceKind, TrimEdge, TrimLoop};
pub use flatness::Flatness;
pub use jet::{CurvatureTensor, Jet};
pub use knots::{KnotVector, MAX_DEGREE};
pub use leaf::{LANES, Lanes, Leaf, LeafBounds, Leaves, NormalCone, Places, Shapes};
pub use mesh::{
    ClosedMesh, FaceMesh, Inside, MeshOptions, ModelMesh, nearest_on_triangle, tessellate,
    tessellate_polygons,
};
pub use model::{Aabb, FaceId, Model};
pub use nesting::turn_by_nesting;
pub use surface::NurbsSurface;

/// A point in model space, mm.
pub type Point3 = nalgebra::Point3<f64>;
/// A vector in model space, mm or unit-free.
pub type Vector3 = nalgebra::Vector3<f64>;
/// A point in a surface's parameter plane `(u, v)`.
pub type Point2 = nalgebra::Point2<f64>;
/// A vector in a surface's parameter plane.
pub type Vector2 = nalgebra::Vector2<f64>;
