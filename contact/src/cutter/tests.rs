//! Analytic cases: what each end does on the level, on slopes, spheres, cylinders, a torus, in a groove, at steps, needles
//! and rims.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use claymill_nurbs::analytic::{self, Frame as Placement};
use claymill_nurbs::{
    Curve2, Face, KnotVector, Model, NurbsSurface, Point2, Point3, Source, SurfaceKind, TrimEdge, TrimLoop,
    Vector3,
};
use claymill_toolpath::{Holder, Tool};

use super::{CUTTER_EPSILON_MM, CutterDrop, CutterLocation, ToolPart};
use crate::Frame;
use crate::{BallDrop, Covering};

pub(super) fn face(surface: NurbsSurface) -> Face {
    Face { surface, loops: Vec::new(), reversed: false, kind: SurfaceKind::Nurbs, source: Source::default() }
}

pub(super) fn placed(origin: Point3, z: Vector3) -> Placement {
    Placement::new(origin, z, Vector3::x()).unwrap()
}

pub(super) fn top() -> Frame {
    // Front +x: setup coordinates are model coordinates.
    Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap()[0]
}

/// A circle of 30 mm about the origin of the parameter plane.
pub(super) fn round_trim() -> TrimLoop {
    let arc = |from: f64| {
        let corner = |a: f64| Point2::new(30.0 * a.cos(), 30.0 * a.sin());
        let w = (PI / 4.0).cos();
        let middle = corner(from + PI / 4.0).coords / w;
        Curve2::new(
            KnotVector::clamped_uniform(2, 3),
            vec![corner(from), middle.into(), corner(from + FRAC_PI_2)],
            Some(vec![1.0, w, 1.0]),
        )
        .unwrap()
    };
    let edges = (0..4).map(|k| TrimEdge { pcurve: arc(f64::from(k) * FRAC_PI_2), shared: None }).collect();
    TrimLoop { edges }
}

/// A model covered for tools.
pub(super) struct Bench {
    pub(super) model: Model,
    pub(super) covering: Covering,
}

impl Bench {
    pub(super) fn of(faces: Vec<Face>) -> Self {
        let model = Model { faces, ..Model::default() };
        let area_mm2 = model.faces.iter().map(Face::area_mm2).sum();
        let covering = Covering::new(&model, &vec![false; model.faces.len()], area_mm2, 10.0).unwrap();
        Bench { model, covering }
    }

    pub(super) fn surfaces(surfaces: Vec<NurbsSurface>) -> Self {
        Bench::of(surfaces.into_iter().map(face).collect())
    }

    fn tool(&self, tool: &str) -> CutterDrop<'_> {
        CutterDrop::new(&self.model, &self.covering, &top(), &tool.parse::<Tool>().unwrap())
    }

    fn ball(&self, radius_mm: f64) -> BallDrop<'_> {
        BallDrop::new(&self.model, &self.covering, &top(), radius_mm)
    }
}

/// Never lower than it may be, and higher by no more than is stated, which is what is aimed at or, at round rims, close to it.
fn assert_rests(at: Option<CutterLocation>, exact: f64, what: &str) -> CutterLocation {
    assert_rests_within(at, exact, 1.0001 * CUTTER_EPSILON_MM, what)
}

fn assert_rests_within(at: Option<CutterLocation>, exact: f64, gap_mm: f64, what: &str) -> CutterLocation {
    let at = at.unwrap_or_else(|| panic!("{what}: nothing"));
    assert!(at.tip.z >= exact - 1e-9, "{what}: {} is below {exact}", at.tip.z);
    assert!(at.tip.z <= exact + at.gap_mm + 1e-9, "{what}: {} is not {exact} within {}", at.tip.z, at.gap_mm);
    assert!(at.gap_mm <= gap_mm, "{what}: gap {}", at.gap_mm);
    at
}

fn plane_through(tilt_deg: f64, x: (f64, f64)) -> NurbsSurface {
    let t = tilt_deg.to_radians();
    let along = Vector3::new(t.cos(), 0.0, t.sin());
    let frame = Placement::new(Point3::origin(), along.cross(&Vector3::y()), along).unwrap();
    analytic::plane_patch(&frame, x, (-200.0, 200.0)).unwrap()
}

const TOOLS: [&str; 5] =
    ["ball:10", "flat:10", "bull:10:2", "bull:10:9", "bull:8:3,taper:10,length:40,shank:40"];

/// Height of the tip on a plane of slope `m` above the plane: the flat's rim and the corner's ball.
fn above_slope(tool: &str, m: f64) -> f64 {
    let tool: Tool = tool.parse().unwrap();
    let (flat, corner) = (tool.radius_mm() - tool.corner_radius_mm(), tool.corner_radius_mm());
    flat * m + corner * (m.hypot(1.0) - 1.0)
}

#[test]
fn level_and_sloped_planes() {
    for tilt_deg in [0.0, 7.0, 30.0, 44.0] {
        let bench = Bench::surfaces(vec![plane_through(tilt_deg, (-200.0, 200.0))]);
        let m = f64::tan(f64::to_radians(tilt_deg));
        for tool in TOOLS {
            let end = bench.tool(tool);
            for (x, y) in [(0.0, 0.0), (13.7, -4.1), (-51.0, 60.0)] {
                let at = assert_rests(end.drop(x, y), m * x + above_slope(tool, m), tool);
                assert_eq!(at.part, ToolPart::End);
            }
        }
    }
}

#[test]
fn sphere_cylinder_and_torus() {
    // On a sphere of radius ρ about the origin the corner's circle touches with its centre on a sphere of ρ + r.
    let rho = 40.0;
    let sphere =
        analytic::sphere(&placed(Point3::origin(), Vector3::z()), rho, (0.0, TAU), (-FRAC_PI_2, FRAC_PI_2))
            .unwrap();
    let ball = Bench::surfaces(vec![sphere]);
    for (tool, flat, r) in [("ball:10", 0.0_f64, 10.0_f64), ("flat:10", 10.0, 0.0), ("bull:10:2", 8.0, 2.0)] {
        let end = ball.tool(tool);
        for i in 1..60 {
            let angle = f64::from(i) * 0.7;
            let out = 0.61 * f64::from(i);
            let (x, y) = (out * angle.cos(), out * angle.sin());
            let across = (out - flat).max(0.0);
            let exact = ((rho + r) * (rho + r) - across * across).sqrt() - r;
            // The parametrisation is singular at the pole.
            let gap_mm = if out < flat + 1.0 { 5e-3 } else { 1.0001 * CUTTER_EPSILON_MM };
            assert_rests_within(end.drop(x, y), exact, gap_mm, &format!("{tool} at {out}"));
        }
    }
    // A cylinder along y: the same in its cross-section.
    let axis = Placement::new(Point3::new(0.0, 150.0, 0.0), Vector3::y(), Vector3::x()).unwrap();
    let bar = Bench::surfaces(vec![analytic::cylinder(&axis, rho, (0.0, TAU), (-300.0, 0.0)).unwrap()]);
    for (tool, flat, r) in [("ball:10", 0.0_f64, 10.0_f64), ("flat:10", 10.0, 0.0), ("bull:10:2", 8.0, 2.0)] {
        let end = bar.tool(tool);
        for i in 0..30 {
            let x = 1.3 * f64::from(i);
            let across = (x - flat).max(0.0);
            let exact = ((rho + r) * (rho + r) - across * across).sqrt() - r;
            assert_rests(end.drop(x, 3.0), exact, &format!("{tool} at {x}"));
        }
    }
    // Over a torus about z the axis of revolution of the tool may be moved to touch the tube at its nearest circle.
    let (major, minor) = (60.0, 15.0);
    let torus =
        analytic::torus(&placed(Point3::origin(), Vector3::z()), major, minor, (0.0, TAU), (0.0, TAU))
            .unwrap();
    let ring = Bench::surfaces(vec![torus]);
    for (tool, flat, r) in [("ball:5", 0.0, 5.0), ("flat:5", 5.0, 0.0), ("bull:5:2", 3.0, 2.0)] {
        let end = ring.tool(tool);
        for i in 0..40 {
            let out = 46.0 + 0.8 * f64::from(i);
            let across = ((out - major).abs() - flat).max(0.0);
            let exact = ((minor + r) * (minor + r) - across * across).sqrt() - r;
            let angle = 0.37 + f64::from(i);
            assert_rests(end.drop(out * angle.cos(), out * angle.sin()), exact, &format!("{tool} at {out}"));
        }
    }
}

#[test]
fn groove_step_needle_and_rim() {
    let groove =
        Bench::surfaces(vec![plane_through(30.0, (0.0, 200.0)), plane_through(-30.0, (-200.0, 0.0))]);
    let m = 30f64.to_radians().tan();
    for tool in TOOLS {
        let end = groove.tool(tool);
        for x in [0.0, 1.0, -3.0, 20.0, -33.3_f64] {
            assert_rests(end.drop(x, 4.0), x.abs() * m + above_slope(tool, m), tool);
        }
    }
    // A level plate at z = 7 for x ≥ 0 above another at 0: the rim of the upper one is a step.
    let level = |z: f64, x: (f64, f64)| {
        analytic::plane_patch(&placed(Point3::new(0.0, 0.0, z), Vector3::z()), x, (-100.0, 100.0)).unwrap()
    };
    let step = Bench::surfaces(vec![level(7.0, (0.0, 100.0)), level(0.0, (-100.0, 100.0))]);
    for (tool, flat, r) in [("flat:10", 10.0, 0.0_f64), ("bull:10:2", 8.0, 2.0), ("bull:10:9", 1.0, 9.0)] {
        let end = step.tool(tool);
        for (x, y) in [(3.0, 0.0), (-0.5, 2.0), (-7.9, -33.0), (-8.3, 1.0), (-9.7, 1.0), (-10.2_f64, 1.0)] {
            let out: f64 = (-x - flat).max(0.0);
            let on_rim = if out <= r { 7.0 - r + (r * r - out * out).sqrt() } else { 0.0 };
            assert_rests(end.drop(x, y), on_rim.max(0.0), &format!("{tool} at {x}"));
        }
    }
    // The tip of a steep pyramid holds the tool wherever it is below it.
    let tip = Point3::new(0.0, 0.0, 20.0);
    let sides = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(a, b)| {
        let foot = |x: f64, y: f64| Point3::new(0.1 * x, 0.1 * y, 0.0);
        let net = vec![tip, tip, foot(a, b), foot(-b, a)];
        NurbsSurface::new(KnotVector::clamped_uniform(1, 2), KnotVector::clamped_uniform(1, 2), net, None)
            .unwrap()
    });
    let needle = Bench::surfaces(sides.to_vec());
    for (tool, flat, r) in [("ball:10", 0.0_f64, 10.0_f64), ("flat:10", 10.0, 0.0), ("bull:10:2", 8.0, 2.0)] {
        let end = needle.tool(tool);
        for away in [0.0_f64, 3.0, 7.5, 8.5, 9.5] {
            let out: f64 = (away - flat).max(0.0);
            assert_rests(
                end.drop(away, 0.0),
                20.0 - r + (r * r - out * out).sqrt(),
                &format!("{tool} {away}"),
            );
        }
        assert_eq!(end.drop(10.2, 0.0).map(|l| l.tip.z), None);
    }
    // A disc with a round trim: from outside, its rim is met.
    let plate =
        analytic::plane_patch(&placed(Point3::origin(), Vector3::z()), (-50.0, 50.0), (-50.0, 50.0)).unwrap();
    let disc = Bench::of(vec![Face { loops: vec![round_trim()], ..face(plate) }]);
    for (tool, flat, r) in [("flat:10", 10.0, 0.0_f64), ("bull:10:4", 6.0, 4.0), ("ball:10", 0.0, 10.0)] {
        let end = disc.tool(tool);
        for i in 0..40 {
            let (away, angle) = (31.0 + 0.22 * f64::from(i), 0.31 * f64::from(i));
            let out: f64 = (away - 30.0 - flat).max(0.0);
            let exact = (r * r - out * out).sqrt() - r;
            assert_rests(
                end.drop(away * angle.cos(), away * angle.sin()),
                exact,
                &format!("{tool} at {away}"),
            );
        }
    }
}

/// A wavy sheet without symmetry, curved more tightly than the tools here and there.
fn waves() -> Bench {
    let at = |k: usize| -> Point3 {
        let (i, j) = ((k / 12) as f64, (k % 12) as f64);
        Point3::new(9.0 * i, 8.0 * j, 6.0 * (1.1 * i + 0.3 * j).sin() + 5.0 * (0.9 * j - 0.2 * i).cos())
    };
    let net = (0..144).map(at).collect();
    let knots = || KnotVector::clamped_uniform(3, 12);
    Bench::surfaces(vec![NurbsSurface::new(knots(), knots(), net, None).unwrap()])
}

fn places() -> impl Iterator<Item = (f64, f64)> {
    let share = |k: u32, prime: u32| (f64::from(k) * 0.618_033_988_75 * f64::from(prime)).fract();
    (0..300).map(move |k| (-4.0 + 108.0 * share(k, 1), -4.0 + 96.0 * share(k, 7)))
}

#[test]
fn a_corner_as_large_as_the_tool_is_the_ball() {
    let bench = waves();
    let (end, ball) = (bench.tool("ball:6"), bench.ball(6.0));
    let mut met = 0;
    for (x, y) in places() {
        let (Some(own), Some(known)) = (end.drop(x, y), ball.drop(x, y)) else { continue };
        let higher = own.tip.z + 6.0 - known.centre.z;
        assert!(higher > -1e-8 && higher < own.gap_mm + crate::CONTACT_EPSILON_MM, "({x}, {y}): {higher}");
        assert!(own.gap_mm <= 1.0001 * CUTTER_EPSILON_MM, "({x}, {y}): {}", own.gap_mm);
        met += 1;
    }
    assert!(met > 250, "{met}");
}

#[test]
fn corners_tend_to_the_flat_end_and_larger_tools_stop_higher() {
    let bench = waves();
    let drop = |tool: &str, (x, y): (f64, f64)| bench.tool(tool).drop(x, y);
    let smaller = ["flat:2", "flat:4", "flat:6", "flat:9"].map(|t| bench.tool(t));
    let rounder =
        ["flat:6", "bull:6:0.000001", "bull:6:0.5", "bull:6:2", "bull:6:5", "ball:6"].map(|t| bench.tool(t));
    for (x, y) in places() {
        let rests = |ends: &[CutterDrop]| -> Vec<f64> {
            ends.iter().map(|e| e.drop(x, y).map_or(f64::NEG_INFINITY, |l| l.tip.z)).collect()
        };
        // Each tool holds the one before.
        assert!(rests(&smaller).windows(2).all(|z| z[1] >= z[0] - 2e-5), "({x}, {y})");
        let z = rests(&rounder);
        assert!(z.windows(2).all(|z| z[1] <= z[0] + 2e-5), "({x}, {y}): {z:?}");
        assert!(z[0] == z[1] || (z[0] - z[1]).abs() < 1e-4, "({x}, {y}): {z:?}");
    }
    assert!(drop("flat:6", (500.0, 0.0)).is_none());
}

/// Against points of the surface, so many that the highest is known to a micrometre or so.
#[test]
fn the_surface_itself_holds_it_there() {
    let bench = waves();
    let surface = &bench.model.faces[0].surface;
    let count = 1800;
    let points: Vec<Point3> = (0..=count)
        .flat_map(|i| (0..=count).map(move |j| (i, j)))
        .map(|(i, j)| (f64::from(i) / f64::from(count), f64::from(j) / f64::from(count)))
        .map(|(u, v)| surface.point(u, v))
        .collect();
    for name in TOOLS {
        let tool: Tool = name.parse().unwrap();
        let end = bench.tool(name);
        let outline = crate::cutter::tests::outline(&tool);
        for (x, y) in places().step_by(37) {
            let Some(at) = end.drop(x, y) else { continue };
            let brute = points
                .iter()
                .filter_map(|p| Some(p.z - outline((p.x - x).hypot(p.y - y))?))
                .fold(f64::NEG_INFINITY, f64::max);
            assert!(at.tip.z >= brute - 1e-9, "{name} ({x}, {y}): {} {brute}", at.tip.z);
            // Points 0.06 mm apart; a sharp rim falls between them.
            let missed = if tool.corner_radius_mm() > 0.0 { 1e-3 } else { 0.06 };
            assert!(at.tip.z < brute + missed, "{name} ({x}, {y}): {} {brute}", at.tip.z);
        }
    }
}

/// Lowest height of a tool at a distance from its axis, written down anew.
fn outline(tool: &Tool) -> impl Fn(f64) -> Option<f64> + use<> {
    let (radius, corner, sides) = (tool.radius_mm(), tool.corner_radius_mm(), tool.sides());
    move |d: f64| {
        let out = (d - radius + corner).max(0.0);
        let end = (d <= radius).then(|| corner - (corner * corner - out * out).max(0.0).sqrt());
        let side = |[[low, lower], [high, upper]]: &[[f64; 2]; 2]| {
            if d <= *lower {
                Some(*low)
            } else {
                (d <= *upper).then(|| low + (high - low) * (d - lower) / (upper - lower))
            }
        };
        sides.iter().filter_map(side).chain(end).reduce(f64::min)
    }
}

/// A post of radius 3 and a wall 8 mm away: the ball stands beside the post, the shank on the wall's top.
#[test]
fn taper_and_shank_hold_the_ball_up() {
    let level = |z: f64, x: (f64, f64)| {
        analytic::plane_patch(&placed(Point3::new(0.0, 0.0, z), Vector3::z()), x, (-100.0, 100.0)).unwrap()
    };
    let bench = Bench::surfaces(vec![level(0.0, (-100.0, 100.0)), level(50.0, (8.0, 100.0))]);
    // Straight: beside the wall.
    let part = |tool: &str, x: f64, tip: f64| assert_rests(bench.tool(tool).drop(x, 0.0), tip, tool).part;
    assert_eq!(part("ball:5", 0.0, 0.0), ToolPart::End);
    // A shank of 20 mm from 30 mm up stands on the wall, one of 14 mm passes it.
    assert_eq!(part("ball:5,length:30,shank:20", 0.0, 20.0), ToolPart::Side);
    assert_eq!(part("ball:5,length:30,shank:14", 0.0, 0.0), ToolPart::End);
    assert_eq!(part("ball:5,length:60,shank:20", 0.0, 0.0), ToolPart::End);
    // A taper of 5°: its radius at 50 mm is the ball's at the tangent and what it gains.
    let (sine, cosine) = 5f64.to_radians().sin_cos();
    let (low, from) = (5.0 * (1.0 - sine), 5.0 * cosine);
    let radius_at = |z: f64| from + (z - low) * sine / cosine;
    let tip = 50.0 - (low + (8.0 - from) * cosine / sine);
    assert!(radius_at(50.0) > 8.0 && tip > 0.0);
    assert_eq!(part("ball:5,taper:5,length:70", 0.0, tip), ToolPart::Side);
    assert_eq!(part("ball:5,taper:5,length:70", -2.0, 0.0), ToolPart::End);
    // Flutes that end below: the shank is as thick as they are there.
    assert_eq!(part("ball:5,taper:5,length:30", 0.0, 0.0), ToolPart::End);
}

/// A wall 8 mm away and 50 mm high under the lower end of a holder, at 30 mm: over its inside, past its rim, beside it.
#[test]
fn a_holder_keeps_its_distance() {
    let level = |z: f64, x: (f64, f64)| {
        analytic::plane_patch(&placed(Point3::new(0.0, 0.0, z), Vector3::z()), x, (-100.0, 100.0)).unwrap()
    };
    let bench = Bench::surfaces(vec![level(0.0, (-100.0, 100.0)), level(50.0, (8.0, 100.0))]);
    let near = 1.0 - f64::sqrt(0.75);
    for tool in ["ball:5", "bull:5:1"].map(|text| text.parse::<Tool>().unwrap()) {
        for (radius_mm, tip_mm) in [(10.0, 21.0), (7.5, 21.0 - near), (6.99, 0.0)] {
            let holder = Holder::parse(&format!("30:{0}-{0}x40", 2.0 * radius_mm), &tool).unwrap();
            let drop = BallDrop::of_tool(&bench.model, &bench.covering, &top(), &tool);
            let held = drop.with_holder(&holder, 1.0).drop(0.0, 0.0).unwrap();
            let found_mm = held.centre.z - tool.corner_radius_mm();
            // How high a holder stands is known to a tenth.
            let is_held_mm = if tip_mm > 0.0 { 0.1 } else { 0.0 };
            let within_mm = tip_mm - 1e-3..tip_mm + is_held_mm + 1e-3;
            assert!(within_mm.contains(&found_mm), "{tool} in {holder}: {found_mm} for {tip_mm}");
        }
    }
}

/// On a tilted sheet a flat end rests on its inside, on its borders and on its corners.
#[test]
fn a_flat_end_rests_on_all_of_a_tilted_sheet_and_beside_it() {
    let (sine, cosine) = 15.0_f64.to_radians().sin_cos();
    let at =
        Placement::new(Point3::origin(), Vector3::new(-sine, 0.0, cosine), Vector3::new(cosine, 0.0, sine))
            .unwrap();
    let bench = Bench::surfaces(vec![analytic::plane_patch(&at, (0.0, 90.0), (0.0, 60.0)).unwrap()]);
    let (long, radius) = (90.0 * cosine, 6.0_f64);
    let drop = BallDrop::of_tool(&bench.model, &bench.covering, &top(), &"flat:6".parse().unwrap());
    let mut met = 0;
    for k in 0..4000 {
        let share = |prime: f64| (f64::from(k) * prime).fract();
        let (x, y) = (-8.0 + (long + 16.0) * share(0.618_034), -8.0 + 76.0 * share(0.754_878));
        let beside = (-y).max(y - 60.0).max(0.0);
        let half = (radius * radius - beside * beside).max(0.0).sqrt();
        let far = (x + half).min(long);
        let is_met = beside < radius && x + half > 0.0 && x - half < long;
        let rest = drop.drop(x, y);
        if (radius - beside).abs() < 1e-3 || (x + half).abs() < 1e-3 || (x - half - long).abs() < 1e-3 {
            continue;
        }
        assert_eq!(rest.is_some(), is_met, "{x} {y}");
        if let Some(rest) = rest {
            met += 1;
            let exact = far * sine / cosine;
            let above = rest.centre.z - exact;
            assert!(
                (-1e-9..=1.01 * crate::CONTACT_EPSILON_MM).contains(&above),
                "{x} {y}: {above} {:?}",
                rest.support
            );
        }
    }
    assert!(met > 3000, "{met}");
}
