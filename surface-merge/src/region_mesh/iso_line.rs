//! Iso-lines of a field on a region mesh (marching triangles). Their points lie on the exact
//! surfaces; cubics along the triangle sides smooth out the kinks of a linear field.

use claymill_nurbs::{Point2, Vector3};

use super::{Field, SurfacePoint};

/// Neighbouring points of a line are at least this part of the mesh's edge length apart.
const APART: f64 = 0.05;

/// A line on which a field has one value.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyline {
    /// Its points in order; larger values lie on the left as seen from the outside of the mesh.
    pub points: Vec<IsoPoint>,
    /// The last point is followed by the first.
    pub closed: bool,
}

/// A point of a line: exactly on the surface of its face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IsoPoint {
    /// Where.
    pub at: SurfacePoint,
    /// The gradient of the field there, values per mm: across the line, and so large that `1 / |gradient|` is
    /// the distance in mm to a line one higher.
    pub gradient: Vector3,
}

impl Polyline {
    /// Length of the straight lines between the points, mm.
    #[must_use]
    pub fn length_mm(&self) -> f64 {
        let open: f64 = self.points.windows(2).map(|w| (w[1].at.point - w[0].at.point).norm()).sum();
        match (self.closed, self.points.first(), self.points.last()) {
            (true, Some(a), Some(b)) => open + (a.at.point - b.at.point).norm(),
            _ => open,
        }
    }
}

impl Field<'_, '_> {
    /// All lines on which the field has `value`, each as points where it crosses sides of triangles. The
    /// points are on the NURBS: parameters are interpolated in the plane of the triangle's face, and the
    /// point is that of the surface there. Between two points a line stays inside one face. Where along a
    /// side it crosses is found by a cubic through values and gradients of both ends, which takes out most of
    /// the kinks that a piecewise linear field has.
    #[must_use]
    pub fn iso_line(&self, value: f64) -> Vec<Polyline> {
        self.iso_line_on(value, |_| true)
    }

    /// The same on some triangles alone, by their numbers: what is to be cut may be little of a large region.
    #[must_use]
    pub fn iso_line_on(&self, value: f64, wanted: impl Fn(usize) -> bool) -> Vec<Polyline> {
        let candidates = self.around(value);
        // At the lowest value itself the line runs where the field begins to rise.
        let strict = value <= self.range()[0];
        let is_above = |v: f64| if strict { v > value } else { v >= value };
        let crossed: Vec<u32> = candidates
            .iter()
            .copied()
            .filter(|&t| {
                let above = self.at_corners(t as usize).map(is_above);
                above.contains(&true) && above.contains(&false) && wanted(t as usize)
            })
            .collect();
        // The sides of a triangle over which the line comes in and goes out.
        let through = |triangle: usize| {
            let above = self.at_corners(triangle).map(is_above);
            let side = |from: bool| (0..3).find(|&k| above[k] == from && above[(k + 1) % 3] != from);
            [side(true), side(false)].map(|k| 3 * triangle + k.unwrap_or(0))
        };
        // The triangle after or before one on the line.
        let beyond = |side: usize, way: usize| {
            let twin = self.mesh.across(side)?;
            let index = crossed.binary_search(&((twin / 3) as u32)).ok()?;
            (through(twin / 3)[1 - way] == twin).then_some(index)
        };
        let mut used = vec![false; crossed.len()];
        let mut lines = Vec::new();
        for seed in 0..crossed.len() {
            if used[seed] {
                continue;
            }
            let mut first = seed;
            while let Some(before) = beyond(through(crossed[first] as usize)[0], 0) {
                if before == seed || used[before] {
                    break;
                }
                first = before;
            }
            let [enter, _] = through(crossed[first] as usize);
            let mut points = vec![self.crossing(enter, value)];
            let mut at = first;
            let closed = loop {
                used[at] = true;
                let [_, leave] = through(crossed[at] as usize);
                points.push(self.crossing(leave, value));
                match beyond(leave, 1) {
                    Some(next) if next == first => break true,
                    Some(next) if !used[next] => at = next,
                    _ => break false,
                }
            };
            lines.push(self.tidied(points, closed));
        }
        lines
    }

    /// Where the field has `value` on a side of a triangle.
    fn crossing(&self, side: usize, value: f64) -> IsoPoint {
        let mesh = self.mesh;
        let (triangle, k) = (side / 3, side % 3);
        let ids = mesh.triangles[triangle];
        // From the lower number to the higher, so that both triangles of the side find the same place.
        let (i, j) = if ids[k] < ids[(k + 1) % 3] { (k, (k + 1) % 3) } else { ((k + 1) % 3, k) };
        let (a, b) = (ids[i] as usize, ids[j] as usize);
        let along = mesh.vertices[b].point - mesh.vertices[a].point;
        let values = [self.values()[a], self.values()[b]];
        let slopes = [a, b].map(|v| self.gradients()[v].dot(&along));
        let share = cubic_crossing(values, slopes, value);
        let face = mesh.face_of[triangle];
        let surface = &mesh.model.faces[face].surface;
        let uv = mesh.corners[triangle];
        let at = uv[i] + (uv[j] - uv[i]) * share;
        let (u, v) = surface.clamp(at.x, at.y);
        let gradient = self.gradients()[a] * (1.0 - share) + self.gradients()[b] * share;
        IsoPoint { at: SurfacePoint { face, uv: Point2::new(u, v), point: surface.point(u, v) }, gradient }
    }

    /// Leaves out points that nearly coincide with the one before them.
    fn tidied(&self, points: Vec<IsoPoint>, closed: bool) -> Polyline {
        let near = APART * self.mesh.edge_mm;
        let apart = |a: &IsoPoint, b: &IsoPoint| (a.at.point - b.at.point).norm() > near;
        let last = points[points.len() - 1];
        let mut kept: Vec<IsoPoint> = Vec::with_capacity(points.len());
        for point in points {
            if kept.last().is_none_or(|before| apart(before, &point)) {
                kept.push(point);
            }
        }
        if closed {
            while kept.len() > 1 && !apart(&kept[kept.len() - 1], &kept[0]) {
                kept.pop();
            }
        } else if kept.len() > 1 {
            // An open line ends where it meets the border.
            let end = kept.len() - 1;
            kept[end] = last;
        }
        Polyline { points: kept, closed }
    }
}

/// Shares of a side closer than this are one.
const SAME_SHARE: f64 = 1e-14;
const MOST_STEPS: usize = 60;

/// Where on `[0, 1]` the cubic with these values and slopes at the ends is `value`, which lies between the
/// values at the ends.
fn cubic_crossing([a, b]: [f64; 2], [da, db]: [f64; 2], value: f64) -> f64 {
    let rise = b - a;
    if rise == 0.0 {
        return 0.5;
    }
    // Slopes of a monotone cubic lie between 0 and three times the rise (Fritsch and Carlson 1980).
    let bounded = |d: f64| (d / rise).clamp(0.0, 3.0);
    let (p, q, target) = (bounded(da), bounded(db), (value - a) / rise);
    let cubic = |x: f64| x * (p + x * (3.0 - 2.0 * p - q + x * (p + q - 2.0)));
    let slope = |x: f64| p + x * (2.0 * (3.0 - 2.0 * p - q) + x * 3.0 * (p + q - 2.0));
    // Newton's steps, halves where they lead out of the bracket.
    let (mut low, mut high, mut x) = (0.0, 1.0, target);
    for _ in 0..MOST_STEPS {
        let off = cubic(x) - target;
        if off == 0.0 {
            return x;
        }
        *(if off < 0.0 { &mut low } else { &mut high }) = x;
        let newton = x - off / slope(x);
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - x).abs() < SAME_SHARE {
            return next;
        }
        x = next;
    }
    x
}
