//! Stock that is in a file: solids and meshes, what a job leaves as the stock of the next one, and files that are none.

use std::path::Path;

use claymill_exchange::{stl_bytes, write_step};
use claymill_nurbs::{ClosedMesh, Model, Vector3};
use claymill_tests::model_of;
use claymill_toolpath::{Stock, read_job};

use crate::levels::{STOCK, USUAL, job, planned, rectangle, tray, verification};
use crate::run::run_without_adapter;
use crate::scratch;

const TOOL: &str = "flat:4,length:20";

fn stock(file: &str) -> String {
    format!("\n[stock]\nshape = \"file\"\npath = \"{file}\"")
}

/// A box between two corners.
fn solid([x0, y0, z0]: [f64; 3], [x1, y1, z1]: [f64; 3]) -> Model {
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let (a, b, c) = (x1 - x0, y1 - y0, z1 - z0);
    model_of(vec![
        rectangle([x0, y1, z0], x, -z, [a, b]),
        rectangle([x0, y0, z1], x, z, [a, b]),
        rectangle([x0, y0, z0], x, -y, [a, c]),
        rectangle([x1, y1, z0], -x, y, [a, c]),
        rectangle([x0, y1, z0], -y, -x, [b, c]),
        rectangle([x1, y0, z0], y, x, [b, c]),
    ])
}

/// The block of the other jobs, up to a height.
fn block(top: f64) -> Model {
    solid([-2.0, -2.0, -1.0], [28.0, 24.0, top])
}

fn write_mesh(path: &Path, mesh: &ClosedMesh) {
    std::fs::write(path, stl_bytes(&mesh.points, &mesh.triangles)).unwrap();
}

#[test]
fn a_body_is_roughed_and_what_is_left_is_the_stock_of_the_next_job() {
    let folder = scratch();
    let folder = folder.path();
    tray(folder);
    let made = planned(folder, &job(STOCK, TOOL, USUAL));
    assert_eq!(made.code, Some(0), "{made:?}");
    let of_block = verification(&folder.join("out")).stock.unwrap();

    // The same block as a solid, and as a mesh.
    write_step(&folder.join("block.stp"), &block(7.0), &[]).unwrap();
    let mesh = ClosedMesh::of_model(&block(7.0), 0.01).unwrap();
    assert!((mesh.volume_mm3() - 30.0 * 26.0 * 8.0).abs() < 1e-6);
    write_mesh(&folder.join("block.stl"), &mesh);
    for file in ["block.stp", "block.stl"] {
        let made = planned(folder, &job(&stock(file), TOOL, USUAL));
        assert_eq!(made.code, Some(0), "{file}: {made:?}");
        assert!(!made.stderr.contains("lacks material"), "{file}: {made:?}");
        let record = read_job(&folder.join("out")).unwrap();
        let Some(Stock::File(known)) = record.stock else { panic!("{:?}", record.stock) };
        assert_eq!(known.box_mm, Some([-2.0, -2.0, -1.0, 28.0, 24.0, 7.0]));
        let of_file = verification(&folder.join("out")).stock.unwrap();
        // Both are counted by the same points.
        let [one, other] = [&of_block, &of_file].map(|s| &s.volumes);
        assert!((one.initial.mm3 - other.initial.mm3).abs() < 0.02 * one.initial.mm3, "{one:?} {other:?}");
        assert!((one.removed.mm3 - other.removed.mm3).abs() < 0.03 * one.removed.mm3, "{one:?} {other:?}");
    }

    // What is left, and how much that is.
    let left = run_without_adapter(folder, ["stock", "out", "-o", "left.stl", "--pitch", "0.1", "--json"]);
    assert_eq!(left.code, Some(0), "{left:?}");
    let table = left.json();
    let volumes = verification(&folder.join("out")).stock.unwrap().volumes;
    let removed = table[1]["removed_mm3"].as_f64().unwrap();
    assert!((removed - volumes.removed.mm3).abs() < 0.02 * volumes.removed.mm3, "{removed} {volumes:?}");
    let mesh = claymill_exchange::read_solid(&folder.join("left.stl"), 1.0).unwrap();
    let volume = table[1]["volume_mm3"].as_f64().unwrap();
    assert!((mesh.volume_mm3() - volume).abs() < 0.005 * volume, "{} {volume}", mesh.volume_mm3());
    // The same tool finds next to nothing there, a smaller one the corners.
    let cut_mm = |tool: &str| {
        std::fs::remove_dir_all(folder.join("out")).unwrap();
        let made = planned(folder, &job(&stock("left.stl"), tool, USUAL));
        assert!(matches!(made.code, Some(0 | 1)), "{tool}: {made:?}");
        read_job(&folder.join("out")).map_or(0.0, |job| job.totals.length.cut_mm)
    };
    let smaller_mm = cut_mm("flat:1.5,length:20");
    assert!(smaller_mm > 50.0, "{smaller_mm}");
    assert!(cut_mm(TOOL) < 0.2 * smaller_mm);
}

#[test]
fn files_that_are_no_stock_are_named() {
    let folder = scratch();
    let folder = folder.path();
    tray(folder);
    let mut mesh = ClosedMesh::of_model(&block(7.0), 0.01).unwrap();
    write_mesh(&folder.join("block.stl"), &mesh);
    mesh.triangles.pop();
    write_mesh(&folder.join("open.stl"), &mesh);
    std::fs::write(folder.join("text.stl"), "no mesh").unwrap();
    for (file, said) in
        [("open.stl", "the faces are open"), ("text.stl", "text.stl"), ("none.stp", "none.stp")]
    {
        let made = planned(folder, &job(&stock(file), TOOL, USUAL));
        assert_eq!(made.code, Some(1), "{made:?}");
        assert!(made.stderr.contains(said) && made.stderr.contains("help:"), "{file}: {made:?}");
        assert!(!folder.join("out").exists());
    }
    // One that is too low does not hold the part, which is said; another one than was planned with is refused.
    let low = ClosedMesh::of_model(&block(5.0), 0.01).unwrap();
    write_mesh(&folder.join("low.stl"), &low);
    let made = planned(folder, &job(&stock("low.stl"), TOOL, USUAL));
    assert!(made.stderr.contains("lacks material") && made.stderr.contains("by up to 1.00 mm"), "{made:?}");
    write_mesh(&folder.join("low.stl"), &ClosedMesh::of_model(&block(7.0), 0.01).unwrap());
    let verified = run_without_adapter(folder, ["verify", "out"]);
    assert_eq!(verified.code, Some(1), "{verified:?}");
    assert!(verified.stderr.contains("low.stl"), "{verified:?}");
    let asked = run_without_adapter(folder, ["stock", "out"]);
    assert!(asked.stderr.contains("has changed"), "{asked:?}");
}

#[test]
fn operations_are_chosen_for_a_body() {
    let folder = scratch();
    let folder = folder.path();
    crate::operations::plate_and_wall(folder, 40.0);
    let body = solid([-4.0, -4.0, -8.0], [126.0, 74.0, 42.0]);
    write_step(&folder.join("body.stp"), &body, &[]).unwrap();
    let asked = ["plan", "model.igs", "--material", "clay", "--stock", "file:body.stp", "--up", "+z"];
    let more = ["--length", "+x", "--material-side=-z", "--setups", "top", "-o", "out"];
    let made = run_without_adapter(folder, asked.into_iter().chain(more));
    assert_eq!(made.code, Some(0), "{made:?}");
    let record = read_job(&folder.join("out")).unwrap();
    let layers: Vec<_> = record.operations.iter().filter(|o| o.name.starts_with("rough")).collect();
    assert!(layers.len() > 1 && layers.iter().all(|o| o.request.rest_above_mm == Some(1.5)), "{layers:?}");
    let text = std::fs::read_to_string(folder.join("out/job.toml")).unwrap();
    assert!(text.contains("path = \"body.stp\"") && !text.contains("sha256"), "{text}");
}
