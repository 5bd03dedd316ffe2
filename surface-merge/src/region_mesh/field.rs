use claymill_nurbs::Vector3;

use super::RegionMesh;

/// A function over a region: one value for each vertex, linear in between.
#[derive(Debug)]
pub struct Field<'a, 'm> {
    pub(super) mesh: &'a RegionMesh<'m>,
    values: Vec<f64>,
    gradients: Vec<Vector3>,
    /// Triangles by their lowest value.
    by_lowest: Vec<(f64, u32)>,
    /// Largest difference of values within one triangle.
    widest: f64,
    range: [f64; 2],
}

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
            by_lowest: Vec::with_capacity(mesh.triangles.len()),
            widest: 0.0,
            range: [f64::INFINITY, f64::NEG_INFINITY],
            mesh,
            values,
        };
        for triangle in 0..mesh.triangles.len() {
            field.add_gradient(triangle);
            let values = field.at_corners(triangle);
            if values.iter().all(|v| v.is_finite()) {
                let (low, high) =
                    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
                field.by_lowest.push((low, triangle as u32));
                field.widest = field.widest.max(high - low);
                field.range = [field.range[0].min(low), field.range[1].max(high)];
            }
        }
        field.by_lowest.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
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

    /// The triangles that may hold `value`, ascending.
    pub(super) fn around(&self, value: f64) -> Vec<u32> {
        let from = self.by_lowest.partition_point(|t| t.0 < value - self.widest);
        let to = self.by_lowest.partition_point(|t| t.0 <= value);
        let mut triangles: Vec<u32> = self.by_lowest[from..to].iter().map(|t| t.1).collect();
        triangles.sort_unstable();
        triangles
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
