//! Libraries and machines of other programs, read.

use std::path::Path;

use claymill_tooling::{
    Advance, Cutting, LengthUnit, LibraryFormat, LibraryReading, ReadOptions, Speed, ToolingError,
    parse_library,
};

use crate::files;

fn read(text: &str, name: &str) -> LibraryReading {
    parse_library(text.as_bytes(), Path::new(name), &ReadOptions::default()).unwrap()
}

fn skipped(reading: &LibraryReading) -> Vec<(&str, &str)> {
    reading.skipped.iter().map(|s| (s.tool.as_str(), s.reason.as_str())).collect()
}

#[test]
fn fusion_libraries_are_read_with_holders_units_and_presets() {
    let reading = read(files::FUSION, "library.json");
    assert_eq!(reading.format, LibraryFormat::FusionJson);
    let [flat, ball, bull] = &reading.library.tools[..] else { panic!("{reading:?}") };
    assert_eq!(flat.tool.to_string(), "flat:6,length:40,shank:14");
    assert_eq!((flat.id.as_str(), flat.number, flat.flutes), ("T4", Some(4), Some(4)));
    assert_eq!(
        (flat.flute_length_mm, flat.overall_length_mm, flat.stick_out_mm),
        (Some(30.0), Some(90.0), Some(55.0))
    );
    assert_eq!(flat.holder.as_ref().unwrap().to_string(), "55:28-32x20,50x12.5");
    assert_eq!(flat.length_in_spindle_mm(), Some(87.5));
    let rough = Cutting {
        ap_mm: Some(6.0),
        plunge_mm_per_min: Some(300.0),
        ramp_mm_per_min: Some(500.0),
        lead_mm_per_min: Some(900.0),
        ..Cutting::new(Speed::Spindle { rpm: 9000.0 }, Advance::PerEdge { fz_mm: 0.1 })
    };
    assert_eq!(flat.cutting["alu-rough"], rough);
    let second =
        Cutting::new(Speed::Edge { vc_m_per_min: 200.0 }, Advance::PerMinute { feed_mm_per_min: 1200.0 });
    assert_eq!(flat.cutting["alu-rough-2"], second);

    // Half an inch, and its number is taken.
    assert_eq!((ball.id.as_str(), ball.number), ("N2", Some(4)));
    assert_eq!(ball.tool.to_string(), "ball:6.35");
    assert_eq!((ball.stick_out_mm, ball.overall_length_mm), (Some(50.8), Some(101.6)));
    let foam = Cutting::new(Speed::Edge { vc_m_per_min: 304.8 }, Advance::PerEdge { fz_mm: 0.0508 });
    assert_eq!(ball.cutting["foam"], foam);

    assert_eq!((bull.tool.to_string().as_str(), bull.holder.is_none()), ("bull:5:1.5", true));
    let left = skipped(&reading);
    let expected = [
        ("drill 8", "`drill` is no flat"),
        ("chamfer", "`chamfer mill` is no flat"),
        ("tapered", "flank is tapered"),
        ("too round", "a corner radius of 5 mm does not suit"),
        ("no unit", "its unit `` is not known"),
        ("chuck alone", "a holder without a tool"),
    ];
    assert_eq!(left.len(), expected.len());
    for ((tool, reason), (name, part)) in left.iter().zip(expected) {
        assert!(*tool == name && reason.contains(part), "{tool}: {reason}");
    }
    assert!(reading.notes.iter().any(|n| n.contains("preset `no speed`")), "{:?}", reading.notes);
    assert!(reading.notes.iter().any(|n| n.contains("M4")), "{:?}", reading.notes);
}

#[test]
fn an_archive_is_a_library() {
    let reading =
        parse_library(&files::tools_archive(), Path::new("shop.tools"), &ReadOptions::default()).unwrap();
    assert_eq!(reading.format, LibraryFormat::FusionTools);
    let tool = reading.library.get("T9").unwrap();
    assert_eq!((tool.tool.to_string().as_str(), tool.stick_out_mm), ("ball:3", Some(40.0)));
}

#[test]
fn tool_bits_are_read_in_mm_and_inches() {
    let reading = read(files::BALL_BIT, "ball.fctb");
    assert_eq!(reading.format, LibraryFormat::FreeCadBit);
    let ball = &reading.library.tools[0];
    assert_eq!(ball.tool.to_string(), "ball:4,length:25,shank:10");
    assert_eq!(
        (ball.name.as_str(), ball.flutes, ball.overall_length_mm),
        ("Ball 8 long", Some(2), Some(80.0))
    );
    let bull = &read(files::BULL_BIT, "bull.fctb").library.tools[0];
    assert_eq!(bull.tool.to_string(), "bull:6.35:1.27");
    assert_eq!((bull.flutes, bull.flute_length_mm), (Some(4), Some(25.4)));

    let drill = files::BALL_BIT.replace("Ballend", "Drill");
    assert!(skipped(&read(&drill, "d.fctb"))[0].1.contains("`drill` is no end mill"));
    let old = files::BULL_BIT.replace("CornerRadius", "FlatRadius");
    assert!(skipped(&read(&old, "d.fctb"))[0].1.contains("no `CornerRadius`"));
    let odd = files::BALL_BIT.replace("8.0000 mm", "8 cubits");
    assert!(skipped(&read(&odd, "d.fctb"))[0].1.contains("`Diameter` is no length"));
    let newer = files::BALL_BIT.replace("\"version\": 2", "\"version\": 3");
    let error = parse_library(newer.as_bytes(), Path::new("b.fctb"), &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, ToolingError::Version { known: 2, .. }), "{error}");
    assert_eq!(error.to_string(), "b.fctb: version 3 of FreeCAD tool bits is not known; version 2 is");
}

#[test]
fn tool_tables_take_shapes_from_their_remarks() {
    let reading = read(files::TABLE, "tool.tbl");
    assert_eq!(reading.format, LibraryFormat::ToolTable);
    let tools: Vec<_> = reading.library.tools.iter().map(|t| (t.id.as_str(), t.tool.to_string())).collect();
    let expected = [("T1", "ball:5"), ("T12", "bull:8:2"), ("T3", "flat:3")];
    assert_eq!(tools, expected.map(|(id, tool)| (id, tool.to_owned())));
    assert_eq!(reading.library.tools[0].length_in_spindle_mm(), Some(85.25));
    let left = skipped(&reading);
    assert!(
        left[0]
            == (
                "drill",
                "its remark does not say its shape; write `ball`, `flat` or `bull R2` behind the semicolon"
            )
    );
    assert!(left[1].1.contains("no diameter") && left[2].1.contains("no corner radius"), "{left:?}");
    assert!(reading.notes[0].contains("taken as mm"));

    let inches = ReadOptions { table_unit: LengthUnit::Inch };
    let reading = parse_library(b"T1 P1 D0.5 ;ball", Path::new("x"), &inches).unwrap();
    assert_eq!(reading.library.tools[0].tool.to_string(), "ball:6.35");
    let error = parse_library(b"T1 P1 D6\nT2 P2 Dx", Path::new("t.tbl"), &inches).unwrap_err();
    assert_eq!(error.to_string(), "t.tbl: line 2: `Dx` is no word of a tool table");
}

#[test]
fn what_is_no_library_is_refused_by_name() {
    let error = |text: &str, name: &str| {
        let error = parse_library(text.as_bytes(), Path::new(name), &ReadOptions::default()).unwrap_err();
        assert!(!error.advice().is_empty());
        error.to_string()
    };
    assert!(error("solid", "a.stl").contains("a.stl: it is of no tool library's format"));
    assert!(error("{\"a\": 1}", "a.json").contains("neither a Fusion library"));
    assert!(error(files::MACHINE, "m.fcm").contains("a FreeCAD machine"));
    assert!(error("{\"data\": 5}", "a.json").contains("no list of tools"));
    assert!(error("{\"data\": [", "a.json").contains("no JSON"));
    assert!(error("format = \"claymill-process\"", "a.toml").contains("`claymill-process`"));
    assert!(error("name = 3", "a.toml").contains("it states no format"));
    assert!(error("PK nothing", "a.tools").contains("the zip archive is damaged"));
}
