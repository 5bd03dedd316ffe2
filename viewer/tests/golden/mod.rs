//! Pictures compared with kept ones, as an eye would: block by block. `UPDATE_GOLDEN=1` keeps them anew.

use std::path::Path;

use super::*;

/// Side of the blocks whose mean colours are compared, pixels: drivers may differ along edges.
const BLOCK: u32 = 4;
/// Largest difference of a block and of the mean over all blocks, sRGB steps.
const ALIKE: (f64, f64) = (8.0, 0.25);

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
        let corner = |i: u32, j: u32| i * (n + 1) + j;
        let triangles: Vec<[u32; 3]> = (0..n)
            .flat_map(|i| (0..n).map(move |j| (i, j)))
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        scene.add_triangles(&vertices, &triangles);
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

/// Largest and mean difference of blocks.
fn difference(a: &Picture, b: &Picture) -> (f64, f64) {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let mean = |p: &Picture, x: u32, y: u32, c: usize| {
        let pixels = (0..BLOCK * BLOCK).map(|k| p.pixel(x + k % BLOCK, y + k / BLOCK)[c]);
        pixels.map(f64::from).sum::<f64>() / f64::from(BLOCK * BLOCK)
    };
    let mut differences = Vec::new();
    for y in (0..a.height).step_by(BLOCK as usize) {
        for x in (0..a.width).step_by(BLOCK as usize) {
            let channel = |c: usize| (mean(a, x, y, c) - mean(b, x, y, c)).abs();
            differences.push((0..3).map(channel).fold(0.0, f64::max));
        }
    }
    let sum: f64 = differences.iter().sum();
    (differences.iter().copied().fold(0.0, f64::max), sum / differences.len() as f64)
}

fn alike(a: &Picture, b: &Picture) -> bool {
    let (largest, mean) = difference(a, b);
    largest <= ALIKE.0 && mean <= ALIKE.1
}

fn kept(path: &Path) -> Picture {
    let file = std::fs::File::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    let mut data = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut data).unwrap();
    assert_eq!(info.color_type, png::ColorType::Rgb, "{}", path.display());
    let rgba = data.chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], 255]).collect();
    Picture { width: info.width, height: info.height, rgba }
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
        let golden = kept(&path);
        let found = difference(&picture, &golden);
        assert!(alike(&picture, &golden), "{file} differs by {found:?}");

        let turned = Vector3::new(0.05, 0.0, 0.0) + view.direction.normalize();
        let changes = [
            ("a colour", render(&scene([148, 174, 226], true), &view)),
            ("a missing layer", render(&scene(blue, false), &view)),
            ("a turned camera", render(&scene_as_kept, &View { direction: turned, ..view.clone() })),
            ("a wider margin", render(&scene_as_kept, &View { margin: 0.09, ..view.clone() })),
        ];
        for (what, changed) in changes {
            let found = difference(&changed, &golden);
            assert!(!alike(&changed, &golden), "{file}: {what} goes unnoticed, {found:?}");
        }
    }
}
