//! The sweeps of a region, shared by the setups that cut it.

use std::sync::{Arc, OnceLock};

use claymill_nurbs::{FaceId, Vector3};
use claymill_surface_merge::{Guides, RegionMesh};

use crate::Strategy;
use crate::pattern::levels::field::Sweep;
use crate::setup::context::SetupContext;
use crate::setup::sides::Sides;

/// A region's mesh, with the fields that sweep it: each is made when it is first asked for.
pub(crate) struct Sweeps<'a, 'm> {
    pub(crate) mesh: &'a RegionMesh<'m>,
    faces: &'a [FaceId],
    sides: &'a Sides,
    /// The sides that lines run between, where somebody chose them.
    chosen: Option<Guides>,
    harmonic: OnceLock<Option<Arc<Sweep<'a, 'm>>>>,
    scallop: OnceLock<Option<Arc<Sweep<'a, 'm>>>>,
}

impl<'a, 'm> Sweeps<'a, 'm> {
    pub(crate) fn new(
        mesh: &'a RegionMesh<'m>,
        faces: &'a [FaceId],
        sides: &'a Sides,
        chosen: Option<Guides>,
    ) -> Self {
        Sweeps { mesh, faces, sides, chosen, harmonic: OnceLock::new(), scallop: OnceLock::new() }
    }

    /// The sweep that a strategy follows, if there is one.
    pub(crate) fn of(&self, strategy: Strategy, context: &SetupContext) -> Option<Arc<Sweep<'a, 'm>>> {
        let in_steps = |up: &dyn Fn(FaceId, Vector3) -> Vector3| {
            let from = self.chosen.as_ref().map_or_else(|| self.mesh.distance_guide(), |g| g.from.clone());
            Sweep::scallop(self.mesh, &from, context, up).ok().map(Arc::new)
        };
        match strategy {
            Strategy::Flow => {
                let between = || self.chosen.clone().unwrap_or_else(|| self.mesh.guides());
                let make = || Sweep::harmonic(self.mesh, &between()).ok().map(Arc::new);
                self.harmonic.get_or_init(make).clone()
            }
            Strategy::Scallop if self.sides.suit(self.faces, context.index) => {
                self.scallop.get_or_init(|| in_steps(&|face, n| self.sides.up(face, n))).clone()
            }
            // A sheet is cut from both sides, and curved the other way on the other one.
            Strategy::Scallop => {
                let axis = context.frame.axis();
                in_steps(&|_, n| if n.dot(&axis) < 0.0 { -n } else { n })
            }
            _ => None,
        }
    }
}
