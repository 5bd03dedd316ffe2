//! Roughing by levels: planned from a job file and for a material, judged by the verifier, and what it says of planted faults.

use std::path::Path;

use claymill_exchange::write_iges;
use claymill_nurbs::analytic::{Frame, plane_patch};
use claymill_nurbs::{NurbsSurface, Point3, Vector3};
use claymill_tests::model_of;
use claymill_toolpath::{Move, MoveKind, read_job, read_moves};
use claymill_verify::{FindingCode, Verification};

use crate::run::{Run, run_without_adapter};
use crate::scratch;

/// A rectangle with a corner, two sides along axes and a normal across.
pub(crate) fn rectangle(corner: [f64; 3], x: Vector3, z: Vector3, sides: [f64; 2]) -> NurbsSurface {
    let frame = Frame::new(corner.into(), z, x).unwrap();
    plane_patch(&frame, (0.0, sides[0]), (0.0, sides[1])).unwrap()
}

/// A tray: a floor of 26 × 22 mm with walls 6 mm high, into which a tool enters by a helix.
pub(crate) fn tray(folder: &Path) {
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let faces = vec![
        rectangle([0.0, 0.0, 0.0], x, z, [26.0, 22.0]),
        rectangle([0.0, 0.0, 0.0], y, x, [22.0, 6.0]),
        rectangle([26.0, 22.0, 0.0], -y, -x, [22.0, 6.0]),
        rectangle([26.0, 0.0, 0.0], -x, y, [26.0, 6.0]),
        rectangle([0.0, 22.0, 0.0], x, -y, [26.0, 6.0]),
    ];
    write_iges(&folder.join("model.igs"), &model_of(faces), &[]).unwrap();
}

/// A job that roughs the tray by levels of 4 mm at 90°.
pub(crate) fn job(stock: &str, tool: &str, more: &str) -> String {
    format!(
        r#"up = "+z"
length = "+x"
setups = ["top"]
material_side = ["-z"]
{stock}

[[operations]]
name = "rough"
kind = "rough"
cut = "levels"
tool = "{tool}"
tool_number = 1
allowance = 0.5
{more}
"#
    )
}

pub(crate) const STOCK: &str = "\n[stock]\nshape = \"block\"\nbox_mm = [-2.0, -2.0, -1.0, 28.0, 24.0, 7.0]";
pub(crate) const USUAL: &str = "step_down = 4.0\nengagement = 90.0\nband = 0.5";

pub(crate) fn planned(folder: &Path, job: &str) -> Run {
    std::fs::write(folder.join("asked.toml"), job).unwrap();
    run_without_adapter(folder, ["plan", "model.igs", "--job", "asked.toml", "-o", "out"])
}

pub(crate) fn verification(out: &Path) -> Verification {
    serde_json::from_slice(&std::fs::read(out.join("verify.json")).unwrap()).unwrap()
}

/// Writes other moves into the job, and verifies it.
fn verified_with(folder: &Path, moves: &[Move]) -> (Run, Verification) {
    let lines: Vec<String> = moves.iter().map(|m| serde_json::to_string(m).unwrap()).collect();
    std::fs::write(folder.join("out/toolpaths.jsonl"), lines.join("\n") + "\n").unwrap();
    let run = run_without_adapter(folder, ["verify", "out"]);
    (run, verification(&folder.join("out")))
}

fn has(found: &Verification, code: FindingCode) -> bool {
    found.verdict.findings.iter().any(|f| f.code == code && f.message.starts_with("rough: "))
}

#[test]
fn a_tray_is_roughed_by_levels_and_planted_faults_are_found() {
    let folder = scratch();
    let folder = folder.path();
    tray(folder);
    let made = planned(folder, &job(STOCK, "flat:4,length:20", USUAL));
    assert_eq!(made.code, Some(0), "{made:?}");
    let out = folder.join("out");
    let (record, program) = (read_job(&out).unwrap(), read_moves(&out).unwrap());
    let asked = record.operations[0].request.levels.unwrap();
    assert_eq!((asked.step_down_mm, asked.engagement_deg, asked.band_mm), (4.0, 90.0, 0.5));
    let found = verification(&out);
    let levels = found.operations[0].levels.as_ref().unwrap();
    let largest = levels.engagement.largest.as_ref().unwrap();
    assert!((60.0..=90.5).contains(&largest.angle_deg), "{largest:?}");
    assert!(levels.engagement.entries > 0 && levels.links.touching == 0, "{levels:?}");
    assert!(levels.left.area_mm2 > 300.0 && levels.left.above < 1e-3, "{:?}", levels.left);
    assert!(made.stderr.contains("90° were allowed"), "{made:?}");
    let posted = run_without_adapter(folder, ["post", "out", "--to", "linuxcnc", "-o", "job.ngc"]);
    assert_eq!(posted.code, Some(0), "{posted:?}");

    // One pass in the tray shifted outwards by 0.8 mm, to where it is to be cut yet.
    let in_tray = |p: &[f64; 3]| (0.0..26.0).contains(&p[0]) && (0.0..22.0).contains(&p[1]);
    let is_pass = |m: &&Move| m.kind == MoveKind::Cut && m.length_mm() > 10.0 && m.points.iter().all(in_tray);
    let shifted = program.moves.iter().find(is_pass).unwrap().seq;
    let centre = Point3::new(13.0, 11.0, 0.0);
    let mut moves = program.moves.clone();
    for p in &mut moves[shifted as usize].points {
        let away = (Point3::from(*p) - centre).xy().normalize() * 0.8;
        (p[0], p[1]) = (p[0] + away.x, p[1] + away.y);
    }
    let (run, found) = verified_with(folder, &moves);
    assert_eq!(run.code, Some(3), "{run:?}");
    assert!(has(&found, FindingCode::Engagement), "{:?}", found.verdict);

    // The levels near the floor left out.
    let low = |m: &Move| m.points.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
    let bottom = program.moves.iter().map(low).fold(f64::INFINITY, f64::min);
    let mut moves: Vec<Move> = program.moves.iter().filter(|m| low(m) > bottom + 1.0).cloned().collect();
    assert!(moves.len() < program.moves.len());
    (0..).zip(&mut moves).for_each(|(seq, m)| m.seq = seq);
    let (run, found) = verified_with(folder, &moves);
    assert_eq!(run.code, Some(3), "{run:?}");
    assert!(has(&found, FindingCode::StockLeft), "{:?}", found.verdict);
}

#[test]
fn what_levels_cannot_be_is_named() {
    let folder = scratch();
    let folder = folder.path();
    tray(folder);
    let flat = "flat:4,length:20";
    let small = STOCK.replace("7.0]", "5.0]");
    for (asked, said) in [
        (job("", flat, USUAL), "this job has none"),
        (job(&small, flat, USUAL), "does not hold the part"),
        (job(STOCK, flat, "engagement = 0.0"), "engagement of 0°"),
        (job(STOCK, flat, "engagement = 180.0"), "engagement of 180°"),
        (job(STOCK, flat, "step_down = 25.0"), "deeper than the flutes"),
        (job(STOCK, flat, "step_down = 4.0\nband = 0.0"), "a band of 0 mm"),
        (job(STOCK, flat, "dead_centre = 9.0"), "a dead centre of 9 mm"),
        (job(STOCK, flat, "ramp = 0.0"), "a ramp of 0°"),
        (job(STOCK, flat, "rest_above = 1.0"), "rest_of and rest_above"),
        (job(STOCK, flat, USUAL).replace("cut = \"levels\"", "cut = \"layers\""), "is for levels"),
    ] {
        let made = planned(folder, &asked);
        assert!(matches!(made.code, Some(1 | 2)), "{said}: {made:?}");
        assert!(made.stderr.contains(said) && made.stderr.contains("help:"), "{said}: {made:?}");
        assert!(!folder.join("out").exists());
    }
}

/// A thin tool goes over the levels of a thick one: only the corners and the strips along walls are left to it.
#[test]
fn a_thinner_tool_roughs_what_a_thick_one_leaves() {
    let folder = scratch();
    let folder = folder.path();
    tray(folder);
    let first = job(STOCK, "flat:7,length:20", USUAL);
    let second = first.find("[[operations]]").map(|at| &first[at..]).unwrap();
    let second = second.replace("\"rough\"\nkind", "\"rest-rough\"\nkind").replace("flat:7", "flat:2");
    let both = format!("{first}\n{}", second.replace("tool_number = 1", "tool_number = 2"));
    let made = planned(folder, &both);
    assert_eq!(made.code, Some(0), "{made:?}");
    let out = folder.join("out");
    let (found, program) = (verification(&out), read_moves(&out).unwrap());
    let [of_thick, of_thin] = [0, 1].map(|k| found.operations[k].levels.as_ref().unwrap());
    assert!(of_thin.left.area_mm2 > of_thick.left.area_mm2, "{:?}", of_thin.left);
    assert!(of_thin.left.above < 1e-3, "{:?}", of_thin.left);
    let cut_mm = |op: u32| -> f64 {
        let cuts = program.moves.iter().filter(|m| m.op == Some(op) && m.kind == MoveKind::Cut);
        cuts.map(Move::length_mm).sum()
    };
    assert!(cut_mm(1) > 10.0 && cut_mm(1) < 2.0 * cut_mm(0), "{} and {} mm", cut_mm(0), cut_mm(1));
}
