//! Jobs made in memory whose answers are known: exact surfaces, passes at chosen offsets.

use claymill_nurbs::{Curve3, Face, KnotVector, Model, NurbsSurface, Point3, Source, SurfaceKind, Vector3};
use claymill_toolpath::{
    Area, FORMAT_VERSION, FaceAccount, Job, LinkStyle, ModelFacts, Move, MoveKind, Program, Request, Setup,
    Tool, ToolRecord, Totals,
};
use claymill_verify::{Finding, FindingCode, Severity, Verification, VerifyOptions, verify_program};

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
            place: None,
            path: String::new(),
            sha256: String::new(),
            units: "MM".into(),
            unit_mm: 1.0,
            faces_in_file: model.faces.len(),
            faces_read: model.faces.len(),
            mirror: None,
            skipped: Vec::new(),
            area_mm2: total,
            box_mm: [0.0; 6],
        },
        request: Request {
            allowance_mm: 0.0,
            stock_above_mm: 0.0,
            rest_of: None,
            levels: None,
            rest_above_mm: None,
            lines: None,
            guides: Vec::new(),
            pencil: false,
            tool,
            scallop_mm: H,
            strategy: "planar".into(),
            link: LinkStyle::Zigzag,
            preset: "clay".into(),
            up: "+z".into(),
            // Not said, so that it can be cut by its own setup alone.
            length: String::new(),
            only: Vec::new(),
            skip: Vec::new(),
            setups: Vec::new(),
            material_side: Vec::new(),
            bounds: Default::default(),
            check: Vec::new(),
            check_clearance_mm: 0.0,
            holder_clearance_mm: 1.0,
            feed_mm_per_min: 6000.0,
            lead_mm_per_min: Some(3000.0),
            rapid_mm_per_min: 20000.0,
            machine: Default::default(),
        },
        tolerances: Default::default(),
        tools: vec![ToolRecord {
            id: "T1".into(),
            tool,
            holder: None,
            setup_stick_out_mm: Default::default(),
        }],
        setups: vec![Setup {
            name: "top".into(),
            axis: [0.0, 0.0, 1.0],
            quaternion: None,
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
                free_side: Default::default(),
                area: Area { total_mm2: f.area_mm2(), cut_mm2: f.area_mm2(), uncut_mm2: Default::default() },
            })
            .collect(),
        left_out: Vec::new(),
        stock: None,
        operations: Vec::new(),
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
    verify_program(model, job, program, &options(), &()).unwrap()
}

/// Findings besides those on the sequence of moves: most tests have passes alone, which no job has.
pub(crate) fn findings(v: &Verification) -> Vec<&Finding> {
    use FindingCode::{Feed, Jump, Order, Retract, Totals};
    v.verdict.findings.iter().filter(|f| ![Feed, Jump, Order, Retract, Totals].contains(&f.code)).collect()
}

/// Whether the passes by themselves are as they should be.
pub(crate) fn is_sound(v: &Verification) -> bool {
    findings(v).iter().all(|f| f.severity != Severity::Error)
}

/// Height of rapids over everything, and of the ends of leads over passes, mm.
pub(crate) const HIGH: f64 = 100.0;
const LEAD: f64 = 5.0;

/// A job as it should be of passes, each by itself: from above everything down to each, and up again.
pub(crate) fn whole(model: &Model, passes: impl IntoIterator<Item = Move>) -> (Job, Program) {
    let mut moves = vec![];
    for (k, cut) in passes.into_iter().enumerate() {
        let [a, b] = [cut.start(), cut.end()];
        let at = |p: Point3, z: f64| Point3::new(p.x, p.y, z);
        let way = |kind: MoveKind, from: Point3, to: Point3| {
            let feed = if kind == MoveKind::Rapid { 20000.0 } else { 3000.0 };
            let up = Vector3::z() * R;
            Move { feed, ..straight(kind, k as u32, from + up, to + up) }
        };
        if let Some(last) = moves.last().map(Move::end) {
            moves.push(way(MoveKind::Rapid, last, at(a, HIGH)));
        }
        moves.push(way(MoveKind::Rapid, at(a, HIGH), at(a, a.z + LEAD)));
        moves.push(way(MoveKind::LeadIn, at(a, a.z + LEAD), a));
        moves.push(cut);
        moves.push(way(MoveKind::LeadOut, b, at(b, b.z + LEAD)));
        moves.push(way(MoveKind::Rapid, at(b, b.z + LEAD), at(b, HIGH)));
    }
    let program = program(moves);
    let mut job = job(model);
    count(&mut job, &program);
    (job, program)
}

/// Makes the job's totals those of the moves.
pub(crate) fn count(job: &mut Job, program: &Program) {
    job.totals = Totals { moves: program.moves.len() as u64, ..Totals::default() };
    program.moves.iter().for_each(|m| job.totals.length.add(m.kind, m.length_mm()));
}
