//! Waterlines: passes on which the ball's centre keeps its height along the tool axis.

use std::collections::BTreeSet;
use std::sync::Arc;

use claymill_nurbs::{FaceId, NurbsSurface};
use claymill_surface_merge::{Field, IsoPoint, Polyline, RegionMesh};

use crate::pattern::levels::field::faces_of;
use crate::pattern::levels::pattern::{Levels, Spot};
use crate::setup::claimed_mesh::ClaimedMesh;
use crate::setup::context::SetupContext;
use crate::setup::slopes::climb;

/// The height of the ball's centre when it touches the faces of a region.
pub(crate) struct CentreHeights<'a, 'm> {
    field: Field<'a, 'm>,
    context: &'a SetupContext<'a>,
}

/// Its level curves between two heights.
pub(crate) struct Waterlines<'b, 'a, 'm> {
    heights: &'b CentreHeights<'a, 'm>,
    claimed: Arc<ClaimedMesh>,
    range: (f64, f64),
}

impl<'a, 'm> CentreHeights<'a, 'm> {
    pub(crate) fn new(mesh: &'a RegionMesh<'m>, context: &'a SetupContext<'a>) -> Self {
        let height = |v: &claymill_surface_merge::SurfacePoint| {
            let surface = context.ball.surface(v.face);
            let (n, _) = surface.normal(v.uv.x, v.uv.y)?;
            Some(surface.point(v.uv.x, v.uv.y).z + n.z.abs() * context.ball.radius_mm())
        };
        let heights = mesh.vertices().iter().map(|v| height(v).unwrap_or(f64::NAN)).collect();
        CentreHeights { field: Field::new(mesh, heights), context }
    }

    /// Faces on which there are waterlines.
    pub(crate) fn faces(&self) -> BTreeSet<FaceId> {
        faces_of(&self.field)
    }

    /// The waterlines of each range of heights in which something is cut: far apart on a region, what is cut needs
    /// levels of its own.
    pub(crate) fn waterlines(&self) -> Vec<Waterlines<'_, 'a, 'm>> {
        let claimed = Arc::new(ClaimedMesh::new(self.field.mesh(), self.context));
        let ranges = claimed.ranges(&self.field).into_iter();
        ranges.map(|range| Waterlines { heights: self, claimed: claimed.clone(), range }).collect()
    }

    fn surface(&self, face: FaceId) -> &NurbsSurface {
        self.context.ball.surface(face)
    }

    fn spots(&self, lines: Vec<Polyline>) -> Vec<Vec<Spot>> {
        let spots = |line: Polyline| {
            let mut spots: Vec<Spot> = line.points.iter().map(|p| self.spot(*p)).collect();
            if line.closed && !spots.is_empty() {
                let beginning = self.beginning(&spots);
                spots.rotate_left(beginning);
                spots.push(spots[0]);
            }
            spots
        };
        lines.into_iter().map(spots).collect()
    }

    /// A place of a line, with the way along the surface for a millimetre of height.
    fn spot(&self, point: IsoPoint) -> Spot {
        let (face, uv) = (point.at.face, point.at.uv);
        let jet = self.surface(face).jet(uv.x, uv.y);
        let up = jet.normal().map(|n| if n.z < 0.0 { -n } else { n });
        let climb = up.and_then(|n| climb(&jet, &n, self.context.ball.radius_mm()));
        let climb = climb.unwrap_or_else(|| point.gradient.norm());
        Spot { face, u: uv.x, v: uv.y, per_level_mm: 1.0 / climb.max(1e-12) }
    }

    /// Where a closed line begins: after a place that is not cut, else where it is farthest along the setup's `x`,
    /// so that lines one above the other begin close together.
    fn beginning(&self, line: &[Spot]) -> usize {
        let cut = |s: &Spot| self.context.claims_at(s.face, s.u, s.v);
        let x = |s: &Spot| self.surface(s.face).point(s.u, s.v).x;
        let uncut = line.iter().position(|s| !cut(s));
        uncut.or_else(|| (0..line.len()).max_by(|&a, &b| x(&line[a]).total_cmp(&x(&line[b])))).unwrap_or(0)
    }
}

impl Levels for Waterlines<'_, '_, '_> {
    fn range(&self) -> (f64, f64) {
        self.range
    }

    fn whole_lines(&self, level: f64) -> Vec<Vec<Spot>> {
        self.heights.spots(self.heights.field.iso_line(level))
    }

    fn lines(&self, level: f64) -> Vec<Vec<Spot>> {
        self.heights.spots(self.heights.field.iso_line_on(level, |triangle| self.claimed.is_near(triangle)))
    }

    fn height_mm(&self, level: f64) -> Option<f64> {
        Some(level)
    }
}
