use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// What is read at once: a process that is told to end cannot before the system has handed all of it over.
const PIECE_BYTES: u64 = 1 << 20;
/// Model files are told by so many bytes.
const HEAD_BYTES: u64 = 1 << 16;

/// A whole file, piece by piece.
pub(crate) fn contents(path: &Path) -> io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    let mut bytes = Vec::new();
    let expected = usize::try_from(file.metadata()?.len()).unwrap_or(usize::MAX);
    bytes.try_reserve_exact(expected)?;
    while file.by_ref().take(PIECE_BYTES).read_to_end(&mut bytes)? > 0 {}
    Ok(bytes)
}

/// The beginning of a file.
pub(crate) fn head(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(HEAD_BYTES).read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_make_the_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        for len in [0, 1, HEAD_BYTES + 1, PIECE_BYTES, 2 * PIECE_BYTES + 7] {
            let bytes: Vec<u8> = (0..len).map(|i| ((i * i) >> 3) as u8).collect();
            std::fs::write(&path, &bytes).unwrap();
            assert!(contents(&path).unwrap() == bytes);
            assert!(head(&path).unwrap() == bytes[..len.min(HEAD_BYTES) as usize]);
        }
        assert!(contents(&folder.path().join("none")).is_err());
    }
}
