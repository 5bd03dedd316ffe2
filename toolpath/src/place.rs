//! Where a file is that a job names: found again from the job folder, or from anywhere.

use std::ffi::OsString;
use std::path::{Component, Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::sha256_of;

/// A file's path in two forms. Bytes that are no UTF-8 are written `%XX`, and so is the percent sign (`%25`).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct FilePlace {
    /// From the job folder; the whole path where no way leads there.
    pub relative: String,
    /// From the root.
    pub absolute: String,
}

impl FilePlace {
    /// Of a file that is there, as seen from a folder that may not be there yet.
    #[must_use]
    pub fn of(file: &Path, folder: &Path) -> Self {
        let (file, folder) = (whole(file), whole(folder));
        FilePlace { relative: path_to_text(&way(&folder, &file)), absolute: path_to_text(&file) }
    }
}

/// The file that a job folder names. What lies at its place relative to the folder is it, changed or not. Where nothing does: at
/// its whole path, as it was given, or beside the folder; the first with the right bytes, else the first that is there, else as it
/// was given.
#[must_use]
pub fn find_file(folder: &Path, given: &str, place: Option<&FilePlace>, sha256: &str) -> PathBuf {
    if let Some(path) = place.map(|p| folder.join(path_from_text(&p.relative))).filter(|p| p.is_file()) {
        return path;
    }
    let given = PathBuf::from(given);
    let absolute = place.map(|p| path_from_text(&p.absolute));
    let name = absolute.clone().unwrap_or_else(|| given.clone());
    let beside = name.file_name().map(|name| folder.join("..").join(name));
    let all = absolute.into_iter().chain([given.clone()]).chain(beside);
    let there: Vec<PathBuf> = all.filter(|path| path.is_file()).collect();
    let right = |path: &&PathBuf| sha256_of(path).is_ok_and(|found| found == sha256);
    match &there[..] {
        // One candidate is looked at by whoever asked.
        [] => given,
        [only] => only.clone(),
        several => several.iter().find(right).unwrap_or(&several[0]).clone(),
    }
}

/// A path from the root without links, as far as it is there.
pub(crate) fn whole(path: &Path) -> PathBuf {
    if let Ok(found) = path.canonicalize() {
        return found;
    }
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    match (absolute.parent(), absolute.file_name()) {
        (Some(parent), Some(name)) => whole(parent).join(name),
        _ => absolute,
    }
}

/// How to get from one folder to a file; both from the root.
fn way(from: &Path, to: &Path) -> PathBuf {
    let (from, to): (Vec<Component>, Vec<Component>) =
        (from.components().collect(), to.components().collect());
    let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    if common == 0 {
        return to.iter().collect();
    }
    let up = from[common..].iter().map(|_| Component::ParentDir);
    up.chain(to[common..].iter().copied()).collect()
}

/// A path as text: bytes that are no UTF-8 as `%XX`, and so is the percent sign.
#[must_use]
pub fn path_to_text(path: &Path) -> String {
    let mut text = String::new();
    for chunk in path.as_os_str().as_encoded_bytes().utf8_chunks() {
        text.push_str(&chunk.valid().replace('%', "%25"));
        chunk.invalid().iter().for_each(|byte| text.push_str(&format!("%{byte:02X}")));
    }
    text
}

#[cfg(unix)]
fn from_bytes(bytes: Vec<u8>) -> OsString {
    std::os::unix::ffi::OsStringExt::from_vec(bytes)
}

#[cfg(not(unix))]
fn from_bytes(bytes: Vec<u8>) -> OsString {
    String::from_utf8_lossy(&bytes).into_owned().into()
}

/// The path that [`path_to_text`] wrote.
#[must_use]
pub fn path_from_text(text: &str) -> PathBuf {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&first, behind)) = rest.split_first() {
        let digits = (first == b'%').then(|| behind.get(..2)).flatten();
        let digits = digits.and_then(|d| std::str::from_utf8(d).ok());
        match digits.and_then(|d| u8::from_str_radix(d, 16).ok()) {
            Some(byte) => {
                bytes.push(byte);
                rest = &behind[2..];
            }
            None => {
                bytes.push(first);
                rest = behind;
            }
        }
    }
    from_bytes(bytes).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_of_any_bytes_survive_being_written() {
        for bytes in [&b"/a/b c.igs"[..], b"100%", b"%41", b"m\xff\xfe%25.igs", "käfer.igs".as_bytes()] {
            let path = PathBuf::from(from_bytes(bytes.to_vec()));
            assert_eq!(path_from_text(&path_to_text(&path)), path);
        }
        assert_eq!(path_to_text(Path::new("käfer 1.igs")), "käfer 1.igs");
        assert_eq!(path_from_text("50%"), Path::new("50%"));
    }

    #[test]
    fn a_file_is_found_again_whoever_moved() {
        let place = tempfile::tempdir().unwrap();
        let root = place.path();
        let (models, jobs) = (root.join("models"), root.join("work/jobs"));
        std::fs::create_dir_all(&models).unwrap();
        std::fs::create_dir_all(&jobs).unwrap();
        let (model, folder) = (models.join("m.igs"), jobs.join("out"));
        std::fs::write(&model, "model").unwrap();
        let sha256 = sha256_of(&model).unwrap();
        let known = FilePlace::of(&model, &folder);
        assert_eq!(known.relative, "../../../models/m.igs");
        std::fs::create_dir(&folder).unwrap();
        let find = |folder: &Path| find_file(folder, "m.igs", Some(&known), &sha256);
        assert_eq!(find(&folder).canonicalize().unwrap(), model.canonicalize().unwrap());
        // The folder went elsewhere; then both did, together; then the model lies beside the folder.
        std::fs::rename(&folder, root.join("out")).unwrap();
        assert_eq!(find(&root.join("out")), model.canonicalize().unwrap());
        let moved = root.join("moved");
        std::fs::create_dir_all(moved.join("work/jobs")).unwrap();
        std::fs::rename(root.join("out"), moved.join("work/jobs/out")).unwrap();
        std::fs::rename(&models, moved.join("models")).unwrap();
        let found = find(&moved.join("work/jobs/out"));
        assert_eq!(found.canonicalize().unwrap(), moved.join("models/m.igs").canonicalize().unwrap());
        std::fs::rename(moved.join("models/m.igs"), moved.join("work/jobs/m.igs")).unwrap();
        let found = find(&moved.join("work/jobs/out"));
        assert_eq!(found.canonicalize().unwrap(), moved.join("work/jobs/m.igs").canonicalize().unwrap());
        // Of two the right one; what lies where the job and it always lay is it, whatever it has become.
        std::fs::create_dir_all(&models).unwrap();
        std::fs::write(&model, "another").unwrap();
        let found = find(&moved.join("work/jobs/out"));
        assert_eq!(found.canonicalize().unwrap(), moved.join("work/jobs/m.igs").canonicalize().unwrap());
        std::fs::create_dir_all(moved.join("models")).unwrap();
        std::fs::write(moved.join("models/m.igs"), "edited").unwrap();
        let found = find(&moved.join("work/jobs/out"));
        assert_eq!(found.canonicalize().unwrap(), moved.join("models/m.igs").canonicalize().unwrap());
    }
}
