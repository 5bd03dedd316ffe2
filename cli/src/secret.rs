//! The shared secret of connections, read from a file (`--secret`) that only its owner may read.

use std::io;
use std::path::Path;

use claymill_toolpath::{LONGEST_WRITTEN, read_plain};

use crate::failure::Failure;

/// Fewer bytes are no secret.
const SHORTEST: usize = 16;

/// How a secret is made, into this file.
#[cfg(unix)]
fn how_to_make(file: &str) -> String {
    format!("`umask 077; head -c 32 /dev/urandom > {file}`")
}

/// How a secret is made, into this file.
#[cfg(not(unix))]
fn how_to_make(file: &str) -> String {
    format!("32 random bytes in {file}, in a folder that only your account may open")
}

/// The shared secret of a file that nobody else may read or change.
pub(crate) fn secret(path: Option<&Path>) -> Result<Vec<u8>, Failure> {
    let path = path.ok_or_else(|| {
        Failure::usage(
            "a connection needs a shared secret",
            "Name a file with at least 16 bytes: --secret FILE.",
        )
    })?;
    let bytes = read_plain(path, LONGEST_WRITTEN).map_err(Failure::at(path))?;
    if let Some(mode) = open_to_others(path).map_err(Failure::at(path))? {
        return Err(Failure::usage(
            format!("{}: others than its owner may read or write it (mode {mode:04o})", path.display()),
            format!(
                "What others know is no secret, and moves a machine: make a new one with {}, on both sides.",
                how_to_make(&path.display().to_string())
            ),
        ));
    }
    if bytes.len() < SHORTEST {
        let advice = format!("Make one with {}.", how_to_make("secret"));
        return Err(Failure::usage(format!("{}: fewer than 16 bytes are no secret", path.display()), advice));
    }
    Ok(bytes)
}

/// The mode of a file that others than its owner may read or write.
#[cfg(unix)]
fn open_to_others(path: &Path) -> io::Result<Option<u32>> {
    use std::os::unix::fs::PermissionsExt;
    /// Read and write, of the group and of all others.
    const OTHERS: u32 = 0o066;
    let mode = std::fs::metadata(path)?.permissions().mode() & 0o7777;
    Ok((mode & OTHERS != 0).then_some(mode))
}

/// Access control lists are not looked at: a secret is as private as its folder.
#[cfg(not(unix))]
fn open_to_others(_: &Path) -> io::Result<Option<u32>> {
    Ok(None)
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    #[test]
    fn only_its_owner_may_know_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("secret");
        std::fs::write(&path, "sixteen bytes or more").unwrap();
        for (mode, taken) in [
            (0o600, true),
            (0o400, true),
            (0o700, true),
            (0o640, false),
            (0o604, false),
            (0o620, false),
            (0o666, false),
        ] {
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
            let read = secret(Some(&path));
            assert_eq!(read.is_ok(), taken, "{mode:o}");
            if let Err(failure) = read {
                assert!(failure.to_string().contains(&format!("mode {mode:04o}")), "{failure}");
            }
        }
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).unwrap();
        std::fs::write(&path, "short").unwrap();
        assert!(secret(Some(&path)).is_err());
        assert!(secret(Some(Path::new("/dev/zero"))).is_err() && secret(None).is_err());
    }
}
