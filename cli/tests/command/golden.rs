//! Twelve views of a small job, with every layer in one of them, against kept pictures. `UPDATE_GOLDEN=1` keeps them anew.

use std::path::{Path, PathBuf};

use claymill_tests::{Need, Pixels, leave_out, perceived};

use crate::run::run;
use crate::scratch;

/// Name, camera and layers of a picture, and the rest of its command line.
struct Shot {
    name: &'static str,
    camera: [&'static str; 2],
    show: &'static str,
    more: &'static [&'static str],
}

/// The job is kept with them: what a planner makes of it is not in question here. One pass of it runs 8 µm too low, one 3 µm.
const SHOTS: [Shot; 12] = [
    shot("paths", ["--view", "iso"], "regions,joints,trims,cut,link", &[]),
    shot("kinds", ["--view", "top"], "model,joints,cut,link,lead,rapid", &["--paths-by", "kind"]),
    shot("labels", ["--view", "left"], "regions,joints,labels", &[]),
    shot("scallop", ["--view", "right"], "scallop,joints", &[]),
    shot("uncut", ["--view", "front"], "uncut,joints", &[]),
    shot("gouges", ["--view", "rear"], "model,joints,gouges", &[]),
    shot("classes", ["--camera", "40/50"], "model,classes", &[]),
    shot("worst", ["--camera", "30/25"], "regions,iso-lines,worst", &["--supersample"]),
    shot("stock", ["--camera", "200/40"], "stock,joints", &["--at", "35%", "--allowance", "2"]),
    shot(
        "pass",
        ["--view", "top"],
        "model,cut,control-polygons",
        &["--paths-by", "pass", "--focus", "region:2"],
    ),
    shot(
        "feed",
        ["--camera", "-60,-190,120,80,40,8"],
        "model,control-nets,tool,cut,lead",
        &["--paths-by", "feed", "--holder", "30"],
    ),
    shot("zebra", ["--camera", "150/35"], "model", &["--zebra", "--transparent"]),
];

const fn shot(
    name: &'static str,
    camera: [&'static str; 2],
    show: &'static str,
    more: &'static [&'static str],
) -> Shot {
    Shot { name, camera, show, more }
}

fn kept() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden")
}

/// Draws a shot; `None` without a graphics adapter.
fn draw(shot: &Shot, camera: [&str; 2], show: &str, out: &Path) -> Option<Pixels> {
    let line = ["render", "job", "--model", "little.igs", "--size", "400x250", "--show", show, "-o"];
    let out_name = out.to_string_lossy();
    let all = line.into_iter().chain([&*out_name]).chain(camera).chain(shot.more.iter().copied());
    let made = run(&kept(), all);
    if made.stderr.contains("no graphics adapter") {
        return None;
    }
    assert_eq!(made.code, Some(0), "{}: {made:?}", shot.name);
    Some(Pixels::read(out).unwrap())
}

#[test]
fn twelve_views_look_as_they_did_and_every_layer_and_camera_counts() {
    let folder = scratch();
    let out = |name: &str| folder.path().join(format!("{name}.png"));
    for shot in &SHOTS {
        let Some(drawn) = draw(shot, shot.camera, shot.show, &out(shot.name)) else {
            return leave_out(Need::Vulkan, "no graphics adapter");
        };
        let file = kept().join(format!("{}.png", shot.name));
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            std::fs::copy(out(shot.name), &file).unwrap();
        }
        let golden = Pixels::read(&file).unwrap();
        let found = perceived(&drawn, &golden);
        assert!(found.is_alike(), "{} differs from {}: {found:?}", out(shot.name).display(), file.display());

        // Without any one of its layers it is another picture.
        let layers: Vec<&str> = shot.show.split(',').collect();
        for (k, layer) in layers.iter().enumerate().filter(|_| layers.len() > 1) {
            let others: Vec<&str> = (0..layers.len()).filter(|i| *i != k).map(|i| layers[i]).collect();
            let changed = draw(shot, shot.camera, &others.join(","), &out("changed")).unwrap();
            let found = perceived(&changed, &golden);
            assert!(!found.is_alike(), "{} without {layer} goes unnoticed: {found:?}", shot.name);
        }
        // And so it is from a little farther to the side.
        let turned = match shot.camera {
            ["--camera", camera] if camera.contains('/') => {
                let (azimuth, elevation) = camera.split_once('/').unwrap();
                format!("{}/{elevation}", azimuth.parse::<f64>().unwrap() + 1.0)
            }
            ["--camera", camera] => camera.replace("-190", "-188"),
            _ => continue,
        };
        let changed = draw(shot, ["--camera", &turned], shot.show, &out("changed")).unwrap();
        let found = perceived(&changed, &golden);
        assert!(!found.is_alike(), "{} from {turned} goes unnoticed: {found:?}", shot.name);
    }
}

#[test]
fn a_changed_colour_is_noticed() {
    let shifted = |p: &Pixels, by: u8| {
        // Only what is blue: the colour of one region.
        let blue = |[r, g, b, a]: [u8; 4]| {
            if b > r.saturating_add(60) { [r.saturating_add(by), g, b, a] } else { [r, g, b, a] }
        };
        Pixels { rgba: p.rgba.iter().map(|p| blue(*p)).collect(), ..p.clone() }
    };
    let golden = Pixels::read(&kept().join("labels.png")).unwrap();
    assert!(perceived(&shifted(&golden, 1), &golden).is_alike());
    let found = perceived(&shifted(&golden, 14), &golden);
    assert!(!found.is_alike(), "{found:?}");
}
