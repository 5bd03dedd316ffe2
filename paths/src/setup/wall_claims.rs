//! What a setup cuts as walls.

use claymill_contact::Covering;
use claymill_nurbs::ClosestPoints;
use claymill_surface_merge::Joint;

use crate::setup::assignment::Assignments;
use crate::setup::claims::Claims;
use crate::setup::space::Space;

/// The walls of a setup.
pub(crate) struct Walls<'a> {
    /// On the side of `Su × Sv`, and on the other.
    pub(crate) claims: [Claims; 2],
    /// Nearest points of the model.
    pub(crate) closest: &'a ClosestPoints<'a>,
    /// Of the regions.
    pub(crate) joints: &'a [Joint],
}

impl<'a> Walls<'a> {
    pub(crate) fn new(
        covering: &Covering,
        assignments: &Assignments,
        setup: usize,
        space: &'a Space<'_>,
        joints: &'a [Joint],
    ) -> Self {
        let claims = |other_side| Claims::of_walls(covering, assignments, setup, other_side);
        Walls { claims: [false, true].map(claims), closest: &space.closest, joints }
    }
}
