//! The job's bounds as each setup sees them: how far a ball goes beyond boxes and borders, and
//! whether it may touch a point at all. `bounds` measures along the moves by it.

use claymill_nurbs::{Model, Point3, Vector3};
use claymill_toolpath::{Bounds, Contain, Job};

use crate::asked::{avoided_faces, excluded_faces};
use crate::directions::directions;
use crate::mesh::Mesh;
use crate::scene::Scene;
use crate::shadow::Shadow;

/// Gaps between faces up to about this wide, seen along the axis, are no border, and where faces are trimmed is known to some
/// hundredths only: what goes beyond a border by no more than this does not count, mm.
const BORDER_MM: f64 = 0.4;
/// Passes keep a little inside of their bounds: this near to them, mm, nothing is asked of them.
pub(crate) const STRIP_MM: f64 = 0.05;

/// Where the tool is kept, as each setup sees it.
///
/// ```text
///    boxes            contact, centre or disc across the axis, the contact along it
///    faces cut        seen along the axis: the centre, or all of the disc, is over them
///    faces avoided    the ball keeps its distance
/// ```
pub(crate) struct Limits<'a> {
    scene: &'a Scene<'a>,
    bounds: &'a Bounds,
    /// The model's dimension along the axis of each direction, where it is along one.
    along: Vec<Option<usize>>,
    /// What the faces that are cut cover, along each of the model's axes that a setup looks along.
    shadows: [Option<Shadow<'a>>; 3],
}

impl<'a> Limits<'a> {
    /// Those of the job, if it has any.
    pub(crate) fn new(scene: &'a Scene<'a>, mesh: &'a Mesh) -> Option<Self> {
        let bounds = &scene.job.request.bounds;
        if bounds.is_none() {
            return None;
        }
        let along: Vec<Option<usize>> = directions(scene.job).iter().map(dimension).collect();
        let mut shadows = [None, None, None];
        if bounds.contain != Contain::Contact {
            let cut: Vec<bool> = excluded_faces(scene).into_iter().map(|excluded| !excluded).collect();
            for &along in along.iter().flatten() {
                shadows[along].get_or_insert_with(|| Shadow::new(mesh, &cut, along));
            }
        }
        Some(Limits { scene, bounds, along, shadows })
    }

    /// Whether it matters where the ball touches.
    pub(crate) fn heeds_contact(&self) -> bool {
        !self.bounds.within_mm.is_empty()
    }

    /// Whether there is anything that a move could break.
    pub(crate) fn hold_anything(&self) -> bool {
        self.heeds_contact() || self.bounds.contain != Contain::Contact || !self.avoids_nothing()
    }

    fn avoids_nothing(&self) -> bool {
        self.scene.avoided.model().faces.is_empty()
    }

    /// How far the ball at `centre` goes beyond the box that holds it best, mm, negative inside; along the axis only where it
    /// touches. `None` without boxes, and where it is the contact that is held and there is none.
    pub(crate) fn beyond_boxes_mm(
        &self,
        setup: usize,
        centre: &Point3,
        contact: Option<&Point3>,
        radius_mm: f64,
    ) -> Option<f64> {
        let along = self.along[setup];
        let across = if self.bounds.contain == Contain::Contact { contact? } else { centre };
        let margin_mm = self.disc_mm(radius_mm);
        let beyond = |b: &[f64; 6]| {
            let over = |dim: usize, p: &Point3, margin: f64| {
                (b[dim] + margin - p[dim]).max(p[dim] - b[dim + 3] + margin)
            };
            let sides = (0..3).filter_map(|dim| {
                if Some(dim) == along {
                    contact.map(|p| over(dim, p, 0.0))
                } else {
                    Some(over(dim, across, margin_mm))
                }
            });
            sides.fold(f64::NEG_INFINITY, f64::max)
        };
        self.bounds.within_mm.iter().map(beyond).reduce(f64::min)
    }

    /// How far the ball at `centre` goes beyond the faces that are cut, seen along the axis, mm; 0 where it does not. All of it
    /// is looked at if `whole`, else its rim (see [`Shadow::beyond_mm`]).
    pub(crate) fn beyond_border_mm(&self, setup: usize, centre: &Point3, radius_mm: f64, whole: bool) -> f64 {
        let shadow = self.along[setup].and_then(|along| self.shadows[along].as_ref());
        shadow.map_or(0.0, |s| s.beyond_mm(centre, self.disc_mm(radius_mm), BORDER_MM, whole))
    }

    /// Whether the ball may surely touch a point from `centre`: it could be moved a little any way and keep its bounds.
    pub(crate) fn allow(&self, setup: usize, centre: &Point3, contact: &Point3, radius_mm: f64) -> bool {
        let boxes = self.beyond_boxes_mm(setup, centre, Some(contact), radius_mm);
        let keeps_off = || {
            let distance_mm = radius_mm + self.bounds.avoid_mm + STRIP_MM;
            self.avoids_nothing() || !self.scene.avoided.any_within(centre, distance_mm)
        };
        // So much larger, a disc goes beyond a border by more than gaps are wide just when this one comes near to it.
        let larger_mm = self.disc_mm(radius_mm) + BORDER_MM + STRIP_MM;
        let shadow = self.along[setup].and_then(|along| self.shadows[along].as_ref());
        let is_over = || shadow.is_none_or(|s| s.beyond_mm(centre, larger_mm, BORDER_MM, true) == 0.0);
        let cuts_block = self
            .bounds
            .centre_within_mm
            .is_none_or(|b| (0..3).all(|k| (b[k] + STRIP_MM..=b[k + 3] - STRIP_MM).contains(&centre[k])));
        cuts_block && boxes.is_none_or(|mm| mm <= -STRIP_MM) && keeps_off() && is_over()
    }

    /// Radius of the disc that stays inside, seen along the axis.
    fn disc_mm(&self, radius_mm: f64) -> f64 {
        if self.bounds.contain == Contain::Edge { radius_mm } else { 0.0 }
    }
}

/// The model's dimension along an axis, if it is along one.
fn dimension(axis: &Vector3) -> Option<usize> {
    let dim = axis.iamax();
    (axis[dim].abs() > 1.0 - 1e-9).then_some(dim)
}

/// The faces to be avoided, as a model of their own.
pub(crate) fn avoided_model(model: &Model, job: &Job) -> Model {
    Model {
        faces: avoided_faces(model, job).map(|face| model.faces[face].clone()).collect(),
        ..Model::default()
    }
}
