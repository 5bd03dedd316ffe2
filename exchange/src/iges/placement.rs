//! Transformation matrices (124), nested ones included.

use claymill_nurbs::{Point3, Vector3};
use nalgebra::Matrix3;

use super::fault::Fault;
use super::file::File;

/// Matrices in a chain beyond this are a cycle.
const DEEPEST: usize = 32;

/// An affine map from definition space to model space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Placement {
    linear: Matrix3<f64>,
    shift: Vector3,
}

impl Placement {
    /// Scaling about the origin: file units to millimetres, or 1 for parameter space.
    pub(crate) fn scale(factor: f64) -> Self {
        Placement { linear: Matrix3::identity() * factor, shift: Vector3::zeros() }
    }

    /// Scaling, then a shift.
    pub(crate) fn scale_and_shift(factor: f64, shift: Vector3) -> Self {
        Placement { shift, ..Placement::scale(factor) }
    }

    pub(crate) fn point(&self, p: Point3) -> Point3 {
        Point3::from(self.linear * p.coords + self.shift)
    }

    pub(crate) fn vector(&self, v: Vector3) -> Vector3 {
        self.linear * v
    }

    /// The factor by which lengths grow in all directions alike; `None` when they do not.
    pub(crate) fn uniform_scale(&self) -> Option<f64> {
        let gram = self.linear.transpose() * self.linear;
        let square = gram.trace() / 3.0;
        let uneven = (gram - Matrix3::identity() * square).amax();
        // Writers round matrices to a few digits.
        (square > 0.0 && uneven <= 1e-4 * square).then(|| square.sqrt())
    }

    /// First `inner`, then `self`.
    pub(crate) fn after(&self, inner: &Placement) -> Self {
        Placement { linear: self.linear * inner.linear, shift: self.linear * inner.shift + self.shift }
    }

    /// First the matrix that `DE de` points to in its directory entry (if any), then `self`.
    pub(crate) fn of_entity(&self, file: &File, de: i64) -> Result<Self, Fault> {
        let mut placement = *self;
        let mut chain = Vec::new();
        let mut matrix = file.entry(de)?.matrix;
        // Nested matrices act after the one that points to them.
        while matrix != 0 {
            if chain.len() >= DEEPEST {
                return Err(Fault::Nested { de: matrix });
            }
            chain.push(read(file, matrix)?);
            matrix = file.entry(matrix)?.matrix;
        }
        for matrix in chain.iter().rev() {
            placement = placement.after(matrix);
        }
        Ok(placement)
    }
}

fn read(file: &File, de: i64) -> Result<Placement, Fault> {
    let entry = file.entry(de)?;
    if entry.kind != 124 {
        return Err(Fault::Kind { de, kind: entry.kind, wanted: "a transformation matrix" });
    }
    let [a, b, c, x, d, e, f, y, g, h, i, z] = file.record(de)?.reals()?;
    let linear = Matrix3::new(a, b, c, d, e, f, g, h, i);
    if linear.determinant() == 0.0 {
        return Err(Fault::Geometry { de, what: "the transformation matrix is singular" });
    }
    Ok(Placement { linear, shift: Vector3::new(x, y, z) })
}
