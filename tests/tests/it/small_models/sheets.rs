//! Open sheets by chance: nothing of them is cut from the side of the material, nor does the ball get there.

use std::f64::consts::PI;

use claymill_nurbs::analytic::{Frame, cylinder, sphere};
use claymill_nurbs::{Face, KnotVector, Model, NurbsSurface, Point3, Vector3};
use claymill_paths::Strategy;
use claymill_surface_merge::{Preset, SheetOptions, merge, sheets};
use claymill_toolpath::FreeSide;
use claymill_verify::{Finding, FindingCode, Severity, SurfaceState, VerifyOptions, verify_program};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::solids::{between, whole};
use super::{planned_on, size_mm};

const FEW: u64 = 20;
/// Reachable surface that may be left of a sheet among others.
const MOST_LEFT: f64 = 0.02;

/// A bicubic sheet of this size about the origin, bowed at will.
fn bowed(rng: &mut ChaCha8Rng, [wide, deep]: [f64; 2], bow_mm: f64) -> NurbsSurface {
    let mut points = Vec::new();
    for i in 0..4 {
        for j in 0..4 {
            let (x, y) = (f64::from(i) / 3.0 - 0.5, f64::from(j) / 3.0 - 0.5);
            let bow = -4.0 * bow_mm * (x * x + y * y) + 0.2 * bow_mm * between(rng, -1.0, 1.0);
            points.push(Point3::new(wide * x, deep * y, bow));
        }
    }
    NurbsSurface::new(KnotVector::clamped_uniform(3, 4), KnotVector::clamped_uniform(3, 4), points, None)
        .unwrap()
}

/// Turned about a level axis, and moved.
fn placed(surface: &NurbsSurface, lean: f64, turn: f64, to: Vector3) -> NurbsSurface {
    let rotation = nalgebra::Rotation3::from_euler_angles(0.0, lean, turn);
    surface.mapped(|p| rotation * p + to)
}

/// Sheets that stand above, behind and through each other.
fn sheets_by_chance(seed: u64) -> (&'static str, Model) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let rng = &mut rng;
    let mut one = |size: [f64; 2], lean: f64, to: [f64; 3]| {
        let bow_mm = between(rng, 2.0, 20.0);
        let turn = between(rng, -PI, PI);
        placed(&bowed(rng, size, bow_mm), lean, turn, Vector3::from(to))
    };
    let (name, surfaces) = match seed % 5 {
        0 => ("one that leans", vec![one([80.0, 60.0], 0.4 * (seed as f64 % 7.0) - 1.2, [0.0; 3])]),
        1 => {
            let along = Frame::new(Point3::new(20.0, 0.0, -6.0), Vector3::z(), Vector3::x()).unwrap();
            let dome = sphere(&along, 18.0, (0.0, 2.0 * PI), (0.0, 0.5 * PI)).unwrap();
            ("a dome that sinks into one", vec![one([120.0, 90.0], 0.15, [0.0; 3]), dome])
        }
        2 => (
            "one above the other",
            vec![one([90.0, 70.0], 0.1, [0.0; 3]), one([40.0, 50.0], -0.2, [15.0, 10.0, 25.0])],
        ),
        3 => {
            let along = Frame::new(Point3::origin(), Vector3::y(), Vector3::x()).unwrap();
            let arch = cylinder(&along, 30.0, (-PI, 0.0), (-40.0, 40.0)).unwrap();
            ("an arch over one", vec![arch, one([50.0, 40.0], 0.0, [0.0, 0.0, -5.0])])
        }
        _ => (
            "one that stands beside another",
            vec![one([90.0, 60.0], 0.0, [0.0; 3]), one([50.0, 60.0], 1.5, [60.0, 0.0, 5.0])],
        ),
    };
    let faces: Vec<Face> = surfaces.into_iter().map(whole).collect();
    (name, Model { faces, ..Model::default() })
}

#[test]
fn no_ball_gets_behind_open_sheets() {
    let mut wrong = Vec::new();
    for seed in 0..FEW {
        let (name, model) = sheets_by_chance(seed);
        let merged = merge(&model, &Preset::Clay.options()).unwrap();
        let options = SheetOptions { file_states_sides: false, up: Some(Vector3::z()) };
        let mut free_sides = vec![FreeSide::Both; model.faces.len()];
        for sheet in sheets(&model, &merged, &options) {
            for (&face, &along) in sheet.faces.iter().zip(&sheet.free_along) {
                free_sides[face] = FreeSide::one(along);
            }
        }
        let strategy = [Strategy::Planar, Strategy::Scallop, Strategy::Auto][(seed % 3) as usize];
        let radius_mm = [3.0, 5.0, 8.0][(seed / 2 % 3) as usize];
        let scallop_mm = [0.1, 0.5, 1.0][(seed / 5 % 3) as usize];
        let what = format!(
            "seed {seed}: {name}, size {:.0} mm, ball {radius_mm}, scallop {scallop_mm}, {strategy}",
            size_mm(&model)
        );
        let (job, plan) = planned_on(&model, free_sides, strategy, radius_mm, scallop_mm).unwrap();
        let found = verify_program(&model, &job, &plan.program, &VerifyOptions::default(), &()).unwrap();
        eprintln!("{what}: {:?} {:.1?}", found.sides, found.coverage.by_state_mm2);
        // Of what a ball rolls over beside an open border there are warnings only.
        let is_error = |f: &&Finding| f.severity == Severity::Error;
        let of_sides = |f: &&Finding| {
            [FindingCode::WrongSide, FindingCode::Gouge, FindingCode::RapidTouches].contains(&f.code)
        };
        let harms = found.verdict.findings.iter().filter(is_error).filter(of_sides);
        wrong.extend(harms.map(|f| format!("{what}: {}", f.message)));
        let area_mm2 = |state| found.coverage.by_state_mm2.get(&state).copied().unwrap_or(0.0);
        let (cut_mm2, left_mm2) = (area_mm2(SurfaceState::Cut), area_mm2(SurfaceState::ReachableLeft));
        if left_mm2 > MOST_LEFT * cut_mm2 {
            wrong.push(format!("{what}: {left_mm2:.0} mm² left beside {cut_mm2:.0}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
