//! Writing tessellated faces and lines as binary glTF 2.0, which any viewer opens.

use std::path::Path;

use claymill_nurbs::{FaceId, FaceMesh, MeshOptions, Model, NurbsError, Point3, tessellate};
use rayon::prelude::*;
use serde_json::{Value, json};

use crate::export::{Group, WriteError, group_of_face, write_whole};

/// Lines under one name and colour, as the tool paths of a region are.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Lines {
    /// Their name.
    pub name: String,
    /// Red, green, blue.
    pub colour: [u8; 3],
    /// Each line as its points, mm.
    pub lines: Vec<Vec<Point3>>,
}

/// Faces without a colour: clay.
const CLAY: [u8; 3] = [181, 157, 133];
/// Triangle edges are no longer than this part of the face's own deviation allows; here: not limited.
const LONGEST_EDGE_MM: f64 = f64::MAX;

/// Writes `model` as triangles that keep within `deviation_mm` of the faces, one mesh a group in the group's colour and
/// one for the faces outside all groups, and `lines` as line primitives. The scene is in metres with `y` up, as the
/// format wants it; the meshes under it are in millimetres and the model's axes. The file appears whole or
/// not at all. Returns the faces that could not be triangulated, which are left out.
///
/// # Errors
/// See [`WriteError`].
pub fn write_glb(
    path: &Path,
    model: &Model,
    groups: &[Group],
    lines: &[Lines],
    deviation_mm: f64,
) -> Result<Vec<(FaceId, NurbsError)>, WriteError> {
    let group_of = group_of_face(model, groups)?;
    let options = MeshOptions { deviation_mm, longest_edge_mm: LONGEST_EDGE_MM };
    let meshes: Vec<Result<FaceMesh, NurbsError>> =
        model.faces.par_iter().map(|face| tessellate(face, &options)).collect();
    let mut left_out = Vec::new();
    let mut meshes_of: Vec<Vec<(usize, FaceMesh)>> = vec![Vec::new(); groups.len() + 1];
    for (face, mesh) in meshes.into_iter().enumerate() {
        match mesh {
            Ok(mesh) => meshes_of[group_of[face].unwrap_or(groups.len())].push((face, mesh)),
            Err(reason) => left_out.push((face, reason)),
        }
    }
    let mut scene = Scene::default();
    for (index, meshes) in meshes_of.iter().enumerate().filter(|(_, m)| !m.is_empty()) {
        let name = groups.get(index).map_or("faces", |g| g.name.as_str());
        let colour = groups.get(index).and_then(|g| g.colour).unwrap_or(CLAY);
        scene.triangles(name, colour, model, meshes);
    }
    for lines in lines.iter().filter(|l| l.lines.iter().any(|line| line.len() > 1)) {
        scene.lines(lines);
    }
    write_whole(path, &scene.bytes())?;
    Ok(left_out)
}

#[derive(Default)]
struct Scene {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    materials: Vec<Value>,
    meshes: Vec<Value>,
}

impl Scene {
    fn triangles(&mut self, name: &str, colour: [u8; 3], model: &Model, meshes: &[(usize, FaceMesh)]) {
        let (mut points, mut normals, mut indices) = (Vec::new(), Vec::new(), Vec::new());
        for (id, mesh) in meshes {
            let face = &model.faces[*id];
            let first = points.len() as u32;
            points.extend(&mesh.points);
            normals.extend(mesh.uv.iter().map(|uv| {
                let n = face.surface.normal(uv.x, uv.y).map_or(nalgebra::Vector3::z(), |n| n.0);
                if face.reversed { -n } else { n }
            }));
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|i| first + i);
                indices.extend(if face.reversed { [a, c, b] } else { [a, b, c] });
            }
        }
        let attributes = json!({ "POSITION": self.points(&points), "NORMAL": self.vectors(&normals) });
        let (indices, material) = (self.indices(&indices), self.material(colour, false));
        let primitive = json!({ "attributes": attributes, "indices": indices, "material": material });
        self.meshes.push(json!({ "name": name, "primitives": [primitive] }));
    }

    fn lines(&mut self, lines: &Lines) {
        let (mut points, mut indices) = (Vec::new(), Vec::new());
        for line in &lines.lines {
            let first = points.len() as u32;
            points.extend(line);
            indices.extend((1..line.len() as u32).flat_map(|i| [first + i - 1, first + i]));
        }
        let attributes = json!({ "POSITION": self.points(&points) });
        let (indices, material) = (self.indices(&indices), self.material(lines.colour, true));
        let mode_lines = 1;
        let primitive =
            json!({ "attributes": attributes, "indices": indices, "material": material, "mode": mode_lines });
        self.meshes.push(json!({ "name": lines.name, "primitives": [primitive] }));
    }

    fn points(&mut self, points: &[Point3]) -> usize {
        let bound = |pick: fn(f32, f32) -> f32, start: f32| {
            let fold = |k: usize| points.iter().map(|p| p[k] as f32).fold(start, pick);
            [fold(0), fold(1), fold(2)]
        };
        let (low, high) = (bound(f32::min, f32::INFINITY), bound(f32::max, f32::NEG_INFINITY));
        let vectors: Vec<_> = points.iter().map(|p| p.coords).collect();
        let accessor = self.vectors(&vectors);
        self.accessors[accessor]["min"] = json!(low);
        self.accessors[accessor]["max"] = json!(high);
        accessor
    }

    fn vectors(&mut self, vectors: &[nalgebra::Vector3<f64>]) -> usize {
        let bytes = vectors.iter().flat_map(|v| [v.x, v.y, v.z]).flat_map(|c| (c as f32).to_le_bytes());
        let array_buffer = 34962;
        let view = self.view(bytes.collect(), array_buffer);
        let float = 5126;
        self.accessors.push(
            json!({ "bufferView": view, "componentType": float, "count": vectors.len(), "type": "VEC3" }),
        );
        self.accessors.len() - 1
    }

    fn indices(&mut self, indices: &[u32]) -> usize {
        let element_array_buffer = 34963;
        let view = self.view(indices.iter().flat_map(|i| i.to_le_bytes()).collect(), element_array_buffer);
        let unsigned_int = 5125;
        self.accessors.push(
            json!({ "bufferView": view, "componentType": unsigned_int, "count": indices.len(), "type": "SCALAR" }),
        );
        self.accessors.len() - 1
    }

    fn view(&mut self, bytes: Vec<u8>, target: u32) -> usize {
        let offset = self.binary.len();
        self.views
            .push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len(), "target": target }));
        self.binary.extend(bytes);
        self.views.len() - 1
    }

    fn material(&mut self, rgb: [u8; 3], unlit: bool) -> usize {
        // Colours of the format are linear, those of groups sRGB (IEC 61966-2-1).
        let linear = rgb.map(|c| {
            let c = f64::from(c) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        });
        let base = [linear[0], linear[1], linear[2], 1.0];
        let mut material = json!({
            "pbrMetallicRoughness": { "baseColorFactor": base, "metallicFactor": 0.0, "roughnessFactor": 0.7 },
            "doubleSided": true,
        });
        if unlit {
            material["extensions"] = json!({ "KHR_materials_unlit": {} });
        }
        self.materials.push(material);
        self.materials.len() - 1
    }

    fn bytes(mut self) -> Vec<u8> {
        let count = self.meshes.len();
        let mut nodes: Vec<Value> =
            self.meshes.iter().enumerate().map(|(i, m)| json!({ "name": m["name"], "mesh": i })).collect();
        // Millimetres with z up become metres with y up; columns of the matrix one after the other.
        let m = 1e-3;
        let matrix = [m, 0., 0., 0., 0., 0., -m, 0., 0., m, 0., 0., 0., 0., 0., 1.];
        let children: Vec<usize> = (0..count).collect();
        nodes.push(json!({ "name": "model", "children": children, "matrix": matrix }));
        let document = json!({
            "asset": { "version": "2.0", "generator": concat!("claymill ", env!("CARGO_PKG_VERSION")) },
            "extensionsUsed": ["KHR_materials_unlit"],
            "scene": 0,
            "scenes": [{ "nodes": [count] }],
            "nodes": nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{ "byteLength": self.binary.len().next_multiple_of(4) }],
        });
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let mut out = Vec::with_capacity(28 + text.len() + self.binary.len());
        let total = 28 + text.len() + self.binary.len();
        let version = 2_u32;
        out.extend(b"glTF");
        out.extend([version, total as u32, text.len() as u32].iter().flat_map(|n| n.to_le_bytes()));
        out.extend(b"JSON");
        out.extend(text);
        out.extend((self.binary.len() as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend(self.binary);
        out
    }
}
