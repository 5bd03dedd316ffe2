//! Operations that cut only what has enough stock left: the stock is followed from operation to operation.

use std::path::Path;

use claymill_toolpath::{MoveKind, UncutReason, read_job, read_moves};

use crate::operations::plate_and_wall;
use crate::run::run_without_adapter;
use crate::scratch;

/// Roughing by a large ball, which leaves the corner, and by a small one where more than `rest_above` mm are left.
fn job(rest_above: &str) -> String {
    format!(
        r#"up = "+z"
length = "+x"
setups = ["top"]
material_side = ["-z"]
scallop = 1.0
allowance = 1.0
stock_above = 30.0

[stock]
shape = "block"
box_mm = [0.0, 0.0, -10.0, 120.0, 70.0, 32.0]

[[operations]]
name = "rough"
kind = "rough"
tool = "ball:20"
tool_number = 1

[[operations]]
name = "corner"
kind = "rough"
tool = "ball:5"
tool_number = 2
rest_above = {rest_above}
"#
    )
}

fn planned(folder: &Path, rest_above: &str) -> crate::run::Run {
    std::fs::write(folder.join("asked.toml"), job(rest_above)).unwrap();
    run_without_adapter(folder, ["plan", "model.igs", "--job", "asked.toml", "-o", "out"])
}

#[test]
fn only_what_is_left_is_cut_again() {
    let folder = scratch();
    plate_and_wall(folder.path(), 30.0);
    let made = planned(folder.path(), "1.0");
    assert_eq!(made.code, Some(0), "{made:?}");
    let out = folder.path().join("out");
    let (job, program) = (read_job(&out).unwrap(), read_moves(&out).unwrap());
    let corner = &job.operations[1];
    assert_eq!(corner.request.rest_above_mm, Some(1.0));
    // Over the plate, a ball of 20 mm that leaves 1 mm is more than 1 mm up within x of the wall's allowance, where
    // 20 − √(20² − (20 − x)²) > 1: x < 13.76 mm, with a pitch and a triangle.
    let far = |m: &&claymill_toolpath::Move| m.kind == MoveKind::Cut && m.op == Some(1);
    let least =
        program.moves.iter().filter(far).flat_map(|m| &m.points).map(|p| p[0]).fold(f64::INFINITY, f64::min);
    assert!((95.0..119.0 - 13.0).contains(&least), "{least}");
    assert!(corner.area.uncut_mm2[&UncutReason::EarlierTool] > 5000.0);
    // The stock is followed to the end: both operations take something away.
    let found = run_without_adapter(folder.path(), ["verify", "out"]);
    assert_eq!(found.code, Some(0), "{found:?}");

    // Planted: the operation was to cut all of it.
    let text = std::fs::read_to_string(out.join("job.json")).unwrap();
    let all = text.replace("\"rest_above_mm\": 1.0,", "");
    assert_ne!(all, text);
    std::fs::write(out.join("job.json"), all).unwrap();
    let found = run_without_adapter(folder.path(), ["verify", "out"]);
    assert_eq!(found.code, Some(3), "{found:?}");
    assert!(found.stderr.contains("within reach of the tool"), "{found:?}");
}

#[test]
fn where_nothing_is_left_the_operation_is_left_out() {
    let folder = scratch();
    plate_and_wall(folder.path(), 30.0);
    let made = planned(folder.path(), "150.0");
    assert_eq!(made.code, Some(0), "{made:?}");
    assert!(made.stderr.contains("left out") || made.stdout.contains("left out"), "{made:?}");
    assert_eq!(read_job(&folder.path().join("out")).unwrap().operations.len(), 1);
}

#[test]
fn a_thickness_that_is_none_is_refused() {
    let folder = scratch();
    plate_and_wall(folder.path(), 30.0);
    for bad in ["0.0", "-1.0", "nan", "1e9"] {
        let made = planned(folder.path(), bad);
        assert_eq!(made.code, Some(2), "{bad}: {made:?}");
        assert!(made.stderr.contains("rest above"), "{bad}: {made:?}");
    }
    // Without a stock nobody knows what is left.
    let asked = job("1.0");
    let (head, tail) = (asked.find("[stock]").unwrap(), asked.find("[[operations]]").unwrap());
    std::fs::write(folder.path().join("asked.toml"), format!("{}{}", &asked[..head], &asked[tail..]))
        .unwrap();
    let made = run_without_adapter(folder.path(), ["plan", "model.igs", "--job", "asked.toml", "-o", "out"]);
    assert_eq!(made.code, Some(1), "{made:?}");
    assert!(made.stderr.contains("stock is not known"), "{made:?}");
    assert!(!folder.path().join("out").exists());
}
