//! Checks moves against the documented form of `toolpaths.jsonl`: numbering, clamped knots,
//! degrees, four decimals, axes, and ends that meet.

use std::collections::BTreeMap;

use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::{Job, Move, MoveKind, Program};

/// Ends and starts of consecutive moves agree within this, mm.
const JOINED_MM: f64 = 1e-9;
/// The format's coordinates have four decimals.
const DECIMALS: f64 = 1e4;

/// Checks every move against the documented form: numbered from 0, a clamped curve, cubic where it cuts, at
/// constant height where it is rapid, along its setup's axis, starting where the one before ended.
///
/// # Errors
/// One sentence for each kind of defect, with the first move that has it.
pub fn check_form(job: &Job, program: &Program) -> Result<(), String> {
    let mut defects = BTreeMap::new();
    let mut before: Option<&Move> = None;
    for (index, m) in program.moves.iter().enumerate() {
        let mut find = |what: &str| {
            defects.entry(what.to_owned()).or_insert(m.seq);
        };
        if m.seq != index as u64 {
            find("is not numbered in order");
        }
        check_curve(m, &mut find);
        let Some(setup) = job.setups.iter().find(|s| s.name == m.setup) else {
            find("names a setup that the job does not have");
            continue;
        };
        if m.axis_start != setup.axis || m.axis_end != setup.axis {
            find("leaves its setup's axis");
        }
        // Controls move the axes of a rapid each at its own pace: only across or only up and down is certain.
        let axis = Vector3::from(setup.axis);
        let off = |along: bool| {
            let way = |p: &[f64; 3]| Point3::from(*p) - m.start();
            let part = |d: Vector3| if along { d - axis * d.dot(&axis) } else { axis * d.dot(&axis) };
            m.points.iter().map(|p| part(way(p)).norm()).fold(0.0, f64::max)
        };
        if m.kind == MoveKind::Rapid && off(true).min(off(false)) > JOINED_MM {
            find("is rapid and neither level nor along the axis");
        }
        if let Some(b) = before.filter(|b| b.setup == m.setup)
            && (b.end() - m.start()).norm() > JOINED_MM
        {
            find("does not start where the one before ended");
        }
        before = Some(m);
    }
    if defects.is_empty() {
        return Ok(());
    }
    Err(defects.iter().map(|(what, seq)| format!("move {seq} {what}")).collect::<Vec<_>>().join("; "))
}

fn check_curve(m: &Move, find: &mut impl FnMut(&str)) {
    let p = m.degree;
    if (m.kind == MoveKind::Cut && p != 3) || ![1, 3].contains(&p) {
        find("has the wrong degree");
    }
    if m.points.len() <= p || m.knots.len() != m.points.len() + p + 1 {
        find("has counts that make no curve");
        return;
    }
    let clamped = |ends: &[f64]| ends.iter().all(|k| *k == ends[0]);
    if !clamped(&m.knots[..=p]) || !clamped(&m.knots[m.points.len()..]) {
        find("is not clamped");
    }
    if m.knots.windows(2).any(|w| w[1] < w[0]) || m.knots[p] >= m.knots[m.points.len()] {
        find("has knots that do not rise");
    }
    let written = |x: &f64| ((x * DECIMALS).round() / DECIMALS - x).abs() < 1e-9;
    if !m.points.iter().flatten().chain(&m.knots).all(written) {
        find("has more than four decimals");
    }
    if !(m.feed.is_finite() && m.feed > 0.0) {
        find("has no feed");
    }
}
