use std::collections::BTreeMap;

use claymill_nurbs::{
    Curve2, Face, KnotVector, Model, NurbsError, NurbsSurface, Point2, Point3, Source, SurfaceKind, TrimEdge,
    TrimLoop,
};
use claymill_toolpath::{Area, UncutReason};

use crate::plan::{Plan, PlanError, PlanOptions, Progress, Regions, plan_crowded};

/// A triangle thinner than this is as good as its longest side, which its neighbours have too, mm.
const THINNEST_MM: f64 = 1e-6;

/// Plans a job as [`plan()`](crate::plan()) does, with obstacles that no move comes nearer to than
/// [`PlanOptions::check_clearance_mm`]: triangles in the model's coordinates. They are faces that nobody asks to be cut, so that
/// everything that keeps paths off faces keeps them off obstacles; the distance is kept by balls that are larger by it.
///
/// # Errors
/// As [`plan()`](crate::plan()).
pub fn plan_around(
    model: &Model,
    regions: &Regions,
    obstacles: &[[Point3; 3]],
    options: &PlanOptions,
    progress: Progress,
) -> Result<Plan, PlanError> {
    let own = model.faces.len();
    let mut crowded = model.clone();
    for (index, corners) in obstacles.iter().enumerate() {
        let entity = format!("obstacle triangle {index}");
        let built = face(corners, &entity);
        crowded.faces.extend(built.map_err(|source| PlanError::Face {
            face: own + index,
            entity,
            source,
        })?);
    }
    let added = crowded.faces.len() - own;
    if added == 0 {
        return plan_crowded(model, regions, own..own, options, progress);
    }
    let beside = regions.of_face.iter().max().map_or(0, |m| m + 1);
    let longer = |of: &[usize]| [of, &vec![beside; added]].concat();
    let areas: Vec<f64> = crowded.faces[own..].iter().map(Face::area_mm2).collect();
    let around = Regions {
        merged: regions.merged,
        of_face: &longer(regions.of_face),
        excluded: &[regions.excluded, &vec![true; added]].concat(),
        face_area_mm2: &[regions.face_area_mm2, &areas].concat(),
    };
    let mut plan = plan_crowded(&crowded, &around, own..own + added, options, progress)?;
    plan.faces.truncate(own);
    plan.region_setup_area_mm2.truncate(beside);
    plan.area = plan.faces.iter().fold(Area::default(), |mut sum, face| {
        sum.total_mm2 += face.area.total_mm2;
        sum.cut_mm2 += face.area.cut_mm2;
        let uncut: &BTreeMap<UncutReason, f64> = &face.area.uncut_mm2;
        uncut.iter().for_each(|(reason, area)| *sum.uncut_mm2.entry(*reason).or_default() += area);
        sum
    });
    Ok(plan)
}

/// A triangle as a trimmed parallelogram; `None` where it is too thin to matter.
fn face(corners: &[Point3; 3], entity: &str) -> Result<Option<Face>, NurbsError> {
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
        let made = face(&corners, "").unwrap().unwrap();
        approx::assert_relative_eq!(made.area_mm2(), 12.0, max_relative = 1e-12);
        let bounds = made.bounds();
        approx::assert_relative_eq!(bounds.min, Point3::new(1.0, 2.0, 3.0), epsilon = 1e-9);
        approx::assert_relative_eq!(bounds.max, Point3::new(5.0, 2.0, 9.0), epsilon = 1e-9);
        let needle = [corners[0], corners[1], Point3::new(3.0, 2.0, 3.0 + 1e-8)];
        assert!(face(&needle, "").unwrap().is_none());
    }
}
