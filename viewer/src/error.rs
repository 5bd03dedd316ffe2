//! Why a picture could not be made, and the writing of files whole or not at all.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// What pictures are drawn with on this system.
#[cfg(all(unix, not(target_vendor = "apple")))]
const NEEDED: &str = "a Vulkan driver. Without a graphics card install the software driver: \
                      apt-get install mesa-vulkan-drivers libvulkan1";
#[cfg(windows)]
const NEEDED: &str = "a driver for Direct3D 12";
#[cfg(target_vendor = "apple")]
const NEEDED: &str = "a graphics card with Metal";

/// Why a picture could not be made.
#[derive(Debug, Error)]
pub enum ViewError {
    /// Neither a graphics card nor a software driver answers.
    #[error("no graphics adapter was found ({reason}); pictures need {NEEDED}")]
    NoAdapter {
        /// What the graphics library said.
        reason: String,
    },
    /// The adapter was found but does not do its work.
    #[error("the graphics adapter {adapter} failed: {reason}")]
    Device {
        /// Its name.
        adapter: String,
        /// What the graphics library said.
        reason: String,
    },
    /// The picture's size is zero or more than the adapter can hold.
    #[error("a picture of {width} x {height} pixels cannot be made; each side must be 1 to {largest} pixels")]
    Size {
        /// Width asked for, pixels.
        width: u32,
        /// Height asked for, pixels.
        height: u32,
        /// Longest side that works, pixels.
        largest: u32,
    },
    /// The scene holds neither a surface nor a line.
    #[error("there is nothing to draw: the scene holds no surface and no line")]
    EmptyScene,
    /// The caller's description of the model does not fit the model.
    #[error("{what}: {given} given for {faces} faces")]
    Mismatch {
        /// Which list is of the wrong length.
        what: &'static str,
        /// Its length.
        given: usize,
        /// Faces of the model.
        faces: usize,
    },
    /// A file could not be written.
    #[error("{}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
}

/// Writes a file whole or not at all.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), ViewError> {
    claymill_toolpath::write_whole(path, bytes)
        .map_err(|source| ViewError::Write { path: path.to_owned(), source })
}
