//! Closed curves in space as nodes of a Gauss–Legendre rule, for line integrals such as length and
//! vector area (Stokes' theorem).

use claymill_nurbs::{Curve3, NurbsCurve, Point3, Vector3};
use nalgebra::Point;

/// Nodes and weights of order 5 on `[0, 1]`.
pub(crate) const FIVE: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_45),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];
/// The pieces of a curve are integrated in so many parts.
const PARTS: usize = 4;

/// A place on a closed curve with the step that it stands for, so that `∮ f · dp` is the sum of `f(at) · step`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Node {
    pub(crate) at: Point3,
    pub(crate) step: Vector3,
}

/// A closed curve in space, mm, in the direction that the file gives it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Ring {
    pub(crate) nodes: Vec<Node>,
    /// Whether it runs along some edge there and back.
    pub(crate) has_seam: bool,
}

impl Ring {
    /// The ring of curves that follow each other.
    pub(crate) fn of_curves(curves: &[Curve3]) -> Self {
        let curves = head_to_tail(curves, |c| c.start(), |c| c.end(), Curve3::reversed);
        let nodes = |c: &Curve3| -> Vec<Node> {
            let at = |t: f64| {
                let [p, d, _] = c.derivatives(t);
                (Point3::from(p), d)
            };
            parts(c).into_iter().flat_map(|(a, b)| over(a, b, at)).collect()
        };
        // Small gaps are closed: integrals around an open curve depend on where they are taken from.
        let next = curves.iter().cycle().skip(1);
        let joined = curves.iter().zip(next).flat_map(|(c, next)| {
            let (end, start) = (c.end(), next.start());
            nodes(c).into_iter().chain(over(0.0, 1.0, move |x| (end + (start - end) * x, start - end)))
        });
        Ring { nodes: joined.collect(), has_seam: false }
    }

    pub(crate) fn integral(&self, mut f: impl FnMut(&Node) -> f64) -> f64 {
        self.nodes.iter().map(&mut f).sum()
    }

    /// Length, mm.
    pub(crate) fn length(&self) -> f64 {
        self.integral(|n| n.step.norm())
    }

    /// `½ ∮ p × dp`: what any surface inside shows of itself along each axis, by Stokes' theorem.
    pub(crate) fn vector_area(&self) -> Vector3 {
        // Relative to the first place: far models would lose digits.
        let Some(origin) = self.nodes.first().map(|n| n.at) else { return Vector3::zeros() };
        self.nodes.iter().map(|n| (n.at - origin).cross(&n.step) * 0.5).sum()
    }
}

/// Nodes on `[a, b]` of a curve given by place and derivative.
pub(crate) fn over(a: f64, b: f64, at: impl Fn(f64) -> (Point3, Vector3)) -> Vec<Node> {
    let node = |(x, weight): (f64, f64)| {
        let (at, slope) = at(a + (b - a) * x);
        Node { at, step: slope * (weight * (b - a)) }
    };
    FIVE.map(node).into()
}

/// The ranges of parameters over which a curve is integrated.
pub(crate) fn parts<const D: usize>(curve: &NurbsCurve<D>) -> Vec<(f64, f64)> {
    let parts = if curve.knots().degree() == 1 { 1 } else { PARTS };
    let breaks = curve.knots().breaks();
    let cut = |w: &[f64]| {
        let (a, b) = (w[0], w[1]);
        let at = move |k: usize| a + (b - a) * k as f64 / parts as f64;
        (0..parts).map(move |k| (at(k), at(k + 1)))
    };
    breaks.windows(2).flat_map(cut).collect()
}

/// Curves that follow each other, each turned so that it begins where the one before ends.
pub(super) fn head_to_tail<C: Clone, const D: usize>(
    curves: &[C],
    start: impl Fn(&C) -> Point<f64, D>,
    end: impl Fn(&C) -> Point<f64, D>,
    reversed: impl Fn(&C) -> C,
) -> Vec<C> {
    let mut chain: Vec<C> = curves.to_vec();
    if let [first, second, ..] = curves {
        let gap = |p: &Point<f64, D>| (start(second) - p).norm().min((end(second) - p).norm());
        if gap(&start(first)) < gap(&end(first)) {
            chain[0] = reversed(first);
        }
    }
    for i in 1..chain.len() {
        let before = end(&chain[i - 1]);
        if (end(&chain[i]) - before).norm() < (start(&chain[i]) - before).norm() {
            chain[i] = reversed(&chain[i]);
        }
    }
    chain
}
