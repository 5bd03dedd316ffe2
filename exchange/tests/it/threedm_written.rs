//! Hand-made archives of version 3 (no toolkit needed): sum surfaces, hostile sizes, checksums.

use std::path::Path;
use std::time::{Duration, Instant};

use claymill_exchange::{Import, ReadError, read_bytes};

const SUM_SURFACE: u128 = 0xc4cd5359_446d_4690_9ff5_29059732472b;
const ARC: u128 = 0xcf33be2a_09b4_11d4_bffb_0010830122f0;
const LINE: u128 = 0x4ed7d4db_e947_11d3_bfe5_0010830122f0;
const POLYLINE: u128 = 0x4ed7d4e6_e947_11d3_bfe5_0010830122f0;
const POLYCURVE: u128 = 0x4ed7d4e0_e947_11d3_bfe5_0010830122f0;

/// Content of a chunk: its own bytes and chunks inside, which the checksum leaves out.
#[derive(Default)]
struct Content {
    bytes: Vec<u8>,
    crc: crc32fast::Hasher,
}

impl Content {
    fn bytes(mut self, bytes: &[u8]) -> Self {
        self.crc.update(bytes);
        self.bytes.extend(bytes);
        self
    }

    fn integers(self, numbers: &[i32]) -> Self {
        let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
        self.bytes(&bytes)
    }

    fn reals(self, numbers: &[f64]) -> Self {
        let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
        self.bytes(&bytes)
    }

    fn inner(mut self, chunk: &[u8]) -> Self {
        self.bytes.extend(chunk);
        self
    }

    fn chunk(mut self, code: u32) -> Vec<u8> {
        if code & 0x8000 != 0 {
            self.bytes.extend(self.crc.finalize().to_le_bytes());
        }
        let mut chunk = code.to_le_bytes().to_vec();
        chunk.extend((self.bytes.len() as u32).to_le_bytes());
        chunk.extend(self.bytes);
        chunk
    }
}

fn version(major: u8, minor: u8) -> Content {
    Content::default().bytes(&[major << 4 | minor])
}

fn short(code: u32, value: i32) -> Vec<u8> {
    [code.to_le_bytes(), value.to_le_bytes()].concat()
}

fn identity(id: u128) -> Vec<u8> {
    let mut b = id.to_be_bytes().to_vec();
    b[0..4].reverse();
    b[4..6].reverse();
    b[6..8].reverse();
    b
}

fn object(class: u128, data: Content) -> Vec<u8> {
    Content::default()
        .inner(&Content::default().bytes(&identity(class)).chunk(0x0002_fffb))
        .inner(&data.chunk(0x0002_fffc))
        .inner(&short(0x8002_7fff, 0))
        .chunk(0x0002_7ffa)
}

/// An archive in centimetres with the one object.
fn archive(object: &[u8]) -> Vec<u8> {
    let units = Content::default().integers(&[100, 3]).reals(&[0.001, 0.1, 0.01]).chunk(0x2000_8031);
    let attributes = version(1, 0)
        .bytes(&identity(0x11111111_2222_3333_4444_555555555555))
        .integers(&[0, -1, 0])
        .bytes(&[0; 20])
        .integers(&[1])
        .bytes(&[0; 4])
        .integers(&[0, 0])
        .chunk(0x0200_8072);
    let record = Content::default()
        .inner(&short(0x8200_0071, 8))
        .inner(object)
        .inner(&attributes)
        .inner(&short(0x8200_007f, 0))
        .chunk(0x2000_8070);
    let end = short(0xffff_ffff, 0);
    let mut bytes = b"3D Geometry File Format        3".to_vec();
    bytes.extend(Content::default().inner(&units).inner(&end).chunk(0x1000_0015));
    bytes.extend(Content::default().inner(&record).inner(&end).chunk(0x1000_0013));
    let size = bytes.len() as i32 + 12;
    bytes.extend(Content::default().integers(&[size]).chunk(0x0000_7fff));
    bytes
}

fn sum(a: &[u8], b: &[u8]) -> Vec<u8> {
    object(SUM_SURFACE, version(1, 0).reals(&[1.0, 2.0, 3.0]).reals(&[0.0; 6]).inner(a).inner(b))
}

/// An arc of radius 5 about the origin.
fn arc(angles: [f64; 2], domain: [f64; 2]) -> Vec<u8> {
    let frame = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let data = version(1, 0).reals(&frame).reals(&[0.0; 4]).reals(&[5.0]).reals(&[0.0; 9]);
    object(ARC, data.reals(&angles).reals(&domain).integers(&[3]))
}

fn line(from: [f64; 3], to: [f64; 3], domain: [f64; 2]) -> Vec<u8> {
    object(LINE, version(1, 0).reals(&from).reals(&to).reals(&domain).integers(&[3]))
}

fn read(bytes: &[u8]) -> Result<Import, ReadError> {
    read_bytes(bytes, Path::new("made.3dm"))
}

fn area(import: &Import) -> f64 {
    import.model.faces.iter().map(claymill_nurbs::Face::area_mm2).sum()
}

#[test]
fn sums_of_lines_arcs_and_polycurves_have_their_areas() {
    let upright = line([0.0; 3], [0.0, 0.0, 7.0], [0.0, 1.0]);
    let import = read(&archive(&sum(&arc([0.5, 2.5], [0.0, 10.0]), &upright))).unwrap();
    assert_eq!((import.report.units.mm_per_unit, import.report.warnings.len()), (10.0, 0));
    assert!((area(&import) / 7000.0 - 1.0).abs() < 1e-9, "{}", area(&import));
    let face = &import.model.faces[0];
    // The base point moves the axis of the cylinder.
    let ((u, _), (v, _)) = face.surface.domain();
    let expected =
        claymill_nurbs::Point3::new(10.0 + 50.0 * 0.5_f64.cos(), 20.0 + 50.0 * 0.5_f64.sin(), 30.0);
    assert!((face.surface.point(u, v) - expected).norm() < 1e-9);
    assert!(face.source.entity.starts_with("11111111-2222-3333-4444-555555555555"));

    // A line and, where it ends, an arc: quadratic pieces throughout.
    let pieces = version(1, 0).integers(&[2, 0, 0]).reals(&[0.0; 6]).integers(&[3]).reals(&[0.0, 4.0, 9.0]);
    let pieces = pieces
        .inner(&line([5.0, -4.0, 0.0], [5.0, 0.0, 0.0], [0.0, 4.0]))
        .inner(&arc([0.0, 2.0], [0.0, 2.0]));
    let import = read(&archive(&sum(&object(POLYCURVE, pieces), &upright))).unwrap();
    assert!((area(&import) / (100.0 * 7.0 * (4.0 + 10.0)) - 1.0).abs() < 1e-9, "{}", area(&import));
    assert_eq!(import.model.faces[0].surface.domain().0, (0.0, 9.0));
}

#[test]
fn a_product_of_two_long_curves_is_refused_at_once() {
    let count = 30_000_usize;
    let zigzag = |up: bool| {
        let points: Vec<f64> = (0..count)
            .flat_map(|i| {
                let t = i as f64 * 1e-3;
                if up { [0.0, (i % 2) as f64, t] } else { [t, (i % 2) as f64, 0.0] }
            })
            .collect();
        let parameters: Vec<f64> = (0..count).map(|i| i as f64).collect();
        let data = version(1, 0).integers(&[count as i32]).reals(&points).integers(&[count as i32]);
        object(POLYLINE, data.reals(&parameters).integers(&[3]))
    };
    let start = Instant::now();
    let error = read(&archive(&sum(&zigzag(true), &zigzag(false)))).unwrap_err();
    assert!(error.to_string().contains("unfolds to more geometry than its size allows"), "{error}");
    assert!(start.elapsed() < Duration::from_secs(2), "{:?}", start.elapsed());
}

#[test]
fn every_single_byte_of_a_small_archive_may_be_wrong() {
    let sound = archive(&sum(&arc([0.5, 2.5], [0.0, 10.0]), &line([0.0; 3], [0.0, 0.0, 7.0], [0.0, 1.0])));
    let expected = area(&read(&sound).unwrap());
    let mut other = 0;
    for at in 32..sound.len() {
        for value in [0x00, 0x01, 0x7f, 0x80, 0xff] {
            let mut bytes = sound.clone();
            bytes[at] = value;
            if let Ok(import) = read(&bytes) {
                let report = &import.report;
                assert_eq!(report.faces_in_file, report.faces_read + report.skipped.len());
                other += usize::from(
                    (area(&import) - expected).abs() > 1e-9 * expected && report.warnings.is_empty(),
                );
            }
        }
    }
    assert_eq!(other, 0, "silent changes");
}
