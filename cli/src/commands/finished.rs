//! A finished job, as its pictures and its report see it.

use std::path::Path;

use claymill_nurbs::Model;
use claymill_paths::{Orientation, times_s};
use claymill_toolpath::{Job, Move, Program, RegionsFile};
use claymill_verify::{CrestSample, Verification};
use rayon::prelude::*;

/// A job with all that its pictures and its report are made of.
#[derive(Clone, Copy)]
pub(crate) struct Finished<'a> {
    pub(crate) model: &'a Model,
    pub(crate) job: &'a Job,
    pub(crate) regions: &'a RegionsFile,
    pub(crate) region_of_face: &'a [usize],
    pub(crate) program: &'a Program,
    /// Of each move.
    pub(crate) seconds: &'a [f64],
    pub(crate) found: &'a Verification,
    pub(crate) crests: &'a [CrestSample],
    pub(crate) orientation: Orientation,
}

/// The model's file name.
pub(crate) fn title(job: &Job) -> String {
    let path = Path::new(&job.model.path);
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// Seconds of every move: every setup begins and ends at rest.
pub(crate) fn seconds(job: &Job, program: &Program) -> Vec<f64> {
    let setups: Vec<&[Move]> = program.moves.chunk_by(|a, b| a.setup == b.setup).collect();
    setups.par_iter().flat_map_iter(|moves| times_s(moves, &job.request.machine)).collect()
}

/// A word as a shell reads it back.
pub(crate) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_+=./:,@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_come_back_from_the_shell_as_they_were() {
        for word in ["car.igs", "my car's model.igs", "layer:a b", "", "$HOME;ls", "+z", "-y"] {
            let shell = std::process::Command::new("sh")
                .args(["-c", &format!("printf '%s' {}", quoted(word))])
                .output();
            let Ok(shell) = shell else {
                return claymill_tests::leave_out(claymill_tests::Need::UnixTools, "no sh");
            };
            assert_eq!(String::from_utf8_lossy(&shell.stdout), word);
        }
    }
}
