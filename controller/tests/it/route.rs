//! Ways to a move in the middle of a job: what comes after what, how high, how fast.

use claymill_controller::{Approach, Dialect, Machine, MachineJob, Route, Spindle, blocks_of, retreat_of};
use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::MoveKind::{Cut, LeadIn, LeadOut, Link, Rapid};
use claymill_toolpath::{Job, Move, MoveKind, Program};

use crate::job;

/// Of both setups of the job.
const CLEARANCE_MM: f64 = 60.0;
const LEADS: f64 = 3000.0;

/// Two chains in the first setup (the second one of region 1), one in the second:
///
/// ```text
///  0 rapid, 1 lead-in, 2 cut, 3 link, 4 cut, 5 cut, 6 lead-out, 7 rapid, 8 rapid, 9 rapid, 10 lead-in, 11 cut, 12 lead-out,
///  13 rapid │ 14 rapid, 15 lead-in, 16 cut, 17 lead-out, 18 rapid
/// ```
fn program() -> Program {
    let top: &[(MoveKind, usize, [f64; 3])] = &[
        (Rapid, 0, [0., 0., 26.]),
        (LeadIn, 0, [0., 0., 20.]),
        (Cut, 0, [50., 0., 10.]),
        (Link, 0, [50., 1., 10.]),
        (Cut, 0, [30., 1., 12.]),
        (Cut, 0, [0., 1., 20.]),
        (LeadOut, 0, [0., 1., 26.]),
        (Rapid, 1, [0., 1., 40.]),
        (Rapid, 1, [80., 40., 40.]),
        (Rapid, 1, [80., 40., 11.]),
        (LeadIn, 1, [80., 41., 5.]),
        (Cut, 1, [90., 41., 5.]),
        (LeadOut, 1, [90., 41., 11.]),
        (Rapid, 1, [90., 41., 60.]),
    ];
    let left: &[(MoveKind, usize, [f64; 3])] = &[
        (Rapid, 2, [5., -26., 0.]),
        (LeadIn, 2, [5., -20., 0.]),
        (Cut, 2, [50., -20., 0.]),
        (LeadOut, 2, [50., -26., 0.]),
        (Rapid, 2, [50., -60., 0.]),
    ];
    let mut moves: Vec<Move> = Vec::new();
    for (setup, axis, begin, ways) in
        [("top", Vector3::z(), [0., 0., 60.], top), ("left", -Vector3::y(), [5., -60., 0.], left)]
    {
        let mut from = Point3::from(begin);
        for &(kind, region, to) in ways {
            let feed = match kind {
                Rapid => 20_000.0,
                LeadIn | LeadOut => LEADS,
                _ => 6000.0,
            };
            let m = Move::straight(kind, from, to.into(), axis, feed);
            let (seq, setup, tool) = (moves.len() as u64, setup.to_owned(), "T1".to_owned());
            moves.push(Move { seq, setup, tool, region, ..m });
            from = to.into();
        }
    }
    Program { moves }
}

fn record() -> Job {
    let mut job = job::record();
    job.tolerances.insert("clearance_mm".into(), 5.0);
    job
}

fn from(seq: u64, stands: Option<(Point3, Vector3)>) -> Route {
    Route::new(&record(), &program(), |m| m.seq >= seq, stands, None)
}

/// Kind, end and feed of the first moves.
fn begins(route: &Route, count: usize) -> Vec<(MoveKind, [f64; 3], f64)> {
    route.moves[..count].iter().map(|m| (m.kind, m.end().into(), m.feed)).collect()
}

#[test]
fn a_whole_job_is_left_as_it_is() {
    let route = from(0, None);
    assert_eq!((route.moves, route.departs, route.approach), (program().moves, 0, None));
}

#[test]
fn a_cut_behind_a_lead_in_is_come_to_by_it() {
    // Chosen was the cut, its lead-in, or one of the rapids that lead there.
    for seq in 7..=11 {
        let route = from(seq, None);
        let way = [
            (Rapid, [80., 40., 11.], 20_000.0),
            (LeadIn, [80., 41., 5.], LEADS),
            (Cut, [90., 41., 5.], 6000.0),
        ];
        assert_eq!(begins(&route, 3), way, "{seq}");
        assert_eq!(route.moves[0].start(), Point3::new(80.0, 40.0, CLEARANCE_MM));
        let approach = route.approach.unwrap();
        assert!(approach.lead && approach.seq == 11 && approach.over_mm == CLEARANCE_MM, "{approach:?}");
        assert!((approach.plunge_mm - 37_f64.sqrt()).abs() < 1e-9 && approach.feed == LEADS);
    }
}

#[test]
fn a_cut_without_a_lead_in_is_plunged_to_at_the_feed_of_leads_all_the_way() {
    // From the link before it, it is the cut behind the link.
    for seq in [3, 4] {
        let route = from(seq, None);
        let way = [(LeadIn, [50., 1., 10.], LEADS), (Cut, [30., 1., 12.], 6000.0)];
        assert_eq!(begins(&route, 2), way, "{seq}");
        assert_eq!(route.moves[0].start(), Point3::new(50.0, 1.0, CLEARANCE_MM));
        let approach = Approach { seq: 4, over_mm: 60.0, lead: false, plunge_mm: 50.0, feed: LEADS };
        assert_eq!(route.approach, Some(approach));
        assert!(approach.to_string().contains("the last 50.0 mm straight down at 3000 mm/min"));
    }
    assert_eq!(from(5, None).approach.map(|a| (a.seq, a.lead, a.plunge_mm)), Some((5, false, 48.0)));
}

#[test]
fn the_way_at_feed_is_as_long_as_was_said() {
    let begin = |seq, plunge| {
        let route = Route::new(&record(), &program(), |m| m.seq >= seq, None, Some(plunge));
        (begins(&route, 2), route.approach.unwrap().plunge_mm)
    };
    let way = vec![(Rapid, [50., 1., 22.], 20_000.0), (LeadIn, [50., 1., 10.], LEADS)];
    assert_eq!(begin(4, 12.0), (way, 12.0));
    // No more than there is, and no less where the job has a lead-in.
    assert_eq!(begin(4, 80.0).1, 50.0);
    assert_eq!(begin(11, 1.0).0[..2], [(Rapid, [80., 40., 11.], 20_000.0), (LeadIn, [80., 41., 5.], LEADS)]);
}

#[test]
fn from_within_a_cut_it_goes_up_at_feed_then_fast_over_and_down() {
    let stands = Some((Point3::new(20.0, 1.0, 15.0), Vector3::z()));
    let route = from(11, stands);
    let way = [
        (LeadOut, [20., 1., 20.], LEADS),
        (Rapid, [20., 1., 60.], 20_000.0),
        (Rapid, [80., 40., 60.], 20_000.0),
        (Rapid, [80., 40., 11.], 20_000.0),
        (LeadIn, [80., 41., 5.], LEADS),
        (Cut, [90., 41., 5.], 6000.0),
    ];
    assert_eq!(begins(&route, 6), way);
    assert_eq!(route.departs, 2, "tool and spindle are changed above the work");
    // Above everything already: nothing but across; and to another setup it goes up where it is, and the part is turned.
    let above = from(4, Some((Point3::new(20.0, 1.0, 70.0), Vector3::z())));
    assert_eq!(begins(&above, 2), [(Rapid, [50., 1., 70.], 20_000.0), (LeadIn, [50., 1., 10.], LEADS)]);
    assert_eq!(above.departs, 0);
    let turned = from(16, stands);
    assert_eq!(
        begins(&turned, 4)[1..3],
        [(Rapid, [20., 1., 60.], 20_000.0), (Rapid, [5., -26., 0.], 20_000.0)]
    );
    assert_eq!((turned.moves[1].setup.as_str(), turned.moves[2].setup.as_str()), ("top", "left"));
    assert_eq!(turned.moves[2].start(), Point3::new(5.0, -60.0, 0.0));
}

#[test]
fn regions_are_gone_between_over_everything() {
    let route = Route::new(&record(), &program(), |m| m.region != 1, None, None);
    let kinds: Vec<MoveKind> = route.moves.iter().map(|m| m.kind).collect();
    let first = [Rapid, LeadIn, Cut, Link, Cut, Cut, LeadOut, Rapid];
    assert_eq!(kinds, [&first[..], &[Rapid, LeadIn, Cut, LeadOut, Rapid]].concat());
    assert_eq!(route.moves[7].end(), Point3::new(0.0, 1.0, CLEARANCE_MM));
    // One cut alone: down, along, and up.
    let alone = Route::new(&record(), &program(), |m| m.seq == 4, None, None);
    let way = [
        (LeadIn, [50., 1., 10.], LEADS),
        (Cut, [30., 1., 12.], 6000.0),
        (LeadOut, [30., 1., 17.], LEADS),
        (Rapid, [30., 1., 60.], 20_000.0),
    ];
    assert_eq!(begins(&alone, alone.moves.len()), way);
}

/// Whatever is chosen: what follows within a setup begins where the one before it ends; a rapid that the job does not have
/// is never below the clearance height, but on its way down to a lead-in of the job or up.
#[test]
fn no_rapid_leads_into_the_work() {
    let all = program().moves;
    let places = all.iter().map(|m| Some((m.end(), m.axis_end.into()))).chain([None]);
    for stands in places {
        for first in 0..all.len() as u64 {
            for last in first..all.len() as u64 {
                let wanted = |m: &Move| (first..=last).contains(&m.seq) && m.seq % 7 != 4;
                let route = Route::new(&record(), &program(), wanted, stands, None);
                for pair in route.moves.windows(2) {
                    let gap = (pair[1].start() - pair[0].end()).norm();
                    assert!(
                        gap < 1e-3 || pair[0].setup != pair[1].setup,
                        "{first}..{last} {stands:?}: {pair:?}"
                    );
                }
                for (i, m) in route.moves.iter().enumerate() {
                    let height = |p: Point3| Vector3::from(m.axis_end).dot(&p.coords);
                    let (a, b) = (height(m.start()), height(m.end()));
                    let up = b > a && (m.end() - m.start()).norm() - (b - a) < 1e-9;
                    let to_lead = route.moves.get(i + 1).is_some_and(|n| n.kind == LeadIn && all.contains(n));
                    assert!(
                        m.kind != Rapid
                            || all.contains(m)
                            || up
                            || to_lead
                            || a.min(b) >= CLEARANCE_MM - 1e-9,
                        "{first}..{last} {stands:?}: {m:?}"
                    );
                }
                if let Some(m) = route.moves.last() {
                    assert!(Vector3::from(m.axis_end).dot(&m.end().coords) >= CLEARANCE_MM - 1e-9);
                }
            }
        }
    }
}

#[test]
fn linuxcnc_is_told_the_same() {
    let spindle = Spindle { speed_rpm: 12_000.0, ..Spindle::default() };
    let machine = Machine { comments: false, spindle, ..Machine::default() };
    let route = from(4, None);
    let chosen = MachineJob::new(record(), &Program { moves: route.moves }, &machine).unwrap();
    let blocks = blocks_of(&chosen, Dialect::LinuxCnc29, &machine).unwrap();
    let at = |text: &str| {
        blocks.iter().position(|b| b.starts_with(text)).unwrap_or_else(|| panic!("{text}: {blocks:?}"))
    };
    let (spindle, over, across) = (at("S12000 M3"), at("G0 Z60."), at("G0 X-50. Y-1."));
    let (down, cut) = (at("G1 X-50. Y-1. Z10. F3000."), at("G1 X-30. Y-1. Z12. F6000."));
    assert!(spindle < over && over < across && across < down && down + 1 == cut, "{blocks:?}");
    assert!(blocks[across + 1..down].iter().all(|b| !b.contains('Z') || b.contains("Z60.")), "{blocks:?}");
    let retreat = |z| retreat_of(&chosen, Dialect::LinuxCnc29, &machine, z, Some(5.0));
    assert_eq!(retreat(12.5), ["G90 G94 G21", "G1 Z17.5 F3000.", "G0 Z60."]);
    assert_eq!(retreat(58.0)[1..], ["G1 Z60. F3000.", "G0 Z60."]);
    assert!(retreat(60.0).is_empty());
}
