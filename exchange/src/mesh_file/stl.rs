//! STL: text and binary. Neither says what a length is.

use claymill_nurbs::Point3;

use super::error::MeshFault;
use super::weld::Welder;

/// Free text and the number of triangles.
const HEADER: usize = 84;
/// Normal, three corners, two bytes of anything.
const TRIANGLE: usize = 50;
/// How far to look for the first triangle of a text.
const HEAD: usize = 4096;

fn count(bytes: &[u8]) -> Option<usize> {
    let field = bytes.get(HEADER - 4..HEADER)?.try_into().ok()?;
    usize::try_from(u32::from_le_bytes(field)).ok()
}

/// Text begins with `solid`; so does many a binary file, which then has no `facet` behind it.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(HEAD)];
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
    let lower = text.to_ascii_lowercase();
    let exact = count(bytes).and_then(|n| n.checked_mul(TRIANGLE)?.checked_add(HEADER)) == Some(bytes.len());
    lower.starts_with(b"solid")
        && !exact
        && (memchr::memmem::find(&lower, b"facet").is_some()
            || memchr::memmem::find(&lower, b"endsolid").is_some())
}

/// Binary files have nothing to recognise but their length, which the number of triangles gives; files that
/// break off begin with a header that is zero or text.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    let Some(needed) = count(bytes).and_then(|n| n.checked_mul(TRIANGLE)?.checked_add(HEADER)) else {
        return false;
    };
    let plain_header = || bytes[..80].iter().all(|b| *b == 0 || (32..127).contains(b));
    bytes.len() == needed
        || (bytes.len() > HEADER && bytes[..5].eq_ignore_ascii_case(b"solid") && bytes.contains(&0))
        || (bytes.len() > HEADER && bytes[60..80].iter().all(|b| *b == 0) && plain_header())
}

/// Reads binary STL.
pub(super) fn read_binary(bytes: &[u8], out: &mut Welder) -> Result<Vec<String>, MeshFault> {
    let count = count(bytes).unwrap_or(0);
    let body = &bytes[HEADER.min(bytes.len())..];
    if body.len() / TRIANGLE < count {
        let whole = body.len() / TRIANGLE;
        return Err(MeshFault::Truncated(format!("it holds {whole} of {count} triangles")));
    }
    for (i, t) in body.chunks_exact(TRIANGLE).take(count).enumerate() {
        let number = |k: usize| {
            let field = t[12 + 4 * k..16 + 4 * k].try_into().unwrap_or_default();
            f64::from(f32::from_le_bytes(field))
        };
        let corner = |k: usize| Point3::new(number(3 * k), number(3 * k + 1), number(3 * k + 2));
        out.add([corner(0), corner(1), corner(2)], || format!("triangle {i}"))?;
    }
    let rest = body.len() - count * TRIANGLE;
    let told = format!("{rest} bytes behind the last triangle were ignored; check the number of triangles.");
    Ok(if rest > 0 { vec![told] } else { Vec::new() })
}

/// Reads STL as text: any layout of the words.
pub(super) fn read_text(bytes: &[u8], out: &mut Welder) -> Result<Vec<String>, MeshFault> {
    let (mut corners, mut triangles, mut ended) = (Vec::new(), 0_usize, true);
    for (i, line) in bytes.split(|b| *b == b'\n' || *b == b'\r').enumerate() {
        let place = || format!("line {}", i + 1);
        let mut words = line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
        while let Some(word) = words.next() {
            match word.to_ascii_lowercase().as_slice() {
                // Names may be anything.
                b"solid" => {
                    ended = false;
                    break;
                }
                b"endsolid" => {
                    ended = true;
                    break;
                }
                b"facet" => corners.clear(),
                b"vertex" => {
                    let mut number = || {
                        let word = std::str::from_utf8(words.next()?).ok()?;
                        word.parse::<f64>().ok()
                    };
                    let corner = number().zip(number()).zip(number());
                    let ((x, y), z) =
                        corner.ok_or_else(|| MeshFault::wrong(place(), "a corner needs three numbers"))?;
                    if corners.len() == 3 {
                        return Err(MeshFault::wrong(place(), "a facet has more than three corners"));
                    }
                    corners.push(Point3::new(x, y, z));
                }
                b"endfacet" => {
                    let Ok(corners) = <[Point3; 3]>::try_from(corners.as_slice()) else {
                        return Err(MeshFault::wrong(place(), "a facet has fewer than three corners"));
                    };
                    out.add(corners, place)?;
                    triangles += 1;
                }
                // Normals follow from the corners.
                b"normal" => drop(words.by_ref().take(3).count()),
                b"outer" | b"loop" | b"endloop" => {}
                other => {
                    let word = String::from_utf8_lossy(&other[..other.len().min(20)]).into_owned();
                    return Err(MeshFault::wrong(place(), format!("`{word}` is no word of an STL file")));
                }
            }
        }
    }
    if !ended {
        return Err(MeshFault::Truncated(format!("`endsolid` is missing behind {triangles} triangles")));
    }
    Ok(Vec::new())
}
