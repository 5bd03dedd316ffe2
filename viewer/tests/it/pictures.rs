//! What the pixels must show, from first principles and (`golden`) as they were. Needs an adapter; a software driver will do.

mod golden;

use claymill_nurbs::{Point3, Vector3};
use claymill_tests::{Need, leave_out};
use claymill_viewer::{
    Axes, Backdrop, Camera, LineLayer, Picture, PictureOptions, Renderer, Rgb, Scene, SurfaceVertex, View,
    ViewError,
};

/// The renderer, or `None`: the calling test is left out.
#[track_caller]
fn renderer() -> Option<Renderer> {
    match Renderer::new() {
        Ok(renderer) => Some(renderer),
        Err(error) => {
            leave_out(Need::Vulkan, error);
            None
        }
    }
}

fn plain(size: [u32; 2]) -> PictureOptions {
    PictureOptions {
        size,
        annotations: false,
        occlusion: false,
        backdrop: Backdrop::White,
        ..PictureOptions::default()
    }
}

fn vertex(p: Point3, n: Vector3, colour: Rgb) -> SurfaceVertex {
    SurfaceVertex {
        position: [p.x as f32, p.y as f32, p.z as f32],
        normal: [n.x as f32, n.y as f32, n.z as f32],
        colour: [colour[0], colour[1], colour[2], 255],
    }
}

fn add_sphere(scene: &mut Scene, centre: Point3, radius: f64, colour: Rgb) {
    let (rows, columns) = (12_u32, 24_u32);
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..=rows {
        for j in 0..columns {
            let (a, b) = (
                f64::from(i) / f64::from(rows) * std::f64::consts::PI,
                f64::from(j) / f64::from(columns) * std::f64::consts::TAU,
            );
            let n = Vector3::new(a.sin() * b.cos(), a.sin() * b.sin(), a.cos());
            vertices.push(vertex(centre + n * radius, n, colour));
            if i < rows {
                let at = |i: u32, j: u32| i * columns + j % columns;
                triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    scene.add_triangles(&vertices, &triangles);
}

/// A square in the plane of height `z`, seen well from above.
fn add_square(scene: &mut Scene, min: [f64; 2], side: f64, z: f64, colour: Rgb) {
    let corner = |dx: f64, dy: f64| Point3::new(min[0] + dx * side, min[1] + dy * side, z);
    let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
    let vertices = corners.map(|p| vertex(p, Vector3::z(), colour));
    scene.add_triangles(&vertices, &[[0, 1, 2], [0, 2, 3]]);
}

fn line(points: &[Point3], width_px: f32) -> LineLayer {
    let mut layer = LineLayer { width_px, opacity: 1.0, ..LineLayer::default() };
    layer.add(points.iter(), &Point3::origin(), [0, 0, 0], 0);
    layer
}

/// Ink in a column of a picture on white: 1 for each black pixel.
fn ink(picture: &Picture, x: u32) -> f64 {
    // Coverage is mixed by light, so the encoded value has to be undone.
    let light = |v: u8| ((f64::from(v) / 255.0 + 0.055) / 1.055).powf(2.4);
    (0..picture.height).map(|y| 1.0 - light(picture.pixel(x, y)[1])).sum()
}

#[test]
fn spheres_appear_where_the_camera_says() {
    let Some(renderer) = renderer() else { return };
    let places = [(-40.0, -25.0, 3.0), (35.0, 10.0, -20.0), (0.0, 0.0, 0.0), (20.0, -30.0, 28.0)];
    let size = [640, 400];
    for view in [View::top(&Axes::default()), View::left(&Axes::default()), View::iso(&Axes::default())] {
        for (i, &(x, y, z)) in places.iter().enumerate() {
            // One red marker among grey ones, so that its pixels are known.
            let mut scene = Scene::default();
            for (j, &(x, y, z)) in places.iter().enumerate() {
                let colour = if i == j { [230, 0, 0] } else { [120, 120, 120] };
                add_sphere(&mut scene, Point3::new(x, y, z), 1.2, colour);
            }
            let picture = renderer.render(&scene, &view, &plain(size)).unwrap();
            let (mut sum, mut mean) = (0.0, [0.0, 0.0]);
            for py in 0..size[1] {
                for px in 0..size[0] {
                    // Not by brightness: light from one side would pull the mean to that side.
                    let [r, g, ..] = picture.pixel(px, py).map(f64::from);
                    let weight = f64::from(u8::from(r > 2.0 * g));
                    sum += weight;
                    mean[0] += weight * (f64::from(px) + 0.5);
                    mean[1] += weight * (f64::from(py) + 0.5);
                }
            }
            let camera = Camera::frame(&view, scene.points(), size);
            let expected = camera.project(&Point3::new(x, y, z)).unwrap();
            assert!(sum > 20.0, "{}: marker {i} is not seen", view.name);
            for k in 0..2 {
                let error = mean[k] / sum - expected[k];
                assert!(error.abs() < 0.5, "{} marker {i} axis {k}: {error:.3} px off", view.name);
            }
        }
    }
}

#[test]
fn colours_and_backdrop_are_where_they_belong() {
    let Some(renderer) = renderer() else { return };
    let mut scene = Scene::default();
    add_square(&mut scene, [0.0, 0.0], 10.0, 0.0, [220, 60, 60]);
    add_square(&mut scene, [10.0, 0.0], 10.0, 0.0, [60, 60, 220]);
    let view = View::looking("above", -Vector3::z(), Vector3::y());
    let size = [300, 200];
    let picture = renderer.render(&scene, &view, &plain(size)).unwrap();
    let camera = Camera::frame(&view, scene.points(), size);
    let at = |x: f64, y: f64| {
        let [px, py] = camera.project(&Point3::new(x, y, 0.0)).unwrap();
        picture.pixel(px as u32, py as u32)
    };
    for y in [1.0, 5.0, 9.0] {
        let (left, right) = (at(5.0, y), at(15.0, y));
        assert!(left[0] > 2 * left[2] && right[2] > 2 * right[0], "{left:?} {right:?}");
        // Light from the front keeps a colour about what the legend shows.
        assert!(left[0].abs_diff(220) < 40, "{left:?}");
    }
    let corners = [(0, 0), (299, 0), (0, 199), (299, 199)];
    for (x, y) in corners {
        assert_eq!(picture.pixel(x, y), [255, 255, 255, 255]);
    }
    let transparent = PictureOptions { backdrop: Backdrop::Transparent, occlusion: true, ..plain(size) };
    let cut_out = renderer.render(&scene, &view, &transparent).unwrap();
    let [px, py] = camera.project(&Point3::new(5.0, 5.0, 0.0)).unwrap();
    assert_eq!(cut_out.pixel(px as u32, py as u32)[3], 255);
    for (x, y) in corners {
        assert_eq!(cut_out.pixel(x, y)[3], 0);
    }
}

#[test]
fn lines_have_their_width_at_any_slope() {
    let Some(renderer) = renderer() else { return };
    let view = View::looking("above", -Vector3::z(), Vector3::y());
    for slope in [0.0, 0.13, 0.4] {
        for width_px in [1.0, 2.4, 6.0] {
            let mut scene = Scene::default();
            let ends = [Point3::new(-50.0, -50.0 * slope, 0.0), Point3::new(50.0, 50.0 * slope, 0.0)];
            scene.lines.push(line(&ends, width_px));
            let picture = renderer.render(&scene, &view, &plain([400, 300])).unwrap();
            let across = f64::from(width_px) * f64::hypot(1.0, slope);
            let columns: Vec<f64> = (120..280).map(|x| ink(&picture, x)).collect();
            let mean = columns.iter().sum::<f64>() / columns.len() as f64;
            assert!((mean - across).abs() < 0.1, "slope {slope} width {width_px}: {mean:.3} for {across:.3}");
            let spread = columns.iter().fold(0.0_f64, |s, c| s.max((c - mean).abs()));
            assert!(spread < 0.35, "slope {slope} width {width_px}: uneven by {spread:.3} px");
        }
    }
}

#[test]
fn lines_on_a_surface_show_whole_and_lines_behind_it_do_not() {
    let Some(renderer) = renderer() else { return };
    let view = View::looking("slanted", Vector3::new(0.3, 0.5, -0.8), Vector3::z());
    let size = [400, 300];
    for (z, expected) in [(0.0, true), (-5.0, false)] {
        let mut scene = Scene::default();
        add_square(&mut scene, [-50.0, -50.0], 100.0, 0.0, [220, 220, 220]);
        scene.lines.push(line(&[Point3::new(-30.0, -20.0, z), Point3::new(30.0, 25.0, z)], 3.0));
        let picture = renderer.render(&scene, &view, &plain(size)).unwrap();
        let camera = Camera::frame(&view, scene.points(), size);
        for i in 0..=60 {
            let p = Point3::new(f64::from(i) - 30.0, f64::from(i) * 0.75 - 20.0, z);
            let [px, py] = camera.project(&p).unwrap();
            let dark = picture.pixel(px as u32, py as u32)[1] < 90;
            assert_eq!(dark, expected, "at {p} height {z}");
        }
    }
}

#[test]
fn the_same_scene_gives_the_same_pixels_for_any_number_of_threads() {
    let Some(renderer) = renderer() else { return };
    let mut scene = Scene::default();
    add_sphere(&mut scene, Point3::origin(), 20.0, [200, 180, 150]);
    let spiral: Vec<Point3> = (0..20_000)
        .map(|i| {
            let t = f64::from(i) * 0.01;
            Point3::new(20.0 * t.cos() * (t / 200.0), 20.0 * t.sin() * (t / 200.0), 25.0)
        })
        .collect();
    for part in spiral.chunks(40) {
        scene.lines.push(line(part, 1.0));
    }
    let options = PictureOptions { size: [320, 200], supersampling: true, ..PictureOptions::default() };
    let picture_with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| renderer.render(&scene, &View::iso(&Axes::default()), &options).unwrap())
    };
    let one = picture_with(1);
    assert_eq!([one.width, one.height], options.size);
    assert!(one == picture_with(4), "pixels differ");
}

#[test]
fn impossible_pictures_are_refused_with_a_reason() {
    let Some(renderer) = renderer() else { return };
    let view = View::top(&Axes::default());
    let empty = renderer.render(&Scene::default(), &view, &plain([100, 100]));
    assert!(matches!(empty, Err(ViewError::EmptyScene)));
    let mut scene = Scene::default();
    add_square(&mut scene, [0.0, 0.0], 1.0, 0.0, [0, 0, 0]);
    for size in [[0, 100], [100, 1_000_000], [u32::MAX, u32::MAX]] {
        let refused = renderer.render(&scene, &view, &plain(size));
        assert!(matches!(refused, Err(ViewError::Size { .. })), "{size:?}");
    }
    // A single point-like thing is still a picture.
    assert!(renderer.render(&scene, &view, &plain([1, 1])).is_ok());
}

#[test]
fn an_unwritable_file_leaves_nothing_behind() {
    let picture = Picture { width: 1, height: 1, rgba: vec![0; 4] };
    let folder = tempfile::tempdir().unwrap();
    let error = picture.save(&folder.path().join("missing/picture.png")).unwrap_err();
    assert!(error.to_string().contains("missing/picture.png"), "{error}");
    // A folder stands where the file should go.
    let taken = folder.path().join("taken.png");
    std::fs::create_dir(&taken).unwrap();
    assert!(picture.save(&taken).is_err());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "a partial file was left");
}
