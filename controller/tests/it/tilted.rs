//! Setups that the machine turns to by itself: tilted planes of the control, and an indexed axis.

use std::fs;
use std::path::{Path, PathBuf};

use claymill_controller::{
    Dialect, Machine, MachineJob, PlaneBy, PostError, Tilting, check, compare, moves_of, post,
};
use claymill_nurbs::{Curve3, Point3, Vector3};
use claymill_toolpath::{Move, MoveKind, Program, RotaryAxis, round_to_written};

use crate::job;

/// Integers of a turn that is about no axis, and of one whose axis is (½, ½, √½) to nine digits.
const ODD: [i64; 4] = [9, 2, -3, 4];
const LEAN: [i64; 4] = [9_238_795, -2_705_981, 2_705_981, 0];

fn axes(q: [i64; 4]) -> [Vector3; 3] {
    let [a, b, c, d] = q.map(|q| q as f64);
    let n = a * a + b * b + c * c + d * d;
    let x = Vector3::new(a * a + b * b - c * c - d * d, 2.0 * (b * c + a * d), 2.0 * (b * d - a * c)) / n;
    let y = Vector3::new(2.0 * (b * c - a * d), a * a - b * b + c * c - d * d, 2.0 * (c * d + a * b)) / n;
    [x, y, x.cross(&y)]
}

/// Two setups off the axes after one from above, as a job that stands upright.
fn tilted(machine: &Machine) -> (MachineJob, Program) {
    let mut record = job::record();
    record.model.box_mm = [-60.0, -60.0, 0.0, 60.0, 60.0, 50.0];
    for (name, quaternion) in [("odd", ODD), ("lean", LEAN)] {
        let [_, _, z] = axes(quaternion);
        let mut setup = record.setups[0].clone();
        (setup.name, setup.axis, setup.quaternion) = (name.into(), z.into(), Some(quaternion));
        setup.clearance_mm = 120.0;
        record.setups.push(setup);
    }
    let top: Vec<_> = job::curves().into_iter().filter(|(setup, _)| *setup == "top").collect();
    let turned = |q: [i64; 4]| {
        let [x, y, z] = axes(q);
        top.iter().map(move |(_, curve)| {
            let at = |p: &Point3| Point3::from((x * p.x + y * p.y + z * p.z).map(round_to_written));
            let points = curve.points().iter().map(at).collect();
            Curve3::new(curve.knots().clone(), points, curve.weights().map(<[f64]>::to_vec)).unwrap()
        })
    };
    let mut curves = top.clone();
    curves.extend(turned(ODD).map(|c| ("odd", c)));
    curves.extend(turned(LEAN).map(|c| ("lean", c)));
    let axis_of = |setup: &str| match setup {
        "odd" => axes(ODD)[2],
        "lean" => axes(LEAN)[2],
        _ => Vector3::z(),
    };
    let program = job::program_along(&curves, &axis_of);
    (MachineJob::new(record, &program, machine).unwrap(), program)
}

fn control() -> Machine {
    Machine { tilt: Tilting { by: PlaneBy::Control, ..Tilting::default() }, ..Machine::default() }
}

/// The largest distance of the ends of cuts of a program that was read from those of the job, model mm.
fn far_mm(read: &Program, job: &Program) -> f64 {
    let mut worst = 0.0_f64;
    for m in job.moves.iter().filter(|m| m.kind == MoveKind::Cut) {
        let of = |m: &Move| m.seq;
        let found: Vec<&Move> =
            read.moves.iter().filter(|r| of(r) == m.seq && r.kind == MoveKind::Cut).collect();
        let (first, last) = (found[0], found[found.len() - 1]);
        let gap = |a: [f64; 3], b: [f64; 3]| (Point3::from(a) - Point3::from(b)).norm();
        worst = worst.max(gap(first.points[0], m.points[0]));
        worst = worst.max(gap(*last.points.last().unwrap(), *m.points.last().unwrap()));
    }
    worst
}

fn written(
    folder: &Path,
    dialect: Dialect,
    machine: &Machine,
) -> (String, PathBuf, MachineJob, Program, f64) {
    let out = folder.join("part.nc");
    let (job, program) = tilted(machine);
    let totals = post(&job, dialect, machine, &out, &|_| ()).unwrap_or_else(|e| panic!("{dialect}: {e}"));
    assert!(totals.read_back.largest_mm <= totals.stated_mm, "{dialect}: {totals:?}");
    (fs::read_to_string(&out).unwrap(), out, job, program, totals.stated_mm)
}

#[test]
fn tilted_setups_are_the_control_s_planes() {
    for (dialect, plane, ends, stop) in [
        (Dialect::Siemens, "CYCLE800(1,\"\",0,57,0,0,0,", "CYCLE800()", "M0"),
        (Dialect::Fanuc, "G68.2 X0. Y0. Z0. I", "G69", "M0"),
        (Dialect::Heidenhain, "PLANE SPATIAL SPA", "PLANE RESET TURN FMAX", "STOP"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let machine = control();
        let (text, out, job, program, stated_mm) = written(folder.path(), dialect, &machine);
        let lines: Vec<&str> = text.lines().collect();
        let turned = lines.iter().filter(|l| l.contains(plane)).count();
        assert!(turned >= 2 && text.contains(ends), "{dialect}: {text}");
        assert!(!lines.contains(&stop), "{dialect}: the part is turned by hand:\n{text}");
        // What is read is where the job is, in the model, whatever the digits of the angles.
        let files = vec![out.clone()];
        let (read, found) = moves_of(&job, &files, dialect, &machine).unwrap();
        assert_eq!(found.missing, 0, "{dialect}");
        let far = far_mm(&read, &program);
        assert!(far <= stated_mm + 2e-6, "{dialect}: {far} mm");
        eprintln!("{dialect}: {far:.6} mm in the model, stated {stated_mm:.6}");
        // Without the machine definition too: the header tells.
        assert_eq!(moves_of(&job, &files, dialect, &Machine::default()).unwrap().1.missing, 0);
        // A plane a hundredth of a degree beside is found.
        let beside = match dialect {
            Dialect::Siemens => text.replacen("57,0,0,0,-", "57,0,0,0,-1", 1),
            Dialect::Fanuc => text.replacen("Z0. I", "Z0. I1", 1),
            _ => text.replacen("SPB+", "SPB+1", 1),
        };
        assert_ne!(beside, text, "{dialect}");
        fs::write(&out, beside).unwrap();
        let worse = compare(&job, &files, dialect, &machine).unwrap();
        assert!(worse.largest_mm > 2.0 * stated_mm, "{dialect}: {worse:?}");
    }
}

#[test]
fn inches_have_planes_too() {
    for dialect in [Dialect::Siemens, Dialect::Fanuc, Dialect::Heidenhain] {
        let folder = tempfile::tempdir().unwrap();
        let machine = Machine { units: claymill_controller::Units::Inch, tolerance_mm: 0.003, ..control() };
        let (_, out, job, program, stated_mm) = written(folder.path(), dialect, &machine);
        let (read, _) = moves_of(&job, &[out], dialect, &machine).unwrap();
        assert!(far_mm(&read, &program) <= stated_mm + 2e-6, "{dialect}");
    }
}

#[test]
fn jobs_along_the_axes_keep_their_bytes() {
    for dialect in Dialect::ALL {
        let folder = tempfile::tempdir().unwrap();
        let text = |machine: &Machine| {
            let out = folder.path().join("part.nc");
            post(&job::job(&job::curves(), machine), dialect, machine, &out, &|_| ()).unwrap();
            fs::read_to_string(out).unwrap()
        };
        assert_eq!(text(&control()), text(&Machine::default()), "{dialect}");
    }
}

#[test]
fn controls_without_planes_have_a_stop_and_say_so() {
    for dialect in [Dialect::G1, Dialect::Beckhoff, Dialect::Mitsubishi, Dialect::LinuxCnc29] {
        let folder = tempfile::tempdir().unwrap();
        let (text, ..) = written(folder.path(), dialect, &control());
        assert!(text.contains("no tilted planes for this control"), "{dialect}: {text}");
        assert_eq!(text.lines().filter(|l| *l == "M0").count(), 2, "{dialect}");
    }
}

#[test]
fn planes_that_are_left_open_or_not_taken_up_are_refused() {
    let fanuc = |body: &str| {
        let text = format!("G90 G94 G21\nG0 Z100.\nG0 X0. Y0.\n{body}\nM30\n");
        check(&text, Dialect::Fanuc, &Machine::default()).map_err(|(_, r)| r.rule)
    };
    const ON: &str = "G68.2 X0. Y0. Z0. I30. J45. K0.";
    const MOVES: &str = "G0 Z10.\nG0 X0. Y0.\nG1 X10. F600.";
    assert_eq!(fanuc(&format!("{ON}\nG53.1\n{MOVES}\nG69")), Ok(1));
    for (body, rule) in [
        (format!("{ON}\n{MOVES}\nG69"), "fanuc-g53.1"),
        (format!("G53.1\n{MOVES}"), "fanuc-g53.1"),
        (format!("{ON}\nG53.1\n{MOVES}"), "plane-open"),
        (format!("{ON}\nG53.1\n{ON}\nG53.1\n{MOVES}\nG69"), "tilted-plane"),
        (format!("G68.2 X0. Y0. I30. J45. K0.\nG53.1\n{MOVES}\nG69"), "tilted-plane"),
        // Where the tool is after the turn nobody knows.
        (format!("{ON}\nG53.1\nG1 X10. F600.\nG69"), "position"),
    ] {
        assert_eq!(fanuc(&body), Err(rule), "{body}");
    }
    let siemens = |body: &str| {
        let text = format!("G90 G94 G71\nG0 Z100.\nG0 X0. Y0.\n{body}\nM30\n");
        check(&text, Dialect::Siemens, &Machine::default()).map_err(|(_, r)| r.rule)
    };
    assert_eq!(
        siemens(&format!("CYCLE800(1,\"TC1\",0,57,0,0,0,30,45,0,0,0,0,-1,0,1)\n{MOVES}\nCYCLE800()")),
        Ok(1)
    );
    for (call, rule) in [
        ("CYCLE800(1,\"TC1\",0,64,0,0,0,30,45,0,0,0,0,-1,0,1)", "tilted-plane"),
        ("CYCLE800(1,\"TC1\",1,57,0,0,0,30,45,0,0,0,0,-1,0,1)", "tilted-plane"),
        ("CYCLE800(1,\"TC1\",0,57,0,0,0,30,45,0,0,0,9,-1,0,1)", "tilted-plane"),
        ("CYCLE800(1,\"TC1\",0,57,0,0,0,30,45", "tilted-plane"),
        ("CYCLE800(1,\"TC1\",0,57,0,0,0,30,x,0,0,0,0,-1,0,1)", "syntax"),
    ] {
        assert_eq!(siemens(&format!("{call}\n{MOVES}\nCYCLE800()")), Err(rule), "{call}");
    }
    let heidenhain = |body: &str| {
        let text = format!("0 BEGIN PGM A MM\n{body}\n8 END PGM A MM\n");
        check(&text, Dialect::Heidenhain, &Machine::default()).map_err(|(_, r)| r.rule)
    };
    const L: &str = "L Z+10 R0 FMAX\nL X+0 Y+0 R0 FMAX\nL X+10 R0 F600";
    assert_eq!(
        heidenhain(&format!("PLANE SPATIAL SPA+30 SPB+45 SPC+0 TURN FMAX\n{L}\nPLANE RESET STAY")),
        Ok(1)
    );
    for (body, rule) in [
        (format!("PLANE SPATIAL SPA+30 SPB+45 SPC+0 STAY\n{L}\nPLANE RESET STAY"), "tilted-plane"),
        (format!("PLANE SPATIAL SPA+30 SPB+45 TURN FMAX\n{L}\nPLANE RESET STAY"), "tilted-plane"),
        (format!("PLANE VECTOR BX1 TURN FMAX\n{L}"), "tilted-plane"),
        (format!("PLANE SPATIAL SPA+30 SPB+45 SPC+0 TURN FMAX\n{L}"), "plane-open"),
    ] {
        assert_eq!(heidenhain(&body), Err(rule), "{body}");
    }
}

#[test]
fn a_head_that_does_not_come_to_a_setup_is_named() {
    let axis = |direction, travel_deg| RotaryAxis {
        travel_deg,
        direction,
        point_mm: [0.0; 3],
        turns_table: false,
        max_deg_per_min: None,
    };
    let mut machine = control();
    machine.rotary.insert("a".into(), axis([1.0, 0.0, 0.0], [-40.0, 40.0]));
    machine.rotary.insert("c".into(), axis([0.0, 0.0, 1.0], [-360.0, 360.0]));
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("part.nc");
    let (job, _) = tilted(&machine);
    match post(&job, Dialect::Siemens, &machine, &out, &|_| ()) {
        Err(PostError::Limits(found)) => {
            assert!(found.iter().any(|f| f.starts_with("head-limit: setup odd")), "{found:?}");
        }
        other => panic!("{other:?}"),
    }
    machine.rotary.insert("a".into(), axis([1.0, 0.0, 0.0], [-100.0, 100.0]));
    post(&job, Dialect::Siemens, &machine, &out, &|_| ()).unwrap();
}

/// A machine whose A axis turns the part, to the right about +X for a positive angle.
fn indexed() -> Machine {
    let table = RotaryAxis {
        travel_deg: [-200.0, 200.0],
        direction: [1.0, 0.0, 0.0],
        point_mm: [0.0; 3],
        turns_table: true,
        max_deg_per_min: None,
    };
    Machine { rotary: [("a".to_owned(), table)].into(), ..Machine::default() }
}

#[test]
fn setups_around_x_are_one_program_with_an_index() {
    let folder = tempfile::tempdir().unwrap();
    let machine = indexed();
    let out = folder.path().join("part.ngc");
    let curves = job::curves();
    let program = job::program(&curves);
    let mut record = job::record();
    record.model.box_mm = [0.0, -60.0, -80.0, 100.0, 60.0, 50.0];
    let job = MachineJob::new(record, &program, &machine).unwrap();
    let totals = post(&job, Dialect::LinuxCnc29, &machine, &out, &|_| ()).unwrap();
    let text = fs::read_to_string(&out).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert!(!lines.contains(&"M0"), "{text}");
    // X runs against the model's: what looks along -y comes up by a turn to the left about X.
    let at = lines.iter().position(|l| l.starts_with("G0 A") && *l != "G0 A0.").unwrap();
    assert!(lines[at] == "G0 A90." || lines[at] == "G0 A-90.", "{}", lines[at]);
    // Above the corners of the model, 100 mm from X.
    assert_eq!(lines[at - 1], "G0 Z110.", "{text}");
    let (read, found) = moves_of(&job, &[out], Dialect::LinuxCnc29, &machine).unwrap();
    assert_eq!(found.missing, 0);
    assert!(far_mm(&read, &program) <= totals.stated_mm + 2e-6);
    // Stock counts too: a block up to 150 mm from the axis, and its corner is farther.
    let mut blocky = job.clone();
    blocky.job.stock =
        Some(claymill_toolpath::Stock::Block { box_mm: [0.0, -150.0, -80.0, 100.0, 60.0, 200.0] });
    let high = folder.path().join("high.ngc");
    post(&blocky, Dialect::LinuxCnc29, &machine, &high, &|_| ()).unwrap();
    assert!(fs::read_to_string(high).unwrap().contains("\nG0 Z260.\nG0 A"));
    // An index beyond the travel is refused, and A beside other axes too.
    let mut short = indexed();
    short.rotary.get_mut("a").unwrap().travel_deg = [-10.0, 10.0];
    let refused = post(&job, Dialect::LinuxCnc29, &short, &folder.path().join("short.ngc"), &|_| ());
    assert!(matches!(refused, Err(PostError::Refused { .. })), "{refused:?}");
    let rule = |body: &str| {
        let text = format!("G90 G94 G21 G64 P0.002\nG0 Z100.\nG0 X0. Y0.\n{body}\nM2\n");
        check(&text, Dialect::LinuxCnc29, &machine).map_err(|(_, r)| r.rule)
    };
    assert_eq!(rule("G0 A90.\nG1 X1. F600."), Ok(1));
    assert_eq!(rule("G0 A90. X5.\nG1 X1. F600."), Err("index"));
    assert_eq!(rule("G1 A90. F600."), Err("index"));
    assert_eq!(rule("G0 A300."), Err("head-limit"));
}

/// A curve whose last block is shorter than the control's last digit: it belongs to the cut, not to the slower way out.
#[test]
fn the_last_bit_of_a_cut_is_not_the_way_out() {
    let machine = Machine { nurbs: false, ..Machine::default() };
    let mut record = job::record();
    let lean = [9_238_795, -3_826_834, 0, 0];
    let [_, _, z] = axes(lean);
    let mut setup = record.setups[0].clone();
    (setup.name, setup.axis, setup.quaternion, setup.clearance_mm) =
        ("lean".into(), z.into(), Some(lean), 400.0);
    record.setups.push(setup);
    let points = [
        [317.8923, 167.4685, 221.9867],
        [317.5074, 165.804, 223.337],
        [315.2287, 162.3588, 224.9216],
        [311.6185, 160.0518, 224.2809],
        [307.7406, 158.5589, 222.6075],
        [305.605, 158.1333, 221.2894],
        [303.614, 158.0058, 219.7913],
    ];
    let knots = vec![0.0, 0.0, 0.0, 0.0, 6.4888, 12.4164, 12.4164, 19.9149, 19.9149, 19.9149, 19.9149];
    let curve = Curve3::new(
        claymill_nurbs::KnotVector::new(3, knots).unwrap(),
        points.map(Point3::from).to_vec(),
        None,
    )
    .unwrap();
    let end = Point3::from([300.7856, 156.4703, 225.3268]);
    let mut program = Program {
        moves: vec![
            Move::along(MoveKind::Cut, &curve, z, 6000.0),
            Move::straight(MoveKind::LeadOut, curve.end(), end, z, 3000.0),
        ],
    };
    for (seq, m) in program.moves.iter_mut().enumerate() {
        (m.seq, m.setup, m.tool) = (seq as u64, "lean".into(), "T1".into());
    }
    let folder = tempfile::tempdir().unwrap();
    let job = MachineJob::new(record, &program, &machine).unwrap();
    let totals = post(&job, Dialect::Fanuc, &machine, &folder.path().join("a.nc"), &|_| ()).unwrap();
    assert_eq!((totals.read_back.missing, totals.read_back.feed_differs), (0, 0));
}
