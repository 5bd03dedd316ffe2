//! Wavefront OBJ: polygons over a list of corners. It does not say what a length is.

use claymill_nurbs::Point3;

use super::error::MeshFault;
use super::polygon;
use super::weld::Welder;

/// Lines that are looked at to recognise the format.
const HEAD_LINES: usize = 400;
/// First words of the lines of an OBJ file that say something about a mesh.
const KEYWORDS: [&[u8]; 14] =
    [b"v", b"vt", b"vn", b"vp", b"f", b"l", b"p", b"g", b"o", b"s", b"mtllib", b"usemtl", b"mg", b"usemap"];
/// First words of free-form geometry.
const FREE_FORM: [&[u8]; 6] = [b"cstype", b"deg", b"curv", b"curv2", b"surf", b"bmat"];

/// Every line begins with a keyword, and corners come before anything that uses them.
pub(super) fn is_obj(bytes: &[u8]) -> bool {
    let (mut corners, mut goes_on) = (0, false);
    for line in lines(bytes).take(HEAD_LINES) {
        if std::mem::replace(&mut goes_on, line.ends_with(b"\\")) {
            continue;
        }
        let mut words = line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
        let Some(first) = words.next().filter(|w| !w.starts_with(b"#")) else { continue };
        if !KEYWORDS.contains(&first) && !FREE_FORM.contains(&first) {
            return false;
        }
        corners += usize::from(first == b"v" && words.next().is_some_and(|w| number(w).is_some()));
    }
    corners > 0
}

/// Lines without their ends.
fn lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    bytes.split(|b| *b == b'\n').map(|l| l.strip_suffix(b"\r").unwrap_or(l))
}

fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Reads an OBJ file.
pub(super) fn read(bytes: &[u8], out: &mut Welder) -> Result<Vec<String>, MeshFault> {
    let mut corners: Vec<Point3> = Vec::new();
    let mut free_form = false;
    let mut continued: Vec<u8> = Vec::new();
    for (i, line) in lines(bytes).enumerate() {
        // A backslash at the end joins lines.
        let line = if let Some(part) = line.strip_suffix(b"\\") {
            continued.extend(part);
            continued.push(b' ');
            continue;
        } else if continued.is_empty() {
            line
        } else {
            continued.extend(line);
            &continued
        };
        let place = || format!("line {}", i + 1);
        let mut words = line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
        match words.next() {
            Some(b"v") => {
                let mut coordinate = || number(words.next()?);
                let p = coordinate().zip(coordinate()).zip(coordinate());
                let ((x, y), z) =
                    p.ok_or_else(|| MeshFault::wrong(place(), "a corner needs three numbers"))?;
                corners.push(Point3::new(x, y, z));
            }
            Some(b"f" | b"fo") => {
                let ring: Option<Vec<Point3>> = words.map(|w| corner(w, &corners)).collect();
                let ring =
                    ring.ok_or_else(|| MeshFault::wrong(place(), "a polygon uses a missing corner"))?;
                if ring.len() < 3 {
                    return Err(MeshFault::wrong(place(), "a polygon has fewer than three corners"));
                }
                for t in polygon::triangles(&ring).map_err(|what| MeshFault::wrong(place(), what))? {
                    out.add(t, place)?;
                }
            }
            Some(word) => free_form |= FREE_FORM.contains(&word),
            None => {}
        }
        continued.clear();
    }
    let told = "The file holds free-form curves or surfaces, which are not read: only its polygons are.";
    Ok(if free_form { vec![told.into()] } else { Vec::new() })
}

/// The corner that `7`, `7/1/2` or `-1` stands for: counted from one, or backwards from the latest.
fn corner(word: &[u8], corners: &[Point3]) -> Option<Point3> {
    let index = word.split(|b| *b == b'/').next()?;
    let index: i64 = std::str::from_utf8(index).ok()?.parse().ok()?;
    let count = i64::try_from(corners.len()).ok()?;
    let from_zero = if index < 0 { count.checked_add(index)? } else { index - 1 };
    corners.get(usize::try_from(from_zero).ok()?).copied()
}
