//! Rational Bézier arcs in the parameter plane: de Casteljau evaluation and splitting, and cutting
//! into monotone parts. Trim loops are made of them.

use nalgebra::Vector3;

use crate::knots::for_degree;
use crate::{Curve2, Point2, Vector2};

/// A rational Bézier arc in the parameter plane, on `t ∈ [0, 1]`: control points `(w·u, w·v, w)`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Arc {
    net: Vec<Vector3<f64>>,
    /// The ends, kept apart from the net so that neighbours can share them to the last bit.
    ends: [Point2; 2],
}

impl Arc {
    fn new(net: Vec<Vector3<f64>>) -> Arc {
        let ends = [plane(&net[0]), plane(&net[net.len() - 1])];
        Arc { net, ends }
    }

    /// The Bézier arcs of a pcurve, in order.
    pub(crate) fn of_curve(curve: &Curve2) -> Vec<Arc> {
        let arc = |piece: Curve2| {
            let weight = |i: usize| piece.weights().map_or(1.0, |w| w[i]);
            let points = piece.points().iter().enumerate();
            Arc::new(points.map(|(i, p)| (p.coords * weight(i)).push(weight(i))).collect())
        };
        curve.bezier_pieces().into_iter().map(arc).collect()
    }

    pub(crate) fn line(a: Point2, b: Point2) -> Arc {
        Arc::new(vec![a.coords.push(1.0), b.coords.push(1.0)])
    }

    pub(crate) fn start(&self) -> Point2 {
        self.ends[0]
    }

    pub(crate) fn end(&self) -> Point2 {
        self.ends[1]
    }

    /// Moves the end by a rounding error, so that arcs chain to the last bit.
    pub(crate) fn set_end(&mut self, p: Point2) {
        self.ends[1] = p;
    }

    pub(crate) fn control_points(&self) -> impl Iterator<Item = Point2> + '_ {
        self.net.iter().map(plane)
    }

    pub(crate) fn is_line(&self) -> bool {
        self.net.len() == 2
    }

    pub(crate) fn translated(&self, by: Vector2) -> Arc {
        let shift = |h: &Vector3<f64>| Vector3::new(h.x + by.x * h.z, h.y + by.y * h.z, h.z);
        Arc::new(self.net.iter().map(shift).collect())
    }

    pub(crate) fn reversed(&self) -> Arc {
        Arc { net: self.net.iter().rev().copied().collect(), ends: [self.ends[1], self.ends[0]] }
    }

    /// Point at `t` (de Casteljau).
    pub(crate) fn point(&self, t: f64) -> Point2 {
        if let [a, b] = self.net[..] {
            return plane(&(a + (b - a) * t));
        }
        self.jet(t).0
    }

    /// Point and first derivative at `t`.
    pub(crate) fn jet(&self, t: f64) -> (Point2, Vector2) {
        for_degree!(self.net.len() - 1, self.jet_sized(t))
    }

    fn jet_sized<const N: usize>(&self, t: f64) -> (Point2, Vector2) {
        let mut d = [Vector3::zeros(); N];
        let degree = self.net.len() - 1;
        d[..=degree].copy_from_slice(&self.net);
        for level in 1..degree {
            for i in 0..=degree - level {
                d[i] += (d[i + 1] - d[i]) * t;
            }
        }
        let slope = (d[1] - d[0]) * degree as f64;
        let h = d[0] + (d[1] - d[0]) * t;
        let p = plane(&h);
        (p, (slope.xy() - p.coords * slope.z) / h.z)
    }

    /// The two parts at `t` (de Casteljau); they share their common end to the last bit.
    pub(crate) fn split(&self, t: f64) -> (Arc, Arc) {
        let mut high = self.net.clone();
        let mut low = Vec::with_capacity(high.len());
        for level in (0..high.len()).rev() {
            low.push(high[0]);
            for i in 0..level {
                high[i] = high[i] + (high[i + 1] - high[i]) * t;
            }
        }
        let (mut low, mut high) = (Arc::new(low), Arc::new(high));
        (low.ends[0], high.ends) = (self.ends[0], [low.ends[1], self.ends[1]]);
        (low, high)
    }

    /// The parts between the arc's extremes in `u` and `v`: each is monotone in both, up to
    /// rounding.
    pub(crate) fn monotone(&self) -> Vec<Arc> {
        let tiny = 1e-14 * self.control_points().fold(0.0f64, |m, p| m.max(p.coords.amax()));
        let (mut done, mut open) = (Vec::new(), vec![(self.clone(), 0)]);
        while let Some((arc, depth)) = open.pop() {
            match [0, 1].into_iter().find_map(|axis| arc.turn(axis, tiny)) {
                Some(t) if depth < 48 => {
                    let (low, high) = arc.split(t);
                    open.push((high, depth + 1));
                    open.push((low, depth + 1));
                }
                _ => done.push(arc),
            }
        }
        done
    }

    /// Where to cut an arc whose control polygon is not monotone along `axis`: at its extreme when the
    /// polygon turns once, in the middle otherwise. `None` when it is monotone, and then the arc is too
    /// (variation diminishing).
    fn turn(&self, axis: usize, tiny: f64) -> Option<f64> {
        let (a, b) = (self.start()[axis], self.end()[axis]);
        let rises = |w: (f64, f64)| w.1 - w.0 > tiny;
        let falls = |w: (f64, f64)| w.0 - w.1 > tiny;
        let coordinates: Vec<f64> = self.control_points().map(|p| p[axis]).collect();
        let steps = || coordinates.windows(2).map(|w| (w[0], w[1]));
        if !(steps().any(rises) && steps().any(falls)) {
            // Steps below `tiny` may add up to a bulge: the ends must bound the polygon.
            let inside = |&c: &f64| c >= a.min(b) - tiny && c <= a.max(b) + tiny;
            return (!coordinates.iter().all(inside)).then_some(0.5);
        }
        let slope = |t: f64| self.jet(t).1[axis];
        let (mut low, mut high) = (0.0, 1.0);
        let rising = slope(low) > 0.0;
        if rising == (slope(high) > 0.0) {
            return Some(0.5);
        }
        for _ in 0..50 {
            let mid = 0.5 * (low + high);
            *(if (slope(mid) > 0.0) == rising { &mut low } else { &mut high }) = mid;
        }
        let t = 0.5 * (low + high);
        // An extreme this close to an end rises above it by less than rounding.
        (t > 1e-9 && t < 1.0 - 1e-9).then_some(t)
    }

    /// Parameter where a monotone arc reaches `value` along `axis` (bisection to the last bit); `None` when
    /// it does not strictly pass it.
    pub(crate) fn crossing(&self, axis: usize, value: f64) -> Option<f64> {
        let (a, b) = (self.start()[axis], self.end()[axis]);
        if !(a.min(b) < value && value < a.max(b)) {
            return None;
        }
        if self.is_line() && self.net[0].z == self.net[1].z {
            return Some((value - a) / (b - a));
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..54 {
            let mid = 0.5 * (low + high);
            *(if (self.point(mid)[axis] < value) == (a < b) { &mut low } else { &mut high }) = mid;
        }
        Some(0.5 * (low + high))
    }
}

fn plane(h: &Vector3<f64>) -> Point2 {
    Point2::new(h.x / h.z, h.y / h.z)
}
