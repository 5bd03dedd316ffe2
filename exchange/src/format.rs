//! Recognises IGES, STEP and 3dm by content, never by file name, and names what other files look
//! like.

use serde::{Deserialize, Serialize};

use crate::{MeshFormat, threedm};

/// A model file format that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Format {
    /// IGES 5.x in fixed or compressed ASCII.
    Iges,
    /// STEP Part 21: AP203, AP214, AP242.
    Step,
    /// Rhino 3dm (openNURBS archive), versions 2 to 8.
    Rhino3dm,
}

/// Beginnings of files that people hand over by mistake, and what they are.
const KNOWN_STRANGERS: [(&[u8], &str); 6] = [
    (b"PK\x03\x04", "a zip archive"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"ISO-10303-28", "STEP in XML"),
    (b"%PDF", "a PDF document"),
    (b"<", "an XML or HTML text"),
    (b"{", "a JSON text"),
];

impl Format {
    /// Recognises the format by content.
    ///
    /// # Errors
    /// The bytes are of no model format: what they look like instead, in words (`a zip archive`).
    pub fn of(bytes: &[u8]) -> Result<Format, String> {
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let text = text.trim_ascii_start();
        if text.starts_with(b"ISO-10303-21") {
            return Ok(Format::Step);
        }
        if bytes.starts_with(threedm::MAGIC) {
            return Ok(Format::Rhino3dm);
        }
        if is_iges(bytes) {
            return Ok(Format::Iges);
        }
        if let Some(mesh) = MeshFormat::of(bytes) {
            return Err(mesh.words().into());
        }
        if let Some((_, name)) = KNOWN_STRANGERS.iter().find(|(magic, _)| text.starts_with(magic)) {
            return Err((*name).into());
        }
        // Part 21 allows comments before the header.
        if text.starts_with(b"/*") && memchr::memmem::find(text, b"ISO-10303-21").is_some() {
            return Ok(Format::Step);
        }
        let head = &bytes[..bytes.len().min(4096)];
        let text_like = head.iter().all(|b| *b >= 32 || b.is_ascii_whitespace());
        Err(if text_like { "some other text" } else { "binary data" }.into())
    }
}

/// IGES lines carry a section letter in column 73. One of the first lines must be of the start or global
/// section: some senders put foreign lines in front, or drop the start section.
fn is_iges(bytes: &[u8]) -> bool {
    let lines = bytes.split(|b| *b == b'\n' || *b == b'\r');
    lines.filter(|l| !l.is_empty()).take(5).any(|l| {
        matches!(l.get(72), Some(b'S' | b'G' | b'C'))
            && l[73..].iter().any(u8::is_ascii_digit)
            && l[73..].iter().all(|b| b.is_ascii_digit() || *b == b' ')
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_decides() {
        let start = format!("{:<72}S{:>7}\r\n", "a start line", 1);
        assert_eq!(Format::of(start.as_bytes()), Ok(Format::Iges));
        assert_eq!(Format::of(b"\xef\xbb\xbf ISO-10303-21;\nHEADER;"), Ok(Format::Step));
        assert_eq!(Format::of(b"/* made by */ ISO-10303-21;"), Ok(Format::Step));
        assert_eq!(Format::of(b"3D Geometry File Format        4\x01"), Ok(Format::Rhino3dm));
        assert_eq!(Format::of(b"hello, this is a text"), Err("some other text".into()));
        assert_eq!(Format::of(b"solid cube\nfacet normal"), Err("an STL mesh".into()));
        assert_eq!(Format::of(&[0, 1, 2, 250]), Err("binary data".into()));
    }
}
