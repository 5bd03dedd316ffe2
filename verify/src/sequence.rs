//! Holds the order of moves against the job: ends that meet, kinds that may follow each other,
//! feeds, setups and totals. The geometry of moves is measured elsewhere.

use claymill_nurbs::Vector3;
use claymill_toolpath::{Job, LengthByKind, Move, MoveKind, Program, Setup, WRITTEN_STEP_MM};

use crate::report::{Fault, Place, Sequence};

/// Ends that meet may differ by the last written digit of each coordinate, mm.
const MEETS_MM: f64 = 1.01 * WRITTEN_STEP_MM;
/// Feeds are what the job says within this share.
const SAME_FEED: f64 = 1e-6;
/// Sums of lengths agree within the last written digit of every move.
const SAME_LENGTH_MM: f64 = WRITTEN_STEP_MM;

/// Holds the moves, one after the other, against the job that they are said to be:
///
/// ```text
///   setup A  rapid… lead in… cut… link… cut … lead out… rapid   setup B  rapid …
///            └ each begins where the one before ended ┘    └ above everything ┘
/// ```
///
/// The first move has the number `first_seq`.
pub(crate) fn measure(job: &Job, program: &Program, first_seq: u64) -> Sequence {
    let mut found = Sequence { moves: program.moves.len() as u64, ..Sequence::default() };
    let mut last: Option<&Move> = None;
    for (index, m) in program.moves.iter().enumerate() {
        numbered(first_seq + index as u64, m, &mut found);
        fed(job, m, &mut found);
        match last.filter(|before| before.setup == m.setup) {
            Some(before) => {
                joined(before, m, &mut found);
                ordered(job, before, m, &mut found);
            }
            None => {
                if let Some(before) = last {
                    left(job, before, &mut found);
                }
                entered(job, last, m, &mut found);
            }
        }
        last = Some(m);
    }
    if let Some(m) = last {
        left(job, m, &mut found);
    }
    for setup in job.setups.iter().filter(|s| !program.moves.iter().any(|m| m.setup == s.name)) {
        note(&mut found.order, None, || format!("setup {} has no moves", setup.name));
    }
    whole(job, program, &mut found);
    found
}

/// Counts a fault, and keeps the first.
fn note(fault: &mut Fault, at: Option<&Move>, what: impl FnOnce() -> String) {
    fault.count += 1;
    if fault.first.is_none() {
        fault.first = Some(what());
        fault.first_at = at.map(place);
    }
}

/// Where a move begins.
fn place(m: &Move) -> Place {
    Place {
        point_mm: m.start().into(),
        move_seq: Some(m.seq),
        parameter: m.knots.first().copied(),
        face: None,
        entity: None,
    }
}

fn numbered(index: u64, m: &Move, found: &mut Sequence) {
    if m.seq != index {
        note(&mut found.order, Some(m), || format!("move {} stands in place {index}", m.seq));
    }
}

/// Whether a move runs as fast as the job says for its kind; leads that go on along a pass are cut at its feed.
fn fed(job: &Job, m: &Move, found: &mut Sequence) {
    let asked = &job.request;
    let is = |feed: f64| (m.feed - feed).abs() <= SAME_FEED * feed;
    let (right, said) = match m.kind {
        MoveKind::Cut | MoveKind::Link => (is(asked.feed_mm_per_min), asked.feed_mm_per_min),
        MoveKind::Rapid => (is(asked.rapid_mm_per_min), asked.rapid_mm_per_min),
        MoveKind::LeadIn | MoveKind::LeadOut => match asked.lead_mm_per_min {
            Some(lead) => (is(lead) || is(asked.feed_mm_per_min), lead),
            // Jobs of earlier versions do not say: no lead is faster than a rapid.
            None => (m.feed <= (1.0 + SAME_FEED) * asked.rapid_mm_per_min, asked.rapid_mm_per_min),
        },
    };
    if !right {
        note(&mut found.feed, Some(m), || {
            format!("move {}, a {}, has feed {} mm/min, the job says {said}", m.seq, words(m.kind), m.feed)
        });
    }
}

fn joined(before: &Move, m: &Move, found: &mut Sequence) {
    let apart = m.start() - before.end();
    found.largest_jump_mm = found.largest_jump_mm.max(apart.norm());
    // What is no number is no place either.
    let meets = apart.amax() <= MEETS_MM;
    if !meets {
        note(&mut found.jump, Some(m), || {
            format!("move {} begins {:.4} mm from where move {} ended", m.seq, apart.norm(), before.seq)
        });
    }
}

/// Which kinds may follow which. A pass is begun and left by leads or links; only leads turn into rapids and back. On a level an entry
/// ends on ground that it cleared itself, from where the tool goes on as from a pass.
fn ordered(job: &Job, before: &Move, m: &Move, found: &mut Sequence) {
    use MoveKind::{Cut, LeadIn, LeadOut, Link, Rapid};
    let follows = match before.kind {
        Rapid => matches!(m.kind, Rapid | LeadIn),
        LeadIn if job.request.levels.is_some() => m.kind != Rapid,
        LeadIn => matches!(m.kind, LeadIn | Cut),
        Cut => matches!(m.kind, Cut | Link | LeadOut),
        Link => matches!(m.kind, Link | Cut | LeadIn),
        LeadOut => matches!(m.kind, LeadOut | Link | Rapid),
    };
    if !follows {
        note(&mut found.order, Some(m), || {
            format!("move {}, a {}, follows a {}", m.seq, words(m.kind), words(before.kind))
        });
    }
}

/// The first move of a setup comes from above everything, and setups follow each other as the job lists them.
fn entered(job: &Job, last: Option<&Move>, m: &Move, found: &mut Sequence) {
    let index = |name: &str| job.setups.iter().position(|s| s.name == name);
    if let Some(before) = last
        && index(&m.setup) < index(&before.setup)
    {
        note(&mut found.order, Some(m), || {
            format!("move {} goes back to setup {} from setup {}", m.seq, m.setup, before.setup)
        });
    }
    if !(m.kind == MoveKind::Rapid && is_above(job, m, m.start().coords)) {
        note(&mut found.retract, Some(m), || {
            format!("setup {} does not begin with a rapid from above everything (move {})", m.setup, m.seq)
        });
    }
}

/// The last move of a setup ends above everything.
fn left(job: &Job, m: &Move, found: &mut Sequence) {
    if !(m.kind == MoveKind::Rapid && is_above(job, m, m.end().coords)) {
        note(&mut found.retract, Some(m), || {
            format!("setup {} does not end with a rapid above everything (move {})", m.setup, m.seq)
        });
    }
}

fn is_above(job: &Job, m: &Move, tip: Vector3) -> bool {
    let height = |setup: &Setup| tip.dot(&Vector3::from(setup.axis)) >= setup.clearance_mm - MEETS_MM;
    job.setups.iter().find(|s| s.name == m.setup).is_some_and(height)
}

/// Whether nothing is missing and nothing was added: the moves come to what the job counted.
fn whole(job: &Job, program: &Program, found: &mut Sequence) {
    let (counted, there) = (job.totals.moves, program.moves.len() as u64);
    if counted != there {
        note(&mut found.totals, None, || format!("job.json counts {counted} moves, {there} are there"));
    }
    let mut length = LengthByKind::default();
    program.moves.iter().for_each(|m| length.add(m.kind, m.length_mm()));
    let said = &job.totals.length;
    let slack_mm = SAME_LENGTH_MM * (1.0 + there as f64);
    for (kind, is, says) in [
        ("cuts", length.cut_mm, said.cut_mm),
        ("leads", length.lead_mm, said.lead_mm),
        ("links", length.link_mm, said.link_mm),
        ("rapids", length.rapid_mm, said.rapid_mm),
    ] {
        let agrees = (is - says).abs() <= slack_mm;
        if !agrees {
            note(&mut found.totals, None, || {
                format!("job.json has {says:.3} mm of {kind}, {is:.3} mm are there")
            });
        }
    }
}

fn words(kind: MoveKind) -> &'static str {
    match kind {
        MoveKind::Cut => "cut",
        MoveKind::LeadIn => "lead in",
        MoveKind::LeadOut => "lead out",
        MoveKind::Link => "link",
        MoveKind::Rapid => "rapid",
    }
}
