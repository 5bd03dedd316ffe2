//! glTF 2.0: a scene of placed meshes, in metres with y up (Khronos specification, sections 3.4 to 3.7 and 5).

use std::path::Path;

use base64::Engine;
use claymill_nurbs::Point3;
use nalgebra::{Isometry3, Matrix4, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;

use super::error::MeshFault;
use super::weld::Welder;
use crate::contents::contents;

/// The format's unit of length.
pub(super) const MM_PER_METRE: f64 = 1000.0;
/// What binary files begin with.
pub(super) const GLB_MAGIC: &[u8] = b"glTF";
const JSON_CHUNK: u32 = 0x4e4f_534a;
const BINARY_CHUNK: u32 = 0x004e_4942;
/// Triangles that meshes placed again and again may unfold to, beyond one for each byte of the file.
const MOST_TRIANGLES: usize = 1_000_000;
/// Nodes are nested no deeper than this.
const DEEPEST: usize = 256;
/// How far to look for the word that every glTF holds.
const HEAD: usize = 1 << 20;

const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Document {
    scene: Option<usize>,
    scenes: Vec<Scene>,
    nodes: Vec<Node>,
    meshes: Vec<Mesh>,
    accessors: Vec<Accessor>,
    buffer_views: Vec<View>,
    buffers: Vec<Buffer>,
    extensions_required: Vec<String>,
}

#[derive(Debug, Deserialize)]
struct Scene {
    #[serde(default)]
    nodes: Vec<usize>,
}

#[derive(Debug, Deserialize)]
struct Node {
    #[serde(default)]
    children: Vec<usize>,
    mesh: Option<usize>,
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

#[derive(Debug, Deserialize)]
struct Mesh {
    #[serde(default)]
    primitives: Vec<Primitive>,
}

#[derive(Debug, Deserialize)]
struct Primitive {
    attributes: std::collections::BTreeMap<String, usize>,
    indices: Option<usize>,
    mode: Option<u32>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: Option<usize>,
    #[serde(default)]
    byte_offset: usize,
    component_type: u32,
    #[serde(default)]
    normalized: bool,
    count: usize,
    #[serde(rename = "type")]
    kind: String,
    sparse: Option<serde::de::IgnoredAny>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct View {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    byte_stride: Option<usize>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Buffer {
    uri: Option<String>,
    byte_length: usize,
}

/// JSON with the one object that every glTF must have.
pub(super) fn is_json(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let head = |text: &[u8]| memchr::memmem::find(&text[..text.len().min(HEAD)], b"\"asset\"").is_some();
    // The object may stand at the end, behind megabytes of buffers.
    text.starts_with(b"{") && (head(text) || head(&text[text.len().saturating_sub(HEAD)..]))
}

/// Reads glTF as JSON; `folder` holds its buffers.
pub(super) fn read_json(
    bytes: &[u8],
    folder: Option<&Path>,
    out: &mut Welder,
) -> Result<Vec<String>, MeshFault> {
    read(bytes, None, folder, bytes.len(), out)
}

/// Reads glTF in binary form.
pub(super) fn read_binary(
    bytes: &[u8],
    folder: Option<&Path>,
    out: &mut Welder,
) -> Result<Vec<String>, MeshFault> {
    let field = |at: usize| -> Result<u32, MeshFault> {
        let found = bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
        found.ok_or_else(|| MeshFault::Truncated(format!("byte {at} is missing")))
    };
    let version = field(4)?;
    if version != 2 {
        return Err(MeshFault::Unsupported(format!("glTF of version {version}")));
    }
    let (mut json, mut binary, mut at) = (None, None, 12);
    while at < bytes.len() {
        let (length, kind) = (field(at)? as usize, field(at + 4)?);
        let content = (at + 8).checked_add(length).and_then(|end| bytes.get(at + 8..end));
        let content =
            content.ok_or_else(|| MeshFault::Truncated(format!("the chunk at byte {at} is not whole")))?;
        match kind {
            JSON_CHUNK if json.is_none() => json = Some(content),
            BINARY_CHUNK if binary.is_none() => binary = Some(content),
            _ => {}
        }
        at += 8 + length;
    }
    let json = json.ok_or_else(|| MeshFault::Truncated("the scene is missing".into()))?;
    read(json, binary, folder, bytes.len(), out)
}

fn read(
    json: &[u8],
    binary: Option<&[u8]>,
    folder: Option<&Path>,
    size: usize,
    out: &mut Welder,
) -> Result<Vec<String>, MeshFault> {
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    let document: Document = serde_json::from_slice(json)
        .map_err(|e| MeshFault::wrong(format!("line {}, column {}", e.line(), e.column()), e.to_string()))?;
    // Quantised positions are read; other required extensions change what a mesh is.
    let known = |e: &&String| !matches!(e.as_str(), "KHR_mesh_quantization" | "KHR_texture_transform");
    if let Some(extension) = document.extensions_required.iter().find(known) {
        return Err(MeshFault::Unsupported(format!("the extension {extension}")));
    }
    let mut buffers = Vec::new();
    for (i, buffer) in document.buffers.iter().enumerate() {
        buffers.push(content(buffer, i, binary, folder)?);
    }
    let size = buffers.iter().fold(size, |sum, b| sum.saturating_add(b.len()));
    let mut walk = Walk {
        document: &document,
        buffers: &buffers,
        seen: vec![false; document.nodes.len()],
        triangles_left: size.saturating_add(MOST_TRIANGLES),
        out,
    };
    // y up becomes z up.
    let upright = Matrix4::new(
        1.0, 0.0, 0.0, 0.0, //
        0.0, 0.0, -1.0, 0.0, //
        0.0, 1.0, 0.0, 0.0, //
        0.0, 0.0, 0.0, 1.0,
    );
    for root in roots(&document) {
        walk.node(root, &upright, 0)?;
    }
    if document.nodes.is_empty() {
        for mesh in 0..document.meshes.len() {
            walk.mesh(mesh, &upright)?;
        }
    }
    Ok(Vec::new())
}

/// The nodes to begin with: those of the scene, or where there is none all that no other node holds.
fn roots(document: &Document) -> Vec<usize> {
    if let Some(scene) = document.scenes.get(document.scene.unwrap_or(0)) {
        return scene.nodes.clone();
    }
    let mut held = vec![false; document.nodes.len()];
    for child in document.nodes.iter().flat_map(|n| &n.children) {
        if let Some(held) = held.get_mut(*child) {
            *held = true;
        }
    }
    (0..held.len()).filter(|i| !held[*i]).collect()
}

/// The bytes of a buffer: of the binary file itself, of the JSON, or of a file beside it.
fn content(
    buffer: &Buffer,
    index: usize,
    binary: Option<&[u8]>,
    folder: Option<&Path>,
) -> Result<Vec<u8>, MeshFault> {
    let place = || format!("buffer {index}");
    let bytes = match &buffer.uri {
        None => binary.ok_or_else(|| MeshFault::wrong(place(), "its bytes are not in the file"))?.to_vec(),
        Some(uri) if uri.starts_with("data:") => {
            let (_, data) = uri
                .split_once(";base64,")
                .ok_or_else(|| MeshFault::Unsupported("a buffer that is not in base 64".into()))?;
            let decoded = base64::engine::general_purpose::STANDARD.decode(data);
            decoded.map_err(|e| MeshFault::wrong(place(), e.to_string()))?
        }
        Some(uri) => {
            // Only files below the folder: a mesh must not make the program open others.
            let name = uri.replace("%20", " ");
            let inside = |p: &Path| p.components().all(|c| matches!(c, std::path::Component::Normal(_)));
            let (true, Some(folder)) = (inside(Path::new(&name)), folder) else {
                return Err(MeshFault::Unsupported(format!(
                    "the buffer `{uri}`, which is not beside the file,"
                )));
            };
            contents(&folder.join(&name)).map_err(|e| MeshFault::wrong(place(), format!("`{name}`: {e}")))?
        }
    };
    if bytes.len() < buffer.byte_length {
        let what = format!("{place} holds {} of {} bytes", bytes.len(), buffer.byte_length, place = place());
        return Err(MeshFault::Truncated(what));
    }
    Ok(bytes)
}

struct Walk<'a> {
    document: &'a Document,
    buffers: &'a [Vec<u8>],
    /// Nodes form a tree: to come by one again is damage.
    seen: Vec<bool>,
    triangles_left: usize,
    out: &'a mut Welder,
}

impl Walk<'_> {
    fn node(&mut self, index: usize, around: &Matrix4<f64>, depth: usize) -> Result<(), MeshFault> {
        let document = self.document;
        let place = || format!("node {index}");
        let node = document.nodes.get(index).ok_or_else(|| MeshFault::wrong(place(), "it does not exist"))?;
        if std::mem::replace(&mut self.seen[index], true) || depth > DEEPEST {
            return Err(MeshFault::wrong(place(), "nodes are nested too deeply or held twice"));
        }
        let own = match node.matrix {
            Some(m) => Matrix4::from_column_slice(&m),
            None => {
                let [x, y, z, w] = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
                let turn = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
                let shift = Translation3::from(Vector3::from(node.translation.unwrap_or_default()));
                let scale = Vector3::from(node.scale.unwrap_or([1.0; 3]));
                Isometry3::from_parts(shift, turn).to_homogeneous() * Matrix4::new_nonuniform_scaling(&scale)
            }
        };
        let placement = around * own;
        if let Some(mesh) = node.mesh {
            self.mesh(mesh, &placement)?;
        }
        node.children.iter().try_for_each(|child| self.node(*child, &placement, depth + 1))
    }

    fn mesh(&mut self, index: usize, placement: &Matrix4<f64>) -> Result<(), MeshFault> {
        let document = self.document;
        let missing = || MeshFault::wrong(format!("mesh {index}"), "it does not exist");
        for primitive in &document.meshes.get(index).ok_or_else(missing)?.primitives {
            self.primitive(index, primitive, placement)?;
        }
        Ok(())
    }

    fn primitive(
        &mut self,
        mesh: usize,
        primitive: &Primitive,
        placement: &Matrix4<f64>,
    ) -> Result<(), MeshFault> {
        let place = || format!("mesh {mesh}");
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        // Points and lines are no obstacle.
        if !matches!(mode, TRIANGLES | STRIP | FAN) {
            return Ok(());
        }
        let positions = primitive.attributes.get("POSITION");
        let positions = *positions.ok_or_else(|| MeshFault::wrong(place(), "it has no positions"))?;
        let positions = self.elements(positions, "VEC3", 3)?;
        let indices = primitive.indices.map(|accessor| self.elements(accessor, "SCALAR", 1)).transpose()?;
        let length = indices.as_ref().map_or(positions.count, |i| i.count);
        let mut corners = Vec::new();
        let triangles = if mode == TRIANGLES { length / 3 } else { length.saturating_sub(2) };
        let left = self.triangles_left.checked_sub(triangles);
        let left =
            left.ok_or_else(|| MeshFault::wrong(place(), "the file unfolds to more than its size allows"))?;
        for t in 0..triangles {
            let [a, b, c] = match mode {
                TRIANGLES => [3 * t, 3 * t + 1, 3 * t + 2],
                STRIP if t % 2 == 1 => [t + 1, t, t + 2],
                STRIP => [t, t + 1, t + 2],
                _ => [0, t + 1, t + 2],
            };
            let corner = |k: usize| -> Option<Point3> {
                let i = indices.as_ref().map_or(k, |all| all.get(k, 0) as usize);
                let p = (i < positions.count).then(|| [0, 1, 2].map(|k| positions.get(i, k)))?;
                Some(placement.transform_point(&Point3::from(p)))
            };
            let found = corner(a).zip(corner(b)).zip(corner(c));
            let missing = || MeshFault::wrong(place(), format!("triangle {t} uses a missing corner"));
            let ((a, b), c) = found.ok_or_else(missing)?;
            corners.push([a, b, c]);
        }
        self.triangles_left = left;
        for (t, corners) in corners.into_iter().enumerate() {
            self.out.add(corners, || format!("mesh {mesh}, triangle {t}"))?;
        }
        Ok(())
    }

    /// The elements of an accessor of `width` components, which the format calls `kind`.
    fn elements(&self, index: usize, kind: &str, width: usize) -> Result<Elements<'_>, MeshFault> {
        let wrong = |what: &str| MeshFault::wrong(format!("accessor {index}"), what);
        let accessor = self.document.accessors.get(index).ok_or_else(|| wrong("it does not exist"))?;
        if accessor.kind != kind {
            return Err(wrong(&format!("it is {} and not {kind}", accessor.kind)));
        }
        if accessor.sparse.is_some() {
            return Err(MeshFault::Unsupported(format!("accessor {index}, which is sparse,")));
        }
        let view = accessor.buffer_view.and_then(|v| self.document.buffer_views.get(v));
        let view = view.ok_or_else(|| wrong("its buffer view does not exist"))?;
        let buffer = self.buffers.get(view.buffer).ok_or_else(|| wrong("its buffer does not exist"))?;
        let end = view.byte_offset.checked_add(view.byte_length);
        let bytes = end.and_then(|end| buffer.get(view.byte_offset..end));
        let bytes = bytes.ok_or_else(|| wrong("its buffer view is larger than the buffer"))?;
        let bytes = bytes.get(accessor.byte_offset..).ok_or_else(|| wrong("it begins behind its view"))?;
        let component =
            Component::of(accessor.component_type).ok_or_else(|| wrong("its type is not known"))?;
        let size = component.size() * width;
        let stride = view.byte_stride.unwrap_or(size);
        let needed = accessor.count.saturating_sub(1).checked_mul(stride).and_then(|n| n.checked_add(size));
        if stride < size || accessor.count > 0 && needed.is_none_or(|n| n > bytes.len()) {
            return Err(wrong("it reaches behind the end of its view"));
        }
        let scale = if accessor.normalized { component.largest() } else { 1.0 };
        Ok(Elements { bytes, stride, count: accessor.count, component, scale })
    }
}

/// Numbers of an accessor; all of them lie within `bytes`.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    count: usize,
    component: Component,
    /// Numbers are divided by this.
    scale: f64,
}

impl Elements<'_> {
    /// Component `k` of element `i`.
    fn get(&self, i: usize, k: usize) -> f64 {
        let at = i * self.stride + k * self.component.size();
        let bytes = &self.bytes[at..];
        let value = match self.component {
            Component::I8 => f64::from(i8::from_le_bytes([bytes[0]])),
            Component::U8 => f64::from(bytes[0]),
            Component::I16 => f64::from(i16::from_le_bytes([bytes[0], bytes[1]])),
            Component::U16 => f64::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            Component::U32 => f64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
            Component::F32 => f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
        };
        (value / self.scale).max(if self.scale > 1.0 { -1.0 } else { f64::NEG_INFINITY })
    }
}

#[derive(Debug, Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Option<Self> {
        let all = [Self::I8, Self::U8, Self::I16, Self::U16];
        match code {
            5125 => Some(Self::U32),
            5126 => Some(Self::F32),
            _ => all.get(usize::try_from(code.checked_sub(5120)?).ok()?).copied(),
        }
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// What stands for one in normalised numbers.
    fn largest(self) -> f64 {
        match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32767.0,
            Self::U16 => 65535.0,
            Self::U32 => 4_294_967_295.0,
            Self::F32 => 1.0,
        }
    }
}
