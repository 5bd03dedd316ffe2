//! The vector area of a face, the integral of its unit normal: `½ ∮ S × dS` along its boundary by
//! Stokes' theorem.

use crate::arc::Arc;
use crate::gauss::nodes;
use crate::mesh::rectangle;
use crate::rings::rings;
use crate::{Face, Point2, Vector3};

impl Face {
    /// What the trimmed face shows of itself along each axis, mm²: the integral of its unit normal (`Su × Sv`).
    ///
    /// By Stokes' theorem `½ ∮ S × dS` along the exact trim curves: nothing but the boundary counts.
    #[must_use]
    pub fn vector_area_mm2(&self) -> Vector3 {
        let surface = &self.surface;
        let border = self.border();
        let Some(origin) = border.first().map(|a| surface.point(a.start().x, a.start().y)) else {
            return Vector3::zeros();
        };
        let knots = [surface.knots_u().breaks(), surface.knots_v().breaks()];
        let parts = border.iter().flat_map(Arc::monotone).flat_map(|a| between(a, &knots));
        let along = |arc: Arc| -> Vector3 {
            let at = |(t, weight): (f64, f64)| {
                let (at, slope) = arc.jet(t);
                let jet = surface.jet(at.x, at.y);
                (jet.p - origin).cross(&(jet.su * slope.x + jet.sv * slope.y)) * weight
            };
            nodes().map(at).sum()
        };
        parts.map(along).sum::<Vector3>() * 0.5
    }

    /// The closed chains of arcs around the face.
    fn border(&self) -> Vec<Arc> {
        let ((u0, u1), (v0, v1)) = self.surface.domain();
        let whole = (Point2::new(u0, v0), Point2::new(u1, v1));
        let rings = rings(self);
        let window = if self.loops.is_empty() { Some(whole) } else { rectangle(self, &rings, whole) };
        let sides = window.map(|(a, b)| {
            let corners = [a, Point2::new(b.x, a.y), b, Point2::new(a.x, b.y)];
            (0..4).map(|k| Arc::line(corners[k], corners[(k + 1) % 4])).collect()
        });
        sides.unwrap_or_else(|| rings.into_iter().flat_map(|r| r.arcs).collect())
    }
}

/// The parts of a monotone arc between the knots of the surface.
fn between(arc: Arc, knots: &[Vec<f64>; 2]) -> Vec<Arc> {
    let mut parts = vec![arc];
    for (axis, knots) in knots.iter().enumerate() {
        for &knot in knots {
            let cut = |a: Arc| match a.crossing(axis, knot) {
                Some(t) => <[Arc; 2]>::from(a.split(t)).to_vec(),
                None => vec![a],
            };
            parts = parts.into_iter().flat_map(cut).collect();
        }
    }
    parts
}
