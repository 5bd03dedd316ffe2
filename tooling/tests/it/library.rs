//! claymill's own form: round trips, what is refused, and the library that is shipped.

use std::path::Path;

use claymill_tooling::{
    Advance, CheckAgainst, Cutting, Library, LibraryTool, MachineShape, Profiles, ReadOptions, Severity,
    Speed, check_library, library_schema, library_table, parse_library, read_library,
};
use claymill_toolpath::{Holder, HolderSection, Tool};
use proptest::prelude::*;

fn refused(tools: &str) -> (String, String) {
    let text = format!("format = \"claymill-tools\"\nversion = 1\n{tools}");
    let error = Library::parse(&text, Path::new("shop.toml")).unwrap_err();
    (error.to_string(), error.advice().to_owned())
}

#[test]
fn mistakes_are_refused_with_file_tool_and_remedy() {
    let tool = |rest: &str| refused(&format!("[[tools]]\nid = \"T1\"\n{rest}"));
    let cases = [
        ("tool = \"ball:0\"", "shop.toml: T1: tool radius 0 mm", "ball:10"),
        ("tool = \"ball:5\"\nflutes = 0", "number of flutes", "`flutes`"),
        ("tool = \"ball:5\"\nholder = \"4\"", "leaves nothing of a ball", "`holder`"),
        (
            "tool = \"ball:5\"\nholder = \"40\"\nstick_out_mm = 50",
            "both `holder` and `stick_out_mm`",
            "Leave",
        ),
        ("tool = \"ball:5\"\nflute_length_mm = -3", "flute_length_mm is -3", "Correct"),
        ("tool = \"flat:5\"\ndead_centre_mm = 12", "a dead centre of 12 mm", "dead_centre_mm"),
        ("tool = \"flat:5\"\ncentre_cutting = true\ndead_centre_mm = 2", "cuts at its centre", "false"),
        (
            "tool = \"ball:5\"\ncutting.clay = { rpm = 1, vc_m_per_min = 2, fz_mm = 1 }",
            "exactly one of",
            "Give one",
        ),
        (
            "tool = \"ball:5\"\ncutting.clay = { rpm = 1 }",
            "cutting data of clay: exactly one of `fz_mm`",
            "Give one",
        ),
        ("tool = \"ball:5\"\ncutting.clay = { rpm = 0, fz_mm = 1 }", "rpm is 0", "Correct rpm"),
        ("tool = \"ball:5\"\nramp_deg = nan", "ramp", "ramp_deg"),
    ];
    for (rest, what, remedy) in cases {
        let (message, advice) = tool(rest);
        assert!(message.contains(what) && advice.contains(remedy), "{message} / {advice}");
    }
    assert!(refused("[[tools]]\nid = \"a b\"\ntool = \"ball:5\"").0.contains("`a b` is no name"));
    let twice = "[[tools]]\nid = \"T1\"\ntool = \"ball:5\"\n";
    assert!(refused(&format!("{twice}{twice}")).0.contains("T1: the id occurs twice"));
    assert!(
        refused("[[tools]]\nid = \"T1\"\ntool = \"ball:5\"\nflute = 2").0.contains("unknown field `flute`")
    );
    let newer = Library::parse("format = \"claymill-tools\"\nversion = 2", Path::new("t")).unwrap_err();
    assert_eq!(newer.to_string(), "t: version 2 of claymill-tools is not known; version 1 is");
}

#[test]
fn the_shipped_library_fits_the_shipped_machine_and_materials() {
    let library = Library::shipped();
    library.check().unwrap();
    let balls: Vec<f64> =
        library.tools.iter().filter(|t| t.tool.is_ball()).map(|t| t.tool.radius_mm()).collect();
    assert_eq!(balls, [2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.5, 15.0, 20.0, 25.0]);
    assert_eq!(library.tools.len(), 20);
    let (machine, profiles) = (MachineShape::shipped(), Profiles::shipped());
    for name in ["clay", "foam"] {
        let against =
            CheckAgainst { machine: Some(&machine), material: profiles.material(name), depth_mm: None };
        let findings = check_library(&library, &against);
        assert!(findings.iter().all(|f| f.severity == Severity::Warning), "{findings:#?}");
    }
    // Every radius that a shipped process asks for is there.
    for name in profiles.process_names().filter(|n| *n != "general") {
        let process = profiles.resolve(name, name, &std::collections::BTreeMap::new()).unwrap();
        for stage in &process.stages {
            let claymill_tooling::ToolChoice::Auto { radius_mm: Some([low, high]) } = stage.tool.value else {
                continue;
            };
            let material = profiles.material(name).unwrap();
            let fits = |t: &LibraryTool| {
                (low..=high).contains(&t.tool.radius_mm()) && t.cutting_for(material).is_ok()
            };
            assert!(library.tools.iter().any(fits), "{name} {}", stage.kind);
        }
    }
    let again = Library::parse(&library.to_toml(), Path::new("again.toml")).unwrap();
    assert_eq!(again, library);
    let table = library_table(&library);
    assert_eq!(table.lines().count(), 21);
    assert!(table.lines().nth(7).unwrap().trim_start().starts_with("7  T7 "), "{table}");
}

#[test]
fn a_library_is_read_from_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shop.toml");
    std::fs::write(&path, Library::shipped().to_toml()).unwrap();
    let reading = read_library(&path, &ReadOptions::default()).unwrap();
    assert_eq!(reading.library, Library::shipped());
    let none = read_library(&folder.path().join("none.toml"), &ReadOptions::default()).unwrap_err();
    assert!(none.to_string().contains("none.toml"));
}

#[test]
fn the_schema_has_every_field_of_a_file() {
    let schema = serde_json::to_string(&library_schema()).unwrap();
    for field in ["format", "version", "tool", "holder", "dead_centre_mm", "vc_m_per_min", "engagement_deg"] {
        assert!(schema.contains(&format!("\"{field}\"")), "{field}");
    }
}

prop_compose! {
    fn a_size()(v in 0.001..900.0_f64, digits in 0..9_i32) -> f64 {
        let scale = 10_f64.powi(digits);
        ((v * scale).round() / scale).max(0.001)
    }
}

prop_compose! {
    fn a_cutting()(by_edge: bool, per_edge: bool, a in a_size(), b in a_size(), ae in prop::option::of(a_size()),
                   deg in prop::option::of(1.0..180.0_f64)) -> Cutting {
        let speed = if by_edge { Speed::Edge { vc_m_per_min: a } } else { Speed::Spindle { rpm: a } };
        let advance = if per_edge { Advance::PerEdge { fz_mm: b } } else { Advance::PerMinute { feed_mm_per_min: b } };
        Cutting { ae_mm: ae, engagement_deg: deg, lead_mm_per_min: ae, ..Cutting::new(speed, advance) }
    }
}

prop_compose! {
    fn a_tool()(
        shape in 0..3_u8, radius in a_size(), corner in 0.01..0.99_f64,
        sections in prop::collection::vec((a_size(), a_size(), a_size()), 0..4),
        out in a_size(), name in "[ -~äß°]{0,30}", number in prop::option::of(1..1000_u32),
        centre in prop::option::of(any::<bool>()), flute in prop::option::of(a_size()),
        cutting in prop::collection::btree_map("[a-z][a-z0-9.-]{0,8}", a_cutting(), 0..3),
    ) -> LibraryTool {
        let tool: Tool = match shape {
            0 => format!("ball:{radius}"),
            1 => format!("flat:{radius}"),
            _ => format!("bull:{radius}:{}", radius * corner),
        }.parse().unwrap();
        let stick_out_mm = radius + out;
        let section = |(lower_diameter_mm, upper_diameter_mm, length_mm): &(f64, f64, f64)| HolderSection {
            lower_diameter_mm: *lower_diameter_mm, upper_diameter_mm: *upper_diameter_mm, length_mm: *length_mm,
        };
        let holder = (!sections.is_empty())
            .then(|| Holder { stick_out_mm, sections: sections.iter().map(section).collect() });
        LibraryTool {
            number, centre_cutting: centre, flute_length_mm: flute, stick_out_mm: Some(stick_out_mm), holder,
            dead_centre_mm: if centre == Some(false) { 0.1 * radius } else { 0.0 },
            cutting, ..LibraryTool::new("T1", name, tool)
        }
    }
}

proptest! {
    #[test]
    fn what_is_written_is_read_again(tools in prop::collection::vec(a_tool(), 0..5), name in "[ -~é]{0,20}") {
        let mut library = Library { name, tools };
        for (index, tool) in library.tools.iter_mut().enumerate() {
            tool.id = format!("T{index}");
        }
        let text = library.to_toml();
        let again = parse_library(text.as_bytes(), Path::new("x.toml"), &ReadOptions::default());
        prop_assert_eq!(&again.unwrap().library, &library, "{}", text);
    }
}
