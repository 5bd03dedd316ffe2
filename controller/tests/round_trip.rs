//! Every dialect writes every kind of curve, and reads it back within what it states.

mod job;

use std::collections::BTreeMap;
use std::fs;

use claymill_controller::{
    AxisName, Dialect, Files, LineNumbers, Machine, PostError, Rung, Units, moves_of, post,
};

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
