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
