//! Pictures compared with kept ones, as an eye would. `UPDATE_GOLDEN=1` keeps them anew.

use std::path::Path;

use claymill_tests::{Pixels, lattice, perceived};

use super::*;

/// A wavy field in two colours with a ball on it, rows over the field and an outline.
fn scene(left: Rgb, rows: bool) -> Scene {
    let mut scene = Scene::default();
    let height = |x: f64, y: f64| 6.0 * (x / 14.0).sin() * (y / 19.0).cos();
    let n = 40_u32;
    for (half, colour) in [(0.0, left), (1.0, [236, 200, 120])] {
        let vertices: Vec<SurfaceVertex> = (0..=n)
            .flat_map(|i| (0..=n).map(move |j| (i, j)))
            .map(|(i, j)| {
                let (x, y) = (50.0 * (half + f64::from(i) / f64::from(n)), 2.0 * f64::from(j));
                let slope_x = 6.0 / 14.0 * (x / 14.0).cos() * (y / 19.0).cos();
                let slope_y = -6.0 / 19.0 * (x / 14.0).sin() * (y / 19.0).sin();
                let normal = Vector3::new(-slope_x, -slope_y, 1.0).normalize();
                vertex(Point3::new(x, y, height(x, y)), normal, colour)
            })
            .collect();
        scene.add_triangles(&vertices, &lattice(n));
    }
    add_sphere(&mut scene, Point3::new(70.0, 50.0, 14.0), 9.0, [200, 120, 110]);
    let mut layer = LineLayer { width_px: 1.2, opacity: 1.0, thinned: true, ..LineLayer::default() };
    for row in 0..160_u32 {
        let y = 0.25 + 0.5 * f64::from(row);
        let points: Vec<Point3> =
            (0..=100).map(|i| Point3::new(f64::from(i), y, height(f64::from(i), y))).collect();
        layer.add(points.iter(), &scene.origin, [30, 60, 110], row);
    }
    if rows {
        scene.lines.push(layer);
    }
    scene
}

fn options() -> PictureOptions {
    PictureOptions { size: [320, 200], annotations: false, ..PictureOptions::default() }
}

fn pixels(p: &Picture) -> Pixels {
    let rgba = p.rgba.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect();
    Pixels { size: [p.width as usize, p.height as usize], rgba }
}

#[test]
fn pictures_look_as_they_did_and_changes_are_noticed() {
    let Some(renderer) = renderer() else { return };
    let axes = Axes::default();
    let blue = [128, 184, 236];
    let scene_as_kept = scene(blue, true);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let zebra = PictureOptions { reflection_lines: true, ..options() };
    for (file, view, options) in [
        ("iso.png", View::iso(&axes), options()),
        ("top.png", View::top(&axes), options()),
        ("around.png", View::around(&axes, 150.0, 40.0), options()),
        ("zebra.png", View::iso(&axes), zebra),
    ] {
        let path = folder.join(file);
        let render = |scene: &Scene, view: &View| renderer.render(scene, view, &options).unwrap();
        let picture = render(&scene_as_kept, &view);
        if std::env::var("UPDATE_GOLDEN").is_ok_and(|v| v == "1") {
            picture.save(&path).unwrap();
        }
        let golden = Pixels::read(&path).unwrap();
        let found = perceived(&pixels(&picture), &golden);
        assert!(found.is_alike(), "{file} differs by {found:?}");

        let turned = Vector3::new(0.05, 0.0, 0.0) + view.direction.normalize();
        let changes = [
            ("a colour", render(&scene([148, 174, 226], true), &view)),
            ("a missing layer", render(&scene(blue, false), &view)),
            ("a turned camera", render(&scene_as_kept, &View { direction: turned, ..view.clone() })),
            ("a wider margin", render(&scene_as_kept, &View { margin: 0.09, ..view.clone() })),
        ];
        for (what, changed) in changes {
            let found = perceived(&pixels(&changed), &golden);
            assert!(!found.is_alike(), "{file}: {what} goes unnoticed, {found:?}");
        }
    }
}
