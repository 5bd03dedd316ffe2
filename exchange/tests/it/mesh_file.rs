//! Obstacle meshes: one block in every format, files that are damaged, and random damage.

use std::path::Path;
use std::time::{Duration, Instant};

use base64::Engine;
use claymill_exchange::{
    MeshError, MeshFormat, ObstacleMesh, ReadError, read_bytes, read_mesh, read_mesh_bytes,
};
use rand::{Rng, SeedableRng};

/// A block of 2 × 3 × 5 with a corner at (1, 0, 0).
const CORNERS: [[f64; 3]; 8] = [
    [1.0, 0.0, 0.0],
    [3.0, 0.0, 0.0],
    [3.0, 3.0, 0.0],
    [1.0, 3.0, 0.0],
    [1.0, 0.0, 5.0],
    [3.0, 0.0, 5.0],
    [3.0, 3.0, 5.0],
    [1.0, 3.0, 5.0],
];
/// Its sides, anticlockwise from outside.
const SIDES: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
const AREA: f64 = 2.0 * (6.0 + 10.0 + 15.0);

fn triangles() -> Vec<[usize; 3]> {
    SIDES.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect()
}

fn stl_text() -> Vec<u8> {
    let mut text = String::from("solid a block facet\n");
    for t in triangles() {
        text += " facet normal 0 0 0\n  outer loop\n";
        for [x, y, z] in t.map(|i| CORNERS[i]) {
            text += &format!("   vertex {x:e} {y} {z:.3}\n");
        }
        text += "  endloop\n endfacet\n";
    }
    (text + "endsolid a block\n").into_bytes()
}

fn stl_binary() -> Vec<u8> {
    let mut bytes = b"solid of a writer that should not have written solid".to_vec();
    bytes.resize(80, 0);
    bytes.extend(12_u32.to_le_bytes());
    for t in triangles() {
        let numbers = [[0.0; 3]].into_iter().chain(t.map(|i| CORNERS[i])).flatten();
        bytes.extend(numbers.flat_map(|x| (x as f32).to_le_bytes()));
        bytes.extend([0, 0]);
    }
    bytes
}

fn obj() -> Vec<u8> {
    let mut text = String::from("# a block\nmtllib block.mtl\no block\n");
    for [x, y, z] in CORNERS {
        text += &format!("v {x} {y} {z} 1.0\n");
    }
    for (i, side) in SIDES.iter().enumerate() {
        // All the ways to name corners.
        let named: Vec<_> = side
            .iter()
            .map(|c| match i {
                0 => format!("{}", c + 1),
                1 => format!("{}/1", c + 1),
                2 => format!("{}//2", c + 1),
                _ => format!("{}/1/2", *c as i64 - 8),
            })
            .collect();
        text += &if i == 5 {
            format!("f {} {} \\\n {} {}\r\n", named[0], named[1], named[2], named[3])
        } else {
            format!("f {}\n", named.join(" "))
        };
    }
    text.into_bytes()
}

/// Positions and indices of the block in metres with y up: `(x, y, z)` of the block is `(x, z, −y)` here.
fn gltf_buffer() -> Vec<u8> {
    let metres = CORNERS.map(|[x, y, z]| [x * 1e-3, z * 1e-3, -y * 1e-3]);
    let mut bytes: Vec<u8> = metres.into_iter().flatten().flat_map(|x| (x as f32).to_le_bytes()).collect();
    bytes.extend(triangles().into_iter().flatten().flat_map(|i| (i as u16).to_le_bytes()));
    bytes
}

fn gltf_json(uri: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
        "nodes":[{{"children":[1],"translation":[0.001,0,0]}},{{"mesh":0,"translation":[-0.002,0,0],
        "rotation":[0,0,0,1],"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,-0.001,0,0,1]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3"}},
        {{"bufferView":1,"componentType":5123,"count":36,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":96}},{{"buffer":0,"byteOffset":96,"byteLength":72}}],
        "buffers":[{{{uri}"byteLength":168}}]}}"#
    )
}

fn gltf() -> Vec<u8> {
    let data = base64::engine::general_purpose::STANDARD.encode(gltf_buffer());
    gltf_json(&format!(r#""uri":"data:application/octet-stream;base64,{data}","#)).into_bytes()
}

fn glb() -> Vec<u8> {
    let mut json = gltf_json("").into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let binary = gltf_buffer();
    let mut bytes = b"glTF".to_vec();
    bytes.extend(2_u32.to_le_bytes());
    bytes.extend(((12 + 8 + json.len() + 8 + binary.len()) as u32).to_le_bytes());
    for (kind, content) in [(b"JSON", &json), (b"BIN\0", &binary)] {
        bytes.extend((content.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(content);
    }
    bytes
}

fn read(bytes: &[u8]) -> Result<ObstacleMesh, MeshError> {
    read_mesh_bytes(bytes, Path::new("clamp.mesh"), 1.0)
}

#[test]
fn a_block_is_the_same_in_every_format() {
    for (bytes, format) in [
        (stl_text(), MeshFormat::StlText),
        (stl_binary(), MeshFormat::StlBinary),
        (obj(), MeshFormat::Obj),
        (gltf(), MeshFormat::Gltf),
        (glb(), MeshFormat::Glb),
    ] {
        let mesh = read(&bytes).unwrap();
        assert_eq!((mesh.format, mesh.triangles.len(), mesh.vertices.len()), (format, 12, 8));
        assert_eq!((mesh.open_edges(), mesh.crowded_edges(), mesh.without_area), (0, 0, 0), "{format:?}");
        assert!((mesh.area_mm2() - AREA).abs() < 1e-4, "{format:?}: {}", mesh.area_mm2());
        let (low, high) = (mesh.bounds().min, mesh.bounds().max);
        assert!((low.coords - nalgebra::Vector3::new(1.0, 0.0, 0.0)).norm() < 1e-5, "{format:?}: {low}");
        assert!((high.coords - nalgebra::Vector3::new(3.0, 3.0, 5.0)).norm() < 1e-5, "{format:?}: {high}");
        assert_eq!(mesh.warnings, Vec::<String>::new());
        // As a model to be cut it is refused by name.
        let error = read_bytes(&bytes, Path::new("clamp.mesh")).unwrap_err();
        assert!(matches!(error, ReadError::UnknownFormat { .. }));
        assert!(error.to_string().ends_with(format.words()), "{error}");
    }
}

#[test]
fn units_count_where_the_format_has_none() {
    let inches = |bytes: &[u8]| read_mesh_bytes(bytes, Path::new("clamp.mesh"), 25.4).unwrap();
    assert!((inches(&stl_binary()).area_mm2() - AREA * 25.4 * 25.4).abs() < 1e-6);
    assert!((inches(&obj()).bounds().max.z - 5.0 * 25.4).abs() < 1e-9);
    assert_eq!(inches(&glb()).mm_per_unit, 1000.0);
    for nonsense in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = read_mesh_bytes(&obj(), Path::new("clamp.mesh"), nonsense).unwrap_err();
        assert!(matches!(error, MeshError::Unit { .. }));
    }
}

#[test]
fn buffers_beside_the_file_are_found_and_others_are_not_opened() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("clamp 1.bin"), gltf_buffer()).unwrap();
    let path = folder.path().join("clamp.gltf");
    std::fs::write(&path, gltf_json(r#""uri":"clamp%201.bin","#)).unwrap();
    assert_eq!(read_mesh(&path, 1.0).unwrap().triangles.len(), 12);
    for outside in ["../clamp.bin", "/etc/hostname", "a/../../clamp.bin"] {
        std::fs::write(&path, gltf_json(&format!(r#""uri":"{outside}","#))).unwrap();
        let error = read_mesh(&path, 1.0).unwrap_err();
        assert!(error.to_string().contains("not beside the file"), "{error}");
    }
    std::fs::write(&path, gltf_json(r#""uri":"gone.bin","#)).unwrap();
    assert!(read_mesh(&path, 1.0).unwrap_err().to_string().contains("gone.bin"));
}

#[test]
fn holes_and_crowded_edges_are_counted() {
    let text = String::from_utf8(obj()).unwrap();
    let lines: Vec<_> = text.lines().collect();
    let without_a_side = lines[..lines.len() - 2].join("\n");
    assert_eq!(read(without_a_side.as_bytes()).unwrap().open_edges(), 4);
    let with_a_fin = format!("{text}v 9 9 9\nf 1 2 9\nf 1 1 2\n");
    let mesh = read(with_a_fin.as_bytes()).unwrap();
    assert_eq!((mesh.open_edges(), mesh.crowded_edges(), mesh.without_area), (2, 1, 1));
}

#[test]
fn damage_is_named_with_its_place() {
    let swapped = |bytes: Vec<u8>, from: &str, to: &str| {
        String::from_utf8(bytes).unwrap().replacen(from, to, 1).into_bytes()
    };
    let mut cut = stl_binary();
    cut.truncate(84 + 7 * 50 + 20);
    let mut not_a_number = stl_binary();
    not_a_number[84 + 50 + 12..84 + 50 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    let mut short = glb();
    short.truncate(short.len() - 10);
    for (bytes, expected) in [
        (cut, "it holds 7 of 12 triangles"),
        (not_a_number, "triangle 1: a coordinate is not a finite number"),
        (swapped(stl_text(), "vertex 1e0", "vertex one"), "line 4: a corner needs three numbers"),
        (swapped(stl_text(), "endsolid", "solid"), "`endsolid` is missing behind 12 triangles"),
        (swapped(stl_text(), "endloop", "endlop"), "`endlop` is no word"),
        (swapped(obj(), "v 1 0 0 1", "v 1 0"), "line 4: a corner needs three numbers"),
        (swapped(obj(), "f 1", "f 17"), "a polygon uses a missing corner"),
        (swapped(obj(), "f 1 ", "f 0 "), "a polygon uses a missing corner"),
        (short, "is not whole"),
        (swapped(gltf(), r#""count":36"#, r#""count":37"#), "accessor 1: it reaches behind the end"),
        (swapped(gltf(), r#""count":8"#, r#""count":5"#), "triangle"),
        (swapped(gltf(), r#""children":[1]"#, r#""children":[0]"#), "nested too deeply or held twice"),
        (
            swapped(gltf(), r#""asset""#, r#""extensionsRequired":["KHR_draco_mesh_compression"],"asset""#),
            "the extension KHR_draco_mesh_compression cannot be read",
        ),
        (b"v 1 2 3\n".to_vec(), "no triangles"),
        (b"hello".to_vec(), "not an STL, OBJ or glTF mesh"),
    ] {
        let error = read(&bytes).unwrap_err();
        let text = error.to_string();
        assert!(text.starts_with("clamp.mesh: ") && text.contains(expected), "{text}; expected {expected}");
        assert!(!error.advice().is_empty());
    }
}

#[test]
fn random_damage_never_panics_or_hangs() {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(20_261_121);
    let victims = [stl_text(), stl_binary(), obj(), gltf(), glb()];
    let (mut sound, mut refused) = (0, 0);
    for round in 0..20_000 {
        let mut bytes = victims[round % victims.len()].clone();
        if round.is_multiple_of(7) {
            bytes.truncate(random.random_range(0..bytes.len()));
        }
        for _ in 0..random.random_range(1..5).min(bytes.len()) {
            let at = random.random_range(0..bytes.len());
            match random.random_range(0..4) {
                0 => bytes[at] = random.random(),
                1 => bytes[at] ^= 1 << random.random_range(0..8),
                2 => bytes[at] = b"0123456789-e.[]{}\",: /\\\n"[random.random_range(0..24)],
                _ => {
                    // A piece of the file once more: lists grow, keys come twice.
                    let end = (at + random.random_range(1..40)).min(bytes.len());
                    let piece = bytes[at..end].to_vec();
                    let to = random.random_range(0..=bytes.len());
                    bytes.splice(to..to, piece);
                }
            }
        }
        let start = Instant::now();
        match read(&bytes) {
            Ok(mesh) => {
                assert!(mesh.triangles.iter().flatten().all(|i| (*i as usize) < mesh.vertices.len()));
                assert!(mesh.area_mm2().is_finite() && mesh.open_edges() <= 3 * mesh.triangles.len());
                sound += 1;
            }
            Err(error) => {
                assert!(!error.to_string().is_empty());
                refused += 1;
            }
        }
        assert!(start.elapsed() < Duration::from_secs(2), "round {round}");
    }
    assert!(sound > 1000 && refused > 1000, "{sound} sound, {refused} refused");
}

/// A small file whose meshes are placed again and again must not unfold without end.
#[test]
fn placing_again_and_again_ends() {
    let nodes: Vec<_> = (0..200_000).map(|_| r#"{"mesh":0}"#).collect();
    let roots: Vec<_> = (0..200_000).map(|i: usize| i.to_string()).collect();
    let json = String::from_utf8(gltf()).unwrap();
    let primitives = vec![r#"{"attributes":{"POSITION":0},"indices":1}"#; 200].join(",");
    let json = json.replace(r#"{"attributes":{"POSITION":0},"indices":1}"#, &primitives);
    let from = json.find(r#""nodes":[{"children""#).unwrap();
    let to = json.find(r#""meshes""#).unwrap();
    let json = format!("{}\"nodes\":[{}],{}", &json[..from], nodes.join(","), &json[to..])
        .replace(r#"{"nodes":[0]}"#, &format!(r#"{{"nodes":[{}]}}"#, roots.join(",")));
    let error = read(json.as_bytes()).unwrap_err();
    assert!(error.to_string().contains("unfolds to more than its size allows"), "{error}");
}
