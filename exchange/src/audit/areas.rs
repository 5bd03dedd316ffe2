//! Areas that closed curves enclose on surfaces of revolution, by Green's theorem in the angles around their axis.
//!
//! With `dφ = (x dy − y dx) / r²` the integrals need no parameter plane: curves that run round the axis are as good
//! as others, and there is no seam.

use std::f64::consts::{PI, TAU};

use claymill_nurbs::analytic::Frame;
use claymill_nurbs::{Point3, Vector3};

use super::ring::{Node, Ring};

/// Curves on a sphere must keep away from the ends of the axis that angles are measured about, by this part of the
/// radius.
const OFF_AXIS: f64 = 0.05;
/// An area on a closed surface that is this part of the whole, or less, is the whole or nothing.
const NOTHING: f64 = 1e-6;
/// The turns of a closed curve are whole to this.
const WHOLE: f64 = 0.02;

/// A surface on which areas follow from edges, mm.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Carrier {
    Plane {
        normal: Vector3,
    },
    Cylinder {
        frame: Frame,
        radius: f64,
    },
    /// Radius `radius + slope · z`.
    Cone {
        frame: Frame,
        radius: f64,
        slope: f64,
    },
    Sphere {
        centre: Point3,
        radius: f64,
    },
    Torus {
        frame: Frame,
        major: f64,
        minor: f64,
    },
}

/// What a ring encloses: the integral, and how often it runs round the axis.
struct Turned {
    area: f64,
    turns: f64,
}

impl Carrier {
    /// How far the edges are from the surface at most, mm.
    pub(crate) fn farthest(&self, rings: &[Ring]) -> f64 {
        let nodes = || rings.iter().flat_map(|r| &r.nodes);
        let Some(first) = nodes().next() else { return 0.0 };
        let away = |n: &Node| match self {
            // Where along its normal a plane lies is not needed for its areas.
            Carrier::Plane { normal } => (n.at - first.at).dot(normal).abs(),
            Carrier::Cylinder { frame, radius } => {
                let p = frame.local(&n.at);
                (p.x.hypot(p.y) - radius).abs()
            }
            Carrier::Cone { frame, radius, slope } => {
                let p = frame.local(&n.at);
                (p.x.hypot(p.y) - (radius + slope * p.z).abs()).abs() / slope.hypot(1.0)
            }
            Carrier::Sphere { centre, radius } => ((n.at - centre).norm() - radius).abs(),
            Carrier::Torus { frame, major, minor } => {
                let p = frame.local(&n.at);
                ((p.x.hypot(p.y) - major).hypot(p.z) - minor).abs()
            }
        };
        nodes().map(away).fold(0.0, f64::max)
    }

    /// The areas that a face with these bounds may have, mm²: none where they do not tell, two where the way that they
    /// run does not. `sense` says whether the face's outside is the carrier's.
    pub(crate) fn enclosed(&self, rings: &[Ring], sense: bool) -> Vec<f64> {
        match self {
            Carrier::Plane { normal } => {
                largest_less_the_rest(rings.iter().map(|r| r.vector_area().dot(normal))).into_iter().collect()
            }
            Carrier::Cylinder { frame, radius } => {
                let strip = |n: &Node| {
                    let (p, d) = local(frame, n);
                    -p.z * angle(&p, &d) * radius
                };
                around(frame, rings, strip, false)
            }
            Carrier::Cone { frame, radius, slope } => {
                let slant = slope.hypot(1.0) / (2.0 * slope.abs());
                let apex = Frame { origin: frame.origin - frame.z * (radius / slope), ..*frame };
                let sector = |n: &Node| {
                    let (p, d) = local(&apex, n);
                    // Edges beside a slender cone are far from their foot along the axis.
                    let foot = (p.x.hypot(p.y) * slope.abs() + p.z.abs()) / (1.0 + slope * slope);
                    -(foot * slope).powi(2) * angle(&p, &d) * slant * p.z.signum()
                };
                around(&apex, rings, sector, true)
            }
            Carrier::Sphere { centre, radius } => sphere(*centre, *radius, rings, sense),
            Carrier::Torus { frame, major, minor } => torus(frame, *major, *minor, rings, sense),
        }
    }
}

fn local(frame: &Frame, n: &Node) -> (Point3, Vector3) {
    let along = |d: &Vector3| Vector3::new(d.dot(&frame.x), d.dot(&frame.y), d.dot(&frame.z));
    (frame.local(&n.at), along(&n.step))
}

/// The step around the axis, radians.
fn angle(p: &Point3, d: &Vector3) -> f64 {
    let r2 = p.x * p.x + p.y * p.y;
    if r2 > 0.0 { (p.x * d.y - p.y * d.x) / r2 } else { 0.0 }
}

fn turns(frame: &Frame, ring: &Ring) -> f64 {
    let turns = ring.integral(|n| {
        let (p, d) = local(frame, n);
        angle(&p, &d)
    }) / TAU;
    // Curves through the axis turn by parts.
    if (turns - turns.round()).abs() < WHOLE { turns.round() } else { 0.0 }
}

/// A face has one outer bound and holes that touch at most: whatever the bounds are called and whichever way they
/// run.
pub(super) fn largest_less_the_rest(areas: impl Iterator<Item = f64>) -> Option<f64> {
    let areas: Vec<f64> = areas.map(f64::abs).collect();
    let largest = areas.iter().copied().reduce(f64::max)?;
    Some(2.0 * largest - areas.iter().sum::<f64>())
}

/// The area on a cylinder or cone. Two bounds that run round it enclose a band, one closes over the apex.
fn around(frame: &Frame, rings: &[Ring], element: impl Fn(&Node) -> f64, has_apex: bool) -> Vec<f64> {
    let turned: Vec<Turned> =
        rings.iter().map(|r| Turned { area: r.integral(&element), turns: turns(frame, r) }).collect();
    let (round, holes): (Vec<_>, Vec<_>) = turned.into_iter().partition(|t| t.turns != 0.0);
    let band = match &round[..] {
        [] => return largest_less_the_rest(holes.iter().map(|t| t.area)).into_iter().collect(),
        [only] if has_apex => only.area.abs(),
        // Writers that run both the same way round mean a band, too.
        [a, b] if a.turns.abs() == 1.0 && b.turns.abs() == 1.0 => (a.area * a.turns - b.area * b.turns).abs(),
        _ => return Vec::new(),
    };
    vec![band - holes.iter().map(|t| t.area.abs()).sum::<f64>()]
}

/// The area to the left of all bounds, of a surface of area `whole`, from what is known of it but for wholes.
fn on_closed(left: f64, whole: f64, rings: &[Ring]) -> Vec<f64> {
    let area = left.rem_euclid(whole);
    let area = if area <= NOTHING * whole { whole } else { area };
    // A seam is inside of the face, whichever way its bound runs.
    let other = rings.iter().any(|r| r.has_seam).then_some(whole - area);
    std::iter::once(area).chain(other).collect()
}

fn sphere(centre: Point3, radius: f64, rings: &[Ring], sense: bool) -> Vec<f64> {
    // About any axis that the curves keep away from.
    let clear = |axis: &Vector3| -> f64 {
        let away = |n: &Node| (n.at - centre).cross(axis).norm() / radius;
        rings.iter().flat_map(|r| &r.nodes).map(away).fold(f64::INFINITY, f64::min)
    };
    let axes = (-1..=1).flat_map(|i| (-1..=1).map(move |j| Vector3::new(f64::from(i), f64::from(j), 1.3)));
    let axes =
        axes.chain([Vector3::x(), Vector3::y(), Vector3::new(1.0, 0.9, 0.1), Vector3::new(-0.9, 1.0, 0.1)]);
    let Some(axis) = axes.map(|a| a.normalize()).max_by(|a, b| clear(a).total_cmp(&clear(b))) else {
        return Vec::new();
    };
    if clear(&axis) < OFF_AXIS {
        return Vec::new();
    }
    let Some(frame) = Frame::new(centre, axis, Vector3::x()) else { return Vec::new() };
    let zone = |n: &Node| {
        let (p, d) = local(&frame, n);
        -p.z * angle(&p, &d) * radius
    };
    let left: f64 = rings.iter().map(|r| r.integral(zone)).sum();
    let odd = rings.iter().map(|r| turns(&frame, r)).sum::<f64>().rem_euclid(2.0);
    let hemisphere = TAU * radius * radius;
    let left = left + odd * hemisphere;
    on_closed(if sense { left } else { -left }, 2.0 * hemisphere, rings)
}

fn torus(frame: &Frame, major: f64, minor: f64, rings: &[Ring], sense: bool) -> Vec<f64> {
    if major <= minor {
        return Vec::new();
    }
    let tube = |p: &Point3| p.z.atan2(p.x.hypot(p.y) - major);
    // Around the axis, and around the tube.
    let steps = |n: &Node| {
        let (p, d) = local(frame, n);
        let r = p.x.hypot(p.y);
        let (out, up) = (r - major, p.z);
        let outward = (p.x * d.x + p.y * d.y) / r;
        (angle(&p, &d), (out * d.z - up * outward) / (minor * minor))
    };
    let whole = |x: f64| (x / TAU - (x / TAU).round()).abs() < WHOLE;
    let mut around = Vec::new();
    for ring in rings {
        let (u, v) = (ring.integral(|n| steps(n).0), ring.integral(|n| steps(n).1));
        if !whole(u) || !whole(v) {
            return Vec::new();
        }
        around.push([(u / TAU).round(), (v / TAU).round()]);
    }
    let along_axis = around.iter().any(|w| w[0] != 0.0);
    let along_tube = around.iter().any(|w| w[1] != 0.0);
    let left: f64 = match (along_axis, along_tube) {
        (true, true) => return Vec::new(),
        // −∮ ∫ r dv du, the angle around the tube without jumps.
        (_, false) => {
            let mut sum = 0.0;
            for ring in rings {
                let mut unrolled = Unrolled::default();
                sum -= ring.integral(|n| {
                    let (p, _) = local(frame, n);
                    let v = unrolled.next(tube(&p));
                    minor * (major * v + minor * v.sin()) * steps(n).0
                });
            }
            sum
        }
        // ∮ r u dv, the angle around the axis without jumps.
        (false, true) => {
            let mut sum = 0.0;
            for ring in rings {
                let mut unrolled = Unrolled::default();
                sum += ring.integral(|n| {
                    let (p, _) = local(frame, n);
                    let u = unrolled.next(p.y.atan2(p.x));
                    minor * p.x.hypot(p.y) * u * steps(n).1
                });
            }
            sum
        }
    };
    on_closed(if sense { left } else { -left }, 4.0 * PI * PI * major * minor, rings)
}

/// An angle followed without jumps.
#[derive(Default)]
struct Unrolled(Option<f64>);

impl Unrolled {
    fn next(&mut self, angle: f64) -> f64 {
        let next = self.0.map_or(angle, |before| angle + TAU * ((before - angle) / TAU).round());
        self.0 = Some(next);
        next
    }
}
