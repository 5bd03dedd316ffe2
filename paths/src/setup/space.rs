//! The model as it is around a ball anywhere, whichever way the tool came.

use claymill_nurbs::{ClosestPoints, Model, Point3, Vector3};

use crate::setup::leaning::LEAST_FACING;

/// Lines of sight begin this far from the surface, mm.
const OFF_SURFACE_MM: f64 = 0.01;

/// A model that stands somewhere.
pub(crate) struct Space<'a> {
    /// Nearest points of it, in its coordinates.
    pub(crate) closest: ClosestPoints<'a>,
    up: Vector3,
}

impl<'a> Space<'a> {
    /// With `up` upwards.
    pub(crate) fn new(model: &'a Model, up: Vector3) -> Self {
        Space { closest: ClosestPoints::new(model), up }
    }

    /// Whether a place that faces along `normal` looks down, with nothing of the model less than `far_mm` below.
    pub(crate) fn is_underside(&self, at: &Point3, normal: &Vector3, far_mm: f64) -> bool {
        normal.dot(&self.up) < -LEAST_FACING && {
            let from = at + normal * OFF_SURFACE_MM;
            self.closest.crossings(&from, &-self.up, far_mm).all.is_empty()
        }
    }
}
