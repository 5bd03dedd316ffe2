//! The window driven by the events of a hand, against geometry that is known exactly: a ball of 40 mm radius over a
//! plate with rows of passes 2 mm apart. No display is needed; pictures only where there is an adapter.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;
use std::time::{Duration, Instant};

use approx::assert_abs_diff_eq;
use claymill_nurbs::analytic::{Frame, plane_patch, sphere};
use claymill_nurbs::{
    Face, MeshOptions, Model, NurbsSurface, Point3, Source, SurfaceKind, Vector3, tessellate,
};
use claymill_tests::{Need, leave_out};
use claymill_toolpath::{Holder, Job, Move, MoveKind, Program, RegionsFile};
use claymill_viewer::{Axes, ViewError};
use claymill_window::{Care, Exhibit, Headless, JobToShow, Paint, Tool};
use egui::{Key, Modifiers, PointerButton};
use serde_json::{Value, json};

const SIZE: [u32; 2] = [1200, 760];
const CENTRE: [f64; 3] = [300.0, -120.0, 60.0];
const RADIUS_MM: f64 = 40.0;
const ROWS: u32 = 81;
/// Longer than anything takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

fn face(surface: NurbsSurface, kind: SurfaceKind, entity: &str, name: Option<&str>) -> Face {
    let source = Source { entity: entity.into(), name: name.map(Into::into), ..Source::default() };
    Face { surface, loops: Vec::new(), reversed: false, kind, source }
}

/// Rows along y over the plate, every other one backwards, and the way between them; a second a row.
fn job() -> JobToShow {
    let mut moves = Vec::new();
    for row in 0..ROWS {
        let x = 220.0 + 2.0 * f64::from(row);
        let ends = [Point3::new(x, -200.0, 0.0), Point3::new(x, -40.0, 0.0)];
        let [from, to] = if row % 2 == 0 { ends } else { [ends[1], ends[0]] };
        let of = |kind, from, to| Move {
            seq: moves.len() as u64,
            setup: "top".into(),
            region: 1,
            pass: row + 1,
            tool: "T1".into(),
            ..Move::straight(kind, from, to, Vector3::z(), 6000.0)
        };
        let cut = of(MoveKind::Cut, from, to);
        moves.push(cut);
    }
    let length = json!({ "cut_mm": 160.0 * f64::from(ROWS), "lead_mm": 0, "link_mm": 0, "rapid_mm": 0 });
    let area =
        |mm2: f64| json!({ "total_mm2": mm2, "cut_mm2": 0.5 * mm2, "uncut_mm2": { "hidden": 0.5 * mm2 } });
    let account = |face: usize, mm2: f64| {
        let mut account = area(mm2);
        account["face"] = json!(face);
        account["entity"] = json!("");
        account["region"] = json!(face);
        account
    };
    let job: Job = serde_json::from_value(json!({
        "format_version": 1, "claymill_version": "", "peak_memory_mb": 0, "timings": [], "tolerances": {},
        "model": { "path": "", "sha256": "", "units": "mm", "unit_mm": 1, "faces_in_file": 2, "faces_read": 2,
                   "skipped": [], "area_mm2": 1, "box_mm": [0, 0, 0, 1, 1, 1] },
        "request": { "tool": { "shape": "ball", "radius_mm": 5 }, "scallop_mm": 0.1, "strategy": "planar",
                     "link": "lace", "preset": "clay", "up": "+z", "length": "-y", "only": [], "skip": [],
                     "feed_mm_per_min": 6000, "rapid_mm_per_min": 20000 },
        "tools": [{ "id": "T1", "shape": "ball", "radius_mm": 5 }],
        "setups": [{ "name": "top", "axis": [0, 0, 1], "clearance_mm": 120, "area_mm2": 1, "time_s": f64::from(ROWS) }],
        "regions": [], "area": area(60_000.0),
        "faces": [account(0, 20_000.0), account(1, 40_000.0)],
        "totals": { "moves": ROWS, "passes": ROWS, "retracts": 0, "length": length, "control_points": 2 * ROWS,
                    "time_s": ROWS, "lifted_locations": 0 },
    }))
    .unwrap();
    let seconds = vec![1.0; moves.len()];
    JobToShow { job, program: Program { moves }, seconds, verification: None, crests: None }
}

fn exhibit() -> Arc<Exhibit> {
    let frame = |at: Point3| Frame::new(at, Vector3::z(), Vector3::x()).unwrap();
    let ball = sphere(&frame(CENTRE.into()), RADIUS_MM, (0.0, 2.0 * PI), (-FRAC_PI_2, FRAC_PI_2)).unwrap();
    let plate =
        plane_patch(&frame(Point3::new(300.0, -120.0, 0.0)), (-100.0, 100.0), (-100.0, 100.0)).unwrap();
    let faces = vec![
        face(ball, SurfaceKind::Sphere, "DE 17", Some("HEADLAMP")),
        face(plate, SurfaceKind::Plane, "DE 19", None),
    ];
    let options = MeshOptions { deviation_mm: 0.5, longest_edge_mm: 60.0 };
    let meshes = faces.iter().map(|f| tessellate(f, &options).unwrap()).collect();
    Arc::new(Exhibit {
        title: "ball over a plate".into(),
        model: Model { faces, ..Model::default() },
        meshes,
        region_of_face: vec![0, 1],
        regions: RegionsFile { tolerance_mm: 0.01, ..RegionsFile::default() },
        free_sides: Vec::new(),
        axes: Axes::default(),
        job: Some(job()),
    })
}

/// Where a point is in the picture.
fn seen(window: &Headless<'_>, p: [f64; 3]) -> egui::Pos2 {
    window.in_window(window.pane.desk.sight.project(&p.into()).unwrap())
}

fn point(v: &Value) -> Point3 {
    Point3::from([0, 1, 2].map(|i| v[i].as_f64().unwrap()))
}

/// What the click on a place of the model tells other programs.
fn told(window: &mut Headless<'_>, at: [f64; 3]) -> Value {
    let at = seen(window, at);
    window.click(at).unwrap();
    window.pane.desk.take_said().pop().expect("something is said")
}

#[test]
fn a_click_tells_the_exact_surface_and_not_its_triangles() {
    let exhibit = exhibit();
    let mut window = Headless::new(&exhibit, SIZE).unwrap();
    window.frame(Vec::new()).unwrap();
    for (direction, view) in
        [([0.3, -0.5, 0.7], Key::I), ([0.1, 0.2, 0.9], Key::T), ([0.2, -0.9, 0.1], Key::F)]
    {
        window.key(view).unwrap();
        let way = Vector3::from(direction).normalize();
        let place = Point3::from(CENTRE) + way * RADIUS_MM;
        let said = told(&mut window, place.into());
        let surface = &said["picked"]["surface"];
        assert_eq!(surface["name"], "HEADLAMP (DE 17)", "{said}");
        assert_eq!((surface["face"].as_u64(), surface["region"].as_u64()), (Some(0), Some(0)));
        let found = point(&surface["point_mm"]);
        // On the ball to the last digits, at the place within the pixel that was clicked.
        assert_abs_diff_eq!((found - Point3::from(CENTRE)).norm(), RADIUS_MM, epsilon = 1e-9);
        assert!((found - place).norm() < 2.0 * window.pane.desk.sight.mm_per_px(), "{found} for {place}");
        let normal = Vector3::from(point(&surface["normal"]).coords);
        assert_abs_diff_eq!(normal, (found - Point3::from(CENTRE)).normalize(), epsilon = 1e-9);
        for radius in surface["radii_mm"].as_array().unwrap() {
            assert_abs_diff_eq!(radius.as_f64().unwrap(), -RADIUS_MM, epsilon = 1e-6);
        }
        assert_abs_diff_eq!(surface["cut_share"].as_f64().unwrap(), 0.5, epsilon = 1e-12);
        assert!(said["picked"]["path"].is_null(), "no path runs over the ball: {said}");
    }
}

#[test]
fn a_click_on_a_pass_tells_its_move_and_the_tip() {
    let exhibit = exhibit();
    let mut window = Headless::new(&exhibit, SIZE).unwrap();
    window.frame(Vec::new()).unwrap();
    window.key(Key::T).unwrap();
    let at = [230.0, -170.0, 0.0];
    let centre = seen(&window, at);
    window.wheel(centre, 12.0).unwrap();
    let said = told(&mut window, at);
    let path = &said["picked"]["path"];
    assert_eq!(
        (path["seq"].as_u64(), path["pass"].as_u64(), path["region"].as_u64()),
        (Some(5), Some(6), Some(1))
    );
    assert_eq!((path["kind"].as_str(), path["setup"].as_str()), (Some("cut"), Some("top")));
    assert_eq!(path["feed_mm_per_min"].as_f64(), Some(6000.0));
    let near = 1.5 * window.pane.desk.sight.mm_per_px();
    for field in ["tip_mm", "point_mm"] {
        assert!((point(&path[field]) - Point3::from(at)).norm() < near, "{field}: {path}");
    }
    // The sixth row runs backwards: after 130 of 160 mm, five whole seconds before.
    assert_abs_diff_eq!(path["at_s"].as_f64().unwrap(), 5.0 + 130.0 / 160.0, epsilon = near / 100.0);
    assert_eq!(said["picked"]["surface"]["name"], "DE 19");
}

#[test]
fn an_open_boundary_is_told_as_such() {
    let exhibit = exhibit();
    let mut window = Headless::new(&exhibit, SIZE).unwrap();
    window.frame(Vec::new()).unwrap();
    window.key(Key::T).unwrap();
    let said = told(&mut window, [200.0, -120.0, 0.0]);
    let joint = &said["picked"]["joint"];
    assert_eq!(joint["class"], "open boundary");
    assert_eq!(joint["faces"], json!([1]));
}

#[test]
fn a_joint_tells_what_was_measured_on_it() {
    let mut exhibit = Arc::into_inner(exhibit()).unwrap();
    let frame = Frame::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    let half = |u| plane_patch(&frame, u, (-100.0, 100.0)).unwrap();
    let faces = vec![
        face(half((-100.0, 0.0)), SurfaceKind::Plane, "DE 1", None),
        face(half((0.0, 100.0)), SurfaceKind::Plane, "DE 3", None),
    ];
    let options = MeshOptions { deviation_mm: 0.5, longest_edge_mm: 60.0 };
    exhibit.meshes = faces.iter().map(|f| tessellate(f, &options).unwrap()).collect();
    exhibit.model.faces = faces;
    exhibit.job = None;
    exhibit.region_of_face = vec![0, 0];
    let record = |faces: [usize; 2], length_mm: f64, class: &str| {
        json!({ "faces": faces, "length_mm": length_mm, "class": class, "verdict": "merged", "why": "smooth",
            "gap_max_mm": 0.002 * length_mm, "gap_normal_max_mm": 0, "angle_max_deg": 0.25, "angle_p95_deg": 0,
            "angle_rms_deg": 0, "angle_mid_deg": 0, "curvature_max": 0, "curvature_p95": 0, "curvature_rms": 0,
            "curvature_mid": 0, "curvature_relative_max": 0 })
    };
    // Of two joints of one pair the longer one is told.
    let joints = json!([record([1, 0], 1.0, "C0"), record([1, 0], 200.0, "G2")]);
    exhibit.regions.joints = serde_json::from_value(joints).unwrap();
    let exhibit = Arc::new(exhibit);
    let mut window = Headless::new(&exhibit, SIZE).unwrap();
    window.frame(Vec::new()).unwrap();
    assert_eq!(window.pane.desk.joint_counts(), [0, 0, 0, 1, 2]);
    window.key(Key::T).unwrap();
    let on_joint = [0.0, 30.0, 0.0];
    assert!(told(&mut window, on_joint)["picked"]["joint"].is_null(), "smooth joints are not shown unasked");
    window.pane.desk.layers.seams[3] = true;
    let said = told(&mut window, on_joint);
    let joint = &said["picked"]["joint"];
    assert_eq!((&joint["class"], &joint["continuity"]), (&json!("smooth joint"), &json!("G2")), "{said}");
    assert_eq!((&joint["gap_max_mm"], &joint["angle_max_deg"]), (&json!(0.4), &json!(0.25)));
    assert!(
        joint["names"] == json!(["DE 1", "DE 3"]) || joint["names"] == json!(["DE 3", "DE 1"]),
        "{joint}"
    );
    assert!((point(&joint["point_mm"]) - Point3::from(on_joint)).norm() < window.pane.desk.sight.mm_per_px());
}

#[test]
fn two_clicks_measure_between_exact_points() {
    let exhibit = exhibit();
    let mut window = Headless::new(&exhibit, SIZE).unwrap();
    window.frame(Vec::new()).unwrap();
    window.key(Key::T).unwrap();
    window.key(Key::M).unwrap();
    assert_eq!(window.pane.desk.tool, Tool::Measure);
    let up = Vector3::new(0.2, -0.3, 0.8).normalize();
    let high = Point3::from(CENTRE) + up * RADIUS_MM;
    for at in [high.into(), [360.0, -60.0, 0.0]] {
        let at = seen(&window, at);
        window.click(at).unwrap();
    }
    let said = window.pane.desk.take_said().pop().unwrap();
    let measured = &said["measured"];
    let (a, b) = (point(&measured["from_mm"]), point(&measured["to_mm"]));
    let normal = (a - Point3::from(CENTRE)) / RADIUS_MM;
    let scale = window.pane.desk.sight.mm_per_px();
    assert!((a - high).norm() < 3.0 * scale && (b - Point3::new(360.0, -60.0, 0.0)).norm() < 2.0 * scale);
    // Exact, although the pixels are not.
    assert_abs_diff_eq!(normal.norm(), 1.0, epsilon = 1e-10);
    assert_abs_diff_eq!(b.z, 0.0, epsilon = 1e-9);
    let number = |field: &str| measured[field].as_f64().unwrap();
    assert_abs_diff_eq!(number("distance_mm"), (b - a).norm(), epsilon = 1e-9);
    assert_abs_diff_eq!(number("along_normal_mm"), (b - a).dot(&normal), epsilon = 1e-8);
    assert_abs_diff_eq!(number("angle_deg"), normal.xy().norm().atan2(normal.z).to_degrees(), epsilon = 1e-7);
    assert_abs_diff_eq!(point(&measured["delta_mm"]).coords, b - a, epsilon = 1e-9);
}

#[test]
fn what_is_cut_away_or_switched_off_is_not_picked() {
    let exhibit = exhibit();
    let mut window = Headless::new(&exhibit, SIZE).unwrap();
    window.frame(Vec::new()).unwrap();
    window.key(Key::T).unwrap();
    let top = [CENTRE[0] + 5.0, CENTRE[1] - 3.0, 100.0];
    window.key(Key::X).unwrap();
    window.pane.desk.cutting.axis = 2;
    // The box reaches from the plate to the top of the ball: half way up is 10 mm below the ball's middle.
    let section = window.pane.desk.section().unwrap();
    assert_abs_diff_eq!(section.at_mm, 50.0, epsilon = 0.5);
    let said = told(&mut window, top);
    let z = point(&said["picked"]["surface"]["point_mm"]).z;
    assert!(z < section.at_mm && z > 19.0, "the lower half of the ball is seen from inside: {z}");
    window.key(Key::X).unwrap();
    window.pane.desk.layers.regions[0] = false;
    let said = told(&mut window, top);
    assert_eq!(said["picked"]["surface"]["face"].as_u64(), Some(1));
}

#[test]
fn the_hand_turns_moves_and_zooms_about_what_it_holds() {
    let exhibit = exhibit();
    let mut window = Headless::new(&exhibit, SIZE).unwrap();
    window.frame(Vec::new()).unwrap();
    let held = Point3::from(CENTRE) + Vector3::new(0.3, -0.6, 0.6).normalize() * RADIUS_MM;
    let at = seen(&window, held.into());
    let scale = window.pane.desk.sight.mm_per_px_at(&held);
    window.wheel(at, 5.0).unwrap();
    assert!((seen(&window, held.into()) - at).length() < 2.0);
    let zoomed = window.pane.desk.sight.mm_per_px_at(&held);
    assert_abs_diff_eq!(scale / zoomed, 1.2_f64.powi(5), epsilon = 0.02);

    let forward = window.pane.desk.sight.forward();
    window.drag(PointerButton::Middle, at, at + egui::vec2(90.0, 40.0)).unwrap();
    assert!((window.pane.desk.sight.forward() - forward).norm() > 0.2);
    assert!((seen(&window, held.into()) - at).length() < 3.0, "the pivot stands still");

    let forward = window.pane.desk.sight.forward();
    let to = at + egui::vec2(-120.0, 60.0);
    window.drag(PointerButton::Secondary, at, to).unwrap();
    assert_abs_diff_eq!(window.pane.desk.sight.forward(), forward, epsilon = 1e-12);
    assert!((seen(&window, held.into()) - to).length() < 3.0, "it follows the hand");

    window.hold(Modifiers::SHIFT).unwrap();
    window.drag(PointerButton::Primary, to, at).unwrap();
    window.hold(Modifiers::NONE).unwrap();
    assert!((seen(&window, held.into()) - at).length() < 3.0, "and back");
    // None of these drags was a click.
    assert!(window.pane.desk.picked().is_none() && window.pane.desk.take_said().is_empty());
    window.key(Key::Home).unwrap();
    assert!(window.pane.desk.sight.mm_per_px() > 2.0 * zoomed);
}

#[test]
fn time_goes_on_move_by_move_and_as_fast_as_told() {
    let exhibit = exhibit();
    let mut window = Headless::new(&exhibit, SIZE).unwrap();
    window.frame(Vec::new()).unwrap();
    assert_eq!(window.pane.desk.duration_s(), f64::from(ROWS));
    assert!(window.pane.desk.tool_place().is_none(), "the job is over as the window opens");
    window.pane.desk.clock.now_s = 0.0;
    for expected in [1, 2, 3] {
        window.key(Key::ArrowRight).unwrap();
        let place = window.pane.desk.tool_place().unwrap();
        assert_eq!((place.of, place.share), (expected, 0.0));
    }
    window.key(Key::ArrowLeft).unwrap();
    assert_eq!(window.pane.desk.now(), Some((2, 0.0)));
    window.pane.desk.clock.speed = 10.0;
    window.key(Key::Space).unwrap();
    let begun = window.pane.desk.clock.now_s;
    for _ in 0..5 {
        window.frame_after(Vec::new(), 0.05).unwrap();
    }
    let place = window.pane.desk.tool_place().unwrap();
    let passed = window.pane.desk.clock.now_s - begun;
    assert_abs_diff_eq!(passed, 2.5, epsilon = 0.2);
    // Half-way along the fifth row, which runs forward.
    let share = window.pane.desk.now().unwrap().1;
    let row = f64::from(place.of as u32);
    let y = if place.of.is_multiple_of(2) { -200.0 + 160.0 * share } else { -40.0 - 160.0 * share };
    assert_abs_diff_eq!(place.tip, Point3::new(220.0 + 2.0 * row, y, 0.0), epsilon = 1e-6);
    window.key(Key::Space).unwrap();
    let stopped = window.pane.desk.clock.now_s;
    window.frame_after(Vec::new(), 0.2).unwrap();
    assert_eq!(window.pane.desk.clock.now_s, stopped);
}

#[test]
fn pictures_show_what_is_switched_on() {
    let exhibit = exhibit();
    let mut window = Headless::new(&exhibit, SIZE).unwrap();
    if let Err(e) = window.open() {
        assert!(matches!(e, ViewError::NoAdapter { .. }), "{e}");
        return leave_out(Need::Vulkan, e);
    }
    window.key(Key::T).unwrap();
    window.pane.desk.layers.paint = Paint::Clay;
    window.pane.desk.layers.kinds = [false; 4];
    window.rest().unwrap();
    assert_eq!(window.last().map(|l| l.0), Some(Care::Fine));
    let colour = |window: &Headless<'_>, at: [f64; 3]| {
        let at = seen(window, at);
        window.picture().unwrap().pixel(at.x as u32, at.y as u32)
    };
    let on_row = [240.0, -60.0, 0.0];
    let bare = colour(&window, on_row);
    assert!(bare[0] > bare[2], "clay: {bare:?}");
    window.pane.desk.layers.kinds[0] = true;
    let at = seen(&window, on_row);
    window.wheel(at, 14.0).unwrap();
    window.rest().unwrap();
    let with_row = colour(&window, on_row);
    assert!(with_row.iter().zip(&bare).any(|(a, b)| a.abs_diff(*b) > 60), "{with_row:?} over {bare:?}");
    // Before its time the row is not there.
    window.pane.desk.clock.now_s = 1.0;
    window.pane.desk.layers.tool = false;
    window.rest().unwrap();
    let before = colour(&window, on_row);
    assert!(before.iter().zip(&bare).all(|(a, b)| a.abs_diff(*b) < 12), "{before:?} is not {bare:?}");
    // Nothing on the plate's place: the backdrop.
    window.pane.desk.layers.regions = vec![false, false];
    window.pane.desk.layers.seams = [false; 5];
    window.rest().unwrap();
    let empty = colour(&window, on_row);
    assert!(empty[2] > empty[0], "{empty:?}");
}

#[test]
fn material_is_left_where_the_ball_has_not_been_and_the_holder_stands_over_it() {
    let mut exhibit = Arc::into_inner(exhibit()).unwrap();
    let fine = MeshOptions { deviation_mm: 0.5, longest_edge_mm: 6.0 };
    exhibit.meshes = exhibit.model.faces.iter().map(|f| tessellate(f, &fine).unwrap()).collect();
    let record = &mut exhibit.job.as_mut().unwrap().job.tools[0];
    record.holder = Some(Holder::parse("60:27-34x50,63x26", &record.tool).unwrap());
    let exhibit = Arc::new(exhibit);
    let mut window = Headless::new(&exhibit, SIZE).unwrap();
    if let Err(e) = window.open() {
        assert!(matches!(e, ViewError::NoAdapter { .. }), "{e}");
        return leave_out(Need::Vulkan, e);
    }
    let colour = |window: &mut Headless<'_>, at: [f64; 3]| {
        let until = Instant::now() + PATIENCE;
        window.rest().unwrap();
        while window.pane.desk.is_cutting_material() {
            assert!(Instant::now() < until, "the material is never cut");
            std::thread::sleep(Duration::from_millis(5));
            window.rest().unwrap();
        }
        window.rest().unwrap();
        let at = seen(window, at);
        window.picture().unwrap().pixel(at.x as u32, at.y as u32)
    };
    let lightness = |c: [u8; 4]| c[..3].iter().map(|v| i32::from(*v)).sum::<i32>();
    window.key(Key::T).unwrap();
    window.pane.desk.layers.kinds = [false; 4];
    window.pane.desk.layers.tool = false;
    window.pane.desk.layers.paint = Paint::Stock;
    let (early, late) = ([240.0, -60.0, 0.0], [360.0, -60.0, 0.0]);
    // Rows so far, which of the two places are cut by then; and back again.
    for (now_s, cut) in
        [(0.0, [false, false]), (40.5, [true, false]), (80.9, [true, true]), (40.5, [true, false])]
    {
        window.pane.desk.clock.now_s = now_s;
        for (at, cut) in [early, late].into_iter().zip(cut) {
            let found = colour(&mut window, at);
            assert_eq!(lightness(found) > 480, cut, "{found:?} at {at:?} after {now_s} s");
        }
    }
    window.pane.desk.layers.paint = Paint::Clay;
    let clay = colour(&mut window, late);
    assert!(lightness(clay) > 480, "the material is gone with its layer: {clay:?}");

    // From the front: 125 mm above the tip and 25 mm beside it there is holder, and nothing else.
    window.key(Key::F).unwrap();
    let tip = window.pane.desk.tool_place().unwrap().tip;
    let beside = [tip.x + 25.0, tip.y, tip.z + 125.0];
    let empty = colour(&mut window, beside);
    window.pane.desk.layers.tool = true;
    let held = colour(&mut window, beside);
    assert!(lightness(held) < lightness(empty) - 150, "{held:?} over {empty:?}");
}

#[test]
fn a_lost_device_is_an_error_and_no_panic() {
    let exhibit = exhibit();
    let mut window = Headless::new(&exhibit, SIZE).unwrap();
    if let Err(e) = window.open() {
        return leave_out(Need::Vulkan, e);
    }
    window.rest().unwrap();
    window.device().unwrap().destroy();
    window.pane.desk.look("top");
    let lost = window.frame(Vec::new()).and_then(|()| window.rest());
    assert!(matches!(lost, Err(ViewError::Device { .. })), "{lost:?}");
}

/// Figures for ten million line vertices: `cargo test --release -p claymill-window -- --ignored --nocapture`.
#[test]
#[ignore = "takes half a minute and most of a gigabyte"]
fn ten_million_vertices_turn() {
    let mut exhibit = Arc::into_inner(exhibit()).unwrap();
    let job = exhibit.job.as_mut().unwrap();
    let row = job.program.moves[0].clone();
    // Wavy rows 0.05 mm apart, 5000 points each.
    job.program.moves = (0..2000_u32)
        .map(|i| {
            let points: Vec<[f64; 3]> = (0..5000_u32)
                .map(|k| {
                    let y = -210.0 + 0.036 * f64::from(k);
                    [210.0 + 0.09 * f64::from(i) + (0.2 * y).sin(), y, 0.0]
                })
                .collect();
            let mut knots = vec![0.0];
            knots.extend((0..5000).map(f64::from));
            knots.push(4999.0);
            Move { seq: u64::from(i), pass: i, knots, points, ..row.clone() }
        })
        .collect();
    job.seconds = vec![1.0; 2000];
    job.job.totals.length.cut_mm = 2000.0 * 180.0;
    job.job.area.cut_mm2 = 180.0 * 180.0;
    let exhibit = Arc::new(exhibit);
    let began = Instant::now();
    let mut window = Headless::new(&exhibit, [1440, 900]).unwrap();
    println!("laid out in {:.1?}", began.elapsed());
    if let Err(e) = window.open() {
        return leave_out(Need::Vulkan, e);
    }
    for notches in [0.0, 8.0, 12.0, 14.0] {
        let at = window.pane.place().center();
        window.wheel(at, notches).unwrap();
        window.rest().unwrap();
        let at_rest = window.last().unwrap().1;
        let [all, drawn] = claymill_window::Stage::segments(&window.pane.desk);
        window.begin_turning().unwrap();
        let mut took: Vec<_> = (1_u8..10)
            .map(|i| {
                let began = Instant::now();
                window.turn_to([3.0 * f32::from(i), 0.0]).unwrap();
                began.elapsed()
            })
            .collect();
        took.sort();
        window.drag(PointerButton::Middle, at, at).unwrap();
        println!("{drawn} of {all} segments: at rest {at_rest:.1?}, turning {:.1?}", took[4]);
    }
}

#[test]
fn nothing_to_show_is_said() {
    let nothing = Arc::new(Exhibit {
        title: String::new(),
        model: Model::default(),
        meshes: Vec::new(),
        region_of_face: Vec::new(),
        regions: RegionsFile::default(),
        free_sides: Vec::new(),
        axes: Axes::default(),
        job: None,
    });
    assert!(matches!(Headless::new(&nothing, SIZE).err(), Some(ViewError::EmptyScene)));
}
