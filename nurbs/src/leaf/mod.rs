//! Surfaces made ready for evaluation in bulk.
//!
//! ```text
//!   surface ─► Bézier pieces ─► leaf: Bernstein net (bounds, certificates)
//!                                     centred powers, one block a coordinate (speed)
//!
//!   leaf, 8 (u, v) side by side ─► position, six derivatives, normal, both fundamental forms
//! ```
//!
//! The width of a register is chosen when the program runs (AVX-512, AVX2 with FMA, NEON, else none). All widths
//! with fused products give the same bits, and a single point those of eight; machines without (before 2013)
//! differ in the last.

mod arithmetic;
mod bounds;
mod kernel;
mod lanes;
mod powers;

use nalgebra::Vector4;
use pulp::{Arch, Simd, WithSimd};

use crate::{Jet, NurbsSurface, Point3, Vector3};
use arithmetic::{Arithmetic, Single, Wide};
pub use bounds::{LeafBounds, NormalCone};
pub use lanes::{LANES, Lanes, Places, Shapes};

/// One Bézier piece of a surface, made once and evaluated often.
#[derive(Debug, Clone)]
pub struct Leaf {
    degree: [usize; 2],
    rational: bool,
    /// Its interval of the surface's parameters.
    u: (f64, f64),
    v: (f64, f64),
    middle: (f64, f64),
    /// Everything below is relative to this point, so that digits go into the shape.
    origin: Point3,
    /// Homogeneous Bézier points, row-major in `u`.
    net: Box<[Vector4<f64>]>,
    /// `None` where a power basis would lose digits.
    powers: Option<Box<[f64]>>,
}

impl Leaf {
    /// Prepares a surface that is a single polynomial piece.
    fn of(piece: &NurbsSurface) -> Self {
        let degree = [piece.knots_u().degree(), piece.knots_v().degree()];
        let (u, v) = piece.domain();
        Leaf::new(degree, u, v, piece.is_rational(), piece.net())
    }

    /// Prepares a Bézier piece on `u` and `v` by its homogeneous points.
    fn new(degree: [usize; 2], u: (f64, f64), v: (f64, f64), rational: bool, net: &[Vector4<f64>]) -> Self {
        let origin = Point3::from(net.iter().map(|h| h.xyz() / h.w).sum::<Vector3>() / net.len() as f64);
        let mut leaf = Leaf {
            degree,
            rational,
            u,
            v,
            middle: (0.5 * (u.0 + u.1), 0.5 * (v.0 + v.1)),
            origin,
            net: net.iter().map(|h| (h.xyz() - origin.coords * h.w).push(h.w)).collect(),
            powers: None,
        };
        leaf.powers = powers::powers(&leaf);
        leaf
    }

    /// The same on `[-½, ½]²` for evaluation only: what only bounds need is left out.
    pub(crate) fn for_evaluation(degree: [usize; 2], rational: bool, net: &[Vector4<f64>]) -> Self {
        let mut leaf = Leaf::new(degree, (-0.5, 0.5), (-0.5, 0.5), rational, net);
        if leaf.powers.is_some() {
            leaf.net = Box::default();
        }
        leaf
    }

    /// The interval of the surface's `u` that the leaf covers.
    #[must_use]
    pub fn u(&self) -> (f64, f64) {
        self.u
    }

    /// The interval of the surface's `v` that the leaf covers.
    #[must_use]
    pub fn v(&self) -> (f64, f64) {
        self.v
    }

    /// Everything to the second order at many places, eight at a time. Places and shapes pair up; those left over
    /// on either side are ignored. Parameters are the surface's; outside the leaf its polynomials go on.
    pub fn shapes(&self, places: &[Places], shapes: &mut [Shapes]) {
        Arch::new().dispatch(Batch { leaf: self, places, shapes });
    }

    /// The point at one place, mm.
    #[must_use]
    pub fn point(&self, u: f64, v: f64) -> Point3 {
        Arch::new().dispatch(Place { leaf: self, u, v })
    }

    /// Point and derivatives to the second order at one place.
    #[must_use]
    pub fn jet(&self, u: f64, v: f64) -> Jet {
        Arch::new().dispatch(One { leaf: self, u, v })
    }
}

struct Batch<'a> {
    leaf: &'a Leaf,
    places: &'a [Places],
    shapes: &'a mut [Shapes],
}

impl WithSimd for Batch<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let a = Wide(simd);
        for (at, shapes) in self.places.iter().zip(self.shapes) {
            let ((u, _), (v, _)) = (S::as_simd_f64s(&at.u), S::as_simd_f64s(&at.v));
            for k in 0..u.len() {
                let d = kernel::derivatives(a, self.leaf, u[k], v[k]);
                shapes.put::<S>(k, &d, &kernel::forms(a, &d));
            }
        }
    }
}

struct One<'a> {
    leaf: &'a Leaf,
    u: f64,
    v: f64,
}

impl One<'_> {
    #[inline(always)]
    fn jet(&self, a: impl Arithmetic<Real = f64>) -> Jet {
        let d = kernel::derivatives(a, self.leaf, self.u, self.v);
        Jet {
            p: Point3::from(d.p),
            su: d.su.into(),
            sv: d.sv.into(),
            suu: d.suu.into(),
            suv: d.suv.into(),
            svv: d.svv.into(),
        }
    }
}

impl WithSimd for One<'_> {
    type Output = Jet;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Jet {
        if S::IS_SCALAR { self.jet(Single::<false>) } else { self.jet(Single::<true>) }
    }
}

struct Place<'a> {
    leaf: &'a Leaf,
    u: f64,
    v: f64,
}

impl WithSimd for Place<'_> {
    type Output = Point3;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Point3 {
        Point3::from(if S::IS_SCALAR {
            kernel::point(Single::<false>, self.leaf, self.u, self.v)
        } else {
            kernel::point(Single::<true>, self.leaf, self.u, self.v)
        })
    }
}

/// A surface as its leaves.
#[derive(Debug, Clone)]
pub struct Leaves {
    /// Row by row in `u`, then `v`.
    leaves: Vec<Leaf>,
    breaks: [Vec<f64>; 2],
}

impl Leaves {
    /// Prepares all of a surface.
    #[must_use]
    pub fn new(surface: &NurbsSurface) -> Self {
        Leaves {
            leaves: surface.bezier_pieces().iter().map(Leaf::of).collect(),
            breaks: [surface.knots_u().breaks(), surface.knots_v().breaks()],
        }
    }

    /// All leaves, row by row in `u`, then `v`.
    #[must_use]
    pub fn as_slice(&self) -> &[Leaf] {
        &self.leaves
    }

    /// The leaf that holds `(u, v)`; a parameter on a knot belongs to the leaf above, one outside the domain to
    /// the nearest leaf.
    #[must_use]
    pub fn at(&self, u: f64, v: f64) -> &Leaf {
        let [i, j] = [(0, u), (1, v)].map(|(axis, t): (usize, f64)| {
            let inner = &self.breaks[axis][1..self.breaks[axis].len() - 1];
            inner.partition_point(|&k| k <= t)
        });
        &self.leaves[i * (self.breaks[1].len() - 1) + j]
    }

    /// `((u_min, u_max), (v_min, v_max))`.
    #[must_use]
    pub fn domain(&self) -> ((f64, f64), (f64, f64)) {
        let [u, v] = self.breaks.each_ref().map(|b| (b[0], b[b.len() - 1]));
        (u, v)
    }

    /// The point at `(u, v)`, mm.
    #[must_use]
    pub fn point(&self, u: f64, v: f64) -> Point3 {
        self.at(u, v).point(u, v)
    }

    /// Point and derivatives to the second order at `(u, v)`, as [`NurbsSurface::jet`] gives them.
    #[must_use]
    pub fn jet(&self, u: f64, v: f64) -> Jet {
        self.at(u, v).jet(u, v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::KnotVector;

    /// A piece of two degrees with a bulge of `wild` mm here and there.
    fn piece(p: usize, q: usize, rational: bool, wild: f64) -> NurbsSurface {
        let at = |k: usize| {
            let (i, j) = ((k / (q + 1)) as f64 / p as f64, (k % (q + 1)) as f64 / q as f64);
            Point3::new(60.0 * i, 50.0 * j, 9.0 * (2.0 * i * j).sin() + wild * (k as f64 * 2.4).sin())
        };
        let count = (p + 1) * (q + 1);
        let weights = (0..count).map(|k| 1.0 + 0.2 * (k as f64).cos()).collect();
        let knots = |degree| KnotVector::clamped_uniform(degree, degree + 1);
        let points = (0..count).map(at).collect();
        NurbsSurface::new(knots(p), knots(q), points, rational.then_some(weights)).unwrap()
    }

    #[test]
    fn smooth_leaves_are_held_by_powers_and_wild_ones_of_a_high_degree_are_not() {
        for p in 1..=15 {
            assert!(Leaf::of(&piece(p, 3, false, 0.0)).powers.is_some(), "degree {p}");
        }
        assert!(Leaf::of(&piece(15, 15, false, 40.0)).powers.is_none());
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn all_widths_give_the_same_bits() {
        let Some(narrow) = pulp::x86::V3::try_new() else {
            return claymill_tests::leave_out(claymill_tests::Need::Avx2, "no AVX2 here");
        };
        for (p, q) in [(1, 1), (2, 3), (3, 3), (5, 5), (9, 4), (15, 15)] {
            for (rational, wild) in [(false, 0.0), (true, 0.0), (true, 40.0)] {
                let leaf = Leaf::of(&piece(p, q, rational, wild));
                let u = std::array::from_fn(|k| k as f64 / 7.0);
                let places = [Places { u, v: u.map(|u| 1.0 - u * u) }; 3];
                let mut wide = [Shapes::default(); 3];
                leaf.shapes(&places, &mut wide);
                let mut same = [Shapes::default(); 3];
                Arch::V3(narrow).dispatch(Batch { leaf: &leaf, places: &places, shapes: &mut same });
                assert!(wide == same, "degree {p} {q} rational {rational}");
                let mut alone = [Shapes::default(); 3];
                Arch::Scalar.dispatch(Batch { leaf: &leaf, places: &places, shapes: &mut alone });
                for k in 0..LANES {
                    let (a, b) = (wide[2].jet(k), alone[2].jet(k));
                    assert!((a.p - b.p).norm() < 1e-12 && (a.suu - b.suu).norm() < 1e-10);
                    assert_eq!(a, leaf.jet(places[2].u[k], places[2].v[k]));
                    let n = wide[2].normal(k).unwrap();
                    approx::assert_relative_eq!(n, a.normal().unwrap(), epsilon = 1e-14);
                    let (x, y) = (wide[2].curvature(k), a.curvature(&n));
                    approx::assert_relative_eq!(x.first, y.first, epsilon = 1e-9);
                    approx::assert_relative_eq!(x.second, y.second, epsilon = 1e-9);
                }
            }
        }
    }
}
