//! Whether a ball that rests somewhere touches the side of a face that is free of material.

use claymill_nurbs::{Foot, Point3, Vector3};

use crate::material::behind::Material;
use crate::material::free_sides::FreeSides;
use crate::material::rims::Rims;
use crate::{BallDrop, Location, Support};

impl<'a> BallDrop<'a> {
    /// The same for a ball that cuts these sides of faces. It rests where it would, and is asked whether it may.
    #[must_use]
    pub fn on_free_sides(mut self, free: FreeSides<'a>, rims: Rims, material: Option<Material<'a>>) -> Self {
        (self.free, self.rims, self.material) = (free, rims, material);
        self
    }

    /// The sides of faces that may be cut.
    #[must_use]
    pub fn free(&self) -> FreeSides<'a> {
        self.free
    }

    /// Whether it could be in the material anywhere.
    #[must_use]
    pub fn has_material(&self) -> bool {
        self.material.is_some()
    }

    /// Whether the ball is in the material somewhere on its way up from a place of its centre.
    #[must_use]
    pub fn is_in_material_above(&self, centre: &Point3) -> bool {
        // Within another end fits a ball that is as wide and as low.
        let centre = centre + Vector3::z() * self.end().flat_mm;
        self.material.as_ref().is_some_and(|material| material.is_above(&centre))
    }

    /// Whether it is with its centre at a place of the model, of which `foot` is nearest to there.
    #[must_use]
    pub fn is_in_material(&self, foot: &Foot, centre: &Point3) -> bool {
        self.material.as_ref().is_some_and(|material| material.holds(foot, centre))
    }

    /// Whether the inside of a face carries the ball on the side of the material, or the ball has rolled over an open border to
    /// that side. Whether it would have to come through the material is not asked: that takes closest points on its whole way
    /// up, and what is written is looked at once more.
    #[must_use]
    pub fn touches_material(&self, at: &Location) -> bool {
        let (u, v) = match at.support {
            Support::Face { u, v } => (u, v),
            // What is bounded only is mostly such an edge, where a surface is singular.
            Support::Edge | Support::Bound => {
                return self.rims.is_rolled_over(&self.contact(at), &at.normal);
            }
            Support::Side => return false,
        };
        !self.free.of(at.face).is_both()
            && (self.surface(at.face).normal(u, v))
                .is_some_and(|(n, _)| !self.free.allow(at.face, n.dot(&at.normal) > 0.0))
    }
}
