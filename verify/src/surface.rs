//! The residual on samples spread evenly over all faces (R2 low-discrepancy sequence), and the
//! state of each: cut, or why not.

use claymill_nurbs::{Face, FaceId, FaceMesh, Jet, Point2, Point3, Vector3};
use claymill_toolpath::{Cancelled, FreeSide, Job};
use rayon::prelude::*;

use crate::asked::excluded_faces;
use crate::reach::Reach;
use crate::report::{ResidualSample, SurfaceState};
use crate::scene::{Scene, Stage};
use crate::swept::Swept;

/// However well a valley fits the ball, passes are no further apart than flat step-overs divided by the root of this.
const LEAST_BEND: f64 = 0.05;

/// Heights up to this many scallop heights are measured; beyond it, a place is simply not cut.
const MEASURED_UP_TO: f64 = 5.0;
/// Every face gets at least this many samples.
const SAMPLES_PER_FACE: usize = 4;
/// A whole model gets at least about this many: small ones are sampled more densely.
const SAMPLES: f64 = 50_000.0;
/// The plastic number's powers: the two-dimensional golden ratio (Roberts' R2 sequence).
const R2: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053_2];

/// Samples of one face.
pub(crate) struct FaceSamples {
    pub(crate) area_mm2: f64,
    /// Empty when the face could not be triangulated.
    pub(crate) samples: Vec<ResidualSample>,
}

/// Puts samples evenly on all faces and measures on each what the swept balls leave; where too much is left,
/// says why.
pub(crate) fn measure(
    scene: &Scene<'_>,
    meshes: &[Option<FaceMesh>],
    swept: &Swept<'_>,
    reach: &Reach<'_>,
    stage: &Stage<'_>,
) -> Result<Vec<FaceSamples>, Cancelled> {
    let excluded = excluded_faces(scene);
    let areas: Vec<f64> = scene.model.faces.par_iter().map(Face::area_mm2).collect();
    let area_per_sample = scene.options.area_per_sample_mm2.min(areas.iter().sum::<f64>() / SAMPLES);
    let spots: Vec<(f64, Vec<Point2>)> = (scene.model.faces.par_iter().zip(&areas).zip(meshes))
        .map(|((face, &area), mesh)| {
            let count = ((area / area_per_sample).ceil() as usize).max(SAMPLES_PER_FACE);
            (area, mesh.as_ref().map_or_else(Vec::new, |m| spread(face, m, count)))
        })
        .collect();
    let on_face = |(face, (area, spots)): (usize, &(f64, Vec<Point2>))| {
        let weight = area / spots.len().max(1) as f64;
        let look = |uv: &Point2| sample(scene, face, uv, weight, excluded[face], swept, reach);
        FaceSamples { area_mm2: *area, samples: spots.par_iter().map(look).collect() }
    };
    spots.par_iter().enumerate().map(|face| stage.part(meshes.len(), || on_face(face))).collect()
}

fn sample(
    scene: &Scene<'_>,
    face: FaceId,
    uv: &Point2,
    area_mm2: f64,
    excluded: bool,
    swept: &Swept<'_>,
    reach: &Reach<'_>,
) -> ResidualSample {
    let surface = &scene.model.faces[face].surface;
    let jet = surface.jet(uv.x, uv.y);
    let point = jet.p;
    let mut sample = ResidualSample {
        point,
        normal: Vector3::zeros(),
        face,
        area_mm2,
        residual_mm: None,
        step_over_mm: None,
        state: SurfaceState::NotMeasured,
        cut_from_material: false,
        cut_from_inside: false,
    };
    let Some((normal, _)) = surface.normal(uv.x, uv.y) else {
        return sample;
    };
    let free = scene.free_sides[face];
    sample.normal = if free == FreeSide::Against { -normal } else { normal };
    let h = scene.scallop_mm();
    if let Some(left) = swept.residual(&point, &normal, MEASURED_UP_TO * h, free) {
        sample.residual_mm = Some(left.height_mm);
        sample.normal = normal * left.side;
        // The least length is that of balls.
        let tool = &scene.job.request.tool;
        if tool.is_ball() {
            sample.step_over_mm = step_over_mm(&jet, &left.way, &sample.normal, tool.radius_mm(), h);
        }
    }
    let limit = scene.options.cut_limit * h;
    if !free.is_both() {
        let material = FreeSide::one(free == FreeSide::Against);
        // Near a sharp edge balls on the free side of one face come as near as this to the other one's material side: there the
        // edge or the first face is nearest to them.
        let is_in_material = |centre: &Point3| {
            let foot = scene.closest.closest(centre, swept.largest_radius_mm() + limit);
            foot.is_some_and(|foot| scene.is_in_material(&foot, centre))
        };
        sample.cut_from_material = swept.reaches(&point, &normal, limit, material, is_in_material);
    }
    sample.state = if sample.residual_mm.is_some_and(|height| height <= limit) {
        SurfaceState::Cut
    } else if excluded {
        SurfaceState::Excluded
    } else {
        reach.judge(&point, &normal, limit - h, free)
    };
    sample.cut_from_inside = sample.state == SurfaceState::Cut && reach.is_inside(&point, &sample.normal);
    sample
}

/// How far apart passes that run this `way` may be on the surface, mm: `s = 2 √((2 R h − h²) / (1 − κ⁺R))`, `κ⁺` across them
/// (docs/theory.md §4.2, whose table in §4.3 it meets to a thousandth).
fn step_over_mm(jet: &Jet, way: &Vector3, normal: &Vector3, radius_mm: f64, scallop_mm: f64) -> Option<f64> {
    let across = normal.cross(way).try_normalize(0.0)?;
    let bend = 1.0 - jet.normal_curvature(&across, normal)? * radius_mm;
    Some(2.0 * ((2.0 * radius_mm * scallop_mm - scallop_mm * scallop_mm) / bend.max(LEAST_BEND)).sqrt())
}

/// Faces that the planner left out since it could not triangulate them.
pub(crate) fn uncovered_faces(job: &Job) -> impl Iterator<Item = FaceId> {
    job.left_out.iter().map(|f| f.face)
}

/// Parameters of `count` points, one for each equal part of the face's area in the order of the mesh's
/// triangles, scattered inside by a low-discrepancy sequence.
pub(crate) fn spread(face: &Face, mesh: &FaceMesh, count: usize) -> Vec<Point2> {
    let corners = |t: &[u32; 3]| t.map(|i| i as usize);
    let area = |t: &[u32; 3]| {
        let [a, b, c] = corners(t).map(|i| mesh.points[i]);
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    let total: f64 = mesh.triangles.iter().map(area).sum();
    let mut spots = Vec::with_capacity(count);
    let mut covered = 0.0;
    for t in &mesh.triangles {
        covered += area(t);
        while spots.len() < count && (spots.len() as f64 + 0.5) * total <= covered * count as f64 {
            let turn = |ratio: f64| (0.5 + ratio * spots.len() as f64).fract();
            let (mut s, mut r) = (turn(R2[0]), turn(R2[1]));
            if s + r > 1.0 {
                (s, r) = (1.0 - s, 1.0 - r);
            }
            let [a, b, c] = corners(t).map(|i| mesh.uv[i]);
            let uv = a + (b - a) * s + (c - a) * r;
            let (u, v) = face.surface.clamp(uv.x, uv.y);
            spots.push(Point2::new(u, v));
        }
    }
    spots
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn step_overs_are_those_of_the_reference_table() {
        // docs/theory.md §4.3, R = 10, h = 0.02: the plane, cylinders of radius 1000, 100 and 25, convex and concave.
        let table = [
            (0.0, 1.264_278),
            (-1e-3, 1.257_992),
            (1e-3, 1.270_660),
            (-1e-2, 1.205_324),
            (1e-2, 1.332_802),
            (-0.04, 1.068_103),
            (0.04, 1.632_902),
        ];
        for (bend, exact) in table {
            let zero = Vector3::zeros();
            let jet = Jet {
                p: Point3::origin(),
                su: Vector3::x() * 3.0,
                sv: Vector3::y() * 2.0,
                suu: zero,
                suv: zero,
                svv: Vector3::z() * (4.0 * bend),
            };
            let found = step_over_mm(&jet, &(Vector3::x() * 7.0), &Vector3::z(), 10.0, 0.02).unwrap();
            approx::assert_relative_eq!(found, exact, max_relative = 1e-3);
        }
    }
}
