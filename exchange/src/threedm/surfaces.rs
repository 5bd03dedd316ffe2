//! Surface objects as exact NURBS.

use claymill_nurbs::analytic;
use claymill_nurbs::{KnotVector, NurbsSurface, Point3, SurfaceKind, Vector3};

use crate::warp::Warp;

use super::archive::Reader;
use super::class::{Class, Object};
use super::context::Context;
use super::curves::{self, Native};
use super::fault::Fault;

/// Control points that a full turn takes.
const POINTS_OF_A_TURN: usize = 9;

/// A surface of the archive.
#[derive(Debug, Clone)]
pub(super) struct Carrier {
    /// File units.
    pub(super) surface: NurbsSurface,
    pub(super) kind: SurfaceKind,
    /// From the archive's parameters to those of the surface.
    pub(super) warps: [Warp; 2],
}

impl Carrier {
    pub(super) fn plain(surface: NurbsSurface, kind: SurfaceKind) -> Self {
        Carrier { surface, kind, warps: <[Warp; 2]>::default() }
    }

    pub(super) fn transposed(self) -> Self {
        let [u, v] = self.warps;
        Carrier { surface: self.surface.transposed(), warps: [v, u], ..self }
    }
}

/// Whether objects of this class are surfaces.
pub(super) fn is_surface(class: Class) -> bool {
    matches!(class, Class::NurbsSurface | Class::PlaneSurface | Class::RevolutionSurface | Class::SumSurface)
}

/// Reads a surface object.
pub(super) fn read(Object { class, data: mut r }: Object, context: &Context) -> Result<Carrier, Fault> {
    let carrier = match (class, r.version()?) {
        (Class::NurbsSurface, (1, _)) => nurbs(&mut r)?,
        (Class::PlaneSurface, (1, minor)) => plane(&mut r, minor)?,
        (Class::RevolutionSurface, (major @ (1 | 2), _)) => revolution(&mut r, major, context)?,
        (Class::SumSurface, (1, _)) => sum(&mut r, context)?,
        (class, (version, _)) if is_surface(class) => {
            return Err(Fault::Version { what: class.name(), version });
        }
        (class, _) => {
            let at = r.position();
            return Err(Fault::Found { at, found: format!("a {}", class.name()), wanted: "a surface" });
        }
    };
    r.finish()?;
    Ok(carrier)
}

fn nurbs(r: &mut Reader) -> Result<Carrier, Fault> {
    let dimension = curves::dimension(r)?;
    let rational = r.integer()? != 0;
    let (degree_u, degree_v) = (curves::degree(r)?, curves::degree(r)?);
    let _counts_and_reserved = r.take(16)?;
    let _bounds = r.reals::<6>()?;
    let (knots_u, knots_v) = (curves::knots(r, degree_u)?, curves::knots(r, degree_v)?);
    let (points, weights): (Vec<_>, Vec<_>) = r
        .list(8 * (dimension + usize::from(rational)), |r| curves::control_point(r, dimension, rational))?
        .into_iter()
        .unzip();
    let surface = NurbsSurface::new(knots_u, knots_v, points, weights.into_iter().collect())?;
    Ok(Carrier::plain(surface, SurfaceKind::Nurbs))
}

fn plane(r: &mut Reader, minor: u8) -> Result<Carrier, Fault> {
    let frame = curves::plane(r)?;
    let domain = [r.reals::<2>()?, r.reals::<2>()?];
    let extents = if minor >= 1 { [r.reals::<2>()?, r.reals::<2>()?] } else { domain };
    let knots = |[a, b]: [f64; 2]| KnotVector::new(1, vec![a, a, b, b]);
    let corners = extents[0].iter().flat_map(|x| extents[1].iter().map(|y| frame.point(*x, *y, 0.0)));
    let surface = NurbsSurface::new(knots(domain[0])?, knots(domain[1])?, corners.collect(), None)?;
    Ok(Carrier::plain(surface, SurfaceKind::Plane))
}

fn revolution(r: &mut Reader, major: u8, context: &Context) -> Result<Carrier, Fault> {
    let axis = [r.reals::<3>()?, r.reals::<3>()?].map(Point3::from);
    let [from, to] = r.reals()?;
    let domain = if major >= 2 { r.reals()? } else { [from, to] };
    let _bounds = r.reals::<6>()?;
    let transposed = r.integer()? != 0;
    if !r.flag()? {
        return Err(Fault::Geometry("a surface of revolution has no curve"));
    }
    let Native { curve, warp } = curves::next(r)?;
    context.spend(curve.points().len().saturating_mul(POINTS_OF_A_TURN))?;
    let by_angle = analytic::revolution(&curve, &axis[0], &(axis[1] - axis[0]), (from, to))?;
    let warp_u = Warp::of_arc(&by_angle.knots_u().breaks(), to - from);
    let (surface, warp_u) = if domain == [from, to] {
        (by_angle, warp_u)
    } else {
        let [t0, t1] = domain;
        let at = |k: &f64| if *k == to { t1 } else { t0 + (k - from) * ((t1 - t0) / (to - from)) };
        let knots = KnotVector::new(2, by_angle.knots_u().as_slice().iter().map(at).collect())?;
        (rebuilt(&by_angle, knots)?, warp_u.moved((from, to), (t0, t1)))
    };
    let carrier = Carrier { surface, kind: SurfaceKind::Revolution, warps: [warp_u, warp] };
    Ok(if transposed { carrier.transposed() } else { carrier })
}

/// The surface with other knots in `u`.
fn rebuilt(surface: &NurbsSurface, knots_u: KnotVector) -> Result<NurbsSurface, Fault> {
    let net = surface.net();
    let points = net.iter().map(|h| Point3::from(h.xyz() / h.w)).collect();
    let weights = surface.is_rational().then(|| net.iter().map(|h| h.w).collect());
    Ok(NurbsSurface::new(knots_u, surface.knots_v().clone(), points, weights)?)
}

/// `base + a(u) + b(v)`. With the weights multiplied, the homogeneous net of the sum is the sum of the control
/// points.
fn sum(r: &mut Reader, context: &Context) -> Result<Carrier, Fault> {
    let base = Vector3::from(r.reals::<3>()?);
    let _bounds = r.reals::<6>()?;
    let (a, b) = (curves::next(r)?, curves::next(r)?);
    let (along_u, along_v) = (a.curve.points(), b.curve.points());
    context.spend(along_u.len().saturating_mul(along_v.len()))?;
    let points = along_u.iter().flat_map(|p| along_v.iter().map(move |q| p + q.coords + base)).collect();
    let weight = |c: &Native, i: usize| c.curve.weights().map_or(1.0, |w| w[i]);
    let pairs = (0..along_u.len()).flat_map(|i| (0..along_v.len()).map(move |j| (i, j)));
    let weights = pairs.map(|(i, j)| weight(&a, i) * weight(&b, j)).collect();
    let knots = |c: &Native| c.curve.knots().clone();
    let surface = NurbsSurface::new(knots(&a), knots(&b), points, Some(weights))?;
    Ok(Carrier { surface, kind: SurfaceKind::Extrusion, warps: [a.warp, b.warp] })
}
