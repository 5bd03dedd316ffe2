//! Leads: on arcs where nothing is in the way, and clear of what is.

use crate::few_faces::planned;
use claymill_nurbs::analytic::{Frame as Placement, plane_patch};
use claymill_nurbs::{Curve3, NurbsSurface, Point3, Vector3};
use claymill_paths::{Plan, PlanOptions};
use claymill_toolpath::{FreeSide, LinkStyle, Move, MoveKind};

const R: f64 = 5.0;
const SCALLOP_MM: f64 = 0.1;
const WIDE_MM: f64 = 60.0;

/// A level rectangle, `x` from one of these to the other.
fn level(z: f64, x: (f64, f64)) -> NurbsSurface {
    let at = Placement::new(Point3::new(0.0, 0.0, z), Vector3::z(), Vector3::x()).unwrap();
    plane_patch(&at, x, (0.0, WIDE_MM)).unwrap()
}

/// Rows along x over the faces, each reached and left from above.
fn rows(surfaces: Vec<NurbsSurface>) -> Plan {
    planned(surfaces, R, SCALLOP_MM, |usual| PlanOptions {
        link: LinkStyle::OneWay,
        row_angle_deg: Some(0.0),
        ..usual
    })
}

fn places(curve: &Curve3) -> Vec<Point3> {
    let (a, b) = curve.domain();
    (0..=200).map(|k| curve.point(a + (b - a) * f64::from(k) / 200.0)).collect()
}

#[test]
fn a_pass_in_the_open_is_reached_and_left_without_a_corner() {
    let plan = rows(vec![level(0.0, (0.0, 100.0))]);
    let moves: Vec<&Move> = plan.program.moves.iter().collect();
    let mut met = [0, 0];
    for w in moves.windows(2) {
        let (lead, cut) = match (w[0].kind, w[1].kind) {
            (MoveKind::LeadIn, MoveKind::Cut) => (w[0].curve().unwrap(), w[1].curve().unwrap()),
            (MoveKind::Cut, MoveKind::LeadOut) => (w[1].curve().unwrap(), w[0].curve().unwrap()),
            _ => continue,
        };
        let leads_in = w[0].kind == MoveKind::LeadIn;
        met[usize::from(leads_in)] += 1;
        let (at_lead, at_cut) =
            if leads_in { (lead.domain().1, cut.domain().0) } else { (lead.domain().0, cut.domain().1) };
        let turn = lead.derivatives(at_lead)[1].angle(&cut.derivatives(at_cut)[1]);
        assert!(turn < 1e-3, "a corner of {turn} rad");
        // A quarter of a circle, but for what the pass's end climbs; the cubic is off by 0.03 %, written digits by 0.01 %.
        let way = lead.derivatives(at_lead)[1].normalize();
        let inward = (Vector3::z() - way * way.z).normalize();
        let centre = lead.point(at_lead) + inward * (0.5 * R);
        for p in places(&lead) {
            approx::assert_relative_eq!((p - centre).norm(), 0.5 * R, max_relative = 5e-4);
        }
    }
    assert!(met[0] > 5 && met[1] > 5, "{met:?}");
}

#[test]
fn nothing_that_hangs_over_the_end_of_a_pass_is_touched() {
    let ledge_mm = 20.0;
    let far = rows(vec![level(0.0, (0.0, 100.0)), level(ledge_mm, (150.0, 200.0))]);
    let ends = far.program.moves.iter().filter(|m| m.kind == MoveKind::LeadOut && m.degree == 3);
    let arcs_end_mm = ends.map(|m| m.points[3][0]).filter(|x| *x < 110.0).fold(0.0, f64::max);
    assert!(arcs_end_mm > 100.0 + 0.5 * R);
    // Over the plate, and where arcs from its end just lead to: there the way up touches by a little.
    let beside = (0..=6).map(|k| arcs_end_mm + R - 1e-3 * f64::from(k));
    for from_mm in [50.0].into_iter().chain(beside) {
        let plan = rows(vec![level(0.0, (0.0, 100.0)), level(ledge_mm, (from_mm, 200.0))]);
        let below = |m: &&Move| m.kind == MoveKind::Cut && m.points.iter().all(|p| p[2] < 1.0);
        assert!(plan.program.moves.iter().filter(below).count() > 20);
        for m in &plan.program.moves {
            for tip in places(&m.curve().unwrap()) {
                let centre = tip + Vector3::z() * R;
                let nearest =
                    Point3::new(centre.x.clamp(from_mm, 200.0), centre.y.clamp(0.0, WIDE_MM), ledge_mm);
                let distance = (centre - nearest).norm();
                assert!(distance > R - 1e-3, "{:?} enters the ledge: {distance} at {centre}", m.kind);
            }
        }
    }
}

#[test]
fn no_pass_ends_where_its_lead_would_come_up_through_the_material() {
    let high_mm = 30.0;
    let upright = || {
        let at = Placement::new(Point3::origin(), Vector3::x(), Vector3::y()).unwrap();
        plane_patch(&at, (-20.0, WIDE_MM + 20.0), (0.0, high_mm)).unwrap()
    };
    let free = |surface: NurbsSurface, side: Vector3| {
        FreeSide::one(surface.normal(30.0, 15.0).unwrap().0.dot(&side) > 0.0)
    };
    let floor = || level(0.0, (0.0, 100.0));
    // The sheet has its material on the side of the floor.
    let plan = planned(vec![floor(), upright()], R, SCALLOP_MM, |usual| PlanOptions {
        link: LinkStyle::OneWay,
        row_angle_deg: Some(0.0),
        free_sides: vec![free(floor(), Vector3::z()), free(upright(), -Vector3::x())],
        ..usual
    });
    let mut nearest_mm = f64::INFINITY;
    for m in plan.program.moves.iter().filter(|m| m.setup == "top") {
        for tip in places(&m.curve().unwrap()).into_iter().filter(|p| p.x > 0.0 && p.z < high_mm - R) {
            assert!(tip.x > R + 1.0, "{:?} {} mm from the side of the material", m.kind, tip.x - R);
            nearest_mm = nearest_mm.min(tip.x - R);
        }
    }
    assert!(nearest_mm < 1.3, "{nearest_mm}");
}
