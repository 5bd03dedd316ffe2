//! Curves that passes are made of: what they follow seen along the tool axis, and splines.

pub(crate) mod banded;
pub(crate) mod contour;
pub(crate) mod cubics;
pub(crate) mod drive;
pub(crate) mod plan_curve;
pub(crate) mod spiral;
pub(crate) mod spline;
