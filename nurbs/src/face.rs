//! Faces: a surface with its trim loops, and where it came from in its file.

use serde::{Deserialize, Serialize};

use crate::{Curve2, NurbsSurface};

/// A trimmed piece of a surface: what a file calls a face.
#[derive(Debug, Clone)]
pub struct Face {
    /// The carrier.
    pub surface: NurbsSurface,
    /// Trim loops in the parameter plane; empty when the face is the whole surface. The face is the set of
    /// parameters with a non-zero winding number, so that orientation of loops does not matter.
    pub loops: Vec<TrimLoop>,
    /// The file says that the face's outside is `-(Su × Sv)`.
    pub reversed: bool,
    /// What the surface was in the file.
    pub kind: SurfaceKind,
    /// Where it came from.
    pub source: Source,
}

/// One closed trim loop: edges head to tail.
#[derive(Debug, Clone, Default)]
pub struct TrimLoop {
    /// The edges in order.
    pub edges: Vec<TrimEdge>,
}

/// One edge of a trim loop.
#[derive(Debug, Clone)]
pub struct TrimEdge {
    /// The edge in the parameter plane, in the loop's direction.
    pub pcurve: Curve2,
    /// Identity of the edge in the file's own topology: two uses of one id are the same edge.
    pub shared: Option<u64>,
}

/// What a surface was in its file, before it became a NURBS.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[expect(missing_docs, reason = "the names say it")]
pub enum SurfaceKind {
    Nurbs,
    Plane,
    Cylinder,
    Cone,
    Sphere,
    Torus,
    Revolution,
    Extrusion,
    Ruled,
    Offset,
    Spline,
}

/// Where a face came from.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Source {
    /// The entity in the file: `DE 17`, `#4711`.
    pub entity: String,
    /// Name given by the designer, if any.
    pub name: Option<String>,
    /// Layer or level, if any.
    pub layer: Option<String>,
    /// Colour, if any.
    pub colour: Option<[u8; 3]>,
}
