//! Axes to turn a part about: how much of it is seen from around each, and how thick a bar it needs.

use claymill_contact::{Axis, Frame};
use claymill_toolpath::{Monitor, Stage};
use rayon::prelude::*;

use crate::error::ReachError;
use crate::part::Part;
use crate::samples::{samples, spacing_mm};
use crate::slices::Slices;

/// An axis to turn a part about.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisView {
    /// The axis.
    pub axis: Axis,
    /// Share of the area that is seen from some angle about it, from 0 to 1.
    pub seen_share: f64,
    /// Smallest diameter of a bar along it that holds the part, mm.
    pub bar_mm: f64,
    /// A point on the bar's middle line, in model coordinates.
    pub middle: [f64; 3],
    /// Length of the part along it, mm.
    pub length_mm: f64,
}

/// Triangles keep within this share of the part's size.
const DEVIATION_SHARE: f64 = 1e-4;
/// Samples are as fine as for a tool of this share of the part's size.
const TOOL_SHARE: f64 = 0.01;
/// An axis from which this share is seen sees all: samples beside edges are seen by rounding or not.
pub const SEEN_SHARE: f64 = 0.999;

/// Looks at a part from around axes. Nothing leans too far, for a tool may pass beside it.
///
/// # Errors
/// A face cannot be covered, nothing has an area, or the monitor ends it.
pub fn axis_views(part: &Part, axes: &[Axis], monitor: &dyn Monitor) -> Result<Vec<AxisView>, ReachError> {
    let size_mm = part.face_area_mm2.iter().sum::<f64>().sqrt();
    let deviation_mm = (DEVIATION_SHARE * size_mm).max(1e-4);
    let radius_mm = TOOL_SHARE * size_mm;
    let covering = part.covering(radius_mm.max(1e-3))?;
    let all = samples(part, &covering, spacing_mm(size_mm * size_mm, radius_mm));
    if all.is_empty() {
        return Err(ReachError::Nothing);
    }
    let whole_mm2: f64 = all.iter().map(|s| s.area_mm2).sum();
    let mut views = Vec::with_capacity(axes.len());
    for (k, &axis) in axes.iter().enumerate() {
        monitor.go_on()?;
        monitor.at(Stage::Setups, k as f64 / axes.len() as f64);
        let other = Axis { index: (axis.index + 1) % 3, negative: false };
        let frame = Frame::new("axis", axis, other)?;
        let slices = Slices::new(part, &frame, deviation_mm, 90.0)?;
        let seen: Vec<f64> = all
            .par_iter()
            .map(|sample| if slices.arcs(sample).is_empty() { 0.0 } else { sample.area_mm2 })
            .collect();
        let (bar_mm, [x, y]) = slices.bar();
        let [low, high] = slices.along_mm();
        let middle = frame.to_model(&claymill_nurbs::Point3::new(x, y, 0.5 * (low + high)));
        let seen_share = seen.iter().sum::<f64>() / whole_mm2;
        views.push(AxisView { axis, seen_share, bar_mm, middle: middle.into(), length_mm: high - low });
    }
    Ok(views)
}

/// The axis of the thinnest bar among those that all is seen from, or else the one from which most is seen.
#[must_use]
pub fn best_axis(views: &[AxisView]) -> Option<&AxisView> {
    let all = views.iter().filter(|view| view.seen_share >= SEEN_SHARE);
    let thinnest = all.min_by(|a, b| a.bar_mm.total_cmp(&b.bar_mm));
    let most = || {
        views.iter().min_by(|a, b| b.seen_share.total_cmp(&a.seen_share).then(a.bar_mm.total_cmp(&b.bar_mm)))
    };
    thinnest.or_else(most)
}
