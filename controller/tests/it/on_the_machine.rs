//! What the operator meets: where the tool waits, which number it has, which zero counts, whether the spindle turns, and what
//! the header says of the job.

use std::fs;
use std::path::Path;

use claymill_controller::{
    AxisName, Dialect, Machine, PostTotals, SetupPlace, Spindle, ToolPlace, Units, moves_of, post,
};

use crate::job;

/// The program of two setups, held against its job by its own reader.
fn written(dialect: Dialect, machine: &Machine, notes: &[&str]) -> (PostTotals, String) {
    let folder = tempfile::tempdir().unwrap();
    let mut job = job::job(&job::curves(), machine);
    job.notes = notes.iter().map(|&note| note.to_owned()).collect();
    let out = folder.path().join("part.nc");
    let totals = post(&job, dialect, machine, &out, &|_| ()).unwrap_or_else(|e| panic!("{dialect}: {e}"));
    let (_, found) = moves_of(&job, std::slice::from_ref(&out), dialect, machine).unwrap();
    assert_eq!((found.missing, found.feed_differs), (0, 0), "{dialect}");
    (totals, fs::read_to_string(out).unwrap())
}

/// Lines of a program that begin so, line numbers aside.
fn places(text: &str, wanted: &str) -> Vec<usize> {
    let bare = |line: &str| line.trim_start_matches(|c: char| c.is_ascii_digit()).trim_start().to_owned();
    text.lines().enumerate().filter(|(_, l)| bare(l).starts_with(wanted)).map(|(i, _)| i).collect()
}

/// Blocks that go up out of the way, that stop, and that end.
fn signs(dialect: Dialect) -> Option<[&'static str; 3]> {
    Some(match dialect {
        Dialect::Fanuc | Dialect::Mitsubishi => ["G91 G28 Z0.", "M0", "M30"],
        Dialect::LinuxCnc29 | Dialect::LinuxCnc210 => ["G0 Z160.", "M0", "M2"],
        Dialect::Siemens | Dialect::Beckhoff | Dialect::G1 => ["G0 Z160.", "M0", "M30"],
        Dialect::Heidenhain => ["L Z+160 R0 FMAX", "STOP M5", "L M30"],
        Dialect::AptCatia | Dialect::AptCreo => ["GOTO/", "STOP", "FINI"],
        Dialect::StepNc => return None,
    })
}

#[test]
fn the_tool_is_out_of_the_way_before_a_stop_and_at_the_end() {
    for dialect in Dialect::ALL {
        let (totals, text) = written(dialect, &Machine::default(), &[]);
        assert!(
            text.contains(&format!("before a stop, a tool change and the end: {}", totals.retreat)),
            "{text}"
        );
        let Some([up, stop, end]) = signs(dialect) else { continue };
        let (up, stop, end) = (places(&text, up), places(&text, stop), places(&text, end));
        assert_eq!((stop.len(), end.len()), (1, 1), "{dialect}: {text}");
        // Nothing moves between.
        let moves = |i: usize| {
            let line = text.lines().nth(i).unwrap();
            line.contains(" X") || line.contains("GOTO") || line.contains("SPL") || line.contains(" Z")
        };
        for at in [stop[0], end[0]] {
            let last = *up.iter().rfind(|i| **i < at).unwrap_or_else(|| panic!("{dialect}: {text}"));
            assert!(at - last <= 4 && (last + 1..at).all(|i| !moves(i)), "{dialect}: {last} {at}\n{text}");
        }
        if matches!(dialect, Dialect::AptCatia | Dialect::AptCreo) {
            let before = |at: usize| text.lines().take(at).filter(|l| l.starts_with("GOTO")).last().unwrap();
            assert!(before(stop[0]).ends_with(",160.") && before(end[0]).ends_with(",160."), "{text}");
        }
    }
}

#[test]
fn the_retreat_is_as_high_as_asked_and_as_the_machine_reaches() {
    let over = |machine: Machine| written(Dialect::G1, &machine, &[]).1;
    assert_eq!(places(&over(Machine { retreat_mm: 30.0, ..Machine::default() }), "G0 Z90.").len(), 2);
    let axes = [(AxisName::Z, [-500.0, 120.0])].into();
    assert_eq!(places(&over(Machine { axes, ..Machine::default() }), "G0 Z120.").len(), 2);
    let none = over(Machine { retreat_mm: 0.0, ..Machine::default() });
    assert!(places(&none, "G0 Z160.").is_empty(), "{none}");
    // The shop's own way goes before.
    let home = Some(vec!["G53 G0 Z0".to_owned()]);
    let own = over(Machine { home, ..Machine::default() });
    assert!(places(&own, "G0 Z160.").is_empty() && places(&own, "G53 G0 Z0").len() == 3, "{own}");
    assert!(
        own.contains("the end: the machine_s own blocks")
            || own.contains("the end: the machine's own blocks")
    );
}

#[test]
fn no_speed_is_written_that_nobody_gave() {
    for dialect in Dialect::ALL {
        let (_, silent) = written(dialect, &Machine::default(), &[]);
        for word in ["S0", "S12000", "M3\n", "M4\n", "SPINDL/1", "SPINDL/0", ".TCP.,$,0."] {
            assert!(!silent.contains(word), "{dialect}: {word} in\n{silent}");
        }
        assert!(silent.contains("no spindle speed is known"), "{dialect}");
        let spindle = Spindle { speed_rpm: 9000.0, ..Spindle::default() };
        let (_, told) = written(dialect, &Machine { spindle, ..Machine::default() }, &[]);
        assert!(told.contains("9000") || told.contains(".TCP.,$,150."), "{dialect}: {told}");
        assert!(!told.contains("no spindle speed is known"), "{dialect}");
        // That of a tool goes before that of the spindle.
        let tools = [("T1".to_owned(), ToolPlace { number: None, speed_rpm: Some(6000.0) })].into();
        let (_, own) = written(dialect, &Machine { spindle, tools, ..Machine::default() }, &[]);
        assert!(own.contains("6000") || own.contains(".TCP.,$,100."), "{dialect}: {own}");
    }
}

#[test]
fn tools_and_zeros_have_the_numbers_of_the_machine() {
    let machine = |offsets: [&str; 2]| {
        let place = |name: &str, offset: &str| {
            (name.to_owned(), SetupPlace { work_offset: Some(offset.to_owned()), ..SetupPlace::default() })
        };
        Machine {
            tools: [("T1".to_owned(), ToolPlace { number: Some(12), speed_rpm: None })].into(),
            setups: [place("top", offsets[0]), place("left", offsets[1])].into(),
            ..Machine::default()
        }
    };
    for (dialect, tool) in [
        (Dialect::Fanuc, "T12 M6"),
        (Dialect::Mitsubishi, "T12 M6"),
        (Dialect::Siemens, "T12 M6"),
        (Dialect::LinuxCnc29, "T12 M6"),
        (Dialect::Beckhoff, "T12 M6"),
        (Dialect::G1, "T12 M6"),
        (Dialect::Heidenhain, "TOOL CALL 12 Z"),
        (Dialect::AptCatia, "LOADTL/12"),
    ] {
        let text = written(dialect, &machine(["G54", "G55"]), &[]).1;
        assert_eq!(places(&text, tool).len(), 2, "{dialect}: {text}");
        assert!(text.contains("setup left tool T12"), "{dialect}: {text}");
        if !matches!(dialect, Dialect::Heidenhain | Dialect::AptCatia) {
            let zeros = [places(&text, "G54"), places(&text, "G55")];
            assert!(zeros.iter().all(|z| z.len() == 1) && zeros[0][0] < zeros[1][0], "{dialect}: {text}");
        }
    }
    assert!(written(Dialect::Fanuc, &machine(["G54", "G55"]), &[]).1.contains("H12"));
    // Further offsets, in each control's own words.
    assert!(written(Dialect::Fanuc, &machine(["G54.1 P5", "G54.1 P6"]), &[]).1.contains("\nG54.1 P6\n"));
    assert!(written(Dialect::Siemens, &machine(["G505", "G599"]), &[]).1.contains("\nG505\n"));
    assert!(written(Dialect::Heidenhain, &machine(["1", "2"]), &[]).1.contains("Q339=+2"));
}

#[test]
fn what_must_be_said_of_a_job_stands_in_every_header() {
    const NOTE: &str = "UNVERIFIED JOB did not pass verification";
    for dialect in Dialect::ALL {
        let (totals, text) = written(dialect, &Machine::default(), &[NOTE]);
        let head: String = text.lines().take(12).collect::<Vec<_>>().join("\n");
        assert!(head.contains(NOTE), "{dialect}: {head}");
        assert_eq!(totals.notes, [NOTE]);
        assert!(!written(dialect, &Machine::default(), &[]).1.contains("UNVERIFIED"));
    }
}

#[test]
fn a_machine_in_inches_needs_no_more_said() {
    let machine = Machine::parse("units = \"inch\"", Path::new("mill.toml")).unwrap();
    assert_eq!(machine.units, Units::Inch);
    for dialect in Dialect::ALL {
        let (totals, _) = written(dialect, &machine, &[]);
        assert!(totals.read_back.largest_mm <= totals.stated_mm, "{dialect}: {totals:?}");
    }
    // Fewer digits than the tolerance needs: said with the figures that help.
    let coarse = Machine { digits: Some(3), ..machine };
    let job = job::job(&job::curves(), &coarse);
    let folder = tempfile::tempdir().unwrap();
    let refused = post(&job, Dialect::Fanuc, &coarse, &folder.path().join("x.nc"), &|_| ()).unwrap_err();
    assert!(refused.to_string().contains("give tolerance_mm = 0.026 or more digits"), "{refused}");
    let better = Machine { tolerance_mm: 0.026, ..coarse };
    let job = job::job(&job::curves(), &better);
    post(&job, Dialect::Fanuc, &better, &folder.path().join("x.nc"), &|_| ()).unwrap();
}
