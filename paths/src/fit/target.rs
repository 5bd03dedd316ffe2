//! The lifted path that a fit follows, by arc length. It gives the first knots, corners that lie
//! above both neighbours, and places where the curvature jumps.

use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::round_to_written;
use nalgebra::{MatrixXx3, SVector};

use crate::fit::refit::{LONGEST_SPAN_MM, Over};
use crate::follow::profile::{Profile, Sample, step_to};

/// Fewer tangents than this do not tell a jump of curvature from a bend.
const LEAST_TANGENTS: usize = 6;
/// A jump is believed where it explains the tangents better than a bend at the same place, by this factor.
const SHARPER: f64 = 1.4;
/// So far beyond both ends of a span its tangents are taken, and a jump is looked for, in spans.
const BEYOND: f64 = 0.25;
const LOOKED: f64 = 0.15;
/// And first at so many places.
const PLACES: usize = 24;
/// Below this share of what it is taken from, what is left is nothing but rounding.
const FEWEST: f64 = 1e-9;

/// Stretches whose ends are further apart than this do not meet, mm; with a smaller sine² between what lifts them they
/// are parallel.
const FARTHEST_MM: f64 = 0.05;
const FLATTEST: f64 = 1e-4;

/// The biased path by arc length: position and unit tangent.
pub(crate) struct Target {
    t: Vec<f64>,
    p: Vec<Point3>,
    tangent: Vec<Vector3>,
    /// How near to it a fit is to come.
    aim_mm: f64,
}

/// Where two stretches meet at a corner: the place that lies above both by the bias.
pub(crate) fn corner(before: &Profile, after: &Profile, over: &Over) -> Option<Point3> {
    let Over { drive, tolerance, .. } = over;
    let ends = [before.end(), after.start()];
    let [a, b] = ends.map(|q| {
        let [x, y] = drive.at(q.s);
        Point3::new(x, y, q.z)
    });
    let [up, lean] = ends.map(|q| drive.lift(q.s, q.slope));
    let halfway = nalgebra::center(&a, &b);
    let cos = up.dot(&lean);
    let lacks = [tolerance.bias_mm - (halfway - a).dot(&up), tolerance.bias_mm - (halfway - b).dot(&lean)];
    let sin2 = 1.0 - cos * cos;
    let (along_up, along_lean) = if sin2 < FLATTEST {
        let share = 0.5 * lacks[0].max(lacks[1]);
        (share, share)
    } else {
        ((lacks[0] - cos * lacks[1]) / sin2, (lacks[1] - cos * lacks[0]) / sin2)
    };
    let place = halfway + up * along_up + lean * along_lean;
    ((place - halfway).norm() < FARTHEST_MM && (b - a).norm() < FARTHEST_MM).then_some(place)
}

/// Puts the first place in a corner, from which the tangents lead in the given `way`. That of a valley is a little before
/// the place above the deepest one: what is behind it is left out.
fn begin_at(corner: Option<Point3>, p: &mut Vec<Point3>, tangent: &mut Vec<Vector3>, way: f64) {
    let Some(corner) = corner else { return };
    p[0] = corner;
    let behind = |i: &usize| way * (p[*i] - corner).dot(&tangent[0]) <= 0.0;
    let left_out = 1..1 + (1..p.len() - 1).take_while(behind).count();
    p.drain(left_out.clone());
    tangent.drain(left_out);
}

impl Target {
    /// Over a profile that ends at `corners`, where it does (see [`corner`]).
    pub(crate) fn new(profile: &Profile, corners: [Option<Point3>; 2], over: &Over) -> Self {
        let Over { drive, tolerance, .. } = over;
        let biased = |q: &Sample| {
            let [x, y] = drive.at(q.s);
            Point3::new(x, y, q.z) + drive.lift(q.s, q.slope) * tolerance.bias_mm
        };
        let mut p: Vec<Point3> = profile.samples.iter().map(biased).collect();
        let along = |q: &Sample| {
            let [ex, ey] = drive.direction(q.s);
            Vector3::new(ex, ey, q.slope).normalize()
        };
        let mut tangent: Vec<Vector3> = profile.samples.iter().map(along).collect();
        begin_at(corners[0], &mut p, &mut tangent, 1.0);
        p.reverse();
        tangent.reverse();
        begin_at(corners[1], &mut p, &mut tangent, -1.0);
        p.reverse();
        tangent.reverse();
        let mut t = vec![0.0; p.len()];
        for i in 1..p.len() {
            t[i] = t[i - 1] + (p[i] - p[i - 1]).dot(&(tangent[i - 1] + tangent[i]).normalize()).max(0.0);
        }
        Target { t, p, tangent, aim_mm: tolerance.aim_mm() }
    }

    pub(crate) fn length(&self) -> f64 {
        self.t[self.t.len() - 1]
    }

    pub(crate) fn ends(&self) -> (Point3, Point3) {
        (self.p[0], self.p[self.p.len() - 1])
    }

    /// Position by cubic Hermite interpolation in arc length; looked for from the place `near`, which becomes the one
    /// before `t`.
    pub(crate) fn at(&self, t: f64, near: &mut usize) -> Point3 {
        *near = step_to(*near, self.t.len(), |i| self.t[i] <= t);
        let i = *near + 1;
        let h = self.t[i] - self.t[i - 1];
        if h <= 0.0 {
            return self.p[i];
        }
        let x = (t - self.t[i - 1]) / h;
        let (x2, x3) = (x * x, x * x * x);
        let tangent = |k: usize| self.tangent[k] * h;
        Point3::from(
            self.p[i - 1].coords * (2.0 * x3 - 3.0 * x2 + 1.0)
                + tangent(i - 1) * (x3 - 2.0 * x2 + x)
                + self.p[i].coords * (3.0 * x2 - 2.0 * x3)
                + tangent(i) * (x3 - x2),
        )
    }

    fn tangent_at(&self, t: f64) -> Vector3 {
        let i = self.t.partition_point(|&k| k <= t).clamp(1, self.t.len() - 1);
        let h = self.t[i] - self.t[i - 1];
        let x = if h > 0.0 { (t - self.t[i - 1]) / h } else { 0.0 };
        self.tangent[i - 1] * (1.0 - x) + self.tangent[i] * x
    }

    /// First knots: spans of length `(384 ε / |f⁗|)^¼` (docs/theory.md §7.2), with `f⁗` from third
    /// differences of the tangent.
    pub(crate) fn first_breaks(&self, length: f64) -> Vec<f64> {
        let cells = ((length / 2.0).ceil() as usize).clamp(4, 4000);
        let step = (length / 8.0).min(4.0);
        let mut sums = vec![0.0];
        for i in 0..cells {
            let t = (i as f64 + 0.5) / cells as f64 * length;
            let middle = t.clamp(1.5 * step, length - 1.5 * step);
            let a = [-1.5, -0.5, 0.5, 1.5].map(|k| self.tangent_at(middle + k * step));
            let fourth = (a[3] - a[2] * 3.0 + a[1] * 3.0 - a[0]).norm() / step.powi(3);
            let density = (fourth / (384.0 * self.aim_mm)).powf(0.25).max(1.0 / LONGEST_SPAN_MM);
            sums.push(sums[i] + density * length / cells as f64);
        }
        let total = sums[cells];
        let spans = total.ceil().max(1.0);
        let mut breaks = vec![0.0];
        for k in 1..spans as usize {
            let wanted = total * k as f64 / spans;
            let i = sums.partition_point(|&v| v <= wanted).clamp(1, cells);
            let x = (wanted - sums[i - 1]) / (sums[i] - sums[i - 1]);
            breaks.push(round_to_written((i as f64 - 1.0 + x) / cells as f64 * length));
        }
        breaks.push(length);
        breaks.dedup_by(|b, a| *b - *a < 0.01);
        breaks
    }

    /// Where in a span or just beside it the curvature jumps, if it does: there the tangents bend like a hinge between two parabolas.
    pub(crate) fn jump(&self, [from, to]: [f64; 2]) -> Option<f64> {
        let beyond = BEYOND * (to - from);
        let first = self.t.partition_point(|&t| t < from - beyond);
        let last = self.t.partition_point(|&t| t <= to + beyond);
        if last < first + LEAST_TANGENTS {
            return None;
        }
        let (middle, width) = (0.5 * (from + to), to - from);
        let x = self.t[first..last].iter().map(|t| (t - middle) / width).collect();
        let hinge = Hinge::new(x, &self.tangent[first..last])?;
        let (at, sharp) = hinge.best(1);
        let (_, smooth) = hinge.best(2);
        (sharp * SHARPER * SHARPER < smooth).then_some(middle + at * width)
    }
}

/// Tangents over a span, to be explained by `a + b·x + c·x² + d·max(x − at, 0)^power`.
///
/// What the parabola explains is taken out first. Of the rest the hinge explains `(r·g)² / (g·g − Σ(q·g)²)`, `g` being its
/// values, `r` the rest and `q` what parabolas span; sums from the right end give all of these at once for any place.
struct Hinge {
    /// Where the tangents are, in shares of the span from its middle.
    x: Vec<f64>,
    /// From each tangent on: sums of the powers of `x`.
    powers: Vec<[f64; 5]>,
    /// And of `q` and `r`, each times 1, `x` and `x²`.
    products: Vec<[SVector<f64, 6>; 3]>,
    /// Sum of squares that the parabola leaves.
    left: f64,
}

impl Hinge {
    fn new(x: Vec<f64>, tangents: &[Vector3]) -> Option<Self> {
        let qr = MatrixXx3::from_fn(x.len(), |i, power| x[i].powi(power as i32)).qr();
        let (q, r) = (qr.q(), qr.r());
        if (0..3).any(|k| r[(k, k)].abs() < FEWEST) {
            return None;
        }
        let explained: [Vector3; 3] =
            [0, 1, 2].map(|k| q.column(k).iter().zip(tangents).map(|(&q, t)| t * q).sum());
        let (mut powers, mut products, mut left) = (vec![[0.0; 5]], vec![[SVector::zeros(); 3]], 0.0);
        for i in (0..x.len()).rev() {
            let own = [0, 1, 2].map(|k| q[(i, k)]);
            let rest = tangents[i] - (0..3).map(|k| explained[k] * own[k]).sum::<Vector3>();
            left += rest.norm_squared();
            let both = SVector::from([own[0], own[1], own[2], rest.x, rest.y, rest.z]);
            let (mut power, mut product) = (powers[powers.len() - 1], products[products.len() - 1]);
            (0..5).for_each(|k| power[k] += x[i].powi(k as i32));
            (0..3).for_each(|k| product[k] += both * x[i].powi(k as i32));
            powers.push(power);
            products.push(product);
        }
        powers.reverse();
        products.reverse();
        Some(Hinge { x, powers, products, left })
    }

    /// The best place in the span, and the sum of squares that it leaves.
    fn best(&self, power: usize) -> (f64, f64) {
        let left = |at: f64| self.left(at, power);
        let places = (0..=PLACES).map(|k| (1.0 + 2.0 * LOOKED) * k as f64 / PLACES as f64 - LOOKED - 0.5);
        let (mut at, mut least) = places
            .map(|at| (at, left(at)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap_or((0.0, f64::INFINITY));
        let mut step = 0.5 / PLACES as f64;
        while step > 1e-3 {
            for near in [at - step, at + step] {
                let sum = left(near);
                if sum < least {
                    (at, least) = (near, sum);
                }
            }
            step *= 0.5;
        }
        (at, least)
    }

    fn left(&self, at: f64, power: usize) -> f64 {
        let from = self.x.partition_point(|&x| x <= at);
        let (sums, products) = (&self.powers[from], &self.products[from]);
        // (x − at)^power and its square, as factors of the powers of x.
        let (hinge, square): ([f64; 3], [f64; 5]) = if power == 1 {
            ([-at, 1.0, 0.0], [at * at, -2.0 * at, 1.0, 0.0, 0.0])
        } else {
            let a2 = at * at;
            ([a2, -2.0 * at, 1.0], [a2 * a2, -4.0 * a2 * at, 6.0 * a2, -4.0 * at, 1.0])
        };
        let along: SVector<f64, 6> = (0..3).map(|k| products[k] * hinge[k]).sum();
        let whole: f64 = (0..5).map(|k| sums[k] * square[k]).sum();
        let own = whole - along.fixed_rows::<3>(0).norm_squared();
        if own <= FEWEST * whole {
            return self.left;
        }
        self.left - along.fixed_rows::<3>(3).norm_squared() / own
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, Matrix3xX};

    use super::*;

    #[test]
    fn a_hinge_leaves_what_least_squares_leave() {
        let x: Vec<f64> = (0..60).map(|k| -0.7 + 1.4 * (f64::from(k) / 59.0).powf(1.2)).collect();
        let bend = |x: f64| Vector3::new(1.0, 0.3 * x * x + (x - 0.11).max(0.0), 0.1 * x.powi(3) - 0.2 * x);
        let tangents: Vec<Vector3> = x.iter().map(|&x| bend(x)).collect();
        let hinge = Hinge::new(x.clone(), &tangents).unwrap();
        let right = Matrix3xX::from_columns(&tangents).transpose();
        for power in [1, 2] {
            for at in (0..=24).map(|k| -0.65 + 1.3 * f64::from(k) / 24.0) {
                let values = |i: usize, j: usize| match j {
                    3 => (x[i] - at).max(0.0).powi(power),
                    _ => x[i].powi(j as i32),
                };
                let q = DMatrix::from_fn(x.len(), 4, values).qr().q();
                let exact = (&right - &q * (q.transpose() * &right)).norm_squared();
                let ours = hinge.left(at, power as usize);
                assert!((ours - exact).abs() < 1e-10 + 1e-7 * exact, "{power} at {at}: {ours}, {exact}");
            }
        }
        let (at, left) = hinge.best(1);
        assert!((at - 0.11).abs() < 0.02 && left < 0.5 * hinge.best(2).1, "{at} {left}");
    }
}
