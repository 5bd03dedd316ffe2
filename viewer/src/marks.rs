//! Surfaces painted by what became of them, as a verifier found it.

use std::collections::HashMap;

use claymill_nurbs::{Point3, Vector3};
use rayon::prelude::*;

use crate::legend::{LegendEntry, Mark};
use crate::palette::{NOT_CUT, Rgb};
use crate::scene::Scene;

/// The meaning of the numbers of a map of states.
#[derive(Debug, Clone)]
pub struct StateScale {
    /// Colour and meaning of each state, for the legend top to bottom; an empty meaning is left out.
    pub states: Vec<(Rgb, String)>,
    /// About the distance of the samples, mm.
    pub spacing_mm: f64,
}

impl Scene {
    /// Paints the surfaces by the state (an index into the scale) of the sample nearest to each vertex; grey where none is
    /// near. Samples come with the normal of their side: the two sides of a sheet do not take each other's colour.
    pub fn paint_states(&mut self, samples: &[(Point3, Vector3, usize)], scale: &StateScale) {
        let cell_mm = 1.5 * scale.spacing_mm;
        let cell = |p: &Point3| [0, 1, 2].map(|k: usize| (p[k] / cell_mm).floor() as i32);
        let mut cells: HashMap<[i32; 3], Vec<usize>> = HashMap::new();
        for (i, (p, ..)) in samples.iter().enumerate() {
            cells.entry(cell(p)).or_default().push(i);
        }
        let nearest = |p: &Point3, n: &Vector3| {
            let [x, y, z] = cell(p);
            let around = (0..27).map(|d: i32| [x + d % 3 - 1, y + d / 3 % 3 - 1, z + d / 9 - 1]);
            let near = around.filter_map(|c| cells.get(&c)).flatten();
            // Along the surface rather than through it.
            let far = |i: usize| {
                let d = samples[i].0 - p;
                d.norm_squared() + 8.0 * d.dot(n).powi(2)
            };
            near.map(|&i| (far(i), i))
                .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
                .map(|(_, i)| samples[i].2)
        };
        let origin = self.origin.coords;
        for mesh in &mut self.surfaces {
            mesh.vertices.par_iter_mut().for_each(|v| {
                let p = Point3::from(v.position.map(f64::from)) + origin;
                let state = nearest(&p, &Vector3::from(v.normal.map(f64::from)));
                let [r, g, b] = state.and_then(|s| scale.states.get(s)).map_or(NOT_CUT, |s| s.0);
                v.colour = [r, g, b, v.colour[3]];
            });
        }
        self.is_map = true;
        for (colour, text) in scale.states.iter().filter(|s| !s.1.is_empty()) {
            self.legend.push(LegendEntry { mark: Mark::Area, colour: *colour, text: text.clone() });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::SurfaceVertex;

    #[test]
    fn a_vertex_takes_the_state_of_the_nearest_sample_and_grey_where_none_is_near() {
        let mut scene = Scene::new(Point3::new(10.0, 0.0, 0.0));
        let at = |x: f32| SurfaceVertex {
            position: [x, 0.0, 0.0],
            normal: [0.0, 0.0, 1.0],
            colour: [0, 0, 0, 255],
        };
        scene.add_triangles(&[at(0.0), at(9.0), at(80.0)], &[[0, 1, 2]]);
        let up = Vector3::z();
        let samples = [
            (Point3::new(11.0, 0.0, 0.0), up, 1),
            // Nearer, but through the sheet.
            (Point3::new(10.0, 0.0, -0.6), up, 0),
            (Point3::new(18.0, 0.0, 0.0), up, 0),
        ];
        let states = vec![([1, 2, 3], "cut".to_owned()), ([4, 5, 6], String::new())];
        scene.paint_states(&samples, &StateScale { states, spacing_mm: 5.0 });
        let colours: Vec<[u8; 4]> = scene.surfaces[0].vertices.iter().map(|v| v.colour).collect();
        assert_eq!(colours[0], [4, 5, 6, 255]);
        assert_eq!(colours[1], [1, 2, 3, 255]);
        assert_eq!(colours[2][..3], NOT_CUT);
        assert_eq!(scene.legend.len(), 1);
    }
}
