//! What the vehicle's answers claim, checked on the shuffled faces alone: nothing here uses the generator's
//! sheets or feature lines.

use std::collections::BTreeMap;

use claymill_models::{Continuity, RoadsterOptions, Sample, roadster};
use claymill_nurbs::{Face, Point3, Vector3};

/// A point of a face's boundary with the unit normal there.
struct Seat {
    point: Point3,
    normal: Vector3,
    /// Normal curvature across the edge for that normal, 1/mm.
    curvature: f64,
}

/// One of the four sides of an untrimmed face.
#[derive(Clone, Copy)]
struct Side<'a> {
    face: &'a Face,
    side: usize,
}

impl Side<'_> {
    fn all(face: &Face) -> [Side<'_>; 4] {
        [0, 1, 2, 3].map(|side| Side { face, side })
    }

    fn parameters(&self, share: f64) -> (f64, f64) {
        let ((u0, u1), (v0, v1)) = self.face.surface.domain();
        let (u, v) = (u0 + (u1 - u0) * share, v0 + (v1 - v0) * share);
        [(u, v0), (u, v1), (u0, v), (u1, v)][self.side]
    }

    fn point(&self, share: f64) -> Point3 {
        let (u, v) = self.parameters(share);
        self.face.surface.point(u, v)
    }

    fn seat(&self, share: f64) -> Seat {
        let (u, v) = self.parameters(share);
        let jet = self.face.surface.jet(u, v);
        let normal = jet.normal().expect("no face is degenerate at its boundary");
        let along = if self.side < 2 { jet.su } else { jet.sv };
        let across = normal.cross(&along).normalize();
        Seat { point: jet.p, normal, curvature: jet.normal_curvature(&across, &normal).expect("regular") }
    }

    /// How far the middle is from the ends, mm.
    fn bend(&self) -> f64 {
        (self.point(0.5) - self.point(0.0)).norm() + (self.point(0.5) - self.point(1.0)).norm()
    }

    /// Share of the side nearest to `p`, and the distance (bisection of nested samples, then Newton on
    /// differences).
    fn nearest(&self, p: &Point3) -> (f64, f64) {
        const COARSE: usize = 24;
        let distance = |s: f64| (self.point(s) - p).norm();
        let coarse = (0..=COARSE).map(|i| i as f64 / COARSE as f64);
        let start = coarse.min_by(|a, b| distance(*a).total_cmp(&distance(*b))).expect("samples");
        let step = 1.0 / COARSE as f64;
        if distance(start) > 4.0 * step * (self.point(1.0) - self.point(0.0)).norm().max(self.bend()) {
            return (start, distance(start));
        }
        let (mut low, mut high) = ((start - step).max(0.0), (start + step).min(1.0));
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        for _ in 0..14 {
            let (a, b) = (high - golden * (high - low), low + golden * (high - low));
            if distance(a) < distance(b) { high = b } else { low = a }
        }
        // Golden section stalls at the square root of the rounding error; a secant step finishes.
        let mut s = 0.5 * (low + high);
        for _ in 0..6 {
            let h = 1e-5;
            let (a, b) = ((s - h).max(0.0), (s + h).min(1.0));
            let tangent = (self.point(b) - self.point(a)) / (b - a);
            s = (s + (p - self.point(s)).dot(&tangent) / tangent.norm_squared()).clamp(0.0, 1.0);
        }
        (s, distance(s))
    }
}

/// The sides of two faces that lie on each other, with the common stretches as pairs of shares.
struct Shared<'a> {
    sides: [Side<'a>; 2],
    /// Shares on the first side.
    stretch: (f64, f64),
}

/// Where two faces meet, found from positions alone.
fn shared<'a>(a: &'a Face, b: &'a Face) -> Vec<Shared<'a>> {
    const ON: f64 = 1e-7;
    let mut found = Vec::new();
    for s in Side::all(a) {
        for t in Side::all(b) {
            let ends = [0.0, 1.0].map(|e| (e, t.nearest(&s.point(e))));
            let back = [0.0, 1.0].map(|e| s.nearest(&t.point(e)));
            let mut shares: Vec<f64> = ends.iter().filter(|(_, (_, d))| *d < ON).map(|(e, _)| *e).collect();
            shares.extend(back.iter().filter(|(_, d)| *d < ON).map(|(share, _)| *share));
            shares.sort_by(f64::total_cmp);
            let (Some(&low), Some(&high)) = (shares.first(), shares.last()) else {
                continue;
            };
            let middle = s.point(0.5 * (low + high));
            if high - low > 1e-6 && t.nearest(&middle).1 < ON {
                found.push(Shared { sides: [s, t], stretch: (low, high) });
            }
        }
    }
    found
}

struct Measured {
    gap_mm: f64,
    angle_deg: (f64, f64),
    curvature_jump: f64,
    length_mm: f64,
    /// Length over which the angle is less than 3°, mm.
    faint_mm: f64,
}

fn measure(shared: &Shared) -> Measured {
    const SAMPLES: usize = 40;
    let [a, b] = shared.sides;
    let (low, high) = shared.stretch;
    let mut m =
        Measured { gap_mm: 0.0, angle_deg: (180.0, 0.0), curvature_jump: 0.0, length_mm: 0.0, faint_mm: 0.0 };
    let mut last: Option<Point3> = None;
    for i in 0..=SAMPLES {
        let share = low + (high - low) * i as f64 / SAMPLES as f64;
        let p = a.seat(share);
        let (other, gap) = b.nearest(&p.point);
        let q = b.seat(other);
        // Neither face knows its outside: fold the angle into 0…90°.
        let sign = p.normal.dot(&q.normal).signum();
        let angle = p.normal.cross(&q.normal).norm().atan2(p.normal.dot(&q.normal).abs()).to_degrees();
        m.gap_mm = m.gap_mm.max(gap);
        m.angle_deg = (m.angle_deg.0.min(angle), m.angle_deg.1.max(angle));
        m.curvature_jump = m.curvature_jump.max((p.curvature - sign * q.curvature).abs());
        let step = last.map_or(0.0, |l| (p.point - l).norm());
        m.length_mm += step;
        m.faint_mm += if angle < 3.0 { step } else { 0.0 };
        last = Some(p.point);
    }
    m
}

fn sample(patches: usize, seed: u64) -> Sample {
    roadster(&RoadsterOptions { patches, seed })
}

fn root(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}

/// Checks every joint of a sample and that the smooth ones alone give the planted partition.
fn check(sample: &Sample) {
    let (faces, answers) = (&sample.model.faces, &sample.answers);
    let mut parent: Vec<usize> = (0..faces.len()).collect();
    let mut jumps = 0;
    let mut borders: BTreeMap<[usize; 2], (f64, f64)> = BTreeMap::new();
    let mut joints = answers.joints.iter().peekable();
    while let Some(first) = joints.next() {
        let [a, b] = first.faces;
        let mut claimed = vec![first];
        while let Some(next) = joints.next_if(|j| j.faces == [a, b]) {
            claimed.push(next);
        }
        let found = shared(&faces[a], &faces[b]);
        let mut measured: Vec<Measured> = found.iter().map(measure).collect();
        assert_eq!(measured.len(), claimed.len(), "joints between {a} and {b}");
        measured.sort_by(|m, n| m.length_mm.total_cmp(&n.length_mm));
        for (m, joint) in measured.iter().zip(claimed) {
            let place = format!("joint {a}-{b} {joint:?}");
            assert!(m.gap_mm <= 1e-9, "{place}: gap {} mm", m.gap_mm);
            assert!((m.length_mm / joint.length_mm - 1.0).abs() < 2e-2, "{place}: length {}", m.length_mm);
            match joint.class {
                Continuity::C0 => assert!(m.angle_deg.1 > 1.0, "{place}: {:?}", m.angle_deg),
                Continuity::G1 | Continuity::G2 => {
                    assert!(m.angle_deg.1.to_radians() < 1e-9, "{place}: {:?}", m.angle_deg);
                    let (ra, rb) = (root(&mut parent, a), root(&mut parent, b));
                    parent[ra] = rb;
                }
            }
            if joint.class == Continuity::C0 {
                let mut regions = [a, b].map(|face| answers.region_of_face[face]);
                regions.sort_unstable();
                let border = borders.entry(regions).or_default();
                *border = (border.0 + m.faint_mm, border.1 + m.length_mm);
            }
            if joint.class == Continuity::G2 {
                // Rounding of control points that lie millimetres apart, in second derivatives (1e-5 of what a 10 mm ball has).
                assert!(m.curvature_jump < 1e-6, "{place}: {}", m.curvature_jump);
            }
            jumps += usize::from(joint.class == Continuity::G1 && m.curvature_jump > 1e-5);
        }
    }
    assert!(
        2 * jumps > answers.totals.joints_g1,
        "{jumps} of {} G1 joints have a jump",
        answers.totals.joints_g1
    );
    // Where three panels meet along a smooth line their tangent planes agree in that one point, so a crease
    // may fade there; not farther than that.
    let name = |region: usize| answers.regions[region].name.as_str();
    let faint: Vec<_> = (borders.iter())
        .filter(|(_, (faint, length))| *faint > 0.05 * length)
        .map(|(r, lengths)| (r.map(name), lengths))
        .collect();
    assert!(faint.is_empty(), "creases under 3° along more than 5 %: {faint:?}");
    for region in &answers.regions {
        let first = root(&mut parent, region.faces[0]);
        for &face in &region.faces {
            assert_eq!(root(&mut parent, face), first, "{} is connected", region.name);
        }
    }
    let mut roots: Vec<usize> = (0..faces.len()).map(|i| root(&mut parent, i)).collect();
    roots.sort_unstable();
    roots.dedup();
    assert_eq!(roots.len(), 37);
}

#[test]
fn every_claim_about_every_joint_holds_on_the_faces() {
    check(&sample(500, 1));
    check(&sample(2000, 2));
}

#[test]
fn patch_counts_follow_the_request_and_no_crease_joint_looks_smooth() {
    let requests = [500, 5000, 20_000].map(|patches| (patches, 3));
    for (patches, seed) in requests.into_iter().chain((1..=20).map(|seed| (2000, seed))) {
        let sample = sample(patches, seed);
        let count = sample.model.faces.len();
        assert!(count.abs_diff(patches) * 10 <= patches, "{count} for {patches}");
        assert_eq!(sample.answers.regions.len(), 37);
        assert_eq!(sample.answers.totals.faces, count);
        let name = |face: usize| &sample.answers.regions[sample.answers.region_of_face[face]].name;
        for joint in sample.answers.joints.iter().filter(|j| j.class == Continuity::C0) {
            let sides = joint.faces.map(name);
            assert!(joint.angle_deg > 1.0, "{patches} patches, seed {seed}: {sides:?} {joint:?}");
        }
    }
}

#[test]
fn seeds_change_the_file_and_nothing_else_does() {
    let (a, b, c) = (sample(700, 5), sample(700, 5), sample(700, 6));
    assert_eq!(a.answers, b.answers);
    for (x, y) in a.model.faces.iter().zip(&b.model.faces) {
        assert_eq!(x.surface, y.surface);
    }
    assert_ne!(a.answers.region_of_face, c.answers.region_of_face);
}

#[test]
fn an_edit_moves_the_inside_of_one_wing_and_nothing_else() {
    let options = RoadsterOptions { patches: 500, seed: 7 };
    let (before, after) = (roadster(&options), claymill_models::roadster_edited(&options, 2.0));
    assert_eq!(before.answers.region_of_face, after.answers.region_of_face);
    let mut farthest_mm: f64 = 0.0;
    for (face, (a, b)) in before.model.faces.iter().zip(&after.model.faces).enumerate() {
        assert_eq!((a.surface.knots_u(), a.surface.knots_v()), (b.surface.knots_u(), b.surface.knots_v()));
        let moved_mm =
            a.surface.net().iter().zip(b.surface.net()).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max);
        let region = &before.answers.regions[before.answers.region_of_face[face]].name;
        assert!(moved_mm == 0.0 || region == "front wing right", "{region}: {moved_mm}");
        farthest_mm = farthest_mm.max(moved_mm);
    }
    assert!((1.5..=2.0 + 1e-9).contains(&farthest_mm), "{farthest_mm}");
    assert_eq!(before.answers.totals.joints_c0, after.answers.totals.joints_c0);
}
