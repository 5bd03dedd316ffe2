//! Whole jobs: operations that are chosen for a material, one program of all of them, and what is found when they are damaged.

use std::path::Path;

use claymill_exchange::write_iges;
use claymill_nurbs::analytic::{Frame, plane_patch};
use claymill_nurbs::{Point3, Vector3};
use claymill_tests::model_of;
use claymill_toolpath::{OperationKind, Stock, read_job, read_moves};

use crate::run::run_without_adapter;
use crate::scratch;

/// A plate of 120 × 70 mm with a wall across its end, so high.
pub(crate) fn plate_and_wall(folder: &Path, height_mm: f64) {
    let frame = |origin, z, x| Frame::new(origin, z, x).unwrap();
    let plate =
        plane_patch(&frame(Point3::origin(), Vector3::z(), Vector3::x()), (0.0, 120.0), (0.0, 70.0)).unwrap();
    let end = frame(Point3::new(120.0, 0.0, 0.0), -Vector3::x(), -Vector3::y());
    let wall = plane_patch(&end, (-70.0, 0.0), (0.0, height_mm)).unwrap();
    write_iges(&folder.join("model.igs"), &model_of(vec![plate, wall]), &[]).unwrap();
}

const WHOLE: [&str; 11] = [
    "plan",
    "model.igs",
    "--material",
    "clay",
    "--stock",
    "layer:10",
    "--up",
    "+z",
    "--length",
    "+x",
    "--material-side=-z",
];

/// The job of the model for clay, in the folder `out`.
fn planned(folder: &Path) {
    plate_and_wall(folder, 40.0);
    let made = run_without_adapter(folder, WHOLE.iter().chain(&["-o", "out"]));
    assert_eq!(made.code, Some(0), "{made:?}");
}

#[test]
fn a_material_makes_a_whole_job_that_can_be_run_again_and_posted() {
    let folder = scratch();
    planned(folder.path());
    let out = folder.path().join("out");
    let (job, program) = (read_job(&out).unwrap(), read_moves(&out).unwrap());
    assert_eq!(job.format_version, 2);
    assert_eq!(job.stock, Some(Stock::Layer { thickness_mm: 10.0 }));
    let kinds: Vec<OperationKind> = job.operations.iter().map(|o| o.kind).collect();
    assert_eq!(kinds[..2], [OperationKind::Rough, OperationKind::Finish], "{kinds:?}");
    assert!(job.operations.iter().all(|o| !o.reason.is_empty()));
    assert_eq!(job.operations[0].request.allowance_mm, 3.0);
    // All moves, each of an operation, one after the other.
    assert_eq!(program.moves.len() as u64, job.totals.moves);
    assert!(program.moves.windows(2).all(|w| w[0].op <= w[1].op && w[1].seq == w[0].seq + 1));
    let last = program.moves.last().unwrap();
    assert_eq!(last.op, Some(job.operations.len() as u32 - 1));
    for (op, operation) in job.operations.iter().enumerate() {
        let tools = program.moves.iter().filter(|m| m.op == Some(op as u32)).map(|m| &m.tool);
        assert!(tools.clone().count() > 0 && tools.into_iter().all(|tool| *tool == operation.tool));
    }
    // The job file makes the same moves again.
    let again = ["plan", "model.igs", "--job", "out/job.toml", "-o", "again"];
    let again = run_without_adapter(folder.path(), again);
    assert_eq!(again.code, Some(0), "{again:?}");
    let moves = |job: &str| std::fs::read(folder.path().join(job).join("toolpaths.jsonl")).unwrap();
    assert!(moves("out") == moves("again"));
    // It is verified by itself, and posted with its tool changes.
    assert_eq!(run_without_adapter(folder.path(), ["verify", "out"]).code, Some(0));
    let post = ["post", "out", "--to", "linuxcnc", "-o", "job.ngc"];
    let posted = run_without_adapter(folder.path(), post);
    assert_eq!(posted.code, Some(0), "{posted:?}");
}

#[test]
fn planted_faults_in_operations_are_found() {
    let folder = scratch();
    planned(folder.path());
    let out = folder.path().join("out");
    let (text, job) = (
        std::fs::read_to_string(out.join("toolpaths.jsonl")).unwrap(),
        std::fs::read_to_string(out.join("job.json")).unwrap(),
    );
    let verified = |moves: &str, job: &str| {
        std::fs::write(out.join("toolpaths.jsonl"), moves).unwrap();
        std::fs::write(out.join("job.json"), job).unwrap();
        run_without_adapter(folder.path(), ["verify", "out"])
    };
    // The finish before the roughing.
    let (rough, rest): (Vec<&str>, Vec<&str>) = text.lines().partition(|line| line.contains("\"op\":0,"));
    let swapped: String = rest.iter().chain(&rough).map(|line| format!("{line}\n")).collect();
    let found = verified(&swapped, &job);
    assert_eq!(found.code, Some(3), "{found:?}");
    assert!(
        found.stdout.contains("earlier operation") || found.stderr.contains("earlier operation"),
        "{found:?}"
    );
    // Roughing that leaves less than it says.
    let deeper = job.replacen("\"allowance_mm\": 3.0", "\"allowance_mm\": 3.2", 1);
    assert_ne!(deeper, job);
    let found = verified(&text, &deeper);
    assert_eq!(found.code, Some(3), "{found:?}");
    assert!(
        found.stdout.contains("rough: the ball enters") || found.stderr.contains("rough: the ball enters")
    );
    // Moves of the finish that say they were roughing have another tool.
    let mixed = text.replace("\"op\":1,", "\"op\":0,");
    assert_eq!(verified(&mixed, &job).code, Some(1));
    // A move of no operation, and an operation with a tool that nobody has.
    for (moves, job) in [
        (text.replacen("\"op\":0,", "\"op\":77,", 1), job.clone()),
        (text.clone(), job.replace("\"tool\": \"T", "\"tool\": \"X")),
    ] {
        let found = verified(&moves, &job);
        assert_eq!(found.code, Some(1), "{found:?}");
    }
    assert_eq!(verified(&text, &job).code, Some(0));
}

#[test]
fn what_makes_no_whole_job_is_named() {
    let folder = scratch();
    plate_and_wall(folder.path(), 40.0);
    std::fs::write(folder.path().join("none.toml"), "operations = []\n").unwrap();
    std::fs::write(folder.path().join("odd.toml"), "[[operations]]\nname = \"a\"\nkind = \"polish\"\n")
        .unwrap();
    let cases: [(&[&str], i32, &str); 7] = [
        (&["--tools", "shop.toml"], 2, "material"),
        (&["--material", "butter"], 1, "butter"),
        (&["--material", "clay", "--tools", "shop.toml"], 1, "shop.toml"),
        (&["--material", "clay", "--stock", "ball"], 2, "stock"),
        (&["--material", "clay", "--stock", "0,0,0:10,10,10"], 1, "does not hold"),
        (&["--job", "none.toml"], 1, "operations"),
        (&["--job", "odd.toml"], 1, "operation a"),
    ];
    for (asked, code, word) in cases {
        let plan = ["plan", "model.igs", "-o", "out"];
        let found = run_without_adapter(folder.path(), plan.iter().chain(asked));
        assert_eq!(found.code, Some(code), "{asked:?}: {found:?}");
        assert!(found.stderr.contains(word), "{asked:?}: {found:?}");
        assert!(!folder.path().join("out").exists(), "{asked:?}");
    }
}
