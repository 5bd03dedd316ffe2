use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};
use thiserror::Error;

use crate::largest::Largest;
use crate::plain_file::{LONGEST_MADE, open_plain, read_plain};
use crate::plausible::{check_move, implausible, impossible_region};
use crate::{Job, Move, Program, RegionsFile};

/// Name of the job record.
pub const JOB_FILE: &str = "job.json";
/// Name of the regions' file.
pub const REGIONS_FILE: &str = "regions.json";
/// Name of the moves' file.
pub const TOOLPATHS_FILE: &str = "toolpaths.jsonl";
/// Name of the verification's result.
pub const VERIFY_FILE: &str = "verify.json";
/// Name of the report.
pub const REPORT_FILE: &str = "report.html";

/// Why a job folder could not be read or written.
#[derive(Debug, Error)]
pub enum FolderError {
    /// Reading or writing failed.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// A file does not have the documented form.
    #[error("{} line {line}: {message}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// A value is one that no job has.
    #[error("{}: {what}", path.display())]
    Implausible {
        /// The file.
        path: PathBuf,
        /// Which value, and what it may be.
        what: String,
    },
    /// The destination exists and is not a job folder: it is left alone.
    #[error("{} exists and is not a claymill job folder", .0.display())]
    NotAJobFolder(PathBuf),
}

fn io_error(path: &Path) -> impl FnOnce(io::Error) -> FolderError + '_ {
    |source| FolderError::Io { path: path.to_owned(), source }
}

/// Writes a job folder beside its destination and moves it into place when it is whole.
///
/// Dropping the writer without [`FolderWriter::finish`] removes everything that was written.
#[derive(Debug)]
pub struct FolderWriter {
    partial: PathBuf,
    destination: PathBuf,
    /// Folders above it that had to be made, innermost first.
    made: Vec<PathBuf>,
    finished: bool,
}

impl FolderWriter {
    /// Starts a folder that will become `destination`.
    ///
    /// # Errors
    /// The destination's parent cannot be written, or the destination exists and holds something else than
    /// a job (an empty folder is fine).
    pub fn begin(destination: &Path) -> Result<Self, FolderError> {
        Self::begin_replacing(destination, JOB_FILE)
    }

    /// As [`FolderWriter::begin`], for a folder that may be replaced when it holds the file `mark`.
    ///
    /// # Errors
    /// As [`FolderWriter::begin`].
    pub fn begin_replacing(destination: &Path, mark: &str) -> Result<Self, FolderError> {
        if destination.exists() {
            let mut entries = fs::read_dir(destination).map_err(io_error(destination))?;
            if entries.next().is_some() && !destination.join(mark).exists() {
                return Err(FolderError::NotAJobFolder(destination.to_owned()));
            }
        }
        let name = destination.file_name().map_or_else(|| "job".into(), |n| n.to_string_lossy().into_owned());
        let parent = match destination.parent() {
            Some(p) if !p.as_os_str().is_empty() => p.to_owned(),
            _ => PathBuf::from("."),
        };
        let partial = parent.join(format!(".{name}.{}.partial", std::process::id()));
        let missing = parent.ancestors().take_while(|p| !p.as_os_str().is_empty() && !p.exists());
        let made = missing.map(Path::to_owned).collect();
        let writer = FolderWriter { partial, destination: destination.to_owned(), made, finished: false };
        fs::create_dir_all(&parent).map_err(io_error(&parent))?;
        let partial = writer.path();
        if partial.exists() {
            fs::remove_dir_all(partial).map_err(io_error(partial))?;
        }
        fs::create_dir(partial).map_err(io_error(partial))?;
        Ok(writer)
    }

    /// Where the files are until the folder is whole.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.partial
    }

    /// Writes `value` as indented JSON.
    ///
    /// # Errors
    /// Writing fails.
    pub fn json(&self, name: &str, value: &impl Serialize) -> Result<(), FolderError> {
        let path = self.partial.join(name);
        let mut text = serde_json::to_vec_pretty(value).map_err(|e| FolderError::Format {
            path: path.clone(),
            line: 0,
            message: e.to_string(),
        })?;
        text.push(b'\n');
        fs::write(&path, text).map_err(io_error(&path))
    }

    /// Writes plain text.
    ///
    /// # Errors
    /// Writing fails.
    pub fn text(&self, name: &str, text: &str) -> Result<(), FolderError> {
        let path = self.partial.join(name);
        fs::write(&path, text).map_err(io_error(&path))
    }

    /// Writes the moves, one a line.
    ///
    /// # Errors
    /// Writing fails.
    pub fn moves(&self, program: &Program) -> Result<(), FolderError> {
        let path = self.partial.join(TOOLPATHS_FILE);
        let mut out = BufWriter::new(File::create(&path).map_err(io_error(&path))?);
        for m in &program.moves {
            serde_json::to_writer(&mut out, m)
                .map_err(|e| FolderError::Io { path: path.clone(), source: e.into() })?;
            out.write_all(b"\n").map_err(io_error(&path))?;
        }
        out.flush().map_err(io_error(&path))
    }

    /// Moves the folder into place; an earlier job there is replaced.
    ///
    /// # Errors
    /// Renaming fails.
    pub fn finish(mut self) -> Result<(), FolderError> {
        let replaced = self.destination.exists();
        let mut old = self.partial.clone();
        if replaced && exchange(&self.partial, &self.destination).is_err() {
            // Where folders cannot change places there is a moment with neither.
            old.set_extension("old");
            fs::rename(&self.destination, &old).map_err(io_error(&self.destination))?;
            fs::rename(&self.partial, &self.destination).map_err(|source| {
                // The earlier job comes back; the first error is the one worth telling.
                let _ = fs::rename(&old, &self.destination);
                io_error(&self.destination)(source)
            })?;
        } else if !replaced {
            fs::rename(&self.partial, &self.destination).map_err(io_error(&self.destination))?;
        }
        self.finished = true;
        if replaced {
            fs::remove_dir_all(&old).map_err(io_error(&old))?;
        }
        Ok(())
    }
}

/// Lets two folders change places at once: whoever looks sees the one or the other, whole.
#[cfg(target_os = "linux")]
fn exchange(a: &Path, b: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE)?)
}

#[cfg(not(target_os = "linux"))]
fn exchange(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

impl Drop for FolderWriter {
    fn drop(&mut self) {
        if !self.finished {
            // Best effort: there is nobody left to tell.
            let _ = fs::remove_dir_all(&self.partial);
            for folder in &self.made {
                let _ = fs::remove_dir(folder);
            }
        }
    }
}

/// JSON files of a job are no longer than this, bytes.
const LONGEST_JSON: u64 = 1 << 30;
/// Neither are lines of moves.
const LONGEST_LINE: u64 = 256 << 20;
/// No number of a job, and no area in mm², is larger.
const LARGEST_NUMBER: f64 = 1e15;

fn format_error(path: &Path, e: &serde_json::Error) -> FolderError {
    FolderError::Format { path: path.to_owned(), line: e.line(), message: e.to_string() }
}

fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T, FolderError> {
    let text = read_plain(path, LONGEST_JSON).map_err(io_error(path))?;
    let value = serde_json::from_slice(&text).map_err(|e| format_error(path, &e))?;
    let Largest(largest) = serde_json::from_slice(&text).map_err(|e| format_error(path, &e))?;
    if largest > LARGEST_NUMBER {
        let what = format!("it holds the number {largest:e}, which nothing of a job is");
        return Err(FolderError::Implausible { path: path.to_owned(), what });
    }
    Ok(value)
}

/// Reads `job.json` of a job folder.
///
/// # Errors
/// The file is missing, not of the documented form, or has values that no job has.
pub fn read_job(folder: &Path) -> Result<Job, FolderError> {
    let path = folder.join(JOB_FILE);
    let job = read_json(&path)?;
    match implausible(&job) {
        Some(what) => Err(FolderError::Implausible { path, what }),
        None => Ok(job),
    }
}

/// Reads `regions.json` of a job folder.
///
/// # Errors
/// The file is missing, not of the documented form, or numbers its regions as none does.
pub fn read_regions(folder: &Path) -> Result<RegionsFile, FolderError> {
    let path = folder.join(REGIONS_FILE);
    let regions = read_json(&path)?;
    match impossible_region(&regions) {
        Some(what) => Err(FolderError::Implausible { path, what }),
        None => Ok(regions),
    }
}

/// Reads `toolpaths.jsonl` of a job folder.
///
/// # Errors
/// The file is missing, or a line is not a move that a machine could make.
pub fn read_moves(folder: &Path) -> Result<Program, FolderError> {
    let path = folder.join(TOOLPATHS_FILE);
    let mut file = BufReader::new(open_plain(&path, LONGEST_MADE).map_err(io_error(&path))?);
    let mut moves = Vec::new();
    let mut text = Vec::new();
    for line in 1.. {
        text.clear();
        let length =
            file.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut text).map_err(io_error(&path))?;
        if length == 0 {
            break;
        }
        let wrong = |message: String| FolderError::Format { path: path.clone(), line, message };
        if length as u64 == LONGEST_LINE {
            return Err(wrong("the line has no end".into()));
        }
        if text.trim_ascii().is_empty() {
            continue;
        }
        let parsed: Move = serde_json::from_slice(&text).map_err(|e| wrong(e.to_string()))?;
        check_move(&parsed).map_err(|e| wrong(e.to_string()))?;
        moves.push(parsed);
    }
    Ok(Program { moves })
}

/// SHA-256 of a file, hexadecimal.
///
/// # Errors
/// The file cannot be read, or is a device or pipe.
pub fn sha256_of(path: &Path) -> Result<String, FolderError> {
    let mut file = open_plain(path, LONGEST_MADE).map_err(io_error(path))?;
    let mut hash = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        let count = file.read(&mut buffer).map_err(io_error(path))?;
        if count == 0 {
            break;
        }
        hash.update(&buffer[..count]);
    }
    Ok(hash.finalize().iter().map(|b| format!("{b:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    fn write(destination: &Path, number: u32) {
        let writer = FolderWriter::begin_replacing(destination, "number").unwrap();
        writer.text("number", &number.to_string()).unwrap();
        writer.text("again", &number.to_string()).unwrap();
        writer.finish().unwrap();
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_folder_is_there_at_every_moment_while_it_is_replaced() {
        let place = tempfile::tempdir().unwrap();
        let destination = place.path().join("out");
        write(&destination, 0);
        let done = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let watch = scope.spawn(|| {
                let mut looks = 0u64;
                while !done.load(Ordering::Relaxed) {
                    assert!(destination.exists());
                    looks += 1;
                }
                looks
            });
            (1..300).for_each(|number| write(&destination, number));
            done.store(true, Ordering::Relaxed);
            assert!(watch.join().unwrap() > 100);
        });
        assert_eq!(fs::read_to_string(destination.join("again")).unwrap(), "299");
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 1);
    }
}
