//! Reads model files whole, or their first bytes, and refuses folders, pipes, devices and files
//! beyond 8 GiB.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// What is read at once: a process that is told to end cannot before the system has handed all of it over.
const PIECE_BYTES: u64 = 1 << 20;
/// Model files are told by so many bytes.
const HEAD_BYTES: u64 = 1 << 16;
/// No model file is longer, bytes.
const LONGEST_BYTES: u64 = 8 << 30;

/// Opens a file that is one: folders, pipes and devices may never come to an end.
fn open(path: &Path) -> io::Result<File> {
    // Before it is opened: to open a pipe waits for whoever writes into it.
    let facts = std::fs::metadata(path)?;
    let wrong = |kind, what: &str| Err(io::Error::new(kind, what.to_owned()));
    if facts.is_dir() {
        return wrong(io::ErrorKind::IsADirectory, "it is a directory, not a file");
    }
    if !facts.is_file() {
        return wrong(io::ErrorKind::InvalidInput, "it is a device or a pipe, not a file");
    }
    if facts.len() > LONGEST_BYTES {
        let what = format!("it is {} GB long, which no model is", facts.len() >> 30);
        return wrong(io::ErrorKind::FileTooLarge, &what);
    }
    File::open(path)
}

/// A whole file, piece by piece.
pub(crate) fn contents(path: &Path) -> io::Result<Vec<u8>> {
    // A file that grows while it is read is left where it was.
    let mut file = open(path)?.take(LONGEST_BYTES);
    let mut bytes = Vec::new();
    let expected = usize::try_from(file.get_ref().metadata()?.len()).unwrap_or(usize::MAX);
    bytes.try_reserve_exact(expected)?;
    while file.by_ref().take(PIECE_BYTES).read_to_end(&mut bytes)? > 0 {}
    Ok(bytes)
}

/// The beginning of a file.
pub(crate) fn head(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.take(HEAD_BYTES).read_to_end(&mut bytes)?;
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
        assert!(contents(folder.path()).unwrap_err().to_string().contains("directory"));
    }

    #[test]
    #[cfg(unix)]
    fn devices_and_files_without_end_are_refused() {
        for read in [contents, head] {
            assert!(read(Path::new("/dev/zero")).unwrap_err().to_string().contains("device"));
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("holes");
        File::create(&path).unwrap().set_len(1 << 40).unwrap();
        assert!(contents(&path).unwrap_err().to_string().contains("1024 GB long"));
    }
}
