//! The material that is left, at any time of a job: a height in each cell of a grid for every setup.
//!
//! ```text
//!   model from a setup's direction ──► top of each cell + allowance ──► ball swept along the tip's way ──► heights
//!   heights, and what earlier setups left ──► colour of the model's vertices; a skin over cells not yet cut
//! ```

use claymill_nurbs::{Point3, Vector3};
use rayon::prelude::*;

use crate::camera::{Camera, View};
use crate::course::{Course, Station};
use crate::front::Front;
use crate::palette::Rgb;
use crate::scene::{LegendEntry, LineKind, Mark, Scene, SurfaceVertex};

/// Material that is still to go, and what has been cut.
const TO_GO: Rgb = [124, 92, 68];
const DONE: Rgb = [214, 206, 194];
/// Cells along the longer side of a map, and the smallest cell as a part of the ball's radius.
const CELLS: f64 = 1000.0;
const FINEST_RADII: f64 = 0.12;
/// What is left of the allowance where a cell counts as cut.
const LEFT: f32 = 0.5;

/// The material over a model that is being cut.
#[derive(Debug, Clone)]
pub struct Stock {
    allowance_mm: f64,
    /// One a setup, in machining order.
    maps: Vec<HeightMap>,
    /// When each setup begins, s.
    begin_s: Vec<f64>,
    /// Vertices of the model's surfaces that were cut, surface by surface; only ever set.
    done: Vec<Vec<bool>>,
    now_s: f64,
    next_station: usize,
}

/// Heights along one tool axis.
#[derive(Debug, Clone)]
struct HeightMap {
    camera: Camera,
    axis: Vector3,
    size: [usize; 2],
    /// The model's, mm along the axis; minus infinity where there is none.
    model: Vec<f32>,
    /// The material's; `None` until the setup begins.
    stock: Option<Vec<f32>>,
}

impl Stock {
    /// Every setup of a job begins with `allowance_mm` along its tool axis over whatever was not cut before.
    #[must_use]
    pub fn of(bare: &Scene, course: &Course, allowance_mm: f64) -> Self {
        let stations = &course.stations;
        let radius_mm = stations.iter().map(|s| s.radius_mm).fold(f64::INFINITY, f64::min);
        let begin_s: Vec<f64> = course.setups.iter().map(|s| s.0).collect();
        let axis = |at_s: f64| {
            let first = stations.partition_point(|s| s.at_s < at_s);
            // The station on the border belongs to the setup before.
            stations.get(first + 1).or(stations.last()).map_or(Vector3::z(), |s| s.axis)
        };
        let maps = begin_s.iter().map(|&s| HeightMap::new(bare, axis(s), radius_mm)).collect();
        let done = bare.surfaces.iter().map(|s| vec![false; s.vertices.len()]).collect();
        Stock { allowance_mm, maps, begin_s, done, now_s: -1.0, next_station: 0 }
    }

    /// Cuts until `to_s`; time only goes on.
    pub fn advance(&mut self, bare: &Scene, course: &Course, to_s: f64) {
        let stations = &course.stations;
        let mut cutting = true;
        while cutting {
            cutting = false;
            let setup = self.begin_s.partition_point(|s| *s <= self.now_s.max(0.0)).max(1) - 1;
            self.begin(bare, setup);
            let end_s = self.begin_s.get(setup + 1).copied().unwrap_or(f64::INFINITY);
            let until_s = to_s.min(end_s);
            while let Some(pair) = stations.get(self.next_station..self.next_station + 2) {
                // A pair that is only begun is cut as far as it goes, and again from its start the next time.
                if pair[0].at_s >= until_s {
                    break;
                }
                let to = if pair[1].at_s <= until_s {
                    pair[1]
                } else {
                    course.station(until_s).unwrap_or(pair[1])
                };
                if pair[0].axis == pair[1].axis {
                    self.maps[setup].cut(&pair[0], &to);
                }
                if pair[1].at_s > until_s {
                    break;
                }
                self.next_station += 1;
            }
            if end_s <= to_s {
                self.mark_done(bare, setup);
                cutting = setup + 1 < self.begin_s.len();
                self.now_s = end_s;
            } else {
                self.now_s = to_s;
            }
        }
    }

    fn begin(&mut self, bare: &Scene, setup: usize) {
        if self.maps.get(setup).is_none_or(|m| m.stock.is_some()) {
            return;
        }
        let allowance = self.allowance_mm as f32;
        let mut stock: Vec<f32> = self.maps[setup].model.iter().map(|h| h + allowance).collect();
        // What earlier setups cut has no material left.
        let before = &self.maps[..setup];
        let map = &self.maps[setup];
        for (i, h) in stock.iter_mut().enumerate().filter(|(_, h)| h.is_finite()) {
            let top = map.place(i, f64::from(map.model[i]));
            if before.iter().any(|m| m.is_cut_at(&top, allowance, bare.deviation_mm)) {
                *h = map.model[i];
            }
        }
        self.maps[setup].stock = Some(stock);
    }

    fn mark_done(&mut self, bare: &Scene, setup: usize) {
        let map = &self.maps[setup];
        let allowance = self.allowance_mm as f32;
        for (mesh, done) in bare.surfaces.iter().zip(&mut self.done) {
            for (v, done) in mesh.vertices.iter().zip(done).filter(|(_, done)| !**done) {
                let p = Point3::from(v.position.map(f64::from)) + bare.origin.coords;
                *done = map.is_cut_at(&p, allowance, bare.deviation_mm);
            }
        }
    }

    /// Puts the material into a scene of the same model at the time that was advanced to, in place of the paths.
    pub fn show(&self, bare: &Scene, scene: &mut Scene) {
        scene.lines.retain(|l| !matches!(l.kind, LineKind::Cut | LineKind::Link | LineKind::Lead));
        self.paint(bare, scene);
        self.add_skin(scene);
        for (colour, text) in
            [(TO_GO, format!("material, {} mm over the model", self.allowance_mm)), (DONE, "cut".to_owned())]
        {
            scene.legend.push(LegendEntry { mark: Mark::Area, colour, text });
        }
    }

    /// Colours the model's surfaces, which are the first of `scene`, by whether they are cut.
    pub fn paint(&self, bare: &Scene, scene: &mut Scene) {
        let allowance = self.allowance_mm as f32;
        let current = self.current();
        for (k, done) in self.done.iter().enumerate() {
            let Some(mesh) = scene.surfaces.get_mut(k) else { continue };
            mesh.vertices.par_iter_mut().zip(done).for_each(|(v, &done)| {
                let p = Point3::from(v.position.map(f64::from)) + bare.origin.coords;
                let cut = done || current.is_some_and(|m| m.is_cut_at(&p, allowance, bare.deviation_mm));
                let [r, g, b] = if cut { DONE } else { TO_GO };
                v.colour = [r, g, b, 255];
            });
        }
    }

    /// Adds the surface of what is still to go in the setup that is on.
    pub fn add_skin(&self, scene: &mut Scene) {
        if let Some(map) = self.current() {
            map.add_skin(scene, self.allowance_mm as f32);
        }
    }

    /// Colours of the material and of what has been cut.
    #[must_use]
    pub fn colours() -> [Rgb; 2] {
        [TO_GO, DONE]
    }

    fn current(&self) -> Option<&HeightMap> {
        self.maps.get(self.begin_s.partition_point(|s| *s <= self.now_s.max(0.0)).max(1) - 1)
    }
}

impl HeightMap {
    fn new(bare: &Scene, axis: Vector3, radius_mm: f64) -> Self {
        let view = View { margin: 0.01, ..View::looking("stock", -axis, axis) };
        let wide = Camera::frame(&view, bare.points(), [CELLS as u32; 2]);
        let finer = wide.mm_per_px() / (FINEST_RADII * radius_mm).max(1e-3);
        let cells = if finer < 1.0 { (CELLS * finer).ceil().max(8.0) } else { CELLS } as u32;
        let camera = Camera::frame(&view, bare.points(), [cells; 2]);
        let front = Front::of(bare, &camera, [cells; 2], 1.0, &[]);
        HeightMap { camera, axis, size: front.size, model: front.nearest, stock: None }
    }

    /// The place of a cell's middle at a height.
    fn place(&self, i: usize, height_mm: f64) -> Point3 {
        let at = [(i % self.size[0]) as f64 + 0.5, (i / self.size[0]) as f64 + 0.5];
        self.camera.unprojected(at, height_mm)
    }

    /// The ball and all above it, from one place to the next.
    fn cut(&mut self, from: &Station, to: &Station) {
        let Some(stock) = &mut self.stock else { return };
        let cell_mm = self.camera.mm_per_px();
        let radius_mm = from.radius_mm;
        let reach = (radius_mm / cell_mm).ceil();
        let pieces = ((to.tip - from.tip).norm() / (0.5 * cell_mm)).ceil().clamp(1.0, 1e5) as u32;
        for k in 0..=pieces {
            let tip = from.tip + (to.tip - from.tip) * (f64::from(k) / f64::from(pieces));
            let Some([x, y]) = self.camera.project(&tip) else { continue };
            let height_mm = self.camera.nearness(&tip);
            let range = |c: f64, end: usize| {
                (c - reach).floor().max(0.0) as usize..((c + reach).ceil().max(0.0) as usize).min(end)
            };
            for row in range(y, self.size[1]) {
                for column in range(x, self.size[0]) {
                    let away_mm = (column as f64 + 0.5 - x).hypot(row as f64 + 0.5 - y) * cell_mm;
                    if away_mm <= radius_mm {
                        let bottom = height_mm + radius_mm - (radius_mm.powi(2) - away_mm.powi(2)).sqrt();
                        let h = &mut stock[row * self.size[0] + column];
                        *h = h.min(bottom as f32);
                    }
                }
            }
        }
    }

    /// Whether `p` is on top of the model in this map and little is left above it.
    fn is_cut_at(&self, p: &Point3, allowance: f32, deviation_mm: f64) -> bool {
        let (Some(stock), Some([x, y])) = (&self.stock, self.camera.project(p)) else { return false };
        if x < 0.0 || y < 0.0 || x as usize >= self.size[0] || y as usize >= self.size[1] {
            return false;
        }
        let i = y as usize * self.size[0] + x as usize;
        // On a steep wall a cell holds many heights.
        let tolerance = (deviation_mm + 2.0 * self.camera.mm_per_px()) as f32;
        let height = self.camera.nearness(p) as f32;
        (height - self.model[i]).abs() <= tolerance && stock[i] - self.model[i] < LEFT * allowance
    }

    /// A surface over the cells that are not cut yet, down to their neighbours.
    fn add_skin(&self, scene: &mut Scene, allowance: f32) {
        let Some(stock) = &self.stock else { return };
        let [width, height] = self.size;
        let to_go = |i: usize| stock[i].is_finite() && stock[i] - self.model[i] >= LEFT * allowance;
        // Higher steps than these are the model's own.
        let step_mm = 4.0 * self.camera.mm_per_px() as f32 + 2.0 * allowance;
        let mut number = vec![u32::MAX; width * height];
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        let mut vertex = |i: usize| {
            if number[i] == u32::MAX {
                number[i] = vertices.len() as u32;
                let p = self.place(i, f64::from(stock[i])) - scene.origin.coords;
                let n = self.normal(stock, i);
                vertices.push(SurfaceVertex {
                    position: [p.x as f32, p.y as f32, p.z as f32],
                    normal: [n.x as f32, n.y as f32, n.z as f32],
                    colour: [TO_GO[0], TO_GO[1], TO_GO[2], 255],
                });
            }
            number[i]
        };
        for y in 0..height.saturating_sub(1) {
            for x in 0..width.saturating_sub(1) {
                let at = y * width + x;
                for t in [[at, at + width, at + 1], [at + 1, at + width, at + width + 1]] {
                    let heights = t.map(|i| stock[i]);
                    let low = heights.iter().copied().fold(f32::INFINITY, f32::min);
                    let high = heights.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                    if low.is_finite() && high - low <= step_mm && t.iter().any(|&i| to_go(i)) {
                        triangles.push(t.map(&mut vertex));
                    }
                }
            }
        }
        scene.add_triangles(&vertices, &triangles);
    }

    fn normal(&self, stock: &[f32], i: usize) -> Vector3 {
        let [width, height] = self.size;
        let (x, y) = (i % width, i / width);
        let slope = |low: usize, high: usize, cells: usize| {
            let rise = f64::from(stock[high] - stock[low]) / (cells.max(1) as f64 * self.camera.mm_per_px());
            if rise.is_finite() { rise.clamp(-4.0, 4.0) } else { 0.0 }
        };
        let (x0, x1) = (x.saturating_sub(1), (x + 1).min(width - 1));
        let (y0, y1) = (y.saturating_sub(1), (y + 1).min(height - 1));
        let along_x = slope(y * width + x0, y * width + x1, x1 - x0);
        let along_y = slope(y0 * width + x, y1 * width + x, y1 - y0);
        let [right, up, _] = self.camera.basis();
        (self.axis - right * along_x + up * along_y).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::animation::Reel;
    use crate::strokes::StrokeStyle;
    use claymill_toolpath::{Move, MoveKind, Program, Tool, ToolRecord};

    /// A plate of 100 × 60 mm, over whose middle a ball of radius 5 runs at 10 mm/s along x.
    fn reel() -> Reel {
        let tools = [ToolRecord { id: "T1".into(), tool: Tool::ball(5.0), holder: None }];
        let cut = Move {
            setup: "top".into(),
            tool: "T1".into(),
            ..Move::straight(MoveKind::Cut, [0., 30., 0.].into(), [100., 30., 0.].into(), Vector3::z(), 600.0)
        };
        let mut bare = Scene::new(Point3::new(50.0, 30.0, 0.0));
        let n = 40_u32;
        let vertices: Vec<SurfaceVertex> = (0..=n)
            .flat_map(|i| (0..=n).map(move |j| (i, j)))
            .map(|(i, j)| SurfaceVertex {
                position: [100.0 * i as f32 / n as f32 - 50.0, 60.0 * j as f32 / n as f32 - 30.0, 0.0],
                normal: [0.0, 0.0, 1.0],
                colour: [9; 4],
            })
            .collect();
        bare.add_triangles(&vertices, &claymill_tests::lattice(n));
        let style = StrokeStyle { tools: &tools, ..StrokeStyle::new(0.1) };
        Reel::new(bare, &Program { moves: vec![cut] }, &[10.0], &style)
    }

    fn height(stock: &Stock, x: f64, y: f64) -> f64 {
        let map = &stock.maps[0];
        let [px, py] = map.camera.project(&Point3::new(x, y, 0.0)).unwrap();
        let i = py as usize * map.size[0] + px as usize;
        f64::from(map.stock.as_ref().unwrap()[i] - map.model[i])
    }

    #[test]
    fn the_ball_leaves_a_groove_of_its_own_round_as_far_as_it_came() {
        let reel = reel();
        let mut stock = Stock::of(reel.bare(), reel.course(), 4.0);
        stock.advance(reel.bare(), reel.course(), 5.0);
        let cell = stock.maps[0].camera.mm_per_px();
        for (x, y) in [(20.0, 30.0), (20.0, 32.0), (40.0, 27.0), (49.0, 30.0), (45.0, 34.0)] {
            let away = f64::abs(y - 30.0);
            let round = 5.0 - (25.0 - away * away).sqrt();
            // A cell holds the height at its middle.
            let slope = away / (25.0 - away * away).sqrt();
            approx::assert_abs_diff_eq!(height(&stock, x, y), round.min(4.0), epsilon = (slope + 0.1) * cell);
        }
        for (x, y) in [(60.0, 30.0), (20.0, 40.0), (90.0, 5.0)] {
            approx::assert_abs_diff_eq!(height(&stock, x, y), 4.0, epsilon = 1e-4);
        }
        // In steps it comes to the same as at once.
        let mut slowly = Stock::of(reel.bare(), reel.course(), 4.0);
        for k in 1..=50 {
            slowly.advance(reel.bare(), reel.course(), 0.1 * f64::from(k));
        }
        let [a, b] = [&slowly, &stock].map(|s| s.maps[0].stock.as_ref().unwrap());
        assert!(a.iter().zip(b).all(|(a, b)| a == b || (a - b).abs() < 0.02));
    }

    #[test]
    fn what_is_cut_shows_the_model_and_the_rest_a_skin_above_it() {
        let reel = reel();
        let mut stock = Stock::of(reel.bare(), reel.course(), 4.0);
        stock.advance(reel.bare(), reel.course(), 5.0);
        let mut scene = reel.scene(5.0);
        let before = scene.surfaces[0].vertices.len();
        stock.show(reel.bare(), &mut scene);
        let model = reel.bare().surfaces[0].vertices.len();
        let coloured = |colour: Rgb, v: &&SurfaceVertex| v.colour[..3] == colour;
        let cut: Vec<_> = scene.surfaces[0].vertices[..model].iter().filter(|v| coloured(DONE, v)).collect();
        assert!(!cut.is_empty());
        // The ball leaves less than half of 4 mm within 4 mm of its way.
        assert!(cut.iter().all(|v| v.position[1].abs() < 4.5 && v.position[0] < 5.5), "{cut:?}");
        let skin = &scene.surfaces[0].vertices[before..];
        let highest = skin.iter().map(|v| v.position[2]).fold(0.0, f32::max);
        assert!((highest - 4.0).abs() < 1e-3, "{highest}");
        assert!(skin.iter().all(|v| v.normal[2] > 0.2));
        assert!(scene.lines.iter().all(|l| l.kind != LineKind::Cut));
    }
}
