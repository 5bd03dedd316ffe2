//! How far the normal of a place runs before it meets the model again: beyond that what stands there is the part, not stock.

use std::cell::Cell;
use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, Point3, Vector3};

use crate::drop::DropMesh;

/// Triangles nearer than this are of the place itself, mm.
const BESIDE_MM: f64 = 0.2;
/// Components of a direction below this are none.
const ALONG: f64 = 1e-12;

impl DropMesh<'_> {
    /// The distance from a place (model coordinates) along a unit vector to the nearest triangle, at most a limit, mm.
    pub(crate) fn clear_ahead_mm(&self, place: &Point3, along: &Vector3, limit_mm: f64) -> f64 {
        let from = self.in_frame(place);
        let along = (self.in_frame(&(place + along)) - from).normalize();
        let nearest_mm = Cell::new(limit_mm);
        self.visit(
            |b| is_met(b, &from, &along, nearest_mm.get()),
            |i| {
                if let Some(at_mm) = met_mm(&self.corners(i), &from, &along)
                    && (BESIDE_MM..nearest_mm.get()).contains(&at_mm)
                {
                    nearest_mm.set(at_mm);
                }
                ControlFlow::Continue(())
            },
        );
        nearest_mm.get()
    }
}

/// Whether a straight way of a length meets a box.
fn is_met(b: &Aabb, from: &Point3, along: &Vector3, length_mm: f64) -> bool {
    let (mut enter, mut leave) = (0.0_f64, length_mm);
    for k in 0..3 {
        if along[k].abs() < ALONG {
            if from[k] < b.min[k] || from[k] > b.max[k] {
                return false;
            }
            continue;
        }
        let ends = [b.min[k], b.max[k]].map(|side| (side - from[k]) / along[k]);
        enter = enter.max(ends[0].min(ends[1]));
        leave = leave.min(ends[0].max(ends[1]));
    }
    enter <= leave
}

/// Where a line meets a triangle (Möller and Trumbore 1997), mm from its start.
fn met_mm([a, b, c]: &[Point3; 3], from: &Point3, along: &Vector3) -> Option<f64> {
    let (ab, ac) = (b - a, c - a);
    let across = along.cross(&ac);
    let volume = ab.dot(&across);
    let to = from - a;
    let u = to.dot(&across) / volume;
    let turned = to.cross(&ab);
    let v = along.dot(&turned) / volume;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| ac.dot(&turned) / volume)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_meet_triangles_where_they_should() {
        let triangle =
            [Point3::new(4.0, -1.0, -1.0), Point3::new(5.0, 3.0, -1.0), Point3::new(6.0, 0.0, 3.0)];
        let middle = Point3::from((triangle[0].coords + triangle[1].coords + triangle[2].coords) / 3.0);
        let along = middle.coords.normalize();
        let at = met_mm(&triangle, &Point3::origin(), &along).expect("met");
        assert!((at - middle.coords.norm()).abs() < 1e-12);
        assert!(met_mm(&triangle, &Point3::origin(), &Vector3::y()).is_none());
        let b = Aabb::of(triangle.iter());
        assert!(is_met(&b, &Point3::origin(), &along, 10.0));
        assert!(!is_met(&b, &Point3::origin(), &along, 2.0), "too far");
        assert!(!is_met(&b, &Point3::origin(), &Vector3::y(), 10.0));
    }
}
