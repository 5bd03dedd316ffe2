//! Bounds of leaves: they hold wherever one looks, and are not far from what is found there.

use crate::shapes::{cylinder, panel, plane, sphere, torus};
use claymill_nurbs::{Aabb, KnotVector, Leaf, Leaves, NurbsSurface, Point3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// How far bounds may be from what is found, for so many cuts.
#[derive(Debug, Clone, Copy)]
struct Looseness {
    cuts: u32,
    /// Of the box, as a share of its diagonal.
    position: f64,
    /// Of the angle of the cone, rad, as a share of the largest angle found.
    angle: f64,
    /// Of the curvatures, as a share of the largest found.
    curvature: f64,
}

/// Asserts that the bounds of a leaf hold and measures how loose they are; `None` where they claim no cone.
fn measured(name: &str, leaf: &Leaf, cuts: u32) -> Option<Looseness> {
    let bounds = leaf.bounds(cuts);
    let cone = bounds.normals?;
    let (low, high) = bounds.curvature?;
    let mut found = Aabb::empty();
    let (mut least, mut most, mut angle) = (f64::INFINITY, f64::NEG_INFINITY, 0.0f64);
    let ((u0, u1), (v0, v1)) = (leaf.u(), leaf.v());
    for i in 0..=60 {
        for j in 0..=60 {
            let jet = leaf.jet(u0 + (u1 - u0) * f64::from(i) / 60.0, v0 + (v1 - v0) * f64::from(j) / 60.0);
            found.add(&jet.p);
            let n = jet.normal().expect("a leaf with a cone is regular");
            let (a, b) = jet.curvature(&n).principal().expect("a leaf with a cone is regular");
            (least, most) = (least.min(a), most.max(b));
            angle = angle.max(n.dot(&cone.axis).clamp(-1.0, 1.0).acos());
        }
    }
    let outside = (found.max - bounds.aabb.max).sup(&(bounds.aabb.min - found.min)).max();
    assert!(outside <= 0.0, "{name}: {outside} mm outside of the box");
    // The sampled curvatures carry rounding of their own.
    let noise = 1e-9 * (least.abs() + most.abs()) + 1e-13;
    assert!(low <= least + noise && most <= high + noise, "{name}: [{least}, {most}] in [{low}, {high}]");
    assert!(cone.cosine.acos() >= angle - 1e-7, "{name}: {angle} in {}", cone.cosine.acos());
    let spare = (bounds.aabb.max - found.max).sup(&(found.min - bounds.aabb.min)).max();
    Some(Looseness {
        cuts,
        position: spare / found.diagonal(),
        angle: cone.cosine.acos() / angle.max(1e-3) - 1.0,
        curvature: (high - most).max(least - low) / least.abs().max(most).max(1e-6),
    })
}

fn check(name: &str, surface: &NurbsSurface, allowed: Looseness) {
    for leaf in Leaves::new(surface).as_slice() {
        let seen = measured(name, leaf, allowed.cuts).expect("the leaf has bounds");
        assert!(
            seen.position <= allowed.position
                && seen.angle <= allowed.angle
                && seen.curvature <= allowed.curvature,
            "{name}: {seen:?} against {allowed:?}"
        );
    }
}

/// A panel with a bulge, bumps of `bumps` mm, and weights that differ by `uneven`.
fn bulged((p, q): (usize, usize), bumps: f64, uneven: f64, seed: u64) -> NurbsSurface {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for i in 0..=p {
        for j in 0..=q {
            let (x, y) = (i as f64 / p as f64, j as f64 / q as f64);
            let z = 9.0 * (2.0 * x).sin() + 7.0 * (1.7 * y).cos() + rng.random_range(-bumps..=bumps);
            points.push(Point3::new(2500.0 + 80.0 * x + 5.0 * y, 60.0 * y, z));
            weights.push(1.0 + uneven * rng.random_range(0.0..1.0));
        }
    }
    let knots = |degree| KnotVector::clamped_uniform(degree, degree + 1);
    NurbsSurface::new(knots(p), knots(q), points, (uneven > 0.0).then_some(weights)).unwrap()
}

#[test]
fn bounds_hold_and_are_close() {
    for (cuts, position, round, flat) in [(0, 1e-2, 1.3, 0.1), (1, 5e-3, 0.2, 0.03), (2, 1e-3, 0.05, 0.01)] {
        let allowed = |curvature| Looseness { cuts, position, angle: 1e-6, curvature };
        // Leaves of a quarter turn; a box around control points is exact for these.
        check("cylinder", &cylinder(40.0, 100.0), allowed(round));
        check("torus", &torus(60.0, 15.0), allowed(round));
        check("plane", &plane(100.0), allowed(flat));
        check("panel", &panel(), allowed(flat));
        for (p, q) in [(2, 2), (3, 3), (1, 3), (5, 5), (3, 7)] {
            for uneven in [0.0, 0.1] {
                let name = format!("bulged {p}x{q}, weights {uneven}");
                check(&name, &bulged((p, q), 0.2, uneven, 1), allowed(flat));
            }
        }
    }
}

#[test]
fn bounds_hold_on_wild_leaves() {
    let mut claims = 0;
    for seed in 0..150 {
        let degrees = (1 + seed as usize % 4, 1 + seed as usize / 4 % 5);
        let surface = bulged(degrees, 0.2 * seed as f64, (seed % 3) as f64 * 0.7, seed);
        for leaf in Leaves::new(&surface).as_slice() {
            claims += usize::from(measured(&format!("seed {seed}"), leaf, seed as u32 % 3).is_some());
        }
    }
    assert!(claims > 50, "{claims} leaves had bounds");
}

#[test]
fn where_the_normal_vanishes_nothing_is_claimed() {
    // Every leaf of a sphere ends in a pole.
    for leaf in Leaves::new(&sphere(10.0)).as_slice() {
        let bounds = leaf.bounds(2);
        assert!(bounds.curvature.is_none());
        assert!(bounds.aabb.diagonal() < 17.4);
    }
    // A sheet folded over.
    let xs = [0.0, 10.0, 0.0];
    let net = xs.iter().flat_map(|&x| [0.0, 5.0].map(|y| Point3::new(x, y, 0.1 * x * y)));
    let (ku, kv) = (KnotVector::clamped_uniform(2, 3), KnotVector::clamped_uniform(1, 2));
    let fold = NurbsSurface::new(ku, kv, net.collect(), None).unwrap();
    let bounds = Leaves::new(&fold).as_slice()[0].bounds(0);
    assert!(bounds.normals.is_none() && bounds.curvature.is_none());
}
