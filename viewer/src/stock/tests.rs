//! Cuts into a plate whose depths are known.

use std::time::{Duration, Instant};

use super::*;
use crate::animation::Reel;
use crate::shapes::SurfaceVertex;
use crate::strokes::StrokeStyle;
use claymill_nurbs::Point3;
use claymill_toolpath::{Move, MoveKind, Program, Tool, ToolRecord};

/// A plate of 100 × 60 mm with a ball of radius 5.
fn reel_of(moves: Vec<Move>, seconds: &[f64]) -> Reel {
    let tools = [ToolRecord {
        id: "T1".into(),
        tool: Tool::ball(5.0),
        holder: None,
        setup_stick_out_mm: Default::default(),
    }];
    let mut bare = Scene::new(Point3::new(50.0, 30.0, 0.0));
    let n = 40_u32;
    let vertices: Vec<SurfaceVertex> = (0..=n)
        .flat_map(|i| (0..=n).map(move |j| (i, j)))
        .map(|(i, j)| SurfaceVertex {
            position: [100.0 * i as f32 / n as f32 - 50.0, 60.0 * j as f32 / n as f32 - 30.0, 0.0],
            normal: [0.0, 0.0, 1.0],
            colour: [9; 4],
        })
        .collect();
    bare.add_triangles(&vertices, &claymill_tests::lattice(n));
    let style = StrokeStyle { tools: &tools, ..StrokeStyle::new(0.1) };
    Reel::new(bare, &Program { moves }, seconds, &style)
}

fn straight(setup: &str, from: [f64; 3], to: [f64; 3], axis: Vector3) -> Move {
    Move {
        setup: setup.into(),
        tool: "T1".into(),
        ..Move::straight(MoveKind::Cut, from.into(), to.into(), axis, 600.0)
    }
}

/// Over the middle of the plate the ball runs at 10 mm/s along x.
fn groove() -> Reel {
    reel_of(vec![straight("top", [0., 30., 0.], [100., 30., 0.], Vector3::z())], &[10.0])
}

/// Rows over half of the plate from above, over the other half from aslant, and over some of it deeper.
fn three_setups() -> Reel {
    let mut moves = Vec::new();
    let aslant = Vector3::new(0.0, 0.6, 0.8);
    for (setup, rows, z, axis) in [
        ("top", 2..14, 0.0, Vector3::z()),
        ("aslant", 14..29, 0.0, aslant),
        ("again", 10..20, -1.0, Vector3::z()),
    ] {
        for row in rows {
            let y = 2.0 * f64::from(row);
            let ends = [[0.0, y, z], [100.0, y, z]];
            let [from, to] = if row % 2 == 0 { ends } else { [ends[1], ends[0]] };
            moves.push(straight(setup, from, to, axis));
        }
    }
    let seconds = vec![10.0; moves.len()];
    reel_of(moves, &seconds)
}

fn at(reel: &Reel, stock: &mut Stock, at_s: f64) -> (Cut, Vec<Vec<[u8; 4]>>, Vec<SurfaceVertex>) {
    stock.go_to(reel.bare(), reel.course(), at_s);
    let mut skin = Scene::new(reel.bare().origin);
    stock.add_skin(&mut skin);
    let skin = skin.surfaces.into_iter().flat_map(|s| s.vertices).collect();
    (stock.now.clone().unwrap(), stock.colours(reel.bare()), skin)
}

fn height(stock: &Stock, x: f64, y: f64) -> f64 {
    let grid = &stock.grids[0];
    let [px, py] = grid.camera.project(&Point3::new(x, y, 0.0)).unwrap().map(|v| v as usize);
    f64::from(stock.now.as_ref().unwrap().heights.at(px, py) - grid.model[py * grid.size[0] + px])
}

#[test]
fn the_ball_leaves_a_groove_of_its_own_round_as_far_as_it_came() {
    let reel = groove();
    let mut stock = Stock::of(reel.bare(), reel.course(), 4.0);
    stock.go_to(reel.bare(), reel.course(), 5.0);
    let cell = stock.grids[0].camera.mm_per_px();
    for (x, y) in [(20.0, 30.0), (20.0, 32.0), (40.0, 27.0), (49.0, 30.0), (45.0, 34.0)] {
        let away = f64::abs(y - 30.0);
        let round = 5.0 - (25.0 - away * away).sqrt();
        // A cell holds the height at its middle.
        let slope = away / (25.0 - away * away).sqrt();
        approx::assert_abs_diff_eq!(height(&stock, x, y), round.min(4.0), epsilon = (slope + 0.1) * cell);
    }
    for (x, y) in [(60.0, 30.0), (20.0, 40.0), (90.0, 5.0)] {
        approx::assert_abs_diff_eq!(height(&stock, x, y), 4.0, epsilon = 1e-4);
    }
}

#[test]
fn the_material_of_a_time_is_the_same_to_the_bit_however_one_came_there() {
    let reel = three_setups();
    let whole_s = reel.duration_s();
    // Borders of setups, ends of rows, and what lies between.
    let times: Vec<f64> =
        (0..=40).map(|k| whole_s * f64::from(k) / 40.0).chain([120.0, 269.999, 270.0, 33.3, 33.31]).collect();
    let anew: Vec<_> =
        times.iter().map(|&s| at(&reel, &mut Stock::of(reel.bare(), reel.course(), 3.0), s)).collect();
    assert!(
        anew.windows(2).take(40).all(|w| w[0].0.heights != w[1].0.heights),
        "something is cut all the time"
    );
    let order = |kind: u32| -> Vec<usize> {
        let n = times.len();
        match kind {
            0 => (0..n).collect(),
            1 => (0..n).rev().collect(),
            _ => (0..3 * n).map(|k| k * 17 % n).collect(),
        }
    };
    for (most_bytes, apart) in [(96 << 20, 300), (400_000, 50), (0, 300)] {
        let mut stock = Stock::of(reel.bare(), reel.course(), 3.0).with_checkpoints();
        stock.checkpoints.most_bytes = most_bytes;
        stock.checkpoints.apart = apart;
        for k in [0, 1, 2].into_iter().flat_map(order) {
            assert!(at(&reel, &mut stock, times[k]) == anew[k], "at {} s, {most_bytes} bytes", times[k]);
            let bytes = stock.checkpoints.bytes(&stock.fresh);
            assert!(bytes <= most_bytes, "{bytes} bytes");
        }
        let kept = stock.checkpoints.kept.len();
        assert!(if most_bytes == 0 { kept == 0 } else { kept > 3 }, "{kept} states in {most_bytes} bytes");
        // A smaller allowance and back: nothing is left over of it.
        stock.begin_anew(1.0);
        at(&reel, &mut stock, 200.0);
        stock.begin_anew(3.0);
        assert!(at(&reel, &mut stock, times[7]) == anew[7]);
    }
}

#[test]
fn going_back_costs_a_small_part_of_cutting_anew() {
    let passes = |k: i32| {
        let y = f64::from(k % 300) * 0.2;
        straight("top", [0.0, y, 0.0], [100.0, y, 0.0], Vector3::z())
    };
    let moves: Vec<Move> = (0..1200).map(passes).collect();
    let reel = reel_of(moves, &[10.0; 1200]);
    let (bare, course) = (reel.bare(), reel.course());
    let mut stock = Stock::of(bare, course, 3.0).with_checkpoints();
    let mut took = |at_s: f64| {
        let began = Instant::now();
        stock.go_to(bare, course, at_s);
        began.elapsed()
    };
    let anew = took(12_000.0);
    let back: Duration = (1..=20_u32).map(|k| took(12_000.0 - 590.0 * f64::from(k))).sum::<Duration>() / 20;
    eprintln!("cut anew {anew:.1?}, back {back:.1?}; {} MB", stock.checkpoints.bytes(&stock.fresh) >> 20);
    assert!(10 * back < anew, "{back:?} back, {anew:?} anew");
}

#[test]
fn what_is_cut_shows_the_model_and_the_rest_a_skin_above_it() {
    let reel = groove();
    let mut stock = Stock::of(reel.bare(), reel.course(), 4.0);
    stock.go_to(reel.bare(), reel.course(), 5.0);
    let mut scene = reel.scene(5.0);
    let before = scene.surfaces[0].vertices.len();
    stock.show(reel.bare(), &mut scene);
    let model = reel.bare().surfaces[0].vertices.len();
    let coloured = |colour: Rgb, v: &&SurfaceVertex| v.colour[..3] == colour;
    let cut: Vec<_> = scene.surfaces[0].vertices[..model].iter().filter(|v| coloured(DONE, v)).collect();
    assert!(!cut.is_empty());
    // The ball leaves less than half of 4 mm within 4 mm of its way.
    assert!(cut.iter().all(|v| v.position[1].abs() < 4.5 && v.position[0] < 5.5), "{cut:?}");
    let skin = &scene.surfaces[0].vertices[before..];
    let highest = skin.iter().map(|v| v.position[2]).fold(0.0, f32::max);
    assert!((highest - 4.0).abs() < 1e-3, "{highest}");
    assert!(skin.iter().all(|v| v.normal[2] > 0.2));
    assert!(scene.lines.iter().all(|l| l.kind != LineKind::Cut));
}

#[test]
fn a_skin_of_large_squares_covers_what_one_of_cells_would() {
    let reel = groove();
    let mut stock = Stock::of(reel.bare(), reel.course(), 4.0);
    stock.go_to(reel.bare(), reel.course(), 5.0);
    let mut skin = Scene::new(reel.bare().origin);
    stock.add_skin(&mut skin);
    let mesh = &skin.surfaces[0];
    let (now, grid) = (stock.now.as_ref().unwrap(), &stock.grids[0]);
    let cells = grid.size[0] * grid.size[1];
    assert!(mesh.indices.len() / 3 < cells / 4, "{} triangles over {cells} cells", mesh.indices.len() / 3);
    // Seen from above, wherever a cell holds material there is a skin about as high.
    let front = crate::front::Front::of(&skin, &grid.camera, grid.size.map(|s| s as u32), 1.0, &[]);
    let [width, height] = grid.size;
    let mut to_go = 0;
    for (y, x) in (1..height - 1).flat_map(|y| (1..width - 1).map(move |x| (y, x))) {
        let inside = (y - 1..=y + 1).all(|y| {
            (x - 1..=x + 1)
                .all(|x| now.heights.at(x, y).is_finite() && !grid.is_cut(&now.heights, [x, y], 4.0))
        });
        if inside {
            to_go += 1;
            let off = front.nearest[y * width + x] - now.heights.at(x, y);
            assert!(off.abs() < 0.21 + 1e-3, "cell {x} {y}: {off} mm");
        }
    }
    assert!(to_go > cells / 3);
}
