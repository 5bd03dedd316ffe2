//! Blocks that a machine's definition puts into programs: safe start, tool change, end.

use claymill_controller::{Dialect, Machine, PostError, PostTotals, ReadError, post};

use crate::job;

/// Start, tool change and end of a shop's machine in each language.
const SHOPS: [(Dialect, &str); 8] = [
    (
        Dialect::Fanuc,
        r#"start = ["G91 G28 Z0.", "G90 G10 L2 P1 X0. Y0. Z0.", "N5 G50 G69 G15 (nothing scaled)"]
           tool_change = ["G91 G28 Z0.", "T{tool} M6", "G90 G43 H{tool} D{tool}", "G4 X2.", "M98 P8000"]
           end = ["G91 G28 Z0.", "G28 X0. Y0.", "G90", "M19"]"#,
    ),
    (
        Dialect::Mitsubishi,
        r#"start = ["G30 P2 Z0."]
           tool_change = ["M150", "T{tool}", "M6 (tool {tool})", "G65 P9023 T{tool}."]"#,
    ),
    (
        Dialect::Siemens,
        r#"line_numbers = { first = 10, step = 10 }
           start = ["CYCLE832(0.01,_FINISH,0.8)", "DEF REAL _HIGH ; of the shop", "FFWON SOFT", "SUPA G0 Z=_HIGH D0"]
           tool_change = ["T{tool} M6", "TRAFOOF", "D1"]
           end = ["SUPA G0 Z=_HIGH D0", "CYCLE832()"]"#,
    ),
    (
        Dialect::Heidenhain,
        r#"start = ["CYCL DEF 247 DATUM SETTING Q339=+1 ; preset", "M129", "FN 0: Q1 = +3"]
           tool_change = ["M5 ; spindle", "TOOL CALL {tool} Z S12000", "L Z-1 R0 FMAX M91", "M3"]
           end = ["L Z-1 R0 FMAX M91", "CALL LBL 99"]"#,
    ),
    (
        Dialect::LinuxCnc29,
        r##"start = ["G28.1", "G64 P0.001", "o<warmup> call", "#5 = [1 + 2]"]
           tool_change = ["M5", "G53 G0 Z0", "T{tool} M6", "G43 H{tool}"]
           end = ["G53 G0 Z0", "G30"]"##,
    ),
    (
        Dialect::Beckhoff,
        r##"start = ["#SET SLOPE PROFIL[2]", "#HSC ON"]
            tool_change = ["V.G.WZ_AKT.D = {tool}", "T{tool} M6"]"##,
    ),
    (
        Dialect::AptCatia,
        r#"start = ["MACHIN/MILL,1 $$ of the shop", "CUTTER/12.,6."]
           end = ["GOHOME/0.,0.,500."]"#,
    ),
    (Dialect::StepNc, r#"start = ["not for a Part 21 file"]"#),
];

fn posted(dialect: Dialect, toml: &str) -> (Result<PostTotals, PostError>, String) {
    let machine = Machine::parse(toml, std::path::Path::new("shop.toml")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("part.nc");
    let made = post(&job::job(&job::curves(), &machine), dialect, &machine, &out, &|_| ());
    (made, std::fs::read_to_string(&out).unwrap_or_default())
}

#[test]
fn programs_with_a_shop_s_blocks_are_read_back() {
    for (dialect, toml) in SHOPS {
        let (made, text) = posted(dialect, toml);
        let totals = made.unwrap_or_else(|e| panic!("{dialect}: {e}"));
        assert!(totals.read_back.largest_mm <= totals.stated_mm + 2e-6 && totals.read_back.missing == 0);
        let machine = Machine::parse(toml, std::path::Path::new("shop.toml")).unwrap();
        let blocks = machine.start.iter().chain(&machine.end).chain(machine.tool_change.iter().flatten());
        for block in blocks.filter(|_| dialect != Dialect::StepNc) {
            assert!(
                text.contains(&block.replace("{tool}", "1")),
                "{dialect}: `{block}` is not in the program"
            );
        }
    }
}

#[test]
fn modes_that_they_leave_on_count() {
    for (dialect, toml, rule) in [
        (Dialect::Fanuc, r#"start = ["G91 G28 Z0."]"#, "incremental"),
        (Dialect::Fanuc, r#"tool_change = ["T{tool} M6", "G41 D{tool} M98 P1"]"#, "radius-compensation"),
        (Dialect::G1, r#"start = ["G93 M98"]"#, "feed-mode"),
        (Dialect::LinuxCnc29, r#"start = ["G64 P0.5"]"#, "linuxcnc-blend"),
    ] {
        match posted(dialect, toml).0 {
            Err(PostError::ReadBack(ReadError::Refused { refusal, .. })) => assert_eq!(refusal.rule, rule),
            other => panic!("{dialect} {toml}: {other:?}"),
        }
    }
    // No path tolerance is exact path, which G64 P0 is not.
    let (made, text) = posted(Dialect::LinuxCnc29, "blend_mm = 0");
    assert!(made.is_ok() && text.contains("G61") && !text.contains("G64"), "{made:?}");
    // A unit that the rest of the program is not in makes another part of it.
    let (made, _) = posted(Dialect::Fanuc, r#"start = ["G20 M98 P1"]"#);
    assert!(made.is_err(), "{made:?}");
}
