//! Triangulates rectangular faces as a grid of quads, cut along their shorter diagonals.

use super::lines::Lines;
use crate::curvedness::Curvedness;
use crate::knots::for_degree;
use crate::{FaceMesh, MeshOptions, NurbsError, NurbsSurface, Point2, Point3};
use nalgebra::Vector4;

/// Vertices closer than this are one point: a pole, mm.
const POLE_MM: f64 = 1e-9;

/// Triangulates a rectangle of the parameter plane as a grid of quads cut along their shorter diagonal.
pub(crate) fn rectangle_mesh(
    surface: &NurbsSurface,
    window: (Point2, Point2),
    options: &MeshOptions,
) -> Result<FaceMesh, NurbsError> {
    let curved = Curvedness::of(surface);
    let lines = Lines::new(&curved, window, options)?;
    let (rows, columns) = (lines.u.len(), lines.v.len());
    let points = surface.grid(&lines.u, &lines.v);
    let uv = lines.u.iter().flat_map(|&u| lines.v.iter().map(move |&v| Point2::new(u, v)));
    let mut mesh = FaceMesh {
        uv: uv.collect(),
        triangles: Vec::with_capacity(2 * (rows - 1) * (columns - 1)),
        deviation_mm: Vec::with_capacity(2 * (rows - 1) * (columns - 1)),
        rings: vec![outline(rows, columns)],
        points,
    };
    let piece_of =
        |breaks: &[f64], t: f64| breaks.partition_point(|&k| k <= t).saturating_sub(1).min(breaks.len() - 2);
    let pieces_v: Vec<usize> = lines.v.iter().map(|&v| piece_of(&curved.breaks_v, v)).collect();
    for a in 0..rows - 1 {
        let i = piece_of(&curved.breaks_u, lines.u[a]);
        for b in 0..columns - 1 {
            let bounds = curved.piece(i, pieces_v[b]);
            let deviation = bounds.deviation_mm(lines.u[a + 1] - lines.u[a], lines.v[b + 1] - lines.v[b]);
            let at = |a: usize, b: usize| (a * columns + b) as u32;
            mesh.add_quad([at(a, b), at(a + 1, b), at(a + 1, b + 1), at(a, b + 1)], deviation);
        }
    }
    Ok(mesh)
}

/// The border of the grid, anticlockwise.
fn outline(rows: usize, columns: usize) -> Vec<u32> {
    let at = |a: usize, b: usize| (a * columns + b) as u32;
    let mut ring: Vec<u32> = (0..rows - 1).map(|a| at(a, 0)).collect();
    ring.extend((0..columns - 1).map(|b| at(rows - 1, b)));
    ring.extend((1..rows).rev().map(|a| at(a, columns - 1)));
    ring.extend((1..columns).rev().map(|b| at(0, b)));
    ring
}

impl FaceMesh {
    /// Two triangles, or one where a side of the quad is a pole.
    fn add_quad(&mut self, [a, b, c, d]: [u32; 4], deviation_mm: f64) {
        let length = |i: u32, j: u32| (self.points[i as usize] - self.points[j as usize]).norm_squared();
        let pair = if length(a, c) <= length(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
        for triangle in pair {
            self.add_triangle(triangle, deviation_mm);
        }
    }

    /// Leaves out triangles that a pole has shrunk to a line.
    pub(crate) fn add_triangle(&mut self, triangle: [u32; 3], deviation_mm: f64) {
        let [a, b, c] = triangle.map(|i| self.points[i as usize]);
        let apart = |p: Point3, q: Point3| (p - q).norm_squared() > POLE_MM * POLE_MM;
        if apart(a, b) && apart(b, c) && apart(c, a) {
            self.triangles.push(triangle);
            // Rounded up, so that the bound stays one.
            self.deviation_mm.push((deviation_mm as f32).next_up());
        }
    }
}

impl NurbsSurface {
    /// The points at all pairs of `us` and `vs`, row by row in `u`. Contracting the net with one `u` first
    /// makes a point cost `degree + 1` products instead of its square.
    pub(crate) fn grid(&self, us: &[f64], vs: &[f64]) -> Vec<Point3> {
        let degree = self.knots_u().degree().max(self.knots_v().degree());
        for_degree!(degree, self.grid_sized(us, vs))
    }

    fn grid_sized<const N: usize>(&self, us: &[f64], vs: &[f64]) -> Vec<Point3> {
        let columns = self.size().1;
        let (p, q) = (self.knots_u().degree(), self.knots_v().degree());
        let bases: Vec<_> = vs.iter().map(|&v| self.knots_v().values::<N>(v)).collect();
        let mut points = Vec::with_capacity(us.len() * vs.len());
        let mut row = vec![Vector4::zeros(); columns];
        for &u in us {
            let (first, values) = self.knots_u().values::<N>(u);
            row.fill(Vector4::zeros());
            for i in 0..=p {
                let source = &self.net()[(first + i) * columns..][..columns];
                row.iter_mut().zip(source).for_each(|(r, s)| *r += s * values[i]);
            }
            points.extend(bases.iter().map(|(first, values)| {
                let polygon = &row[*first..=first + q];
                let h = polygon.iter().zip(values).fold(Vector4::zeros(), |h, (c, n)| h + c * *n);
                Point3::from(h.xyz() / h.w)
            }));
        }
        points
    }
}
