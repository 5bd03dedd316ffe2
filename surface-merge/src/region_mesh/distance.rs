//! Distance fields on a region mesh, in mm or in step-overs: fast marching over intrinsic Delaunay
//! triangles, then the field whose gradient follows those directions (last step of the heat
//! method).

use claymill_nurbs::{FaceId, Point2, Vector3};

use super::arrival;
use super::connectivity::NONE;
use super::intrinsic::Intrinsic;
use super::sparse::System;
use super::{Field, FieldError, RegionMesh};

/// How often the directions are taken anew from the distance itself.
const SMOOTHINGS: usize = 1;

impl<'m> RegionMesh<'m> {
    /// The distance from the vertices `from` along the surface, mm.
    ///
    /// # Errors
    /// The same as [`RegionMesh::distance_in`].
    pub fn distance(&self, from: &[u32]) -> Result<Field<'_, 'm>, FieldError> {
        self.distance_in(from, |_, _, along| along.norm())
    }

    /// The distance from the vertices `from` in a metric of one's own: `metric(face, uv, along)` is how much the way
    /// `along` (mm) counts, going by what is known at these parameters of the face. With length / step-over, the distance
    /// counts passes. Along each side of a triangle the metric of its own face is integrated by Simpson's rule; over
    /// joints, where curvature may jump, both sides count half.
    ///
    /// Directions come from a front that marches over intrinsic Delaunay triangles of the metric's lengths, as sharp where fronts
    /// meet as the triangles; the field is the one whose gradient follows them (as in the last step of Crane, Weischedel,
    /// Wardetzky, "Geodesics in heat", 2013), exactly 0 on `from`. Measured from one side over plane, cylinder and
    /// hemisphere with edges of about a twentieth of the largest distance, the field is off by less than 0.3 % of that; from a
    /// single point by up to 0.6 edge lengths (tests). Parts that `from` does not touch have no value (NaN).
    ///
    /// # Errors
    /// An empty set or one without a vertex of the mesh; a metric that is not positive; a matrix that cannot be
    /// factorised.
    pub fn distance_in(
        &self,
        from: &[u32],
        metric: impl Fn(FaceId, Point2, &Vector3) -> f64,
    ) -> Result<Field<'_, 'm>, FieldError> {
        let count = self.vertices.len();
        let sources: Vec<usize> = from.iter().map(|&v| v as usize).filter(|&v| v < count).collect();
        if sources.is_empty() {
            return Err(FieldError::NoGuide { what: "vertex to measure from" });
        }
        let lengths = self.lengths(metric)?;
        let intrinsic = Intrinsic::new(&self.triangles, &self.twins, lengths);
        let times = arrival::times(&intrinsic, count, &sources);

        // Times are as long as they should be, but lines between them are not smooth; the function whose gradient comes closest
        // to having their directions and the length 1 has both.
        let mut fixed = vec![None; count];
        sources.iter().for_each(|&v| fixed[v] = Some(0.0));
        let load = unit_gradient(&intrinsic, &times);
        let system = System::laplace(&intrinsic.weights(), &fixed)?;
        let mut values = system.solve(|i| load[i]);
        for _ in 0..SMOOTHINGS {
            let load = unit_gradient(&intrinsic, &values);
            values = system.solve(|i| load[i]);
        }
        Ok(Field::new(self, values))
    }

    /// Lengths of the sides of each triangle in a metric.
    fn lengths(&self, metric: impl Fn(FaceId, Point2, &Vector3) -> f64) -> Result<Vec<[f64; 3]>, FieldError> {
        let on_face = |t: usize, k: usize| {
            // Always the same way round, so that both triangles of a side agree to the last bit.
            let next = (k + 1) % 3;
            let (a, b) = if self.triangles[t][k] < self.triangles[t][next] { (k, next) } else { (next, k) };
            let vertices = [a, b].map(|corner| self.triangles[t][corner]);
            let along = self.point(vertices[1]) - self.point(vertices[0]);
            if along.norm() == 0.0 {
                return Ok(0.0);
            }
            let uv = [a, b].map(|corner| self.corners[t][corner]);
            let mut sum = 0.0;
            for (weight, at) in [(1.0, uv[0]), (4.0, nalgebra::center(&uv[0], &uv[1])), (1.0, uv[1])] {
                let value = metric(self.face_of[t], at, &along);
                if !(value > 0.0 && value.is_finite()) {
                    return Err(FieldError::Metric { vertex: vertices[0], value });
                }
                sum += weight * value;
            }
            Ok(sum / 6.0)
        };
        let own = |t| Ok([on_face(t, 0)?, on_face(t, 1)?, on_face(t, 2)?]);
        let own: Vec<[f64; 3]> = (0..self.triangles.len()).map(own).collect::<Result<_, _>>()?;
        let both = |t: usize, k: usize| match self.twins[3 * t + k] {
            NONE => own[t][k],
            twin => 0.5 * (own[t][k] + own[twin as usize / 3][twin as usize % 3]),
        };
        Ok((0..own.len()).map(|t| [both(t, 0), both(t, 1), both(t, 2)]).collect())
    }
}

/// `∫ X·∇ψ` for the hat function `ψ` of every vertex, `X` the unit vector along which `values` rise.
fn unit_gradient(intrinsic: &Intrinsic, values: &[f64]) -> Vec<f64> {
    let mut load = vec![0.0; values.len()];
    for (t, triangle) in intrinsic.triangles.iter().enumerate() {
        let p = intrinsic.flat(t);
        // Twice the area times the gradient of each corner's hat function.
        let rise: [[f64; 2]; 3] = std::array::from_fn(|k| {
            let (a, b) = (p[(k + 1) % 3], p[(k + 2) % 3]);
            [a[1] - b[1], b[0] - a[0]]
        });
        let value = triangle.map(|v| values[v as usize]);
        let largest = value.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let gradient: [f64; 2] =
            std::array::from_fn(|axis| (0..3).map(|k| value[k] / largest * rise[k][axis]).sum());
        let size = gradient[0].hypot(gradient[1]);
        if size > 0.0 && size.is_finite() {
            for k in 0..3 {
                let along = gradient[0] * rise[k][0] + gradient[1] * rise[k][1];
                load[triangle[k] as usize] += 0.5 * along / size;
            }
        }
    }
    load
}
