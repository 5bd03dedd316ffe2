//! The tool stays where it is kept, comes as near to the limits as it may, and runs out over open borders.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::few_faces::planned;
use claymill_nurbs::analytic::{Frame as Placement, cylinder, plane_patch, sphere};
use claymill_nurbs::{NurbsSurface, Point3, Vector3};
use claymill_paths::{Plan, PlanOptions, Strategy};
use claymill_toolpath::{Bounds, Contain, Move, MoveKind};

const R: f64 = 5.0;
const SCALLOP_MM: f64 = 0.1;
/// Passes stay so far inside, at most, where they meet a limit.
const SHY_MM: f64 = 0.03;
/// Half a step-over on a plane: as far as a pass along a limit may be from it.
const HALF_STEP_MM: f64 = 1.0;

/// A level rectangle from one corner to another.
fn level(z: f64, [x0, y0, x1, y1]: [f64; 4]) -> NurbsSurface {
    let at = Placement::new(Point3::new(0.0, 0.0, z), Vector3::z(), Vector3::x()).unwrap();
    plane_patch(&at, (x0, x1), (y0, y1)).unwrap()
}

fn kept(surfaces: Vec<NurbsSurface>, strategy: Strategy, bounds: Bounds) -> Plan {
    planned(surfaces, R, SCALLOP_MM, |usual| PlanOptions {
        row_angle_deg: Some(0.0),
        strategy,
        bounds,
        ..usual
    })
}

/// Ball centres along moves from above.
fn centres<'p>(plan: &'p Plan, kinds: &'p [MoveKind]) -> impl Iterator<Item = Point3> + 'p {
    let moves = plan.program.moves.iter().filter(|m| m.setup == "top" && kinds.contains(&m.kind));
    moves.flat_map(|m: &Move| {
        let curve = m.curve().unwrap();
        let (a, b) = curve.domain();
        (0..=50).map(move |k| curve.point(a + (b - a) * f64::from(k) / 50.0) + Vector3::z() * R)
    })
}

const DOWN: [MoveKind; 4] = [MoveKind::Cut, MoveKind::Link, MoveKind::LeadIn, MoveKind::LeadOut];

/// Lowest and highest along x and y.
fn ranges(places: impl Iterator<Item = Point3>) -> [[f64; 2]; 2] {
    let start = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    places.fold(start, |ranges, p| [0, 1].map(|k| [ranges[k][0].min(p[k]), ranges[k][1].max(p[k])]))
}

#[test]
fn boxes_hold_the_contact_the_centre_or_all_of_the_ball() {
    let dome = || {
        let at = Placement::new(Point3::new(0.0, 0.0, -30.0), Vector3::z(), Vector3::x()).unwrap();
        sphere(&at, 50.0, (0.0, TAU), (0.0, FRAC_PI_2)).unwrap()
    };
    let sides_mm = [-12.0, -9.0, -100.0, 14.0, 17.0, 100.0];
    for strategy in [Strategy::Planar, Strategy::Scallop] {
        for contain in [Contain::Contact, Contain::Centre, Contain::Edge] {
            let bounds = Bounds { contain, within_mm: vec![sides_mm], ..Bounds::default() };
            let plan = kept(vec![dome()], strategy, bounds);
            let middle = |centre: Point3| match contain {
                // On the sphere, seen from its centre.
                Contain::Contact => {
                    let out = centre - Point3::new(0.0, 0.0, -30.0);
                    Point3::new(0.0, 0.0, -30.0) + out * (50.0 / out.norm())
                }
                Contain::Centre | Contain::Edge => centre,
            };
            let inset_mm = if contain == Contain::Edge { R } else { 0.0 };
            let cut = ranges(centres(&plan, &[MoveKind::Cut]).map(middle));
            for k in 0..2 {
                let (low, high) = (sides_mm[k] + inset_mm, sides_mm[k + 3] - inset_mm);
                let [least, most] = cut[k];
                // Rows run along x: those beside the other two sides may be half a step-over away.
                let shy_mm = if k == 0 { SHY_MM } else { HALF_STEP_MM };
                assert!(
                    least >= low - 1e-3 && least <= low + shy_mm,
                    "{strategy} {contain:?} {k}: {least} {low}"
                );
                assert!(
                    most <= high + 1e-3 && most >= high - shy_mm,
                    "{strategy} {contain:?} {k}: {most} {high}"
                );
            }
            let links = ranges(centres(&plan, &[MoveKind::Link]).map(middle));
            assert!(
                links[0][0] >= sides_mm[0] + inset_mm - 0.01 && links[0][1] <= sides_mm[3] - inset_mm + 0.01
            );
            let out_mm2 = plan.area.uncut_mm2[&claymill_toolpath::UncutReason::OutOfBounds];
            assert!(out_mm2 > 0.5 * plan.area.total_mm2 - plan.area.cut_mm2, "{out_mm2}");
        }
    }
}

#[test]
fn a_box_ends_the_rounds_along_a_wall() {
    // A bore that is cut from the top alone: plates around it are in the other setups' way.
    let at = |origin: Point3, z: Vector3, x: Vector3| Placement::new(origin, z, x).unwrap();
    let bore_mm = 20.0;
    let bore = cylinder(
        &at(Point3::new(0.0, 0.0, -40.0), Vector3::z(), Vector3::x()),
        bore_mm,
        (0.0, TAU),
        (0.0, 40.0),
    );
    let side = |out: Vector3| {
        plane_patch(&at(Point3::from(out * 60.0), out, Vector3::z()), (-60.0, 20.0), (-60.0, 60.0)).unwrap()
    };
    let sides = [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y()].map(side);
    let sides_mm = [-50.0, -50.0, -25.0, 50.0, 7.0, 50.0];
    let bounds = Bounds { within_mm: vec![sides_mm], ..Bounds::default() };
    let plan = kept([bore.unwrap()].into_iter().chain(sides).collect(), Strategy::Planar, bounds);
    let touched = |c: Point3| Point3::new(c.x, c.y, 0.0) * (bore_mm / c.x.hypot(c.y)) + Vector3::z() * c.z;
    let cut: Vec<Point3> = centres(&plan, &[MoveKind::Cut]).map(touched).collect();
    let [_, [_, most]] = ranges(cut.iter().copied());
    assert!((7.0 - SHY_MM..=7.0 + 1e-3).contains(&most), "{most}");
    let lowest_mm = cut.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    assert!((-25.0..=-25.0 + 2.0 * HALF_STEP_MM).contains(&lowest_mm), "{lowest_mm}");
}

#[test]
fn the_ball_stays_over_what_is_cut() {
    let [wide, deep] = [80.0, 60.0];
    let plate = || vec![level(0.0, [0.0, 0.0, wide, deep])];
    for (contain, inset_mm) in [(Contain::Contact, 0.0), (Contain::Centre, 0.0), (Contain::Edge, R)] {
        let plan = kept(plate(), Strategy::Planar, Bounds { contain, ..Bounds::default() });
        let cut = ranges(centres(&plan, &[MoveKind::Cut]));
        let down = ranges(centres(&plan, &DOWN));
        for (k, far) in [wide, deep].into_iter().enumerate() {
            assert!((cut[k][0] - inset_mm).abs() <= HALF_STEP_MM, "{contain:?} {k}: {:?}", cut[k]);
            assert!((far - inset_mm - cut[k][1]).abs() <= HALF_STEP_MM, "{contain:?} {k}: {:?}", cut[k]);
            if contain != Contain::Contact {
                let [least, most] = down[k];
                assert!(
                    least >= inset_mm - 1e-3 && most <= far - inset_mm + 1e-3,
                    "{contain:?} {k}: {down:?}"
                );
            }
        }
    }
}

#[test]
fn no_move_comes_near_to_what_is_to_be_avoided() {
    // A kerb across a plate, upright and square.
    let stand = Placement::new(Point3::new(50.0, 0.0, 0.0), Vector3::x(), Vector3::y()).unwrap();
    let kerb = || plane_patch(&stand, (0.0, 60.0), (0.0, 12.0)).unwrap();
    let plate = || level(0.0, [0.0, 0.0, 100.0, 60.0]);
    for avoid_mm in [0.0, 1.5, 6.0] {
        let bounds = Bounds { avoid: vec![1], avoid_mm, ..Bounds::default() };
        let plan = kept(vec![plate(), kerb()], Strategy::Planar, bounds);
        let away = |c: Point3| {
            let nearest = Point3::new(50.0, c.y.clamp(0.0, 60.0), c.z.clamp(0.0, 12.0));
            (c - nearest).norm() - R
        };
        let least_mm = centres(&plan, &DOWN).map(away).fold(f64::INFINITY, f64::min);
        assert!(least_mm >= avoid_mm - 1e-3, "{least_mm} of {avoid_mm} mm");
        let passes_mm = centres(&plan, &[MoveKind::Cut]).map(away).fold(f64::INFINITY, f64::min);
        assert!(passes_mm <= avoid_mm + SHY_MM, "{passes_mm} of {avoid_mm} mm");
        assert!(plan.faces[1].area.cut_mm2 == 0.0);
    }
}

#[test]
fn passes_run_out_over_open_borders_and_turn_there() {
    let extend_mm = 4.0;
    let plates = || vec![level(0.0, [0.0, 0.0, 40.0, 60.0]), level(0.0, [40.0, 0.0, 80.0, 60.0])];
    let plan = kept(plates(), Strategy::Planar, Bounds { extend_mm, ..Bounds::default() });
    let top: Vec<&Move> = plan.program.moves.iter().filter(|m| m.setup == "top").collect();
    let passes = plan.totals.passes as usize;
    assert!(passes > 20);
    // Both ends of a pass are open on a side, and go on in the other plate on the other.
    let outs: Vec<&&Move> =
        top.iter().filter(|m| m.kind == MoveKind::LeadOut && m.length_mm() > extend_mm - 0.01).collect();
    assert!(outs.len() >= passes / 2, "{} of {passes}", outs.len());
    for m in &outs {
        let (from, to) = (m.start(), m.end());
        assert!((to - from).norm() <= extend_mm + 0.01 || from.z != to.z);
        assert!(from.x < 1.0 || from.x > 79.0 || from.z > 1.0, "{from}");
    }
    let far = ranges(centres(&plan, &DOWN));
    assert!(far[0][0] < -extend_mm + 0.1 && far[0][1] > 80.0 + extend_mm - 0.1, "{far:?}");
    // Turns are links in the open, without a corner.
    let retracts = plan.totals.retracts;
    assert!(retracts <= 2, "{retracts}");
    for w in top.windows(2).filter(|w| w[0].kind == MoveKind::LeadOut && w[1].kind == MoveKind::Link) {
        let (a, b) = (w[0].curve().unwrap(), w[1].curve().unwrap());
        let turn = a.derivatives(a.domain().1)[1].angle(&b.derivatives(b.domain().0)[1]);
        assert!(turn < 0.01, "{turn}");
    }
    // And none where the ball is to stay over the plate.
    let bounds = Bounds { extend_mm, contain: Contain::Edge, ..Bounds::default() };
    let inside = ranges(centres(&kept(plates(), Strategy::Planar, bounds), &DOWN));
    assert!(inside[0][0] >= R - 1e-3 && inside[0][1] <= 80.0 - R + 1e-3, "{inside:?}");
}
