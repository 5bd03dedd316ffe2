//! Small models and triangle lattices for tests.

use claymill_nurbs::{Face, Model, NurbsSurface, Source, SurfaceKind};

/// Whole surfaces as the faces of a model.
#[must_use]
pub fn model_of(surfaces: impl IntoIterator<Item = NurbsSurface>) -> Model {
    let face = |surface| Face {
        surface,
        loops: Vec::new(),
        reversed: false,
        kind: SurfaceKind::Nurbs,
        source: Source::default(),
    };
    Model { faces: surfaces.into_iter().map(face).collect(), ..Model::default() }
}

/// Two triangles for each of `n` × `n` squares between `n + 1` times `n + 1` vertices, column by column.
#[must_use]
pub fn lattice(n: u32) -> Vec<[u32; 3]> {
    let corner = |i: u32, j: u32| i * (n + 1) + j;
    let squares = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    squares
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect()
}
