//! Binary STL, written.

use claymill_nurbs::Point3;

/// Free text in front.
const HEADER: &[u8] = b"claymill, millimetres";
const HEADER_SIZE: usize = 80;

/// The bytes of a binary STL of triangles, in millimetres. Coordinates become single precision, so that what is closed stays
/// closed.
///
/// # Panics
/// A triangle names a corner that is not there.
#[must_use]
pub fn stl_bytes(points: &[Point3], triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut bytes = HEADER.to_vec();
    bytes.resize(HEADER_SIZE, 0);
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for t in triangles {
        let [a, b, c] = t.map(|i| points[i as usize]);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
        for v in [normal, a.coords, b.coords, c.coords] {
            v.iter().for_each(|c| bytes.extend((*c as f32).to_le_bytes()));
        }
        // Attributes, of which there are none.
        bytes.extend([0; 2]);
    }
    bytes
}
