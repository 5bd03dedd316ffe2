//! Jobs made in memory whose answers are known: exact surfaces, passes at chosen offsets.
#![allow(dead_code, reason = "each test file uses its part")]

use claymill_nurbs::{Curve3, Face, KnotVector, Model, NurbsSurface, Point3, Source, SurfaceKind, Vector3};
use claymill_toolpath::{
    Area, FORMAT_VERSION, FaceAccount, Job, LinkStyle, ModelFacts, Move, MoveKind, Program, Request, Setup,
    Tool, ToolRecord, Totals,
};
use claymill_verify::{Verification, VerifyOptions, verify_program};

/// Ball radius of all tests, mm.
pub(crate) const R: f64 = 10.0;
/// Scallop height of all tests, mm.
pub(crate) const H: f64 = 0.02;

/// A model of untrimmed faces.
pub(crate) fn model(surfaces: impl IntoIterator<Item = NurbsSurface>) -> Model {
    let face = |(i, surface): (usize, NurbsSurface)| Face {
        surface,
        loops: Vec::new(),
        reversed: false,
        kind: SurfaceKind::Nurbs,
        source: Source { entity: format!("DE {}", 2 * i + 1), ..Source::default() },
    };
    Model { faces: surfaces.into_iter().enumerate().map(face).collect(), ..Model::default() }
}

/// The rectangle `x × y` at height `z`.
pub(crate) fn rectangle(x: (f64, f64), y: (f64, f64), z: f64) -> NurbsSurface {
    let knots = || KnotVector::clamped_uniform(1, 2);
    let corners = [(x.0, y.0), (x.0, y.1), (x.1, y.0), (x.1, y.1)];
    let points = corners.map(|(x, y)| Point3::new(x, y, z)).to_vec();
    NurbsSurface::new(knots(), knots(), points, None).unwrap()
}

/// A job record with one setup from above.
pub(crate) fn job(model: &Model) -> Job {
    let total: f64 = model.faces.iter().map(Face::area_mm2).sum();
    let tool = Tool::ball(R);
    Job {
        format_version: FORMAT_VERSION,
        claymill_version: String::new(),
        model: ModelFacts {
            path: String::new(),
            sha256: String::new(),
            units: "MM".into(),
            unit_mm: 1.0,
            faces_in_file: model.faces.len(),
            faces_read: model.faces.len(),
            skipped: Vec::new(),
            area_mm2: total,
            box_mm: [0.0; 6],
        },
        request: Request {
            rest_of: None,
            lines: None,
            guides: Vec::new(),
            pencil: false,
            tool,
            scallop_mm: H,
            strategy: "planar".into(),
            link: LinkStyle::Lace,
            preset: "clay".into(),
            up: "+z".into(),
            length: "-x".into(),
            only: Vec::new(),
            skip: Vec::new(),
            bounds: Default::default(),
            check: Vec::new(),
            holder_clearance_mm: 1.0,
            feed_mm_per_min: 6000.0,
            rapid_mm_per_min: 20000.0,
            machine: Default::default(),
        },
        tolerances: Default::default(),
        tools: vec![ToolRecord { id: "T1".into(), tool, holder: None }],
        setups: vec![Setup {
            name: "top".into(),
            axis: [0.0, 0.0, 1.0],
            clearance_mm: 100.0,
            area_mm2: 0.0,
            time_s: 0.0,
        }],
        regions: Vec::new(),
        totals: Totals::default(),
        area: Area { total_mm2: total, cut_mm2: total, uncut_mm2: Default::default() },
        faces: (model.faces.iter().enumerate())
            .map(|(face, f)| FaceAccount {
                face,
                entity: f.source.entity.clone(),
                region: 0,
                area: Area { total_mm2: f.area_mm2(), cut_mm2: f.area_mm2(), uncut_mm2: Default::default() },
            })
            .collect(),
        left_out: Vec::new(),
        timings: Vec::new(),
        peak_memory_mb: 0.0,
    }
}

/// A move of the ball's centre along `curve`, not rounded to written digits.
pub(crate) fn along(kind: MoveKind, pass: u32, curve: &Curve3) -> Move {
    let mut m = Move::along(kind, curve, Vector3::z(), 6000.0);
    for p in &mut m.points {
        p[2] -= R;
    }
    m.pass = pass;
    m.setup = "top".into();
    m.tool = "T1".into();
    m
}

/// A straight move of the ball's centre.
pub(crate) fn straight(kind: MoveKind, pass: u32, a: Point3, b: Point3) -> Move {
    let length = (b - a).norm();
    let knots = KnotVector::new(1, vec![0.0, 0.0, length, length]).unwrap();
    along(kind, pass, &Curve3::new(knots, vec![a, b], None).unwrap())
}

/// Numbers the moves.
pub(crate) fn program(moves: impl IntoIterator<Item = Move>) -> Program {
    let numbered = moves.into_iter().enumerate().map(|(seq, m)| Move { seq: seq as u64, ..m });
    Program { moves: numbered.collect() }
}

/// Options for small models.
pub(crate) fn options() -> VerifyOptions {
    VerifyOptions { area_per_sample_mm2: 0.2, ..VerifyOptions::default() }
}

/// Verifies silently.
pub(crate) fn check(model: &Model, job: &Job, program: &Program) -> Verification {
    verify_program(model, job, program, &options(), &|_, _| ()).unwrap()
}
