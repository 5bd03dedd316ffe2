//! Files of a finished job folder made anew, put in place one by one, with the list of hashes last.

use std::fs;
use std::path::{Path, PathBuf};

use crate::folder::io_error;
use crate::manifest;
use crate::place::whole;
use crate::scratch::Scratch;
use crate::{FolderError, VERIFY_FILE};

/// Some files of a finished folder, made anew: written beside it and put in place one by one.
#[derive(Debug)]
pub struct Renewal {
    folder: PathBuf,
    scratch: Scratch,
}

/// What is computed from the other files, and nobody's work: stale or copied, it is made anew.
const COMPUTED: [&str; 2] = [VERIFY_FILE, "crests.bin"];

impl Renewal {
    /// Starts to make the files `names` of `folder` anew.
    ///
    /// # Errors
    /// Another process writes there, or one of the files is not claymill's or was changed since.
    pub fn begin(folder: &Path, names: &[&str]) -> Result<Self, FolderError> {
        let folder = whole(folder);
        let scratch = Scratch::beside(&folder)?;
        manifest::may_renew(&folder, names, &COMPUTED)?;
        Ok(Renewal { folder, scratch })
    }

    /// Where the files are written first.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.scratch.folder
    }

    /// What must be removed when the process is interrupted.
    #[must_use]
    pub fn leftovers(&self) -> Vec<PathBuf> {
        self.scratch.leftovers()
    }

    /// Puts what was written in place, and lists it.
    ///
    /// # Errors
    /// A file cannot be renamed.
    pub fn finish(self) -> Result<(), FolderError> {
        let here = &self.scratch.folder;
        let mut names = Vec::new();
        for entry in fs::read_dir(here).map_err(io_error(here))? {
            let name = entry.map_err(io_error(here))?.file_name();
            names.extend(name.to_str().map(str::to_owned));
        }
        names.sort();
        for name in &names {
            let to = self.folder.join(name);
            fs::rename(here.join(name), &to).map_err(io_error(&to))?;
        }
        manifest::update(&self.folder, &self.folder, names.into_iter())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FolderWriter, MANIFEST_FILE, is_whole};

    #[test]
    fn only_what_was_written_here_is_made_anew() {
        let place = tempfile::tempdir().unwrap();
        let out = place.path().join("out");
        let writer = FolderWriter::begin(&out).unwrap();
        writer.text("job.json", "{}").unwrap();
        writer.text("report.html", "1").unwrap();
        writer.finish().unwrap();
        let renew = |text: &str| {
            let renewal = Renewal::begin(&out, &["report.html", VERIFY_FILE])?;
            fs::write(renewal.path().join("report.html"), text).unwrap();
            fs::write(renewal.path().join(VERIFY_FILE), text).unwrap();
            renewal.finish()
        };
        renew("2").unwrap();
        assert_eq!(fs::read_to_string(out.join("report.html")).unwrap(), "2");
        // It is whole, whatever lies beside what was written, until something of that is changed or gone.
        fs::write(out.join("notes"), "mine").unwrap();
        assert!(is_whole(&out) && !is_whole(place.path()));
        fs::write(out.join("job.json"), "{ }").unwrap();
        assert!(!is_whole(&out));
        fs::remove_file(out.join("job.json")).unwrap();
        assert!(!is_whole(&out));
        fs::write(out.join("job.json"), "{}").unwrap();
        fs::remove_file(out.join("notes")).unwrap();
        assert!(is_whole(&out));
        // It is ours still: the folder can be replaced.
        drop(FolderWriter::begin(&out).unwrap());
        // A verdict from elsewhere is computed again; a report that somebody wrote in stays.
        fs::write(out.join(VERIFY_FILE), "of another job").unwrap();
        renew("3").unwrap();
        fs::write(out.join("report.html"), "with my notes").unwrap();
        let refused = renew("4");
        assert!(matches!(refused, Err(FolderError::NotOurs { .. })), "{refused:?}");
        assert_eq!(fs::read_to_string(out.join("report.html")).unwrap(), "with my notes");
        // A job of a version that kept no list is as it was left.
        fs::remove_file(out.join(MANIFEST_FILE)).unwrap();
        renew("5").unwrap();
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 1);
    }
}
