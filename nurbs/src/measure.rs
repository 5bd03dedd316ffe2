use crate::{Aabb, Face};

impl Face {
    /// Area of the trimmed face, mm², to a relative accuracy of 1e-7 or better.
    #[must_use]
    pub fn area_mm2(&self) -> f64 {
        todo!()
    }

    /// Box around the trimmed face, within 1e-4 mm of the smallest one.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        todo!()
    }
}
