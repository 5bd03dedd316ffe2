//! From a model file to a verified job folder, with the command as users have it.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use claymill_exchange::read;
use claymill_nurbs::Vector3;
use claymill_tests::{Need, check_form, leave_out, measure_ball};
use claymill_toolpath::{
    Job, LinkStyle, MANIFEST_FILE, MoveKind, RegionsFile, TOOLPATHS_FILE, UncutReason, read_job, read_moves,
    read_regions,
};
use claymill_verify::Verification;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::run::{Run, panel, run, run_without_adapter};
use crate::scratch;

const RADIUS_MM: f64 = 10.0;
const GOUGE_MM: f64 = 0.005;
/// Share of the total area to which the account closes.
const ACCOUNT: f64 = 1e-6;

/// A folder with the model and the job `lace`, planned once for all tests of this file.
static PLANNED: LazyLock<(PathBuf, Run)> = LazyLock::new(|| {
    // Nothing is dropped at the end of a static: a fixed place, so that runs do not pile up.
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("whole_job");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    panel(&folder);
    let made = plan(&folder, "lace", &["--threads", "2"]);
    (folder, made)
});

fn plan(folder: &Path, out: &str, more: &[&str]) -> Run {
    run(folder, job(out).iter().chain(more))
}

/// The same without pictures: those of `lace` and of `single` are looked at.
fn plan_without_pictures(folder: &Path, out: &str, more: &[&str]) -> Run {
    run_without_adapter(folder, job(out).iter().chain(more))
}

fn job(out: &str) -> [&str; 8] {
    ["plan", "panel.igs", "--tool", "ball:10", "--scallop", "0.1", "-o", out]
}

pub(crate) fn planned() -> &'static Path {
    assert_eq!(PLANNED.1.code, Some(0), "{:?}", PLANNED.1);
    &PLANNED.0
}

/// Reads a JSON file as `T`, and makes sure that `T` knows everything in it.
fn whole<T: Serialize + DeserializeOwned>(path: PathBuf) -> T {
    let text = fs::read_to_string(&path).unwrap();
    let value: Value = serde_json::from_str(&text).unwrap();
    let typed: T =
        serde_json::from_value(value.clone()).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    assert_eq!(serde_json::to_value(&typed).unwrap(), value, "{}", path.display());
    typed
}

/// Form, areas and gouges of a job on the panel.
fn check_job(folder: &Path, job: &str) -> Job {
    let out = folder.join(job);
    let model = read(&folder.join("panel.igs")).unwrap().model;
    let found: Job = whole(out.join("job.json"));
    let regions: RegionsFile = whole(out.join("regions.json"));
    let verified: Verification = whole(out.join("verify.json"));
    let program = read_moves(&out).unwrap();
    check_form(&found, &program).unwrap();

    let near = |a: f64, b: f64| (a - b).abs() <= ACCOUNT * found.area.total_mm2;
    let uncut: f64 = found.area.uncut_mm2.values().sum();
    assert!(near(found.area.cut_mm2 + uncut, found.area.total_mm2), "{:?}", found.area);
    let face_cut: f64 = found.faces.iter().map(|f| f.area.cut_mm2).sum();
    assert!(near(face_cut, found.area.cut_mm2));
    let in_regions: f64 = regions.regions.iter().map(|r| r.area_mm2).sum();
    assert!(near(in_regions, found.area.total_mm2));
    assert!(near(verified.coverage.total_mm2, found.area.total_mm2));
    for f in &found.faces {
        let sum = f.area.cut_mm2 + f.area.uncut_mm2.values().sum::<f64>();
        assert!((sum - f.area.total_mm2).abs() <= ACCOUNT * f.area.total_mm2, "{f:?}");
    }
    let m = &found.model;
    assert_eq!(m.faces_in_file, m.faces_read + m.skipped.len());
    assert_eq!(found.faces.len(), m.faces_read);
    assert_eq!(found.totals.moves as usize, program.moves.len());
    let points: usize = program.moves.iter().map(|m| m.points.len()).sum();
    assert_eq!(found.totals.control_points as usize, points);

    let ball = measure_ball(&model, &program, RADIUS_MM, 0.3);
    eprintln!("{job}: {ball:?}");
    let (depth, at) = ball.deepest.unwrap();
    assert!(depth <= GOUGE_MM, "move {at} enters by {depth} mm");
    let (excess, at) = ball.excess.unwrap();
    assert!(excess <= GOUGE_MM, "move {at} runs {excess} mm above its face");
    assert!(ball.rapid_clearance.is_none_or(|(c, _)| c > 0.0), "{ball:?}");
    // The verifier looks denser and knows where to look: it finds at least as much.
    assert!(verified.gouge.deepest_mm > depth - 1e-4, "{depth} {:?}", verified.gouge);
    assert!(verified.verdict.passed, "{:?}", verified.verdict);
    found
}

#[test]
fn the_job_folder_is_whole_and_true() {
    let job = check_job(planned(), "lace");
    assert_eq!(job.request.link, LinkStyle::Zigzag);
    let bar = 0.999 * job.area.total_mm2;
    assert!(job.area.cut_mm2 > bar, "{:?}", job.area);
    assert_eq!(job.regions.len(), 1);

    let out = planned().join("lace");
    let mut names: Vec<_> = fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    let plain = ["job.json", "job.toml", "regions.json", "report.html", TOOLPATHS_FILE, "verify.json"];
    for name in plain {
        assert!(names.iter().any(|n| n == name), "{name} is missing: {names:?}");
    }
    let report = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("</html>") && !report.contains("src=\"http"), "the report needs the network");
    let pictures: Vec<_> = names.iter().filter(|n| n.to_string_lossy().ends_with(".png")).collect();
    if PLANNED.1.stderr.contains("no pictures") {
        assert!(pictures.is_empty(), "{pictures:?}");
        return leave_out(Need::Vulkan, "no graphics adapter, thus no pictures");
    }
    for name in ["preview-iso.png", "preview-top.png", "preview-side.png"] {
        let bytes = fs::read(out.join(name)).unwrap();
        assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
        let side = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!((side(16), side(20)), (1920, 1080), "{name}");
    }
    assert!(report.contains("data:image/png;base64,"));
}

#[test]
fn what_is_said_of_a_job_fits_on_one_screen() {
    planned();
    let lines: Vec<&str> = PLANNED.1.stderr.lines().collect();
    assert!(lines.len() <= 24, "{} lines: {lines:#?}", lines.len());
    let widest = lines.iter().filter(|l| !l.contains(" lace")).map(|l| l.chars().count()).max().unwrap();
    assert!(widest <= 80, "{widest} columns: {lines:#?}");
    assert!(!PLANNED.1.stderr.contains('\u{1b}'), "no colours where there is no terminal");
}

#[test]
fn box_links_cut_one_way() {
    let folder = planned();
    let made = plan_without_pictures(folder, "box", &["--link", "one-way"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    let job = check_job(folder, "box");
    assert_eq!(job.request.link, LinkStyle::OneWay);
    let along = |out: &str| {
        let direction = Vector3::from(job.regions[0].pass_direction.unwrap());
        let moves = read_moves(&folder.join(out)).unwrap().moves;
        let cuts = moves.iter().filter(|m| m.kind == MoveKind::Cut);
        let (on, back): (Vec<_>, Vec<_>) =
            cuts.map(|m| (m.end() - m.start()).dot(&direction)).partition(|d| *d > 0.0);
        (on.len(), back.len())
    };
    let (on, back) = along("box");
    assert!(on == 0 || back == 0, "{on} passes one way, {back} the other");
    let (on, back) = along("lace");
    // Short rows between others are taken from whichever end is nearer.
    assert!(20 * on.abs_diff(back) <= on + back, "{on} passes one way, {back} the other");
}

#[test]
fn rows_run_at_the_angle_asked_for() {
    let folder = planned();
    let made = plan_without_pictures(folder, "angled", &["--angle", "-30", "--only", "region:0"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    let job = check_job(folder, "angled");
    let report = fs::read_to_string(folder.join("angled/report.html")).unwrap();
    assert!(report.contains("claymill plan panel.igs --job angled/job.toml -o angled"));
    let again = ["plan", "panel.igs", "--job", "angled/job.toml", "-o", "angled_again"];
    let again = run_without_adapter(folder, again);
    assert_eq!(again.code, Some(0), "{again:?}");
    let moves = |job: &str| fs::read(folder.join(job).join(TOOLPATHS_FILE)).unwrap();
    assert!(moves("angled") == moves("angled_again"));
    let rows: Vec<Vector3> = read_moves(&folder.join("angled"))
        .unwrap()
        .moves
        .iter()
        .filter(|m| m.kind == MoveKind::Cut && m.setup == "top" && m.length_mm() > 5.0)
        .map(|m| (m.end() - m.start()) - Vector3::z() * (m.end() - m.start()).z)
        .collect();
    assert!(rows.len() > 20);
    let along = Vector3::from(job.regions.iter().find(|r| r.setup == "top").unwrap().pass_direction.unwrap());
    assert!(rows.iter().all(|row| row.cross(&along).norm() < 1e-4 * row.norm()), "{along:?}");
    // Seen from the top, the setup's x is the panel's x, one way or the other.
    let to_x_deg = along.x.abs().acos().to_degrees();
    assert!((to_x_deg - 30.0).abs() < 1e-9, "{to_x_deg}");
    let refused = plan(folder, "no_angle", &["--angle", "nan"]);
    assert!(refused.code != Some(0) && !folder.join("no_angle").exists(), "{refused:?}");
}

#[test]
fn what_is_left_out_is_not_cut_and_accounted() {
    let folder = planned();
    let made = plan_without_pictures(folder, "part", &["--only", "region:0", "--skip", "face:0-3"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    let job = check_job(folder, "part");
    for f in &job.faces {
        let left_out = f.area.uncut_mm2.get(&UncutReason::Excluded).copied().unwrap_or(0.0);
        if f.face <= 3 {
            assert_eq!((f.area.cut_mm2, left_out), (0.0, f.area.total_mm2), "{f:?}");
        } else {
            assert_eq!(left_out, 0.0, "{f:?}");
            assert!(f.area.cut_mm2 > 0.9 * f.area.total_mm2, "{f:?}");
        }
    }
    let regions = read_regions(&folder.join("part")).unwrap();
    assert!((regions.regions[0].setup_area_mm2["top"] - job.area.cut_mm2).abs() < 1.0);
    let reread: Job = read_job(&folder.join("part")).unwrap();
    assert_eq!(
        (reread.request.only, reread.request.skip),
        (vec!["region:0".into()], vec!["face:0-3".into()])
    );
}

#[test]
fn thread_count_does_not_change_a_byte() {
    let folder = planned();
    let made = plan(folder, "single", &["--threads", "1"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    let bytes = |job: &str| {
        let mut names: Vec<_> =
            fs::read_dir(folder.join(job)).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        // The report shows the timings, and the list of files has the hashes of both.
        names.retain(|n| n != "report.html" && n != MANIFEST_FILE);
        let content = |name: &OsString| {
            let f = &folder.join(job).join(name);
            if name == "job.json" {
                let mut job: Value = serde_json::from_slice(&fs::read(f).unwrap()).unwrap();
                let timings = job.as_object_mut().unwrap();
                assert!(timings.remove("timings").is_some() && timings.remove("peak_memory_mb").is_some());
                return job.to_string().into_bytes();
            }
            fs::read(f).unwrap()
        };
        names.into_iter().map(|n| (n.clone(), content(&n))).collect::<BTreeMap<_, _>>()
    };
    let (one, two) = (bytes("single"), bytes("lace"));
    assert!(one.keys().eq(two.keys()));
    for (name, content) in one {
        assert!(content == two[&name], "{} differs", name.display());
    }
}

/// Copies the job `lace` and its model, for tests that spoil them.
fn copy_of_the_job() -> tempfile::TempDir {
    let copy = scratch();
    fs::copy(planned().join("panel.igs"), copy.path().join("panel.igs")).unwrap();
    let to = copy.path().join("lace");
    fs::create_dir(&to).unwrap();
    for entry in fs::read_dir(planned().join("lace")).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
    copy
}

#[test]
fn the_verifier_passes_a_sound_job_and_finds_a_lowered_move() {
    let copy = copy_of_the_job();
    let sound = run(copy.path(), ["verify", "lace", "--json"]);
    assert_eq!(sound.code, Some(0), "{sound:?}");
    let again: Verification = serde_json::from_str(&sound.stdout).unwrap();
    let first: Verification = whole(planned().join("lace/verify.json"));
    assert_eq!(again, first);

    let path = copy.path().join("lace").join(TOOLPATHS_FILE);
    let mut moves = read_moves(&copy.path().join("lace")).unwrap().moves;
    let cuts = moves.iter().filter(|m| m.kind == MoveKind::Cut).count();
    let lowered = moves.iter_mut().filter(|m| m.kind == MoveKind::Cut).nth(cuts / 2).unwrap();
    for p in &mut lowered.points {
        for k in 0..3 {
            p[k] -= 0.02 * lowered.axis_start[k];
        }
    }
    let seq = lowered.seq;
    let lines = moves.iter().map(|m| serde_json::to_string(m).unwrap() + "\n");
    fs::write(&path, lines.collect::<String>()).unwrap();
    let spoilt = run(copy.path(), ["verify", "lace", "--json"]);
    assert_eq!(spoilt.code, Some(3), "{}", spoilt.stderr);
    let found: Verification = serde_json::from_str(&spoilt.stdout).unwrap();
    assert!((0.018..0.022).contains(&found.gouge.deepest_mm), "{:?}", found.gouge);
    assert_eq!(found.gouge.deepest_at.unwrap().move_seq, Some(seq));
    let told = run(copy.path(), ["verify", "lace"]);
    assert!(told.stderr.contains("FAILED: the ball enters the model"), "{}", told.stderr);
}

#[test]
fn the_verifier_refuses_another_model_and_a_damaged_folder() {
    let copy = copy_of_the_job();
    let model = copy.path().join("panel.igs");
    let mut text = fs::read_to_string(&model).unwrap();
    text.push('\n');
    fs::write(&model, text).unwrap();
    let changed = run(copy.path(), ["verify", "lace"]);
    assert_eq!(changed.code, Some(1));
    for part in ["panel.igs", "has changed since the job was planned", "help: "] {
        assert!(changed.stderr.contains(part), "{}", changed.stderr);
    }
    let elsewhere = planned().join("panel.igs");
    let original = run(copy.path(), ["verify", "lace", "--model", elsewhere.to_str().unwrap()]);
    assert_eq!(original.code, Some(0), "{}", original.stderr);

    let moves = copy.path().join("lace").join(TOOLPATHS_FILE);
    let text = fs::read_to_string(&moves).unwrap();
    fs::write(&moves, &text[..text.len() / 2]).unwrap();
    fs::remove_file(&model).unwrap();
    fs::copy(planned().join("panel.igs"), &model).unwrap();
    let broken = run(copy.path(), ["verify", "lace"]);
    assert_eq!(broken.code, Some(1));
    for part in [TOOLPATHS_FILE, "line ", "help: "] {
        assert!(broken.stderr.contains(part), "{}", broken.stderr);
    }
}
