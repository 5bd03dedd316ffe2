//! Findings that are taken from a store are those that are measured, whatever has changed since.

use std::sync::Arc;

use claymill_nurbs::{KnotVector, Model, NurbsSurface, Point3};
use claymill_store::Store;
use claymill_toolpath::{Job, Kept, Move, MoveKind, Program};
use claymill_verify::{Verification, verify_keeping, verify_with_crests};

use crate::synthetic::{H, R, job, model, options, program, rectangle, straight};

const FACES: usize = 4;
const LONG_MM: f64 = 120.0;
const WIDE_MM: f64 = 30.0;

/// A row of squares along x, each a region.
fn floors() -> Vec<NurbsSurface> {
    let along = |k: usize| (k as f64 * LONG_MM, (k + 1) as f64 * LONG_MM);
    (0..FACES).map(|k| rectangle(along(k), (0.0, WIDE_MM), 0.0)).collect()
}

/// The upright rectangle across the row at `x`, between two heights.
fn upright(x: f64, y: (f64, f64), z: (f64, f64)) -> NurbsSurface {
    let knots = || KnotVector::clamped_uniform(1, 2);
    let corners = [(y.0, z.0), (y.0, z.1), (y.1, z.0), (y.1, z.1)];
    let points = corners.map(|(y, z)| Point3::new(x, y, z)).to_vec();
    NurbsSurface::new(knots(), knots(), points, None).unwrap()
}

/// Passes along x over each of the squares.
fn passes() -> Vec<Move> {
    let step_over_mm = 2.0 * (2.0 * R * H - H * H).sqrt();
    let count = (WIDE_MM / step_over_mm) as u32;
    let pass = |region: usize, k: u32| {
        let y = (f64::from(k) + 0.5) * WIDE_MM / f64::from(count);
        let at = |x: f64| Point3::new(x, y, R);
        let [from, to] = [region, region + 1].map(|k| k as f64 * LONG_MM);
        let cut = straight(MoveKind::Cut, k, at(from), at(to));
        Move { region, ..cut }
    };
    (0..FACES).flat_map(|region| (0..count).map(move |k| pass(region, k))).collect()
}

/// What is found with what is kept; it has to be what is found without. And the share of parts that were known.
fn found(store: &Arc<Store>, model: &Model, job: &Job, program: &Program) -> (Verification, f64) {
    let kept = Kept::in_store(store.clone(), "this");
    let (with, crests_with) = verify_keeping(model, job, program, &options(), &kept, &()).unwrap();
    let (without, crests_without) = verify_with_crests(model, job, program, &options(), &()).unwrap();
    assert_eq!(with, without);
    assert_eq!(crests_with, crests_without);
    let count = kept.count();
    (with, count.reused as f64 / count.of as f64)
}

#[test]
fn what_is_kept_is_what_is_measured_after_any_change() {
    let folder = tempfile::tempdir().unwrap();
    let store = Arc::new(Store::open(folder.path(), Store::USUAL_LIMIT_BYTES).unwrap());
    let (faces, moves) = (model(floors()), program(passes()));
    let job_of = |model: &Model| job(model);
    let (first, known) = found(&store, &faces, &job_of(&faces), &moves);
    assert!(known == 0.0 && first.gouge.deepest_mm < 1e-6 && first.shank.as_ref().unwrap().touching == 0);
    let (again, known) = found(&store, &faces, &job_of(&faces), &moves);
    assert!(known == 1.0 && again == first);

    // One square is raised: the ball enters it, and it alone is looked at again.
    let mut raised = floors();
    raised[2] = rectangle((2.0 * LONG_MM, 3.0 * LONG_MM), (0.0, WIDE_MM), 0.02);
    let raised = model(raised);
    let (gouged, known) = found(&store, &raised, &job_of(&raised), &moves);
    assert!((gouged.gouge.deepest_mm - 0.02).abs() < 1e-6, "{}", gouged.gouge.deepest_mm);
    assert_eq!(gouged.gouge.deepest_at.unwrap().face, Some(2));
    assert!(known > 0.3 && known < 0.9, "{known}");

    // A pass is left out: a crest stands there.
    let mut fewer = passes();
    let gone = fewer.len() / 2 + 9;
    fewer.remove(gone);
    let fewer = program(fewer);
    let (high, known) = found(&store, &faces, &job_of(&faces), &fewer);
    assert!(high.scallop.crests.max_mm > 3.0 * first.scallop.crests.max_mm);
    assert!(known > 0.3, "{known}");

    // A pass is raised: it leaves too much.
    let mut lifted = passes();
    let at = lifted.len() / 2 + 9;
    lifted[at].points.iter_mut().for_each(|p| p[2] += 0.03);
    let (left, known) = found(&store, &faces, &job_of(&faces), &program(lifted));
    assert!((left.contact.excess_max_mm - 0.03).abs() < 1e-6);
    assert!(known > 0.3, "{known}");

    // Something stands high above, in the way of the shank alone, and where passes end.
    let mut hung = floors();
    hung.push(upright(LONG_MM + 10.0, (-50.0, -R + 2.0), (30.0, 90.0)));
    let hung = model(hung);
    let (struck, known) = found(&store, &hung, &job_of(&hung), &moves);
    assert!(struck.shank.as_ref().unwrap().touching > 0);
    assert!(known > 0.3 && known < 1.0, "{known}");

    // The same faces in another order: places tell the faces as they are counted now.
    let turned = model(floors().into_iter().rev());
    let mut job = job_of(&turned);
    job.faces.iter_mut().for_each(|account| account.region = FACES - 1 - account.face);
    found(&store, &turned, &job, &moves);
}
