//! `claymill tools`: libraries of every format listed, drawn and checked; what is unreadable is named with its remedy.

use std::fs;

use crate::run::run;
use crate::scratch;

const OWN: &str = r#"
format = "claymill-tools"
version = 1
name = "shop"
[[tools]]
id = "T7"
number = 7
tool = "ball:10"
flutes = 2
flute_length_mm = 60
overall_length_mm = 200
holder = "110:33-42x54,63x26"
[tools.cutting.clay]
rpm = 3000
feed_mm_per_min = 8000
[[tools]]
id = "T8"
number = 8
tool = "bull:6:1"
"#;

const FUSION: &str = r#"{"data": [
    {"type": "ball end mill", "unit": "millimeters", "description": "finisher", "geometry":
        {"DC": 12, "LCF": 30, "LB": 50, "OAL": 90, "SFDM": 12, "NOF": 2}, "post-process": {"number": 4}},
    {"type": "drill", "unit": "millimeters", "description": "drill 5", "geometry": {"DC": 5, "SIG": 118}}
], "version": 2}"#;

const BIT: &str = r#"{"version": 2, "name": "ball 6", "shape": "ballend.fcstd",
    "parameter": {"Diameter": "6.00 mm", "CuttingEdgeHeight": "20 mm", "Length": "50 mm", "ShankDiameter": "6 mm"}}"#;

#[test]
fn libraries_of_every_format_are_listed() {
    let folder = scratch();
    for (name, text, expected) in [
        ("own.toml", OWN, "7  T7  ball"),
        ("fusion.json", FUSION, "4  T4  ball    12       6"),
        ("bit.fctb", BIT, "N1  ball     6       3"),
        ("tool.tbl", "T5 P5 D10 Z+60 ;ball\n", "5  T5  ball    10       5"),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
        let listed = run(folder.path(), ["tools", name]);
        assert_eq!(listed.code, Some(0), "{name}: {listed:?}");
        assert!(listed.stdout.contains(expected), "{name}: {listed:?}");
    }
    let drill = run(folder.path(), ["tools", "fusion.json"]);
    assert!(drill.stderr.contains("drill 5"), "{drill:?}");
    let own = run(folder.path(), ["tools", "own.toml", "--json"]).json();
    let tool = &own["tools"][0];
    assert_eq!((&tool["diameter_mm"], &tool["stick_out_mm"]), (&20.0.into(), &110.0.into()));
    assert_eq!((&tool["materials"][0], &tool["holder"][0]["length_mm"]), (&"clay".into(), &54.0.into()));
    let shipped = run(folder.path(), ["tools"]);
    assert_eq!((shipped.code, shipped.stdout.lines().count()), (Some(0), 21));
}

#[test]
fn tools_are_drawn_to_one_scale() {
    let folder = scratch();
    fs::write(folder.path().join("own.toml"), OWN).unwrap();
    for _ in 0..2 {
        // The second time over its own drawing.
        let drawn = run(folder.path(), ["tools", "own.toml", "--svg", "out/tools.svg"]);
        assert_eq!(drawn.code, Some(0), "{drawn:?}");
    }
    let svg = fs::read_to_string(folder.path().join("out/tools.svg")).unwrap();
    assert_eq!(svg.matches("class=\"tool\"").count(), 2);
    // In millimetres, whatever the size of the sheet: the ball's flutes end 60 mm above the tip, 10 mm to each side.
    assert!(svg.contains("10,-60") && svg.contains("-10,-60") && svg.ends_with("</svg>\n"), "{svg}");
    fs::write(folder.path().join("mine.svg"), "<svg>mine</svg>").unwrap();
    let refused = run(folder.path(), ["tools", "own.toml", "--svg", "mine.svg"]);
    assert!(refused.code == Some(1) && refused.stderr.contains("--force"), "{refused:?}");
}

#[test]
fn what_is_wrong_is_named_with_its_remedy() {
    let folder = scratch();
    fs::write(folder.path().join("own.toml"), OWN).unwrap();
    fs::write(folder.path().join("small.toml"), "[changer]\nplaces = 7\nlongest_mm = 150\n").unwrap();
    let checked = run(folder.path(), ["tools", "own.toml", "--machine", "small.toml", "--material", "clay"]);
    assert_eq!(checked.code, Some(3), "{checked:?}");
    for part in ["T7", "150", "T8", "[tools.cutting.clay]"] {
        assert!(checked.stderr.contains(part), "{part}: {checked:?}");
    }
    fs::write(folder.path().join("broken.json"), "{\"data\": [").unwrap();
    fs::write(folder.path().join("notes.txt"), "hello").unwrap();
    for (words, part) in [
        (vec!["tools", "broken.json"], "Export the file again"),
        (vec!["tools", "notes.txt"], "tool table"),
        (vec!["tools", "none.toml"], "Check the path"),
        (vec!["tools", "own.toml", "--material", "cheese"], "clay, foam and aluminium"),
    ] {
        let refused = run(folder.path(), words.clone());
        assert!(
            matches!(refused.code, Some(1 | 2)) && refused.stderr.contains(part),
            "{words:?}: {refused:?}"
        );
    }
}
