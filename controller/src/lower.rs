use claymill_nurbs::{Curve3, KnotVector, Point3};
use nalgebra::Vector2;
use serde::Serialize;

use crate::biarc::{Station, biarc};
use crate::follow::deviation;
use crate::number::{LengthFormat, round};
use crate::{Plane, Refusal, Shape};

/// What a dialect takes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Abilities {
    /// Forms of curves, the best first; none for a control that knows lines and arcs only.
    pub splines: Vec<Splines>,
    /// G2 and G3 in the planes of two axes.
    pub arcs: bool,
}

/// What a dialect takes of curves.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Splines {
    /// One polynomial piece at a time instead of a curve with inner knots.
    pub pieces: bool,
    /// Lowest and highest degree.
    pub degrees: [usize; 2],
    /// Smallest and largest weight after the curve's weights were scaled so that the largest one is `[1]`
    /// or less; `None` for a control without weights.
    pub weights: Option<[f64; 2]>,
    /// Decimals of weights.
    pub weight_digits: u8,
    /// Decimals of knots.
    pub knot_digits: u8,
    /// Largest knot.
    pub largest_knot: f64,
    /// Planes in which curves may lie; `None` for any place in space.
    pub planes: Option<Vec<Plane>>,
    /// Largest number of control points in one curve.
    pub max_points: usize,
    /// Whether inner control points keep all their digits: polynomial coefficients have more than coordinates.
    pub exact_points: bool,
    /// Whether the first weight must be 1, because it cannot be written.
    pub first_weight_one: bool,
    /// Whether each piece is written with a knot in its middle: for uniform splines of five points or more.
    pub halved: bool,
}

/// What a curve became.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rung {
    /// A straight move of the job.
    Straight,
    /// The job's curve itself, rounded.
    Nurbs,
    /// A polynomial curve fitted to it.
    Polynomial,
    /// Pairs of tangent arcs.
    Biarcs,
    /// Straight moves.
    Chords,
}

impl Rung {
    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Rung::Straight => "straight",
            Rung::Nurbs => "as NURBS",
            Rung::Polynomial => "as polynomials",
            Rung::Biarcs => "as biarcs",
            Rung::Chords => "as chords",
        }
    }
}

/// A curve as a control takes it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Lowered {
    /// What it became.
    pub rung: Rung,
    /// Its shapes, in written digits, each starting where the one before it ends.
    pub shapes: Vec<Shape>,
    /// Largest distance from the job's curve after rounding, mm.
    pub error_mm: f64,
}

/// Pieces below which a curve is no longer halved: it has a cusp that nothing smooth follows.
const SMALLEST_MM: f64 = 1e-3;

/// Takes a curve down the ladder NURBS, polynomial, biarcs, straight moves until what is left is within
/// `tolerance_mm` of the curve, the rounding to `format` aside.
///
/// # Errors
/// Not even straight moves stay within the tolerance: the digits are too coarse for it.
pub(crate) fn lower(
    curve: &Curve3,
    abilities: &Abilities,
    format: &LengthFormat,
    tolerance_mm: f64,
) -> Result<Lowered, Refusal> {
    // Rounding a point moves it by no more than half a step along each axis.
    let allowed = tolerance_mm + 0.87 * format.step_mm();
    if 0.87 * format.step_mm() > tolerance_mm {
        return Err(Refusal::new(
            "digits",
            format!(
                "rounding to {} decimals takes more than the tolerance of {tolerance_mm} mm",
                format.digits
            ),
        ));
    }
    let (from, to) = (format.snap_point(&curve.start()), format.snap_point(&curve.end()));
    if curve.knots().degree() == 1 && curve.points().len() == 2 {
        let shapes = if from == to { Vec::new() } else { vec![Shape::Line { from, to }] };
        let error_mm = (from - curve.start()).norm().max((to - curve.end()).norm());
        return Ok(Lowered { rung: Rung::Straight, shapes, error_mm });
    }
    type Attempt = fn(&Curve3, &Abilities, &LengthFormat, f64) -> Option<Vec<Shape>>;
    let rungs: [(Rung, Attempt); 4] = [
        (Rung::Nurbs, as_nurbs),
        (Rung::Polynomial, as_polynomial),
        (Rung::Biarcs, as_biarcs),
        (Rung::Chords, as_chords),
    ];
    let mut least = f64::INFINITY;
    for (rung, attempt) in rungs {
        // An attempt looks at a few places only: where it was too bold, it aims at less.
        for share in [1.0, 0.7, 0.4, 0.1] {
            let Some(shapes) = attempt(curve, abilities, format, share * tolerance_mm) else { break };
            let error_mm = deviation(curve, &shapes);
            if error_mm <= allowed {
                return Ok(Lowered { rung, shapes, error_mm });
            }
            least = least.min(error_mm);
            if rung == Rung::Nurbs {
                break;
            }
        }
    }
    Err(Refusal::new(
        "tolerance",
        format!(
            "the curve can be written within {least:.6} mm only, {allowed:.6} mm are allowed: give it more digits or a larger tolerance_mm"
        ),
    ))
}

/// Whether all control points lie in a plane that the control takes curves in.
fn lies_in(curve: &Curve3, planes: Option<&[Plane]>, format: &LengthFormat) -> bool {
    let Some(planes) = planes else { return true };
    planes.iter().any(|plane| holds(curve, *plane, format))
}

/// Whether a curve's points have one written coordinate across the plane.
pub(crate) fn holds(curve: &Curve3, plane: Plane, format: &LengthFormat) -> bool {
    let k = plane.axes()[2];
    let first = format.snap(curve.points()[0][k]);
    curve.points().iter().all(|p| format.snap(p[k]) == first)
}

/// In the first form that takes the curve within the tolerance.
fn as_nurbs(
    curve: &Curve3,
    abilities: &Abilities,
    format: &LengthFormat,
    tolerance_mm: f64,
) -> Option<Vec<Shape>> {
    let fits = |splines: &&Splines| {
        lies_in(curve, splines.planes.as_deref(), format)
            && curve.knots().degree() <= splines.degrees[1]
            && (curve.weights().is_none() || splines.weights.is_some())
    };
    let allowed = tolerance_mm + 0.87 * format.step_mm();
    let mut forms = abilities.splines.iter().filter(fits).peekable();
    while let Some(splines) = forms.next() {
        match written(curve, splines, format) {
            Some(shapes) if forms.peek().is_none() || deviation(curve, &shapes) <= allowed => {
                return Some(shapes);
            }
            _ => {}
        }
    }
    None
}

fn as_polynomial(
    curve: &Curve3,
    abilities: &Abilities,
    format: &LengthFormat,
    tolerance_mm: f64,
) -> Option<Vec<Shape>> {
    let splines = abilities.splines.first()?;
    if !lies_in(curve, splines.planes.as_deref(), format) || splines.degrees[1] < 3 {
        return None;
    }
    written(&hermite(curve, 0.5 * tolerance_mm)?, splines, format)
}

/// A curve with its knots, points and weights rounded as the control takes them, cut where it takes no longer.
fn written(curve: &Curve3, splines: &Splines, format: &LengthFormat) -> Option<Vec<Shape>> {
    let mut shapes = Vec::new();
    let needs_pieces = splines.pieces || !clamped(curve) || curve.knots().degree() < splines.degrees[0];
    if !needs_pieces && curve.points().len() <= splines.max_points {
        shapes.push(Shape::Spline(rounded(curve, splines, format)?));
    } else if splines.pieces || curve.knots().degree() < splines.degrees[0] || curve.weights().is_some() {
        for piece in curve.bezier_pieces() {
            let mut piece = elevated(&piece, splines.degrees[0])?;
            if splines.halved {
                piece = halved(&piece)?;
            }
            if format.snap_point(&piece.start()) == format.snap_point(&piece.end()) && tiny(&piece, format) {
                continue;
            }
            shapes.push(Shape::Spline(rounded(&piece, splines, format)?));
        }
    } else {
        for part in cut(curve, splines.max_points)? {
            shapes.push(Shape::Spline(rounded(&part, splines, format)?));
        }
    }
    chained(&mut shapes);
    Some(shapes)
}

/// Whether all control points are one written point.
fn tiny(curve: &Curve3, format: &LengthFormat) -> bool {
    let first = format.snap_point(&curve.points()[0]);
    curve.points().iter().all(|p| format.snap_point(p) == first)
}

fn clamped(curve: &Curve3) -> bool {
    let (p, u) = (curve.knots().degree(), curve.knots().as_slice());
    u[0] == u[p] && u[u.len() - 1 - p] == u[u.len() - 1]
}

/// A piece may have been left out as too short: the next one then starts where the one before it ends.
fn chained(shapes: &mut [Shape]) {
    for i in 1..shapes.len() {
        let end = shapes[i - 1].end();
        if let Shape::Spline(curve) = &mut shapes[i]
            && curve.points()[0] != end
        {
            let mut points = curve.points().to_vec();
            points[0] = end;
            if let Ok(moved) =
                Curve3::new(curve.knots().clone(), points, curve.weights().map(<[f64]>::to_vec))
            {
                *curve = moved;
            }
        }
    }
}

/// Cuts a curve without weights at knots so that no part has more than `max_points` points.
fn cut(curve: &Curve3, max_points: usize) -> Option<Vec<Curve3>> {
    let p = curve.knots().degree();
    let pieces = curve.bezier_pieces();
    let per_part = (max_points.checked_sub(1)? / p).max(1);
    let join = |group: &[Curve3]| {
        let mut knots = vec![group[0].domain().0; p + 1];
        let mut points = vec![group[0].points()[0]];
        for piece in group {
            points.extend_from_slice(&piece.points()[1..]);
            knots.extend(vec![piece.domain().1; p]);
        }
        knots.push(group[group.len() - 1].domain().1);
        Curve3::new(KnotVector::new(p, knots).ok()?, points, None).ok()
    };
    pieces.chunks(per_part).map(join).collect()
}

/// The same Bézier curve with a degree of at least `degree` (The NURBS Book, eq. 5.36, one step at a time).
fn elevated(curve: &Curve3, degree: usize) -> Option<Curve3> {
    let mut curve = curve.clone();
    while curve.knots().degree() < degree {
        let p = curve.knots().degree();
        let (a, b) = curve.domain();
        let weight = |i: usize| curve.weights().map_or(1.0, |w| w[i]);
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for i in 0..=p + 1 {
            let share = i as f64 / (p + 1) as f64;
            let (left, right) = (i.saturating_sub(1), i.min(p));
            let (wl, wr) = (share * weight(left), (1.0 - share) * weight(right));
            weights.push(wl + wr);
            points.push(Point3::from(
                (curve.points()[left].coords * wl + curve.points()[right].coords * wr) / (wl + wr),
            ));
        }
        let mut knots = vec![a; p + 2];
        knots.extend(vec![b; p + 2]);
        let weights = curve.weights().is_some().then_some(weights);
        curve = Curve3::new(KnotVector::new(p + 1, knots).ok()?, points, weights).ok()?;
    }
    Some(curve)
}

/// A cubic Bézier curve with a further knot in its middle.
fn halved(curve: &Curve3) -> Option<Curve3> {
    let (a, b) = curve.domain();
    let p = curve.points();
    if p.len() != 4 || curve.weights().is_some() {
        return None;
    }
    let middle = |i: usize| nalgebra::center(&p[i], &p[i + 1]);
    let points = vec![p[0], middle(0), middle(1), middle(2), p[3]];
    let knots = vec![a, a, a, a, 0.5 * (a + b), b, b, b, b];
    Curve3::new(KnotVector::new(3, knots).ok()?, points, None).ok()
}

/// Knots from zero on, points and weights in the digits that the control reads.
fn rounded(curve: &Curve3, splines: &Splines, format: &LengthFormat) -> Option<Curve3> {
    let (a, b) = curve.domain();
    // Knots mean nothing by their size: they are stretched to use the digits that there are.
    let mut scale = 1.0;
    while scale < 1e3 && (b - a) * scale * 10.0 <= splines.largest_knot {
        scale *= 10.0;
    }
    while (b - a) * scale > splines.largest_knot {
        scale *= 0.1;
    }
    let stretched = |k: &f64| (k - a) * scale;
    let exact = |k: f64| (k - round(k, splines.knot_digits)).abs() < 1e-9;
    let knots: Vec<f64> =
        if curve.knots().as_slice().iter().all(|k| exact(k - a)) && b - a <= splines.largest_knot {
            curve.knots().as_slice().iter().map(|k| round(k - a, splines.knot_digits)).collect()
        } else {
            curve.knots().as_slice().iter().map(|k| round(stretched(k), splines.knot_digits)).collect()
        };
    let points = curve.points().iter().enumerate();
    let last = curve.points().len() - 1;
    let snap = |(i, p): (usize, &Point3)| {
        if splines.exact_points && i != 0 && i != last { *p } else { format.snap_point(p) }
    };
    let weights = match (curve.weights(), splines.weights) {
        (None, _) => None,
        (Some(_), None) => return None,
        (Some(w), Some([smallest, largest])) => {
            let top = w.iter().copied().fold(0.0, f64::max);
            let mut factor = 1.0;
            if splines.first_weight_one {
                factor = 1.0 / w[0];
            }
            // A power of two: weights that were exact stay exact, the others use all the digits.
            if !splines.first_weight_one {
                factor = (largest / top).log2().floor().clamp(-60.0, 60.0).exp2();
            }
            let scaled: Vec<f64> = w.iter().map(|w| round(w * factor, splines.weight_digits)).collect();
            if scaled.iter().any(|w| !(smallest..=largest).contains(w)) {
                return None;
            }
            Some(scaled)
        }
    };
    let knots = KnotVector::new(curve.knots().degree(), knots).ok()?;
    Curve3::new(knots, points.map(snap).collect(), weights).ok()
}

/// A cubic without weights, with the curve's points and derivatives at its joints, within `tolerance_mm`.
fn hermite(curve: &Curve3, tolerance_mm: f64) -> Option<Curve3> {
    let mut stations = Vec::new();
    let cubic = |a: f64, b: f64| {
        // Just inside: derivatives may jump at knots.
        let inset = 1e-9 * (b - a);
        let ([p, d, _], [q, e, _]) = (curve.derivatives(a + inset), curve.derivatives(b - inset));
        let third = (b - a) / 3.0;
        [p, p + d * third, q - e * third, q]
    };
    let far = |a: f64, b: f64| {
        let c = cubic(a, b);
        [0.25, 0.5, 0.75].into_iter().any(|s: f64| {
            let r = 1.0 - s;
            let p =
                c[0] * (r * r * r) + c[1] * (3.0 * r * r * s) + c[2] * (3.0 * r * s * s) + c[3] * (s * s * s);
            (p - curve.derivatives(a + (b - a) * s)[0]).norm() > tolerance_mm
        })
    };
    for span in curve.knots().breaks().windows(2) {
        halve(curve, (span[0], span[1]), &far, &mut stations);
    }
    let mut knots = vec![stations.first()?.0; 4];
    let mut points = vec![Point3::from(cubic(stations[0].0, stations[0].1)[0])];
    for &(a, b) in &stations {
        points.extend(cubic(a, b)[1..].iter().map(|&p| Point3::from(p)));
        knots.extend([b; 3]);
    }
    knots.push(stations[stations.len() - 1].1);
    Curve3::new(KnotVector::new(3, knots).ok()?, points, None).ok()
}

/// Cuts `span` in halves until no part is `far` from what stands for it.
fn halve(curve: &Curve3, span: (f64, f64), far: &dyn Fn(f64, f64) -> bool, parts: &mut Vec<(f64, f64)>) {
    let mut waiting = vec![span];
    while let Some((a, b)) = waiting.pop() {
        let middle = 0.5 * (a + b);
        let small = (curve.point(b) - curve.point(a)).norm() < SMALLEST_MM
            && (curve.point(middle) - curve.point(a)).norm() < SMALLEST_MM;
        if !small && far(a, b) {
            waiting.extend([(middle, b), (a, middle)]);
        } else {
            parts.push((a, b));
        }
    }
}

fn as_biarcs(
    curve: &Curve3,
    abilities: &Abilities,
    format: &LengthFormat,
    tolerance_mm: f64,
) -> Option<Vec<Shape>> {
    if !abilities.arcs {
        return None;
    }
    let plane = Plane::ALL.into_iter().find(|plane| holds(curve, *plane, format))?;
    let [i, j, _] = plane.axes();
    let station = |t: f64, side: f64| {
        let d = curve.derivatives(t + side)[1];
        let direction = Vector2::new(d[i], d[j]).try_normalize(1e-12)?;
        Some(Station { point: format.snap_point(&curve.point(t)), direction })
    };
    let pair = |a: f64, b: f64| {
        let inset = 1e-9 * (b - a);
        biarc(&station(a, inset)?, &station(b, -inset)?, plane, format)
    };
    let far = |a: f64, b: f64| {
        let Some(shapes) = pair(a, b) else { return true };
        from_part(curve, a, b, &shapes) > tolerance_mm
    };
    let mut parts = Vec::new();
    for span in curve.knots().breaks().windows(2) {
        halve(curve, (span[0], span[1]), &far, &mut parts);
    }
    let mut shapes = Vec::new();
    for (a, b) in parts {
        let ends = (format.snap_point(&curve.point(a)), format.snap_point(&curve.point(b)));
        match pair(a, b) {
            Some(pair) => shapes.extend(pair),
            None if ends.0 == ends.1 => {}
            None => shapes.push(Shape::Line { from: ends.0, to: ends.1 }),
        }
    }
    Some(shapes)
}

/// Largest distance of a few points of the shapes from the part of the curve that they stand for.
fn from_part(curve: &Curve3, a: f64, b: f64, shapes: &[Shape]) -> f64 {
    let mut largest: f64 = 0.0;
    for s in [0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875] {
        let p = curve.point(a + (b - a) * s);
        let nearest = shapes.iter().map(|shape| distance(shape, &p)).fold(f64::INFINITY, f64::min);
        largest = largest.max(nearest);
    }
    largest
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

fn as_chords(curve: &Curve3, _: &Abilities, format: &LengthFormat, tolerance_mm: f64) -> Option<Vec<Shape>> {
    let far = |a: f64, b: f64| {
        let (p, q) = (curve.point(a), curve.point(b));
        let line = Shape::Line { from: p, to: q };
        [0.25, 0.5, 0.75]
            .into_iter()
            .any(|s| distance(&line, &curve.point(a + (b - a) * s)) > 0.98 * tolerance_mm)
    };
    let mut shapes = Vec::new();
    let mut from = format.snap_point(&curve.start());
    for t in chord_ends(curve, &far) {
        let to = format.snap_point(&curve.point(t));
        if from != to {
            shapes.push(Shape::Line { from, to });
            from = to;
        }
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

/// Ends of chords as long as `far` allows, from one knot to the next.
fn chord_ends(curve: &Curve3, far: &dyn Fn(f64, f64) -> bool) -> Vec<f64> {
    let mut ends = Vec::new();
    for span in curve.knots().breaks().windows(2) {
        let mut halves = Vec::new();
        halve(curve, (span[0], span[1]), far, &mut halves);
        // As many equal parts as the shortest half needs are often too many: try with fewer.
        let (mut low, mut high) = (1, halves.len());
        let fits = |n: usize| {
            let at = |i: usize| span[0] + (span[1] - span[0]) * i as f64 / n as f64;
            (0..n).all(|i| !far(at(i), at(i + 1)))
        };
        while low < high {
            let n = usize::midpoint(low, high);
            if fits(n) { high = n } else { low = n + 1 }
        }
        if low < halves.len() || fits(low) {
            ends.extend((1..=low).map(|i| span[0] + (span[1] - span[0]) * i as f64 / low as f64));
        } else {
            ends.extend(halves.iter().map(|h| h.1));
        }
    }
    ends
}
