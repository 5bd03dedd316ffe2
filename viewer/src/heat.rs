//! Maps of scallop heights: the colour scale by shares of the requested height, its legend, and the
//! highest crest near each vertex.

use std::collections::HashMap;

use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::Request;
use claymill_verify::SCALLOP_BAR;
use rayon::prelude::*;

use crate::browser::step_over_mm;
use crate::legend::{LegendEntry, Mark};
use crate::palette::{NOT_CUT, Rgb};
use crate::scene::Scene;

/// Colours of a map of heights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeatScale {
    /// The height that was asked for, mm: maps of different jobs share their colours by it.
    pub asked_mm: f64,
    /// Size of the cells in which the highest sample counts, mm.
    pub cell_mm: f64,
}

/// Cells are at least this large, mm, and at least so many step-overs, so that none between two crests is empty.
const LEAST_CELL_MM: f64 = 8.0;
const CELL_STEPS: f64 = 2.0;

impl HeatScale {
    /// The scale that suits what a job was asked for.
    #[must_use]
    pub fn of_request(request: &Request) -> Self {
        Self::over(step_over_mm(request), request.scallop_mm)
    }

    fn over(step_over_mm: f64, asked_mm: f64) -> Self {
        HeatScale { asked_mm, cell_mm: LEAST_CELL_MM.max(CELL_STEPS * step_over_mm) }
    }
}

/// What a cell counts whose middle is a side away: enough where there is no other.
const LEAST_WEIGHT: f64 = 1e-6;

/// Steps of the scale, as shares of the height asked for, with their colours: from blue (more passes than needed)
/// over green (as asked, to the most that is allowed) to red (too high). Lightness falls towards both ends, so that the map can be read
/// without colours too.
const STEPS: [(f64, Rgb); 7] = [
    (0.0, [44, 62, 140]),
    (0.4, [86, 140, 200]),
    (0.8, [150, 206, 190]),
    (1.0, [196, 226, 140]),
    (SCALLOP_BAR, [224, 232, 128]),
    (1.15, [250, 180, 60]),
    (1.5, [190, 30, 40]),
];

/// Colour of a height, given as a share of the height asked for.
#[must_use]
pub fn heat_colour(share: f64) -> Rgb {
    let above = STEPS.partition_point(|s| s.0 <= share).clamp(1, STEPS.len() - 1);
    let ((a, from), (b, to)) = (STEPS[above - 1], STEPS[above]);
    let x = ((share - a) / (b - a)).clamp(0.0, 1.0);
    [0, 1, 2].map(|k| (f64::from(from[k]) * (1.0 - x) + f64::from(to[k]) * x).round() as u8)
}

/// The steps of the scale in words.
pub fn heat_legend(asked_mm: f64) -> impl Iterator<Item = (Rgb, String)> {
    let last = STEPS.len() - 1;
    STEPS.into_iter().enumerate().map(move |(i, (share, colour))| {
        let mm = share * asked_mm;
        let more = if share == 1.0 {
            ", as asked"
        } else if share == SCALLOP_BAR {
            ", the bar"
        } else if i == last {
            " or more"
        } else {
            ""
        };
        (colour, format!("{mm:.3} mm{more}"))
    })
}

/// Heights by place: the highest of each cell.
pub(crate) struct HighestNear {
    cell_mm: f64,
    highest: HashMap<[i32; 3], f64>,
}

impl HighestNear {
    pub(crate) fn new(heights: &[(Point3, f64)], scale: &HeatScale) -> Self {
        let mut near = HighestNear { cell_mm: scale.cell_mm, highest: HashMap::new() };
        for (p, height) in heights {
            let cell = near.cell(p);
            let h = near.highest.entry(cell).or_insert(0.0);
            *h = h.max(*height);
        }
        near
    }

    fn cell(&self, p: &Point3) -> [i32; 3] {
        [0, 1, 2].map(|k: usize| (p[k] / self.cell_mm).floor() as i32)
    }

    /// Between the highest of the cells around: where a cell has its middle, its own.
    pub(crate) fn at(&self, p: &Point3) -> Option<f64> {
        let around = Vector3::repeat(0.5 * self.cell_mm);
        let ([i0, j0, k0], [i1, j1, k1]) = (self.cell(&(p - around)), self.cell(&(p + around)));
        let cells = (i0..=i1).flat_map(|i| (j0..=j1).flat_map(move |j| (k0..=k1).map(move |k| [i, j, k])));
        let (mut sum, mut weights) = (0.0, 0.0);
        for cell in cells {
            let Some(height) = self.highest.get(&cell) else { continue };
            let aside = [0, 1, 2].map(|k| p[k] / self.cell_mm - f64::from(cell[k]) - 0.5);
            let weight: f64 = aside.iter().map(|a| (1.0 - a.abs()).max(LEAST_WEIGHT)).product();
            sum += weight * height;
            weights += weight;
        }
        (weights > 0.0).then(|| sum / weights)
    }
}

impl Scene {
    /// Paints the surfaces by the highest of `heights` (place and height, mm) in each cell and the ones around it;
    /// grey where there is none. Adds the scale to the legend.
    pub fn paint_heights(&mut self, heights: &[(Point3, f64)], scale: &HeatScale) {
        let near = HighestNear::new(heights, scale);
        let colour = |p: &Point3| near.at(p).map_or(NOT_CUT, |h| heat_colour(h / scale.asked_mm));
        let origin = self.origin.coords;
        for mesh in &mut self.surfaces {
            mesh.vertices.par_iter_mut().for_each(|v| {
                let [r, g, b] = colour(&(Point3::from(v.position.map(f64::from)) + origin));
                v.colour = [r, g, b, v.colour[3]];
            });
        }
        self.is_map = true;
        for (colour, text) in heat_legend(scale.asked_mm) {
            self.legend.push(LegendEntry { mark: Mark::Area, colour, text });
        }
        self.legend.push(LegendEntry { mark: Mark::Area, colour: NOT_CUT, text: "no passes".to_owned() });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::SurfaceVertex;

    #[test]
    fn vertices_take_the_colour_of_the_highest_sample_in_the_cells_around_them() {
        let mut scene = Scene::new(Point3::new(100.0, 0.0, 0.0));
        let vertex = |x: f32| SurfaceVertex {
            position: [x, 0.0, 0.0],
            normal: [0.0, 0.0, 1.0],
            colour: [0, 0, 0, 255],
        };
        scene.add_triangles(&[vertex(0.0), vertex(1.0), vertex(90.0)], &[[0, 1, 2]]);
        let heights = [(Point3::new(100.0, 0.0, 0.0), 0.05), (Point3::new(101.0, 0.5, 0.0), 0.1)];
        scene.paint_heights(&heights, &HeatScale { asked_mm: 0.1, cell_mm: 5.0 });
        let colours: Vec<[u8; 4]> = scene.surfaces[0].vertices.iter().map(|v| v.colour).collect();
        let opaque = |c: Rgb| [c[0], c[1], c[2], 255];
        assert_eq!(colours, [opaque(STEPS[3].1), opaque(STEPS[3].1), opaque(NOT_CUT)]);
        let scale = HeatScale::over(14.1, 0.5);
        let crests: Vec<(Point3, f64)> = (0..2500)
            .map(|k| (Point3::new(f64::from(k % 50) * 14.1, f64::from(k / 50) * 9.0, 0.0), 0.5))
            .collect();
        let near = HighestNear::new(&crests, &scale);
        let everywhere = |k: u32| Point3::new(f64::from(k % 97) * 7.1, f64::from(k / 97) * 4.5, 0.0);
        assert!((0..97 * 97).all(|k| near.at(&everywhere(k)).is_some()), "no gaps between coarse passes");
        assert_eq!(heat_colour(-1.0), STEPS[0].1);
        assert_eq!(heat_colour(9.0), STEPS[6].1);
    }
}
