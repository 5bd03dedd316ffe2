//! Straight moves and pairs of arcs along a curve, each as long as the tolerance allows.

use claymill_nurbs::{Curve3, Point3, Vector3};
use nalgebra::Vector2;

use super::{Abilities, holds};
use crate::biarc::{Station, biarc};
use crate::number::LengthFormat;
use crate::{Arc, Plane, Shape};

/// What a piece may use up of the tolerance: it is looked at in a few places only.
const SHARE: f64 = 0.98;
/// Looks for the longest piece from one place.
const LOOKS: usize = 14;
/// A piece that is nearly as long as it could be is long enough.
const ENOUGH: f64 = 1.04;
/// Arcs of a pair that differ less in their radius are one.
const ONE_RADIUS: f64 = 1e-3;

/// Pairs of arcs where one plane of two axes holds the curve, straight moves where those get further in a block.
pub(super) fn as_blocks(
    curve: &Curve3,
    abilities: &Abilities,
    format: &LengthFormat,
    tolerance_mm: f64,
) -> Option<Vec<Shape>> {
    let plane = Plane::ALL.into_iter().find(|plane| holds(curve, *plane, format));
    let plane = plane.filter(|_| abilities.arcs)?;
    let course = Course::new(curve, format, tolerance_mm);
    let (mut t, mut line_step, mut pair_step) = (course.begin, course.length(), course.length());
    let mut shapes: Vec<Shape> = Vec::new();
    while t < course.end {
        let from = curve.point(t);
        let line = course.longest(t, line_step, 2.0, |to| course.line(t, to, &from, &curve.point(to)));
        let pair = course.longest(t, pair_step, 3.0, |to| course.pair(t, to, plane));
        let pace = |p: &Option<Piece>| p.as_ref().map_or(0.0, |p| (p.end - t) / p.shapes.len().max(1) as f64);
        let paces = (pace(&line), pace(&pair));
        for (piece, step) in [(&line, &mut line_step), (&pair, &mut pair_step)] {
            *step = piece.as_ref().map_or(*step, |p| p.end - t);
        }
        // Pairs of arcs have no corners: they win where both are as good.
        let piece = if paces.1 >= paces.0 { pair } else { line }.unwrap_or_else(|| course.sliver(t, &from));
        t = piece.end;
        shapes.extend(piece.shapes);
    }
    Some(shapes)
}

/// Straight moves. Their inner corners lie beside the curve, on its outer side, so that they may be longer by half than
/// chords: the curve then runs between corners and middles.
pub(super) fn as_chords(
    curve: &Curve3,
    _: &Abilities,
    format: &LengthFormat,
    tolerance_mm: f64,
) -> Option<Vec<Shape>> {
    let course = Course::new(curve, format, tolerance_mm);
    let (mut t, mut step, mut from) = (course.begin, course.length(), curve.start());
    let mut shapes: Vec<Shape> = Vec::new();
    while t < course.end {
        let piece = course.longest(t, step, 2.0, |to| course.line(t, to, &from, &course.corner(&from, to)));
        let piece = piece.unwrap_or_else(|| course.sliver(t, &from));
        (step, t, from) = (piece.end - t, piece.end, course.corner(&from, piece.end));
        shapes.extend(piece.shapes);
    }
    Some(shapes)
}

/// Points of straight moves along a curve, the start first.
pub(crate) fn chords(curve: &Curve3, format: &LengthFormat, tolerance_mm: f64) -> Vec<Point3> {
    let none = Abilities { splines: Vec::new(), arcs: false };
    let shapes = as_chords(curve, &none, format, tolerance_mm).unwrap_or_default();
    let start = format.snap_point(&curve.start());
    std::iter::once(start).chain(shapes.iter().map(Shape::end)).collect()
}

/// A part of the curve, and what stands for it.
struct Piece {
    end: f64,
    shapes: Vec<Shape>,
    /// Largest distance seen.
    error_mm: f64,
}

struct Course<'a> {
    curve: &'a Curve3,
    breaks: Vec<f64>,
    begin: f64,
    end: f64,
    format: &'a LengthFormat,
    tolerance_mm: f64,
}

impl<'a> Course<'a> {
    fn new(curve: &'a Curve3, format: &'a LengthFormat, tolerance_mm: f64) -> Self {
        let (begin, end) = curve.domain();
        Course {
            curve,
            breaks: curve.knots().breaks(),
            begin,
            end,
            format,
            tolerance_mm: SHARE * tolerance_mm,
        }
    }

    fn length(&self) -> f64 {
        self.end - self.begin
    }

    /// The longest piece from `t` that `make` keeps within the tolerance, from a first guess at its length in the
    /// parameter; its error grows with the power `order` of that. `None` where none is short enough.
    fn longest(&self, t: f64, guess: f64, order: f64, make: impl Fn(f64) -> Option<Piece>) -> Option<Piece> {
        let (mut step, mut too_far) = (guess, f64::INFINITY);
        let mut best: Option<Piece> = None;
        for _ in 0..LOOKS {
            let to = if t + step >= self.end { self.end } else { t + step };
            if to <= t {
                break;
            }
            let fits = |p: &Piece| p.error_mm <= self.tolerance_mm;
            let found = make(to);
            let share = found.as_ref().map_or(0.0, |p| self.tolerance_mm / p.error_mm.max(1e-12));
            step = to - t;
            if found.as_ref().is_some_and(fits) {
                best = found;
                if to == self.end {
                    break;
                }
                let next = step * (0.96 * share).powf(1.0 / order).clamp(1.0, 4.0);
                step = if next < too_far { next } else { 0.5 * (step + too_far) };
            } else {
                too_far = step;
                step *= (0.92 * share).powf(1.0 / order).clamp(0.2, 0.9);
            }
            if let Some(best) = &best {
                // Between what fits and what does not.
                let low = best.end - t;
                step = if step <= low { 0.5 * (low + too_far) } else { step };
                if step.min(self.end - t) < ENOUGH * low {
                    break;
                }
            }
        }
        best
    }

    /// What is too short to be anything but straight: about a cusp.
    fn sliver(&self, t: f64, from: &Point3) -> Piece {
        let speed = self.curve.derivatives(t)[1].norm().max(1e-3);
        let end = (t + 10.0 * self.format.step_mm() / speed).max(t + 1e-6 * self.length()).min(self.end);
        let to = self.curve.point(end);
        Piece { end, shapes: self.written(from, &to), error_mm: 0.0 }
    }

    /// A straight move in written digits, if it has a length.
    fn written(&self, from: &Point3, to: &Point3) -> Vec<Shape> {
        let (from, to) = (self.format.snap_point(from), self.format.snap_point(to));
        if from == to { Vec::new() } else { vec![Shape::Line { from, to }] }
    }

    fn line(&self, t: f64, end: f64, from: &Point3, to: &Point3) -> Option<Piece> {
        let chord = to - from;
        let square = chord.norm_squared().max(1e-300);
        let error_mm = self.farthest(t, end, 4, |p| {
            let off = p - from;
            (off - chord * (off.dot(&chord) / square).clamp(0.0, 1.0)).norm()
        });
        Some(Piece { end, shapes: self.written(from, to), error_mm })
    }

    /// Two tangent arcs, or one where they are the same.
    fn pair(&self, t: f64, end: f64, plane: Plane) -> Option<Piece> {
        let [i, j, _] = plane.axes();
        let station = |t: f64, side: f64| {
            let d = self.curve.derivatives(t + side)[1];
            let direction = Vector2::new(d[i], d[j]).try_normalize(1e-12)?;
            Some(Station { point: self.format.snap_point(&self.curve.point(t)), direction })
        };
        // Just inside: derivatives may jump at knots.
        let inset = 1e-9 * (end - t);
        let mut shapes = biarc(&station(t, inset)?, &station(end, -inset)?, plane, self.format)?;
        if shapes.is_empty() {
            return None;
        }
        let far = |shapes: &[Shape]| {
            self.farthest(t, end, 8, |p| shapes.iter().map(|s| distance(s, p)).fold(f64::INFINITY, f64::min))
        };
        let mut error_mm = far(&shapes);
        if let [Shape::Arc(a), Shape::Arc(b)] = &shapes[..]
            && a.clockwise == b.clockwise
            && (a.radius_mm() - b.radius_mm()).abs() < ONE_RADIUS * a.radius_mm()
            && let Some(one) = Arc::through(a.from, b.to, a.centre, plane, a.clockwise)
        {
            let one = vec![Shape::Arc(self.rounded(one))];
            let one_mm = far(&one);
            if one_mm <= self.tolerance_mm {
                (shapes, error_mm) = (one, one_mm);
            }
        }
        Some(Piece { end, shapes, error_mm })
    }

    /// The arc with a centre in written digits, from the start.
    fn rounded(&self, arc: Arc) -> Arc {
        let mut centre = arc.centre;
        for k in 0..3 {
            centre[k] = arc.from[k] + self.format.snap(centre[k] - arc.from[k]);
        }
        Arc::through(arc.from, arc.to, centre, arc.plane, arc.clockwise).unwrap_or(arc)
    }

    /// Where a straight move from `from` ends that stands for the curve up to `t`.
    fn corner(&self, from: &Point3, t: f64) -> Point3 {
        let [p, d1, d2] = self.curve.derivatives(t);
        let square = d1.norm_squared();
        if t >= self.end || square <= 0.0 {
            return self.curve.point(t);
        }
        // A chord of length l is κ l² / 8 from the curve; half of that goes to its ends.
        let bend: Vector3 = (d2 - d1 * (d1.dot(&d2) / square)) / square;
        let off = bend * ((p - from.coords).norm_squared() / 16.0);
        let off = off * (0.9 * self.tolerance_mm / off.norm().max(1e-300)).min(1.0);
        Point3::from(p - off)
    }

    /// Largest distance of points of the curve between `t` and `end`, `parts` of them in each span.
    fn farthest(&self, t: f64, end: f64, parts: u32, far: impl Fn(&Point3) -> f64) -> f64 {
        let inner = self.breaks.partition_point(|b| *b <= t)..self.breaks.partition_point(|b| *b < end);
        let mut largest: f64 = 0.0;
        let mut from = t;
        for &to in self.breaks[inner].iter().chain([&end]) {
            for i in 1..=parts {
                let s = f64::from(i) / f64::from(parts);
                largest = largest.max(far(&self.curve.point(from + (to - from) * s)));
            }
            from = to;
        }
        largest
    }
}

/// Distance of a point from a line or an arc that it lies beside.
fn distance(shape: &Shape, p: &Point3) -> f64 {
    match shape {
        Shape::Line { from, to } => {
            let d = to - from;
            let s = ((p - from).dot(&d) / d.norm_squared().max(1e-300)).clamp(0.0, 1.0);
            (p - (from + d * s)).norm()
        }
        Shape::Arc(arc) => {
            let ends = (p - arc.from).norm().min((p - arc.to).norm());
            let ring = ((p - arc.centre).norm() - arc.radius_mm()).abs();
            // Beside the arc, not beside the rest of its circle.
            let chord = arc.to - arc.from;
            let s = (p - arc.from).dot(&chord) / chord.norm_squared().max(1e-300);
            if (0.0..=1.0).contains(&s) { ring } else { ends }
        }
        Shape::Spline(_) => f64::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::KnotVector;

    use super::*;
    use crate::follow::deviation;
    use crate::{Dialect, Machine};

    const TOLERANCE_MM: f64 = 0.002;
    const ARCS: Abilities = Abilities { splines: Vec::new(), arcs: true };

    fn format() -> LengthFormat {
        Dialect::G1.format(&Machine::default())
    }

    fn cubic(points: &[[f64; 3]]) -> Curve3 {
        let spans = points.len() - 3;
        let mut knots = vec![0.0; 3];
        knots.extend((0..=spans).map(|i| i as f64 * 10.0));
        knots.extend([spans as f64 * 10.0; 3]);
        Curve3::new(KnotVector::new(3, knots).unwrap(), points.iter().map(|&p| p.into()).collect(), None)
            .unwrap()
    }

    /// A quarter of a circle in a plane that no two axes span.
    fn tilted_quarter(radius_mm: f64) -> Curve3 {
        let s = std::f64::consts::FRAC_1_SQRT_2;
        let at = |x: f64, z: f64| Point3::new(0.6 * x, 0.8 * x, z) * radius_mm;
        let points = vec![at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
        Curve3::new(KnotVector::new(2, vec![0., 0., 0., 1., 1., 1.]).unwrap(), points, Some(vec![1., s, 1.]))
            .unwrap()
    }

    #[test]
    fn straight_moves_use_the_tolerance_on_both_sides() {
        for radius_mm in [5.0, 80.0, 2000.0] {
            let curve = tilted_quarter(radius_mm);
            let shapes = as_chords(&curve, &ARCS, &format(), TOLERANCE_MM).unwrap();
            // Corners and middles both at the tolerance: chords of √(16 r t).
            let least = std::f64::consts::FRAC_PI_2 * radius_mm / (16.0 * radius_mm * TOLERANCE_MM).sqrt();
            let count = shapes.len() as f64;
            assert!(count >= least.floor() && count < 1.12 * least + 2.0, "{count} of {least}");
            assert!(deviation(&curve, &shapes) <= TOLERANCE_MM + 0.87 * format().step_mm());
            assert_eq!(shapes[0].start(), format().snap_point(&curve.start()));
            assert_eq!(shapes[shapes.len() - 1].end(), format().snap_point(&curve.end()));
        }
    }

    #[test]
    fn an_arc_is_one_arc_whatever_its_knots() {
        // Half a circle in two spans.
        let arc = Arc::through(
            Point3::new(10.0, 3.0, 0.0),
            Point3::new(-10.0, 3.0, 0.0),
            Point3::new(0.0, 3.0, 0.0),
            Plane::Zx,
            true,
        );
        let shapes = as_blocks(&arc.unwrap().curve().unwrap(), &ARCS, &format(), TOLERANCE_MM).unwrap();
        let arcs = shapes.iter().filter(|s| matches!(s, Shape::Arc(_))).count();
        assert!(shapes.len() <= 2 && arcs == shapes.len(), "{shapes:?}");
    }

    #[test]
    fn each_part_gets_what_takes_it_further() {
        // Straight for 60 mm, then a bend.
        let mut points: Vec<[f64; 3]> = (0..8).map(|i| [f64::from(i) * 10.0, 0.0, 7.0]).collect();
        points.extend([[80.0, 4.0, 7.0], [86.0, 12.0, 7.0], [88.0, 22.0, 7.0], [85.0, 30.0, 7.0]]);
        let curve = cubic(&points);
        let shapes = as_blocks(&curve, &ARCS, &format(), TOLERANCE_MM).unwrap();
        assert!(matches!(shapes[0], Shape::Line { .. }) && shapes[0].length_mm() > 50.0, "{shapes:?}");
        let arcs = shapes.iter().filter(|s| matches!(s, Shape::Arc(_))).count();
        assert!(arcs > 4 && arcs + 3 > shapes.len(), "{shapes:?}");
        assert!(deviation(&curve, &shapes) <= TOLERANCE_MM + 0.87 * format().step_mm());
        let straight = as_chords(&curve, &ARCS, &format(), TOLERANCE_MM).unwrap();
        assert!(shapes.len() < straight.len(), "{} of {}", shapes.len(), straight.len());
        for pair in shapes.windows(2) {
            assert_eq!(pair[0].end(), pair[1].start());
        }
    }

    #[test]
    fn a_cusp_ends() {
        let curve = cubic(&[[0., 0., 0.], [10., 0., 0.], [-10., 0., 0.], [0., 0., 0.], [0., 5., 0.]]);
        for shapes in [
            as_blocks(&curve, &ARCS, &format(), TOLERANCE_MM).unwrap(),
            as_chords(&curve, &ARCS, &format(), TOLERANCE_MM).unwrap(),
        ] {
            assert!(shapes.len() < 1000);
            assert_eq!(shapes[shapes.len() - 1].end(), Point3::new(0.0, 5.0, 0.0));
        }
    }
}
