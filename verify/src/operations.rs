//! A job with operations: each is verified by itself, with its own tool and allowance, and all verdicts make one.

use std::ops::Range;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use claymill_exchange::read_solid;
use claymill_nurbs::{ClosedMesh, MeshOptions, Model, Point3, Vector3};
use claymill_toolpath::{
    Cancelled, Job, Kept, LATEST_FORMAT_VERSION, Levels, Monitor, Move, MoveKind, Program, Stage, Stock,
    sha256_of,
};

use crate::error::VerifyError;
use crate::levels::{self, LevelsFound, Standing};
use crate::options::VerifyOptions;
use crate::reach::AskedOfStock;
use crate::report::{CrestSample, OperationFound, Verification};
use crate::stock::{InitialStock, StockCheck, StockError, StockHit, StockOptions, StockReport};
use crate::verdict::{Finding, FindingCode, Severity, Verdict};
use crate::{measure_all, sequence};

/// Curved moves become chords within this distance, for stock, mm.
const STOCK_CHORD_MM: f64 = 0.01;
/// Stock in the way is found if a ball of this diameter fits into it, mm.
const NARROWEST_MM: f64 = 0.5;
/// Boxes of a proof are not divided below this side, mm.
const SMALLEST_BOX_MM: f64 = 0.25;
/// Where a model is covered with triangles for its layer, they are within this of it, mm.
const STOCK_MESH_MM: f64 = 0.1;
/// Quasi-random points for volumes.
const VOLUME_POINTS: u64 = 1 << 17;
/// Where only what has stock above a thickness is to be cut, places with less than so many times as much may be left: the planner
/// knows the stock to a fraction of that thickness.
const REST_LEEWAY: f64 = 1.5;
/// Axes that differ by less are one; and setups have no more than so many.
const SAME_AXIS: f64 = 1e-6;
const MOST_AXES: usize = 64;
/// Poses at which the engagement is measured.
const POSES: u64 = 200;

/// Measures the moves of each operation against what was asked of it. What is said of the whole job is what was found of the
/// operation that finishes the surface; the verdict is of all. Crests are those of all that cut the surface.
///
/// # Errors
/// As [`crate::verify_program`]; or a move names no operation.
pub(crate) fn measure(
    model: &Model,
    job: &Job,
    program: &Program,
    options: &VerifyOptions,
    monitor: &dyn Monitor,
) -> Result<(Verification, Vec<CrestSample>), VerifyError> {
    let known = job.operations.len();
    if let Some(m) = program.moves.iter().find(|m| m.op.is_none_or(|op| op as usize >= known)) {
        let name = m.op.map_or_else(|| "none".to_owned(), |op| op.to_string());
        return Err(VerifyError::Unknown { seq: m.seq, what: "operation", name });
    }
    let (mut all, mut crests) = (Vec::new(), Vec::new());
    let mut first_seq = 0;
    let read = ReadStock::of(job, &options.folder)?;
    let followed = |stock: &Stock| follow((model, job), program, (stock, &read), monitor);
    // The stock is large: where no operation asks of it, only when the others are done.
    let has_shank = job.tools.iter().any(|t| t.holder.is_some() || t.tool.sides().len() > 1);
    let asked = has_shank
        || job.operations.iter().any(|o| o.request.rest_above_mm.is_some() || o.request.levels.is_some());
    let early = job.stock.as_ref().filter(|_| asked).map(followed).transpose()?;
    for (index, operation) in job.operations.iter().enumerate() {
        let Some(part) = job.of_operation(index) else { continue };
        let moves = program.of_operation(index);
        let sequence = sequence::measure(&part, &moves, first_seq);
        // All moves are there, one after the other: the next one is the operation's first.
        let begins = early.as_ref().and_then(|check| Some((check, check.time_of(first_seq as usize).ok()?)));
        let ends = first_seq + moves.moves.len() as u64;
        if let Some(levels) = operation.request.levels {
            let range = first_seq as usize..ends as usize;
            first_seq = ends;
            let (mut found, samples) =
                levels::measure_moves(model, &part, (&moves, sequence), options, monitor)?;
            let checked = early.as_ref().filter(|_| is_in_order(program, index, &range));
            let check = |whole| {
                of_levels(
                    (model, job, &read),
                    program,
                    (&part, levels),
                    range.clone(),
                    whole,
                    &samples,
                    monitor,
                )
            };
            let levels = checked.map(check).transpose()?;
            let mut findings = found.verdict.findings;
            match &levels {
                Some(levels) => findings.extend(levels::findings(levels, operation.request.tool.radius_mm())),
                None => findings.push(levels::unmeasured()),
            }
            found.verdict = Verdict::of(findings);
            all.push(OperationFound { name: operation.name.clone(), kind: operation.kind, found, levels });
            continue;
        }
        let stands = begins.zip(operation.request.rest_above_mm).map(|((check, begins), above_mm)| {
            let height_mm = operation.request.allowance_mm + REST_LEEWAY * above_mm;
            move |p: &Point3, n: &Vector3| check.is_stock(&(p + n * height_mm), begins)
        });
        // What stands in the way when a setup is done was never taken out of it there.
        let last_along = last_along(&moves, first_seq as usize);
        let struck = early.as_ref().map(|check| {
            let radius_mm = operation.request.tool.radius_mm();
            let kept_mm = options.holder_clearance_of_mm(&operation.request);
            move |centre: &Point3, axis: &Vector3| {
                let last = last_along.iter().find(|(along, _)| (along - axis).norm() < SAME_AXIS);
                last.and_then(|(_, last)| check.struck_at(*last, &(centre - axis * radius_mm), axis, kept_mm))
            }
        });
        let stock = AskedOfStock {
            stands: stands.as_ref().map(|stands| stands as _),
            struck: struck.as_ref().map(|struck| struck as _),
        };
        first_seq = ends;
        let (found, samples) =
            measure_all(model, &part, (&moves, Some(sequence), stock), options, &Kept::nowhere(), monitor)?;
        if operation.kind.is_of_surface() {
            crests.extend(samples);
        }
        all.push(OperationFound { name: operation.name.clone(), kind: operation.kind, found, levels: None });
    }
    let main = job.main_operation().and_then(|main| all.get(main)).map(|main| main.found.clone());
    let found =
        main.ok_or_else(|| VerifyError::Unknown { seq: 0, what: "operation", name: "none".to_owned() })?;
    let check = match early {
        Some(check) => Some(check),
        None => job.stock.as_ref().map(followed).transpose()?,
    };
    // It is asked before each move.
    let (begun, moves) = (AtomicUsize::new(0), program.moves.len().max(1));
    let keep_going = || {
        let share = begun.fetch_add(1, Ordering::Relaxed) as f64 / moves as f64;
        monitor.at(Stage::Stock, share.min(1.0));
        monitor.go_on().is_ok()
    };
    let report = |check: StockCheck<'_>| check.report(None, &keep_going).map_err(of_stock);
    let stock = check.map(report).transpose()?;
    let verdict = joined(job, program, &all, stock.as_ref());
    let found =
        Verification { format_version: LATEST_FORMAT_VERSION, verdict, stock, operations: all, ..found };
    Ok((found, crests))
}

/// Whether the moves of a program in a range are those of an operation, each with the number of its place.
fn is_in_order(program: &Program, operation: usize, range: &Range<usize>) -> bool {
    let of_range = program.moves.get(range.clone());
    let is_own = |(k, m): (usize, &Move)| m.seq == k as u64 && m.op == Some(operation as u32);
    of_range.is_some_and(|moves| range.clone().zip(moves).all(is_own))
}

/// What levels do to the stock.
fn of_levels(
    (model, job, read): (&Model, &Job, &ReadStock),
    program: &Program,
    (part, asked): (&Job, Levels),
    range: Range<usize>,
    whole: &StockCheck<'_>,
    samples: &Standing,
    monitor: &dyn Monitor,
) -> Result<LevelsFound, VerifyError> {
    let keep_going = || monitor.go_on().is_ok();
    let stock = job.stock.as_ref().map(|stock| initial(model, stock, read)).transpose()?;
    let Some(stock) = stock else { return Err(StockError::NoMove(range.start).into()) };
    let until = &program.moves[..range.end];
    let until = StockCheck::new(stock, until, &job.tools, &stock_options(), &keep_going).map_err(of_stock)?;
    let part = (part, asked, job.tools.as_slice());
    levels::measure_stock(part, program, range, [whole, &until], samples, monitor).map_err(of_stock)
}

/// The last move along each axis that a tool has, as its number in a program in which the moves begin with `first`.
fn last_along(moves: &Program, first: usize) -> Vec<(Vector3, usize)> {
    let mut last: Vec<(Vector3, usize)> = Vec::new();
    for (index, m) in (first..).zip(&moves.moves) {
        let axis = Vector3::from(m.axis_start);
        match last.iter().position(|(along, _)| (along - axis).norm() < SAME_AXIS) {
            Some(known) => last[known].1 = index,
            // A tool that turns on its way has no axis that a setup has.
            None if last.len() < MOST_AXES => last.push((axis, index)),
            None => {}
        }
    }
    last
}

/// The stock at all times of the whole program: by it one knows whether rapids, shanks and holders keep clear of what is there.
fn follow<'a>(
    (model, job): (&'a Model, &Job),
    program: &'a Program,
    (stock, read): (&Stock, &ReadStock),
    monitor: &dyn Monitor,
) -> Result<StockCheck<'a>, VerifyError> {
    monitor.at(Stage::Stock, 0.0);
    let keep_going = || monitor.go_on().is_ok();
    let initial = initial(model, stock, read)?;
    StockCheck::new(initial, &program.moves, &job.tools, &stock_options(), &keep_going).map_err(of_stock)
}

/// What the file of a job's stock encloses, if it is in one.
struct ReadStock(Option<ClosedMesh>);

impl ReadStock {
    fn of(job: &Job, folder: &Path) -> Result<Self, VerifyError> {
        let Some(Stock::File(file)) = &job.stock else { return Ok(ReadStock(None)) };
        let path = file.find(folder);
        let found = sha256_of(&path)?;
        if found != file.sha256 {
            return Err(VerifyError::ModelChanged { path, expected: file.sha256.clone(), found });
        }
        Ok(ReadStock(Some(read_solid(&path, file.unit_mm)?)))
    }
}

/// The stock of a job before its first move.
fn initial<'a>(model: &'a Model, stock: &Stock, read: &ReadStock) -> Result<InitialStock<'a>, VerifyError> {
    Ok(match *stock {
        Stock::Layer { thickness_mm } => InitialStock::layer(
            model,
            thickness_mm,
            None,
            &MeshOptions { deviation_mm: STOCK_MESH_MM, longest_edge_mm: f64::INFINITY },
        )?,
        Stock::Block { box_mm: [x0, y0, z0, x1, y1, z1] } => {
            InitialStock::block(Point3::new(x0, y0, z0), Point3::new(x1, y1, z1))?
        }
        Stock::Bar { from_mm, to_mm, diameter_mm } => {
            let (from, to) = (Point3::from(from_mm), Point3::from(to_mm));
            InitialStock::cylinder(from, to - from, 0.5 * diameter_mm, (to - from).norm())?
        }
        Stock::File(_) => match &read.0 {
            Some(solid) => InitialStock::mesh(&solid.points, &solid.triangles)?,
            None => return Err(StockError::Empty("file").into()),
        },
    })
}

fn stock_options() -> StockOptions {
    StockOptions {
        chord_mm: STOCK_CHORD_MM,
        narrowest_mm: NARROWEST_MM,
        smallest_box_mm: SMALLEST_BOX_MM,
        // Passes are linked along the surface, and enter through what they are to cut: what that takes away is among the volumes.
        links_clear: false,
        volume_points: VOLUME_POINTS,
        engagement_poses: POSES,
        ..StockOptions::default()
    }
}

fn of_stock(error: StockError) -> VerifyError {
    match error {
        StockError::Stopped => Cancelled.into(),
        other => other.into(),
    }
}

/// Errors where the program runs through stock as it must not.
fn stock_findings(stock: &StockReport) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut find = |code, severity, message: String, hit: &Option<StockHit>| {
        findings.push(Finding { code, severity, message, place: hit.as_ref().map(|hit| hit.at.clone()) });
    };
    if let Some(rapids) = stock.clear.get(&MoveKind::Rapid) {
        let size = |hit: &Option<StockHit>| hit.as_ref().map_or(0.0, |hit| hit.size_mm);
        if rapids.touching > 0 {
            let text = format!(
                "{} of {} rapids run through stock, {:.2} mm of it at most",
                rapids.touching,
                rapids.moves,
                size(&rapids.worst)
            );
            find(FindingCode::RapidInStock, Severity::Error, text, &rapids.worst);
        }
        if rapids.undecided > 0 {
            let text = format!(
                "of {} rapids it could not be decided whether they are clear of stock",
                rapids.undecided
            );
            find(FindingCode::RapidUndecided, Severity::Warning, text, &rapids.worst_undecided);
        }
    }
    if stock.body.touching > 0 {
        let text = format!(
            "shank or holder run through stock on {} of {} moves",
            stock.body.touching, stock.body.moves
        );
        find(FindingCode::BodyInStock, Severity::Error, text, &stock.body.worst);
    }
    findings
}

/// The findings of all operations, each with its name, errors first.
fn joined(job: &Job, program: &Program, all: &[OperationFound], stock: Option<&StockReport>) -> Verdict {
    let of_one = |one: &OperationFound| {
        let name = one.name.clone();
        let named =
            move |finding: Finding| Finding { message: format!("{name}: {}", finding.message), ..finding };
        one.found.verdict.findings.clone().into_iter().map(named).collect::<Vec<_>>()
    };
    let mut findings: Vec<Finding> = all.iter().flat_map(of_one).collect();
    findings.extend(stock.into_iter().flat_map(stock_findings));
    let out_of_order = program.moves.windows(2).find(|w| w[1].op < w[0].op);
    findings.extend(out_of_order.map(|w| Finding {
        code: FindingCode::Order,
        severity: Severity::Error,
        message: format!("move {} goes back to an earlier operation", w[1].seq),
        place: None,
    }));
    let (counted, there) = (job.totals.moves, program.moves.len() as u64);
    findings.extend((counted != there).then(|| Finding {
        code: FindingCode::Totals,
        severity: Severity::Error,
        message: format!("job.json counts {counted} moves, {there} are there"),
        place: None,
    }));
    Verdict::of(findings)
}
