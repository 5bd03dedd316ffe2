//! Drive surfaces: one bicubic fitted to a whole region by least squares over its layout in the
//! plane, trimmed by the region's outline. claymill's passes do not use it.

use claymill_nurbs::{
    ClosestPoints, Curve2, FaceId, KnotVector, Model, NurbsSurface, Point2, Point3, TrimEdge, TrimLoop,
};
use rayon::prelude::*;
use thiserror::Error;

use super::flatten::{extent, twice_area};
use super::sparse::solve_spline;
use super::{FieldError, RegionMesh};

/// One surface over a whole region.
#[derive(Debug, Clone)]
pub struct DriveSurface {
    /// A bicubic over `[0, 1]²` that goes on smoothly beyond the region.
    pub surface: NurbsSurface,
    /// The region's outline on it, the outer loop first.
    pub loops: Vec<TrimLoop>,
    /// Largest distance from the region's faces, mm, at places between the fitted ones.
    pub deviation_max_mm: f64,
    /// Root mean square of the distances, mm.
    pub deviation_rms_mm: f64,
}

/// Why a region has no drive surface.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NoDriveSurface {
    /// It is closed.
    #[error("the region is closed: it cannot be laid out in the plane without a cut")]
    Closed,
    /// Not all of it hangs together.
    #[error("the region is in parts")]
    InParts,
    /// Laid out in the plane it would lie on itself.
    #[error("the region cannot be laid out in the plane without lying on itself")]
    Folded,
    /// Its outline touches itself.
    #[error("the outline of the region touches itself")]
    Outline,
    /// The best fit is no good.
    #[error("no fit comes nearer than {deviation_max_mm:.3} mm (more than {most_mm} mm is refused)")]
    TooFar {
        /// Largest distance of the best fit, mm.
        deviation_max_mm: f64,
        /// The largest one accepted, mm.
        most_mm: f64,
    },
    /// The fields themselves.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// The least squares.
    #[error("the surface could not be fitted")]
    NoFit,
}

/// Spans of the fit along the shorter side: doubled from the first until the deviation is small enough.
const SPANS: (usize, usize) = (4, 64);
/// Vertices for each control point at least: more unknowns would follow the mesh's own roughness.
const VERTICES_A_POINT: usize = 3;
/// The layout keeps this part of its size from the surface's sides.
const MARGIN: f64 = 0.01;
/// Stiffness where there is nothing to fit, as a part of the mean weight of a control point.
const STIFFNESS: f64 = 1e-6;
/// A fit that is off by more than so many tolerances is refused.
const MOST: f64 = 10.0;
/// Distances are not measured beyond this multiple of what is refused.
const FAR: f64 = 10.0;
/// A turn of the outline by more than this is a corner, radians.
const CORNER: f64 = 0.35;

impl RegionMesh<'_> {
    /// Fits one bicubic surface over the region: laid out in the plane ([`NoDriveSurface::Folded`] where it cannot
    /// be), its vertices give a place on the faces for each place of the layout, and least squares with a little
    /// stiffness go on smoothly beyond the outline, with which the surface is then trimmed. It is refined until it
    /// is within `tolerance_mm` of the faces or has 64 spans along its shorter side; what it then is off by is
    /// stated, and above ten tolerances it is refused.
    ///
    /// For programs that want one surface to drive along. claymill's own passes do not use it: their points are
    /// on the faces themselves.
    ///
    /// # Errors
    /// Regions that cannot be laid out, and fits that are not near enough.
    pub fn drive_surface(&self, tolerance_mm: f64) -> Result<DriveSurface, NoDriveSurface> {
        if self.loops().is_empty() {
            return Err(NoDriveSurface::Closed);
        }
        let flat = self.flattened()?;
        if flat.iter().flatten().any(|x| !x.is_finite()) {
            return Err(NoDriveSurface::InParts);
        }
        if self.is_folded(&flat) {
            return Err(NoDriveSurface::Folded);
        }
        let (places, aspect) = self.normalised(&flat);
        let loops = self.outline(&places)?;
        let part = self.part();
        let closest = ClosestPoints::new(&part);
        let weights = self.vertex_areas();
        let most_mm = MOST * tolerance_mm;
        let mut spans = SPANS.0;
        let mut best: Option<DriveSurface> = None;
        loop {
            let counts = aspect.map(|a| (spans as f64 * a).round() as usize + 3);
            let surface = self.fitted(&places, &weights, counts)?;
            let found = self.measured(surface, &places, &closest, FAR * most_mm);
            if best.as_ref().is_none_or(|b| found.deviation_max_mm < b.deviation_max_mm) {
                best = Some(found);
            }
            let small = best.as_ref().is_some_and(|b| b.deviation_max_mm <= tolerance_mm);
            let next = aspect.map(|a| (2.0 * spans as f64 * a).round() as usize + 3);
            if small || spans >= SPANS.1 || VERTICES_A_POINT * next[0] * next[1] > places.len() {
                let found = best.ok_or(NoDriveSurface::NoFit)?;
                let deviation_max_mm = found.deviation_max_mm.min(FAR * most_mm);
                if deviation_max_mm <= most_mm {
                    return Ok(DriveSurface { loops, ..found });
                }
                return Err(NoDriveSurface::TooFar { deviation_max_mm, most_mm });
            }
            spans *= 2;
        }
    }

    /// The faces of this mesh as a model of their own.
    fn part(&self) -> Model {
        let mut faces: Vec<FaceId> = self.face_of.clone();
        faces.sort_unstable();
        faces.dedup();
        Model { faces: faces.iter().map(|&f| self.model.faces[f].clone()).collect(), ..Model::default() }
    }

    /// A third of the area of the triangles around each vertex.
    fn vertex_areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.vertices.len()];
        for (t, corners) in self.triangles.iter().enumerate() {
            let third = self.triangle_area_mm2(t) / 3.0;
            corners.iter().for_each(|&v| areas[v as usize] += third);
        }
        areas
    }

    /// The layout turned to its longest extent and scaled into `[0, 1]²`, and its sides by the shorter one.
    fn normalised(&self, flat: &[[f64; 2]]) -> (Vec<[f64; 2]>, [f64; 2]) {
        let count = flat.len() as f64;
        let mean: [f64; 2] = std::array::from_fn(|k| flat.iter().map(|p| p[k]).sum::<f64>() / count);
        let moment =
            |a: usize, b: usize| -> f64 { flat.iter().map(|p| (p[a] - mean[a]) * (p[b] - mean[b])).sum() };
        let (sin, cos) = (0.5 * (2.0 * moment(0, 1)).atan2(moment(0, 0) - moment(1, 1))).sin_cos();
        let turned: Vec<[f64; 2]> =
            flat.iter().map(|p| [cos * p[0] + sin * p[1], cos * p[1] - sin * p[0]]).collect();
        let (low, high) = extent(&turned);
        let size: [f64; 2] = std::array::from_fn(|k| high[k] - low[k]);
        let at =
            |p: &[f64; 2]| std::array::from_fn(|k| MARGIN + (1.0 - 2.0 * MARGIN) * (p[k] - low[k]) / size[k]);
        (turned.iter().map(at).collect(), size.map(|s| s / size[0].min(size[1])))
    }

    /// The loops of the mesh as trim loops: straight from vertex to vertex in the layout, cut at corners.
    fn outline(&self, places: &[[f64; 2]]) -> Result<Vec<TrimLoop>, NoDriveSurface> {
        let mut loops: Vec<(f64, TrimLoop)> = Vec::new();
        for ring in self.loops() {
            let points: Vec<[f64; 2]> = ring.vertices.iter().map(|&v| places[v as usize]).collect();
            let n = points.len();
            let step =
                |k: usize| -> [f64; 2] { std::array::from_fn(|x| points[(k + 1) % n][x] - points[k % n][x]) };
            let turn = |k: usize| {
                let (a, b) = (step(k + n - 1), step(k));
                (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1]).abs()
            };
            let mut cuts: Vec<usize> = (0..n).filter(|&k| turn(k) > CORNER).collect();
            if cuts.len() < 2 {
                let first = cuts.first().copied().unwrap_or(0);
                cuts = vec![first, (first + n / 2) % n];
                cuts.sort_unstable();
            }
            let edge = |from: usize, to: usize| {
                let to = if to > from { to } else { to + n };
                let along = (from..=to).map(|k| Point2::from(points[k % n])).collect();
                let knots = KnotVector::clamped_uniform(1, to - from + 1);
                Some(TrimEdge { pcurve: Curve2::new(knots, along, None).ok()?, shared: None })
            };
            let edges = (0..cuts.len()).map(|k| edge(cuts[k], cuts[(k + 1) % cuts.len()]));
            let edges = edges.collect::<Option<Vec<_>>>().ok_or(NoDriveSurface::Outline)?;
            let area = (0..n).map(|k| twice_area([[0.0; 2], points[k], points[(k + 1) % n]])).sum();
            loops.push((area, TrimLoop { edges }));
        }
        loops.sort_by(|a, b| b.0.total_cmp(&a.0));
        match loops.split_first() {
            Some((outer, holes)) if outer.0 > 0.0 && holes.iter().all(|h| h.0 < 0.0) => {
                Ok(loops.into_iter().map(|(_, l)| l).collect())
            }
            _ => Err(NoDriveSurface::Outline),
        }
    }

    /// Least squares through the vertices, and as little change of slope from one control point to the next as
    /// these leave free.
    fn fitted(
        &self,
        places: &[[f64; 2]],
        weights: &[f64],
        counts: [usize; 2],
    ) -> Result<NurbsSurface, NoDriveSurface> {
        let knots = counts.map(|n| KnotVector::clamped_uniform(3, n));
        let total: f64 = weights.iter().sum();
        let stiffness = STIFFNESS * total / (counts[0] * counts[1]) as f64;
        let given = places.iter().zip(weights).zip(&self.vertices).map(|((at, &weight), vertex)| {
            let [(i, u), (j, v)] = [0, 1].map(|k| knots[k].basis_functions(at[k]));
            let basis = std::array::from_fn(|a| std::array::from_fn(|b| u[a] * v[b]));
            ([i, j], basis, weight, vertex.point.coords.into())
        });
        let points = solve_spline(counts, stiffness, given)?;
        let [u, v] = knots;
        let points = points.into_iter().map(Point3::from).collect();
        NurbsSurface::new(u, v, points, None).map_err(|_| NoDriveSurface::NoFit)
    }

    /// The surface with its distance from the faces in the middle of all triangles, infinite beyond `within_mm`.
    fn measured(
        &self,
        surface: NurbsSurface,
        places: &[[f64; 2]],
        closest: &ClosestPoints<'_>,
        within_mm: f64,
    ) -> DriveSurface {
        let distances: Vec<f64> = self
            .triangles
            .par_iter()
            .map(|t| {
                let at = |k: usize| t.iter().map(|&v| places[v as usize][k]).sum::<f64>() / 3.0;
                let p = surface.point(at(0), at(1));
                closest.closest(&p, within_mm).map_or(f64::INFINITY, |f| f.distance_mm)
            })
            .collect();
        let squares: f64 = distances.iter().map(|d| d * d).sum();
        DriveSurface {
            surface,
            loops: Vec::new(),
            deviation_max_mm: distances.iter().copied().fold(0.0, f64::max),
            deviation_rms_mm: (squares / distances.len() as f64).sqrt(),
        }
    }
}
