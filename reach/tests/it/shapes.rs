//! Shapes of analytic surfaces, and real parts with their material sides.

use std::path::Path;

use claymill_nurbs::analytic::{Frame as Placement, plane_patch};
use claymill_nurbs::{Face, Model, NurbsSurface, Point3, Vector3};
use claymill_reach::Part;
use claymill_surface_merge::{MergeOptions, SheetOptions, merge, sheets};
use claymill_tests::model_of;
use claymill_toolpath::FreeSide;

/// A model that owns what a [`Part`] refers to.
pub(crate) struct Shape {
    pub(crate) model: Model,
    pub(crate) area_mm2: Vec<f64>,
    pub(crate) free: Vec<FreeSide>,
}

impl Shape {
    /// Whole surfaces, free where they look away from a point.
    pub(crate) fn around(middle: Point3, surfaces: Vec<NurbsSurface>) -> Self {
        Self::free_where(surfaces, |p, n| n.dot(&(p - middle)) > 0.0)
    }

    /// Whole surfaces, free on the side of `Su × Sv` where that is said of a place and its normal.
    pub(crate) fn free_where(surfaces: Vec<NurbsSurface>, is_free: impl Fn(Point3, Vector3) -> bool) -> Self {
        let model = model_of(surfaces);
        let side = |f: &Face| {
            let ((u0, u1), (v0, v1)) = f.surface.domain();
            let (u, v) = (u0 + 0.37 * (u1 - u0), v0 + 0.41 * (v1 - v0));
            FreeSide::one(is_free(f.surface.point(u, v), f.surface.normal(u, v).unwrap().0))
        };
        let free = model.faces.iter().map(side).collect();
        let area_mm2 = model.faces.iter().map(Face::area_mm2).collect();
        Shape { model, area_mm2, free }
    }

    /// A file, with the material sides that are found.
    pub(crate) fn read(path: &Path) -> Self {
        let import = claymill_exchange::read(path).unwrap();
        let model = import.model;
        let merged = merge(&model, &MergeOptions::default()).unwrap();
        let options = SheetOptions { file_states_sides: true, up: Some(Vector3::z()) };
        let mut free = vec![FreeSide::Both; model.faces.len()];
        for sheet in sheets(&model, &merged, &options) {
            for (&face, &along) in sheet.faces.iter().zip(&sheet.free_along) {
                free[face] = FreeSide::one(along);
            }
        }
        let area_mm2 = import.report.faces.iter().map(|face| face.area_read_mm2).collect();
        Shape { model, area_mm2, free }
    }

    pub(crate) fn part(&self) -> Part<'_> {
        Part {
            model: &self.model,
            face_area_mm2: &self.area_mm2,
            free_sides: &self.free,
            open: &[],
            excluded: &[],
        }
    }
}

/// A rectangle from a corner along two sides.
pub(crate) fn rectangle(corner: [f64; 3], along: [f64; 3], up: [f64; 3]) -> NurbsSurface {
    let (a, b) = (Vector3::from(along), Vector3::from(up));
    let at = Placement::new(corner.into(), a.cross(&b), a).unwrap();
    plane_patch(&at, (0.0, a.norm()), (0.0, b.norm())).unwrap()
}

/// The six sides of a box.
pub(crate) fn block([x, y, z]: [f64; 3]) -> Vec<NurbsSurface> {
    vec![
        rectangle([0.0, 0.0, 0.0], [x, 0.0, 0.0], [0.0, y, 0.0]),
        rectangle([0.0, 0.0, z], [x, 0.0, 0.0], [0.0, y, 0.0]),
        rectangle([0.0, 0.0, 0.0], [x, 0.0, 0.0], [0.0, 0.0, z]),
        rectangle([0.0, y, 0.0], [x, 0.0, 0.0], [0.0, 0.0, z]),
        rectangle([0.0, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]),
        rectangle([x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]),
    ]
}
