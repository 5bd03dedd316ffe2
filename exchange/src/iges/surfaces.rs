//! Surface entities as NURBS.

use claymill_nurbs::analytic::{self, Frame};
use claymill_nurbs::{Curve3, KnotVector, NurbsError, NurbsSurface, Point3, SurfaceKind, Vector3};

use super::curves::{self, level};
use super::fault::Fault;
use super::file::{File, Record};
use super::placement::Placement;

/// The geometry under a face.
#[derive(Debug, Clone)]
pub(crate) enum Carrier {
    /// A bounded surface.
    Bounded {
        surface: NurbsSurface,
        kind: SurfaceKind,
        /// The declared part of the domain, where it is not the whole: `(u0, u1), (v0, v1)`.
        window: Option<Window>,
        /// Whether the file's pcurves are in this surface's parameters.
        own_parameters: bool,
    },
    /// An unbounded plane, mm.
    Plane(Frame),
}

/// A rectangle of parameters.
pub(crate) type Window = ((f64, f64), (f64, f64));

/// Entity types that are surfaces.
pub(crate) fn is_surface(kind: i64) -> bool {
    matches!(kind, 108 | 114 | 118 | 120 | 122 | 128 | 140 | 190 | 192 | 194 | 196 | 198)
}

/// Whether a surface entity is a face where no other entity trims it: the unbounded ones are not.
pub(crate) fn is_face_alone(kind: i64) -> bool {
    matches!(kind, 114 | 118 | 120 | 122 | 128 | 140)
}

/// Reads surface `de`, mapped by `placement`; also gives the property pointers behind its parameters.
pub(crate) fn read(file: &File, de: i64, placement: &Placement) -> Result<(Carrier, Vec<i64>), Fault> {
    let entry = file.entry(de)?;
    let placement = placement.of_entity(file, de)?;
    let mut record = file.record(de)?;
    let r = &mut record;
    let bounded = |surface, kind| (surface, kind, None);
    let (surface, kind, window) = match entry.kind {
        128 => {
            let (surface, window) = b_spline(r)?;
            (surface, SurfaceKind::Nurbs, window)
        }
        118 => bounded(ruled(file, r, entry.form)?, SurfaceKind::Ruled),
        120 => bounded(revolution(file, r)?, SurfaceKind::Revolution),
        122 => bounded(tabulated(file, r)?, SurfaceKind::Extrusion),
        108 => return Ok((Carrier::Plane(placed_plane(r, &placement)?), record.properties())),
        190 => {
            let frame = plane_by_point(file, r, &placement)?;
            return Ok((Carrier::Plane(frame), record.properties()));
        }
        kind if is_surface(kind) => return Err(Fault::Unsupported { de, kind }),
        kind => {
            let wanted = "a surface";
            return Err(Fault::Kind { de, kind, wanted });
        }
    };
    let carrier = Carrier::Bounded {
        surface: placed(&surface, &placement).map_err(|source| Fault::Nurbs { de, source })?,
        kind,
        window,
        own_parameters: entry.kind == 128,
    };
    Ok((carrier, record.properties()))
}

fn placed(surface: &NurbsSurface, placement: &Placement) -> Result<NurbsSurface, NurbsError> {
    let net = surface.net();
    NurbsSurface::new(
        surface.knots_u().clone(),
        surface.knots_v().clone(),
        net.iter().map(|h| placement.point(Point3::from(h.xyz() / h.w))).collect(),
        surface.is_rational().then(|| net.iter().map(|h| h.w).collect()),
    )
}

/// 128. The file runs fastest in `u`, the kernel in `v`.
fn b_spline(record: &mut Record) -> Result<(NurbsSurface, Option<Window>), Fault> {
    let de = record.de;
    let nurbs = |source| Fault::Nurbs { de, source };
    let (last_u, last_v) = (record.count()?, record.count()?);
    let (degree_u, degree_v) = (record.count()?, record.count()?);
    record.skip(5)?;
    let (nu, nv) = (last_u + 1, last_v + 1);
    let knots_u = record.required(nu + degree_u + 1, Record::real)?;
    let knots_v = record.required(nv + degree_v + 1, Record::real)?;
    let count = nu.checked_mul(nv).ok_or(Fault::Ended { de })?;
    let weights = record.required(count, Record::real)?;
    let points = record.required(count, |r| r.reals().map(|[x, y, z]| Point3::new(x, y, z)))?;
    let [u0, u1, v0, v1] = record.reals()?;

    let turned = || (0..nu).flat_map(|i| (0..nv).map(move |j| j * nu + i));
    let surface = NurbsSurface::new(
        KnotVector::new(degree_u, level(knots_u)).map_err(nurbs)?,
        KnotVector::new(degree_v, level(knots_v)).map_err(nurbs)?,
        turned().map(|k| points[k]).collect(),
        Some(turned().map(|k| weights[k]).collect()),
    )
    .map_err(nurbs)?;
    let (whole_u, whole_v) = surface.domain();
    let (part_u, part_v) = (part((u0, u1), whole_u), part((v0, v1), whole_v));
    let window = (part_u.is_some() || part_v.is_some())
        .then_some((part_u.unwrap_or(whole_u), part_v.unwrap_or(whole_v)));
    Ok((surface, window))
}

/// The declared range where it is a real part of the domain. Omitted, reversed and over-long ranges are common
/// and mean the whole.
fn part((a, b): (f64, f64), (whole_a, whole_b): (f64, f64)) -> Option<(f64, f64)> {
    let slack = 1e-9 * (whole_b - whole_a);
    let (low, high) = (a.max(whole_a), b.min(whole_b));
    (high - low > slack && (low > whole_a + slack || high < whole_b - slack)).then_some((low, high))
}

/// The one curve at `de`, in the surface's definition space.
fn single(file: &File, de: i64) -> Result<Curve3, Fault> {
    let mut pieces = curves::read(file, de, &Placement::scale(1.0))?;
    match (pieces.pop(), pieces.is_empty()) {
        (Some(curve), true) => Ok(curve),
        _ => Err(Fault::Unsupported { de, kind: file.entry(de)?.kind }),
    }
}

/// 118: straight lines between two curves, at equal parameters after scaling. Curves with different knots would
/// have to be refined first and are left out.
fn ruled(file: &File, record: &mut Record, form: i64) -> Result<NurbsSurface, Fault> {
    let de = record.de;
    let [first, second, backwards] = [record.integer()?, record.integer()?, record.integer()?];
    let a = single(file, first)?;
    let b = single(file, second)?;
    let b = if backwards == 1 { b.reversed() } else { b };
    let unit = |c: &Curve3| -> Vec<f64> {
        let (t0, t1) = c.domain();
        c.knots().as_slice().iter().map(|k| (k - t0) / (t1 - t0)).collect()
    };
    let (ka, kb) = (unit(&a), unit(&b));
    let same = a.knots().degree() == b.knots().degree()
        && ka.len() == kb.len()
        && ka.iter().zip(&kb).all(|(x, y)| (x - y).abs() <= 1e-12);
    // Form 0 pairs points by arc length: the same thing for straight lines.
    let straight = a.knots().degree() == 1 && a.points().len() == 2;
    if !same || (form == 0 && !straight) {
        return Err(Fault::Unsupported { de, kind: 118 });
    }
    let nurbs = |source| Fault::Nurbs { de, source };
    let weight = |c: &Curve3, i: usize| c.weights().map_or(1.0, |w| w[i]);
    let pairs = || (0..a.points().len()).flat_map(|i| [(&a, i), (&b, i)]);
    NurbsSurface::new(
        KnotVector::new(a.knots().degree(), ka).map_err(nurbs)?,
        KnotVector::clamped_uniform(1, 2),
        pairs().map(|(c, i)| c.points()[i]).collect(),
        Some(pairs().map(|(c, i)| weight(c, i)).collect()),
    )
    .map_err(nurbs)
}

/// 120: a generatrix turned about a line.
fn revolution(file: &File, record: &mut Record) -> Result<NurbsSurface, Fault> {
    let de = record.de;
    let (axis, generatrix) = (record.integer()?, record.integer()?);
    let [from, to] = record.reals()?;
    let axis = single(file, axis)?;
    let generatrix = single(file, generatrix)?;
    let to = if to > from { to } else { to + std::f64::consts::TAU };
    analytic::revolution(&generatrix, &axis.start(), &(axis.end() - axis.start()), (from, to))
        .map_err(|source| Fault::Nurbs { de, source })
}

/// 122: a directrix moved along a line that starts at its first point.
fn tabulated(file: &File, record: &mut Record) -> Result<NurbsSurface, Fault> {
    let de = record.de;
    let directrix = single(file, record.integer()?)?;
    let [x, y, z] = record.reals()?;
    let direction = Point3::new(x, y, z) - directrix.start();
    analytic::extrusion(&directrix, &direction, (0.0, 1.0)).map_err(|source| Fault::Nurbs { de, source })
}

/// 108: `a x + b y + c z = d`.
fn placed_plane(record: &mut Record, placement: &Placement) -> Result<Frame, Fault> {
    let de = record.de;
    let [a, b, c, d] = record.reals()?;
    let normal = Vector3::new(a, b, c);
    let foot = Point3::from(normal * (d / normal.norm_squared()));
    frame(de, placement, foot, normal)
}

/// 190: a point (116) and a direction (123).
fn plane_by_point(file: &File, record: &mut Record, placement: &Placement) -> Result<Frame, Fault> {
    let de = record.de;
    let (location, normal) = (record.integer()?, record.integer()?);
    let triple = |de: i64, kind: i64, wanted: &'static str| {
        let found = file.entry(de)?.kind;
        if found != kind {
            return Err(Fault::Kind { de, kind: found, wanted });
        }
        file.record(de)?.reals::<3>()
    };
    let location = Point3::from(triple(location, 116, "a point")?);
    let normal = Vector3::from(triple(normal, 123, "a direction")?);
    frame(de, placement, location, normal)
}

/// The plane's frame in model space. The normal is rebuilt from two mapped directions, which stays right under
/// scaling and mirroring.
fn frame(de: i64, placement: &Placement, origin: Point3, normal: Vector3) -> Result<Frame, Fault> {
    let what = "the plane has no normal";
    let lost = || Fault::Geometry { de, what };
    let local = Frame::new(origin, normal, Vector3::zeros()).ok_or_else(lost)?;
    let (x, y) = (placement.vector(local.x), placement.vector(local.y));
    Frame::new(placement.point(origin), x.cross(&y), x).ok_or_else(lost)
}
