//! Regions written as model files.

use serde_json::Value;

use crate::run::run;
use crate::scratch;

#[test]
fn regions_come_back_from_every_format_that_can_be_read() {
    let folder = scratch();
    let folder = folder.path();
    assert_eq!(run(folder, ["sample", "panel", "-o", "panel.igs"]).code, Some(0));
    let inspect = |name: &str| run(folder, ["inspect", name, "--json"]).json();
    let first = inspect("panel.igs");
    for name in ["regions.igs", "regions.stp"] {
        let made = run(folder, ["merge", "panel.igs", "--export", name]);
        assert_eq!(made.code, Some(0), "{made:?}");
        let second = inspect(name);
        assert_eq!(second["faces"], first["faces"], "{name}");
        assert_eq!(second["skipped"], Value::Array(Vec::new()), "{name}");
        let (a, b) = (first["area_mm2"].as_f64().unwrap(), second["area_mm2"].as_f64().unwrap());
        assert!((a / b - 1.0).abs() < 1e-9, "{name}: {a} {b}");
    }
    assert_eq!(run(folder, ["merge", "panel.igs", "--export", "regions.glb"]).code, Some(0));
    let glb = std::fs::read(folder.join("regions.glb")).unwrap();
    assert_eq!(
        (&glb[..4], glb.len()),
        (b"glTF".as_slice(), u32::from_le_bytes(glb[8..12].try_into().unwrap()) as usize)
    );
    let refused = run(folder, ["merge", "panel.igs", "--export", "regions.xyz"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(refused.stderr.contains(".igs, .stp or .glb"));
}

#[test]
fn the_mirror_image_of_a_model_is_its_other_half() {
    let folder = scratch();
    let folder = folder.path();
    assert_eq!(run(folder, ["sample", "ribbon", "--patches", "200", "-o", "left.igs"]).code, Some(0));
    let mirrored = |from: &str, to: &str| {
        let made = run(folder, ["merge", from, "--mirror", "y", "--export", to, "--json"]);
        assert_eq!(made.code, Some(0), "{made:?}");
        made.json()["regions"].as_array().unwrap().len()
    };
    let (right, left) = (mirrored("left.igs", "right.stp"), mirrored("right.stp", "left-again.igs"));
    assert_eq!(right, left);
    let inspect = |name: &str| run(folder, ["inspect", name, "--json"]).json();
    let [first, image, second] = ["left.igs", "right.stp", "left-again.igs"].map(inspect);
    let number = |of: &Value| of.as_f64().unwrap();
    for (found, sign) in [(&image, -1.0), (&second, 1.0)] {
        assert_eq!(found["faces"], first["faces"]);
        assert!((number(&found["area_mm2"]) / number(&first["area_mm2"]) - 1.0).abs() < 1e-9);
        let sides = |of: &Value| -> [f64; 6] { std::array::from_fn(|k| number(&of["box_mm"][k])) };
        let (a, b) = (sides(&first), sides(found));
        let wanted = if sign > 0.0 { [a[1], a[4]] } else { [-a[4], -a[1]] };
        assert!((b[1] - wanted[0]).abs() < 1e-6 && (b[4] - wanted[1]).abs() < 1e-6, "{a:?} {b:?}");
        assert!((b[0] - a[0]).abs() < 1e-6 && (b[5] - a[5]).abs() < 1e-6, "{a:?} {b:?}");
    }
    let refused = run(folder, ["merge", "left.igs", "--mirror", "y"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
}

#[test]
fn a_drive_surface_says_what_it_is_off_by_or_why_there_is_none() {
    let folder = scratch();
    let folder = folder.path();
    let made = run(folder, ["sample", "ribbon", "--patches", "200", "-o", "ribbon.igs"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    let merged = run(folder, ["merge", "ribbon.igs", "--drive-surfaces", "drive.igs", "-o", "merged"]);
    assert_eq!(merged.code, Some(0), "{merged:?}");
    assert!(merged.stdout.contains("drive surface of region   0: off by 0.0"), "{}", merged.stdout);
    let drive = run(folder, ["inspect", "drive.igs", "--json"]).json();
    assert_eq!(drive["faces"], 1);
    let text = std::fs::read_to_string(folder.join("merged/regions.json")).unwrap();
    let regions: Value = serde_json::from_str(&text).unwrap();
    let quality = &regions["regions"][0]["quality"];
    assert_eq!((quality["euler"].as_i64(), quality["genus"].as_u64()), (Some(1), Some(0)));
    let refused = run(folder, ["merge", "ribbon.igs", "--drive-surfaces", "drive.xyz"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
}
