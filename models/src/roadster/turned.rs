//! The roadster's wheels and mirrors: closed tubes swept from profiles.

use std::f64::consts::TAU;

use claymill_nurbs::{Point3, Vector3};

use crate::sheet::Sheet;
use crate::spline::Spline;

/// Control points around a wheel: eight for each spoke.
const AROUND: usize = 40;
const SPOKES: f64 = 5.0;

/// Profile of a wheel: parameter, (radius, half track, 0) and direction of travel, from the tread's inner
/// edge over the tread and the outer wall to the hub.
const WHEEL: [(f64, [f64; 2], [f64; 2]); 8] = [
    (0.0, [304.0, 672.0], [0.8, 0.6]),
    (0.12, [331.0, 702.0], [0.0, 1.0]),
    (0.35, [331.0, 868.0], [0.0, 1.0]),
    (0.48, [300.0, 902.0], [-1.0, 0.1]),
    (0.6, [240.0, 898.0], [-1.0, -0.25]),
    (0.7, [212.0, 872.0], [-0.8, -0.6]),
    (0.9, [80.0, 866.0], [-1.0, 0.25]),
    (1.0, [14.0, 876.0], [-1.0, 0.0]),
];

/// How deep the spaces between spokes are, mm.
const SPOKE_MM: f64 = 15.0;

/// Factor from the radius of a circle to that of the control points of its closed uniform cubic.
fn control_radius(count: usize) -> f64 {
    6.0 / (4.0 + 2.0 * (TAU / count as f64).cos())
}

/// A wheel with its tyre on the right side, axis across at `(x, z)`.
pub(super) fn wheel(name: &str, x: f64, z: f64) -> Sheet {
    let nodes = WHEEL.map(|(v, [r, y], [dr, dy])| (v, Point3::new(r, y, 0.0), Vector3::new(dr, dy, 0.0)));
    let profile = Spline::profile(&nodes);
    let ring = |c: &Point3| -> Vec<Point3> {
        // Spokes live on the disc, and fade toward rim and hub.
        let disc = ((c.x - 60.0) * (225.0 - c.x)).max(0.0) / (82.5 * 82.5);
        (0..AROUND)
            .map(|i| {
                let angle = TAU * i as f64 / AROUND as f64;
                let r = c.x * control_radius(AROUND);
                let y = c.y + SPOKE_MM * disc * (SPOKES * angle).cos();
                Point3::new(x + r * angle.cos(), y, z + r * angle.sin())
            })
            .collect()
    };
    let rings: Vec<_> = profile.points.iter().map(ring).collect();
    Sheet::tube(name, profile.knots, &rings)
}

/// Profile of a mirror's housing and glass: parameter, (x from the tip, share of the full section), direction.
const MIRROR: [(f64, [f64; 2], [f64; 2]); 6] = [
    (0.0, [0.0, 0.05], [0.0, 1.0]),
    (0.45, [52.0, 0.74], [0.75, 0.6]),
    (0.75, [112.0, 1.0], [1.0, 0.1]),
    (0.83, [120.0, 0.95], [0.0, -1.0]),
    (0.9, [112.0, 0.86], [-0.3, -1.0]),
    (1.0, [108.0, 0.05], [0.0, -1.0]),
];

/// The right mirror: a closed pod beside the window's front corner.
pub(super) fn mirror(name: &str) -> Sheet {
    const TIP: [f64; 3] = [1455.0, 884.0, 1072.0];
    const HALF: (f64, f64) = (108.0, 64.0);
    const COUNT: usize = 24;
    let nodes =
        MIRROR.map(|(v, [x, s], [dx, ds])| (v, Point3::new(x, 100.0 * s, 0.0), Vector3::new(dx, ds, 0.0)));
    let profile = Spline::profile(&nodes);
    let ring = |c: &Point3| -> Vec<Point3> {
        let share = c.y / 100.0 * control_radius(COUNT);
        (0..COUNT)
            .map(|i| {
                let (sin, cos) = (TAU * i as f64 / COUNT as f64).sin_cos();
                // Fuller than an ellipse, as housings are.
                let full = 1.0 / (cos.powi(4) + sin.powi(4)).powf(0.12);
                let sweep = 0.18 * HALF.0 * share * cos;
                Point3::new(
                    TIP[0] + c.x + sweep,
                    TIP[1] + HALF.0 * share * full * cos,
                    TIP[2] + HALF.1 * share * full * sin,
                )
            })
            .collect()
    };
    let rings: Vec<_> = profile.points.iter().map(ring).collect();
    Sheet::tube(name, profile.knots, &rings)
}
