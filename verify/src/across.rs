//! A direction across an axis, where any will do.

use claymill_nurbs::Vector3;

/// A unit vector at right angles to a unit axis: the same for the same axis.
pub(crate) fn across(axis: &Vector3) -> Vector3 {
    axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize()
}
