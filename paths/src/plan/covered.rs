//! A model with more faces than its own, which only stand in the way.

use std::borrow::Cow;

use claymill_contact::Covering;
use claymill_nurbs::{
    Aabb, Curve2, Face, FaceId, KnotVector, Model, NurbsError, NurbsSurface, Point2, Point3, Source,
    SurfaceKind, TrimEdge, TrimLoop,
};

use crate::plan::regions::Regions;

/// A triangle thinner than this is as good as its longest side, which its neighbours have too, mm.
const THINNEST_MM: f64 = 1e-6;
/// The box of a face that cannot be covered is larger than the face by this on every side, mm: so a flat one has an inside.
const BESIDE_MM: f64 = 1e-3;

/// A face that is not machined, since it cannot be covered with triangles. Its box stands in its place.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    /// Index of the face.
    pub face: FaceId,
    /// Why it cannot be covered.
    pub reason: NurbsError,
    /// The box that protects it.
    pub bounds: Aabb,
}

/// A model covered with triangles. Where faces had to be left out, it has further ones: the sides of their boxes.
#[derive(Debug)]
pub struct Covered<'a> {
    /// The model, the boxes' sides behind its own faces.
    pub model: Cow<'a, Model>,
    /// Its covering.
    pub covering: Covering,
    /// The faces left out.
    pub left_out: Vec<LeftOut>,
    /// For each further face, the one that it stands for.
    stands_for: Vec<FaceId>,
}

impl<'a> Covered<'a> {
    /// Covers a model of `area_mm2` for a ball; what is `excluded` only stands in the way.
    ///
    /// # Errors
    /// The box of a face cannot be made, with the number of the face.
    pub fn new(
        model: &'a Model,
        excluded: &[bool],
        area_mm2: f64,
        radius_mm: f64,
    ) -> Result<Self, (FaceId, NurbsError)> {
        let uncovered = match Covering::of_all(model, excluded, area_mm2, radius_mm) {
            Ok(covering) => {
                let (left_out, stands_for) = (Vec::new(), Vec::new());
                return Ok(Covered { model: Cow::Borrowed(model), covering, left_out, stands_for });
            }
            Err(uncovered) => uncovered,
        };
        let mut crowd = model.clone();
        let (mut left_out, mut stands_for) = (Vec::with_capacity(uncovered.len()), Vec::new());
        for (face, reason) in uncovered {
            let bounds = model.faces[face].bounds().inflated(BESIDE_MM);
            let entity = format!("box of face {face}");
            for corners in triangles(&bounds) {
                crowd.faces.extend(triangle(&corners, &entity).map_err(|e| (face, e))?);
            }
            left_out.push(LeftOut { face, reason, bounds });
            stands_for.resize(crowd.faces.len() - model.faces.len(), face);
        }
        let added = stands_for.len();
        let excluded = [excluded, &vec![true; added]].concat();
        let bare: Vec<FaceId> = left_out.iter().map(|l| l.face).collect();
        let covering = Covering::without(&crowd, &bare, &excluded, area_mm2, radius_mm)
            .map_err(|mut uncovered| uncovered.swap_remove(0))?;
        Ok(Covered { model: Cow::Owned(crowd), covering, left_out, stands_for })
    }

    /// The model's own face that a face is, or is a side of the box of.
    #[must_use]
    pub fn own_face(&self, face: FaceId) -> FaceId {
        let own = self.model.faces.len() - self.stands_for.len();
        face.checked_sub(own).and_then(|side| self.stands_for.get(side)).copied().unwrap_or(face)
    }
}

/// Regions of a model to which faces were added that nobody asks to be cut.
#[derive(Debug, Clone)]
pub(crate) struct WiderRegions {
    of_face: Vec<usize>,
    excluded: Vec<bool>,
    face_area_mm2: Vec<f64>,
}

impl WiderRegions {
    /// For a model whose first faces are those of the regions.
    pub(crate) fn over(regions: &Regions, model: &Model) -> Self {
        let own = regions.of_face.len();
        let added = model.faces[own..].len();
        let beside = regions.of_face.iter().max().map_or(0, |m| m + 1);
        let areas: Vec<f64> = model.faces[own..].iter().map(Face::area_mm2).collect();
        WiderRegions {
            of_face: [regions.of_face, &vec![beside; added]].concat(),
            excluded: [regions.excluded, &vec![true; added]].concat(),
            face_area_mm2: [regions.face_area_mm2, &areas].concat(),
        }
    }

    /// They are not cut.
    pub(crate) fn leave_out(&mut self, faces: impl IntoIterator<Item = FaceId>) {
        faces.into_iter().for_each(|face| self.excluded[face] = true);
    }

    /// As the planner takes them.
    pub(crate) fn as_regions<'a>(&'a self, of: &Regions<'a>) -> Regions<'a> {
        Regions {
            merged: of.merged,
            of_face: &self.of_face,
            excluded: &self.excluded,
            face_area_mm2: &self.face_area_mm2,
        }
    }
}

/// The sides of a box, two triangles each.
pub(crate) fn triangles(bounds: &Aabb) -> Vec<[Point3; 3]> {
    let corners = bounds.vertices();
    let sides = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    sides
        .iter()
        .flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]])
        .map(|t| t.map(|k: usize| corners[k]))
        .collect()
}

/// A triangle as a trimmed parallelogram; `None` where it is too thin to matter.
pub(crate) fn triangle(corners: &[Point3; 3], entity: &str) -> Result<Option<Face>, NurbsError> {
    let [a, b, c] = *corners;
    let (along, across) = (b - a, c - a);
    let longest = along.norm().max(across.norm()).max((c - b).norm());
    if along.cross(&across).norm() <= THINNEST_MM * longest {
        return Ok(None);
    }
    let knots = || KnotVector::clamped_uniform(1, 2);
    let surface = NurbsSurface::new(knots(), knots(), vec![a, c, b, b + across], None)?;
    let rim = [Point2::new(0.0, 0.0), Point2::new(1.0, 0.0), Point2::new(0.0, 1.0)];
    let side = |i: usize| TrimEdge { pcurve: Curve2::line(rim[i], rim[(i + 1) % 3]), shared: None };
    Ok(Some(Face {
        surface,
        loops: vec![TrimLoop { edges: (0..3).map(side).collect() }],
        reversed: false,
        kind: SurfaceKind::Plane,
        source: Source { entity: entity.to_owned(), ..Source::default() },
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_a_face_of_its_area_and_a_needle_none() {
        let corners = [Point3::new(1.0, 2.0, 3.0), Point3::new(5.0, 2.0, 3.0), Point3::new(1.0, 2.0, 9.0)];
        let made = triangle(&corners, "").unwrap().unwrap();
        approx::assert_relative_eq!(made.area_mm2(), 12.0, max_relative = 1e-12);
        let bounds = made.bounds();
        approx::assert_relative_eq!(bounds.min, Point3::new(1.0, 2.0, 3.0), epsilon = 1e-9);
        approx::assert_relative_eq!(bounds.max, Point3::new(5.0, 2.0, 9.0), epsilon = 1e-9);
        let needle = [corners[0], corners[1], Point3::new(3.0, 2.0, 3.0 + 1e-8)];
        assert!(triangle(&needle, "").unwrap().is_none());
    }

    #[test]
    fn a_box_is_closed() {
        let bounds = Aabb { min: Point3::new(1.0, 2.0, 3.0), max: Point3::new(3.0, 5.0, 7.0) };
        let area: f64 = triangles(&bounds).iter().map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm()).sum();
        approx::assert_relative_eq!(area, 2.0 * (6.0 + 8.0 + 12.0), max_relative = 1e-12);
        let all: Vec<Point3> = triangles(&bounds).concat();
        assert_eq!(Aabb::of(&all), bounds);
    }

    #[test]
    fn a_face_that_encloses_nothing_is_left_out_and_boxed() {
        let flat = |x: f64| {
            let knots = || KnotVector::clamped_uniform(1, 2);
            let at = |u: f64, v: f64| Point3::new(x + 10.0 * u, 10.0 * v, 0.0);
            let net = vec![at(0.0, 0.0), at(0.0, 1.0), at(1.0, 0.0), at(1.0, 1.0)];
            NurbsSurface::new(knots(), knots(), net, None).unwrap()
        };
        let there_and_back = |a: Point2, b: Point2| TrimLoop {
            edges: [[a, b], [b, a]]
                .map(|[a, b]| TrimEdge { pcurve: Curve2::line(a, b), shared: None })
                .into(),
        };
        let face = |surface: NurbsSurface, loops: Vec<TrimLoop>| Face {
            surface,
            loops,
            reversed: false,
            kind: SurfaceKind::Plane,
            source: Source::default(),
        };
        let needle = there_and_back(Point2::new(0.2, 0.5), Point2::new(0.4, 0.5));
        let model = Model {
            faces: vec![face(flat(0.0), vec![]), face(flat(20.0), vec![needle])],
            ..Model::default()
        };
        assert!(Covering::new(&model, &[false; 2], 200.0, 3.0).is_err());
        let covered = Covered::new(&model, &[false; 2], 200.0, 3.0).unwrap();
        let [LeftOut { face: 1, bounds, .. }] = &covered.left_out[..] else { panic!("{covered:?}") };
        assert_eq!(covered.model.faces.len(), 2 + 12);
        assert_eq!([0, 1, 2, 13].map(|face| covered.own_face(face)), [0, 1, 1, 1]);
        // Around the needle, not around all of its surface.
        approx::assert_relative_eq!(bounds.min, Point3::new(22.0, 5.0, 0.0), epsilon = 0.002);
        approx::assert_relative_eq!(bounds.max, Point3::new(24.0, 5.0, 0.0), epsilon = 0.002);
    }
}
