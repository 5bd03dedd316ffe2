//! Lines through models against closed forms and brute force.

use crate::shapes::{ellipse, face, panel, plane, sphere, torus};
use claymill_nurbs::{ClosestPoints, Crossings, Model, NurbsSurface, Point3, TrimLoop, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn model(surface: NurbsSurface, loops: Vec<TrimLoop>) -> Model {
    Model { faces: vec![face(surface, loops)], ..Model::default() }
}

fn random(rng: &mut ChaCha8Rng, size: f64) -> Vector3 {
    Vector3::from_fn(|_, _| rng.random_range(-size..size))
}

#[test]
fn lines_cross_a_sphere_where_the_formula_says() {
    let model = model(sphere(20.0), vec![]);
    let index = ClosestPoints::new(&model);
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut hits = 0;
    for k in 0..2000 {
        let (o, d) = (random(&mut rng, 60.0), random(&mut rng, 1.0).normalize());
        let found = index.crossings(&Point3::from(o), &(d * 3.0), 200.0);
        let (b, c) = (o.dot(&d), o.norm_squared() - 400.0);
        let under = b * b - c;
        if under.abs() < 1e-3 {
            continue;
        }
        let root = under.max(0.0).sqrt();
        let expected: Vec<f64> = if under < 0.0 { vec![] } else { vec![-b - root, -b + root] };
        let expected: Vec<f64> = expected.into_iter().filter(|t| *t > 0.0).collect();
        assert!(found.complete, "line {k}");
        assert_eq!(found.all.len(), expected.len(), "line {k}: {found:?}");
        for (c, t) in found.all.iter().zip(&expected) {
            assert!(
                (c.along_mm - t).abs() < 1e-7
                    && (model.faces[0].surface.point(c.u, c.v) - c.point).norm() < 1e-9
            );
        }
        hits += expected.len();
    }
    assert!(hits > 200, "{hits} crossings");
}

#[test]
fn a_line_through_both_poles_finds_both_whichever_is_looked_at_first() {
    let model = model(sphere(20.0), vec![]);
    let index = ClosestPoints::new(&model);
    for way in [1.0, -1.0] {
        for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
            let start = Point3::from(axis * (-50.0 * way));
            let found = index.crossings(&start, &(axis * way), 100.0);
            let mut along: Vec<f64> = found.all.iter().map(|c| c.along_mm).collect();
            along.dedup_by(|b, a| (*b - *a).abs() < 1e-6);
            assert_eq!(along.len(), 2, "{found:?}");
            assert!((along[0] - 30.0).abs() < 1e-7 && (along[1] - 70.0).abs() < 1e-7, "{found:?}");
        }
    }
}

#[test]
fn lines_cross_a_torus_as_often_as_its_equation_changes_sign() {
    let model = model(torus(60.0, 15.0), vec![]);
    let index = ClosestPoints::new(&model);
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let inside = |p: &Vector3| (p.x.hypot(p.y) - 60.0).hypot(p.z) - 15.0;
    let mut most = 0;
    for k in 0..500 {
        let (o, d) = (random(&mut rng, 90.0), random(&mut rng, 1.0).normalize());
        let found = index.crossings(&Point3::from(o), &d, 300.0);
        let values: Vec<f64> = (0..=30_000).map(|i| inside(&(o + d * (f64::from(i) * 0.01)))).collect();
        let least = values.windows(3).filter(|w| w[1].abs() <= w[0].abs() && w[1].abs() <= w[2].abs());
        // Nearly touching: sampling cannot tell.
        if least.clone().any(|w| w[1].abs() < 1e-4 && w[0] * w[2] > 0.0) {
            continue;
        }
        let changes = values.windows(2).filter(|w| w[0] * w[1] < 0.0).count();
        assert!(found.complete && found.all.len() == changes, "line {k}: {changes}, {found:?}");
        most = most.max(changes);
    }
    assert_eq!(most, 4);
}

/// Crossings of a line with the triangles of a fine grid.
fn brute(surface: &NurbsSurface, inside: impl Fn(f64, f64) -> bool, o: &Point3, d: &Vector3) -> Vec<f64> {
    const N: usize = 300;
    let at = |i: usize, j: usize| surface.point(i as f64 / N as f64, j as f64 / N as f64);
    let grid: Vec<Point3> =
        (0..=N).flat_map(|i| (0..=N).map(move |j| (i, j))).map(|(i, j)| at(i, j)).collect();
    let mut found = Vec::new();
    for i in 0..N {
        for j in 0..N {
            let (a, b) = (i * (N + 1) + j, (i + 1) * (N + 1) + j);
            for t in [[a, b, b + 1], [a, b + 1, a + 1]] {
                let [p, q, r] = t.map(|k| grid[k]);
                let n = (q - p).cross(&(r - p));
                let along = (p - o).dot(&n) / d.dot(&n);
                let x = o + d * along;
                let sides = [(p, q), (q, r), (r, p)]
                    .map(|(a, b): (Point3, Point3)| (b - a).cross(&(x - a)).dot(&n) >= 0.0);
                let middle = ((i as f64 + 0.5) / N as f64, (j as f64 + 0.5) / N as f64);
                if along > 0.0 && sides.iter().all(|&s| s) && inside(middle.0, middle.1) {
                    found.push(along);
                }
            }
        }
    }
    found.sort_by(f64::total_cmp);
    found
}

#[test]
fn brute_force_finds_the_same_crossings_of_a_wave() {
    let waves = panel().mapped(|p| Point3::new(p.x, p.y, p.z + 60.0 * (p.x / 60.0).sin()));
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let whole: fn(f64, f64) -> bool = |_, _| true;
    let trimmed: fn(f64, f64) -> bool = |u, v| ((u - 0.5) / 0.45).powi(2) + ((v - 0.5) / 0.3).powi(2) <= 1.0;
    for (name, loops, inside) in
        [("whole", vec![], whole), ("trimmed", vec![ellipse((0.5, 0.5), 0.45, 0.3)], trimmed)]
    {
        let model = model(waves.clone(), loops);
        let index = ClosestPoints::new(&model);
        let mut several = 0;
        for k in 0..40 {
            let (u, v) = (rng.random_range(0.2..0.8), rng.random_range(0.3..0.7));
            let through = waves.point(u, v);
            let d = Vector3::new(1.0, rng.random_range(-0.3..0.3), rng.random_range(-0.3..0.3)).normalize();
            let o = through - d * 900.0;
            let found: Crossings = index.crossings(&o, &d, 3000.0);
            assert!(found.complete, "{name} {k}");
            assert!(
                found.all.iter().any(|c| (c.point - through).norm() < 1e-6),
                "{name} {k}: not where it was aimed"
            );
            let expected = brute(&waves, inside, &o, &d);
            several += usize::from(expected.len() > 1);
            // A grazing line or one near a rim may pass the triangles and not the surface.
            let plain = |c: &claymill_nurbs::Crossing| {
                let edge = inside(c.u + 0.01, c.v)
                    && inside(c.u - 0.01, c.v)
                    && inside(c.u, c.v + 0.01)
                    && inside(c.u, c.v - 0.01);
                edge && waves.jet(c.u, c.v).normal().unwrap().dot(&d).abs() > 0.1
            };
            for c in found.all.iter().filter(|c| plain(c)) {
                assert!(
                    expected.iter().any(|t| (t - c.along_mm).abs() < 1.0),
                    "{name} {k}: {} not in {expected:?}",
                    c.along_mm
                );
            }
            for t in &expected {
                let close = found.all.iter().any(|c| (t - c.along_mm).abs() < 1.0);
                let p = index.closest(&(o + d * *t), 5.0).unwrap();
                let steep = waves.jet(p.u, p.v).normal().unwrap().dot(&d).abs() > 0.1;
                assert!(close || !steep || p.on_boundary, "{name} {k}: {t} not in {found:?}");
            }
        }
        assert!(several > 5, "{name}: {several}");
    }
}

#[test]
fn a_line_that_touches_or_lies_in_a_face_is_no_proof() {
    let sheet = model(plane(50.0), vec![]);
    let index = ClosestPoints::new(&sheet);
    assert!(!index.crossings(&Point3::new(-20.0, 3.0, 0.0), &Vector3::x(), 30.0).complete);
    let above = index.crossings(&Point3::new(-20.0, 3.0, 1e-6), &Vector3::x(), 30.0);
    assert!(above.complete && above.all.is_empty());
    let ball = model(sphere(20.0), vec![]);
    let index = ClosestPoints::new(&ball);
    let tangent = index.crossings(&Point3::new(12.0, -50.0, 16.0), &Vector3::y(), 100.0);
    assert!(!tangent.complete, "{tangent:?}");
    assert_eq!(index.crossings(&Point3::origin(), &Vector3::zeros(), 1.0), Crossings::default());
}
