//! Carriers: the surface under a face, whose patch is cut only once the trim loops are known.
//!
//! A carrier's parameters are those of the NURBS patch that it will become. Around an axis that is the
//! parameter of a rational arc whose pieces are quarter turns (see [`ArcParameter`]): the same for every
//! patch, and periodic, so that loops can be laid out before the patch is chosen.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use claymill_nurbs::analytic::{ArcParameter, Frame, cone, plane_patch, torus};
use claymill_nurbs::{NurbsError, NurbsSurface, Point2, Point3};

use super::spline::SplineChart;

/// A carrier.
#[derive(Debug)]
pub(crate) enum Carrier {
    /// A surface with a frame.
    Quadric { frame: Frame, quadric: Quadric },
    /// A NURBS with a domain of its own.
    Spline(SplineChart),
}

/// The shape of a carrier in its frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Quadric {
    /// `z = 0`.
    Plane,
    /// Radius `radius + slope · z`; a cylinder when the slope is 0.
    Cone { radius: f64, slope: f64 },
    /// A sphere when `major` is 0.
    Torus { major: f64, minor: f64 },
    /// One of the two sheets of a torus that crosses itself (`major < minor`): the outer one, or the lemon inside.
    Spindle { major: f64, minor: f64, outer: bool },
}

impl Quadric {
    /// The torus with these radii; of one that crosses itself the outer or inner sheet.
    pub(crate) fn torus(major: f64, minor: f64, outer: bool) -> Self {
        if major < minor { Quadric::Spindle { major, minor, outer } } else { Quadric::Torus { major, minor } }
    }

    /// The parallel surface at `distance` along `Su × Sv`, with the frame moved along its axis by the second value;
    /// `None` where radii vanish.
    pub(crate) fn offset(self, distance: f64) -> Option<(Self, f64)> {
        let positive = |r: f64| (r > 0.0).then_some(r);
        Some(match self {
            Quadric::Plane => (self, distance),
            Quadric::Cone { radius, slope } if slope == 0.0 => {
                (Quadric::Cone { radius: positive(radius + distance)?, slope }, 0.0)
            }
            Quadric::Cone { radius, slope } => {
                (Quadric::Cone { radius: radius + distance * slope.hypot(1.0), slope }, 0.0)
            }
            Quadric::Torus { major, minor } => {
                (Quadric::Torus { major, minor: positive(minor + distance)? }, 0.0)
            }
            Quadric::Spindle { .. } => return None,
        })
    }
}

/// The sheet's range around the tube, between the two points where it crosses the other.
fn sheet(major: f64, minor: f64, outer: bool) -> (f64, f64) {
    let apex = quarters().at_angle((-major / minor).acos());
    if outer { (-apex, apex) } else { (apex, TAU - apex) }
}

/// A range in the parameter plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range {
    pub(crate) min: Point2,
    pub(crate) max: Point2,
}

impl Range {
    /// The smallest range around the points.
    pub(crate) fn of(points: impl IntoIterator<Item = Point2>) -> Self {
        let inf = f64::INFINITY;
        let nothing = Range { min: Point2::new(inf, inf), max: Point2::new(-inf, -inf) };
        points.into_iter().fold(nothing, |r, p| Range { min: r.min.inf(&p), max: r.max.sup(&p) })
    }
}

/// Parameters of the carrier point nearest to a space point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Foot {
    pub(crate) uv: Point2,
    /// From the space point to the carrier.
    pub(crate) distance: f64,
    /// The point is a pole: `uv[0]` or `uv[1]` could be anything.
    pub(crate) free: [bool; 2],
}

impl Foot {
    /// Moves the foot by whole periods, and along its free directions, as near to `near` as it goes.
    pub(crate) fn towards(mut self, near: Option<Point2>, periods: [Option<f64>; 2]) -> Self {
        let Some(near) = near else { return self };
        for d in 0..2 {
            if self.free[d] {
                self.uv[d] = near[d];
            } else if let Some(period) = periods[d] {
                self.uv[d] += period * ((near[d] - self.uv[d]) / period).round();
            }
        }
        self
    }
}

/// The arc parameter with joints at whole quarter turns.
fn quarters() -> ArcParameter {
    ArcParameter::new(0.0, TAU).unwrap_or_else(|_| unreachable!("a whole turn is a valid arc"))
}

/// The smallest range of whole quarter turns around `low..high`, and at least one.
fn whole_quarters(low: f64, high: f64) -> (f64, f64) {
    let first = (low / FRAC_PI_2 + 1e-9).floor();
    let last = (high / FRAC_PI_2 - 1e-9).ceil().max(first + 1.0);
    (first * FRAC_PI_2, last * FRAC_PI_2)
}

/// A straight range, widened when it is empty.
fn straight(low: f64, high: f64) -> (f64, f64) {
    let least = 1e-9 * (1.0 + low.abs().max(high.abs()));
    if high - low > least { (low, high) } else { (low - least, high + least) }
}

impl Carrier {
    /// The nearest point of the carrier to `p`, laid near `near`; `size` is a length below which points
    /// count as equal.
    pub(crate) fn foot(&self, p: &Point3, near: Option<Point2>, size: f64) -> Foot {
        let (frame, quadric) = match self {
            Carrier::Spline(chart) => return chart.foot(p, near, size),
            Carrier::Quadric { frame, quadric } => (frame, quadric),
        };
        let l = frame.local(p);
        let away = l.x.hypot(l.y);
        let around = || quarters().at_angle(l.y.atan2(l.x));
        let (uv, distance) = match quadric {
            Quadric::Plane => (Point2::new(l.x, l.y), l.z.abs()),
            Quadric::Cone { radius, slope } => {
                let v = ((away - radius) * slope + l.z) / (1.0 + slope * slope);
                let distance = (away - radius - slope * l.z).abs() / slope.hypot(1.0);
                (Point2::new(around(), v), distance)
            }
            Quadric::Torus { major, minor } => {
                let (across, up) = (away - major, l.z);
                let uv = Point2::new(around(), quarters().at_angle(up.atan2(across)));
                (uv, (across.hypot(up) - minor).abs())
            }
            Quadric::Spindle { major, minor, outer } => {
                // The inner sheet lies across the axis.
                let (u, across) = if *outer {
                    (around(), away - major)
                } else {
                    (quarters().at_angle((-l.y).atan2(-l.x)), -away - major)
                };
                let (low, high) = sheet(*major, *minor, *outer);
                let v = quarters().at_angle(l.z.atan2(across).rem_euclid(TAU));
                let v = if *outer && v > PI { v - TAU } else { v };
                (Point2::new(u, v.clamp(low, high)), (across.hypot(l.z) - minor).abs())
            }
        };
        let pole = away <= size && *quadric != Quadric::Plane;
        let foot = Foot { uv, distance, free: [pole, false] };
        foot.towards(near, self.periods())
    }

    /// The carrier's parameters where the formulas of ISO 10303-42 have `u` and `v`: angles in radians become
    /// parameters of arcs.
    pub(crate) fn at_angles(&self, u: f64, v: f64) -> Point2 {
        let arc = |angle: f64| quarters().at_angle(angle);
        match self {
            Carrier::Spline(_) | Carrier::Quadric { quadric: Quadric::Plane, .. } => Point2::new(u, v),
            Carrier::Quadric { quadric: Quadric::Cone { .. }, .. } => Point2::new(arc(u), v),
            Carrier::Quadric { .. } => Point2::new(arc(u), arc(v)),
        }
    }

    /// Which of the parameters of the formulas are angles.
    pub(crate) fn angles(&self) -> [bool; 2] {
        match self {
            Carrier::Spline(_) | Carrier::Quadric { quadric: Quadric::Plane, .. } => [false; 2],
            Carrier::Quadric { quadric: Quadric::Cone { .. }, .. } => [true, false],
            Carrier::Quadric { .. } => [true; 2],
        }
    }

    /// The period in `u` and `v`.
    pub(crate) fn periods(&self) -> [Option<f64>; 2] {
        match self {
            Carrier::Spline(chart) => chart.periods(),
            Carrier::Quadric { quadric, .. } => match quadric {
                Quadric::Plane => [None, None],
                Quadric::Torus { major, .. } if *major > 0.0 => [Some(TAU), Some(TAU)],
                Quadric::Cone { .. } | Quadric::Torus { .. } | Quadric::Spindle { .. } => [Some(TAU), None],
            },
        }
    }

    /// The value of the parameter across `direction` at which the carrier collapses to a point, on the upper
    /// or lower side.
    pub(crate) fn pole(&self, direction: usize, upper: bool) -> Option<f64> {
        match self {
            Carrier::Spline(chart) => chart.pole(direction, upper),
            Carrier::Quadric { quadric, .. } => match quadric {
                Quadric::Cone { radius, slope } if direction == 0 && *slope != 0.0 => Some(-radius / slope),
                Quadric::Torus { major, .. } if direction == 0 && *major == 0.0 => {
                    Some(if upper { FRAC_PI_2 } else { -FRAC_PI_2 })
                }
                Quadric::Spindle { major, minor, outer } if direction == 0 => {
                    let (low, high) = sheet(*major, *minor, *outer);
                    Some(if upper { high } else { low })
                }
                _ => None,
            },
        }
    }

    /// The range of the whole carrier, when it is finite.
    pub(crate) fn whole(&self) -> Option<Range> {
        let (min, max) = match self {
            Carrier::Spline(chart) => {
                let ((u0, u1), (v0, v1)) = chart.surface().domain();
                (Point2::new(u0, v0), Point2::new(u1, v1))
            }
            Carrier::Quadric { quadric, .. } => match quadric {
                Quadric::Torus { major, .. } if *major > 0.0 => (Point2::origin(), Point2::new(TAU, TAU)),
                Quadric::Torus { .. } => (Point2::new(0.0, -FRAC_PI_2), Point2::new(TAU, FRAC_PI_2)),
                Quadric::Spindle { major, minor, outer } => {
                    let (low, high) = sheet(*major, *minor, *outer);
                    (Point2::new(0.0, low), Point2::new(TAU, high))
                }
                _ => return None,
            },
        };
        Some(Range { min, max })
    }

    /// Whether the carrier alone encloses a volume, so that a face on it can lie outside of its loops.
    pub(crate) fn is_closed(&self) -> bool {
        let closed = |direction: usize| {
            self.periods()[direction].is_some()
                || (self.pole(1 - direction, false).is_some() && self.pole(1 - direction, true).is_some())
        };
        self.whole().is_some() && closed(0) && closed(1)
    }

    /// The shift by whole periods after which `range` starts inside the carrier's own domain.
    pub(crate) fn home_shift(&self, range: &Range) -> nalgebra::Vector2<f64> {
        let Some(whole) = self.whole() else {
            return nalgebra::Vector2::zeros();
        };
        let periods = self.periods();
        nalgebra::Vector2::from_fn(|d, _| {
            let Some(period) = periods[d] else { return 0.0 };
            -period * ((range.min[d] - whole.min[d]) / period + 1e-6).floor()
        })
    }

    /// The NURBS patch that covers `range`.
    pub(crate) fn patch(&self, range: &Range) -> Result<NurbsSurface, NurbsError> {
        let (low, high) = (range.min, range.max);
        let (frame, quadric) = match self {
            Carrier::Spline(chart) => return chart.patch(range),
            Carrier::Quadric { frame, quadric } => (frame, *quadric),
        };
        let (u, v) = (whole_quarters(low.x, high.x), straight(low.y, high.y));
        match quadric {
            Quadric::Plane => plane_patch(frame, straight(low.x, high.x), v),
            Quadric::Cone { radius, slope } => cone(frame, radius, slope.atan(), u, v),
            Quadric::Torus { major, minor } => torus(frame, major, minor, u, whole_quarters(low.y, high.y)),
            Quadric::Spindle { major, minor, outer } => {
                let tube = torus(frame, major, minor, u, whole_quarters(low.y, high.y))?;
                let (low, high) = sheet(major, minor, outer);
                let tube = tube.split_v(low).map_or(tube, |(_, above)| above);
                Ok(tube.split_v(high).map_or(tube, |(below, _)| below))
            }
        }
    }
}
