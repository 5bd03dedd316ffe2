//! From which height the tool may enter: above what levels before left standing since it was too little to be cut.

use crate::area::{Approach, Stroke};
use crate::outline::{Outline, Place};
use crate::planar_set::PlanarSet;

/// What is left counts as near if it is within so many radii of the tool's axis: the axis is looked at in places.
const NEAR: f64 = 1.1;
/// Places along each piece of a way in.
const PLACES: usize = 8;

/// What stands above a level.
pub(crate) struct Above {
    /// All above this was cut before, but for what stands, mm.
    pub(crate) cut_mm: f64,
    /// Up to which height something stands, and where the tool's axis would meet it.
    pub(crate) standing: Vec<(f64, Outline)>,
}

impl Above {
    /// Nothing stands above a height.
    pub(crate) fn flat(cut_mm: f64) -> Self {
        Above { cut_mm, standing: Vec::new() }
    }

    /// Something was left up to a height.
    pub(crate) fn leave(&mut self, up_to_mm: f64, left: &PlanarSet, tool_radius_mm: f64) {
        self.standing.push((up_to_mm, Outline::new(&left.dilated(NEAR * tool_radius_mm))));
    }

    /// The height above which nothing is met when the tool comes down for a stroke.
    pub(crate) fn of_stroke(&self, stroke: &Stroke) -> f64 {
        if self.standing.is_empty() {
            return self.cut_mm;
        }
        let way_in = stroke.lead_in.first().or(stroke.cut.first());
        let mut places: Vec<Place> = way_in.into_iter().map(|piece| piece.from).collect();
        if let Approach::Helix { centre, radius_mm } = stroke.approach {
            let turn = |k: usize| {
                let (sine, cosine) = (std::f64::consts::TAU * k as f64 / PLACES as f64).sin_cos();
                [centre[0] + radius_mm * cosine, centre[1] + radius_mm * sine]
            };
            places.extend((0..PLACES).map(turn).chain([centre]));
        } else {
            // A ring may be a ramp.
            let along = |k: usize| k as f64 / PLACES as f64;
            places.extend(stroke.cut.iter().flat_map(|piece| (1..=PLACES).map(move |k| piece.at(along(k)))));
        }
        self.over(&places)
    }

    /// The same for a place where the tool comes up or down.
    pub(crate) fn over(&self, places: &[Place]) -> f64 {
        let met = self.standing.iter().filter(|(_, near)| places.iter().any(|p| near.contains(*p)));
        met.map(|(height, _)| *height).fold(self.cut_mm, f64::max)
    }
}
