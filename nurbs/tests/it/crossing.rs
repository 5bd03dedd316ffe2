//! Trim loops that cross themselves and each other in places that as good as coincide.

use crate::shapes::{face, plane};
use claymill_nurbs::{FaceMesh, MeshOptions, Point2, tessellate_polygons};

/// A generator of even numbers below 2⁵³ (Steele, Lea and Flood's SplitMix64).
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    fn below(&mut self, count: u64) -> u64 {
        self.next() % count
    }

    fn even(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn area(mesh: &FaceMesh) -> f64 {
    let corner = |t: &[u32; 3], k: usize| mesh.uv[t[k] as usize];
    let twice = |t: &[u32; 3]| (corner(t, 1) - corner(t, 0)).perp(&(corner(t, 2) - corner(t, 0)));
    mesh.triangles.iter().map(|t| 0.5 * twice(t)).sum()
}

/// All of it is triangulated once, within the box of its corners.
fn check(polygon: &[(f64, f64)]) {
    let surface = face(plane(10.0), Vec::new()).surface;
    let options = MeshOptions { deviation_mm: 1.0, longest_edge_mm: 1e9 };
    let polygon: Vec<Point2> = polygon.iter().map(|&(x, y)| Point2::new(x, y)).collect();
    match tessellate_polygons(&surface, std::slice::from_ref(&polygon), &options) {
        Ok(mesh) => {
            let first = (polygon[0], polygon[0]);
            let (low, high) = polygon.iter().fold(first, |(low, high), p| (low.inf(p), high.sup(p)));
            let (found, most) = (area(&mesh), (high - low).product());
            assert!(found > 0.0 && found <= most * (1.0 + 1e-9), "{found} of {most}: {polygon:?}");
        }
        Err(e) => assert!(e.to_string().contains("enclose nothing"), "{e}: {polygon:?}"),
    }
}

#[test]
fn what_is_left_of_an_edge_that_is_cut_may_cross_another_one() {
    // Where the first edge that is in the way is cut, the rest of the second one is in the way of the place.
    check(&[(1.0, 4.0), (3.0, 3.0), (0.0, 2.0), (3.0, 2.0), (4.0, 1.0)]);
    check(&[(0.0, 4.0), (3.0, 1.0), (1.0, 3.0), (1.0, 1.0), (0.0, 3.0), (1.0, 4.0)]);
    check(&[(4.0, 2.0), (4.0, 0.0), (3.0, 2.0), (4.0, 3.0), (1.0, 0.0), (0.0, 3.0)]);
}

#[test]
fn loops_that_cross_anyhow_are_triangulated() {
    for seed in 0..4000 {
        let mut chance = Chance(seed);
        let count = 4 + chance.below(12) as usize;
        // From no more than rounding to a whole step.
        let off = 10f64.powi(-(chance.below(16) as i32));
        let polygon: Vec<(f64, f64)> = (0..count)
            .map(|k| {
                let aside = [off * chance.even(), off * chance.even()];
                let (x, y) = match seed % 4 {
                    // All edges as good as meet in the middle.
                    0 => {
                        let turn = std::f64::consts::PI * (k as f64 / count as f64 + (k % 2) as f64);
                        let far = 3.0 + 5.0 * chance.even();
                        (far * turn.cos(), far * turn.sin())
                    }
                    // They meet others' ends.
                    1 => return (chance.below(5) as f64, chance.below(5) as f64),
                    2 => (chance.below(4) as f64, chance.below(4) as f64),
                    // They lie on each other.
                    _ => (8.0 * (k * (k % 2)) as f64 / count as f64, 0.0),
                };
                (x + aside[0], y + aside[1])
            })
            .collect();
        check(&polygon);
    }
}
