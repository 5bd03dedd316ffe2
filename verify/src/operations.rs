//! A job with operations: each is verified by itself, with its own tool and allowance, and all verdicts make one.

use claymill_nurbs::Model;
use claymill_toolpath::{Job, LATEST_FORMAT_VERSION, Monitor, Program};

use crate::error::VerifyError;
use crate::options::VerifyOptions;
use crate::report::{CrestSample, OperationFound, Verification};
use crate::verdict::{Finding, FindingCode, Severity, Verdict};
use crate::{measure_all, sequence};

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
    for (index, operation) in job.operations.iter().enumerate() {
        let Some(part) = job.of_operation(index) else { continue };
        let moves = program.of_operation(index);
        let sequence = sequence::measure(&part, &moves, first_seq);
        first_seq += moves.moves.len() as u64;
        let (found, samples) = measure_all(model, &part, (&moves, Some(sequence)), options, monitor)?;
        if operation.kind.is_of_surface() {
            crests.extend(samples);
        }
        all.push(OperationFound { name: operation.name.clone(), kind: operation.kind, found });
    }
    let main = job.main_operation().and_then(|main| all.get(main)).map(|main| main.found.clone());
    let found =
        main.ok_or_else(|| VerifyError::Unknown { seq: 0, what: "operation", name: "none".to_owned() })?;
    let verdict = joined(job, program, &all);
    Ok((Verification { format_version: LATEST_FORMAT_VERSION, verdict, operations: all, ..found }, crests))
}

/// The findings of all operations, each with its name, errors first.
fn joined(job: &Job, program: &Program, all: &[OperationFound]) -> Verdict {
    let of_one = |one: &OperationFound| {
        let name = one.name.clone();
        let named =
            move |finding: Finding| Finding { message: format!("{name}: {}", finding.message), ..finding };
        one.found.verdict.findings.clone().into_iter().map(named).collect::<Vec<_>>()
    };
    let mut findings: Vec<Finding> = all.iter().flat_map(of_one).collect();
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
    findings.sort_by_key(|finding| finding.severity);
    Verdict { passed: findings.iter().all(|f| f.severity != Severity::Error), findings }
}
