//! What is under the pointer: the exact surface, and the drawn lines near it.

use std::ops::Range;

use claymill_nurbs::{Aabb, ClosestPoints, Point3, Vector3};

use crate::lines::{BREAK, Lines};
use crate::sight::{Ray, Sight};

/// A line this near to the pointer is meant, pixels.
pub(crate) const REACH_PX: f64 = 5.0;
/// A line this far behind the surface still shows, pixels.
const SUNK_PX: f64 = 8.0;

/// The half space that is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Unit normal, toward what is cut away.
    pub normal: Vector3,
    /// Position along the normal, mm from the model's zero.
    pub at_mm: f64,
}

impl Section {
    /// Whether a point is on the side that is shown.
    #[must_use]
    pub fn keeps(&self, p: &Point3) -> bool {
        self.normal.dot(&p.coords) <= self.at_mm
    }
}

/// A place on the exact surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// The face.
    pub face: usize,
    /// Its parameters.
    pub uv: [f64; 2],
    /// The point, mm.
    pub point: Point3,
    /// Unit normal toward the eye.
    pub normal: Vector3,
}

/// A place on a drawn line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnLine {
    /// What the line belongs to.
    pub tag: u32,
    /// Where on the drawn length of it, 0 to 1.
    pub share: f64,
    /// The point, mm.
    pub point: Point3,
    /// Distance from the pointer, pixels.
    pub off_px: f64,
}

/// The first place of the exact surface that a line of sight meets among `shown` faces in front of the section.
pub(crate) fn spot(
    closest: &ClosestPoints<'_>,
    surfaces: &[claymill_nurbs::Face],
    ray: &Ray,
    reach_mm: f64,
    shown: impl Fn(usize) -> bool,
    section: Option<&Section>,
) -> Option<Spot> {
    let crossings = closest.crossings(&ray.from, &ray.along, reach_mm);
    let kept = |p: &Point3| section.is_none_or(|s| s.keeps(p));
    let first = crossings.all.iter().find(|c| shown(c.face) && kept(&c.point))?;
    let normal = surfaces[first.face].surface.normal(first.u, first.v).map_or(-ray.along, |(n, _)| n);
    let normal = if normal.dot(&ray.along) > 0.0 { -normal } else { normal };
    Some(Spot { face: first.face, uv: [first.u, first.v], point: first.point, normal })
}

/// The drawn line nearest to the pointer, if the surface does not hide it.
#[expect(clippy::too_many_arguments, reason = "what is drawn, from where, and what hides it")]
pub(crate) fn line(
    lines: &Lines,
    ranges: impl Iterator<Item = Range<usize>>,
    origin: &Point3,
    sight: &Sight,
    at_px: [f64; 2],
    shown: impl Fn(u32) -> bool,
    surface: Option<&Spot>,
    section: Option<&Section>,
) -> Option<OnLine> {
    let hidden = |p: &Point3| {
        surface.is_some_and(|s| sight.depth(p) > sight.depth(&s.point) + SUNK_PX * sight.mm_per_px_at(p))
    };
    let mut best: Option<OnLine> = None;
    for range in ranges {
        let vertices = &lines.vertices[range.clone()];
        let place = |i: usize| Point3::from(vertices[i].at.map(f64::from)) + origin.coords;
        // Neighbours share their projections.
        let mut before: Option<(Point3, Option<[f64; 2]>)> = None;
        for i in 0..vertices.len() {
            let b = place(i);
            let to_px = sight.project(&b);
            let a = before.replace((b, to_px));
            let starts = i > 0 && vertices[i - 1].tag & BREAK == 0;
            let (Some((a, Some(p))), Some(q)) = (a.filter(|_| starts), to_px) else { continue };
            let (t, off_px) = nearest_on_segment(at_px, p, q);
            if off_px > REACH_PX || best.is_some_and(|b| b.off_px <= off_px) {
                continue;
            }
            let point = a + (b - a) * t;
            let tag = vertices[i].tag & !BREAK;
            if !shown(tag) || hidden(&point) || section.is_some_and(|s| !s.keeps(&point)) {
                continue;
            }
            let [from, to] = [lines.share[range.start + i - 1], lines.share[range.start + i]].map(f64::from);
            best = Some(OnLine { tag, share: from + (to - from) * t, point, off_px });
        }
    }
    best
}

/// Whether a box, relative to `origin`, comes near a place of the picture.
pub(crate) fn box_near(bounds: &Aabb, origin: &Point3, sight: &Sight, at_px: [f64; 2]) -> bool {
    let corners = bounds.vertices().map(|c| sight.project(&(c + origin.coords)));
    if corners.iter().any(Option::is_none) {
        // Around the eye: anything is possible.
        return true;
    }
    (0..2).all(|i| {
        let along = corners.iter().flatten().map(|c| c[i]);
        let low = along.clone().fold(f64::INFINITY, f64::min);
        let high = along.fold(f64::NEG_INFINITY, f64::max);
        low - REACH_PX <= at_px[i] && at_px[i] <= high + REACH_PX
    })
}

/// Share along the segment, and distance.
fn nearest_on_segment(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> (f64, f64) {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let length2 = dx * dx + dy * dy;
    let t = match length2 > 0.0 {
        true => (((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / length2).clamp(0.0, 1.0),
        false => 0.0,
    };
    (t, (p[0] - a[0] - dx * t).hypot(p[1] - a[1] - dy * t))
}
