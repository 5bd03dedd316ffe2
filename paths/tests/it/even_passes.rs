//! Passes at a constant scallop height on surfaces where distances and crests are known exactly.

use std::f64::consts::{PI, TAU};

use crate::few_faces::planned;
use claymill_nurbs::analytic::{Frame as Placement, cylinder, plane_patch, sphere, torus};
use claymill_nurbs::{NurbsSurface, Point3, Vector3};
use claymill_paths::{FitTolerance, PlanOptions, Strategy, flat_mm};
use claymill_toolpath::{LinkStyle, MoveKind};

const R: f64 = 10.0;
const SCALLOP_MM: f64 = 0.1;

/// A number of the pass, and its way, cut by cut, as so many places of the ball's centre and one more.
fn cuts(surface: NurbsSurface, link: LinkStyle, parts: u32) -> Vec<(u32, Vec<Point3>)> {
    let options = |usual| PlanOptions { strategy: Strategy::Scallop, link, ..usual };
    let plan = planned([surface], R, SCALLOP_MM, options);
    let cuts = plan.program.moves.iter().filter(|m| m.kind == MoveKind::Cut);
    let places = cuts.map(|m| {
        let curve = m.curve().unwrap();
        let (a, b) = curve.domain();
        // Moves are those of the tool's tip.
        let at = |k| curve.point(a + (b - a) * f64::from(k) / f64::from(parts)) + Vector3::z() * R;
        (m.pass, (0..=parts).map(at).collect())
    });
    places.collect()
}

/// The ways of the ball's centre along all passes over one face, each as a few of its places. Cut one way, closed passes are
/// no spiral.
fn passes(surface: NurbsSurface) -> Vec<Vec<Point3>> {
    cuts(surface, LinkStyle::OneWay, 20).into_iter().map(|cut| cut.1).collect()
}

/// Holds passes against the truth: `across` tells how far along the surface, across the passes, the ball touches, from
/// 0 to `width_mm`; `curvature` is the surface's across them, positive where it is convex.
fn hold(name: &str, surface: NurbsSurface, width_mm: f64, curvature: f64, across: impl Fn(&Point3) -> f64) {
    let mut at: Vec<f64> = Vec::new();
    for pass in passes(surface) {
        let places: Vec<f64> = pass.iter().map(&across).collect();
        let mean = places.iter().sum::<f64>() / places.len() as f64;
        // All of a pass is equally far, within a 25th of a step.
        let off = places.iter().map(|p| (p - mean).abs()).fold(0.0, f64::max);
        assert!(off < 0.04 * flat_mm(R, SCALLOP_MM), "{name}: a pass at {mean} mm wanders by {off} mm");
        at.push(mean);
    }
    at.sort_by(f64::total_cmp);
    let apart: Vec<f64> = at.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > 0.05).collect();

    // Two balls whose places lie `arc` apart meet at this height over the surface (docs/theory.md §4.1).
    let crest = |arc: f64| {
        let reach = if curvature == 0.0 { 1e6 } else { 1.0 / curvature.abs() };
        let side = if curvature < 0.0 { -1.0 } else { 1.0 };
        let (centre, half) = (reach + side * R, 0.5 * arc / reach);
        let root = (R * R - (centre * half.sin()).powi(2)).sqrt();
        side * (centre * half.cos() - side * root - reach) + FitTolerance::of_scallop(SCALLOP_MM).bias_mm
    };
    let heights: Vec<f64> = apart.iter().map(|&d| crest(d) / SCALLOP_MM).collect();
    let (low, high) =
        heights.iter().fold((f64::INFINITY, 0.0f64), |(low, high), &h| (low.min(h), high.max(h)));
    assert!(low > 0.95 && high < 1.02, "{name}: crests from {low} to {high}");

    // No pass more than the width asks for, and half a step from either border.
    let step =
        flat_mm(R, FitTolerance::of_scallop(SCALLOP_MM).to_lay_mm(SCALLOP_MM)) / (1.0 + curvature * R).sqrt();
    let fewest = width_mm / step;
    let count = apart.len() + 1;
    assert!((count as f64) < fewest + 1.0 && count as f64 > fewest - 1.0, "{name}: {count} for {fewest}");
    for end in [at[0], width_mm - at[at.len() - 1]] {
        assert!((end - 0.5 * step).abs() < 0.05 * step, "{name}: the last pass is {end} mm from the border");
    }
}

fn upright(origin: Point3) -> Placement {
    Placement::new(origin, Vector3::z(), Vector3::x()).unwrap()
}

#[test]
fn a_plane_has_equal_rows() {
    let tilt = 25f64.to_radians();
    let normal = Vector3::new(0.0, -tilt.sin(), tilt.cos());
    let placement = Placement::new(Point3::origin(), normal, Vector3::x()).unwrap();
    let surface = plane_patch(&placement, (0.0, 300.0), (0.0, 120.0)).unwrap();
    let along = normal.cross(&Vector3::x());
    hold("plane", surface, 120.0, 0.0, |p| p.coords.dot(&along));
}

#[test]
fn a_hill_and_a_valley_have_rows_as_their_curvature_asks() {
    const REACH: f64 = 100.0;
    let lying = Placement::new(Point3::origin(), Vector3::x(), Vector3::z()).unwrap();
    let (from, to) = (-40f64.to_radians(), 40f64.to_radians());
    let width_mm = REACH * (to - from);
    let turned = |p: &Point3, up: f64| p.y.atan2(up * p.z);
    let field = cylinder(&lying, REACH, (from, to), (0.0, 250.0)).unwrap();
    hold("hill", field, width_mm, 1.0 / REACH, |p| REACH * (turned(p, 1.0) - from));
    let valley = cylinder(&lying, REACH, (PI + from, PI + to), (0.0, 250.0)).unwrap();
    hold("valley", valley, width_mm, -1.0 / REACH, |p| REACH * (turned(p, -1.0) - from));
}

#[test]
fn a_zone_of_a_sphere_and_a_torus_have_rings_at_equal_distances() {
    const REACH: f64 = 120.0;
    let (low, high) = (45f64.to_radians(), 75.7f64.to_radians());
    let zone = sphere(&upright(Point3::origin()), REACH, (0.0, TAU), (low, high)).unwrap();
    hold("sphere", zone, REACH * (high - low), 1.0 / REACH, |p| REACH * (p.z.atan2(p.x.hypot(p.y)) - low));
    // Over the crown of a tube: convex outside, a saddle inside.
    const TUBE: f64 = 80.0;
    let crown = torus(&upright(Point3::origin()), 200.0, TUBE, (0.0, TAU), (0.8, 2.2)).unwrap();
    hold("torus", crown, TUBE * 1.4, 1.0 / TUBE, |p| {
        let v = p.z.atan2(p.x.hypot(p.y) - 200.0);
        TUBE * (v - 0.8)
    });
}

#[test]
fn rings_are_one_spiral_with_turns_a_step_apart() {
    const REACH: f64 = 120.0;
    let (low, high) = (45f64.to_radians(), 75.7f64.to_radians());
    let zone = sphere(&upright(Point3::origin()), REACH, (0.0, TAU), (low, high)).unwrap();
    let cuts = cuts(zone, LinkStyle::Zigzag, 400);
    assert!(cuts.iter().all(|cut| cut.0 == cuts[0].0), "more than one pass");
    // From cut to cut it goes on where it was, in the same direction.
    for w in cuts.windows(2) {
        let (before, after) = (&w[0].1, &w[1].1);
        let last = before.len() - 1;
        assert!((before[last] - after[0]).norm() < 1e-3);
        let turn = |a: &Point3, b: &Point3, c: &Point3| (b - a).angle(&(c - b));
        let bend = turn(&before[last - 2], &before[last - 1], &before[last]);
        assert!((turn(&before[last - 1], &before[last], &after[1]) - bend).abs() < 0.005);
    }
    // Where it crosses half a plane through the axis, it is a step further up each time but the first and the last.
    let way: Vec<Point3> = cuts.into_iter().flat_map(|cut| cut.1).collect();
    let across = |p: &Point3| REACH * (p.z.atan2(p.x.hypot(p.y)) - low);
    let step =
        flat_mm(R, FitTolerance::of_scallop(SCALLOP_MM).to_lay_mm(SCALLOP_MM)) / (1.0 + R / REACH).sqrt();
    for turned in [0.3f64, 1.7, 4.0] {
        let beside = |p: &Point3| p.y * turned.cos() - p.x * turned.sin();
        let ahead = |p: &Point3| p.x * turned.cos() + p.y * turned.sin() > 0.0;
        let crosses = |w: &&[Point3]| (beside(&w[0]) < 0.0) != (beside(&w[1]) < 0.0) && ahead(&w[0]);
        let mut at: Vec<f64> = way.windows(2).filter(crosses).map(|w| across(&w[0])).collect();
        at.sort_by(f64::total_cmp);
        let apart: Vec<f64> = at.windows(2).map(|w| w[1] - w[0]).collect();
        let inner = &apart[1..apart.len() - 1];
        assert!(inner.iter().all(|d| (d / step - 1.0).abs() < 0.04), "{step} mm asked for, {inner:?}");
        assert!(apart.iter().all(|d| *d < 1.04 * step), "{apart:?}");
    }
}
