//! What a machine does not reach is named with its move, and the remedy is one.

use claymill_controller::{
    AxisName, Dialect, Machine, MachineJob, PostError, SetupPlace, Spindle, post, travel,
};

use crate::job;

fn findings(machine: &Machine) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let job = job::job(&job::curves(), machine);
    match post(&job, Dialect::Siemens, machine, &folder.path().join("part.mpf"), &|_| ()) {
        Ok(_) => Vec::new(),
        Err(PostError::Limits(found)) => found,
        Err(other) => panic!("{other}"),
    }
}

#[test]
fn a_zero_that_is_proposed_is_one_from_which_all_is_reached() {
    // The job's X runs from -64 to 0; this machine's from 100 to 170.
    let mut machine = Machine { axes: [(AxisName::X, [100.0, 170.0])].into(), ..Machine::default() };
    for setup in ["top", "left"] {
        let found = findings(&machine);
        let named = format!("axis-limit: setup {setup}: X");
        assert!(found.iter().any(|f| f.starts_with(&named) && f.contains("(move ")), "{setup}: {found:?}");
        let remedy = found.iter().find(|f| f.contains(&format!("[setups.{setup}] zero_mm = ["))).unwrap();
        let (_, numbers) = remedy.split_once("zero_mm = [").unwrap();
        let zero: Vec<f64> = numbers.trim_end_matches(']').split(", ").map(|n| n.parse().unwrap()).collect();
        let place = SetupPlace { work_offset: None, zero_mm: zero.try_into().unwrap() };
        machine.setups.insert(setup.into(), place);
    }
    assert_eq!(findings(&machine), [""; 0]);
}

#[test]
fn retracts_count_and_what_is_too_long_is_cut() {
    // Everything is cut below 40 mm; the clearance height is 60.
    let low = Machine { axes: [(AxisName::Z, [-100.0, 50.0])].into(), ..Machine::default() };
    let found = findings(&low);
    assert!(found[0].contains("Z 60.0000 mm (on its way up) is above 50"), "{found:?}");
    let short = Machine { axes: [(AxisName::X, [0.0, 30.0])].into(), ..Machine::default() };
    let found = findings(&short);
    assert!(found.iter().any(|f| f.contains("in 3 parts along it")), "{found:?}");
}

#[test]
fn a_speed_that_the_spindle_has_not_is_named() {
    let spindle = Spindle { speed_rpm: 24_000.0, max_rpm: Some(18_000.0), ..Spindle::default() };
    let found = findings(&Machine { spindle, ..Machine::default() });
    assert!(found[0].starts_with("spindle-limit: setup top: T1 turns at 24000"), "{found:?}");
}

#[test]
fn the_travel_of_a_section_is_that_of_its_moves_and_its_ways() {
    let machine = Machine::default();
    let job: MachineJob = job::job(&job::curves(), &machine);
    let [x, _, z] = travel(&job.sections[0], &machine);
    assert_eq!((x.range_mm, z.range_mm[1], z.at[1]), ([-64.0, 0.0], 160.0, None));
}
