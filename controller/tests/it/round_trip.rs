//! Every dialect writes every kind of curve, and reads it back within what it states.

use std::collections::BTreeMap;
use std::fs;

use claymill_controller::{
    AxisName, Coolant, Dialect, Files, LineNumbers, Machine, MachineJob, PostError, Rung, Spindle, Units,
    moves_of, post,
};
use claymill_toolpath::{Move, MoveKind, Program};

use crate::job;

fn written(dialect: Dialect, machine: &Machine) -> (claymill_controller::PostTotals, String) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("part.nc");
    let job = job::job(&job::curves(), machine);
    let totals = post(&job, dialect, machine, &out, &|_| ()).unwrap_or_else(|e| panic!("{dialect}: {e}"));
    let text = fs::read_to_string(&totals.files[0].path).unwrap();
    // Verified as a program: the same moves, under the same names.
    let paths: Vec<_> = totals.files.iter().map(|f| f.path.clone()).collect();
    let (program, found) = moves_of(&job, &paths, dialect, machine).unwrap();
    assert_eq!((found.missing, found.largest_mm), (0, totals.read_back.largest_mm));
    assert!(program.moves.iter().all(|m| m.curve().is_ok()));
    (totals, text)
}

#[test]
fn the_example_machines_write_their_jobs() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/machines");
    for (name, dialect) in [
        ("fanuc-30i", Dialect::Fanuc),
        ("siemens-840d", Dialect::Siemens),
        ("heidenhain-itnc", Dialect::Heidenhain),
        ("linuxcnc", Dialect::LinuxCnc29),
        ("mitsubishi-m700v", Dialect::Mitsubishi),
        ("beckhoff-twincat", Dialect::Beckhoff),
        ("plain", Dialect::G1),
    ] {
        let machine = Machine::read(&folder.join(name).with_extension("toml")).unwrap();
        let (totals, _) = written(dialect, &machine);
        assert!(totals.read_back.largest_mm <= totals.stated_mm + 2e-6);
    }
}

#[test]
fn what_is_written_is_the_job() {
    for dialect in Dialect::ALL {
        // Four decimals of an inch are coarser than the usual tolerance.
        for (units, tolerance_mm) in [(Units::Mm, 0.002), (Units::Inch, 0.003)] {
            let (totals, text) = written(dialect, &Machine { units, tolerance_mm, ..Machine::default() });
            let back = &totals.read_back;
            assert!(back.largest_mm <= totals.stated_mm, "{dialect}: {totals:?}");
            assert_eq!((back.missing, back.feed_differs), (0, 0), "{dialect}: {totals:?}");
            assert!(
                text.contains(&format!("{:.6}", back.largest_mm)),
                "{dialect}: the header states the error"
            );
            eprintln!("{dialect} {units:?}: {:?}, {:.6} mm", totals.rungs, back.largest_mm);
        }
    }
}

#[test]
fn the_ladder_is_no_longer_than_it_must_be() {
    let rungs = |dialect, machine: &Machine| written(dialect, machine).0.rungs;
    let usual = Machine::default();
    let count = |r: &BTreeMap<Rung, u64>, rung| r.get(&rung).copied().unwrap_or(0);
    // Degree 4 and 5 are fitted for Fanuc; Siemens takes them and every weight as they are.
    let fanuc = rungs(Dialect::Fanuc, &usual);
    assert_eq!((count(&fanuc, Rung::Nurbs), count(&fanuc, Rung::Polynomial)), (8, 2), "{fanuc:?}");
    let siemens = rungs(Dialect::Siemens, &usual);
    assert_eq!(count(&siemens, Rung::Nurbs), 10, "{siemens:?}");
    // Three rational curves have no weights on a Heidenhain, one has degree 4.
    let heidenhain = rungs(Dialect::Heidenhain, &usual);
    assert_eq!(count(&heidenhain, Rung::Polynomial), 4, "{heidenhain:?}");
    // 2.9 takes curves in G17 only; 2.10 in the other planes too; the curve in space goes as straight moves.
    let old = rungs(Dialect::LinuxCnc29, &usual);
    let new = rungs(Dialect::LinuxCnc210, &usual);
    assert!(count(&old, Rung::Biarcs) > count(&new, Rung::Biarcs), "{old:?} {new:?}");
    assert!(count(&new, Rung::Nurbs) > count(&old, Rung::Nurbs), "{old:?} {new:?}");
    assert!(count(&new, Rung::Chords) >= 1, "{new:?}");
    let plain = rungs(Dialect::G1, &Machine { arcs: false, ..Machine::default() });
    assert_eq!((count(&plain, Rung::Biarcs), count(&plain, Rung::Chords)), (0, 10), "{plain:?}");
}

#[test]
fn line_numbers_and_files() {
    let numbered = Machine { line_numbers: Some(LineNumbers { first: 10, step: 5 }), ..Machine::default() };
    let (_, text) = written(Dialect::Siemens, &numbered);
    assert!(text.contains("N10 G90") && text.contains("N15 T1 M6"), "{text}");
    for files in [Files::Setup, Files::Tool] {
        let (totals, _) = written(Dialect::Fanuc, &Machine { files, ..Machine::default() });
        assert_eq!(totals.files.len(), 2);
    }
    for dialect in Dialect::ALL {
        let small = Machine { max_bytes: Some(4096), ..Machine::default() };
        let (totals, _) = written(dialect, &small);
        assert!(totals.files.iter().all(|f| f.bytes < 200_000), "{dialect}");
    }
}

#[test]
fn what_the_machine_cannot_do_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("part.nc");
    let refused = |machine: Machine, rule: &str| {
        let job = job::job(&job::curves(), &machine);
        match post(&job, Dialect::Fanuc, &machine, &out, &|_| ()) {
            Err(PostError::Refused { refusal, .. }) => assert_eq!(refusal.rule, rule),
            Err(PostError::Limits(found)) => assert!(found[0].starts_with(rule), "{found:?}"),
            other => panic!("{other:?}"),
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "something is left behind");
    };
    refused(Machine { axes: [(AxisName::X, [0.0, 20.0])].into(), ..Machine::default() }, "axis-limit");
    refused(Machine { digits: Some(1), tolerance_mm: 1e-4, ..Machine::default() }, "digits");
}

#[test]
fn the_same_job_gives_the_same_bytes() {
    for dialect in Dialect::ALL {
        let machine = Machine::default();
        assert_eq!(written(dialect, &machine).1, written(dialect, &machine).1);
    }
}

/// What an operator relies on: up before anything is changed or turned, spindle before the way down, what is set up where.
#[test]
fn a_program_begins_stops_and_ends_out_of_the_way() {
    let spindle = Spindle { speed_rpm: 12_000.0, ..Spindle::default() };
    let machine = Machine { coolant: Coolant::Flood, spindle, ..Machine::default() };
    let (_, text) = written(Dialect::Fanuc, &machine);
    let lines: Vec<&str> = text.lines().collect();
    let all = |wanted: &str| -> Vec<usize> {
        lines.iter().enumerate().filter(|(_, l)| l.starts_with(wanted)).map(|(i, _)| i).collect()
    };
    let (home, change, spindle) = (all("G91 G28 Z0."), all("T1 M6"), all("S12000 M3"));
    let (over, cut, coolant) = (all("G0 G43 Z60. H1"), all("G05 P10000"), all("M8"));
    let (off, stop, end) = (all("M5"), all("M0"), all("M30"));
    assert_eq!((home.len(), change.len(), stop.len(), end.len()), (3, 2, 1, 1));
    for i in 0..2 {
        let order = [home[i], change[i], spindle[i], over[i], coolant[i], cut[i], off[i], home[i + 1]];
        assert!(order.is_sorted(), "{order:?}");
    }
    assert!(home[1] < stop[0] && stop[0] < change[1] && home[2] < end[0]);
    assert!(home.iter().all(|i| lines[i + 1] == "G90"));
    assert_eq!(lines[1], "O0001 (PART)");
    assert!(text.contains("(setup left tool T1 ball R6., its tip is programmed)"), "{text}");
    assert!(text.contains("(zero at X0. Y0. Z0. of the model, tool axis -y, lowest Z"), "{text}");
    // Elsewhere the machine definition says where that is, and a Heidenhain's preset.
    let home = Some(vec!["L Z-1 R0 FMAX M91".to_owned()]);
    let machine = Machine { home, work_offset: "3".into(), ..Machine::default() };
    let (_, text) = written(Dialect::Heidenhain, &machine);
    assert_eq!((text.matches("L Z-1 R0 FMAX M91").count(), text.matches("Q339=+3").count()), (3, 2));
}

#[test]
fn a_tool_that_sticks_out_otherwise_is_measured_anew() {
    let folder = tempfile::tempdir().unwrap();
    let machine = Machine::default();
    let mut job = job::job(&job::curves(), &machine);
    let text = |job: &MachineJob| {
        let totals = post(job, Dialect::Fanuc, &machine, &folder.path().join("part.nc"), &|_| ()).unwrap();
        fs::read_to_string(&totals.files[0].path).unwrap()
    };
    assert!(!text(&job).contains("sticks out"));
    job.sections[0].stick_out_mm = Some(42.0);
    job.sections[1].stick_out_mm = Some(42.0);
    let same = text(&job);
    assert_eq!(
        (same.matches("sticks out 42.").count(), same.contains("measure its length anew")),
        (2, false)
    );
    job.sections[1].stick_out_mm = Some(61.0);
    let other = text(&job);
    assert!(other.contains("tool T1 sticks out 61.: measure its length anew"), "{other}");
    assert!(other.contains("ball R6., sticks out 61., its tip is programmed"), "{other}");
}

#[test]
fn a_file_begins_behind_a_retract() {
    let axis = claymill_nurbs::Vector3::z();
    let mut moves = Vec::new();
    let mut from = claymill_nurbs::Point3::new(0.0, 0.0, 60.0);
    for i in 0..200 {
        let (x, y) = (f64::from(i % 10) * 5.0, f64::from(i));
        let ways = [
            (MoveKind::Rapid, [x, y, 30.0]),
            (MoveKind::LeadIn, [x, y, 20.0]),
            (MoveKind::Cut, [x + 9.0, y, 20.0]),
            (MoveKind::LeadOut, [x + 9.0, y, 30.0]),
            (MoveKind::Rapid, [x + 9.0, y, 60.0]),
            (MoveKind::Rapid, [f64::from((i + 1) % 10) * 5.0, y + 1.0, 60.0]),
        ];
        for (kind, to) in ways {
            let m = Move::straight(kind, from, to.into(), axis, 3000.0);
            let (setup, tool) = ("top".to_owned(), "T1".to_owned());
            moves.push(Move { seq: moves.len() as u64, setup, tool, ..m });
            from = to.into();
        }
    }
    let machine = Machine { max_bytes: Some(8192), ..Machine::default() };
    let job = MachineJob::new(job::record(), &Program { moves }, &machine).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let totals = post(&job, Dialect::Fanuc, &machine, &folder.path().join("part.nc"), &|_| ()).unwrap();
    assert!(totals.files.len() > 3, "{totals:?}");
    for (i, file) in totals.files.iter().enumerate() {
        let text = fs::read_to_string(&file.path).unwrap();
        assert!(text.contains(&format!("O{:04} (PART)", i + 1)), "{text}");
        // Straight down to where a move begins: below the clearance height a file would go down to go up.
        assert!(!text.lines().any(|l| l.starts_with("G0 Z")), "{text}");
    }
}
