//! Step-over of a flat or bull-nosed end, whose axis is that of the setup (docs/theory.md §4.4).
//!
//! ```text
//!        seen along the feed, the disc is an ellipse, and the tool that swollen by its corner
//!      ╲    ╱╲    ╱
//!       ╲__╱  ╲__╱      h     both sides of it, as wide as they are a scallop height above the ground
//!     ──────────────
//! ```

use claymill_contact::EndShape;
use claymill_nurbs::{Jet, Vector3};
use nalgebra::{Matrix2, Vector2};

use crate::RowsAlong;
use crate::pattern::step_over::flat_mm;

/// Ground that leans by less than this (sine) is level: the disc touches nearly all over.
const LEVEL: f64 = 1e-4;
/// Rows of an end overlap by this share of its radius where nothing else asks for more: the sharp rim of a flat one would
/// leave what lies exactly between.
const OVERLAP: f64 = 0.05;
/// A valley nearly as tight as the tool asks for rows ever closer together; below this share of what a ball as large needs on
/// a plane nothing is gained.
const CLOSEST: f64 = 0.1;

/// A tool in contact with the ground: tangent coordinates along the fall line of the ground (uphill) and along its contour.
#[derive(Debug, Clone, Copy)]
struct Touching {
    end: EndShape,
    uphill: Vector3,
    contour: Vector3,
    normal: Vector3,
    /// Radii of curvature of the tool there, uphill and along the contour.
    radii: Matrix2<f64>,
    /// Second form of the ground, a valley positive, 1/mm.
    ground: Matrix2<f64>,
}

impl Touching {
    fn new(jet: &Jet, end: &EndShape) -> Option<Self> {
        let n = jet.normal()?;
        let normal = if n.z < 0.0 { -n } else { n };
        let sine = normal.x.hypot(normal.y);
        let contour = Vector3::z().cross(&normal).try_normalize(1e-12).unwrap_or_else(Vector3::x);
        let uphill = normal.cross(&contour);
        let forms = jet.curvature(&normal).second;
        let at = [uphill, contour].map(|w| jet.tangent_coordinates(&w));
        let [a, b] = [at[0]?, at[1]?];
        let form = |p: &Vector2<f64>, q: &Vector2<f64>| p.dot(&(forms * q));
        let ground = Matrix2::new(form(&a, &a), form(&a, &b), form(&a, &b), form(&b, &b));
        let radii = Matrix2::new(end.corner_mm, 0.0, 0.0, end.corner_mm + end.flat_mm / sine.max(LEVEL));
        Some(Touching { end: *end, uphill, contour, normal, radii, ground })
    }

    /// A tangent vector in these coordinates.
    fn flat(&self, w: &Vector3) -> Vector2<f64> {
        Vector2::new(w.dot(&self.uphill), w.dot(&self.contour))
    }

    /// How far the tool is, seen along the feed, from its contact: along the ground to the side of `across`, and away from it,
    /// where its outline leans by `angle` (negative on the other side).
    fn outline(&self, across: &Vector3, angle: f64) -> [f64; 2] {
        let EndShape { flat_mm, corner_mm } = self.end;
        // Its support function is corner + flat·√(1 − v_z²) in the direction v, its outline the gradient of that.
        let support = |angle: f64| {
            let (sine, cosine) = angle.sin_cos();
            let v = across * sine - self.normal * cosine;
            let turned = across * cosine + self.normal * sine;
            let flat = v.x.hypot(v.y);
            let slope = if flat > 0.0 { -v.z * turned.z / flat } else { 0.0 };
            (v, turned, corner_mm + flat_mm * flat, flat_mm * slope)
        };
        let place = |angle: f64| {
            let (v, turned, out, slope) = support(angle);
            let p = v * out + turned * slope;
            [p.dot(across), p.dot(&self.normal)]
        };
        let ([x, y], [x0, y0]) = (place(angle), place(0.0));
        [x - x0, y - y0]
    }

    /// How wide the tool is at a height over ground that bends by `valley` (1/mm) across the feed, along that ground.
    fn width_mm(&self, across: &Vector3, height_mm: f64, valley: f64) -> f64 {
        let side = |way: f64| {
            let over = |angle: f64| {
                let [x, y] = self.outline(across, way * angle);
                // Over the circle that the ground is there, and where on it.
                let away = (1.0 - valley * y).hypot(valley * x);
                let gap = (2.0 * y - valley * (x * x + y * y)) / (1.0 + away);
                let turn = (valley * x.abs()).atan2(1.0 - valley * y);
                (gap, if turn == 0.0 { x.abs() } else { turn / valley })
            };
            // Above where the outline is upright the tool's side goes on along the axis.
            let lean = way * across.z;
            let upright = if lean > 0.0 { self.normal.z.atan2(lean) } else { std::f64::consts::FRAC_PI_2 };
            let (mut low, mut high) = (0.0, upright);
            for _ in 0..STEPS {
                let middle = 0.5 * (low + high);
                *if over(middle).0 < height_mm { &mut low } else { &mut high } = middle;
            }
            let ((gap, beside), (next_gap, next)) = (over(low), over(high));
            let missing = height_mm - gap;
            match () {
                // A straight piece of the outline, as that of a flat end is, has one angle.
                () if next_gap >= height_mm && next_gap > gap => {
                    beside + (next - beside) * missing / (next_gap - gap)
                }
                () if next_gap < height_mm => next + (height_mm - next_gap) * lean.max(0.0) / self.normal.z,
                () => beside,
            }
        };
        side(1.0) + side(-1.0)
    }
}

/// Halvings of a right angle until nothing is left to be known.
const STEPS: usize = 50;

/// The widest step-over that an end has, that on level ground, mm.
pub(crate) fn widest_mm(end: &EndShape, scallop_mm: f64) -> f64 {
    let corner = 2.0 * end.corner_mm * scallop_mm - scallop_mm * scallop_mm;
    (2.0 * (end.flat_mm + corner.max(0.0).sqrt())).min((2.0 - OVERLAP) * end.radius_mm())
}

/// Distance of parallel rows of an end, in the setup's horizontal plane, that keeps the scallop height at this point of a
/// surface given in setup coordinates.
///
/// With P the tool's radii of curvature and S the surface's second form, the contact moves by `(1 − P·S)⁻¹` of what the tool
/// moves, and tools that move along `m`, side by side at the distance `d`, leave `d² / 8(wPw − Pw·S·Pw)` between
/// them, `w` across `m`. What that comes to as a bend of the ground across the contacts gives the exact width of the tool.
pub(crate) fn row_distance_mm(jet: &Jet, along: RowsAlong, end: &EndShape, scallop_mm: f64) -> Option<f64> {
    let touching = Touching::new(jet, end)?;
    let [ex, ey] = along.unit();
    let plane = Vector3::new(-ey, ex, 0.0);
    let feed = plane.cross(&touching.normal);
    let sine = feed.norm();
    let feed = feed / sine;
    let across = touching.normal.cross(&feed);
    let (m, w) = (touching.flat(&feed), touching.flat(&across));
    let (radii, ground) = (touching.radii, touching.ground);
    let (across_radius, pw) = (w.dot(&(radii * w)), radii * w);
    let square = across_radius - pw.dot(&(ground * pw));
    // adj(A) = tr(A) − A: how much the contacts are closer together than the tools.
    let shift = Matrix2::identity() - radii * ground;
    let spread = ((Matrix2::identity() * shift.trace() - shift) * m).norm();
    let closest = CLOSEST * flat_mm(end.radius_mm(), scallop_mm);
    let fits = shift.determinant() > 0.0 && square > 0.0 && spread > 0.0;
    let step = if fits {
        let valley = 1.0 / across_radius - spread * spread / square;
        touching.width_mm(&across, scallop_mm, valley) * spread
    } else if across_radius > 0.0 {
        closest
    } else {
        // A sharp rim that goes along the contour: what it leaves does not depend on how the ground bends.
        touching.width_mm(&across, scallop_mm, 0.0)
    };
    let distance = step.min(widest_mm(end, scallop_mm)) * sine;
    (distance.is_finite() && distance > 0.0).then_some(distance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    const BULL: EndShape = EndShape { flat_mm: 8.0, corner_mm: 2.0 };
    const FLAT: EndShape = EndShape { flat_mm: 10.0, corner_mm: 0.0 };
    const H: f64 = 0.02;

    #[test]
    fn effective_radii_are_those_of_the_reference() {
        for (slope_deg, bull, flat) in [
            (1.0, 460.389_507_988, 572.986_884_986),
            (3.0, 154.858_580_874, 191.073_226_093),
            (5.0, 93.789_705_965, 114.737_132_457),
            (10.0, 48.070_163_865, 57.587_704_831),
            (15.0, 32.909_626_441, 38.637_033_052),
            (30.0, 18.0, 20.0),
        ] {
            assert_abs_diff_eq!(effective_radius_mm(&BULL, slope_deg, 0.0), bull, epsilon = 1e-8);
            assert_abs_diff_eq!(effective_radius_mm(&FLAT, slope_deg, 0.0), flat, epsilon = 1e-8);
            assert_abs_diff_eq!(effective_radius_mm(&BULL, slope_deg, 90.0), 2.0, epsilon = 1e-8);
        }
    }

    #[test]
    fn steps_on_a_plane_are_those_of_the_reference() {
        for (slope_deg, bull, flat) in [
            (3.0, 4.919_463_257, 5.476_090_990),
            (5.0, 3.847_116_002, 4.259_965_661),
            (10.0, 2.764_115_340, 3.026_709_645),
            (15.0, 2.289_764_240, 2.481_539_877),
            (30.0, 1.695_327_378, 1.787_064_632),
        ] {
            assert_abs_diff_eq!(plane_step_mm(&BULL, slope_deg, 0.0, H), bull, epsilon = 1e-8);
            assert_abs_diff_eq!(plane_step_mm(&FLAT, slope_deg, 0.0, H), flat, epsilon = 1e-8);
        }
        // On the level both lie flat; along the contour of a slope a sharp rim leaves stairs.
        let level = 2.0 * (8.0 + (2.0 * 2.0 * H - H * H).sqrt());
        assert_abs_diff_eq!(plane_step_mm(&BULL, 0.0, 0.0, H), level, epsilon = 1e-8);
        assert_abs_diff_eq!(plane_step_mm(&FLAT, 0.0, 0.0, H), 20.0, epsilon = 1e-8);
        let stairs = H / (20f64.to_radians().sin() * 20f64.to_radians().cos());
        assert_abs_diff_eq!(plane_step_mm(&FLAT, 20.0, 90.0, H), stairs, epsilon = 1e-8);
    }

    /// An end in contact with a plane that leans by `slope_deg`, and the direction across rows that lean by `from_fall_deg` from
    /// its fall line.
    fn on_plane(end: &EndShape, slope_deg: f64, from_fall_deg: f64) -> (Touching, Vector3) {
        let jet = leaning(0.0, slope_deg);
        let turn = from_fall_deg.to_radians();
        let feed = jet.su * turn.cos() + jet.sv * turn.sin();
        let touching = Touching::new(&jet, end).unwrap();
        (touching, touching.normal.cross(&feed))
    }

    /// Radius of the ball that leaves the same between narrow rows on that plane, mm.
    fn effective_radius_mm(end: &EndShape, slope_deg: f64, from_fall_deg: f64) -> f64 {
        let (touching, across) = on_plane(end, slope_deg, from_fall_deg);
        let w = touching.flat(&across);
        w.dot(&(touching.radii * w))
    }

    /// Step-over on that plane, mm.
    fn plane_step_mm(end: &EndShape, slope_deg: f64, from_fall_deg: f64, scallop_mm: f64) -> f64 {
        let (touching, across) = on_plane(end, slope_deg, from_fall_deg);
        touching.width_mm(&across, scallop_mm, 0.0)
    }

    /// A cylinder that leans, its axis along the fall line, in contact where the ground leans by `slope_deg` along the feed.
    fn leaning(bend: f64, slope_deg: f64) -> Jet {
        let (sine, cosine) = slope_deg.to_radians().sin_cos();
        let (n, uphill) = (Vector3::new(-sine, 0.0, cosine), Vector3::new(cosine, 0.0, sine));
        let zero = Vector3::zeros();
        let p = claymill_nurbs::Point3::origin();
        Jet { p, su: uphill, sv: Vector3::y(), suu: zero, suv: zero, svv: n * bend }
    }

    #[test]
    fn widths_in_valleys_and_over_ridges_are_those_of_the_reference() {
        for (bend, slope_deg, width) in [
            (1.0 / 60.0, 9.0, 7.226_769_448),
            (1.0 / 60.0, 10.0, 5.802_598_208),
            (1.0 / 60.0, 15.0, 3.382_432_734),
            (-1.0 / 60.0, 3.0, 2.627_556_301),
            (-1.0 / 60.0, 5.0, 2.416_613_960),
            (-1.0 / 60.0, 10.0, 2.063_845_629),
        ] {
            let touching = Touching::new(&leaning(bend, slope_deg), &BULL).unwrap();
            let found = touching.width_mm(&Vector3::y(), H, bend);
            assert_abs_diff_eq!(found, width, epsilon = 1e-8);
        }
    }

    #[test]
    fn rows_over_a_leaning_cylinder_are_as_far_apart_as_its_width_moves_the_tool() {
        // Across the cylinder the tool moves by 1 − ρκ of its contact, ρ its radius of curvature there.
        for (bend, slope_deg, width) in [(1.0 / 60.0, 10.0, 5.802_598_208), (-1.0 / 60.0, 5.0, 2.416_613_960)]
        {
            let found = row_distance_mm(&leaning(bend, slope_deg), RowsAlong::X, &BULL, H).unwrap();
            let moves = 1.0 - effective_radius_mm(&BULL, slope_deg, 0.0) * bend;
            assert_abs_diff_eq!(found, width * moves, epsilon = 1e-7);
        }
    }

    #[test]
    fn a_ball_has_the_steps_of_a_ball() {
        let ball = EndShape::ball(10.0);
        for turn_deg in [0.0, 30.0, 90.0] {
            let step = plane_step_mm(&ball, 20.0, turn_deg, H);
            assert_abs_diff_eq!(step, flat_mm(10.0, H), epsilon = 1e-8);
        }
    }
}
