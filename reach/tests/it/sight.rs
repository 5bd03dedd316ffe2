//! Arcs of sight against independent rays: a fine mesh of each model, and every triangle tried.

use claymill_contact::Frame;
use claymill_nurbs::{ClosestPoints, MeshOptions, Point3, Vector3, tessellate};
use claymill_reach::{Arc, Slices, samples};
use rand::{Rng, SeedableRng};

use crate::shapes::Shape;

/// An answer may be wrong this near to the end of an arc, degrees.
const ALLOWED_DEG: f64 = 0.05;
/// Chords of the independent mesh are off by this, mm.
const CHORD_MM: f64 = 2e-3;
/// So much before a place an independent ray begins, mm: beyond what its own chords may hide.
const BEFORE_MM: f64 = 4e-3;
const PLACES: usize = 60;
const ANGLES: usize = 100;

/// How far an angle is from the nearest end of arcs.
fn from_end(arcs: &[Arc], deg: f64) -> f64 {
    let apart = |a: f64, b: f64| ((a - b + 540.0).rem_euclid(360.0) - 180.0).abs();
    let ends = arcs.iter().flat_map(|a| [a.from_deg, a.from_deg + a.span_deg]);
    ends.map(|end| apart(end, deg)).fold(f64::INFINITY, f64::min)
}

/// Triangles of a model in a grid of nothing: all are tried, box by box.
struct Rays {
    triangles: Vec<[Point3; 3]>,
}

impl Rays {
    fn of(shape: &Shape) -> Self {
        let options = MeshOptions { deviation_mm: CHORD_MM, longest_edge_mm: 1e4 };
        let triangles = shape.model.faces.iter().flat_map(|face| {
            let mesh = tessellate(face, &options).unwrap();
            let of = |t: &[u32; 3]| t.map(|i| mesh.points[i as usize]);
            mesh.triangles.iter().map(of).collect::<Vec<_>>()
        });
        Rays { triangles: triangles.collect() }
    }

    /// Triangles that a plane square to the axis meets.
    fn near(&self, from: &Point3, axis: &Vector3) -> Vec<[Point3; 3]> {
        let side = |p: &Point3| axis.dot(&(p - from));
        let meets = |t: &&[Point3; 3]| {
            let at = t.map(|p| side(&p));
            at.iter().any(|s| *s >= -1e-9) && at.iter().any(|s| *s <= 1e-9)
        };
        self.triangles.iter().filter(meets).copied().collect()
    }
}

/// Whether a ray meets a triangle (Möller and Trumbore).
fn meets([a, b, c]: &[Point3; 3], from: &Point3, way: &Vector3) -> bool {
    let (ab, ac) = (b - a, c - a);
    let p = way.cross(&ac);
    let det = ab.dot(&p);
    if det.abs() < 1e-14 * ab.norm() * ac.norm() {
        return false;
    }
    let t = from - a;
    let u = t.dot(&p) / det;
    let q = t.cross(&ab);
    let v = way.dot(&q) / det;
    (0.0..=1.0).contains(&u) && v >= 0.0 && u + v <= 1.0 && ac.dot(&q) / det > 0.0
}

/// Places of a model, angles about an axis: how many answers are wrong, and how far from an end at most.
fn wrong_answers(shape: &Shape, axis: Vector3, seed: u64) -> (usize, usize, f64) {
    let part = shape.part();
    let frame = Frame::tilted("axis", axis.into(), "+z".parse().unwrap(), "+x".parse().unwrap()).unwrap();
    let slices = Slices::new(&part, &frame, 0.05, 90.0).unwrap();
    let closest = ClosestPoints::new(&shape.model);
    let covering = part.covering(2.0).unwrap();
    let all = samples(&part, &covering, (shape.area_mm2.iter().sum::<f64>() / 5000.0).sqrt());
    let rays = Rays::of(shape);
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let (mut asked, mut wrong, mut farthest) = (0, 0, 0.0_f64);
    for _ in 0..PLACES {
        let sample = &all[random.random_range(0..all.len())];
        let arcs = slices.exact_arcs(sample, &closest);
        let along = shape.free[sample.face].allows(true);
        let normal = if along { sample.normal } else { -sample.normal };
        let from = sample.point + normal * BEFORE_MM;
        let near = rays.near(&from, &frame.axis());
        let [x, y, _] = frame.axes();
        for _ in 0..ANGLES {
            let deg: f64 = random.random_range(0.0..360.0);
            let way = x * deg.to_radians().cos() + y * deg.to_radians().sin();
            let seen = normal.dot(&way) > -1e-9 && !near.iter().any(|t| meets(t, &from, &way));
            asked += 1;
            if seen != arcs.iter().any(|arc| arc.contains(deg)) {
                wrong += 1;
                // A ray along the place's own tangent is at the end of what it faces.
                let grazing = normal.dot(&way).clamp(-1.0, 1.0).asin().to_degrees().abs();
                let off = from_end(&arcs, deg).min(grazing);
                farthest = farthest.max(off);
            }
        }
    }
    (asked, wrong, farthest)
}

#[test]
fn no_answer_is_wrong_beyond_the_end_of_an_arc() {
    let files = [
        "prismatic_ctc01.stp",
        "prismatic_ctc03_inch.stp",
        "mfcad/0-0-0-5-8-23.step",
        "mfcad/1-1-1-2-7-23.step",
    ];
    let axes = [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(0.48, -0.6, 0.64)];
    for (k, name) in files.iter().enumerate() {
        let Some(path) = claymill_tests::corpus_file(name) else { continue };
        let shape = Shape::read(&path);
        for (j, axis) in axes.iter().enumerate() {
            let (asked, wrong, farthest) = wrong_answers(&shape, *axis, (10 * k + j) as u64);
            println!("{name} {axis:?}: {wrong} of {asked} differ, {farthest:.4}° from an end at most");
            assert!(farthest <= ALLOWED_DEG, "{name} {axis:?}: {farthest}");
            assert!(wrong * 100 <= asked, "{name}: {wrong} of {asked}");
        }
    }
}
