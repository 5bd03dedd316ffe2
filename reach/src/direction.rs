//! Directions to choose from: the tool's axis from tip to holder, each with a frame of integers.

use std::collections::BTreeSet;

use claymill_contact::{Axis, Frame, FrameError};
use claymill_nurbs::{Model, SurfaceKind, Vector3};

use crate::error::{ReachError, check};
use crate::part::Part;

/// A direction to reach from.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// Its frame, exact.
    pub frame: Frame,
    /// Why it is among the candidates.
    pub origin: Origin,
}

/// Why a direction is among the candidates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Origin {
    /// It was asked for.
    Forced,
    /// An axis of the model, or halfway between two or three of them.
    Cube,
    /// The normal of a plane face.
    Plane(usize),
    /// One of an even spread.
    Spread,
    /// An angle about a rotary axis, degrees.
    Angle(f64),
}

/// Directions closer than this are one (sine, 0.06°).
const SAME: f64 = 1e-3;
/// Normals of planes that are looked at, the largest faces first.
const MOST_PLANES: usize = 200;
/// A plane's normal is that of its middle.
const MIDDLE: f64 = 0.5;
/// Rounding of what is on the border of the head's range, degrees.
const RANGE_DEG: f64 = 1e-6;

/// The frame of a direction, named by its number: the same axes give the same frame everywhere.
fn frame(name: &str, axis: Vector3, up: Axis, front: Axis) -> Result<Frame, FrameError> {
    Frame::tilted(name, axis.into(), up, front)
}

/// Directions at a step around a rotary axis. 0° is the up axis, or where that is the rotary axis, the front; angles
/// turn about the axis by the right hand.
///
/// # Errors
/// The step is not between 0 and 120 degrees, or the axes are parallel.
pub fn circle(axis: Axis, step_deg: f64, up: Axis, front: Axis) -> Result<Vec<Direction>, ReachError> {
    check("a step", step_deg, 0.0, 120.0)?;
    let count = (360.0 / step_deg).round().max(3.0) as usize;
    (0..count).map(|k| at_angle(axis, 360.0 * k as f64 / count as f64, up, front)).collect()
}

/// The direction at an angle about a rotary axis, as [`circle`] counts it.
///
/// # Errors
/// The axes are parallel.
pub fn at_angle(axis: Axis, deg: f64, up: Axis, front: Axis) -> Result<Direction, ReachError> {
    let zero = if axis.index == up.index { front } else { up };
    let (first, about) = (zero.vector(), axis.vector());
    let side = about.cross(&first);
    let (sine, cosine) = deg.to_radians().sin_cos();
    let name =
        format!("a{}", format!("{deg:.3}").trim_end_matches('0').trim_end_matches('.').replace('.', "_"));
    // The frame's x runs along the rotary axis, so that turning it is all that changes.
    let (up, along) = (zero, Axis { index: axis.index, negative: false });
    let frame = frame(&name, first * cosine + side * sine, up, along)?;
    Ok(Direction { frame, origin: Origin::Angle(deg) })
}

/// Directions of a head that tilts `range_deg` from `up`: forced ones, axes and what is halfway between them, normals of
/// planes, and an even spread over the sphere, `fineness` times divided.
///
/// # Errors
/// The range is not between 0 and 180 degrees, or holds no direction.
pub fn sphere(
    part: &Part,
    forced: &[[f64; 3]],
    range_deg: f64,
    fineness: u32,
    (up, front): (Axis, Axis),
) -> Result<Vec<Direction>, ReachError> {
    check("a range of the head", range_deg, 0.0, 180.0)?;
    let least = (range_deg + RANGE_DEG).min(180.0).to_radians().cos();
    let is_in_range = |v: &Vector3| v.dot(&up.vector()) >= least;
    let mut found: Vec<(Vector3, Origin)> = Vec::new();
    for v in forced {
        // The frame says what is no direction.
        let axis = frame("forced", (*v).into(), up, front)?.axis();
        found.push((axis, Origin::Forced));
    }
    let others = cube().into_iter().map(|v| (v, Origin::Cube));
    let others = others.chain(planes(part)).chain(spread(fineness).into_iter().map(|v| (v, Origin::Spread)));
    for (v, origin) in others.filter(|(v, _)| is_in_range(v)) {
        if !found.iter().any(|(w, _)| w.dot(&v) > 0.0 && w.cross(&v).norm() < SAME) {
            found.push((v, origin));
        }
    }
    if found.is_empty() {
        return Err(ReachError::NoDirection { range_deg });
    }
    let named = found.into_iter().enumerate().map(|(k, (v, origin))| {
        let axis = frame(&format!("d{k}"), v, up, front)?;
        Ok(Direction { frame: axis, origin })
    });
    named.collect()
}

/// The six axes, the twelve directions between two and the eight between three.
fn cube() -> Vec<Vector3> {
    let steps = [-1.0, 0.0, 1.0];
    let all =
        steps.iter().flat_map(|&x| steps.iter().flat_map(move |&y| steps.map(|z| Vector3::new(x, y, z))));
    let mut all: Vec<Vector3> = all.filter(|v| v.norm() > 0.0).collect();
    // Axes first: of equal directions the lowest number is taken.
    all.sort_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
    all.into_iter().map(|v| v.normalize()).collect()
}

/// Outward normals of plane faces, of the largest first; both of a face that is free on both sides.
fn planes(part: &Part) -> Vec<(Vector3, Origin)> {
    let model: &Model = part.model;
    let mut faces: Vec<usize> = (0..model.faces.len()).filter(|&f| is_plane(model, f)).collect();
    let area = |face: usize| part.face_area_mm2.get(face).copied().unwrap_or(0.0);
    faces.sort_by(|&a, &b| area(b).total_cmp(&area(a)).then(a.cmp(&b)));
    faces.truncate(MOST_PLANES);
    let normals = faces.into_iter().flat_map(|face| {
        let surface = &model.faces[face].surface;
        let ((u0, u1), (v0, v1)) = surface.domain();
        let normal = surface.normal(u0 + MIDDLE * (u1 - u0), v0 + MIDDLE * (v1 - v0)).map(|(n, _)| n);
        let sides = [true, false].into_iter().filter(move |&along| part.free().allow(face, along));
        sides.filter_map(move |along| Some((normal? * if along { 1.0 } else { -1.0 }, Origin::Plane(face))))
    });
    normals.collect()
}

/// Whether all control points lie in one plane.
fn is_plane(model: &Model, face: usize) -> bool {
    const FLAT: f64 = 1e-6;
    let face = &model.faces[face];
    if face.kind == SurfaceKind::Plane {
        return true;
    }
    let ((u0, u1), (v0, v1)) = face.surface.domain();
    let Some((n, _)) = face.surface.normal(0.5 * (u0 + u1), 0.5 * (v0 + v1)) else { return false };
    let at = face.surface.point(u0, v0);
    let (nu, nv) = face.surface.size();
    let points: Vec<_> = (0..nu)
        .flat_map(|i| (0..nv).map(move |j| (i, j)))
        .map(|(i, j)| face.surface.control_point(i, j))
        .collect();
    let size = points.iter().map(|p| (p - at).norm()).fold(0.0, f64::max);
    points.iter().all(|p| n.dot(&(p - at)).abs() <= FLAT * size)
}

/// Corners of an icosahedron whose triangles are cut in four `fineness` times, on the sphere: 12, 42, 162, 642.
pub(crate) fn spread(fineness: u32) -> Vec<Vector3> {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut corners = Vec::with_capacity(12);
    for (a, b) in [(1.0, golden), (1.0, -golden), (-1.0, golden), (-1.0, -golden)] {
        corners.extend([Vector3::new(0.0, a, b), Vector3::new(a, b, 0.0), Vector3::new(b, 0.0, a)]);
    }
    let mut corners: Vec<Vector3> = corners.into_iter().map(|v| v.normalize()).collect();
    // Neighbours of an icosahedron of circumradius 1 are 1.0515 apart, those of its halves half as much.
    let mut apart = 1.2;
    for _ in 0..fineness.min(4) {
        let mut halves = BTreeSet::new();
        for i in 0..corners.len() {
            for j in i + 1..corners.len() {
                if (corners[i] - corners[j]).norm() < apart {
                    halves.insert((i, j));
                }
            }
        }
        let new: Vec<Vector3> =
            halves.into_iter().map(|(i, j)| (corners[i] + corners[j]).normalize()).collect();
        corners.extend(new);
        apart *= 0.54;
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_has_as_many_directions_as_a_divided_icosahedron_and_they_are_even() {
        for (fineness, count) in [(0, 12), (1, 42), (2, 162), (3, 642)] {
            let all = spread(fineness);
            assert_eq!(all.len(), count);
            let nearest = |v: &Vector3| {
                let others = all.iter().filter(|w| *w != v);
                others.map(|w| (w - v).norm()).fold(f64::INFINITY, f64::min)
            };
            let distances: Vec<f64> = all.iter().map(nearest).collect();
            let (low, high) = distances.iter().fold((9.0_f64, 0.0_f64), |(a, b), &d| (a.min(d), b.max(d)));
            assert!(high / low < 1.3, "{fineness}: {low} {high}");
        }
    }

    #[test]
    fn angles_turn_by_the_right_hand_and_the_frame_keeps_the_rotary_axis() {
        let axis = |t: &str| t.parse::<Axis>().unwrap();
        let all = circle(axis("+x"), 30.0, axis("+z"), axis("-y")).unwrap();
        assert_eq!(all.len(), 12);
        assert_eq!(all[0].frame.axis(), Vector3::z());
        assert_eq!(all[3].frame.axis(), -Vector3::y());
        for direction in &all {
            let [x, ..] = direction.frame.axes();
            assert!((x.x.abs() - 1.0).abs() < 1e-9, "{x}");
        }
        assert_eq!(circle(axis("+z"), 90.0, axis("+z"), axis("-y")).unwrap()[0].frame.axis(), -Vector3::y());
    }

    #[test]
    fn steps_and_ranges_that_cannot_be_are_refused() {
        let axis = |t: &str| t.parse::<Axis>().unwrap();
        for step in [0.0, -1.0, f64::NAN, 200.0] {
            assert!(matches!(
                circle(axis("+x"), step, axis("+z"), axis("-y")),
                Err(ReachError::Number { .. })
            ));
        }
    }
}
