//! The boundary loops of a face, trimmed or not, and trim curves lifted to the surface by the chain
//! rule.

use nalgebra::Point;

use crate::{Curve2, Face, Jet, Leaves, NurbsSurface, Point3, TrimEdge, TrimLoop, Vector2, Vector3};

impl Face {
    /// The boundary loops: the trim loops, or for an untrimmed face the four sides of the domain as one
    /// loop of straight pcurves, anticlockwise (`v = v0`, `u = u1`, `v = v1`, `u = u0`). Sides that collapse
    /// to a point (poles) or meet each other (seams of closed surfaces) are included.
    #[must_use]
    pub fn boundary(&self) -> Vec<TrimLoop> {
        if !self.loops.is_empty() {
            return self.loops.clone();
        }
        let ((u0, u1), (v0, v1)) = self.surface.domain();
        let corners = [(u0, v0), (u1, v0), (u1, v1), (u0, v1)].map(|(u, v)| Point::from([u, v]));
        let edge =
            |i: usize| TrimEdge { pcurve: Curve2::line(corners[i], corners[(i + 1) % 4]), shared: None };
        vec![TrimLoop { edges: (0..4).map(edge).collect() }]
    }
}

impl NurbsSurface {
    /// The point `S(c(t))`, mm.
    #[must_use]
    pub fn point_on(&self, pcurve: &Curve2, t: f64) -> Point3 {
        let c = pcurve.point(t);
        self.point(c.x, c.y)
    }

    /// Position, first and second derivative with respect to `t` of the space curve `S(c(t))` (chain rule).
    #[must_use]
    pub fn lift(&self, pcurve: &Curve2, t: f64) -> [Vector3; 3] {
        let c = pcurve.derivatives(t);
        lifted(&self.jet(c[0].x, c[0].y), c)
    }
}

impl Leaves {
    /// The point of a pcurve on the surface; see [`NurbsSurface::point_on`].
    #[must_use]
    pub fn point_on(&self, pcurve: &Curve2, t: f64) -> Point3 {
        let c = pcurve.point(t);
        self.point(c.x, c.y)
    }

    /// A pcurve as a space curve; see [`NurbsSurface::lift`].
    #[must_use]
    pub fn lift(&self, pcurve: &Curve2, t: f64) -> [Vector3; 3] {
        let c = pcurve.derivatives(t);
        lifted(&self.jet(c[0].x, c[0].y), c)
    }
}

fn lifted(j: &Jet, [_, d1, d2]: [Vector2; 3]) -> [Vector3; 3] {
    let first = j.su * d1.x + j.sv * d1.y;
    let second = j.suu * (d1.x * d1.x)
        + j.suv * (2.0 * d1.x * d1.y)
        + j.svv * (d1.y * d1.y)
        + j.su * d2.x
        + j.sv * d2.y;
    [j.p.coords, first, second]
}
