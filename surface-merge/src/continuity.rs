//! How smooth a joint is, measured along its whole length.
//!
//! Two surfaces with a common edge and common normals along it are curvature-continuous exactly when their
//! normal curvatures across the edge agree everywhere on it (the linkage-curve theorem: Pegna and Wolter,
//! J. Mechanical Design 1992); one number per point decides. It is read from the second fundamental forms,
//! not from fitted section curves.

use claymill_nurbs::{Face, Model, NurbsSurface, Point3, Vector3};

use crate::edge::Edge;
use crate::joint::{Continuity, Joint, JointSample, Spread};
use crate::matching::Run;
use crate::options::{CurvatureLimit, MergeOptions};
use crate::tolerance::CURVATURE_FLOOR_PER_MM;
use crate::verdict::Verdict;

/// Normals within this angle are tangent-continuous, degrees.
const G1_DEG: f64 = 0.5;
/// Curvatures within this share of the larger one are equal.
const G2_SHARE: f64 = 0.10;

/// Gauss–Legendre nodes and weights on [-1, 1]: with 9 points for a joint of one polynomial piece.
const GAUSS_9: [(f64, f64); 9] = [
    (-0.968_160_239_507_626_1, 0.081_274_388_361_574_41),
    (-0.836_031_107_326_635_8, 0.180_648_160_694_857_4),
    (-0.613_371_432_700_590_4, 0.260_610_696_402_935_46),
    (-0.324_253_423_403_808_9, 0.312_347_077_040_002_84),
    (0.0, 0.330_239_355_001_259_8),
    (0.324_253_423_403_808_9, 0.312_347_077_040_002_84),
    (0.613_371_432_700_590_4, 0.260_610_696_402_935_46),
    (0.836_031_107_326_635_8, 0.180_648_160_694_857_4),
    (0.968_160_239_507_626_1, 0.081_274_388_361_574_41),
];
/// With 5 points for each of several pieces.
const GAUSS_5: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

/// Measures the joint that a run makes.
pub(crate) fn measure(
    model: &Model,
    edges: &[Edge<'_>],
    run: &Run,
    non_manifold: bool,
    options: &MergeOptions,
) -> Joint {
    let crossing = Crossing::new(model, &edges[run.a], &edges[run.b], run);
    let pieces = crossing.pieces(run);
    let rule: &[(f64, f64)] = if pieces.len() == 2 { &GAUSS_9 } else { &GAUSS_5 };
    let mut samples = Vec::with_capacity(rule.len() * (pieces.len() - 1));
    for piece in pieces.windows(2) {
        let (middle, half) = (0.5 * (piece[0] + piece[1]), 0.5 * (piece[1] - piece[0]));
        samples.extend(rule.iter().map(|(x, w)| crossing.sample(middle + half * x, w * half)));
    }
    let half_way = 0.5 * (crossing.a.arc_length(run.on_a[0]) + crossing.a.arc_length(run.on_a[1]));
    let mid = crossing.sample(crossing.a.at_length(half_way), 0.0);
    let floor = curvature_floor(model, run.a, edges).max(curvature_floor(model, run.b, edges));
    let (radius, speed) = (options.ball_radius_mm, options.feed_mm_per_min / 60.0);
    let (mut machining_limit, mut relative_limit) = (None, None);
    match options.low.curvature {
        CurvatureLimit::Any => {}
        CurvatureLimit::Machining(limit) => machining_limit = Some(limit),
        CurvatureLimit::Relative(limit) => relative_limit = Some(limit),
    }
    let spread =
        |limit: Option<f64>, value: &dyn Fn(&JointSample) -> f64| Spread::of(&samples, &mid, limit, value);
    Joint {
        sides: [crossing.a.stretch(run.on_a), crossing.b.stretch(run.on_b)],
        length_mm: samples.iter().map(|s| s.length_mm).sum(),
        continuity: classify(&samples, floor),
        gap_normal_mm: spread(Some(options.low.gap_normal_mm), &|s| s.gap_normal_mm),
        gap_lateral_mm: spread(Some(options.low.gap_lateral_mm), &|s| s.gap_lateral_mm),
        angle_deg: spread(Some(options.low.angle_deg), &|s| s.angle_deg.abs()),
        curvature_machining: spread(machining_limit, &|s| radius * s.curvature_jump_per_mm()),
        curvature_relative: spread(relative_limit, &|s| s.curvature_relative(floor)),
        acceleration_jump: spread(None, &|s| speed * speed * s.curvature_jump_per_mm()),
        curvature_floor_per_mm: floor,
        normals_agree: crossing.same_side > 0.0,
        non_manifold,
        ends: [crossing.a.points(run.on_a), crossing.b.points(run.on_b)],
        mid,
        samples,
        // Growing decides.
        verdict: Verdict::Merged,
        why: String::new(),
        outdone: false,
        failing: None,
        regions_if_merged: None,
    }
}

fn classify(samples: &[JointSample], floor_per_mm: f64) -> Continuity {
    let tangent = samples.iter().all(|s| s.angle_deg.abs() <= G1_DEG);
    let curvature = |s: &JointSample| {
        let larger = s.curvature_per_mm.map_or(0.0, |[a, b]| a.abs().max(b.abs()));
        s.curvature_jump_per_mm() <= (G2_SHARE * larger).max(floor_per_mm)
    };
    match (tangent, samples.iter().all(curvature)) {
        (false, _) => Continuity::C0,
        (true, false) => Continuity::G1,
        (true, true) => Continuity::G2,
    }
}

/// Everything needed to measure across a joint at any parameter of its first edge.
struct Crossing<'e, 'm> {
    a: &'e Edge<'m>,
    b: &'e Edge<'m>,
    /// 1 or -1: the first face lies left or right of its edge, seen along `Su × Sv`.
    left: f64,
    /// 1 or -1: the edges run with or against each other.
    heading: f64,
    /// 1 or -1: `Su × Sv` of the second face points to the same side of the joined surface, or not.
    same_side: f64,
    /// 1 or -1: `Su × Sv` of the first face points to its outside, or not.
    outside: f64,
}

impl<'e, 'm> Crossing<'e, 'm> {
    fn new(model: &Model, a: &'e Edge<'m>, b: &'e Edge<'m>, run: &Run) -> Self {
        let sign = |positive: bool| if positive { 1.0 } else { -1.0 };
        let heading = sign((run.on_a[1] - run.on_a[0]) * (run.on_b[1] - run.on_b[0]) > 0.0);
        let (left, other_left) = (sign(a.inside_left), sign(b.inside_left));
        // Walking along the joint with one face on the left, the surface goes on smoothly on the right: two
        // faces whose boundaries run against each other, both on their left, have normals on one side.
        let same_side = -left * other_left * heading;
        let outside = sign(!model.faces[a.face].reversed);
        Crossing { a, b, left, heading, same_side, outside }
    }

    /// Parameters of the first edge where the joint's polynomial pieces meet, ends included.
    fn pieces(&self, run: &Run) -> Vec<f64> {
        let [from, to] = run.on_a;
        let (low, high) = (run.on_b[0].min(run.on_b[1]), run.on_b[0].max(run.on_b[1]));
        let own = self.a.breaks.iter().copied();
        let inside_b = self.b.breaks.iter().copied().filter(|&t| t > low && t < high);
        let opposite = inside_b.map(|t| self.a.foot(&Point3::from(self.b.lift(t)[0])).t);
        let sliver = 1e-4 * (to - from);
        let mut cuts: Vec<f64> = own.chain(opposite).collect();
        cuts.retain(|&t| t > from + sliver && t < to - sliver);
        cuts.sort_by(f64::total_cmp);
        cuts.dedup_by(|later, earlier| *later - *earlier < sliver);
        cuts.insert(0, from);
        cuts.push(to);
        cuts
    }

    /// Measures at parameter `ta` of the first edge; `dt` is the stretch of parameter it stands for.
    fn sample(&self, ta: f64, dt: f64) -> JointSample {
        let [pa, va, _] = self.a.lift(ta);
        let foot = self.b.foot(&Point3::from(pa));
        let along = (va.normalize() + foot.velocity.normalize() * self.heading).normalize();
        let (ja, na) = frame(self.a, ta);
        let (jb, nb) = frame(self.b, foot.t);
        let point = Point3::from(pa);
        let length_mm = va.norm() * dt;
        let gap = foot.point - point;
        let (Some((na, soft_a)), Some((nb, soft_b))) = (na, nb) else {
            return JointSample {
                point,
                length_mm,
                gap_normal_mm: gap.norm(),
                gap_lateral_mm: 0.0,
                angle_deg: 0.0,
                curvature_per_mm: None,
            };
        };
        let nb = nb * self.same_side;
        let mean = (na + nb).try_normalize(1e-9).unwrap_or(na);
        let gap_normal_mm = gap.dot(&mean).abs();
        // Directions across the edge, from the first face into the second, in either tangent plane.
        let (across_a, across_b) = (along.cross(&na) * self.left, along.cross(&nb) * self.left);
        let angle = na.cross(&nb).norm().atan2(na.dot(&nb)).to_degrees();
        let side = if across_b.dot(&na) * self.outside < 0.0 { -1.0 } else { 1.0 };
        let curvature_per_mm = match (soft_a || soft_b, ja, jb) {
            (false, ja, jb) => ja
                .normal_curvature(&across_a, &(na * self.outside))
                .zip(jb.normal_curvature(&across_b, &(nb * self.outside)))
                .map(|(a, b)| [a, b]),
            _ => None,
        };
        JointSample {
            point,
            length_mm,
            gap_normal_mm,
            gap_lateral_mm: (gap.norm_squared() - gap_normal_mm * gap_normal_mm).max(0.0).sqrt(),
            angle_deg: angle * side,
            curvature_per_mm,
        }
    }
}

type Normal = Option<(Vector3, bool)>;

fn frame(edge: &Edge<'_>, t: f64) -> (claymill_nurbs::Jet, Normal) {
    let c = edge.pcurve.point(t);
    let jet = edge.surface.jet(c.x, c.y);
    let normal = jet.normal().map(|n| (n, false)).or_else(|| edge.surface.normal(c.x, c.y));
    (jet, normal)
}

/// The smallest curvature difference that means anything on a face: second differences of control points
/// rounded to the file's last digit.
fn curvature_floor(model: &Model, edge: usize, edges: &[Edge<'_>]) -> f64 {
    let Face { surface, .. } = &model.faces[edges[edge].face];
    let (across_u, across_v) = control_spacing(surface);
    let floor = |degree: usize, spacing: f64| {
        let p = degree as f64;
        4.0 * (p - 1.0) / p * model.coordinate_step_mm / (spacing * spacing)
    };
    let rounding =
        floor(surface.knots_u().degree(), across_u).max(floor(surface.knots_v().degree(), across_v));
    if rounding.is_finite() { rounding.max(CURVATURE_FLOOR_PER_MM) } else { CURVATURE_FLOOR_PER_MM }
}

/// Mean distance of control points along `u` and along `v`, mm.
fn control_spacing(surface: &NurbsSurface) -> (f64, f64) {
    let (rows, columns) = surface.size();
    let apart = |a: (usize, usize), b: (usize, usize)| {
        (surface.control_point(a.0, a.1) - surface.control_point(b.0, b.1)).norm()
    };
    let (i, j) = (rows / 2, columns / 2);
    let along_u: f64 = (1..rows).map(|k| apart((k, j), (k - 1, j))).sum();
    let along_v: f64 = (1..columns).map(|k| apart((i, k), (i, k - 1))).sum();
    (along_u / (rows - 1) as f64, along_v / (columns - 1) as f64)
}
