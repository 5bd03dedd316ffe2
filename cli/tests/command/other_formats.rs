//! Rhino files go the ordinary way; meshes are inspected and not machined.

use std::path::Path;

use serde_json::Value;

use crate::run::run;
use crate::scratch;

/// A tetrahedron with its base missing.
const TENT: &str = "solid tent
facet normal 0 0 0 outer loop vertex 0 0 0 vertex 40 0 0 vertex 0 0 30 endloop endfacet
facet normal 0 0 0 outer loop vertex 40 0 0 vertex 0 30 0 vertex 0 0 30 endloop endfacet
facet normal 0 0 0 outer loop vertex 0 30 0 vertex 0 0 0 vertex 0 0 30 endloop endfacet
endsolid tent
";

fn json(folder: &Path, args: &[&str]) -> Value {
    let made = run(folder, args);
    assert_eq!(made.code, Some(0), "{made:?}");
    serde_json::from_str(&made.stdout).expect("JSON")
}

#[test]
fn a_mesh_is_inspected_but_not_planned() {
    let folder = scratch();
    let folder = folder.path();
    std::fs::write(folder.join("tent.dat"), TENT).expect("a file");
    let found = json(folder, &["inspect", "tent.dat", "--json"]);
    assert_eq!(
        (&found["triangles"], &found["open_edges"], &found["unit_mm"]),
        (&3.into(), &3.into(), &1.0.into())
    );
    let sides = 0.5 * 40.0 * 30.0 + 0.5 * 30.0 * 30.0;
    let slope = 0.5 * f64::sqrt((30.0_f64 * 30.0).powi(2) + 2.0 * (40.0_f64 * 30.0).powi(2));
    let area = found["area_mm2"].as_f64().expect("a number");
    assert!((area - sides - slope).abs() < 1e-9, "{area}");
    assert_eq!(found["box_mm"], serde_json::json!([0.0, 0.0, 0.0, 40.0, 30.0, 30.0]));
    let inches = json(folder, &["inspect", "tent.dat", "--mesh-unit", "25.4", "--json"]);
    assert_eq!(inches["box_mm"][3], 1016.0);
    let text = run(folder, ["inspect", "tent.dat"]);
    assert!(text.stdout.contains("open edges  3"), "{}", text.stdout);
    let refused = run(folder, ["plan", "tent.dat", "-o", "job"]);
    assert_eq!(refused.code, Some(1));
    assert!(refused.stderr.contains("it looks like an STL mesh"), "{}", refused.stderr);
    let damaged = TENT.replace("vertex 40", "vertex forty");
    std::fs::write(folder.join("damaged.stl"), damaged).expect("a file");
    let refused = run(folder, ["inspect", "damaged.stl"]);
    assert_eq!(refused.code, Some(1));
    assert!(refused.stderr.contains("line 2: a corner needs three numbers"), "{}", refused.stderr);
}

#[test]
fn a_rhino_file_is_a_model() {
    let folder = scratch();
    let archive = concat!(env!("CARGO_MANIFEST_DIR"), "/../exchange/tests/threedm/v5.3dm");
    let found = json(folder.path(), &["inspect", archive, "--json"]);
    assert_eq!(
        (&found["faces"], &found["faces_in_file"], &found["units"]),
        (&21.into(), &24.into(), &"MM".into())
    );
    let merged = json(folder.path(), &["merge", archive, "--json"]);
    // The box: six sides, each a region of its own.
    let areas: Vec<f64> = merged["regions"]
        .as_array()
        .expect("regions")
        .iter()
        .filter_map(|r| r["area_mm2"].as_f64())
        .collect();
    for side in [200.0, 300.0, 600.0] {
        assert_eq!(areas.iter().filter(|a| (**a - side).abs() < 1e-6).count(), 2, "{areas:?}");
    }
}
