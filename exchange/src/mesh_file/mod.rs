//! Triangle meshes as obstacles: clamps, tables, neighbouring parts. They are never machined.
//!
//! ```text
//!   bytes ─ format? ─┬─ stl ──┐
//!                    ├─ obj ──┼─ triangles ─ Welder ─► ObstacleMesh (mm)
//!                    └─ gltf ─┘
//! ```
//!
//! An obstacle with a hole is dangerous, so a mesh is read whole or not at all; only triangles without area are
//! left out, and counted.

mod error;
mod gltf;
mod obj;
mod polygon;
mod stl;
mod stl_writer;
mod weld;

use std::path::Path;

use claymill_nurbs::{Aabb, Point3};
use serde::{Deserialize, Serialize};

pub use error::{MeshError, MeshFault};
pub use stl_writer::stl_bytes;

use crate::Format;
use crate::contents::{contents, head};
use crate::plausible::Reach;

use weld::Welder;

/// A mesh file format that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MeshFormat {
    /// STL as text.
    StlText,
    /// STL in binary form.
    StlBinary,
    /// Wavefront OBJ.
    Obj,
    /// glTF 2.0 as JSON.
    Gltf,
    /// glTF 2.0 in one binary file.
    Glb,
}

impl MeshFormat {
    /// Recognises a mesh by content.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Option<MeshFormat> {
        if bytes.starts_with(gltf::GLB_MAGIC) {
            return Some(MeshFormat::Glb);
        }
        if stl::is_text(bytes) {
            return Some(MeshFormat::StlText);
        }
        if stl::is_binary(bytes) {
            return Some(MeshFormat::StlBinary);
        }
        if gltf::is_json(bytes) {
            return Some(MeshFormat::Gltf);
        }
        obj::is_obj(bytes).then_some(MeshFormat::Obj)
    }

    /// Recognises a mesh file by content; `None` where it cannot be read, too. Of a model file, which may be large,
    /// no more than the beginning is read.
    #[must_use]
    pub fn of_file(path: &Path) -> Option<MeshFormat> {
        match Format::of(&head(path).ok()?) {
            Ok(_) => None,
            Err(_) => MeshFormat::of(&contents(path).ok()?),
        }
    }

    /// The format in words: `a binary STL mesh`.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            MeshFormat::StlText => "an STL mesh",
            MeshFormat::StlBinary => "a binary STL mesh",
            MeshFormat::Obj => "an OBJ mesh",
            MeshFormat::Gltf => "a glTF mesh",
            MeshFormat::Glb => "a binary glTF mesh",
        }
    }

    /// Whether files of this format say what a length is.
    #[must_use]
    pub fn has_unit(self) -> bool {
        matches!(self, MeshFormat::Gltf | MeshFormat::Glb)
    }
}

/// Triangles of a file, in millimetres, with corners at one place made one.
#[derive(Debug, Clone, PartialEq)]
pub struct ObstacleMesh {
    /// The format that was recognised.
    pub format: MeshFormat,
    /// The corners, mm, in the order in which the file uses them first.
    pub vertices: Vec<Point3>,
    /// Corners of each triangle, in file order.
    pub triangles: Vec<[u32; 3]>,
    /// Every length of the file was multiplied by this.
    pub mm_per_unit: f64,
    /// Triangles of the file that have no area and were left out.
    pub without_area: usize,
    /// Whole sentences about things to check.
    pub warnings: Vec<String>,
}

impl ObstacleMesh {
    /// The box around all corners.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        Aabb::of(&self.vertices)
    }

    /// Sum of the triangles' areas.
    #[must_use]
    pub fn area_mm2(&self) -> f64 {
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| self.vertices[i as usize]);
            0.5 * (b - a).cross(&(c - a)).norm()
        };
        self.triangles.iter().map(area).sum()
    }

    /// Edges of one triangle alone. None where the mesh is watertight.
    #[must_use]
    pub fn open_edges(&self) -> usize {
        self.edges().chunk_by(|a, b| a == b).filter(|same| same.len() == 1).count()
    }

    /// Edges where more than two triangles meet.
    #[must_use]
    pub fn crowded_edges(&self) -> usize {
        self.edges().chunk_by(|a, b| a == b).filter(|same| same.len() > 2).count()
    }

    /// The edges of all triangles, smaller corner first, in order.
    fn edges(&self) -> Vec<[u32; 2]> {
        let sides = |[a, b, c]: &[u32; 3]| [[*a, *b], [*b, *c], [*c, *a]].map(|[p, q]| [p.min(q), p.max(q)]);
        let mut edges: Vec<_> = self.triangles.iter().flat_map(sides).collect();
        edges.sort_unstable();
        edges
    }
}

/// Reads a mesh. The format is recognised by content. Files without a unit (STL, OBJ) are scaled by
/// `unitless_mm`: the millimetres in one of their units. glTF is in metres with y up; it is turned so that its up
/// is z.
///
/// # Errors
/// The file cannot be opened, is no mesh, is damaged or cut short, or holds no triangle.
pub fn read_mesh(path: &Path, unitless_mm: f64) -> Result<ObstacleMesh, MeshError> {
    let bytes = contents(path).map_err(|source| MeshError::Open { path: path.into(), source })?;
    read_mesh_bytes(&bytes, path, unitless_mm)
}

/// Reads a mesh from memory; `path` serves messages and finds the buffers of a glTF in the same folder.
///
/// # Errors
/// As [`read_mesh`].
pub fn read_mesh_bytes(bytes: &[u8], path: &Path, unitless_mm: f64) -> Result<ObstacleMesh, MeshError> {
    let at = |fault: MeshFault| MeshError::Damaged { path: path.into(), fault };
    let format = MeshFormat::of(bytes).ok_or_else(|| MeshError::UnknownFormat { path: path.into() })?;
    let mm_per_unit = if format.has_unit() { gltf::MM_PER_METRE } else { unitless_mm };
    if !(mm_per_unit > 0.0 && mm_per_unit.is_finite()) {
        return Err(MeshError::Unit { mm: unitless_mm });
    }
    let mut welder = Welder::new(mm_per_unit);
    let warnings = match format {
        MeshFormat::StlText => stl::read_text(bytes, &mut welder),
        MeshFormat::StlBinary => stl::read_binary(bytes, &mut welder),
        MeshFormat::Obj => obj::read(bytes, &mut welder),
        MeshFormat::Gltf => gltf::read_json(bytes, path.parent(), &mut welder),
        MeshFormat::Glb => gltf::read_binary(bytes, path.parent(), &mut welder),
    }
    .map_err(at)?;
    let reach = Reach::of(welder.vertices.iter().copied());
    if let Some((p, mm)) = welder.vertices.iter().find_map(|p| Some((p, reach.beyond_mm(p)?))) {
        let place = format!("corner ({:.3e}, {:.3e}, {:.3e}) mm", p.x, p.y, p.z);
        return Err(at(MeshFault::wrong(place, reach.reason(mm))));
    }
    let mesh = ObstacleMesh {
        format,
        vertices: welder.vertices,
        triangles: welder.triangles,
        mm_per_unit,
        without_area: welder.without_area,
        warnings,
    };
    if mesh.triangles.is_empty() {
        return Err(MeshError::NoTriangles { path: path.into() });
    }
    Ok(mesh)
}
