//! What a setup sees of the whole model: boxes around what it is covered with, and whether it has rims.

use claymill_nurbs::Aabb;

use crate::drop::BallDrop;

impl BallDrop<'_> {
    /// Calls `visit` with a box around every covered piece, in the setup's coordinates.
    pub fn for_each_box(&self, mut visit: impl FnMut(&Aabb)) {
        self.for_each_box_of_face(|_, piece| visit(piece));
    }

    /// A box around all that covers each face, in the setup's coordinates.
    #[must_use]
    pub fn face_boxes(&self) -> Vec<Aabb> {
        let mut boxes = vec![Aabb::empty(); self.faces.len()];
        self.for_each_box_of_face(|face, piece| boxes[face] = boxes[face].union(piece));
        boxes
    }

    /// Whether there are open borders that it must not roll over.
    #[must_use]
    pub fn has_rims(&self) -> bool {
        !self.rims.is_empty()
    }

    fn for_each_box_of_face(&self, mut visit: impl FnMut(usize, &Aabb)) {
        for t in &self.triangles {
            visit(t.face as usize, &Aabb::of(&t.p).inflated(f64::from(t.deviation_mm)));
        }
        for e in &self.edges {
            visit(e.face as usize, &Aabb::of([&e.a, &e.b]).inflated(e.deviation_mm));
        }
    }
}
