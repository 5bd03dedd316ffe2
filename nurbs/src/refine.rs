use crate::NurbsSurface;

impl NurbsSurface {
    /// Cuts the surface at `u` into the pieces below and above, exactly (knot insertion, The NURBS Book
    /// A5.3); `None` when `u` is not strictly inside the domain.
    #[must_use]
    pub fn split_u(&self, u: f64) -> Option<(NurbsSurface, NurbsSurface)> {
        let _ = u;
        todo!()
    }

    /// Cuts the surface at `v`; see [`Self::split_u`].
    #[must_use]
    pub fn split_v(&self, v: f64) -> Option<(NurbsSurface, NurbsSurface)> {
        let _ = v;
        todo!()
    }

    /// The same surface with `u` and `v` exchanged.
    #[must_use]
    pub fn transposed(&self) -> Self {
        todo!()
    }

    /// The same surface with `u` run backwards on the same domain.
    #[must_use]
    pub fn reversed_u(&self) -> Self {
        todo!()
    }

    /// The polynomial pieces, each a single-span surface on its own knot interval (so that parameters keep
    /// their meaning), row by row in `u`, then `v`.
    #[must_use]
    pub fn bezier_pieces(&self) -> Vec<NurbsSurface> {
        todo!()
    }
}
