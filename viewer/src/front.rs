//! Which face is in front at each place of a picture, found by the processor: no graphics card is asked.

use std::ops::Range;

use claymill_nurbs::Point3;
use rayon::prelude::*;

use crate::camera::Camera;
use crate::scene::Scene;

/// Nothing is there.
pub(crate) const NOBODY: u32 = u32::MAX;
/// Rows that one thread fills at a time.
const BAND: usize = 16;

/// Owners of the surfaces in front, in cells of a few pixels.
pub(crate) struct Front {
    /// Cells in a row, and rows.
    pub(crate) size: [usize; 2],
    /// Side of a cell, pixels.
    pub(crate) cell_px: f64,
    /// Owner of each cell, row by row; [`NOBODY`] where no owned surface is in front.
    pub(crate) owner: Vec<u32>,
    /// How near its surface is ([`Camera::nearness`]); minus infinity where there is none.
    pub(crate) nearest: Vec<f32>,
}

/// Vertices of one surface of a scene that belong to an owner.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Owned {
    pub(crate) surface: usize,
    pub(crate) vertices: Range<u32>,
    pub(crate) owner: u32,
}

impl Front {
    /// Looks at the surfaces of `scene`; triangles belong to the owner of their first vertex, those without one hide what
    /// is behind them.
    pub(crate) fn of(scene: &Scene, camera: &Camera, size: [u32; 2], cell_px: f64, owned: &[Owned]) -> Self {
        let cells = size.map(|s| (f64::from(s) / cell_px).ceil().max(1.0) as usize);
        let placed: Vec<Placed> = (scene.surfaces.iter().enumerate())
            .map(|(k, mesh)| {
                let place = |v: &crate::SurfaceVertex| {
                    let p = Point3::from(v.position.map(f64::from)) + scene.origin.coords;
                    // Depth as 1/distance is straight in a perspective picture; order is all that counts here.
                    let nearness = camera.nearness(&p);
                    camera.project(&p).map_or([f32::NAN; 3], |[x, y]| {
                        [(x / cell_px) as f32, (y / cell_px) as f32, nearness as f32]
                    })
                };
                let mut owners = vec![NOBODY; mesh.vertices.len()];
                for o in owned.iter().filter(|o| o.surface == k) {
                    owners[o.vertices.start as usize..o.vertices.end as usize].fill(o.owner);
                }
                Placed { at: mesh.vertices.par_iter().map(place).collect(), owners, corners: &mesh.indices }
            })
            .collect();
        let bands: Vec<Band> = (0..cells[1].div_ceil(BAND))
            .into_par_iter()
            .map(|b| {
                let rows = b * BAND..((b + 1) * BAND).min(cells[1]);
                let mut band = Band {
                    width: cells[0],
                    nearest: vec![f32::NEG_INFINITY; cells[0] * rows.len()],
                    owner: vec![NOBODY; cells[0] * rows.len()],
                    rows,
                };
                for mesh in &placed {
                    for t in mesh.corners.chunks_exact(3) {
                        band.fill(
                            [t[0], t[1], t[2]].map(|i| mesh.at[i as usize]),
                            mesh.owners[t[0] as usize],
                        );
                    }
                }
                band
            })
            .collect();
        Front {
            size: cells,
            cell_px,
            owner: bands.iter().flat_map(|b| b.owner.iter().copied()).collect(),
            nearest: bands.iter().flat_map(|b| b.nearest.iter().copied()).collect(),
        }
    }

    /// For each cell about how far it is from the nearest cell of another owner, in cells: 1 on the border.
    pub(crate) fn room(&self) -> Vec<f32> {
        const ASLANT: f32 = std::f32::consts::SQRT_2;
        let [width, height] = self.size;
        let mut room = vec![f32::INFINITY; width * height];
        let at = |x: i64, y: i64| {
            let inside = (0..width as i64).contains(&x) && (0..height as i64).contains(&y);
            inside.then(|| y as usize * width + x as usize)
        };
        let steps = [(-1, 0, 1.0), (0, -1, 1.0), (-1, -1, ASLANT), (1, -1, ASLANT)];
        let forth = (0..height as i64).flat_map(|y| (0..width as i64).map(move |x| (x, y)));
        let back = (0..height as i64).rev().flat_map(|y| (0..width as i64).rev().map(move |x| (x, y)));
        for (x, y, sign) in forth.map(|(x, y)| (x, y, 1)).chain(back.map(|(x, y)| (x, y, -1))) {
            let Some(here) = at(x, y) else { continue };
            for (dx, dy, step) in steps {
                let through = match at(x + sign * dx, y + sign * dy) {
                    Some(there) if self.owner[there] == self.owner[here] => room[there] + step,
                    // Another's cell, or the picture's border.
                    _ => step,
                };
                room[here] = room[here].min(through);
            }
        }
        room
    }
}

struct Placed<'a> {
    at: Vec<[f32; 3]>,
    owners: Vec<u32>,
    corners: &'a [u32],
}

struct Band {
    width: usize,
    rows: Range<usize>,
    nearest: Vec<f32>,
    owner: Vec<u32>,
}

impl Band {
    fn fill(&mut self, [a, b, c]: [[f32; 3]; 3], owner: u32) {
        let low = |i: usize| a[i].min(b[i]).min(c[i]);
        let high = |i: usize| a[i].max(b[i]).max(c[i]);
        let cross = |p: [f32; 3], q: [f32; 3], x: f32, y: f32| {
            (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
        };
        let twice_area = cross(a, b, c[0], c[1]);
        if twice_area == 0.0 || !twice_area.is_finite() {
            return;
        }
        // Cells whose middle may lie inside; conversion to integers saturates.
        let range = |i: usize, end: usize| {
            ((low(i) - 0.5).ceil().max(0.0) as usize)..((high(i) + 0.5).floor().max(0.0) as usize).min(end)
        };
        let rows = range(1, self.rows.end);
        for y in rows.start.max(self.rows.start)..rows.end {
            for x in range(0, self.width) {
                let (px, py) = (x as f32 + 0.5, y as f32 + 0.5);
                let weights = [cross(b, c, px, py), cross(c, a, px, py), cross(a, b, px, py)];
                if weights.iter().any(|w| w * twice_area < 0.0) {
                    continue;
                }
                let near = (weights[0] * a[2] + weights[1] * b[2] + weights[2] * c[2]) / twice_area;
                let at = (y - self.rows.start) * self.width + x;
                if near > self.nearest[at] {
                    (self.nearest[at], self.owner[at]) = (near, owner);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Axes, View};
    use crate::shapes::SurfaceVertex;
    use claymill_nurbs::Vector3;

    #[test]
    fn the_nearest_surface_owns_a_cell_in_any_camera() {
        let mut scene = Scene::default();
        let square = |half: f32, z: f32| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| SurfaceVertex {
                position: [x * half, y * half, z],
                normal: [0.0, 0.0, 1.0],
                colour: [200; 4],
            })
        };
        // A large plate below and a small one above it.
        scene.add_triangles(&square(50.0, 0.0), &[[0, 1, 2], [0, 2, 3]]);
        scene.add_triangles(&square(20.0, 30.0), &[[0, 1, 2], [0, 2, 3]]);
        let owned = [(0..4, 7), (4..8, 9)].map(|(vertices, owner)| Owned { surface: 0, vertices, owner });
        let flat = View::looking("above", -Vector3::z(), Vector3::y());
        let eye = View::standing(&Axes::default(), Point3::new(0.0, 0.0, 200.0), Point3::new(0.0, 0.1, 0.0));
        for view in [flat, eye.unwrap()] {
            let size = [400, 400];
            let camera = Camera::frame(&view, scene.points(), size);
            let front = Front::of(&scene, &camera, size, 2.0, &owned);
            assert_eq!(front.size, [200, 200]);
            let owner = |x: f64, y: f64, z: f64| {
                let [px, py] = camera.project(&Point3::new(x, y, z)).unwrap().map(|v| (v / 2.0) as usize);
                front.owner[py * 200 + px]
            };
            assert_eq!([owner(0.0, 0.0, 0.0), owner(15.0, -15.0, 30.0), owner(-45.0, 40.0, 0.0)], [9, 9, 7]);
            assert_eq!(front.owner[0], NOBODY);
            // The middle of the small plate is farthest from what is not its own.
            let room = front.room();
            let best =
                (0..room.len()).filter(|&i| front.owner[i] == 9).max_by(|&a, &b| room[a].total_cmp(&room[b]));
            let (x, y) = (best.unwrap() % 200, best.unwrap() / 200);
            assert!(x.abs_diff(100) <= 2 && y.abs_diff(100) <= 2, "{x} {y}");
        }
    }
}
