//! A part from a bar: the finish from every angle with one program, and levels before it.

use claymill_exchange::write_iges;
use claymill_nurbs::analytic::{Frame, plane_patch};
use claymill_nurbs::{NurbsSurface, Vector3};
use claymill_tests::model_of;
use claymill_toolpath::{MoveKind, OperationKind, Stock, read_job, read_moves};

use claymill_verify::FindingCode;

use crate::run::run_without_adapter;
use crate::scratch;

fn rectangle(corner: [f64; 3], along: [f64; 3], up: [f64; 3]) -> NurbsSurface {
    let (a, b) = (Vector3::from(along), Vector3::from(up));
    let at = Frame::new(corner.into(), a.cross(&b), a).unwrap();
    plane_patch(&at, (0.0, a.norm()), (0.0, b.norm())).unwrap()
}

/// A box of 24 × 12 × 8 mm.
fn block() -> Vec<NurbsSurface> {
    let [x, y, z] = [24.0, 12.0, 8.0];
    vec![
        rectangle([0.0; 3], [x, 0.0, 0.0], [0.0, y, 0.0]),
        rectangle([0.0, 0.0, z], [x, 0.0, 0.0], [0.0, y, 0.0]),
        rectangle([0.0; 3], [x, 0.0, 0.0], [0.0, 0.0, z]),
        rectangle([0.0, y, 0.0], [x, 0.0, 0.0], [0.0, 0.0, z]),
        rectangle([0.0; 3], [0.0, y, 0.0], [0.0, 0.0, z]),
        rectangle([x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]),
    ]
}

#[test]
fn a_part_comes_out_of_a_bar_with_one_program() {
    let folder = scratch();
    write_iges(&folder.path().join("part.igs"), &model_of(block()), &[]).unwrap();
    let machine = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/machines/linuxcnc-a-axis.toml");
    let asked = ["prototype", "part.igs", "--stock", "round:18", "--axis", "x", "--cutting-force", "20"];
    let more =
        ["--material", "delrin", "--tool", "ball:2", "--scallop", "0.1", "--machine", machine, "-o", "out"];
    let made = run_without_adapter(folder.path(), asked.iter().chain(&more));
    assert_eq!(made.code, Some(0), "{made:?}");
    let out = folder.path().join("out");
    let (job, program) = (read_job(&out.join("job")).unwrap(), read_moves(&out.join("job")).unwrap());
    assert_eq!(job.operations.len(), 1);
    // The tool's axis stays between the ends of the bar, where the chucks are.
    let cuts = program.moves.iter().filter(|m| m.kind == MoveKind::Cut);
    let places = cuts.flat_map(|m| &m.points).map(|p| p[0]);
    let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    assert!(low > -34.0 && high < -1.9, "{low} to {high}");
    let text = std::fs::read_to_string(out.join("part.ngc")).unwrap();
    assert!(text.lines().any(|line| line.contains('A')), "no index move");
    assert!(out.join("setup-sheet.md").is_file() && out.join("held.stp").is_file());
}

/// Levels from every angle, each on what those before left, and the finish: one job out of the bar.
#[test]
fn a_bar_is_roughed_from_every_angle_as_its_stock() {
    let folder = scratch();
    write_iges(&folder.path().join("part.igs"), &model_of(block()), &[]).unwrap();
    let asked = ["prototype", "part.igs", "--stock", "round:18", "--axis", "x", "--cutting-force", "20"];
    let more =
        ["--material", "delrin", "--tool", "ball:2", "--rough", "flat:3", "--scallop", "0.2", "-o", "out"];
    let made = run_without_adapter(folder.path(), asked.iter().chain(&more));
    assert!(matches!(made.code, Some(0 | 3)), "{made:?}");
    let out = folder.path().join("out").join("job");
    let (job, program) = (read_job(&out).unwrap(), read_moves(&out).unwrap());
    let Some(Stock::Bar { to_mm, diameter_mm, .. }) = job.stock else { panic!("{:?}", job.stock) };
    assert_eq!((to_mm, diameter_mm), ([0.0; 3], 18.0));
    let kinds: Vec<OperationKind> = job.operations.iter().map(|o| o.kind).collect();
    let (last, before) = kinds.split_last().unwrap();
    assert_eq!(*last, OperationKind::Finish);
    assert!(!before.is_empty() && before.iter().all(|kind| *kind == OperationKind::Rough), "{kinds:?}");
    let text = std::fs::read_to_string(out.join("verify.json")).unwrap();
    let found: claymill_verify::Verification = serde_json::from_str(&text).unwrap();
    let count = |code| found.verdict.findings.iter().filter(|f| f.code == code).count();
    for code in [FindingCode::Gouge, FindingCode::OutOfBounds] {
        assert_eq!(count(code), 0, "{:?}", found.verdict);
    }
    assert!(program.moves.iter().any(|m| m.kind == MoveKind::Cut && m.op == Some(0)));
}

#[test]
fn a_bar_too_thin_is_refused() {
    let folder = scratch();
    write_iges(&folder.path().join("part.igs"), &model_of(block()), &[]).unwrap();
    let asked = ["plan", "part.igs", "--material", "aluminium", "--stock", "round:14:x", "-o", "out"];
    let made = run_without_adapter(folder.path(), asked);
    assert_eq!(made.code, Some(1), "{made:?}");
    assert!(
        made.stderr.contains("a bar of 14 mm does not hold the model, which needs 14.422 mm"),
        "{made:?}"
    );
    assert!(!folder.path().join("out").exists());
}
