use claymill_nurbs::Point3;

use super::guides::{GuideKind, Guides, HOLE, ROUND_END, Ring, TIP};
use super::{FieldError, RegionMesh};

/// A side of a region: a loop of its border, or a stretch of one from corner to corner.
struct Side {
    ring: usize,
    /// Places in the loop where it begins and ends; the same ones for all of it.
    ends: (usize, usize),
    vertices: Vec<u32>,
}

impl RegionMesh<'_> {
    /// Distance of a point from the nearest vertex of the region's border, mm; none for a closed region.
    #[must_use]
    pub fn from_border_mm(&self, p: &Point3) -> Option<f64> {
        let vertices = self.loops().iter().flat_map(|l| &l.vertices);
        vertices.map(|&v| (self.point(v) - p).norm()).min_by(f64::total_cmp)
    }

    /// The side of the region nearest to `from`, and the one nearest to `to` or else the one across. A loop with two corners
    /// or more (turns of 30°) has sides between them, any other is one side.
    ///
    /// # Errors
    /// A closed region has no sides, and both points may name the same one.
    pub fn guides_near(&self, from: &Point3, to: Option<&Point3>) -> Result<Guides, FieldError> {
        let no_side = FieldError::NoGuide { what: "border to choose sides of" };
        let first = self.side_near(from).ok_or(no_side)?;
        let mut other = match to.and_then(|to| self.side_near(to)) {
            Some(side) if (side.ring, side.ends) == (first.ring, first.ends) => {
                return Err(FieldError::NoGuide { what: "second side: both places are beside the same one" });
            }
            Some(side) => side.vertices,
            None => self.opposite(&first)?,
        };
        other.retain(|v| !first.vertices.contains(v));
        Ok(Guides { from: first.vertices, to: other, kind: GuideKind::Chosen })
    }

    fn side_near(&self, p: &Point3) -> Option<Side> {
        let distance = |&v: &u32| (self.point(v) - p).norm();
        let places = self.loops().iter().enumerate().flat_map(|(ring, l)| {
            l.vertices.iter().enumerate().map(move |(place, v)| (ring, place, distance(v)))
        });
        let (ring, place, _) = places.min_by(|a, b| a.2.total_cmp(&b.2))?;
        let border = Ring::new(self, &self.loops()[ring]);
        let corners: Vec<usize> = border.corners().into_iter().map(|c| c.0).collect();
        if corners.len() < 2 {
            return Some(Side { ring, ends: (0, 0), vertices: self.loops()[ring].vertices.clone() });
        }
        let after = corners.partition_point(|&c| c <= place);
        let ends = (corners[(after + corners.len() - 1) % corners.len()], corners[after % corners.len()]);
        Some(Side { ring, ends, vertices: border.stretch(ends.0, ends.1) })
    }

    /// What lies across from a side: of four and more the one that has no corner with it and whose middle is the farthest
    /// away, of fewer a part around the place farthest away; from a whole loop, the other end of the region.
    fn opposite(&self, side: &Side) -> Result<Vec<u32>, FieldError> {
        let middle = |vertices: &[u32]| self.point(vertices[vertices.len() / 2]);
        let from = middle(&side.vertices);
        let farther = |a: &Point3, b: &Point3| (a - from).norm().total_cmp(&(b - from).norm());
        let border = &self.loops()[side.ring];
        if side.ends.0 == side.ends.1 {
            let is_end = |l: &&super::BoundaryLoop| l.length_mm > HOLE * border.length_mm;
            let others = self.loops().iter().enumerate().filter(|(k, _)| *k != side.ring).map(|(_, l)| l);
            if let Some(end) = others.clone().find(is_end) {
                return Ok(end.vertices.clone());
            }
            let field = self.distance(&side.vertices)?;
            let values = field.values().iter().enumerate().filter(|v| v.1.is_finite());
            let farthest = values.max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |v| v.0);
            return Ok(self.vertices_near(&self.point(farthest as u32)));
        }
        let ring = Ring::new(self, border);
        let corners: Vec<usize> = ring.corners().into_iter().map(|c| c.0).collect();
        let begins = corners.iter().position(|&c| c == side.ends.0).unwrap_or(0);
        let count = corners.len();
        if count < 4 {
            let places = 0..border.vertices.len();
            let at = |place: &usize| self.point(border.vertices[*place]);
            let tip = places.max_by(|a, b| farther(&at(a), &at(b))).unwrap_or(0);
            let [a, b] = ring.around(tip, if count == 3 { TIP } else { ROUND_END });
            return Ok(ring.stretch(a, b));
        }
        let sides = (2..count - 1).map(|k| [begins + k, begins + k + 1].map(|c| corners[c % count]));
        let sides = sides.map(|[a, b]| ring.stretch(a, b));
        let far = sides.max_by(|a, b| farther(&middle(a), &middle(b)));
        Ok(far.unwrap_or_default())
    }
}
