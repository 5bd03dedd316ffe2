//! The fewest angles that meet all arcs of a circle, exactly.

/// An arc of a circle, from one angle on to another, degrees. Both ends belong to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Where it begins.
    pub from_deg: f64,
    /// How far it goes on, 360 at most.
    pub span_deg: f64,
}

/// Angles that differ by less are the same, degrees.
const SAME_DEG: f64 = 1e-9;
const TURN_DEG: f64 = 360.0;

impl Arc {
    /// Whether an angle lies on it.
    #[must_use]
    pub fn contains(&self, deg: f64) -> bool {
        let along = (deg - self.from_deg).rem_euclid(TURN_DEG);
        along <= self.span_deg + SAME_DEG || along >= TURN_DEG - SAME_DEG
    }

    fn end_deg(&self) -> f64 {
        (self.from_deg + self.span_deg).rem_euclid(TURN_DEG)
    }
}

/// The fewest angles of which every arc holds one, from the lowest.
///
/// Some best choice has all its angles at ends of arcs. So each end is tried as the first angle. What is left then lies
/// on a line, where taking the nearest end of all arcs that are not met yet is best.
///
/// ```
/// use claymill_reach::{Arc, fewest_angles};
///
/// let faces = [0.0, 90.0, 180.0, 270.0].map(|deg| Arc { from_deg: deg - 60.0, span_deg: 120.0 });
/// assert_eq!(fewest_angles(&faces).len(), 2);
/// ```
#[must_use]
pub fn fewest_angles(arcs: &[Arc]) -> Vec<f64> {
    let mut best: Option<Vec<f64>> = None;
    for first in arcs.iter().map(Arc::end_deg) {
        let mut angles = vec![first];
        // The others, as they end after the first angle. None of them passes it.
        let mut rest: Vec<(f64, &Arc)> = arcs
            .iter()
            .filter(|arc| !arc.contains(first))
            .map(|arc| ((arc.end_deg() - first).rem_euclid(TURN_DEG), arc))
            .collect();
        rest.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (end, arc) in rest {
            if !arc.contains(*angles.last().unwrap_or(&first)) {
                angles.push((first + end).rem_euclid(TURN_DEG));
            }
        }
        if best.as_ref().is_none_or(|b| angles.len() < b.len()) {
            best = Some(angles);
        }
    }
    let mut best = best.unwrap_or_default();
    best.sort_by(f64::total_cmp);
    best
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// By trying all choices of ends.
    fn by_force(arcs: &[Arc]) -> usize {
        let ends: Vec<f64> = arcs.iter().map(Arc::end_deg).collect();
        (0..1_u32 << arcs.len())
            .filter(|chosen| {
                arcs.iter().all(|a| (0..arcs.len()).any(|k| chosen >> k & 1 == 1 && a.contains(ends[k])))
            })
            .map(u32::count_ones)
            .min()
            .unwrap_or(0) as usize
    }

    proptest! {
        #[test]
        fn no_choice_has_fewer(arcs in prop::collection::vec((0.0..360.0_f64, 0.0..200.0_f64), 0..9)) {
            let arcs: Vec<Arc> =
                arcs.into_iter().map(|(from_deg, span_deg)| Arc { from_deg, span_deg }).collect();
            let angles = fewest_angles(&arcs);
            prop_assert!(arcs.iter().all(|arc| angles.iter().any(|&deg| arc.contains(deg))));
            prop_assert_eq!(angles.len(), by_force(&arcs));
        }
    }

    #[test]
    fn a_cylinder_and_a_hexagon_take_as_many_as_worked_out_by_hand() {
        let of = |normals: usize, tilt_deg: f64| {
            let step = TURN_DEG / normals as f64;
            let arcs: Vec<Arc> = (0..normals)
                .map(|k| Arc { from_deg: k as f64 * step - tilt_deg, span_deg: 2.0 * tilt_deg })
                .collect();
            fewest_angles(&arcs).len()
        };
        for (tilt_deg, count) in [(80.0, 3), (60.0, 3), (45.0, 4), (30.0, 6), (10.0, 18)] {
            assert_eq!(of(1440, tilt_deg), count, "cylinder, {tilt_deg}");
        }
        for (tilt_deg, count) in [(29.9, 6), (30.0, 3), (59.9, 3), (60.0, 2), (80.0, 2)] {
            assert_eq!(of(6, tilt_deg), count, "hexagon, {tilt_deg}");
        }
    }
}
