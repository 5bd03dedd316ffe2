//! The two sides of a region that the user chooses by points (`--guide`); a missing second side is
//! the one across.

use claymill_nurbs::Point3;

use super::guides::{GuideKind, Guides, HOLE, ROUND_END, Ring, TIP};
use super::{FieldError, RegionMesh};

/// A side of a region: a loop of its border, or a stretch of one from corner to corner.
struct Side {
    /// Index of the loop.
    loop_: usize,
    ring: Ring,
    /// Places in the loop at which it turns, ascending.
    corners: Vec<usize>,
    /// The corner where the stretch begins; none where the loop has less than two.
    begins: Option<usize>,
}

impl Side {
    /// The stretch that begins at a corner, counted on around the loop.
    fn stretch(&self, corner: usize) -> Vec<u32> {
        let [from, to] = [corner, corner + 1].map(|c| self.corners[c % self.corners.len()]);
        self.ring.stretch(from, to)
    }
}

impl RegionMesh<'_> {
    /// Distance of a point from the nearest vertex of the region's border, mm; none for a closed region.
    #[must_use]
    pub fn from_border_mm(&self, p: &Point3) -> Option<f64> {
        self.nearest_on_border(p).map(|(.., mm)| mm)
    }

    /// The side of the region nearest to `from`, and the one nearest to `to` or else the one across. A loop with two corners
    /// or more (turns of 30°) has sides between them, any other is one side.
    ///
    /// # Errors
    /// A closed region has no sides, and both points may name the same one.
    pub fn guides_near(&self, from: &Point3, to: Option<&Point3>) -> Result<Guides, FieldError> {
        let no_side = FieldError::NoGuide { what: "border to choose sides of" };
        let first = self.side_near(from).ok_or(no_side)?;
        let from = self.vertices_of(&first);
        let mut other = match to.and_then(|to| self.side_near(to)) {
            Some(side) if (side.loop_, side.begins) == (first.loop_, first.begins) => {
                return Err(FieldError::NoGuide { what: "second side: both places are beside the same one" });
            }
            Some(side) => self.vertices_of(&side),
            None => self.opposite(&first, &from)?,
        };
        other.retain(|v| !from.contains(v));
        Ok(Guides { from, to: other, kind: GuideKind::Chosen })
    }

    /// The vertex of the border nearest to a point: its loop, its place in it, and how far away it is, mm.
    fn nearest_on_border(&self, p: &Point3) -> Option<(usize, usize, f64)> {
        let distance = |&v: &u32| (self.point(v) - p).norm();
        let places = self.loops().iter().enumerate().flat_map(|(index, l)| {
            l.vertices.iter().enumerate().map(move |(place, v)| (index, place, distance(v)))
        });
        places.min_by(|a, b| a.2.total_cmp(&b.2))
    }

    fn side_near(&self, p: &Point3) -> Option<Side> {
        let (loop_, place, _) = self.nearest_on_border(p)?;
        let ring = Ring::new(self, &self.loops()[loop_]);
        let corners: Vec<usize> = ring.corners().into_iter().map(|c| c.0).collect();
        let before = corners.partition_point(|&c| c <= place) + corners.len();
        let begins = (corners.len() >= 2).then(|| (before - 1) % corners.len());
        Some(Side { loop_, ring, corners, begins })
    }

    fn vertices_of(&self, side: &Side) -> Vec<u32> {
        let whole = || self.loops()[side.loop_].vertices.clone();
        side.begins.map_or_else(whole, |corner| side.stretch(corner))
    }

    /// What lies across from a side: of four and more the one that has no corner with it and whose middle is the farthest
    /// away, of fewer a part around the place farthest away; from a whole loop, the other end of the region.
    fn opposite(&self, side: &Side, vertices: &[u32]) -> Result<Vec<u32>, FieldError> {
        let Some(begins) = side.begins else { return self.other_end(side) };
        let middle = |vertices: &[u32]| self.point(vertices[vertices.len() / 2]);
        let from = middle(vertices);
        let farther = |a: &Point3, b: &Point3| (a - from).norm().total_cmp(&(b - from).norm());
        let count = side.corners.len();
        if count < 4 {
            let border = &self.loops()[side.loop_].vertices;
            let at = |place: &usize| self.point(border[*place]);
            let tip = (0..border.len()).max_by(|a, b| farther(&at(a), &at(b))).unwrap_or(0);
            let [a, b] = side.ring.around(tip, if count == 3 { TIP } else { ROUND_END });
            return Ok(side.ring.stretch(a, b));
        }
        let sides = (2..count - 1).map(|k| side.stretch(begins + k));
        Ok(sides.max_by(|a, b| farther(&middle(a), &middle(b))).unwrap_or_default())
    }

    /// The end of the region away from a whole loop: another loop that is no hole, or where it is farthest away.
    fn other_end(&self, side: &Side) -> Result<Vec<u32>, FieldError> {
        let border = &self.loops()[side.loop_];
        let mut others = self.loops().iter().enumerate().filter(|(k, _)| *k != side.loop_);
        if let Some((_, end)) = others.find(|(_, l)| l.length_mm > HOLE * border.length_mm) {
            return Ok(end.vertices.clone());
        }
        let field = self.distance(&border.vertices)?;
        let values = field.values().iter().enumerate().filter(|v| v.1.is_finite());
        let farthest = values.max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |v| v.0);
        Ok(self.vertices_near(&self.point(farthest as u32)))
    }
}
