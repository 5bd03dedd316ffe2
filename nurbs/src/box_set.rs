//! A few boxes that others may meet: one around all of them tells most of those that do not.

use crate::model::Aabb;

/// Boxes, and one around all of them.
#[derive(Debug, Clone)]
pub struct BoxSet {
    all: Aabb,
    each: Vec<Aabb>,
}

impl BoxSet {
    /// Of these boxes.
    #[must_use]
    pub fn of(boxes: impl IntoIterator<Item = Aabb>) -> Self {
        let each: Vec<Aabb> = boxes.into_iter().collect();
        BoxSet { all: each.iter().fold(Aabb::empty(), |all, b| all.union(b)), each }
    }

    /// The box around all of them.
    #[must_use]
    pub fn around(&self) -> &Aabb {
        &self.all
    }

    /// The boxes, in order.
    #[must_use]
    pub fn each(&self) -> &[Aabb] {
        &self.each
    }

    /// Whether any of them has a point in common with a box.
    #[must_use]
    pub fn meets(&self, other: &Aabb) -> bool {
        self.all.meets(other) && self.each.iter().any(|own| own.meets(other))
    }

    /// Whether any of them has a point in common with any of others.
    #[must_use]
    pub fn meets_any(&self, others: &BoxSet) -> bool {
        self.all.meets(&others.all) && others.each.iter().any(|other| self.meets(other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_between_two_boxes_meets_neither() {
        let at = |x: f64| Aabb::of_corners([x, 0.0, 0.0, x + 1.0, 1.0, 1.0]);
        let two = BoxSet::of([at(0.0), at(10.0)]);
        assert_eq!(two.around(), &Aabb::of_corners([0.0, 0.0, 0.0, 11.0, 1.0, 1.0]));
        assert!(two.meets(&at(0.5)) && two.meets(&at(1.0)) && two.meets(&at(9.0)));
        assert!(!two.meets(&at(5.0)) && !two.meets(&at(12.0)));
        assert!(two.meets_any(&BoxSet::of([at(5.0), at(10.5)])) && !two.meets_any(&BoxSet::of([at(5.0)])));
        assert!(!two.meets(&Aabb::empty()) && !BoxSet::of([]).meets(&at(0.0)));
    }
}
