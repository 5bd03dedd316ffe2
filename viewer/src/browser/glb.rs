//! Writes glTF binaries with quantised positions and normals (`KHR_mesh_quantization`), for the 3D
//! view in the browser.

use std::ops::Range;

use serde_json::{Value, json};

/// Positions are written as steps of one cube: 16 bits a coordinate.
const STEPS: f32 = 65_535.0;
/// Vertices of one primitive at most: two bytes an index, 65 535 being the format's sign for a restart.
const LARGEST: usize = 65_535;
const ARRAY_BUFFER: u32 = 34_962;
const ELEMENT_ARRAY_BUFFER: u32 = 34_963;

/// The cube that positions are measured in, so that 16 bits a coordinate suffice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cube {
    pub(super) corner: [f32; 3],
    pub(super) step: f32,
}

impl Cube {
    /// The smallest cube around `points`.
    pub(super) fn around<'a>(points: impl Iterator<Item = &'a [f32; 3]>) -> Self {
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for p in points {
            for i in 0..3 {
                low[i] = low[i].min(p[i]);
                high[i] = high[i].max(p[i]);
            }
        }
        let side = (0..3).map(|i| high[i] - low[i]).fold(0.0, f32::max);
        let corner = if side.is_finite() { low } else { [0.0; 3] };
        Cube { corner, step: if side.is_finite() && side > 0.0 { side / STEPS } else { 1.0 } }
    }

    fn place(&self, p: &[f32; 3]) -> [u16; 3] {
        [0, 1, 2].map(|i| ((p[i] - self.corner[i]) / self.step).round().clamp(0.0, STEPS) as u16)
    }
}

/// Triangles as they go into the file.
#[derive(Debug, Clone, Default)]
pub(super) struct Triangles {
    pub(super) points: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    /// A number a vertex, the attribute `_SCALLOP`.
    pub(super) heights: Vec<u8>,
    pub(super) corners: Vec<[u32; 3]>,
}

/// A glTF 2.0 file in the making: positions of 16 and normals of 8 bits a coordinate
/// (`KHR_mesh_quantization`), one array an attribute so that it compresses well.
pub(super) struct Glb {
    cube: Cube,
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    materials: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
}

impl Glb {
    pub(super) fn new(cube: Cube) -> Self {
        let empty = Vec::new;
        Glb {
            cube,
            binary: Vec::new(),
            views: empty(),
            accessors: empty(),
            materials: empty(),
            meshes: empty(),
            nodes: empty(),
        }
    }

    /// A material of this sRGB colour; `lit` is for surfaces, else it is for lines.
    pub(super) fn material(&mut self, rgb: [u8; 3], lit: bool) -> usize {
        // The format's colours are linear (IEC 61966-2-1).
        let [r, g, b] = rgb.map(|c| {
            let c = f64::from(c) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        });
        let mut material = json!({
            "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8 },
            "doubleSided": true,
        });
        if !lit {
            material["extensions"] = json!({ "KHR_materials_unlit": {} });
        }
        self.materials.push(material);
        self.materials.len() - 1
    }

    /// A node with triangles. `extras` tells readers what it is.
    pub(super) fn triangles(&mut self, name: &str, material: usize, mesh: &Triangles, extras: Value) {
        let attributes = json!({
            "POSITION": self.positions(&mesh.points),
            "NORMAL": self.normals(&mesh.normals),
            "_SCALLOP": self.heights(&mesh.heights),
        });
        let indices = self.indices(mesh.corners.iter().flatten().copied(), mesh.points.len());
        self.node(
            name,
            vec![json!({ "attributes": attributes, "indices": indices, "material": material })],
            extras,
        );
    }

    /// A node with polylines, in as many primitives as two bytes an index make necessary.
    pub(super) fn lines(&mut self, name: &str, material: usize, lines: &[&[[f32; 3]]], extras: Value) {
        const MODE_LINES: u32 = 1;
        let mut primitives = Vec::new();
        for chunk in chunks(lines) {
            let points: Vec<[f32; 3]> =
                chunk.iter().flat_map(|(line, part)| lines[*line][part.clone()].iter().copied()).collect();
            let mut ends = Vec::with_capacity(2 * points.len());
            let mut first = 0;
            for (_, part) in &chunk {
                let count = part.len() as u32;
                ends.extend((first + 1..first + count).flat_map(|i| [i - 1, i]));
                first += count;
            }
            let attributes = json!({ "POSITION": self.positions(&points) });
            let indices = self.indices(ends.into_iter(), points.len());
            primitives.push(json!({ "attributes": attributes, "indices": indices, "material": material,
                "mode": MODE_LINES }));
        }
        if !primitives.is_empty() {
            self.node(name, primitives, extras);
        }
    }

    fn node(&mut self, name: &str, primitives: Vec<Value>, extras: Value) {
        self.nodes.push(json!({ "name": name, "mesh": self.meshes.len(), "extras": extras }));
        self.meshes.push(json!({ "name": name, "primitives": primitives }));
    }

    fn positions(&mut self, points: &[[f32; 3]]) -> usize {
        let places: Vec<[u16; 3]> = points.iter().map(|p| self.cube.place(p)).collect();
        let bound = |pick: fn(u16, u16) -> u16, start: u16| {
            [0, 1, 2].map(|i| places.iter().map(|p| p[i]).fold(start, pick))
        };
        let (low, high) = (bound(u16::min, u16::MAX), bound(u16::max, 0));
        // Vertices start at multiples of four bytes.
        let bytes = places.iter().flat_map(|p| [p[0], p[1], p[2], 0]).flat_map(u16::to_le_bytes).collect();
        let view = self.view(bytes, ARRAY_BUFFER, Some(8));
        const UNSIGNED_SHORT: u32 = 5123;
        self.accessor(json!({ "bufferView": view, "componentType": UNSIGNED_SHORT, "count": places.len(),
            "type": "VEC3", "min": low, "max": high }))
    }

    fn normals(&mut self, normals: &[[f32; 3]]) -> usize {
        let byte = |c: f32| ((c * 127.0).round() as i8).to_le_bytes()[0];
        let bytes = normals.iter().flat_map(|n| [byte(n[0]), byte(n[1]), byte(n[2]), 0]).collect();
        let view = self.view(bytes, ARRAY_BUFFER, Some(4));
        const BYTE: u32 = 5120;
        self.accessor(
            json!({ "bufferView": view, "componentType": BYTE, "count": normals.len(), "type": "VEC3",
            "normalized": true }),
        )
    }

    fn heights(&mut self, heights: &[u8]) -> usize {
        let bytes = heights.iter().flat_map(|&h| [h, 0, 0, 0]).collect();
        let view = self.view(bytes, ARRAY_BUFFER, Some(4));
        const UNSIGNED_BYTE: u32 = 5121;
        self.accessor(
            json!({ "bufferView": view, "componentType": UNSIGNED_BYTE, "count": heights.len(), "type": "SCALAR" }),
        )
    }

    fn indices(&mut self, indices: impl Iterator<Item = u32>, vertices: usize) -> usize {
        let short = vertices <= LARGEST;
        let bytes: Vec<u8> = if short {
            indices.flat_map(|i| (i as u16).to_le_bytes()).collect()
        } else {
            indices.flat_map(u32::to_le_bytes).collect()
        };
        let (size, component) = if short { (2, 5123) } else { (4, 5125) };
        let count = bytes.len() / size;
        let view = self.view(bytes, ELEMENT_ARRAY_BUFFER, None);
        self.accessor(
            json!({ "bufferView": view, "componentType": component, "count": count, "type": "SCALAR" }),
        )
    }

    fn view(&mut self, bytes: Vec<u8>, target: u32, stride: Option<u32>) -> usize {
        let offset = self.binary.len();
        let mut view =
            json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len(), "target": target });
        if let Some(stride) = stride {
            view["byteStride"] = json!(stride);
        }
        self.binary.extend(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// The file's bytes. `rows` are the axes of the file (x left, y up, z to the front) in model coordinates;
    /// it is in metres from `origin_mm`. Both stand in the file too,
    /// and `lift_mm`: how far behind the triangles lines may lie.
    pub(super) fn bytes(mut self, rows: [[f64; 3]; 3], origin_mm: [f64; 3], lift_mm: f64) -> Vec<u8> {
        let scale = 1e-3 * f64::from(self.cube.step);
        let corner = self.cube.corner.map(f64::from);
        let moved = [0, 1, 2].map(|r: usize| 1e-3 * (0..3).map(|c| rows[r][c] * corner[c]).sum::<f64>());
        // Columns one after the other.
        let mut matrix: Vec<f64> = Vec::with_capacity(16);
        for c in 0..3 {
            matrix.extend([rows[0][c] * scale, rows[1][c] * scale, rows[2][c] * scale, 0.0]);
        }
        matrix.extend([moved[0], moved[1], moved[2], 1.0]);
        let children: Vec<usize> = (0..self.nodes.len()).collect();
        self.nodes.push(json!({ "name": "model", "children": children, "matrix": matrix }));
        let document = json!({
            "asset": { "version": "2.0", "generator": concat!("claymill ", env!("CARGO_PKG_VERSION")),
                "extras": { "origin_mm": origin_mm, "axes": rows, "lift_mm": lift_mm } },
            "extensionsUsed": ["KHR_mesh_quantization", "KHR_materials_unlit"],
            "extensionsRequired": ["KHR_mesh_quantization"],
            "scene": 0,
            "scenes": [{ "nodes": [children.len()] }],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{ "byteLength": self.binary.len() }],
        });
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let total = 28 + text.len() + self.binary.len();
        let mut out = Vec::with_capacity(total);
        const VERSION: u32 = 2;
        out.extend(b"glTF");
        out.extend([VERSION, total as u32, text.len() as u32].iter().flat_map(|n| n.to_le_bytes()));
        out.extend(b"JSON");
        out.extend(text);
        out.extend((self.binary.len() as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend(self.binary);
        out
    }
}

/// The lines cut into groups of at most [`LARGEST`] points: which line, which of its points. Parts of one line
/// share a point.
fn chunks(lines: &[&[[f32; 3]]]) -> Vec<Vec<(usize, Range<usize>)>> {
    let (mut all, mut open, mut filled) = (Vec::new(), Vec::new(), 0);
    for (index, line) in lines.iter().enumerate() {
        let mut start = 0;
        while start + 1 < line.len() {
            if LARGEST - filled < 2 {
                all.push(std::mem::take(&mut open));
                filled = 0;
            }
            let end = line.len().min(start + LARGEST - filled);
            open.push((index, start..end));
            filled += end - start;
            start = end - 1;
        }
    }
    if !open.is_empty() {
        all.push(open);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_are_cut_into_groups_that_two_bytes_can_count_and_no_segment_is_lost() {
        let line: Vec<[f32; 3]> = (0..150_000).map(|i| [i as f32, 0.0, 0.0]).collect();
        let single = [[0.0; 3]];
        let lines: [&[[f32; 3]]; 4] = [&line[..3], &single, &line, &line[..2]];
        let groups = chunks(&lines);
        let mut segments = [0; 4];
        for group in &groups {
            assert!(group.iter().map(|(_, part)| part.len()).sum::<usize>() <= LARGEST);
            for (index, part) in group {
                assert!(part.len() > 1);
                segments[*index] += part.len() - 1;
            }
        }
        assert_eq!(segments, [2, 0, 149_999, 1]);
    }

    #[test]
    fn a_point_comes_back_within_half_a_step() {
        let points = [[-250.0, 3.0, 10.0], [4250.0, 1200.0, 700.0], [77.7, -33.3, 5.5]];
        let cube = Cube::around(points.iter());
        for p in &points {
            let q = cube.place(p);
            for i in 0..3 {
                let back = cube.corner[i] + f32::from(q[i]) * cube.step;
                assert!((back - p[i]).abs() <= 0.5 * cube.step + 1e-3, "{back} {}", p[i]);
            }
        }
        assert_eq!(Cube::around([].iter()).step, 1.0);
    }
}
