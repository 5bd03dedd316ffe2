//! Curve objects as exact NURBS. Curves in a parameter plane are the same objects with `z = 0`.

use claymill_nurbs::analytic::{self, Frame};
use claymill_nurbs::{Curve3, KnotVector, NurbsError, Point3, Vector3};

use crate::bezier;
use crate::subcurve::{mapped, subcurve};
use crate::warp::Warp;

use super::archive::Reader;
use super::class::{self, Class, Object};
use super::fault::Fault;

/// Polycurves are nested no deeper than this.
const DEEPEST: usize = 8;
/// Parameters nearer than this part of a domain are the same.
const SAME_PARAMETER: f64 = 1e-9;

/// A curve of the archive.
#[derive(Debug, Clone)]
pub(super) struct Native {
    /// File units, on the domain that the archive gives the curve.
    pub(super) curve: Curve3,
    /// From the archive's parameters to the curve's.
    pub(super) warp: Warp,
}

impl Native {
    fn plain(curve: Curve3) -> Self {
        Native { curve, warp: Warp::default() }
    }

    /// The part between two of the archive's parameters; the whole for an interval that is none.
    pub(super) fn part(&self, (a, b): (f64, f64)) -> Result<Curve3, NurbsError> {
        let (t0, t1) = self.curve.domain();
        let slack = SAME_PARAMETER * (t1 - t0);
        let whole = a <= t0 + slack && b >= t1 - slack;
        if whole || b.is_nan() || a.is_nan() || b - a <= slack {
            return Ok(self.curve.clone());
        }
        subcurve(&self.curve, self.warp.at(a.max(t0)).0, self.warp.at(b.min(t1)).0)
    }

    /// The curve laid onto another domain.
    fn on(self, to: (f64, f64)) -> Result<Self, NurbsError> {
        let from = self.curve.domain();
        if from == to {
            return Ok(self);
        }
        let scale = (to.1 - to.0) / (from.1 - from.0);
        let at = |t: &f64| match *t {
            t if t == from.1 => to.1,
            t => to.0 + (t - from.0) * scale,
        };
        let mut knots: Vec<f64> = self.curve.knots().as_slice().iter().map(at).collect();
        for i in 1..knots.len() {
            // Rounding must not make the end overtaken by the knot before it.
            knots[i] = knots[i].max(knots[i - 1]);
        }
        let weights = self.curve.weights().map(<[f64]>::to_vec);
        let knots = KnotVector::new(self.curve.knots().degree(), knots)?;
        let curve = Curve3::new(knots, self.curve.points().to_vec(), weights)?;
        Ok(Native { curve, warp: self.warp.moved(from, to) })
    }
}

/// Reads a curve object.
pub(super) fn read(object: Object) -> Result<Native, Fault> {
    nested(object, 0)
}

/// The curve object that comes next.
pub(super) fn next(r: &mut Reader) -> Result<Native, Fault> {
    read(class::object(r)?)
}

fn nested(Object { class, data: mut r }: Object, depth: usize) -> Result<Native, Fault> {
    if depth > DEEPEST {
        return Err(Fault::Nested);
    }
    let (major, minor) = r.version()?;
    if major != 1 {
        return Err(Fault::Version { what: class.name(), version: major });
    }
    let native = match class {
        Class::NurbsCurve => Native::plain(nurbs(&mut r, minor)?),
        Class::PolyCurve => polycurve(&mut r, depth)?,
        Class::PolylineCurve => Native::plain(polyline(&mut r)?),
        Class::LineCurve => Native::plain(line(&mut r)?),
        Class::ArcCurve => arc(&mut r)?,
        Class::CurveOnSurface => return Err(Fault::Geometry("a curve is stored as a curve on a surface")),
        _ => {
            let at = r.position();
            return Err(Fault::Found { at, found: format!("a {}", class.name()), wanted: "a curve" });
        }
    };
    r.finish()?;
    Ok(native)
}

/// Reads a count of knots and the knots. The archive leaves out the first and the last, which no point of the
/// curve depends on.
pub(super) fn knots(r: &mut Reader, degree: usize) -> Result<KnotVector, Fault> {
    let mut knots = r.list(8, Reader::real)?;
    if let (Some(first), Some(last)) = (knots.first().copied(), knots.last().copied()) {
        knots.insert(0, first);
        knots.push(last);
    }
    Ok(KnotVector::new(degree, knots)?)
}

/// The degree, stored as order.
pub(super) fn degree(r: &mut Reader) -> Result<usize, Fault> {
    let at = r.position();
    let order = r.integer()?;
    let wanted = "the order of a curve or surface";
    let degree = usize::try_from(order).ok().and_then(|o| o.checked_sub(1));
    degree.ok_or_else(|| Fault::Found { at, found: order.to_string(), wanted })
}

/// A control point with the number of coordinates that the archive stores and, when rational, its weight; the
/// coordinates are multiplied by it.
pub(super) fn control_point(
    r: &mut Reader,
    dimension: usize,
    rational: bool,
) -> Result<(Point3, Option<f64>), Fault> {
    let mut p = Point3::origin();
    for k in 0..dimension {
        p[k] = r.real()?;
    }
    if !rational {
        return Ok((p, None));
    }
    let weight = r.real()?;
    Ok((p / weight, Some(weight)))
}

/// The number of coordinates: two or three.
pub(super) fn dimension(r: &mut Reader) -> Result<usize, Fault> {
    let at = r.position();
    match r.integer()? {
        2 => Ok(2),
        3 => Ok(3),
        other => Err(Fault::Found { at, found: other.to_string(), wanted: "a dimension of 2 or 3" }),
    }
}

fn nurbs(r: &mut Reader, minor: u8) -> Result<Curve3, Fault> {
    let dimension = dimension(r)?;
    let rational = r.integer()? != 0;
    let degree = degree(r)?;
    let _point_count = r.integer()?;
    let _reserved = r.take(8)?;
    let _bounds = r.reals::<6>()?;
    let knots = knots(r, degree)?;
    let (points, weights): (Vec<_>, Vec<_>) = r
        .list(8 * (dimension + usize::from(rational)), |r| control_point(r, dimension, rational))?
        .into_iter()
        .unzip();
    if minor >= 1 {
        r.flag()?;
    }
    Ok(Curve3::new(knots, points, weights.into_iter().collect())?)
}

fn polyline(r: &mut Reader) -> Result<Curve3, Fault> {
    let points = r.list(24, |r| r.reals::<3>().map(Point3::from))?;
    let mut parameters = r.list(8, Reader::real)?;
    let _dimension = r.integer()?;
    if let (Some(first), Some(last)) = (parameters.first().copied(), parameters.last().copied()) {
        parameters.insert(0, first);
        parameters.push(last);
    }
    Ok(Curve3::new(KnotVector::new(1, parameters)?, points, None)?)
}

fn line(r: &mut Reader) -> Result<Curve3, Fault> {
    let (from, to) = (r.reals::<3>()?, r.reals::<3>()?);
    let [t0, t1] = r.reals()?;
    let _dimension = r.integer()?;
    Ok(analytic::segment(Point3::from(from), Point3::from(to), (t0, t1))?)
}

/// A plane as origin, three axes and equation.
pub(super) fn plane(r: &mut Reader) -> Result<Frame, Fault> {
    let origin = Point3::from(r.reals::<3>()?);
    let [x, y, _z] = [r.reals::<3>()?, r.reals::<3>()?, r.reals::<3>()?].map(Vector3::from);
    let _equation = r.reals::<4>()?;
    Frame::new(origin, x.cross(&y), x).ok_or(Fault::Geometry("a plane has no normal"))
}

fn arc(r: &mut Reader) -> Result<Native, Fault> {
    let frame = plane(r)?;
    let radius = r.real()?;
    // Three points of the circle, which the plane and the radius give as well.
    let _points = r.reals::<9>()?;
    let [from, to] = r.reals()?;
    let [t0, t1] = r.reals()?;
    let _dimension = r.integer()?;
    let curve = analytic::circle_arc(&frame, radius, (from, to))?;
    let warp = Warp::of_arc(&curve.knots().breaks(), to - from);
    Ok(Native { curve, warp }.on((t0, t1))?)
}

/// The pieces of a polycurve, or the one curve that another object is.
pub(super) fn pieces(object: Object) -> Result<Vec<Native>, Fault> {
    let Object { class: Class::PolyCurve, data: mut r } = object else { return Ok(vec![read(object)?]) };
    let (version, _) = r.version()?;
    if version != 1 {
        return Err(Fault::Version { what: "a polycurve", version });
    }
    segments(&mut r, 0)
}

fn segments(r: &mut Reader, depth: usize) -> Result<Vec<Native>, Fault> {
    let at = r.position();
    let count = r.integer()?;
    let _reserved = r.take(8)?;
    let _bounds = r.reals::<6>()?;
    let parameters = r.list(8, Reader::real)?;
    if usize::try_from(count).ok().and_then(|n| n.checked_add(1)) != Some(parameters.len()) || count < 1 {
        let wanted = "the number of pieces of a polycurve";
        return Err(Fault::Found { at, found: count.to_string(), wanted });
    }
    let piece = |w: &[f64]| Ok(nested(class::object(r)?, depth + 1)?.on((w[0], w[1]))?);
    parameters.windows(2).map(piece).collect()
}

fn polycurve(r: &mut Reader, depth: usize) -> Result<Native, Fault> {
    let mut warp = Warp::default();
    let mut curves = Vec::new();
    for piece in segments(r, depth)? {
        warp.extend(piece.warp);
        curves.push(piece.curve);
    }
    let empty = Fault::Geometry("a polycurve has no pieces");
    Ok(Native { curve: bezier::chained(&curves).ok_or(empty)??, warp })
}

/// A curve of the parameter plane.
pub(super) fn flat(curve: &Curve3) -> Result<claymill_nurbs::Curve2, NurbsError> {
    mapped(curve, Point3::xy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chained_curves_keep_their_shape_and_their_parameters() {
        let line = analytic::segment(Point3::new(-3.0, 1.0, 0.0), Point3::new(0.0, 1.0, 0.0), (-2.0, 0.0));
        let frame = Frame::new(Point3::origin(), -Vector3::z(), Vector3::y()).unwrap();
        let arc = analytic::circle_arc(&frame, 1.0, (0.0, 2.0)).unwrap();
        let warp = Warp::of_arc(&arc.knots().breaks(), 2.0);
        let arc = Native { curve: arc, warp }.on((0.0, 5.0)).unwrap();
        let end = arc.curve.end();
        let cubic = Curve3::new(
            KnotVector::new(3, vec![5.0, 5.0, 5.0, 5.0, 6.0, 7.0, 7.0, 7.0, 7.0]).unwrap(),
            (0..5)
                .map(|i| end + Vector3::new(f64::from(i), f64::from(i * i) * 0.3, 0.5 * f64::from(i)))
                .collect(),
            None,
        )
        .unwrap();
        let pieces = vec![line.unwrap(), arc.curve.clone(), cubic];
        let whole = bezier::chained(&pieces).unwrap().unwrap();
        assert_eq!((whole.knots().degree(), whole.domain()), (3, (-2.0, 7.0)));
        for piece in &pieces {
            let (a, b) = piece.domain();
            for i in 0..=20 {
                let t = a + (b - a) * f64::from(i) / 20.0;
                approx::assert_abs_diff_eq!(whole.point(t), piece.point(t), epsilon = 1e-12);
            }
        }
        for i in 0..=20 {
            let part = f64::from(i) / 20.0;
            let p = whole.point(arc.warp.at(5.0 * part).0);
            approx::assert_abs_diff_eq!(
                p,
                frame.point((2.0 * part).cos(), (2.0 * part).sin(), 0.0),
                epsilon = 1e-12
            );
        }
    }
}
