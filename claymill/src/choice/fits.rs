//! How large a ball fits where: area-weighted samples of the surface, each with the largest ball that touches there and enters
//! no face.

use claymill_nurbs::{ClosestPoints, Domain, Face, Point3, Vector3};
use claymill_toolpath::{Cancelled, Monitor};
use rayon::prelude::*;

use crate::prepared::Prepared;

/// Samples of the whole model, at most about so many.
const SAMPLES: f64 = 6_000.0;
/// Of each face along each parameter.
const MOST_ALONG: usize = 24;
/// A ball that is entered by less fits: that is what passes leave, mm.
const FITS_MM: f64 = 0.02;
/// What leans away from all setups by more than this is reached by none (sine, 10°).
const LEAST_FACING: f64 = 0.1736;

/// A place of the surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    /// Area that it stands for, mm².
    pub(crate) area_mm2: f64,
    /// Radius of the largest ball that fits there, mm: at most the one that was asked about.
    pub(crate) fits_mm: f64,
    /// Least radius of the surface where it is hollow there, mm; infinity where it is not.
    pub(crate) hollow_mm: f64,
}

/// Samples of what the setups see, with the largest balls up to `most_mm` that fit.
///
/// # Errors
/// The monitor ends it.
pub(crate) fn samples(
    prepared: &Prepared<'_>,
    axes: &[Vector3],
    most_mm: f64,
    monitor: &dyn Monitor,
) -> Result<Vec<Sample>, Cancelled> {
    let model = prepared.file.model();
    let closest = ClosestPoints::new(model);
    let areas = &prepared.file.face_area_mm2;
    let whole_mm2: f64 = areas.iter().sum();
    let of_face = |face: usize| {
        monitor.go_on()?;
        let along = (SAMPLES * areas[face] / whole_mm2).sqrt().ceil();
        let along = if along.is_finite() { (along as usize).clamp(1, MOST_ALONG) } else { 1 };
        let free = prepared.options.free_sides.get(face).copied();
        let places = places(&model.faces[face], along);
        let area_mm2 = areas[face] / places.len().max(1) as f64;
        let sample = |&(p, n, bends): &(Point3, Vector3, [f64; 2])| {
            let sides = [(n, bends[1], true), (-n, -bends[0], false)].into_iter();
            let allowed = sides.filter(|(.., positive)| free.is_none_or(|free| free.allows(*positive)));
            let seen = allowed.filter(|(n, ..)| axes.iter().any(|a| a.dot(n) > LEAST_FACING));
            let samples = seen.map(|(n, most, _)| Sample {
                area_mm2,
                fits_mm: closest.largest_ball_mm(&p, &n, [0.0, most_mm], FITS_MM),
                hollow_mm: if most > 0.0 { 1.0 / most } else { f64::INFINITY },
            });
            samples.reduce(|a, b| if b.fits_mm > a.fits_mm { b } else { a })
        };
        let samples = places.iter().filter_map(sample);
        Ok(samples.collect::<Vec<_>>())
    };
    let cut = (0..model.faces.len()).into_par_iter().filter(|&face| !prepared.excluded[face]);
    Ok(cut.map(of_face).collect::<Result<Vec<_>, Cancelled>>()?.into_iter().flatten().collect())
}

/// Places on a face, evenly in its parameters, with unit normals and the least and the largest curvature towards these, 1/mm.
fn places(face: &Face, along: usize) -> Vec<(Point3, Vector3, [f64; 2])> {
    let domain = (!face.loops.is_empty()).then(|| Domain::new(face));
    let ((u0, u1), (v0, v1)) = face.surface.domain();
    let at = |i: usize, from: f64, to: f64| from + (to - from) * (i as f64 + 0.5) / along as f64;
    let grid = (0..along).flat_map(|i| (0..along).map(move |j| (i, j)));
    grid.map(|(i, j)| (at(i, u0, u1), at(j, v0, v1)))
        .filter(|&(u, v)| domain.as_ref().is_none_or(|d| d.contains(u, v)))
        .filter_map(|(u, v)| {
            let (jet, (n, _)) = (face.surface.jet(u, v), face.surface.normal(u, v)?);
            // Where the surface has no curvature, none is hollow.
            let bends = jet.curvature(&n).principal().map_or([0.0; 2], |(least, most)| [least, most]);
            Some((jet.p, n, bends))
        })
        .filter(|(p, n, _)| p.iter().chain(n.iter()).all(|c| c.is_finite()))
        .collect()
}
