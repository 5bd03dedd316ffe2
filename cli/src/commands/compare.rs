//! `claymill compare`: every combination of strategy, scallop height and tool, planned and verified on
//! the same terms, on one page.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use claymill_paths::FitTolerance;
use claymill_toolpath::{Job, LengthByKind, MoveKind, Program, Renewal, Tool, write_whole};
use claymill_verify::{HISTOGRAM_BIN, SurfaceState, Verification};
use claymill_viewer::{Compared, ComparisonInput, comparison_html, flatten};
use rayon::prelude::*;
use serde::Serialize;

use super::compare_jobs::{Combination, Wanted};
use super::compare_kept::Before;
use super::plan::{Done, run};
use super::{Context, compare_plot, compare_table};
use crate::args::{CompareArgs, ReuseArgs};
use crate::console::{counted, outln};
use crate::failure::{Failure, advice_on};
use crate::interrupt::{self, INTERRUPTED};

/// The comparison as data, as a table for spreadsheets, as a diagram and as a page, and the options that all its jobs share.
const FILES: [&str; 5] = ["compare.json", "compare.csv", "compare.svg", "compare.html", "compare.toml"];

/// The whole comparison.
#[derive(Debug, Serialize)]
pub(super) struct Comparison {
    model: String,
    /// Width of the histograms' bins, as a share of the scallop height asked for.
    histogram_bin: f64,
    pub(super) entries: Vec<Entry>,
}

/// One combination of strategy, tool and scallop height.
#[derive(Debug, Serialize)]
pub(super) struct Entry {
    /// Its job folder inside the comparison's.
    pub(super) name: String,
    pub(super) strategy: String,
    pub(super) tool: Tool,
    pub(super) scallop_mm: f64,
    pub(super) passed: bool,
    #[serde(flatten)]
    pub(super) all: Figures,
    /// Share of the area within reach that no pass cut.
    pub(super) never_cut_share: f64,
    /// Largest gouge, mm.
    pub(super) gouge_mm: f64,
    /// Share of the crests between 0.90 and 1.05 of the scallop height.
    pub(super) even_share: f64,
    /// The same of the crests inside of regions.
    pub(super) even_inside_share: f64,
    /// Straight moves that would follow the cuts at the same tolerance, and how many that is for one control point of
    /// theirs.
    pub(super) straight_moves: u64,
    pub(super) straight_per_point: f64,
    pub(super) histogram: Vec<f64>,
    pub(super) regions: Vec<RegionEntry>,
}

/// One region of a combination, in all setups.
#[derive(Debug, Serialize)]
pub(super) struct RegionEntry {
    region: usize,
    #[serde(flatten)]
    figures: Figures,
}

/// What is compared.
#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct Figures {
    pub(super) area_mm2: f64,
    pub(super) length: LengthByKind,
    /// The least length of passes that leaves the scallop height, by the surface's curvature across them, in mm, and as a
    /// share of the length of the cuts.
    pub(super) least_length_mm: f64,
    pub(super) efficiency: f64,
    /// The same by the step-over on a plane: area ÷ flat step-over ÷ length of the cuts.
    pub(super) flat_efficiency: f64,
    pub(super) passes: u32,
    pub(super) retracts: u32,
    /// Share of the whole way that does not cut.
    pub(super) non_cutting_share: f64,
    pub(super) time_s: f64,
    pub(super) control_points: u64,
    pub(super) scallop_max_mm: f64,
    pub(super) scallop_p99_mm: f64,
    pub(super) scallop_p95_mm: f64,
    pub(super) scallop_mean_mm: f64,
}

/// `claymill compare`.
pub(crate) fn compare(context: &Context, args: &CompareArgs) -> Result<ExitCode, Failure> {
    let wanted = Wanted::of(args)?;
    let combinations = wanted.combinations(args)?;
    std::fs::create_dir_all(&args.out).map_err(|e| failed(&args.out, &e))?;
    // Looked at before hours of planning, and again when it is written.
    drop(begin(&args.out)?);
    let finished = tell_at_interrupt(combinations.len());
    let mut comparison = Comparison {
        model: args.model.display().to_string(),
        histogram_bin: HISTOGRAM_BIN,
        entries: Vec::new(),
    };
    let mut exit = ExitCode::SUCCESS;
    let mut compared = Vec::new();
    let mut before = Before::new(context);
    for Combination { name, request } in combinations {
        context.console.say(format!("\n{name}"));
        let folder = args.out.join(&name);
        let done = match before.made(&request, &folder)? {
            Some(done) => {
                let why = format!(
                    "{}: planned before by this version, from the same model and with the same options",
                    folder.display()
                );
                context.console.say_long("kept", &why);
                done
            }
            None => {
                let console = context.console.for_job();
                let context = Context { console: &console, json: false, force: context.force };
                run(&context, &request, &folder, &ReuseArgs::nowhere())?
            }
        };
        finished.lock().unwrap_or_else(PoisonError::into_inner).push(name.clone());
        if done.exit != ExitCode::SUCCESS {
            exit = done.exit;
        }
        let entry = Entry::new(name.clone(), &done);
        compared.push(Compared {
            name,
            efficiency: entry.all.efficiency,
            job: done.job,
            found: done.found,
            map: done.scallop_map,
        });
        comparison.entries.push(entry);
    }
    write_files(args, &wanted, &comparison, &compared)?;
    if context.json {
        context.print_json(&comparison)?;
    } else if !context.console.is_quiet() {
        outln!("{}", compare_table::table(&comparison.entries));
        context.console.say(format!("comparison {}", args.out.display()));
    }
    Ok(exit)
}

/// The names of combinations that are finished; they are told when the process is interrupted.
fn tell_at_interrupt(all: usize) -> Arc<Mutex<Vec<String>>> {
    let finished = Arc::new(Mutex::new(Vec::new()));
    let names = Arc::clone(&finished);
    interrupt::at_first(move || {
        interrupt::end(INTERRUPTED.into(), || {
            let names: MutexGuard<'_, Vec<String>> = names.lock().unwrap_or_else(PoisonError::into_inner);
            eprintln!("{}", interruption(&names, all));
        });
    });
    finished
}

/// What an interruption leaves, and how it goes on.
fn interruption(finished: &[String], all: usize) -> String {
    let which = if finished.is_empty() { String::new() } else { format!(": {}", finished.join(", ")) };
    format!(
        "interrupted: {} of {} done{which}\n  help: The same command goes on from there; nothing else was left behind.",
        finished.len(),
        counted(all, "combination")
    )
}

/// Begins to write the comparison's own files.
fn begin(out: &Path) -> Result<Renewal, Failure> {
    let renewal = Renewal::begin(out, &FILES)?;
    interrupt::remove_on_interrupt(renewal.leftovers());
    Ok(renewal)
}

fn write_files(
    args: &CompareArgs,
    wanted: &Wanted,
    comparison: &Comparison,
    compared: &[Compared],
) -> Result<(), Failure> {
    let json = serde_json::to_string_pretty(comparison)
        .map_err(|e| Failure::problem(format!("the comparison cannot be written as JSON: {e}"), ""))?;
    let svg = compare_plot::svg(comparison);
    let title = args.model.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let [.., job_file] = FILES;
    let command = wanted.command(args, job_file);
    let page = ComparisonInput { title: &title, jobs: compared, plot_svg: &svg, command: &command };
    let html = comparison_html(&page);
    let renewal = begin(&args.out)?;
    for (file, text) in FILES.iter().zip([json, csv(comparison), svg, html, wanted.job_file()?]) {
        let path = renewal.path().join(file);
        write_whole(&path, text.as_bytes()).map_err(|e| failed(&path, &e))?;
    }
    Ok(renewal.finish()?)
}

fn failed(file: &Path, error: &std::io::Error) -> Failure {
    Failure::problem(format!("{}: {error}", file.display()), advice_on(error))
}

impl Entry {
    fn new(name: String, done: &Done) -> Self {
        let (job, found) = (&done.job, &done.found);
        let step_mm = claymill_paths::flat_mm(job.request.tool.radius_mm(), job.request.scallop_mm);
        let state = |s: SurfaceState| found.coverage.by_state_mm2.get(&s).copied().unwrap_or_default();
        let (cut, left) = (state(SurfaceState::Cut), state(SurfaceState::ReachableLeft));
        let crests = &found.scallop.crests;
        let totals = &job.totals;
        let all = Figures {
            area_mm2: cut,
            least_length_mm: found.coverage.least_length_mm,
            length: totals.length,
            passes: totals.passes,
            retracts: totals.retracts,
            time_s: totals.time_s,
            control_points: totals.control_points,
            scallop_max_mm: crests.max_mm,
            scallop_p99_mm: crests.p99_mm,
            scallop_p95_mm: crests.p95_mm,
            scallop_mean_mm: crests.mean_mm,
            ..Figures::default()
        };
        let (points, straight_moves) = points_and_straight_moves(&done.program, job.request.scallop_mm);
        Entry {
            name,
            strategy: job.request.strategy.clone(),
            tool: job.request.tool,
            scallop_mm: job.request.scallop_mm,
            passed: found.verdict.passed,
            all: all.with_shares(step_mm),
            never_cut_share: if cut + left > 0.0 { left / (cut + left) } else { 0.0 },
            gouge_mm: found.gouge.deepest_mm,
            even_share: crests.even_share,
            even_inside_share: crests.even_inside_share,
            straight_moves,
            straight_per_point: straight_moves as f64 / points.max(1) as f64,
            histogram: crests.histogram.clone(),
            regions: regions(job, found, step_mm),
        }
    }
}

impl Figures {
    fn with_shares(mut self, step_mm: f64) -> Self {
        let all_mm = self.length.total_mm();
        if self.length.cut_mm > 0.0 {
            self.efficiency = self.least_length_mm / self.length.cut_mm;
            self.flat_efficiency = self.area_mm2 / step_mm / self.length.cut_mm;
        }
        if all_mm > 0.0 {
            self.non_cutting_share = 1.0 - self.length.cut_mm / all_mm;
        }
        self
    }
}

/// The regions in all their setups together. Their areas are the planner's account.
fn regions(job: &Job, found: &Verification, step_mm: f64) -> Vec<RegionEntry> {
    let mut by_region: BTreeMap<usize, Figures> = BTreeMap::new();
    for r in &job.regions {
        let f = by_region.entry(r.region).or_default();
        f.area_mm2 += r.area_mm2;
        f.length += r.length;
        f.passes += r.passes;
        f.retracts += r.retracts;
        f.time_s += r.time_s;
        f.control_points += r.control_points;
    }
    for (account, face) in job.faces.iter().zip(&found.coverage.faces) {
        if let Some(f) = by_region.get_mut(&account.region) {
            f.least_length_mm += face.least_length_mm;
        }
    }
    for c in &found.scallop.crests.by_region {
        if let Some(f) = by_region.get_mut(&c.region) {
            f.scallop_max_mm = c.max_mm;
            f.scallop_p99_mm = c.p99_mm;
            f.scallop_p95_mm = c.p95_mm;
            f.scallop_mean_mm = c.mean_mm;
        }
    }
    let entry = |(region, f): (usize, Figures)| RegionEntry { region, figures: f.with_shares(step_mm) };
    by_region.into_iter().map(entry).collect()
}

/// Control points of the cuts, and straight moves that stay as close to the cuts as these to the exact path.
fn points_and_straight_moves(program: &Program, scallop_mm: f64) -> (u64, u64) {
    let tolerance_mm = 2.0 * FitTolerance::of_scallop(scallop_mm).fit_mm;
    let cuts = program.moves.par_iter().filter(|m| m.kind == MoveKind::Cut);
    let counts = |curve: claymill_nurbs::Curve3| {
        (curve.points().len() as u64, flatten(&curve, tolerance_mm).len() as u64 - 1)
    };
    cuts.filter_map(|m| m.curve().ok()).map(counts).reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
}

fn csv(comparison: &Comparison) -> String {
    let mut out =
        "name,strategy,tool,scallop_mm,region,passed,area_m2,cut_km,link_km,lead_km,rapid_km,efficiency,flat_efficiency,\
                   passes,retracts,non_cutting_share,time_h,control_points,straight_moves,scallop_max_mm,\
                   scallop_p99_mm,scallop_p95_mm,scallop_mean_mm,even_share,even_inside_share,never_cut_share,gouge_mm\n"
            .to_owned();
    for e in &comparison.entries {
        let head = format!("{},{},{},{}", e.name, e.strategy, e.tool, e.scallop_mm);
        let tail = format!(
            "{:.4},{:.4},{:.6},{:.6}",
            e.even_share, e.even_inside_share, e.never_cut_share, e.gouge_mm
        );
        out += &row(&head, "all", &e.passed.to_string(), &e.all, &e.straight_moves.to_string(), &tail);
        for r in &e.regions {
            out += &row(&head, &r.region.to_string(), "", &r.figures, "", ",,,");
        }
    }
    out
}

fn row(head: &str, region: &str, passed: &str, f: &Figures, straight: &str, tail: &str) -> String {
    format!(
        "{head},{region},{passed},{:.6},{:.6},{:.6},{:.6},{:.6},{:.4},{:.4},{},{},{:.4},{:.4},{},{straight},{:.5},{:.5},{:.5},{:.5},{tail}\n",
        f.area_mm2 * 1e-6,
        f.length.cut_mm * 1e-6,
        f.length.link_mm * 1e-6,
        f.length.lead_mm * 1e-6,
        f.length.rapid_mm * 1e-6,
        f.efficiency,
        f.flat_efficiency,
        f.passes,
        f.retracts,
        f.non_cutting_share,
        f.time_s / 3600.0,
        f.control_points,
        f.scallop_max_mm,
        f.scallop_p99_mm,
        f.scallop_p95_mm,
        f.scallop_mean_mm,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interruption_says_what_is_done_and_how_to_go_on() {
        let none = interruption(&[], 5);
        assert!(none.starts_with("interrupted: 0 of 5 combinations done\n"), "{none}");
        let some = interruption(&["planar".into(), "flow".into()], 5);
        assert!(some.starts_with("interrupted: 2 of 5 combinations done: planar, flow\n"), "{some}");
        assert!(some.contains("same command"), "{some}");
    }
}
