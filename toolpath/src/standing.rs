//! What the verdict in a job folder is worth: whether it was passed on the very files that lie there now.

use std::fmt;
use std::fs;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::folder::{hex, read_moves_with_hash};
use crate::{FolderError, Job, Program, TOOLPATHS_FILE, VERIFY_FILE, read_job, sha256_of};

/// What a verdict was passed on, as SHA-256, hexadecimal.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Judged {
    /// Of the bytes of `toolpaths.jsonl`.
    pub toolpaths_sha256: String,
    /// Of what counts of `job.json`: all but timings, memory and the places of files.
    pub job_sha256: String,
    /// Of the model file.
    pub model_sha256: String,
}

impl Judged {
    /// The moves in `folder` and their job.
    ///
    /// # Errors
    /// The moves cannot be read.
    pub fn of(folder: &Path, job: &Job) -> Result<Self, FolderError> {
        Ok(Self::of_moves(sha256_of(&folder.join(TOOLPATHS_FILE))?, job))
    }

    fn of_moves(toolpaths_sha256: String, job: &Job) -> Self {
        Judged { toolpaths_sha256, job_sha256: sha256_of_job(job), model_sha256: job.model.sha256.clone() }
    }
}

/// Link styles as `job.json` has them, and as the hash of a job does: the words that earlier versions wrote, so that a
/// verdict on one of their jobs still stands.
const HASHED_LINKS: [(&str, &str); 2] =
    [(r#""link":"zigzag""#, r#""link":"lace""#), (r#""link":"one_way""#, r#""link":"box""#)];

/// Of a job without what may differ between two equal ones.
fn sha256_of_job(job: &Job) -> String {
    hex(&Sha256::digest(hashed_text(job)))
}

fn hashed_text(job: &Job) -> String {
    let mut job = job.clone();
    job.timings.clear();
    job.peak_memory_mb = 0.0;
    // A file that was moved is still the same: its own hash stands beside its path.
    job.model.path.clear();
    job.model.place = None;
    for obstacle in &mut job.request.check {
        obstacle.path.clear();
        obstacle.place = None;
    }
    // A job that was read is a job that can be written.
    let text = serde_json::to_string(&job).unwrap_or_default();
    // Inside of a string the quotes are escaped: only the field itself reads like this.
    HASHED_LINKS.iter().fold(text, |text, (now, hashed)| text.replace(now, hashed))
}

/// Where a job folder stands with its verification.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Standing {
    /// These very moves met every bar.
    Passed,
    /// These very moves did not.
    NotPassed {
        /// The errors that were found, one sentence each.
        errors: Vec<String>,
    },
    /// There is a verdict, on something else.
    Stale {
        /// What differs.
        what: &'static str,
    },
    /// There is none, or none that can be read.
    NotVerified {
        /// Why not.
        why: String,
    },
}

/// The part of `verify.json` that says on what, and how.
#[derive(Deserialize)]
struct Verified {
    #[serde(default)]
    judged: Option<Judged>,
    verdict: Verdict,
}

#[derive(Deserialize)]
struct Verdict {
    passed: bool,
    #[serde(default)]
    findings: Vec<Finding>,
}

#[derive(Deserialize)]
struct Finding {
    severity: String,
    message: String,
}

impl Standing {
    /// Of the files that lie in `folder`.
    #[must_use]
    pub fn of(folder: &Path) -> Self {
        let judged = read_job(folder).and_then(|job| Judged::of(folder, &job));
        judged.map_or_else(|e| Standing::NotVerified { why: e.to_string() }, |j| Self::on(folder, &j))
    }

    /// Of what was read from `folder`.
    fn on(folder: &Path, here: &Judged) -> Self {
        let text = match fs::read(folder.join(VERIFY_FILE)) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                return Standing::NotVerified { why: format!("there is no {VERIFY_FILE}") };
            }
            Err(e) => return Standing::NotVerified { why: format!("{VERIFY_FILE}: {e}") },
        };
        let verified: Verified = match serde_json::from_slice(&text) {
            Ok(verified) => verified,
            Err(e) => return Standing::NotVerified { why: format!("{VERIFY_FILE}: {e}") },
        };
        let Some(judged) = verified.judged else {
            let why = format!("{VERIFY_FILE} does not say which moves it judged");
            return Standing::NotVerified { why };
        };
        if judged.toolpaths_sha256 != here.toolpaths_sha256 {
            return Standing::Stale { what: "other moves" };
        }
        if judged.model_sha256 != here.model_sha256 {
            return Standing::Stale { what: "another model" };
        }
        if judged.job_sha256 != here.job_sha256 {
            return Standing::Stale { what: "another job.json" };
        }
        let errors: Vec<String> = verified
            .verdict
            .findings
            .into_iter()
            .filter(|f| f.severity == "error")
            .map(|f| f.message)
            .collect();
        if verified.verdict.passed && errors.is_empty() {
            Standing::Passed
        } else {
            Standing::NotPassed { errors }
        }
    }

    /// Whether a verdict belongs to these moves, whatever it says.
    #[must_use]
    pub fn is_current(&self) -> bool {
        matches!(self, Standing::Passed | Standing::NotPassed { .. })
    }

    /// A few words, for the header of a program.
    #[must_use]
    pub fn in_short(&self) -> String {
        match self {
            Standing::Passed => "verified".into(),
            Standing::NotPassed { .. } => "did not pass verification".into(),
            Standing::Stale { what } => format!("the verdict belongs to {what}"),
            Standing::NotVerified { .. } => "never verified".into(),
        }
    }
}

impl fmt::Display for Standing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Standing::Passed => f.write_str("passed verification"),
            Standing::NotPassed { errors } => {
                f.write_str("did not pass verification")?;
                errors.first().map_or(Ok(()), |first| write!(f, ": {first}"))
            }
            Standing::Stale { what } => write!(f, "the verdict in {VERIFY_FILE} belongs to {what}"),
            Standing::NotVerified { why } => write!(f, "not verified: {why}"),
        }
    }
}

/// The moves in a folder, and what a verdict on them and their job is passed on.
///
/// # Errors
/// The moves cannot be read.
pub fn read_moves_judged(folder: &Path, job: &Job) -> Result<(Program, Judged), FolderError> {
    let (program, toolpaths_sha256) = read_moves_with_hash(folder)?;
    Ok((program, Judged::of_moves(toolpaths_sha256, job)))
}

/// A job with its moves, and where it stands: the verdict is compared with what was read, not with what lies there later.
///
/// # Errors
/// The job or its moves cannot be read.
pub fn read_judged(folder: &Path) -> Result<(Job, Program, Standing), FolderError> {
    let job = read_job(folder)?;
    let (program, judged) = read_moves_judged(folder, &job)?;
    let standing = Standing::on(folder, &judged);
    Ok((job, program, standing))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{JOB_FILE, LinkStyle};

    fn job() -> Job {
        serde_json::from_value(serde_json::json!({
            "format_version": 1, "claymill_version": "test",
            "model": {"path": "model.igs", "sha256": "abc", "units": "MM", "unit_mm": 1.0, "faces_in_file": 0,
                "faces_read": 0, "skipped": [], "area_mm2": 0.1, "box_mm": [-0.0, 0.0, 0.0, 1.0, 1.0, 1.0]},
            "request": {"tool": {"shape": "ball", "radius_mm": 6.0}, "scallop_mm": 0.1, "strategy": "planar",
                "link": "lace", "preset": "clay", "up": "+z", "length": "-x", "only": [], "skip": [],
                "feed_mm_per_min": 6000.0, "rapid_mm_per_min": 20000.0},
            "tolerances": {}, "tools": [], "setups": [], "regions": [],
            "totals": {"moves": 0, "passes": 0, "retracts": 0,
                "length": {"cut_mm": 0.0, "lead_mm": 0.0, "link_mm": 0.0, "rapid_mm": 0.0},
                "control_points": 0, "time_s": 0.0, "lifted_locations": 0},
            "area": {"total_mm2": 0.0, "cut_mm2": 0.0, "uncut_mm2": {}},
            "faces": [], "timings": [], "peak_memory_mb": 0.0
        }))
        .unwrap()
    }

    #[test]
    fn a_verdict_on_a_job_of_an_earlier_version_stands() {
        for (old, now, link) in [("lace", "zigzag", LinkStyle::Zigzag), ("box", "one_way", LinkStyle::OneWay)]
        {
            let mut text = serde_json::to_value(job()).unwrap();
            let read = |text: &serde_json::Value| serde_json::from_value::<Job>(text.clone()).unwrap();
            text["request"]["link"] = old.into();
            let earlier = read(&text);
            assert_eq!(earlier.request.link, link);
            // What the earlier version hashed is what it wrote.
            let hashed = hashed_text(&earlier);
            assert!(hashed.contains(&format!(r#""link":"{old}""#)) && !hashed.contains(now), "{hashed}");
            assert_eq!(serde_json::to_value(&earlier).unwrap()["request"]["link"], now);
            text["request"]["link"] = now.into();
            assert_eq!(hashed_text(&read(&text)), hashed);
        }
    }

    fn verdict(folder: &Path, judged: Option<&Judged>, passed: bool) {
        let findings = serde_json::json!([{"severity": "error", "message": "too deep"}]);
        let findings = if passed { serde_json::json!([]) } else { findings };
        let mut file = serde_json::json!({"verdict": {"passed": passed, "findings": findings}});
        if let Some(judged) = judged {
            file["judged"] = serde_json::to_value(judged).unwrap();
        }
        fs::write(folder.join(VERIFY_FILE), file.to_string()).unwrap();
    }

    #[test]
    fn a_verdict_stands_for_the_very_files_only() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let write = |job: &Job| fs::write(folder.join(JOB_FILE), serde_json::to_vec(job).unwrap()).unwrap();
        fs::write(folder.join(TOOLPATHS_FILE), "").unwrap();
        assert!(matches!(Standing::of(folder), Standing::NotVerified { .. }));
        write(&job());
        assert!(matches!(Standing::of(folder), Standing::NotVerified { .. }));
        let judged = Judged::of(folder, &job()).unwrap();
        verdict(folder, Some(&judged), true);
        assert_eq!(Standing::of(folder), Standing::Passed);
        assert_eq!(read_judged(folder).unwrap().2, Standing::Passed);
        verdict(folder, Some(&judged), false);
        assert_eq!(Standing::of(folder), Standing::NotPassed { errors: vec!["too deep".into()] });
        verdict(folder, None, true);
        assert!(matches!(Standing::of(folder), Standing::NotVerified { .. }));
        fs::write(folder.join(VERIFY_FILE), "{").unwrap();
        assert!(matches!(Standing::of(folder), Standing::NotVerified { .. }));

        verdict(folder, Some(&judged), true);
        fs::write(folder.join(TOOLPATHS_FILE), "\n").unwrap();
        assert_eq!(Standing::of(folder), Standing::Stale { what: "other moves" });
        assert_eq!(read_judged(folder).unwrap().2, Standing::Stale { what: "other moves" });
        fs::write(folder.join(TOOLPATHS_FILE), "").unwrap();
        // What counts of the job, and what does not.
        let mut other = job();
        other.request.feed_mm_per_min = 6001.0;
        write(&other);
        assert_eq!(Standing::of(folder), Standing::Stale { what: "another job.json" });
        let mut other = job();
        other.model.sha256 = "abd".into();
        write(&other);
        assert_eq!(Standing::of(folder), Standing::Stale { what: "another model" });
        let mut same = job();
        (same.model.path, same.peak_memory_mb) = ("elsewhere/model.igs".into(), 12.0);
        write(&same);
        assert_eq!(Standing::of(folder), Standing::Passed);
    }
}
