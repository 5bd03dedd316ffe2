//! A shank thicker than its flutes, in stock that stands higher than these: passes on which it would run into stock are left out.

use claymill_toolpath::{MoveKind, read_job, read_moves};

use crate::operations::plate_and_wall;
use crate::run::run_without_adapter;
use crate::scratch;

/// A ball clears the plate up to x = 60 mm, down to 1 mm, out of a block 32 mm high. Another one has flutes of 12 mm under a shank of
/// 16 mm: it may go where the first one has been.
const JOB: &str = r#"
up = "+z"
length = "+x"
setups = ["top"]
material_side = ["-z"]
strategy = "planar"
angle = 90.0
scallop = 1.0
stock_above = 31.0

[stock]
shape = "block"
box_mm = [0.0, 0.0, -10.0, 120.0, 70.0, 32.0]

[[operations]]
name = "half"
kind = "rough"
tool = "ball:10"
tool_number = 1
allowance = 1.0
within = ["-10,-10,-20:60,80,40"]

[[operations]]
name = "short"
kind = "rough"
tool = "ball:5,length:12,shank:16"
tool_number = 2
allowance = 0.5
"#;

/// On the plate tips are lower than this, mm.
const LOW_MM: f64 = 5.0;

/// Up to where the shank begins to be in the way everything is cut: nothing within reach is left.
#[test]
fn where_the_shank_would_run_into_stock_nothing_is_cut() {
    let folder = scratch();
    plate_and_wall(folder.path(), 30.0);
    std::fs::write(folder.path().join("asked.toml"), JOB).unwrap();
    let made = run_without_adapter(folder.path(), ["plan", "model.igs", "--job", "asked.toml", "-o", "out"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    let out = folder.path().join("out");
    let (job, program) = (read_job(&out).unwrap(), read_moves(&out).unwrap());
    let places = |op: u32| {
        let cut = program.moves.iter().filter(move |m| m.kind == MoveKind::Cut && m.op == Some(op));
        // Higher up, on the wall, the shank is above the block.
        cut.flat_map(|m| &m.points).filter(|p| p[2] < LOW_MM).map(|p| p[0])
    };
    let farthest = |op| places(op).fold(f64::NEG_INFINITY, f64::max);
    assert!((55.0..=60.0).contains(&farthest(0)), "{}", farthest(0));
    // Where the first ball has been to x, the block stands from x + 10 mm on above the flutes: the shank of 8 mm is beside it
    // up to x + 2 mm, less what the stock of the planner is coarse by.
    let reached = farthest(1) - farthest(0);
    assert!((-4.0..=2.0).contains(&reached), "{reached}");
    assert_eq!(job.operations.len(), 2);
    let text = std::fs::read_to_string(out.join("verify.json")).unwrap();
    let found: claymill_verify::Verification = serde_json::from_str(&text).unwrap();
    let stock = found.stock.unwrap();
    assert!(
        stock.body.moves > 10 && stock.body.touching == 0 && stock.body.undecided == 0,
        "{:?}",
        stock.body
    );
    let is_struck = |f: &claymill_verify::Finding| f.code == claymill_verify::FindingCode::BodyInStock;
    assert!(!found.verdict.findings.iter().any(is_struck), "{:?}", found.verdict);
}
