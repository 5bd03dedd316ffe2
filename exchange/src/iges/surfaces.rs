//! Surface entities as NURBS.

use claymill_nurbs::analytic::{self, Frame};
use claymill_nurbs::{Curve3, KnotVector, NurbsError, NurbsSurface, Point3, SurfaceKind, Vector3};

use crate::arc_length::ArcLength;
use crate::offset::{OFFSET_MM, WORST_OFFSET_MM};
use crate::warp::Warp;
use crate::{bezier, chart};

use super::curves::{self, level};
use super::fault::Fault;
use super::file::{File, Record};
use super::placement::Placement;
use super::quadrics;

/// Offset surfaces nest no deeper than this.
const DEEPEST: usize = 8;

/// The geometry under a face.
#[derive(Debug)]
pub(crate) enum Carrier {
    /// A bounded surface.
    Bounded {
        surface: NurbsSurface,
        kind: SurfaceKind,
        /// The declared part of the domain, where it is not the whole: `(u0, u1), (v0, v1)`.
        window: Option<Window>,
        /// From the parameters of the file's pcurves to this surface's; `None` where that is not known.
        warps: Option<[Warp; 2]>,
        /// How far the surface is from what the file describes, mm; 0 when it is the same.
        deviation_mm: f64,
    },
    /// An unbounded plane, mm.
    Plane(Frame),
    /// A surface with a frame, mm: it closes on itself.
    Chart { carrier: chart::Carrier, kind: SurfaceKind },
}

/// A rectangle of parameters.
pub(crate) type Window = ((f64, f64), (f64, f64));

/// Entity types that are surfaces.
pub(crate) fn is_surface(kind: i64) -> bool {
    matches!(kind, 108 | 114 | 118 | 120 | 122 | 128 | 140 | 190 | 192 | 194 | 196 | 198)
}

/// Whether a surface entity is a face where no other entity trims it: the unbounded ones are not.
pub(crate) fn is_face_alone(kind: i64) -> bool {
    matches!(kind, 114 | 118 | 120 | 122 | 128 | 140 | 196 | 198)
}

/// Reads surface `de`, mapped by `placement`; also gives the property pointers behind its parameters.
pub(crate) fn read(file: &File, de: i64, placement: &Placement) -> Result<(Carrier, Vec<i64>), Fault> {
    nested(file, de, placement, DEEPEST)
}

fn nested(file: &File, de: i64, placement: &Placement, depth: usize) -> Result<(Carrier, Vec<i64>), Fault> {
    let depth = depth.checked_sub(1).ok_or(Fault::Nested { de })?;
    let entry = file.entry(de)?;
    let placement = placement.of_entity(file, de)?;
    let mut record = file.record(de)?;
    let r = &mut record;
    let exact = |surface, kind| (surface, kind, None, 0.0);
    let mut warps = matches!(entry.kind, 114 | 128).then(<[Warp; 2]>::default);
    let (surface, kind, window, deviation_mm) = match entry.kind {
        128 => {
            let (surface, window) = b_spline(r)?;
            (surface, SurfaceKind::Nurbs, window, 0.0)
        }
        114 => exact(parametric_spline(r)?, SurfaceKind::Spline),
        118 => {
            let (surface, deviation) = ruled(file, r, entry.form)?;
            (surface, SurfaceKind::Ruled, None, deviation)
        }
        120 => {
            let (surface, of_angles) = revolution(file, r)?;
            warps = Some(of_angles);
            exact(surface, SurfaceKind::Revolution)
        }
        122 => exact(tabulated(file, r)?, SurfaceKind::Extrusion),
        108 => return Ok((Carrier::Plane(quadrics::plane(r, &placement)?), record.properties())),
        190 => {
            let frame = quadrics::plane_by_point(file, r, &placement)?;
            return Ok((Carrier::Plane(frame), record.properties()));
        }
        192 | 194 | 196 | 198 => {
            let (carrier, kind) = quadrics::quadric(file, r, entry.kind, entry.form, &placement)?;
            return Ok((Carrier::Chart { carrier, kind }, record.properties()));
        }
        140 => return Ok((offset(file, r, &placement, depth)?, record.properties())),
        kind => {
            let wanted = "a surface";
            return Err(Fault::Kind { de, kind, wanted });
        }
    };
    let carrier = Carrier::Bounded {
        surface: placed(&surface, &placement).map_err(|source| Fault::Nurbs { de, source })?,
        kind,
        window,
        warps,
        deviation_mm,
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

/// The curve at `de` in the surface's definition space; pieces become one.
fn single(file: &File, de: i64) -> Result<Curve3, Fault> {
    let pieces = curves::read(file, de, &Placement::scale(1.0))?;
    let whole = bezier::chained(&pieces).ok_or(Fault::Unsupported { de, kind: file.entry(de)?.kind })?;
    whole.map_err(|source| Fault::Nurbs { de, source })
}

/// 118: straight lines between two curves, at equal shares of their length (form 0) or at equal parameters. Gives
/// the deviation too.
fn ruled(file: &File, record: &mut Record, form: i64) -> Result<(NurbsSurface, f64), Fault> {
    let de = record.de;
    let [first, second, backwards] = [record.integer()?, record.integer()?, record.integer()?];
    let a = single(file, first)?;
    let b = single(file, second)?;
    let b = if backwards == 1 { b.reversed() } else { b };
    let nurbs = |source| Fault::Nurbs { de, source };
    if form == 1 || paced_alike(&a, &b) {
        return bezier::ruled(&a, &b).map(|s| (s, 0.0)).map_err(nurbs);
    }
    let even = |c: &Curve3| ArcLength::new(c).unrolled(OFFSET_MM).map_err(nurbs);
    let ((a, off_a), (b, off_b)) = (even(&a)?, even(&b)?);
    bezier::ruled(&a, &b).map(|s| (s, off_a.max(off_b))).map_err(nurbs)
}

/// Whether equal parameters are equal shares of length, so that both forms mean the same: so it is with lines, and
/// with arcs of one sweep.
fn paced_alike(a: &Curve3, b: &Curve3) -> bool {
    const SAMPLES: u32 = 24;
    let shares = [a, b].map(|c| {
        let (low, high) = c.domain();
        let by_length = ArcLength::new(c);
        (1..SAMPLES)
            .map(move |i| low + (high - low) * f64::from(i) / f64::from(SAMPLES))
            .map(|t| by_length.share(t))
            .collect::<Vec<_>>()
    });
    shares[0].iter().zip(&shares[1]).all(|(x, y)| (x - y).abs() <= 1e-7)
}

/// 114: bicubic pieces in powers. Behind each row of pieces, and behind the last row, the file holds values
/// without meaning.
fn parametric_spline(record: &mut Record) -> Result<NurbsSurface, Fault> {
    let de = record.de;
    record.skip(2)?;
    let (m, n) = (record.count()?, record.count()?);
    let breaks_u = record.required(m.saturating_add(1), Record::real)?;
    let breaks_v = record.required(n.saturating_add(1), Record::real)?;
    let nurbs = |source| Fault::Nurbs { de, source };
    let (knots_u, knots_v) =
        (curves::bezier_knots(&breaks_u).map_err(nurbs)?, curves::bezier_knots(&breaks_v).map_err(nurbs)?);
    let columns = knots_v.point_count();
    // Each value takes a byte at least, if only for its delimiter.
    if m.saturating_mul(n).saturating_mul(48) > record.bytes_left() {
        return Err(Fault::Ended { de });
    }
    let mut points = vec![Point3::origin(); knots_u.point_count().saturating_mul(columns)];
    for i in 0..m {
        let hu = breaks_u[i + 1] - breaks_u[i];
        for j in 0..n {
            let hv = breaks_v[j + 1] - breaks_v[j];
            let coefficients = record.required(48, Record::real)?;
            for (axis, powers) in coefficients.chunks(16).enumerate() {
                // Row k holds the powers of u that go with v to the k.
                let rows: Vec<[f64; 4]> = (powers.chunks(4).enumerate())
                    .map(|(k, c)| {
                        let scaled = [0, 1, 2, 3].map(|l| c[l] * hu.powi(l as i32) * hv.powi(k as i32));
                        curves::bezier_from_powers(scaled)
                    })
                    .collect();
                for a in 0..4 {
                    let column = curves::bezier_from_powers([0, 1, 2, 3].map(|k| rows[k][a]));
                    for (b, value) in column.into_iter().enumerate() {
                        points[(3 * i + a) * columns + 3 * j + b][axis] = value;
                    }
                }
            }
        }
        record.skip(48)?;
    }
    NurbsSurface::new(knots_u, knots_v, points, None).map_err(nurbs)
}

/// 140: the parallel surface of another, on the side of an indicator vector. Lengths in millimetres.
fn offset(file: &File, record: &mut Record, placement: &Placement, depth: usize) -> Result<Carrier, Fault> {
    let de = record.de;
    let [x, y, z, distance] = record.reals()?;
    let base = record.integer()?;
    let (base, _) = nested(file, base, placement, depth)?;
    let what = "its matrix stretches it unevenly";
    let mm = placement.uniform_scale().ok_or(Fault::Geometry { de, what })?;
    let indicator = placement.vector(Vector3::new(x, y, z));
    let signed = |normal: Vector3| distance * mm * if normal.dot(&indicator) < 0.0 { -1.0 } else { 1.0 };
    let what = "the offset surface vanishes";
    match base {
        Carrier::Plane(frame) => {
            let origin = frame.origin + frame.z * signed(frame.z);
            Ok(Carrier::Plane(Frame { origin, ..frame }))
        }
        Carrier::Chart { carrier: chart::Carrier::Quadric { frame, quadric }, kind } => {
            // The indicator stands where angles start, on the equator.
            let (quadric, along) = quadric.offset(signed(frame.x)).ok_or(Fault::Geometry { de, what })?;
            let frame = Frame { origin: frame.origin + frame.z * along, ..frame };
            Ok(Carrier::Chart { carrier: chart::Carrier::Quadric { frame, quadric }, kind })
        }
        Carrier::Chart { .. } => Err(Fault::Unsupported { de, kind: 140 }),
        Carrier::Bounded { surface, window, warps, .. } => {
            let ((u0, u1), (v0, v1)) = surface.domain();
            let at = |x: f64, y: f64| surface.normal(u0 + (u1 - u0) * x, v0 + (v1 - v0) * y);
            // The standard puts the indicator at the middle; a normal that is across it says nothing.
            let places = [(0.5, 0.5), (0.0, 0.0), (1.0, 1.0), (0.25, 0.75), (0.75, 0.25)];
            let normals = places.iter().filter_map(|p| at(p.0, p.1)).map(|n| n.0);
            let telling = normals.max_by(|a, b| a.dot(&indicator).abs().total_cmp(&b.dot(&indicator).abs()));
            let normal = telling.ok_or(Fault::NoArea)?;
            let (surface, deviation_mm) = crate::offset::surface(&surface, signed(normal), OFFSET_MM)
                .map_err(|source| Fault::Nurbs { de, source })?;
            if deviation_mm > WORST_OFFSET_MM {
                let what = "the offset surface folds or has creases";
                return Err(Fault::Geometry { de, what });
            }
            let kind = SurfaceKind::Offset;
            Ok(Carrier::Bounded { surface, kind, window, warps, deviation_mm })
        }
    }
}

/// 120: a generatrix (along `u`) turned about a line (along `v`, by angle); and where its parameters differ.
fn revolution(file: &File, record: &mut Record) -> Result<(NurbsSurface, [Warp; 2]), Fault> {
    let de = record.de;
    let (axis, generatrix_de) = (record.integer()?, record.integer()?);
    let [from, to] = record.reals()?;
    let axis = single(file, axis)?;
    let generatrix = single(file, generatrix_de)?;
    let to = if to > from { to } else { to + std::f64::consts::TAU };
    let surface = analytic::revolution(&generatrix, &axis.start(), &(axis.end() - axis.start()), (from, to))
        .map_err(|source| Fault::Nurbs { de, source })?
        .transposed();
    let along = match file.entry(generatrix_de)?.kind {
        100 => {
            let (start, end) = generatrix.domain();
            Warp::of_arc(&generatrix.knots().breaks(), end - start)
        }
        _ => Warp::default(),
    };
    let round = Warp::of_arc(&surface.knots_v().breaks(), to - from);
    Ok((surface, [along, round]))
}

/// 122: a directrix moved along a line that starts at its first point.
fn tabulated(file: &File, record: &mut Record) -> Result<NurbsSurface, Fault> {
    let de = record.de;
    let directrix = single(file, record.integer()?)?;
    let [x, y, z] = record.reals()?;
    let direction = Point3::new(x, y, z) - directrix.start();
    analytic::extrusion(&directrix, &direction, (0.0, 1.0)).map_err(|source| Fault::Nurbs { de, source })
}
