//! Shapes of machines: claymill's own files, those of the post processor, FreeCAD's.

use std::path::Path;

use claymill_tooling::{MachineShape, machine_from_freecad};

use crate::files;

#[test]
fn a_freecad_machine_has_travels_rotary_axes_and_a_spindle() {
    let (machine, notes) = machine_from_freecad(files::MACHINE.as_bytes(), Path::new("v.fcm")).unwrap();
    assert_eq!((machine.name.as_str(), machine.axis_count()), ("Example V800", 4));
    assert_eq!((machine.axes["y"], machine.travel_mm("z")), ([-10.0, 500.0], Some(450.0)));
    let a = &machine.rotary["a"];
    assert_eq!((a.travel_deg, a.direction, a.point_mm), ([-180.0, 180.0], [0.0, 0.0, 1.0], [1.0, 2.0, 3.0]));
    assert!(a.turns_table && a.max_deg_per_min == Some(9000.0));
    let spindle = machine.spindle;
    assert_eq!((spindle.min_rpm, spindle.max_rpm, spindle.power_kw), (Some(50.0), Some(12_000.0), Some(7.5)));
    assert_eq!(machine.feed.rapid_mm_per_min, Some(12_000.0));
    assert_eq!(notes, ["axis A turns about [0.0, 0.0, 1.0], which is not usual"]);
    let inches = files::MACHINE.replace("metric", "imperial");
    let (machine, _) = machine_from_freecad(inches.as_bytes(), Path::new("v.fcm")).unwrap();
    approx::assert_relative_eq!(machine.travel_mm("x").unwrap(), 800.0 * 25.4);
}

#[test]
fn damaged_machines_are_refused_by_axis() {
    let error =
        |text: String| machine_from_freecad(text.as_bytes(), Path::new("v.fcm")).unwrap_err().to_string();
    assert!(
        error(files::MACHINE.replace("\"max\": 500", "\"max\": -20")).contains("v.fcm: y: its lower limit")
    );
    assert!(
        error(files::MACHINE.replace("rotary\", \"role\"", "odd\", \"role\""))
            .contains("axis A: its type `odd`")
    );
    assert!(error(files::MACHINE.replace("\"version\": 1", "\"version\": 7")).contains("version 7"));
    assert!(error("{}".into()).contains("no FreeCAD machine"));
}

/// The files that programs are written with serve as shapes too.
#[test]
fn machine_definitions_for_programs_are_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/machines");
    let mut read = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let (machine, notes) = MachineShape::read(&entry.unwrap().path()).unwrap();
        assert!(machine.travel_mm("z").is_some_and(|z| z > 0.0) && notes.is_empty());
        read += 1;
    }
    assert!(read >= 7);
}

#[test]
fn the_shipped_machine_reads_what_it_writes() {
    let machine = MachineShape::shipped();
    assert_eq!((machine.axis_count(), machine.spindle.max_rpm), (3, Some(18_000.0)));
    let again = MachineShape::parse(machine.to_toml().as_bytes(), Path::new("m.toml")).unwrap();
    assert_eq!(again, machine);
    let typo = MachineShape::parse(b"chanjer.places = 3", Path::new("m.toml")).unwrap_err();
    assert!(typo.to_string().contains("unknown field `chanjer`"), "{typo}");
    let typo = MachineShape::parse(b"spindle.rpm_max = 3", Path::new("m.toml")).unwrap_err();
    assert!(typo.to_string().contains("unknown field `rpm_max`; spindle has min_rpm"), "{typo}");
    for text in
        ["axes.w = [0, 1]", "axes.x = [2, 1]", "spindle = { min_rpm = 9, max_rpm = 5 }", "changer.places = 0"]
    {
        assert!(MachineShape::parse(text.as_bytes(), Path::new("m.toml")).is_err(), "{text}");
    }
}
