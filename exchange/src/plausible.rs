//! Coordinates that no model has: a face that reaches thousands of times as far out as half of the model does is
//! damaged, and would take hours of work for nothing.

use claymill_nurbs::{Face, Point3};

use crate::{Import, Skipped};

/// A point may lie so many times as far out as half of the model's, ...
const TIMES: f64 = 1000.0;
/// ... and within this distance of the model's middle in any case, mm: 1 km, more than any ship.
const NEAR_MM: f64 = 1e6;

/// Tolerances that files declare are believed up to this, mm: beyond it anything would meet anything.
pub(crate) const LARGEST_TOLERANCE_MM: f64 = 10.0;

/// Where a model is, and how far from there its points may lie.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    middle: Point3,
    limit_mm: f64,
}

impl Reach {
    /// Of a model with these points, mm. The medians are those of what is sound, however far away the rest is.
    pub(crate) fn of(points: impl Iterator<Item = Point3>) -> Self {
        let points: Vec<Point3> = points.collect();
        let median = |values: &mut Vec<f64>| {
            let at = values.len() / 2;
            if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(at, f64::total_cmp).1 }
        };
        let along = |axis: usize| median(&mut points.iter().map(|p| p[axis]).collect());
        let middle = Point3::new(along(0), along(1), along(2));
        let far = median(&mut points.iter().map(|p| (p - middle).norm()).collect());
        Reach { middle, limit_mm: (TIMES * far).max(NEAR_MM) }
    }

    /// How far beyond the limit a point lies: its distance from the middle, mm.
    pub(crate) fn beyond_mm(&self, p: &Point3) -> Option<f64> {
        let distance = (p - self.middle).norm();
        (distance > self.limit_mm).then_some(distance)
    }

    /// The reason to leave something out that reaches so far.
    pub(crate) fn reason(&self, distance_mm: f64) -> String {
        format!(
            "it reaches {distance_mm:.3e} mm from the middle of the model, where up to {:.3e} mm are plausible: half of \
             the model is far nearer",
            self.limit_mm
        )
    }
}

fn net(face: &Face) -> impl Iterator<Item = Point3> {
    face.surface.net().iter().map(|h| Point3::from(h.xyz() / h.w))
}

impl Import {
    /// Leaves out faces that reach implausibly far.
    pub(crate) fn with_plausible_faces(mut self) -> Self {
        let reach = Reach::of(self.model.faces.iter().flat_map(net));
        let far = |face: &Face| net(face).filter_map(|p| reach.beyond_mm(&p)).reduce(f64::max);
        let skipped = &mut self.report.skipped;
        self.model.faces.retain(|face| {
            let Some(distance_mm) = far(face) else { return true };
            skipped.push(Skipped {
                entity: face.source.entity.clone(),
                what: "face".into(),
                reason: reach.reason(distance_mm),
                advice: "A coordinate is damaged, or something lies far from the model: correct or delete it in the \
                         original system and export again."
                    .into(),
            });
            false
        });
        self.report.faces_read = self.model.faces.len();
        if self.report.tolerance_mm >= LARGEST_TOLERANCE_MM {
            self.report.warnings.push(format!(
                "The file declares a tolerance of {LARGEST_TOLERANCE_MM} mm or more: {LARGEST_TOLERANCE_MM} mm were taken; \
                 check it in the original system."
            ));
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_knows_what_is_far() {
        let car = (0..1000).map(|i| Point3::new(f64::from(i) * 4.0, f64::from(i % 7) * 200.0, 500.0));
        let reach = Reach::of(car.chain([Point3::new(1e9, 0.0, 0.0), Point3::new(0.0, -3e8, 0.0)]));
        assert_eq!(reach.beyond_mm(&Point3::new(-9e5, 0.0, 0.0)), None);
        assert!(reach.beyond_mm(&Point3::new(1e9, 0.0, 0.0)).is_some_and(|d| (d - 1e9).abs() < 1e4));
        // A model in metres that are declared as kilometres is as large as it says.
        let large = Reach::of((0..100).map(|i| Point3::new(f64::from(i) * 1e6, 0.0, 0.0)));
        assert_eq!(large.beyond_mm(&Point3::new(1e9, 0.0, 0.0)), None);
        assert_eq!(Reach::of(std::iter::empty()).beyond_mm(&Point3::origin()), None);
    }
}
