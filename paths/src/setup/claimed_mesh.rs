//! What a setup cuts of a region's mesh.

use claymill_nurbs::Point2;
use claymill_surface_merge::{Field, RegionMesh};

use crate::pattern::levels::pattern::BRIDGE_MM;
use crate::setup::context::SetupContext;

/// The triangles of a region's mesh of which a setup cuts anything, and those around them.
pub(crate) struct ClaimedMesh {
    cut: Vec<bool>,
    near: Vec<bool>,
}

impl ClaimedMesh {
    pub(crate) fn new(mesh: &RegionMesh, context: &SetupContext) -> Self {
        let is_cut = |(corners, &face): (&[Point2; 3], &usize)| {
            let middle = Point2::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0);
            let holds = |uv: &Point2| context.claims_at(face, uv.x, uv.y);
            context.claims.any(face) && (corners.iter().any(holds) || holds(&middle))
        };
        let cut: Vec<bool> = mesh.corners().iter().zip(mesh.face_of_triangle()).map(is_cut).collect();
        // A line is followed over gaps, from either side at least as far as to the middle.
        let rings = (BRIDGE_MM / mesh.edge_mm()).ceil() as usize + 1;
        let mut near = cut.clone();
        for _ in 0..rings {
            let mut touched = vec![false; mesh.vertices().len()];
            for (triangle, _) in mesh.triangles().iter().zip(&near).filter(|(_, near)| **near) {
                triangle.iter().for_each(|&v| touched[v as usize] = true);
            }
            let touches = |triangle: &[u32; 3]| triangle.iter().any(|&v| touched[v as usize]);
            near.iter_mut().zip(mesh.triangles()).for_each(|(near, t)| *near |= touches(t));
        }
        ClaimedMesh { cut, near }
    }

    /// Whether a line over the triangle may be cut, or lead from one stretch that is cut to the next.
    pub(crate) fn is_near(&self, triangle: usize) -> bool {
        self.near[triangle]
    }

    /// The ranges of values, ascending and apart, that a field has where something is cut: what a setup cuts of a region
    /// may be far apart, and may begin and end anywhere.
    pub(crate) fn ranges(&self, field: &Field) -> Vec<(f64, f64)> {
        let cut = (0..self.cut.len()).filter(|&triangle| self.cut[triangle]);
        let mut ranges: Vec<(f64, f64)> = cut.filter_map(|triangle| field.values_on(triangle)).collect();
        ranges.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut apart: Vec<(f64, f64)> = Vec::new();
        for range in ranges {
            match apart.last_mut() {
                Some(open) if range.0 <= open.1 => open.1 = open.1.max(range.1),
                _ => apart.push(range),
            }
        }
        apart
    }
}
