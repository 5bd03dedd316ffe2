//! Models (faces in file order, mm) and axis-aligned boxes.

use serde::{Deserialize, Serialize};

use crate::{Face, Point3, Vector3};

/// Comes after the entity that a face is the image of.
const IMAGE: &str = " (image)";

/// Index of a face in [`Model::faces`].
pub type FaceId = usize;

/// Everything machinable that was read from a file, in millimetres.
#[derive(Debug, Clone, Default)]
pub struct Model {
    /// The faces, in file order.
    pub faces: Vec<Face>,
    /// The file's own tolerance, mm; 0 when it states none.
    pub tolerance_mm: f64,
    /// Size of the last digit of the file's coordinates, mm; 0 when unknown. Curvature noise follows from it.
    pub coordinate_step_mm: f64,
}

impl Model {
    /// Its image in the plane through the origin that stands on a coordinate axis, 0 to 2: the other half of a symmetric body. What
    /// was outside stays outside.
    ///
    /// # Panics
    /// There is no such axis.
    #[must_use]
    pub fn mirrored(&self, axis: usize) -> Self {
        let image = |mut p: Point3| {
            p[axis] = -p[axis];
            p
        };
        // The normal of the parameters turns over against the image of the old one.
        let of_face = |face: &Face| Face {
            surface: face.surface.mapped(image),
            reversed: !face.reversed,
            ..face.clone()
        };
        Model { faces: self.faces.iter().map(of_face).collect(), ..*self }
    }

    /// Its faces and then those of its image, see [`Model::mirrored`]: a symmetric body from one half. Images are named so, and
    /// share no edges with what they are images of.
    ///
    /// # Panics
    /// There is no such axis.
    #[must_use]
    pub fn with_image(&self, axis: usize) -> Self {
        let mut image = self.mirrored(axis);
        let edges = |face: &Face| face.loops.iter().flat_map(|l| &l.edges).filter_map(|e| e.shared).max();
        let first_free =
            self.faces.iter().filter_map(edges).max().map_or(Some(0), |most| most.checked_add(1));
        for face in &mut image.faces {
            face.source.entity.push_str(IMAGE);
            for edge in face.loops.iter_mut().flat_map(|l| &mut l.edges) {
                // A number beyond all numbers is none: edges are found by their places then.
                edge.shared = edge.shared.zip(first_free).and_then(|(edge, free)| edge.checked_add(free));
            }
        }
        let faces = self.faces.iter().cloned().chain(image.faces).collect();
        Model { faces, ..*self }
    }
}

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Aabb {
    /// Smallest corner.
    pub min: Point3,
    /// Largest corner.
    pub max: Point3,
}

impl Aabb {
    /// The box that holds nothing.
    #[must_use]
    pub fn empty() -> Self {
        let inf = f64::INFINITY;
        Aabb { min: Point3::new(inf, inf, inf), max: Point3::new(-inf, -inf, -inf) }
    }

    /// Its corners as files hold them: xmin, ymin, zmin, xmax, ymax, zmax.
    #[must_use]
    pub fn corners(&self) -> [f64; 6] {
        let ([a, b, c], [d, e, f]) = (self.min.into(), self.max.into());
        [a, b, c, d, e, f]
    }

    /// The box between two corners as files hold them, like [`Aabb::corners`].
    #[must_use]
    pub fn of_corners([x0, y0, z0, x1, y1, z1]: [f64; 6]) -> Self {
        Aabb { min: Point3::new(x0, y0, z0), max: Point3::new(x1, y1, z1) }
    }

    /// Its eight vertices: bit `k` of a vertex's number says on which side it is along axis `k`.
    #[must_use]
    pub fn vertices(&self) -> [Point3; 8] {
        std::array::from_fn(|i| {
            let side = |axis: usize| if i >> axis & 1 == 0 { self.min[axis] } else { self.max[axis] };
            Point3::new(side(0), side(1), side(2))
        })
    }

    /// The smallest box around `points`.
    #[must_use]
    pub fn of<'a>(points: impl IntoIterator<Item = &'a Point3>) -> Self {
        points.into_iter().fold(Aabb::empty(), |mut b, p| {
            b.add(p);
            b
        })
    }

    /// Grows to hold `p`.
    pub fn add(&mut self, p: &Point3) {
        self.min = self.min.inf(p);
        self.max = self.max.sup(p);
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(&self, other: &Aabb) -> Self {
        Aabb { min: self.min.inf(&other.min), max: self.max.sup(&other.max) }
    }

    /// The box grown by `margin` on every side.
    #[must_use]
    pub fn inflated(&self, margin: f64) -> Self {
        let m = Vector3::new(margin, margin, margin);
        Aabb { min: self.min - m, max: self.max + m }
    }

    /// The same aside, from a height upwards without end.
    #[must_use]
    pub fn upwards_from(&self, z: f64) -> Self {
        let [min, max] = [(self.min, z), (self.max, f64::INFINITY)].map(|(p, z)| Point3::new(p.x, p.y, z));
        Aabb { min, max }
    }

    /// Whether it holds no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.min.x > self.max.x || self.min.y > self.max.y || self.min.z > self.max.z
    }

    /// Length of the diagonal.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        (self.max - self.min).norm()
    }

    /// The middle.
    #[must_use]
    pub fn centre(&self) -> Point3 {
        nalgebra::center(&self.min, &self.max)
    }

    /// Whether the two have a point in common.
    #[must_use]
    pub fn meets(&self, other: &Aabb) -> bool {
        (0..3).all(|k| self.min[k] <= other.max[k] && other.min[k] <= self.max[k])
    }

    /// Squared distance from `p` to the box; 0 inside.
    #[must_use]
    pub fn distance_squared(&self, p: &Point3) -> f64 {
        let outside = (self.min - p).sup(&(p - self.max)).sup(&Vector3::zeros());
        outside.norm_squared()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analytic::{Frame, plane_patch};
    use crate::{Source, SurfaceKind};

    #[test]
    fn outside_stays_outside_in_the_mirror() {
        let frame =
            Frame::new(Point3::new(1.0, 2.0, 3.0), Vector3::new(0.6, 0.8, 0.0), Vector3::z()).unwrap();
        let surface = plane_patch(&frame, (0.0, 4.0), (0.0, 5.0)).unwrap();
        let face = Face {
            surface,
            loops: Vec::new(),
            reversed: true,
            kind: SurfaceKind::Plane,
            source: Source::default(),
        };
        let model = Model { faces: vec![face], ..Model::default() };
        let outward = |model: &Model| {
            let face = &model.faces[0];
            let (n, _) = face.surface.normal(0.5, 0.5).unwrap();
            if face.reversed { -n } else { n }
        };
        for axis in 0..3 {
            let image = model.mirrored(axis);
            let mut wanted = outward(&model);
            wanted[axis] = -wanted[axis];
            assert!((outward(&image) - wanted).norm() < 1e-12, "{axis}");
            let again = image.mirrored(axis);
            assert_eq!(again.faces[0].surface.point(0.3, 0.4), model.faces[0].surface.point(0.3, 0.4));
        }
    }
}
