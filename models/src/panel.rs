//! The sample `panel`: a wavy sheet of 600 × 400 mm with a pressed ridge, one smooth region.

use std::f64::consts::PI;

use claymill_nurbs::{Point3, Vector3};

use crate::Sample;
use crate::network::Network;
use crate::sheet::{Form, Sheet};
use crate::shuffle::shuffled;
use crate::spline::Spline;

/// Size of the panel in x and y, mm.
const SIZE_MM: (f64, f64) = (600.0, 400.0);
/// Height of its waves, mm.
const WAVE_MM: f64 = 18.0;

/// Generates a wavy panel of 600 × 400 mm about the origin: one smooth region in about `patches` patches,
/// with a pressed ridge along the middle that meets the waves tangentially (a jump in curvature).
#[must_use]
pub fn panel(patches: usize, seed: u64) -> Sample {
    let corner = |x: f64, y: f64| Point3::new(x * 0.5 * SIZE_MM.0, y * 0.5 * SIZE_MM.1, 0.0);
    let mut network = Network::default();
    let mut edge = |a, b| {
        let curve = network.add_pair(Spline::line(a, b));
        network.whole(curve)
    };
    let frame = [
        edge(corner(-1.0, -1.0), corner(1.0, -1.0)),
        edge(corner(-1.0, 1.0), corner(1.0, 1.0)),
        edge(corner(-1.0, -1.0), corner(-1.0, 1.0)),
        edge(corner(1.0, -1.0), corner(1.0, 1.0)),
    ];
    let waves: Vec<f64> = (1..12).map(|i| f64::from(i) / 12.0).collect();
    let ridge = [0.15, 0.3, 0.42, 0.42, 0.58, 0.58, 0.7, 0.85];
    let relief = |u: f64, v: f64| {
        let wave = WAVE_MM * (4.0 * PI * u).sin() * (PI * v).sin();
        let ridge = if (v - 0.5).abs() < 0.08 { 0.5 * WAVE_MM } else { 0.0 };
        Vector3::new(0.0, 0.0, wave + ridge * (PI * u).sin())
    };
    let form = Form { outward: Vector3::z(), lines: (&waves, &ridge), relief: &relief, seams_deg: [0.0; 4] };
    shuffled("panel", &[Sheet::hung("panel", &network, frame, &form)], patches, seed)
}
