use std::collections::BTreeMap;

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
        let height = |p: &[f64; 3]| -> f64 { (0..3).map(|k| p[k] * setup.axis[k]).sum() };
        let (low, high) = m
            .points
            .iter()
            .map(height)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), h| (a.min(h), b.max(h)));
        if m.kind == MoveKind::Rapid && high - low > JOINED_MM {
            find("is rapid and not level");
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
