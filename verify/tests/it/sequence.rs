//! Moves that are right one by one, and wrong one after the other.

use crate::synthetic::{HIGH, R, check, count, model, program, rectangle, straight, whole};
use claymill_nurbs::{Model, Point3};
use claymill_toolpath::MoveKind::{Cut, LeadIn, LeadOut, Link, Rapid};
use claymill_toolpath::{Job, Move, MoveKind, Program, Setup};
use claymill_verify::{FindingCode, Severity, Verification, VerifyError, VerifyOptions, verify_program};

const STEP: f64 = 1.26;

fn plate() -> Model {
    model([rectangle((0.0, 40.0), (0.0, 20.0), 0.0)])
}

/// Rows over the plate, every second one linked to the one before it.
fn rows(model: &Model) -> (Job, Program) {
    let place = |k: u32, x: f64| Point3::new(x, STEP * f64::from(k), R);
    let mut passes = Vec::new();
    for k in 0..17 {
        let (a, b) = if k % 2 == 0 { (0.0, 40.0) } else { (40.0, 0.0) };
        passes.push(straight(Cut, k, place(k, a), place(k, b)));
    }
    let (job, lifted) = whole(model, passes);
    let mut moves: Vec<Move> = Vec::new();
    for m in lifted.moves {
        let k = m.pass;
        if m.kind == Cut && k % 2 == 1 {
            // Back to the end of the pass before, and over to this one.
            while moves.last().is_some_and(|last| last.kind != Cut) {
                moves.pop();
            }
            moves.push(straight(Link, k, place(k - 1, 40.0), place(k, 40.0)));
        }
        moves.push(m);
    }
    counted(job, moves)
}

/// The moves, numbered anew, and the totals that they have.
fn counted(mut job: Job, moves: Vec<Move>) -> (Job, Program) {
    let program = program(moves);
    count(&mut job, &program);
    (job, program)
}

fn codes(v: &Verification) -> Vec<FindingCode> {
    assert_eq!(v.verdict.passed, v.verdict.findings.is_empty(), "{:?}", v.verdict);
    assert!(v.verdict.findings.iter().all(|f| f.severity == Severity::Error), "{:?}", v.verdict);
    v.verdict.findings.iter().map(|f| f.code).collect()
}

/// Verifies the rows with a fault; where the totals are asked for, they are those of the faulty moves.
fn faulty(recount: bool, fault: impl FnOnce(&mut Vec<Move>)) -> Verification {
    let model = plate();
    let (job, program) = rows(&model);
    let mut moves = program.moves;
    fault(&mut moves);
    let mut program = Program { moves };
    let mut job = job;
    if recount {
        (job, program) = counted(job, program.moves);
    }
    check(&model, &job, &program)
}

fn message(v: &Verification, code: FindingCode) -> &str {
    let found = v.verdict.findings.iter().find(|f| f.code == code);
    &found.unwrap_or_else(|| panic!("no {code:?} in {:?}", v.verdict)).message
}

#[test]
fn a_whole_job_has_no_fault() {
    let v = faulty(false, |_| ());
    assert_eq!(codes(&v), [], "{:?}", v.verdict);
    let sequence = v.sequence.unwrap();
    assert!(sequence.moves > 60 && sequence.largest_jump_mm < 1e-9);
}

#[test]
fn passes_alone_are_no_job() {
    let v = faulty(false, |moves| moves.retain(|m| m.kind == Cut));
    let found = codes(&v);
    for code in [FindingCode::Jump, FindingCode::Order, FindingCode::Retract, FindingCode::Totals] {
        assert!(found.contains(&code), "{code:?} is not in {found:?}");
    }
    // Whoever adapts the totals and the numbers does not pass either.
    let v = faulty(true, |moves| moves.retain(|m| m.kind == Cut));
    assert_eq!(codes(&v), [FindingCode::Jump, FindingCode::Retract]);
    assert_eq!(v.sequence.unwrap().jump.count, 16);
}

#[test]
fn without_links_the_tool_jumps() {
    let v = faulty(true, |moves| moves.retain(|m| m.kind != Link));
    assert_eq!(codes(&v), [FindingCode::Jump]);
    let text = message(&v, FindingCode::Jump);
    assert!(
        text.starts_with("8 moves do not begin where the one before ended: move 3 begins 1.2600 mm"),
        "{text}"
    );
    let place = v.verdict.findings[0].place.as_ref().unwrap();
    assert_eq!((place.move_seq, place.point_mm), (Some(3), [40.0, STEP, 0.0]));
}

#[test]
fn a_move_beside_its_place_is_joined_to_nothing() {
    for (by, found) in [(2e-4, true), (0.9e-4, false)] {
        let v = faulty(false, |moves| moves[8].points.iter_mut().for_each(|p| p[0] += by));
        assert_eq!(codes(&v).contains(&FindingCode::Jump), found, "{by}: {:?}", v.verdict);
    }
}

#[test]
fn feeds_are_the_jobs() {
    let v = faulty(false, |moves| moves.iter_mut().for_each(|m| m.feed *= 100.0));
    assert_eq!(codes(&v), [FindingCode::Feed]);
    let sequence = v.sequence.as_ref().unwrap();
    assert_eq!(sequence.feed.count, sequence.moves);
    for kind in [Cut, LeadIn, LeadOut, Link, Rapid] {
        let one = |feed: fn(f64) -> f64| {
            faulty(false, |moves| {
                let m = moves.iter_mut().find(|m| m.kind == kind).unwrap();
                m.feed = feed(m.feed);
            })
        };
        let v = one(|feed| 1.01 * feed);
        assert_eq!(codes(&v), [FindingCode::Feed], "{kind:?}");
        let text = message(&v, FindingCode::Feed);
        assert!(text.contains("mm/min, the job says"), "{text}");
    }
}

#[test]
fn a_feed_that_is_no_number_is_refused() {
    let model = plate();
    for feed in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
        let (job, mut program) = rows(&model);
        program.moves[7].feed = feed;
        let refused = verify_program(&model, &job, &program, &VerifyOptions::default(), &());
        let error = refused.unwrap_err();
        assert!(matches!(error, VerifyError::Move(_)) && error.to_string().contains("move 7"), "{error}");
    }
    let (job, mut program) = rows(&model);
    program.moves[7].points[0][1] = f64::NAN;
    assert!(verify_program(&model, &job, &program, &VerifyOptions::default(), &()).is_err());
}

#[test]
fn moves_in_each_others_places_are_out_of_order() {
    let at = |kind: MoveKind| rows(&plate()).1.moves.iter().position(|m| m.kind == kind).unwrap();
    // As they were written, and with the numbers of their new places.
    for recount in [false, true] {
        let v = faulty(recount, |moves| moves.swap(at(Cut), at(Cut) + 1));
        let found = codes(&v);
        assert!(found.contains(&FindingCode::Jump), "{found:?}");
        assert!(found.contains(&FindingCode::Order), "{found:?}");
    }
    let v = faulty(true, |moves| moves[at(LeadIn)].kind = Rapid);
    assert!(message(&v, FindingCode::Order).ends_with("a cut, follows a rapid"), "{:?}", v.verdict);
}

#[test]
fn a_move_is_not_there_twice_nor_missing() {
    let v = faulty(false, |moves| {
        moves.pop();
    });
    assert!(codes(&v).contains(&FindingCode::Totals) && codes(&v).contains(&FindingCode::Retract));
    let v = faulty(false, |moves| moves.insert(3, moves[3].clone()));
    assert!(codes(&v).contains(&FindingCode::Totals) && codes(&v).contains(&FindingCode::Order));
    // A whole pass with its ways, cleanly taken out.
    let v = faulty(false, |moves| {
        let last = moves.iter().rposition(|m| m.kind == Cut && m.pass == 16).unwrap();
        moves.drain(last - 3..);
    });
    assert!(message(&v, FindingCode::Totals).contains("moves"), "{:?}", v.verdict);
}

/// The plate from above, and a wall that another setup cuts.
fn two_setups() -> (Model, Job, Vec<Move>, Vec<Move>) {
    let wall = rectangle((0.0, 20.0), (0.0, 40.0), 0.0).mapped(|p| Point3::new(-40.0, p.y, p.x - 40.0));
    let model = model([rectangle((0.0, 40.0), (0.0, 20.0), 0.0), wall]);
    let (mut job, above) = rows(&model);
    let aside = Setup {
        name: "left".into(),
        axis: [-1.0, 0.0, 0.0],
        quaternion: None,
        clearance_mm: HIGH,
        area_mm2: 0.0,
        time_s: 0.0,
    };
    job.setups.push(aside);
    // The same moves, turned about the axis along y.
    let turned = above.moves.iter().map(|m| {
        let mut m = m.clone();
        m.setup = "left".into();
        (m.axis_start, m.axis_end) = ([-1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]);
        m.points.iter_mut().for_each(|p| *p = [-40.0 - p[2], p[1], p[0] - 40.0]);
        m
    });
    let beside = turned.collect();
    (model, job, above.moves, beside)
}

#[test]
fn setups_follow_each_other() {
    let (model, job, above, beside) = two_setups();
    let verdict = |moves: Vec<Move>| {
        let (job, program) = counted(job.clone(), moves);
        check(&model, &job, &program)
    };
    let whole = verdict([above.clone(), beside.clone()].concat());
    let sequence = whole.sequence.unwrap();
    assert_eq!(
        [sequence.order.count, sequence.jump.count, sequence.retract.count, sequence.totals.count],
        [0; 4],
        "{:?}",
        whole.verdict
    );
    // The other way round, one within the other, and one of them not at all.
    let v = verdict([beside.clone(), above.clone()].concat());
    assert!(
        message(&v, FindingCode::Order).contains("goes back to setup top from setup left"),
        "{:?}",
        v.verdict
    );
    let half = above.len() / 2;
    let v = verdict([&above[..half], &beside[..], &above[half..]].concat());
    let sequence = v.sequence.as_ref().unwrap();
    assert!(sequence.order.count == 1 && sequence.retract.count == 2, "{sequence:?}");
    let v = verdict(above.clone());
    assert_eq!(message(&v, FindingCode::Order), "setup left has no moves");

    // Without its last way up the tool would be taken away in the cut; without the first down it would come from anywhere.
    let (down, up) = (&beside[1..], &above[..above.len() - 1]);
    let v = verdict([up, &beside[..]].concat());
    assert!(message(&v, FindingCode::Retract).contains("setup top does not end"), "{:?}", v.verdict);
    let v = verdict([&above[..], down].concat());
    assert!(message(&v, FindingCode::Retract).contains("setup left does not begin"), "{:?}", v.verdict);
    // Up, but not above everything.
    let mut low = above.clone();
    let last = low.last_mut().unwrap();
    last.points[1][2] -= 1.0;
    let v = verdict([low, beside].concat());
    assert!(message(&v, FindingCode::Retract).contains("setup top does not end"), "{:?}", v.verdict);
}
