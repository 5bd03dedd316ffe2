//! Bounds of position, normals and curvature over a leaf, proven by the convex-hull property of
//! their Bernstein forms.

use nalgebra::{Vector1, Vector3};

use super::Leaf;
use crate::bernstein::Bernstein;
use crate::{Aabb, Point3};

/// What rounding may do to a Bernstein coefficient, as a share of the sizes that were multiplied for it.
const ROUNDING: f64 = 1e-13;
/// A cone this wide (cosine) says nothing that could be used.
const WIDEST_COSINE: f64 = 1e-6;

/// What holds on all of a leaf, proven from control nets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeafBounds {
    /// A box around the leaf, mm.
    pub aabb: Aabb,
    /// A cone around the directions of `Su × Sv`; `None` if they may spread to a half-space or vanish.
    pub normals: Option<NormalCone>,
    /// Smallest and largest normal curvature in any direction for the normal `Su × Sv`, 1/mm; `None` where that
    /// may vanish.
    pub curvature: Option<(f64, f64)>,
}

/// Directions around an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalCone {
    /// Unit vector.
    pub axis: Vector3<f64>,
    /// Cosine of the largest angle from the axis, positive.
    pub cosine: f64,
}

/// A polynomial piece on the unit square: `S = A / w`.
#[derive(Clone)]
struct Piece {
    a: Bernstein<3>,
    /// `None` if it is 1.
    w: Option<Bernstein<1>>,
}

impl Leaf {
    /// Bounds of position, normals and curvature, sharpened by halving the leaf `cuts` times both ways.
    ///
    /// All three come from the convex-hull property: of the points themselves; of `Su × Sv`, times `w³`; and of
    /// the numerators of both fundamental forms, in a basis that is orthonormal in the middle of each part.
    #[must_use]
    pub fn bounds(&self, cuts: u32) -> LeafBounds {
        let a = self.net.iter().map(|h| h.xyz()).collect();
        let w = self.net.iter().map(|h| Vector1::new(h.w)).collect();
        let piece = Piece {
            a: Bernstein::new(self.degree, a),
            w: self.rational.then(|| Bernstein::new(self.degree, w)),
        };
        let mut pieces = vec![piece];
        for axis in (0..cuts).flat_map(|_| [0, 1]) {
            pieces = pieces.iter().flat_map(|p| p.halves(axis)).collect();
        }
        let shapes: Vec<Shape> = pieces.iter().map(Piece::shape).collect();
        let axis = shapes.iter().map(Shape::mean_normal).sum::<Vector3<f64>>().try_normalize(0.0);
        let cosine = |axis: &Vector3<f64>| shapes.iter().map(|s| s.cosine(axis)).fold(1.0, f64::min);
        let cone = axis.map(|axis| NormalCone { axis, cosine: cosine(&axis) });
        let join = |x: (f64, f64), y: (f64, f64)| (x.0.min(y.0), x.1.max(y.1));
        let local = pieces.iter().fold(Aabb::empty(), |b, p| b.union(&p.hull()));
        let slack = ROUNDING * (local.diagonal() + self.origin.coords.amax());
        let aabb = Aabb { min: local.min + self.origin.coords, max: local.max + self.origin.coords };
        LeafBounds {
            aabb: aabb.inflated(slack),
            normals: cone.filter(|c| c.cosine > WIDEST_COSINE),
            curvature: shapes.iter().map(Shape::curvature).reduce(|x, y| Some(join(x?, y?))).flatten(),
        }
    }
}

impl Piece {
    fn halves(&self, axis: usize) -> [Piece; 2] {
        let [low, high] = self.a.halves(axis);
        let [w_low, w_high] = match self.w.as_ref().map(|w| w.halves(axis)) {
            Some(halves) => halves.map(Some),
            None => [None, None],
        };
        [Piece { a: low, w: w_low }, Piece { a: high, w: w_high }]
    }

    /// The box around the control points.
    fn hull(&self) -> Aabb {
        let weight = |k: usize| self.w.as_ref().map_or(1.0, |w| w.coefficients()[k].x);
        let points: Vec<Point3> =
            self.a.coefficients().iter().enumerate().map(|(k, a)| Point3::from(a / weight(k))).collect();
        Aabb::of(&points)
    }

    fn shape(&self) -> Shape {
        let [au, av] = [0, 1].map(|axis| self.a.derivative(axis));
        let second = [au.derivative(0), au.derivative(1), av.derivative(1)];
        let cross = |x: &Bernstein<3>, y: &Bernstein<3>| x.product(y, |x, y| x.cross(y));
        let Some(w) = &self.w else {
            let normal = cross(&au, &av);
            let second = second.each_ref().map(|s| dot(s, &normal));
            return Shape { steep: steepest(&au, &av, 1.0), weight: 1.0, slopes: [au, av], second, normal };
        };
        let (wu, wv) = (w.derivative(0), w.derivative(1));
        let flat = cross(&au, &av);
        let normal = (flat.times(w))
            .minus(&cross(&au, &self.a).times(&wv), 1.0)
            .minus(&cross(&self.a, &av).times(&wu), 1.0);
        // Suu · (Su × Sv) is minus the determinant of the homogeneous point and its derivatives u, v, uu, over w⁴.
        let volume = dot(&self.a, &flat);
        let bends = [wu.derivative(0), wu.derivative(1), wv.derivative(1)];
        let cubed = w.times(w).times(w);
        let second: [Bernstein<1>; 3] = std::array::from_fn(|k| {
            dot(&second[k], &normal).minus(&volume.times(&bends[k]), 1.0).times(&cubed)
        });
        let slope = |d: &Bernstein<3>, wd: &Bernstein<1>| d.times(w).minus(&self.a.times(wd), 1.0);
        let slopes = [slope(&au, &wu), slope(&av, &wv)];
        let weight = w.coefficients().iter().fold(0.0, |m: f64, w| m.max(w.x));
        Shape { steep: steepest(&slopes[0], &slopes[1], weight), weight, slopes, second, normal }
    }
}

fn dot(x: &Bernstein<3>, y: &Bernstein<3>) -> Bernstein<1> {
    x.product(y, |x, y| Vector1::new(x.dot(y)))
}

/// The longer of the largest slopes of `A / w` that the nets allow, but for the range of `w`.
fn steepest(x: &Bernstein<3>, y: &Bernstein<3>, weight: f64) -> f64 {
    x.coefficients().iter().chain(y.coefficients()).map(|c| c.norm()).fold(0.0, f64::max) / (weight * weight)
}

/// Nets of a piece's normal and fundamental forms, times positive factors.
struct Shape {
    /// `w³ Su × Sv`.
    normal: Bernstein<3>,
    /// `w² Su`, `w² Sv`.
    slopes: [Bernstein<3>; 2],
    /// `w⁷ (Suu, Suv, Svv) · (Su × Sv)`.
    second: [Bernstein<1>; 3],
    /// Largest weight.
    weight: f64,
    /// About the largest length of `Su` and `Sv`.
    steep: f64,
}

impl Shape {
    /// What rounding may have done to coefficients of the normal.
    fn rounding(&self) -> f64 {
        ROUNDING * self.steep.powi(2) * self.weight.powi(3)
    }

    fn mean_normal(&self) -> Vector3<f64> {
        self.normal.coefficients().iter().sum()
    }

    /// Least cosine of the angle between a normal and `axis`; negative when unknown.
    fn cosine(&self, axis: &Vector3<f64>) -> f64 {
        let slack = self.rounding();
        let of = |n: &Vector3<f64>| {
            let (along, size) = (n.dot(axis) - slack, n.norm() + slack);
            // A coefficient that rounding alone could make says nothing.
            if along > slack { along / size } else { -1.0 }
        };
        self.normal.coefficients().iter().map(of).fold(1.0, f64::min)
    }

    /// Range of the normal curvature, if the normal is known not to vanish.
    ///
    /// The curvature is a quotient of quadratic forms, `second / (|normal| first)`, and `|normal|` lies between
    /// `normal · axis` and that over the cone's cosine. With the latter for the former both forms are polynomials
    /// whose coefficients pair up: what bounds the quotients of all pairs bounds the quotient everywhere.
    fn curvature(&self) -> Option<(f64, f64)> {
        let axis = self.mean_normal().try_normalize(0.0)?;
        let cosine = self.cosine(&axis);
        if cosine <= WIDEST_COSINE {
            return None;
        }
        let along = self.normal.product(&Bernstein::new([0, 0], vec![axis]), |n, a| Vector1::new(n.dot(a)));
        let [x, y] = &self.slopes;
        let first = [dot(x, x), dot(x, y), dot(y, y)].map(|form| form.times(&along));
        let nets: Vec<&Bernstein<1>> = self.second.iter().chain(&first).collect();
        let degrees = [0, 1].map(|axis| nets.iter().map(|n| n.degrees()[axis]).max().unwrap_or(0));
        let nets: Vec<Bernstein<1>> = nets.iter().map(|n| n.raised_to(degrees)).collect();
        let slack = ROUNDING * self.steep.powi(3) * self.weight.powi(7);
        let slacks = (slack, slack * self.steep);
        let mut range = (f64::INFINITY, f64::NEG_INFINITY);
        for k in 0..nets[0].coefficients().len() {
            let of = |net: usize| nets[net].coefficients()[k].x;
            let quotients = quotients([of(0), of(1), of(2)], [of(3), of(4), of(5)], slacks)?;
            range = (range.0.min(quotients.0), range.1.max(quotients.1));
        }
        // Where all curve one way the longer normal makes for the weaker curvature.
        let weaken = |x: f64, weak: bool| if weak { x * cosine } else { x };
        Some((weaken(range.0, range.0 > 0.0), weaken(range.1, range.1 < 0.0)))
    }
}

/// Range of the quotients of two quadratic forms, each entry known up to its slack; `None` unless the second is
/// positive.
fn quotients(a: [f64; 3], b: [f64; 3], slack: (f64, f64)) -> Option<(f64, f64)> {
    let half_trace = 0.5 * (b[0] + b[2]);
    let determinant = b[0] * b[2] - b[1] * b[1];
    // At least the smaller eigenvalue.
    let least = determinant / (2.0 * half_trace) - 2.0 * slack.1;
    if b[0] <= 0.0 || least <= 0.0 {
        return None;
    }
    let mean = 0.5 * (a[0] * b[2] + a[2] * b[0] - 2.0 * a[1] * b[1]) / determinant;
    let product = (a[0] * a[2] - a[1] * a[1]) / determinant;
    let root = (mean * mean - product).max(0.0).sqrt();
    // Rounding of the closed form itself: a root may be half as exact as what it is taken of.
    let largest = mean.abs() + root;
    let spread =
        2.0 * (slack.0 + largest * slack.1) / least + 1e-7 * (largest - root.min(largest)) + 1e-12 * largest;
    Some((mean - root - spread, mean + root + spread))
}
