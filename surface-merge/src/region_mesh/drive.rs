use claymill_nurbs::{ClosestPoints, FaceId, KnotVector, Model, NurbsSurface, Point3};
use nalgebra::{DMatrix, Dyn, linalg::Cholesky};
use rayon::prelude::*;
use thiserror::Error;

use super::{Field, FieldError, RegionMesh};

/// One surface over a whole region.
#[derive(Debug, Clone)]
pub struct DriveSurface {
    /// A bicubic over `[0, 1]²`; `u` leads from one guide to the other, `v` along them.
    pub surface: NurbsSurface,
    /// Largest distance from the region's faces, mm, over places between the fitted ones too.
    pub deviation_max_mm: f64,
    /// Root mean square of the distances, mm.
    pub deviation_rms_mm: f64,
}

/// Why a region has no drive surface.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum NoDriveSurface {
    /// It has holes, is a ring or is closed.
    #[error("a grid needs one border, this region has {loops}")]
    NoDisk {
        /// Its number of loops.
        loops: usize,
    },
    /// The border is too short for four sides.
    #[error("a grid needs four sides, the border of this region has too few edges")]
    NoSides,
    /// Places of the grid that lie on no triangle, or on two.
    #[error("the two fields do not make a grid: {missing} of {nodes} places are missing or there twice")]
    NoGrid {
        /// Missing and double places.
        missing: usize,
        /// All places.
        nodes: usize,
    },
    /// The fields themselves.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// The least squares.
    #[error("the grid could not be fitted")]
    NoFit,
}

/// Places of the grid along a side: one for each triangle edge, within these bounds.
const PLACES: (f64, f64) = (24.0, 320.0);
/// Spans of the fit: doubled from the first until the deviation is small enough.
const SPANS: (usize, usize) = (4, 64);
/// The part of a grid's places that may be filled in.
const MOST_FILLED: f64 = 1e-3;
/// Barycentric coordinates may be negative by this much.
const INSIDE: f64 = 1e-7;

impl RegionMesh<'_> {
    /// Fits one bicubic surface over the grid that two harmonic fields make: between one pair of opposite sides
    /// and between the other. It is refined until it is within `tolerance_mm` of the faces, or until 64 × 64
    /// spans; what it then is off by is stated.
    ///
    /// For programs that want one surface to drive along. claymill's own passes do not use it: their points are
    /// on the faces themselves.
    ///
    /// # Errors
    /// Regions that are not four-sided sheets, or whose fields fold over.
    pub fn drive_surface(&self, tolerance_mm: f64) -> Result<DriveSurface, NoDriveSurface> {
        if self.loops().len() != 1 {
            return Err(NoDriveSurface::NoDisk { loops: self.loops().len() });
        }
        let [mut a, mut b, mut c, mut d] = self.four_sides().ok_or(NoDriveSurface::NoSides)?;
        if self.run_mm(&b) + self.run_mm(&d) > self.run_mm(&a) + self.run_mm(&c) {
            (a, b, c, d) = (b, c, d, a);
        }
        let fields = [self.harmonic(&a, &c)?, self.harmonic(&d, &b)?];
        let places = |one: &[u32], other: &[u32]| {
            let mean = 0.5 * (self.run_mm(one) + self.run_mm(other));
            (mean / self.edge_mm()).clamp(PLACES.0, PLACES.1).ceil() as usize
        };
        let part = self.part();
        let closest = ClosestPoints::new(&part);
        let grid = self.grid(&fields, [places(&b, &d), places(&a, &c)], &closest)?;
        let mut spans = SPANS.0;
        let mut best: Option<DriveSurface> = None;
        loop {
            let found = fitted(&grid, spans, &closest).ok_or(NoDriveSurface::NoFit)?;
            if best.as_ref().is_none_or(|b| found.deviation_max_mm < b.deviation_max_mm) {
                best = Some(found);
            }
            let small = best.as_ref().is_some_and(|b| b.deviation_max_mm <= tolerance_mm);
            // More unknowns than half the places would follow the grid's own roughness.
            if small || spans == SPANS.1 || 4 * (spans + 3) > grid.rows.min(grid.columns) {
                return best.ok_or(NoDriveSurface::NoFit);
            }
            spans *= 2;
        }
    }

    fn run_mm(&self, side: &[u32]) -> f64 {
        side.windows(2).map(|w| self.distance_mm(w[0], w[1])).sum()
    }

    /// The faces of this mesh as a model of their own.
    fn part(&self) -> Model {
        let mut faces: Vec<FaceId> = self.face_of.clone();
        faces.dedup();
        faces.sort_unstable();
        faces.dedup();
        Model { faces: faces.iter().map(|&f| self.model.faces[f].clone()).collect(), ..Model::default() }
    }

    /// The points where both fields are multiples of their steps.
    fn grid(
        &self,
        [across, along]: &[Field<'_, '_>; 2],
        [rows, columns]: [usize; 2],
        closest: &ClosestPoints<'_>,
    ) -> Result<Grid, NoDriveSurface> {
        let nodes = (rows + 1) * (columns + 1);
        let mut points: Vec<Option<Point3>> = vec![None; nodes];
        let mut double = vec![false; nodes];
        for t in 0..self.triangles().len() {
            let [x, y] = [across.at_corners(t), along.at_corners(t)];
            let corners: [[f64; 2]; 3] = std::array::from_fn(|k| [x[k] * rows as f64, y[k] * columns as f64]);
            let area = cross(corners[0], corners[1], corners[2]);
            let bounds = |axis: usize, most: usize| {
                let low = corners.iter().fold(f64::INFINITY, |m, c| m.min(c[axis]));
                let high = corners.iter().fold(f64::NEG_INFINITY, |m, c| m.max(c[axis]));
                let first = (low - INSIDE).ceil().max(0.0) as usize;
                (high + INSIDE >= 0.0).then(|| first..=((high + INSIDE).floor() as usize).min(most))
            };
            let (Some(is), Some(js)) = (bounds(0, rows), bounds(1, columns)) else { continue };
            if area == 0.0 || area.is_nan() {
                continue;
            }
            for i in is {
                for j in js.clone() {
                    let at = [i as f64, j as f64];
                    let share: [f64; 3] =
                        std::array::from_fn(|k| cross(at, corners[(k + 1) % 3], corners[(k + 2) % 3]) / area);
                    if share.iter().any(|s| *s < -INSIDE) {
                        continue;
                    }
                    let uv = (0..3).fold([0.0; 2], |sum, k| {
                        let c = self.corners()[t][k];
                        [sum[0] + share[k] * c.x, sum[1] + share[k] * c.y]
                    });
                    let surface = &self.model.faces[self.face_of[t]].surface;
                    let (u, v) = surface.clamp(uv[0], uv[1]);
                    let point = surface.point(u, v);
                    let node = i * (columns + 1) + j;
                    match points[node] {
                        Some(p) => double[node] |= (p - point).norm() > 0.2 * self.edge_mm(),
                        None => points[node] = Some(point),
                    }
                }
            }
        }
        let bad: Vec<usize> = (0..nodes).filter(|&n| double[n] || points[n].is_none()).collect();
        if bad.len() as f64 > MOST_FILLED * nodes as f64 {
            return Err(NoDriveSurface::NoGrid { missing: bad.len(), nodes });
        }
        // Single places are lost where the fields are steep, at tips: they lie between their neighbours.
        for n in bad {
            let (i, j) = (n / (columns + 1), n % (columns + 1));
            let near = (0..nodes).filter(|&m| {
                let (k, l) = (m / (columns + 1), m % (columns + 1));
                i.abs_diff(k) <= 1 && j.abs_diff(l) <= 1 && m != n && !double[m]
            });
            let known: Vec<Point3> = near.filter_map(|m| points[m]).collect();
            let sum = known.iter().fold(Point3::origin(), |s, p| s + p.coords / known.len() as f64);
            let foot = (!known.is_empty()).then(|| closest.closest(&sum, f64::INFINITY)).flatten();
            let Some(foot) = foot else { return Err(NoDriveSurface::NoGrid { missing: 1, nodes }) };
            (points[n], double[n]) = (Some(foot.point), false);
        }
        Ok(Grid { points: points.into_iter().flatten().collect(), rows: rows + 1, columns: columns + 1 })
    }
}

/// Points row by row.
struct Grid {
    points: Vec<Point3>,
    rows: usize,
    columns: usize,
}

/// Twice the signed area of a triangle.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Least squares with as many cubic spans both ways: the tensor product of two fits of curves.
fn fitted(grid: &Grid, spans: usize, closest: &ClosestPoints<'_>) -> Option<DriveSurface> {
    let knots = KnotVector::clamped_uniform(3, spans + 3);
    let [by_row, by_column] = [Fit::new(&knots, grid.rows)?, Fit::new(&knots, grid.columns)?];
    let count = spans + 3;
    let axis = |k: usize| {
        let given = DMatrix::from_fn(grid.rows, grid.columns, |i, j| grid.points[i * grid.columns + j][k]);
        let half = by_row.solve(&given);
        by_column.solve(&half.transpose()).transpose()
    };
    let [x, y, z] = [axis(0), axis(1), axis(2)];
    let at = |n: usize| (n / count, n % count);
    let points = (0..count * count).map(|n| Point3::new(x[at(n)], y[at(n)], z[at(n)]));
    let surface = NurbsSurface::new(knots.clone(), knots, points.collect(), None).ok()?;
    // Three places for each span, and never only those that were fitted.
    let probes = (3 * spans).max(48) + 1;
    let distances: Vec<f64> = (0..probes * probes)
        .into_par_iter()
        .map(|n| {
            let share = |k: usize| k as f64 / (probes - 1) as f64;
            let p = surface.point(share(n / probes), share(n % probes));
            closest.closest(&p, f64::INFINITY).map_or(f64::INFINITY, |f| f.distance_mm)
        })
        .collect();
    let squares: f64 = distances.iter().map(|d| d * d).sum();
    Some(DriveSurface {
        surface,
        deviation_max_mm: distances.iter().copied().fold(0.0, f64::max),
        deviation_rms_mm: (squares / distances.len() as f64).sqrt(),
    })
}

/// The least squares of a cubic spline through evenly spaced places, ends included exactly as the rest.
struct Fit {
    basis: DMatrix<f64>,
    normal: Cholesky<f64, Dyn>,
}

impl Fit {
    fn new(knots: &KnotVector, places: usize) -> Option<Self> {
        let mut basis = DMatrix::zeros(places, knots.point_count());
        for i in 0..places {
            let (first, values) = knots.basis_functions(i as f64 / (places - 1) as f64);
            values.iter().enumerate().for_each(|(k, b)| basis[(i, first + k)] = *b);
        }
        let normal = (basis.transpose() * &basis).cholesky()?;
        Some(Fit { basis, normal })
    }

    /// The control values of every column.
    fn solve(&self, given: &DMatrix<f64>) -> DMatrix<f64> {
        self.normal.solve(&(self.basis.transpose() * given))
    }
}
