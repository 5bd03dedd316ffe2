//! The list of shards in a work folder: which parts of the plan each one lays, and what it is expected to take.

use std::fs;
use std::path::{Path, PathBuf};

use claymill_paths::{PlanOptions, PlanPart, flat_mm};
use claymill_toolpath::{LONGEST_WRITTEN, PartKey, read_plain_text, write_whole};
use serde::{Deserialize, Serialize};

use crate::failure::Failure;

/// Names in a work folder.
const SHARDS_FILE: &str = "shards.json";
pub(super) const STORE_FOLDER: &str = "parts";

const FORM: u32 = 1;

/// Time of one core for a metre of passes, and for a part beside that, s: the shards of the roadster at a fifth of its size with a
/// ball of 10 mm took 0.14 s for a metre beside what the model takes.
const S_PER_M: f64 = 0.15;
const S_PER_PART: f64 = 0.5;
/// Memory for a metre of passes while they are laid, MB, and how many times what was needed to list it a shard may take beside
/// that: those shards took as much as the list did, within 3 %.
const MB_PER_M: f64 = 0.2;
const MB_BEYOND: f64 = 1.25;

/// What a work folder holds.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ShardList {
    format_version: u32,
    /// The version of claymill that listed them: another one may lay other passes.
    pub(super) program: String,
    /// The model's file.
    pub(super) model: PathBuf,
    pub(super) model_sha256: String,
    /// Time to read and prepare the model, which every shard needs before its own, s.
    pub(super) prepare_s: f64,
    pub(super) shards: Vec<Shard>,
}

/// Parts that one process lays.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Shard {
    pub(super) setup: String,
    pub(super) regions: Vec<usize>,
    pub(super) area_mm2: f64,
    /// On one core, without what the model takes.
    pub(super) estimated_s: f64,
    pub(super) estimated_mb: f64,
    parts: Vec<String>,
}

impl Shard {
    /// The keys of its parts.
    pub(super) fn keys(&self) -> impl Iterator<Item = PartKey> {
        // Texts were looked at when the list was read.
        self.parts.iter().filter_map(|text| text.parse().ok())
    }
}

impl ShardList {
    pub(super) fn new(
        (program, model, model_sha256): (String, PathBuf, String),
        (prepare_s, prepare_mb): (f64, f64),
        parts: Vec<PlanPart>,
        options: &PlanOptions,
        shard_s: f64,
    ) -> Self {
        let shards = grouped(parts, options, prepare_mb, shard_s);
        ShardList { format_version: FORM, program, model, model_sha256, prepare_s, shards }
    }

    /// Reads the list of a work folder.
    pub(super) fn read(folder: &Path, program: &str) -> Result<Self, Failure> {
        let path = folder.join(SHARDS_FILE);
        let problem =
            |what: String, advice: &str| Failure::problem(format!("{}: {what}", path.display()), advice);
        let text = read_plain_text(&path, LONGEST_WRITTEN).map_err(|e| {
            problem(e.to_string(), "A work folder comes from `claymill shard open MODEL -o FOLDER`.")
        })?;
        let again = "List the shards again: claymill shard open MODEL -o FOLDER.";
        let list: ShardList = serde_json::from_str(&text).map_err(|e| problem(e.to_string(), again))?;
        if list.format_version != FORM {
            let message =
                format!("this is form {} of the list; this version reads {FORM}", list.format_version);
            return Err(problem(message, again));
        }
        let mut parts = list.shards.iter().flat_map(|shard| &shard.parts);
        if let Some(wrong) = parts.find(|text| text.parse::<PartKey>().is_err()) {
            return Err(problem(format!("{wrong:?} is the key of no part"), again));
        }
        if list.program != program {
            let message = format!("{} listed these shards, and this is {program}", list.program);
            return Err(problem(message, "Run all shards with one version, or list them again."));
        }
        Ok(list)
    }

    /// Writes it to a work folder.
    pub(super) fn write(&self, folder: &Path) -> Result<(), Failure> {
        let path = folder.join(SHARDS_FILE);
        let text = serde_json::to_string_pretty(self)
            .map_err(|e| Failure::problem(format!("the shards cannot be written as JSON: {e}"), ""))?;
        write_whole(&path, text.as_bytes()).map_err(Failure::at(&path))
    }
}

/// Makes a work folder, or takes one that is there already.
pub(super) fn begin(folder: &Path) -> Result<(), Failure> {
    fs::create_dir_all(folder).map_err(Failure::at(folder))?;
    let is_empty = fs::read_dir(folder).map_err(Failure::at(folder))?.next().is_none();
    if is_empty || folder.join(SHARDS_FILE).is_file() || folder.join(STORE_FOLDER).is_dir() {
        return Ok(());
    }
    Err(Failure::problem(
        format!("{} is not empty and is no work folder", folder.display()),
        "Name a folder that is empty or not there yet.",
    ))
}

/// Parts of one setup, largest first, until a shard takes long enough. It follows from the parts alone.
fn grouped(mut parts: Vec<PlanPart>, options: &PlanOptions, prepare_mb: f64, shard_s: f64) -> Vec<Shard> {
    let step_mm = flat_mm(options.tool.radius_mm(), options.scallop_mm);
    let length_m = |part: &PlanPart| part.area_mm2 / step_mm / 1000.0;
    let by_size =
        |a: &PlanPart, b: &PlanPart| b.area_mm2.total_cmp(&a.area_mm2).then(a.region.cmp(&b.region));
    parts.sort_by(|a, b| a.setup.cmp(&b.setup).then_with(|| by_size(a, b)));
    let mut shards: Vec<Shard> = Vec::new();
    for part in parts {
        let length_m = length_m(&part);
        let takes_s = S_PER_PART + S_PER_M * length_m;
        let more_mb = MB_PER_M * length_m;
        match shards.last_mut() {
            Some(last) if last.setup == part.setup && last.estimated_s + takes_s <= shard_s => {
                last.regions.push(part.region);
                last.area_mm2 += part.area_mm2;
                last.estimated_s += takes_s;
                last.estimated_mb += more_mb;
                last.parts.push(part.key.to_string());
            }
            _ => shards.push(Shard {
                setup: part.setup,
                regions: vec![part.region],
                area_mm2: part.area_mm2,
                estimated_s: takes_s,
                estimated_mb: MB_BEYOND * prepare_mb + more_mb,
                parts: vec![part.key.to_string()],
            }),
        }
    }
    shards
}

/// Numbers as ranges, as in 3,17,40-44.
pub(super) fn ranges(numbers: &[usize]) -> String {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b);
    let text = |run: &[usize]| match run {
        [one] => one.to_string(),
        [first, .., last] => format!("{first}-{last}"),
        [] => String::new(),
    };
    runs.map(text).collect::<Vec<_>>().join(",")
}

/// The numbers of a text like that, below a limit, each once and in order.
pub(super) fn numbers(text: &str, below: usize) -> Result<Vec<usize>, Failure> {
    let wrong = || {
        let last = below.saturating_sub(1);
        Failure::usage(
            format!("{text:?} does not say which shards"),
            format!("Shards are numbers from 0 to {last}, as in 3 or 4-9,12."),
        )
    };
    let number = |text: &str| text.trim().parse().ok().filter(|n| *n < below).ok_or_else(wrong);
    let mut all = Vec::new();
    for item in text.split(',') {
        let (from, to) = item.split_once('-').unwrap_or((item, item));
        let (from, to): (usize, usize) = (number(from)?, number(to)?);
        if to < from {
            return Err(wrong());
        }
        all.extend(from..=to);
    }
    all.sort_unstable();
    all.dedup();
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read_as_they_are_written() {
        for all in [vec![], vec![0], vec![0, 1], vec![0, 2, 3, 4, 7, 9, 10]] {
            let text = ranges(&all);
            if !all.is_empty() {
                assert_eq!(numbers(&text, 11).unwrap(), all, "{text}");
            }
        }
        assert_eq!(ranges(&[3, 17, 40, 41, 42]), "3,17,40-42");
        assert_eq!(numbers("4,1-2,2", 5).unwrap(), [1, 2, 4]);
        for wrong in ["", "x", "5", "3-1", "1-", "-1", "1,,2"] {
            assert!(numbers(wrong, 5).is_err(), "{wrong}");
        }
    }

    #[test]
    fn shards_hold_every_part_once_and_do_not_follow_from_the_order_of_parts() {
        let options = claymill::Job::new("ball:10".parse().unwrap(), 0.1).passes;
        let part = |n: usize| PlanPart {
            key: claymill_toolpath::KeyMaker::new("part").count(n).finish(),
            setup: ["top", "left", "rear"][n % 3].to_owned(),
            region: n,
            area_mm2: 1e5 * (1.0 + (n * n % 13) as f64),
            is_kept: false,
        };
        let parts: Vec<PlanPart> = (0..40).map(part).collect();
        let shards = grouped(parts.clone(), &options, 100.0, 60.0);
        assert_eq!(shards, grouped(parts.into_iter().rev().collect(), &options, 100.0, 60.0));
        let mut regions: Vec<usize> = shards.iter().flat_map(|s| s.regions.clone()).collect();
        regions.sort_unstable();
        assert_eq!(regions, (0..40).collect::<Vec<_>>());
        assert!(shards.len() > 3 && shards.iter().all(|s| s.regions.len() == s.keys().count()), "{shards:?}");
        assert!(shards.iter().all(|s| s.regions.len() == 1 || s.estimated_s <= 60.0));
        let all = |shards: &[Shard]| shards.iter().map(|s| s.area_mm2).sum::<f64>();
        assert!((all(&shards) - (0..40).map(|n| part(n).area_mm2).sum::<f64>()).abs() < 1.0);
    }
}
