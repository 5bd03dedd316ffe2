//! Walls: upright ones that no setup faces are cut by balls that pass beside them.

use std::f64::consts::{PI, TAU};

use crate::few_faces::planned;
use claymill_nurbs::analytic::{Frame as Placement, cone, cylinder, plane_patch, torus};
use claymill_nurbs::{NurbsSurface, Point3, Vector3};
use claymill_paths::{FitTolerance, Plan, Strategy, flat_mm};
use claymill_toolpath::{LinkStyle, MoveKind};

const R: f64 = 5.0;
const SCALLOP_MM: f64 = 0.1;
const BORE_MM: f64 = 20.0;
const HIGH_MM: f64 = 30.0;
/// So little more than the bore that no ball gets in between.
const HALF_MM: f64 = 20.5;

fn placement() -> Placement {
    Placement::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap()
}

/// The four sides of a block, without its top.
fn sides() -> Vec<NurbsSurface> {
    let side = |out: Vector3| {
        let frame = Placement::new(Point3::from(out * HALF_MM), out, Vector3::z()).unwrap();
        plane_patch(&frame, (0.0, HIGH_MM), (-HALF_MM, HALF_MM)).unwrap()
    };
    [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y()].map(side).to_vec()
}

fn with_sides(surface: NurbsSurface) -> Vec<NurbsSurface> {
    [surface].into_iter().chain(sides()).collect()
}

/// Centres of the ball on the passes in a region from the top.
fn passes(plan: &Plan, region: usize) -> Vec<Vec<Point3>> {
    let is_one =
        |m: &&claymill_toolpath::Move| m.kind == MoveKind::Cut && m.region == region && m.axis_start[2] > 0.5;
    let centres = |m: &claymill_toolpath::Move| {
        let curve = m.curve().unwrap();
        let (a, b) = curve.domain();
        let at = |k: u32| curve.point(a + (b - a) * f64::from(k) / 500.0) + Vector3::z() * R;
        (0..=500).map(at).collect()
    };
    plan.program.moves.iter().filter(is_one).map(centres).collect()
}

#[test]
fn a_bore_is_cut_round_by_round_from_the_top_down() {
    let bore = cylinder(&placement(), BORE_MM, (0.0, TAU), (0.0, HIGH_MM)).unwrap();
    for (strategy, link) in [(Strategy::Planar, LinkStyle::Zigzag), (Strategy::Auto, LinkStyle::OneWay)] {
        let plan = planned(with_sides(bore.clone()), R, SCALLOP_MM, |usual| claymill_paths::PlanOptions {
            strategy,
            link,
            ..usual
        });
        let of_bore = &plan.faces[0];
        approx::assert_relative_eq!(of_bore.area.cut_mm2, TAU * BORE_MM * HIGH_MM, max_relative = 1e-6);

        let tolerance = FitTolerance::of_scallop(SCALLOP_MM);
        let step_mm = flat_mm(R, tolerance.to_lay_mm(SCALLOP_MM));
        let rounds = passes(&plan, 0);
        let levels: Vec<f64> = rounds.iter().map(|r| r[0].z).collect();
        for (round, level) in rounds.iter().zip(&levels) {
            for c in round {
                let away = BORE_MM - c.x.hypot(c.y) - R - tolerance.bias_mm;
                assert!(away.abs() <= tolerance.fit_mm, "{away} mm off beside the wall, at {c}");
                assert!((c.z - level).abs() <= tolerance.fit_mm + 1e-6, "{c} leaves its level");
            }
            let round_mm: f64 = round.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
            approx::assert_relative_eq!(round_mm, TAU * (BORE_MM - R), max_relative = 1e-3);
        }
        assert!(levels.windows(2).all(|w| w[0] > w[1] && w[0] - w[1] < 1.005 * step_mm), "{levels:?}");
        assert!(levels[0] > HIGH_MM - 0.51 * step_mm && levels[levels.len() - 1] < 0.51 * step_mm);
        let totals = plan.regions.iter().find(|r| r.region == 0).unwrap();
        assert!(totals.retracts <= 1, "{} retracts", totals.retracts);

        let leads =
            plan.program.moves.iter().filter(|m| matches!(m.kind, MoveKind::LeadIn | MoveKind::LeadOut));
        let from_top = leads.filter(|m| m.region == 0 && m.axis_start[2] > 0.5);
        let (level, up): (Vec<_>, Vec<_>) = from_top.partition(|m| m.points[0][2] == m.points[1][2]);
        let beside_mm = |p: &[f64; 3]| BORE_MM - p[0].hypot(p[1]) - R;
        assert!(level.len() == up.len() && up.len() >= 2, "{} level, {} up", level.len(), up.len());
        assert!(up.iter().flat_map(|m| &m.points).all(|p| beside_mm(p) > 1.9), "up along the wall");
    }
}

#[test]
fn the_lowest_round_leaves_nothing_down_to_where_the_ball_gets() {
    let step_mm = flat_mm(R, FitTolerance::of_scallop(SCALLOP_MM).to_lay_mm(SCALLOP_MM));
    for k in 0..10 {
        let high_mm = HIGH_MM + 0.1 * f64::from(k) * step_mm;
        let bore = cylinder(&placement(), BORE_MM, (0.0, TAU), (0.0, high_mm)).unwrap();
        let floor = plane_patch(&placement(), (-HALF_MM, HALF_MM), (-HALF_MM, HALF_MM)).unwrap();
        let faces = [bore, floor].into_iter().chain(sides());
        let plan = planned(faces, R, SCALLOP_MM, |usual| usual);
        let levels = passes(&plan, 0).into_iter().map(|round| round[0].z);
        let lowest_mm = levels.fold(f64::INFINITY, f64::min) - R;
        // From half a step above where it gets, a ball leaves no more there than what was asked for.
        assert!(
            (0.0..0.5 * step_mm).contains(&lowest_mm),
            "{lowest_mm} mm over the floor, {high_mm} mm deep"
        );
    }
}

#[test]
fn rounds_go_on_to_where_the_wall_begins_to_lean_over() {
    // A bore with a waist, which is inclined: every round beside it is part of one.
    const TUBE_MM: f64 = 30.0;
    let axis = Vector3::new(0.1, 0.0, 1.0).normalize();
    let placement = Placement::new(Point3::origin(), axis, Vector3::y()).unwrap();
    let (ring_mm, open) = (BORE_MM + TUBE_MM, (0.85 * PI, 1.15 * PI));
    let waist = torus(&placement, ring_mm, TUBE_MM, (0.0, TAU), open).unwrap();
    let shield = cylinder(&placement, BORE_MM + 5.0, (0.0, TAU), (-15.0, 15.0)).unwrap();
    let plan = planned([waist, shield], R, SCALLOP_MM, |usual| usual);

    let step_mm = flat_mm(R, FitTolerance::of_scallop(SCALLOP_MM).to_lay_mm(SCALLOP_MM));
    let mut lowest_mm = [f64::INFINITY; 144];
    for centre in passes(&plan, 0).concat() {
        let (high, across) = (centre.coords.dot(&axis), centre.coords - axis * centre.coords.dot(&axis));
        let out = across.normalize();
        // The tube is met at this angle above its inner side, and upright at that one.
        let met = high.atan2(ring_mm - across.norm());
        let upright = out.z.atan2(axis.z);
        let turn = (across.y.atan2(across.x) + PI) / TAU * 144.0;
        let lowest_mm = &mut lowest_mm[turn as usize % 144];
        *lowest_mm = lowest_mm.min(TUBE_MM * (met - upright));
    }
    assert!(lowest_mm.iter().all(|mm| (-0.1..step_mm).contains(mm)), "{lowest_mm:?}");
    // Where one round takes over from the next there may be a gap.
    let high = lowest_mm.iter().filter(|mm| **mm > 0.55 * step_mm).count();
    assert!(high <= 2, "{high} of {lowest_mm:?} mm above the waist");
}

#[test]
fn what_leans_over_is_not_cut_nor_is_the_underside() {
    // A bore that narrows by 0.6 mm upwards.
    let bore = cone(&placement(), BORE_MM, -(0.6f64 / HIGH_MM).atan(), (0.0, TAU), (0.0, HIGH_MM)).unwrap();
    let top = Placement::new(Point3::new(0.0, 0.0, HIGH_MM), Vector3::z(), Vector3::x()).unwrap();
    let lid = plane_patch(&top, (-HALF_MM, HALF_MM), (-HALF_MM, HALF_MM)).unwrap();
    let bottom = plane_patch(&placement(), (-HALF_MM, HALF_MM), (-HALF_MM, HALF_MM)).unwrap();
    let box_of = [lid, bottom].into_iter().chain(sides());
    for (plan, face) in [
        (planned(with_sides(bore), R, SCALLOP_MM, |usual| usual), 0),
        (planned(box_of, R, SCALLOP_MM, |usual| usual), 1),
    ] {
        let area = &plan.faces[face].area;
        assert!(area.cut_mm2 < 1e-9 * area.total_mm2, "{area:?}");
        assert!(passes(&plan, face).is_empty());
    }
}
