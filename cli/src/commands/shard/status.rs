//! Which shards are done, from the files of a work folder alone: no scheduler is asked.

use std::path::Path;
use std::process::ExitCode;

use serde::Serialize;

use super::list::{STORE_FOLDER, ShardList, ranges};
use crate::args::ListForm;
use crate::commands::Context;
use crate::console::outln;
use crate::failure::Failure;
use crate::reuse::{PROGRAM, Reuse};

/// How a shard stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Standing {
    Done,
    /// Some of its parts are not there.
    Missing,
    /// The file of one of its parts was damaged, and is removed.
    Damaged,
}

/// How the shards of a list stand.
pub(super) struct Standings(Vec<Standing>);

impl Standings {
    /// Reads all parts that are there.
    pub(super) fn of(list: &ShardList, folder: &Path) -> Result<Self, Failure> {
        let reuse = Reuse::of_shards(&folder.join(STORE_FOLDER))?;
        let kept = &reuse.kept;
        let standings = list.shards.iter().map(|shard| {
            if shard.keys().any(|key| kept.has(&key) && !kept.is_whole(&key)) {
                Standing::Damaged
            } else if shard.keys().all(|key| kept.has(&key)) {
                Standing::Done
            } else {
                Standing::Missing
            }
        });
        Ok(Standings(standings.collect()))
    }

    /// The shards that have to be run.
    pub(super) fn missing(&self) -> Vec<usize> {
        self.that(|standing| standing != Standing::Done)
    }

    /// Those of which a part was damaged.
    pub(super) fn damaged(&self) -> Vec<usize> {
        self.that(|standing| standing == Standing::Damaged)
    }

    fn that(&self, is: impl Fn(Standing) -> bool) -> Vec<usize> {
        (0..self.0.len()).filter(|&k| is(self.0[k])).collect()
    }
}

/// What `claymill shard status --json` prints of each shard.
#[derive(Serialize)]
struct Line<'a> {
    shard: usize,
    standing: Standing,
    setup: &'a str,
    regions: &'a [usize],
    area_mm2: f64,
    estimated_s: f64,
    estimated_mb: f64,
}

/// Prints how shards stand, or which are missing.
pub(super) fn status(
    context: &Context,
    folder: &Path,
    missing_as: Option<ListForm>,
) -> Result<ExitCode, Failure> {
    let list = ShardList::read(folder, PROGRAM)?;
    let standings = Standings::of(&list, folder)?;
    let missing = standings.missing();
    match missing_as {
        Some(ListForm::Ranges) if missing.is_empty() => {}
        Some(ListForm::Ranges) => outln!("{}", ranges(&missing)),
        Some(ListForm::Lines) => missing.iter().for_each(|shard| outln!("{shard}")),
        Some(ListForm::Json) => context.print_json(&missing)?,
        None => {
            let lines =
                list.shards.iter().zip(&standings.0).enumerate().map(|(shard, (of, standing))| Line {
                    shard,
                    standing: *standing,
                    setup: &of.setup,
                    regions: &of.regions,
                    area_mm2: of.area_mm2,
                    estimated_s: of.estimated_s,
                    estimated_mb: of.estimated_mb,
                });
            if context.json {
                context.print_json(&lines.collect::<Vec<_>>())?;
            } else {
                print(&list, &standings, lines);
            }
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn print<'a>(list: &ShardList, standings: &Standings, lines: impl Iterator<Item = Line<'a>>) {
    outln!("shard  standing  setup       regions    area m2  about min  about MB");
    for line in lines {
        let standing = format!("{:?}", line.standing).to_lowercase();
        let (m2, min) = (line.area_mm2 / 1e6, line.estimated_s / 60.0);
        let (shard, setup, regions, mb) = (line.shard, line.setup, line.regions.len(), line.estimated_mb);
        outln!("{shard:>5}  {standing:<8}  {setup:<10}  {regions:>7}  {m2:>9.3}  {min:>9.1}  {mb:>8.0}");
    }
    let missing = standings.missing();
    let left_s = missing.iter().fold(0.0, |sum, &k| sum + list.shards[k].estimated_s + list.prepare_s);
    outln!(
        "{} of {} done; about {:.1} h of one core are left",
        list.shards.len() - missing.len(),
        list.shards.len(),
        left_s / 3600.0
    );
}
