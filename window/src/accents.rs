//! Lines over everything else: the section's outline and what is picked.

use claymill_nurbs::{Point3, Vector3};
use rayon::prelude::*;

use crate::desk::Desk;
use crate::layers::LineLook;
use crate::lines::{BREAK, LineVertex};
use crate::pick::Section;

/// Lines and their looks by tag.
#[derive(Debug, Default)]
pub(crate) struct Accents {
    pub(crate) vertices: Vec<LineVertex>,
    pub(crate) looks: Vec<LineLook>,
}

impl Accents {
    fn add(&mut self, look: LineLook, segments: impl IntoIterator<Item = [[f32; 3]; 2]>) {
        let tag = self.looks.len() as u32;
        self.looks.push(look);
        for [a, b] in segments {
            self.vertices.extend([LineVertex { at: a, tag }, LineVertex { at: b, tag: tag | BREAK }]);
        }
    }

    /// Of a desk; `outline` is that of its section.
    pub(crate) fn of(desk: &Desk<'_>, outline: &[[[f32; 3]; 2]]) -> Self {
        let mut accents = Accents::default();
        let edge = if desk.dark { [250, 200, 90] } else { [150, 60, 0] };
        accents.add(LineLook::new(edge, 1.0, 2.0), outline.iter().copied());
        if let Some(picked) = desk.picked() {
            let chosen = LineLook::new([255, 120, 0], 1.0, 3.4);
            if let Some(l) = picked.on_path {
                accents.add(chosen, desk.tracks.lines.of_tag(l.tag));
            } else if let Some(l) = picked.on_seam {
                accents.add(chosen, desk.seam_lines.of_tag(l.tag));
            }
        }
        accents
    }
}

/// Where the section plane meets the triangles of the faces that are shown, relative to the scene's origin.
pub(crate) fn outline(desk: &Desk<'_>, section: &Section) -> Vec<[[f32; 3]; 2]> {
    let exhibit = desk.exhibit();
    let faces: Vec<usize> =
        (0..exhibit.meshes.len()).filter(|f| desk.layers.shows_face(exhibit, *f)).collect();
    let origin = desk.scene.origin;
    let of_face = |&f: &usize| {
        let mesh = &exhibit.meshes[f];
        let above: Vec<f64> =
            mesh.points.iter().map(|p| section.normal.dot(&p.coords) - section.at_mm).collect();
        let crossed = mesh.triangles.iter().filter_map(move |t| {
            let mut ends = [None; 2];
            let mut found = 0;
            for k in 0..3 {
                let [i, j] = [t[k] as usize, t[(k + 1) % 3] as usize];
                if (above[i] > 0.0) != (above[j] > 0.0) && found < 2 {
                    let share = above[i] / (above[i] - above[j]);
                    ends[found] = Some(mesh.points[i] + (mesh.points[j] - mesh.points[i]) * share);
                    found += 1;
                }
            }
            // A hair before the plane, on the side that is shown.
            let place = |p: Point3| {
                let p: Vector3 = p - origin - section.normal * 1e-3;
                [p.x as f32, p.y as f32, p.z as f32]
            };
            Some([place(ends[0]?), place(ends[1]?)])
        });
        crossed.collect::<Vec<_>>()
    };
    faces.par_iter().flat_map_iter(of_face).collect()
}
