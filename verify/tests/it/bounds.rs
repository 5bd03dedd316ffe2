//! Bounds of the tool over plates, where what is kept and what is not is known.

use crate::synthetic::{self, H, R, check, job, model, program, rectangle, straight};
use claymill_nurbs::{Model, NurbsSurface, Point3, Vector3};
use claymill_toolpath::MoveKind::{Cut, LeadOut};
use claymill_toolpath::{Bounds, Contain, FolderWriter, Move, UncutReason, VERIFY_FILE};
use claymill_verify::{BoundsKept, Finding, FindingCode, Severity, SurfaceState, Verification};

const CONTAIN: [Contain; 3] = [Contain::Contact, Contain::Centre, Contain::Edge];
/// Passes keep so far inside, mm.
const INSIDE: f64 = 0.01;
/// Step-over at most that leaves the scallop height on a plane, mm.
const STEP: f64 = 1.264;

fn plate() -> NurbsSurface {
    rectangle((0.0, 80.0), (0.0, 60.0), 0.0)
}

/// Rows over a rectangle of contacts.
fn rows(x: (f64, f64), y: (f64, f64)) -> Vec<Move> {
    let steps = ((y.1 - y.0) / STEP).ceil();
    let row = |k: u32| {
        let at = y.0 + (y.1 - y.0) * f64::from(k) / steps;
        straight(Cut, k, Point3::new(x.0, at, R), Point3::new(x.1, at, R))
    };
    (0..=steps as u32).map(row).collect()
}

fn shift(m: &mut Move, axis: usize, by: f64) {
    for p in &mut m.points {
        p[axis] += by;
    }
}

fn checked(model: &Model, bounds: Bounds, moves: Vec<Move>) -> Verification {
    let mut job = job(model);
    job.request.bounds = bounds;
    check(model, &job, &program(moves))
}

fn kept(v: &Verification) -> &BoundsKept {
    v.bounds.as_ref().unwrap()
}

fn found(v: &Verification) -> Vec<&Finding> {
    v.verdict.findings.iter().filter(|f| f.code == FindingCode::OutOfBounds).collect()
}

fn area(v: &Verification, face: usize, state: SurfaceState) -> f64 {
    v.coverage.faces[face].by_state_mm2.get(&state).copied().unwrap_or(0.0)
}

/// A box over the middle of the plate, and rows over all of it that the tool may touch.
fn boxed(contain: Contain) -> (Bounds, Vec<Move>) {
    let bounds =
        Bounds { contain, within_mm: vec![[20.0, 10.0, -1.0, 60.0, 50.0, 1.0]], ..Bounds::default() };
    let inset = INSIDE + if contain == Contain::Edge { R } else { 0.0 };
    (bounds, rows((20.0 + inset, 60.0 - inset), (10.0 + inset, 50.0 - inset)))
}

#[test]
fn rows_within_a_box_pass_and_what_is_outside_of_it_is_nobodys_fault() {
    let model = model([plate()]);
    for contain in CONTAIN {
        let (bounds, rows) = boxed(contain);
        let v = checked(&model, bounds, rows.clone());
        assert!(synthetic::is_sound(&v), "{contain:?}: {:?}", v.verdict);
        assert_eq!((kept(&v).beyond, kept(&v).beyond_max_mm, &kept(&v).beyond_at), (0, 0.0, &None));
        assert!(kept(&v).samples > 20 * rows.len() as u64);
        // The ball cuts down to 1.5 scallop heights beyond its last contact.
        let beyond = (R * R - (R - 1.5 * H).powi(2)).sqrt() - INSIDE;
        let side = if contain == Contain::Edge { 20.0 } else { 40.0 } + 2.0 * beyond;
        approx::assert_relative_eq!(area(&v, 0, SurfaceState::Cut), side * side, max_relative = 0.01);
        approx::assert_relative_eq!(
            area(&v, 0, SurfaceState::OutOfBounds),
            4800.0 - side * side,
            max_relative = 0.01
        );
        assert_eq!(area(&v, 0, SurfaceState::ReachableLeft), 0.0, "{contain:?}");
    }
}

#[test]
fn what_is_left_within_bounds_is_a_defect_all_the_same() {
    let model = model([plate()]);
    for contain in CONTAIN {
        // In the middle and at the very side.
        for missing in [7, 0] {
            let (bounds, mut rows) = boxed(contain);
            rows.remove(missing);
            let v = checked(&model, bounds, rows);
            assert!(!synthetic::is_sound(&v), "{contain:?}");
            assert!(area(&v, 0, SurfaceState::ReachableLeft) > 0.3 * 20.0, "{contain:?}");
            assert_eq!(v.scallop.crests.max_mm > 1.5 * H, missing == 7, "{contain:?}");
        }
    }
}

#[test]
fn a_row_beyond_its_box_is_found() {
    let model = model([plate()]);
    for contain in CONTAIN {
        let (bounds, mut rows) = boxed(contain);
        shift(&mut rows[5], 0, 1.0);
        let v = checked(&model, bounds, rows);
        approx::assert_abs_diff_eq!(kept(&v).beyond_max_mm, 1.0 - INSIDE, epsilon = 1e-6);
        assert_eq!(kept(&v).beyond, 1);
        let at = kept(&v).beyond_at.as_ref().unwrap();
        assert_eq!((at.move_seq, at.face), (Some(5), (contain == Contain::Contact).then_some(0)));
        let end = if contain == Contain::Edge { 51.0 } else { 61.0 } - INSIDE;
        approx::assert_abs_diff_eq!(at.point_mm[0], end, epsilon = 1e-6);
        let [finding] = found(&v)[..] else { panic!("{contain:?}: {:?}", v.verdict) };
        assert!(
            finding.severity == Severity::Error && finding.message.contains("by 0.990 mm"),
            "{finding:?}"
        );
        assert_eq!(finding.place.as_ref(), Some(at));
    }
}

#[test]
fn one_box_is_enough() {
    let model = model([plate()]);
    let (mut bounds, rows) = boxed(Contain::Contact);
    bounds.within_mm = vec![[0.0, 0.0, -1.0, 80.0, 30.0, 1.0], [0.0, 29.0, -1.0, 80.0, 60.0, 1.0]];
    assert_eq!(kept(&checked(&model, bounds.clone(), rows.clone())).beyond_max_mm, 0.0);
    // No box holds all of a ball that stands over both.
    bounds.contain = Contain::Edge;
    let v = checked(&model, bounds, rows);
    approx::assert_abs_diff_eq!(kept(&v).beyond_max_mm, R - 0.5, epsilon = 0.5 * STEP);
}

#[test]
fn along_the_axis_it_is_the_contact_that_counts() {
    let model = model([plate()]);
    for contain in CONTAIN {
        let (mut bounds, rows) = boxed(contain);
        bounds.within_mm[0][2] = 0.5;
        let v = checked(&model, bounds, rows);
        approx::assert_abs_diff_eq!(kept(&v).beyond_max_mm, 0.5, epsilon = 1e-6);
        assert_eq!(area(&v, 0, SurfaceState::ReachableLeft), 0.0);
    }
}

#[test]
fn leads_may_rise_out_of_a_box_and_leave_its_sides_where_the_contact_counts() {
    let model = model([plate()]);
    for contain in CONTAIN {
        let (bounds, mut rows) = boxed(contain);
        let end = rows.last().unwrap().points.last().copied().unwrap();
        let end = Point3::new(end[0], end[1], R);
        let straight_up = straight(LeadOut, 99, end, end + Vector3::z() * 30.0);
        rows.push(straight_up);
        assert_eq!(kept(&checked(&model, bounds.clone(), rows.clone())).beyond_max_mm, 0.0, "{contain:?}");

        rows.push(straight(LeadOut, 99, end, end + Vector3::new(2.0, 0.0, 0.01)));
        let v = checked(&model, bounds, rows);
        let expected = if contain == Contain::Contact { 0.0 } else { 2.0 - INSIDE };
        approx::assert_abs_diff_eq!(kept(&v).beyond_max_mm, expected, epsilon = 1e-6);
        assert_eq!(found(&v).len(), usize::from(contain != Contain::Contact));
    }
}

#[test]
fn a_row_too_near_to_a_face_to_be_avoided_is_found() {
    // A wall behind the plate; the ball keeps 2 mm away from it.
    let wall = rectangle((0.0, 80.0), (0.0, 40.0), 0.0).mapped(|p| Point3::new(p.x, 60.0, p.y));
    let model = model([plate(), wall]);
    let bounds = Bounds { avoid: vec![1], avoid_mm: 2.0, ..Bounds::default() };
    let farthest = 60.0 - R - 2.0;
    let mut rows = rows((0.0, 80.0), (0.5, farthest - INSIDE));
    let v = checked(&model, bounds.clone(), rows.clone());
    assert!(synthetic::is_sound(&v) && found(&v).is_empty(), "{:?}", v.verdict);
    approx::assert_abs_diff_eq!(kept(&v).avoided_min_mm.unwrap(), 2.0 + INSIDE, epsilon = 1e-6);
    assert_eq!((kept(&v).too_near, kept(&v).avoid_mm), (0, Some(2.0)));
    assert_eq!(area(&v, 0, SurfaceState::ReachableLeft), 0.0);
    approx::assert_relative_eq!(area(&v, 1, SurfaceState::Excluded), 3200.0, max_relative = 1e-9);
    // Between what the ball keeps away from and what it does not fit to.
    let cut = (R * R - (R - 1.5 * H).powi(2)).sqrt();
    approx::assert_relative_eq!(
        area(&v, 0, SurfaceState::OutOfBounds),
        80.0 * (2.0 - cut),
        max_relative = 0.05
    );
    approx::assert_relative_eq!(area(&v, 0, SurfaceState::TooTight), 80.0 * R, max_relative = 0.05);

    let by = farthest + 0.5 - rows[20].points[0][1];
    shift(&mut rows[20], 1, by);
    let v = checked(&model, bounds, rows);
    approx::assert_abs_diff_eq!(kept(&v).avoided_min_mm.unwrap(), 1.5, epsilon = 1e-6);
    assert_eq!(kept(&v).too_near, 1);
    let at = kept(&v).avoided_min_at.as_ref().unwrap();
    assert_eq!((at.move_seq, at.face, at.point_mm[1]), (Some(20), Some(1), 60.0));
    let [finding] = found(&v)[..] else { panic!("{:?}", v.verdict) };
    assert!(finding.severity == Severity::Error && !synthetic::is_sound(&v));
    assert!(finding.message.contains("within 1.500 mm"), "{finding:?}");
}

#[test]
fn a_ball_that_hangs_over_the_border_is_found() {
    let model = model([plate()]);
    // Hangs over by 2 mm at its end.
    let row = |y: f64| straight(Cut, 0, Point3::new(R, y, R), Point3::new(80.0 - R + 2.0, y, R));
    let wide = vec![[-99.0, -99.0, -99.0, 99.0, 99.0, 99.0]];
    for contain in CONTAIN {
        let bounds = Bounds { contain, within_mm: wide.clone(), ..Bounds::default() };
        let v = checked(&model, bounds, vec![row(30.0), row(12.0)]);
        if contain != Contain::Edge {
            assert_eq!((kept(&v).beyond_max_mm, found(&v).len()), (0.0, 0), "{contain:?}");
            continue;
        }
        approx::assert_abs_diff_eq!(kept(&v).beyond_max_mm, 2.0, epsilon = 0.05);
        assert_eq!((kept(&v).beyond, found(&v).len()), (2, 1));
        let at = kept(&v).beyond_at.as_ref().unwrap();
        assert_eq!(at.move_seq, Some(0));
        approx::assert_abs_diff_eq!(at.point_mm[0], 72.0, epsilon = 1e-6);
    }
    let lead = straight(LeadOut, 0, Point3::new(75.0, 30.0, R + 5.0), Point3::new(82.0, 30.0, R + 9.0));
    let centre = Bounds { contain: Contain::Centre, ..Bounds::default() };
    let v = checked(&model, centre, vec![row(30.0), lead]);
    approx::assert_abs_diff_eq!(kept(&v).beyond_max_mm, 2.0, epsilon = 1e-6);
    assert_eq!((kept(&v).beyond, found(&v).len()), (1, 1));
}

#[test]
fn the_ball_stays_over_faces_that_are_cut_and_gaps_between_them_are_none() {
    // Two plates with a gap of 0.3 mm between them, and one that is left out.
    let plates = [((0.0, 40.0), (0.0, 60.0)), ((40.3, 80.0), (0.0, 60.0)), ((80.0, 120.0), (0.0, 60.0))];
    let model = model(plates.map(|(x, y)| rectangle(x, y, 0.0)));
    let mut job = job(&model);
    job.request.bounds.contain = Contain::Edge;
    let left_out = job.faces[2].area.total_mm2;
    job.faces[2].area.uncut_mm2.insert(UncutReason::Excluded, left_out);
    let whole_row = straight(Cut, 0, Point3::new(R, 30.0, R), Point3::new(70.0, 30.0, R));
    let v = check(&model, &job, &program([whole_row]));
    assert_eq!(kept(&v).beyond_max_mm, 0.0);
    // All but the row and a frame that is as wide as the ball.
    let cut = 2.0 * (R * R - (R - 1.5 * H).powi(2)).sqrt();
    let left = area(&v, 0, SurfaceState::ReachableLeft) + area(&v, 1, SurfaceState::ReachableLeft);
    approx::assert_relative_eq!(left, (60.0 - 0.3) * (40.0 - cut), max_relative = 0.01);
    approx::assert_relative_eq!(area(&v, 2, SurfaceState::Excluded), 2400.0, max_relative = 1e-9);

    let over = straight(Cut, 0, Point3::new(R, 30.0, R), Point3::new(73.0, 30.0, R));
    let v = check(&model, &job, &program([over]));
    approx::assert_abs_diff_eq!(kept(&v).beyond_max_mm, 3.0, epsilon = 0.05);
}

#[test]
fn without_bounds_nothing_is_said_of_them() {
    let model = model([plate()]);
    let v = checked(&model, Bounds::default(), rows((0.0, 80.0), (0.0, 60.0)));
    assert!(v.bounds.is_none() && synthetic::findings(&v).is_empty(), "{:?}", v.verdict);
    let folder = tempfile::tempdir().unwrap();
    let written = |name: &str, v: &Verification| {
        let writer = FolderWriter::begin(&folder.path().join(name)).unwrap();
        writer.json(VERIFY_FILE, v).unwrap();
        writer.finish().unwrap();
        std::fs::read_to_string(folder.path().join(name).join(VERIFY_FILE)).unwrap()
    };
    let plain = written("plain", &v);
    assert!(!plain.contains("bounds"), "{plain}");
    // Bounds that hold all change nothing else.
    let wide = Bounds { within_mm: vec![[-99.0, -99.0, -99.0, 99.0, 99.0, 99.0]], ..Bounds::default() };
    let mut held = checked(&model, wide, rows((0.0, 80.0), (0.0, 60.0)));
    assert!(written("held", &held).contains("\"bounds\""));
    held.bounds = None;
    assert_eq!(written("without", &held), plain);
}
