//! Passes that sweep a whole region: level curves of a field over its mesh.

use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::sync::Arc;

use claymill_nurbs::{FaceId, Point2, Vector3};
use claymill_surface_merge::{Field, FieldError, Guides, IsoPoint, Polyline, RegionMesh};

use crate::pattern::levels::pattern::{Levels, Spot};
use crate::pattern::step_over::{flat_mm, on_contact_mm};
use crate::setup::claimed_mesh::ClaimedMesh;
use crate::setup::context::SetupContext;

/// Edges of region meshes, in flat step-overs, and their limits, in ball radii.
const EDGE_STEPS: f64 = 1.5;
const EDGE_RADII: (f64, f64) = (0.3, 1.0);

/// Length of a region mesh's edges that suits the step-over.
pub(crate) fn mesh_edge_mm(radius_mm: f64, scallop_mm: f64) -> f64 {
    (EDGE_STEPS * flat_mm(radius_mm, scallop_mm)).clamp(EDGE_RADII.0 * radius_mm, EDGE_RADII.1 * radius_mm)
}

/// A field whose iso-lines passes follow.
pub(crate) struct Sweep<'a, 'm> {
    field: Field<'a, 'm>,
    /// A unit of the field is a step-over.
    in_steps: bool,
}

/// The iso-lines of a field between two levels.
pub(crate) struct FieldLevels<'a, 'm> {
    sweep: Arc<Sweep<'a, 'm>>,
    claimed: Arc<ClaimedMesh>,
    range: (f64, f64),
}

impl<'a, 'm> Sweep<'a, 'm> {
    /// A harmonic field between two guides: lines sweep from the one to the other.
    pub(crate) fn harmonic(mesh: &'a RegionMesh<'m>, guides: &Guides) -> Result<Self, FieldError> {
        Ok(Sweep { field: mesh.harmonic(&guides.from, &guides.to)?, in_steps: false })
    }

    /// The distance from a guide, counted in step-overs: lines keep the scallop height (docs/theory.md §5.1) on the side
    /// that is `up`, which turns a face's normal there.
    pub(crate) fn scallop(
        mesh: &'a RegionMesh<'m>,
        from: &[u32],
        context: &SetupContext,
        up: impl Fn(FaceId, Vector3) -> Vector3,
    ) -> Result<Self, FieldError> {
        let radius_mm = context.ball.radius_mm();
        let flat = flat_mm(radius_mm, context.scallop_mm);
        let steps = |face: FaceId, at: Point2, along: &Vector3| {
            let jet = context.model.faces[face].surface.jet(at.x, at.y);
            let step = jet
                .normal()
                .and_then(|n| on_contact_mm(&jet, along, &up(face, n), radius_mm, context.scallop_mm));
            // Where patches shrink to a point curvature has no bounds; but the surface turns by no more than half a turn
            // on the way to a neighbour, and that many steps are enough for it.
            let length_mm = along.norm();
            let closest = flat / (1.0 + PI * radius_mm / length_mm).sqrt();
            length_mm / step.filter(|s| s.is_finite() && *s > 0.0).unwrap_or(flat).max(closest)
        };
        Ok(Sweep { field: mesh.distance_in(from, steps)?, in_steps: true })
    }

    /// Faces on which the field has values.
    pub(crate) fn faces(&self) -> BTreeSet<FaceId> {
        faces_of(&self.field)
    }

    /// The iso-lines of each range of levels in which something is cut.
    pub(crate) fn levels(self: &Arc<Self>, context: &SetupContext) -> Vec<FieldLevels<'a, 'm>> {
        let claimed = Arc::new(ClaimedMesh::new(self.field.mesh(), context));
        let ranges = claimed.ranges(&self.field).into_iter();
        ranges.map(|range| FieldLevels { sweep: self.clone(), claimed: claimed.clone(), range }).collect()
    }
}

/// Faces on which a field has values.
pub(crate) fn faces_of(field: &Field) -> BTreeSet<FaceId> {
    let mesh = field.mesh();
    let values = field.values();
    let has_value = |t: &[u32; 3]| t.iter().all(|&v| values[v as usize].is_finite());
    let triangles = mesh.triangles().iter().zip(mesh.face_of_triangle());
    triangles.filter(|(t, _)| has_value(t)).map(|(_, &face)| face).collect()
}

impl Levels for FieldLevels<'_, '_> {
    fn range(&self) -> (f64, f64) {
        self.range
    }

    fn in_steps(&self) -> bool {
        self.sweep.in_steps
    }

    fn whole_lines(&self, level: f64) -> Vec<Vec<Spot>> {
        spots(self.sweep.field.iso_line(level))
    }

    fn lines(&self, level: f64) -> Vec<Vec<Spot>> {
        spots(self.sweep.field.iso_line_on(level, |triangle| self.claimed.is_near(triangle)))
    }
}

fn spots(lines: Vec<Polyline>) -> Vec<Vec<Spot>> {
    let spots = |line: Polyline| {
        let again = line.points.first().copied().filter(|_| line.closed);
        let spot = |p: IsoPoint| Spot {
            face: p.at.face,
            u: p.at.uv.x,
            v: p.at.uv.y,
            per_level_mm: 1.0 / p.gradient.norm().max(1e-12),
        };
        line.points.iter().copied().chain(again).map(spot).collect()
    };
    lines.into_iter().map(spots).collect()
}
