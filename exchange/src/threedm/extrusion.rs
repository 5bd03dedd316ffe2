//! Extrusion objects: plane profiles moved along a line, with mitred ends and caps.

use claymill_nurbs::analytic::{self, Frame};
use claymill_nurbs::{Curve2, Curve3, KnotVector, NurbsSurface, Point2, Point3, SurfaceKind, Vector3};
use nalgebra::{Matrix2, Vector2};

use crate::subcurve::{mapped, subcurve};

use super::archive::{ANONYMOUS, Reader};
use super::body::{Body, RawFace, Trim};
use super::class;
use super::context::Context;
use super::curves;
use super::fault::Fault;
use super::surfaces::Carrier;

/// Mitre normals flatter than this over the profile's plane are ignored, as the archive's own code does.
const STEEPEST_MITRE: f64 = 1.0 / 64.0;
/// Ends of a closed profile meet within this part of its size.
const CLOSED: f64 = 1e-6;
/// Profiles are parted where their direction turns by more than one degree.
const KINK_COSINE: f64 = 0.999_847_695_156_391_3;

/// Reads the data of an extrusion.
pub(super) fn read(mut r: Reader, context: &Context) -> Result<Body, Fault> {
    let (mut part, minor) = r.long_part(ANONYMOUS, "an extrusion")?;
    let r = &mut part;
    let profile = class::object(r)?;
    let path = [r.reals::<3>()?, r.reals::<3>()?].map(Point3::from);
    let range = r.reals::<2>()?;
    let up = Vector3::from(r.reals::<3>()?);
    let mitred = [r.flag()?, r.flag()?];
    let normals = [r.reals::<3>()?, r.reals::<3>()?].map(Vector3::from);
    let domain = r.reals::<2>()?;
    let transposed = r.flag()?;
    let profile_count = if minor >= 1 { r.integer()? } else { 1 };
    let capped = if minor >= 2 { Some([r.flag()?, r.flag()?]) } else { None };

    let axis = path[1] - path[0];
    let bad = || Fault::Geometry("an extrusion has no direction");
    let end = |k: usize| -> Result<End, Fault> {
        let origin = path[0] + axis * range[k];
        let frame = Frame::new(origin, axis, up.cross(&axis)).ok_or_else(bad)?;
        Ok(End::new(frame, mitred[k].then_some(normals[k])))
    };
    let ends = [end(0)?, end(1)?];
    // Holes are the further pieces of a polycurve, apart in space.
    let profiles = if profile_count > 1 { curves::pieces(profile)? } else { vec![curves::read(profile)?] };
    let profiles: Vec<Curve3> = profiles.into_iter().map(|p| p.curve).collect();
    let closed = profiles.iter().all(is_closed);
    let capped = capped.unwrap_or([closed; 2]);
    let knots = KnotVector::new(1, vec![domain[0], domain[0], domain[1], domain[1]])?;

    let mut body = Body { surfaces: Vec::new(), faces: Vec::new() };
    let mut add = |surface: Carrier, loops, reversed| {
        body.faces.push(Ok(RawFace { surface: body.surfaces.len(), loops, reversed, colour: None }));
        body.surfaces.push(Ok(surface));
    };
    for profile in &profiles {
        for piece in smooth_pieces(profile)? {
            context.spend(2 * piece.points().len())?;
            let wall = Carrier::plain(wall(&piece, &ends, &knots)?, SurfaceKind::Extrusion);
            add(if transposed { wall.transposed() } else { wall }, Vec::new(), false);
        }
    }
    for (k, end) in ends.iter().enumerate().filter(|(k, _)| closed && capped[*k]) {
        let (plane, loops) = end.cap(&profiles, context)?;
        add(plane, loops, (k == 0) != transposed);
    }
    Ok(body)
}

/// One end of the path: where a point of the profile's plane goes.
struct End {
    /// The plane of the end; its axis points along the path, or along the mitre's normal.
    plane: Frame,
    /// From the profile's plane to this one.
    stretch: Matrix2<f64>,
}

impl End {
    /// A mitre turns the plane about the line that it shares with the profile's plane; the profile is stretched
    /// across that line so that along the path it looks as before.
    fn new(frame: Frame, normal: Option<Vector3>) -> Self {
        let square = End { plane: frame, stretch: Matrix2::identity() };
        let Some(normal) = normal.and_then(|n| n.try_normalize(0.0)).filter(|n| n.z > STEEPEST_MITRE) else {
            return square;
        };
        let Some(shared) = Vector2::new(-normal.y, normal.x).try_normalize(f64::EPSILON) else {
            return square;
        };
        let line = nalgebra::Unit::new_unchecked(Vector3::new(shared.x, shared.y, 0.0));
        let turn = nalgebra::Rotation3::from_axis_angle(&line, normal.z.clamp(-1.0, 1.0).acos());
        let world = |v: Vector3| frame.x * v.x + frame.y * v.y + frame.z * v.z;
        let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()].map(|v| world(turn * v));
        let across = Vector2::new(shared.y, -shared.x);
        let stretch = shared * shared.transpose() + across * across.transpose() / normal.z;
        End { plane: Frame { x, y, z, ..frame }, stretch }
    }

    fn flat(&self, p: &Point3) -> Point2 {
        Point2::from(self.stretch * p.coords.xy())
    }

    fn point(&self, p: &Point3) -> Point3 {
        let q = self.flat(p);
        self.plane.point(q.x, q.y, 0.0)
    }

    /// The plane inside the profiles.
    fn cap(&self, profiles: &[Curve3], context: &Context) -> Result<(Carrier, Vec<Vec<Trim>>), Fault> {
        let (mut low, mut high) = (Point2::new(f64::INFINITY, f64::INFINITY), Point2::origin());
        high -= low.coords;
        let mut loops = Vec::new();
        for profile in profiles {
            context.spend(profile.points().len())?;
            let pcurve: Curve2 = mapped(profile, |p| self.flat(p))?;
            for p in pcurve.points() {
                (low, high) = (low.inf(p), high.sup(p));
            }
            loops.push(vec![Trim { pcurve, edge: None }]);
        }
        let surface = analytic::plane_patch(&self.plane, (low.x, high.x), (low.y, high.y))?;
        Ok((Carrier::plain(surface, SurfaceKind::Plane), loops))
    }
}

fn is_closed(profile: &Curve3) -> bool {
    let size = profile.points().iter().map(|p| (p - profile.points()[0]).norm()).fold(0.0, f64::max);
    (profile.end() - profile.start()).norm() <= CLOSED * size
}

/// The profile cut where it turns sharply.
fn smooth_pieces(profile: &Curve3) -> Result<Vec<Curve3>, Fault> {
    let degree = profile.knots().degree();
    let (from, to) = profile.domain();
    let breaks = profile.knots().breaks();
    let width = |i: usize| (breaks[i + 1] - breaks[i]) * 1e-9;
    let turns = |i: &usize| {
        let t = breaks[*i];
        if profile.knots().multiplicity(t) < degree {
            return false;
        }
        let slope = |t: f64| profile.derivatives(t)[1].try_normalize(0.0);
        let (before, behind) = (slope(t - width(i - 1)), slope(t + width(*i)));
        before.zip(behind).is_some_and(|(a, b)| a.dot(&b) < KINK_COSINE)
    };
    let mut cuts = vec![from];
    cuts.extend((1..breaks.len() - 1).filter(turns).map(|i| breaks[i]));
    cuts.push(to);
    cuts.windows(2).map(|w| Ok(subcurve(profile, w[0], w[1])?)).collect()
}

/// The profile at both ends, joined by straight lines.
fn wall(profile: &Curve3, ends: &[End; 2], knots: &KnotVector) -> Result<NurbsSurface, Fault> {
    let points = profile.points().iter().flat_map(|p| ends.iter().map(move |e| e.point(p))).collect();
    let weights = profile.weights().map(|w| w.iter().flat_map(|w| [*w, *w]).collect());
    Ok(NurbsSurface::new(profile.knots().clone(), knots.clone(), points, weights)?)
}
