//! Piecewise linear fields on a region mesh: values, gradients, and an index from a value to the
//! triangles that hold it.

use claymill_nurbs::Vector3;

use super::RegionMesh;

/// A function over a region: one value for each vertex, linear in between.
#[derive(Debug)]
pub struct Field<'a, 'm> {
    pub(super) mesh: &'a RegionMesh<'m>,
    values: Vec<f64>,
    gradients: Vec<Vector3>,
    range: [f64; 2],
    /// The triangles, ascending, that hold any value of each equal part of the range.
    holding: Vec<Vec<u32>>,
}

/// So many triangles are in a part of the range, more or less.
const HOLDING: usize = 64;

impl<'a, 'm> Field<'a, 'm> {
    /// A field of one's own: a value for each vertex of the mesh; NaN where it has none.
    ///
    /// # Panics
    /// When there are more or fewer values than vertices.
    #[must_use]
    pub fn new(mesh: &'a RegionMesh<'m>, values: Vec<f64>) -> Self {
        assert_eq!(values.len(), mesh.vertices.len(), "one value for each vertex");
        let mut field = Field {
            gradients: vec![Vector3::zeros(); values.len()],
            range: [f64::INFINITY, f64::NEG_INFINITY],
            holding: vec![Vec::new(); mesh.triangles.len().div_ceil(HOLDING).max(1)],
            mesh,
            values,
        };
        for triangle in 0..mesh.triangles.len() {
            field.add_gradient(triangle);
            if let Some((low, high)) = field.values_on(triangle) {
                field.range = [field.range[0].min(low), field.range[1].max(high)];
            }
        }
        for triangle in 0..mesh.triangles.len() {
            if let Some((low, high)) = field.values_on(triangle) {
                let parts = field.part(low)..=field.part(high);
                field.holding[parts].iter_mut().for_each(|part| part.push(triangle as u32));
            }
        }
        field.finish_gradients();
        field
    }

    /// The mesh.
    #[must_use]
    pub fn mesh(&self) -> &'a RegionMesh<'m> {
        self.mesh
    }

    /// The value at each vertex.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The gradient at each vertex: a tangent vector, values per mm. The mean of the triangles around, by
    /// area.
    #[must_use]
    pub fn gradients(&self) -> &[Vector3] {
        &self.gradients
    }

    /// Smallest and largest value.
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    pub(super) fn at_corners(&self, triangle: usize) -> [f64; 3] {
        self.mesh.triangles[triangle].map(|v| self.values[v as usize])
    }

    /// Lowest and highest value on a triangle of the mesh; `None` where one of its corners has none.
    #[must_use]
    pub fn values_on(&self, triangle: usize) -> Option<(f64, f64)> {
        let values = self.at_corners(triangle);
        let both = |(low, high): (f64, f64), &v: &f64| (low.min(v), high.max(v));
        let whole = values.iter().all(|v| v.is_finite());
        whole.then(|| values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), both))
    }

    /// The part of the range that a value lies in.
    fn part(&self, value: f64) -> usize {
        let [low, high] = self.range;
        let share = (value - low) / (high - low).max(f64::MIN_POSITIVE);
        // Beyond either end, and of no number, this is the first or the last part.
        ((share * self.holding.len() as f64) as usize).min(self.holding.len() - 1)
    }

    /// The triangles that may hold `value`, ascending.
    pub(super) fn around(&self, value: f64) -> &[u32] {
        &self.holding[self.part(value)]
    }

    /// Adds the gradient of a triangle times twice its area to its corners.
    fn add_gradient(&mut self, triangle: usize) {
        let ids = self.mesh.triangles[triangle];
        let [a, b, c] = ids.map(|v| self.mesh.point(v));
        let [x, y, z] = self.at_corners(triangle);
        let normal = (b - a).cross(&(c - a));
        let double = normal.norm();
        if double > 0.0 && (x + y + z).is_finite() {
            let turned = (c - b) * x + (a - c) * y + (b - a) * z;
            let sum = normal.cross(&turned) / double;
            ids.iter().for_each(|&v| self.gradients[v as usize] += sum);
        }
    }

    fn finish_gradients(&mut self) {
        let mut areas = vec![0.0; self.values.len()];
        for t in 0..self.mesh.triangles.len() {
            let double = 2.0 * self.mesh.triangle_area_mm2(t);
            self.mesh.triangles[t].iter().for_each(|&v| areas[v as usize] += double);
        }
        for (gradient, area) in self.gradients.iter_mut().zip(areas) {
            if area > 0.0 {
                *gradient /= area;
            }
        }
    }
}
