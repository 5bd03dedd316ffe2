//! Paths in job files: as they are, or, where they are no UTF-8, behind `bytes:` with their odd bytes as `%XX`.

use std::path::{Path, PathBuf};

use claymill_toolpath::{path_from_text, path_to_text};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

const BYTES: &str = "bytes:";

fn text(path: &Path) -> String {
    match path.to_str() {
        Some(text) if !text.starts_with(BYTES) => text.to_owned(),
        _ => format!("{BYTES}{}", path_to_text(path)),
    }
}

fn path(text: &str) -> PathBuf {
    text.strip_prefix(BYTES).map_or_else(|| text.into(), path_from_text)
}

/// For `Vec<PathBuf>`.
pub(super) mod many {
    use super::*;

    pub(crate) fn serialize<S: Serializer>(paths: &[PathBuf], to: S) -> Result<S::Ok, S::Error> {
        paths.iter().map(|p| text(p)).collect::<Vec<_>>().serialize(to)
    }

    pub(crate) fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<Vec<PathBuf>, D::Error> {
        Ok(Vec::<String>::deserialize(from)?.iter().map(|t| path(t)).collect())
    }
}

/// For `Option<PathBuf>`.
pub(super) mod maybe {
    use super::*;

    pub(crate) fn serialize<S: Serializer>(path: &Option<PathBuf>, to: S) -> Result<S::Ok, S::Error> {
        path.as_deref().map(text).serialize(to)
    }

    pub(crate) fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<Option<PathBuf>, D::Error> {
        Ok(Option::<String>::deserialize(from)?.as_deref().map(path))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_path_comes_back() {
        for plain in ["mill.toml", "a b/50%.stl", "bytes:x"] {
            assert_eq!(path(&text(Path::new(plain))), Path::new(plain));
        }
        assert_eq!(text(Path::new("50%.stl")), "50%.stl");
        #[cfg(unix)]
        {
            use std::os::unix::ffi::OsStrExt;
            let odd = Path::new(std::ffi::OsStr::from_bytes(b"m\xff%.stl"));
            assert_eq!((text(odd).as_str(), path(&text(odd)).as_path()), ("bytes:m%FF%25.stl", odd));
        }
    }
}
