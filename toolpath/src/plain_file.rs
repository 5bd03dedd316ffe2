//! Reads regular files up to a stated size. Folders, pipes and devices are refused: they may never
//! end.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Files that a person writes, such as definitions of machines, are no longer than this, bytes.
pub const LONGEST_WRITTEN: u64 = 16 << 20;
/// Files that a program writes are no longer than this, bytes.
pub const LONGEST_MADE: u64 = 16 << 30;

/// Opens a file for reading that is one: folders, pipes and devices may never come to an end, and no file of its kind is
/// longer than `longest` bytes.
///
/// # Errors
/// What the operating system says, or that it is no such file.
pub fn open_plain(path: &Path, longest: u64) -> io::Result<File> {
    // Before it is opened: to open a pipe waits for whoever writes into it.
    plain(&std::fs::metadata(path)?, longest)?;
    let file = File::open(path)?;
    plain(&file.metadata()?, longest)?;
    Ok(file)
}

fn plain(facts: &std::fs::Metadata, longest: u64) -> io::Result<()> {
    if facts.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a directory, not a file"));
    }
    if !facts.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "it is a device or a pipe, not a file"));
    }
    if facts.len() > longest {
        let (long, longest) = (facts.len() >> 20, longest >> 20);
        let what = format!("it is {long} MB long, and no such file is longer than {longest} MB");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, what));
    }
    Ok(())
}

/// Reads such a file whole.
///
/// # Errors
/// As [`open_plain`].
pub fn read_plain(path: &Path, longest: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // One byte more tells a file that grew.
    open_plain(path, longest)?.take(longest + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > longest {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, "it grows while it is read"));
    }
    Ok(bytes)
}

/// Reads such a file as text.
///
/// # Errors
/// As [`open_plain`]; it is no UTF-8.
pub fn read_plain_text(path: &Path, longest: u64) -> io::Result<String> {
    let bytes = read_plain(path, longest)?;
    String::from_utf8(bytes)
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is not text in UTF-8"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_are_read_and_no_longer_ones() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("file");
        std::fs::write(&path, "grüße").unwrap();
        assert_eq!(read_plain_text(&path, 7).unwrap(), "grüße");
        assert_eq!(read_plain(&path, 6).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
        std::fs::write(&path, [0xff, 0x00]).unwrap();
        assert_eq!(read_plain_text(&path, 7).unwrap_err().kind(), io::ErrorKind::InvalidData);
        assert!(read_plain(place.path(), 7).unwrap_err().to_string().contains("directory"));
        assert_eq!(read_plain(&place.path().join("none"), 7).unwrap_err().kind(), io::ErrorKind::NotFound);
    }

    #[test]
    #[cfg(unix)]
    fn devices_and_pipes_do_not_hold_anyone_up() {
        assert!(read_plain(Path::new("/dev/zero"), 7).unwrap_err().to_string().contains("device"));
        let place = tempfile::tempdir().unwrap();
        let pipe = place.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        assert!(read_plain(&pipe, 7).unwrap_err().to_string().contains("pipe"));
    }
}
