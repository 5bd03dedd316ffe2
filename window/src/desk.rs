//! The state of a window, without a window: what is shown, from where, at what time, and what was picked.

use std::sync::Arc;

use claymill_nurbs::{Aabb, ClosestPoints, Point3, Vector3};
use claymill_viewer::{
    CLOSEST_PASSES_PX, Colouring, HeatScale, Rgb, Scene, SurfaceMesh, View, ViewError, region_colours,
};

use crate::clock::Clock;
use crate::crests::{Crests, News};
use crate::exhibit::{Exhibit, Shared};
use crate::facts::{self, Facts, Measured};
use crate::findings::{Marked, marks};
use crate::joints::{Seam, Seams, joint_counts};
use crate::layers::{self, Layers, LineLook, Paint};
use crate::lines::Lines;
use crate::material::{Left, Material};
use crate::pick::{self, OnLine, Section, Spot, box_near};
use crate::sight::Sight;
use crate::tracks::Tracks;

/// Material over the model, as long as nobody says how much, mm.
const ALLOWANCE_MM: f64 = 3.0;

/// What a click means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tool {
    /// Shows what is known of the place.
    Select,
    /// Takes a point to measure from or to.
    Measure,
}

/// What was picked.
#[derive(Debug, Clone, PartialEq)]
pub struct Picked {
    /// The surface.
    pub spot: Option<Spot>,
    /// The move.
    pub on_path: Option<OnLine>,
    /// The seam.
    pub on_seam: Option<OnLine>,
    /// What is known of them.
    pub facts: Facts,
}

/// A plane along an axis of the vehicle, before which everything is cut away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cutting {
    /// Whether it cuts.
    pub on: bool,
    /// 0 along, 1 across, 2 up.
    pub axis: usize,
    /// Where along the axis, as a part of the model's extent.
    pub share: f64,
    /// Keep the other side.
    pub flipped: bool,
}

/// The state machine behind the window.
pub struct Desk<'a> {
    pub(crate) exhibit: &'a Shared,
    closest: ClosestPoints<'a>,
    bounds: Aabb,
    /// The surfaces in their colours; vertices in the order of the faces' meshes.
    pub(crate) scene: Scene,
    pub(crate) seams: Vec<Seam>,
    joint_counts: [usize; 5],
    pub(crate) seam_lines: Lines,
    pub(crate) tracks: Tracks,
    region_colours: Vec<Rgb>,
    marks: Vec<Marked>,
    /// The camera.
    pub sight: Sight,
    /// What is shown.
    pub layers: Layers,
    /// What a click means.
    pub tool: Tool,
    /// The section plane.
    pub cutting: Cutting,
    /// The time.
    pub clock: Clock,
    /// Dark surroundings.
    pub dark: bool,
    picked: Option<Picked>,
    measured: Vec<Spot>,
    pub(crate) news: News,
    pub(crate) crests: Crests,
    material: Material,
    left: Option<Arc<Left>>,
    cutting_material: bool,
    /// Material over the model before the first setup, mm.
    pub allowance_mm: f64,
    painted: Option<(Paint, bool)>,
    /// Counts repaintings of the surfaces.
    pub(crate) paintings: u64,
    said: Vec<serde_json::Value>,
}

impl<'a> Desk<'a> {
    /// Lays everything out, for a picture of `size` pixels.
    ///
    /// # Errors
    /// There is nothing to show, or the exhibit's lists do not fit its model.
    pub fn new(exhibit: &'a Shared, size: [u32; 2]) -> Result<Self, ViewError> {
        let bounds = exhibit.bounds();
        if bounds.is_empty() {
            return Err(ViewError::EmptyScene);
        }
        let mut scene = Scene::of_model(&exhibit.view(None), Colouring::Clay)?;
        scene.lines.clear();
        if scene.surfaces.is_empty() {
            scene.origin = bounds.centre();
        }
        let (closest, (seams, tracks)) = rayon::join(
            || ClosestPoints::new(&exhibit.model),
            || {
                rayon::join(
                    || Seams::new(exhibit, &scene.origin),
                    || exhibit.job.as_ref().map_or_else(Tracks::default, |j| Tracks::new(&scene, j)),
                )
            },
        );
        let axes = exhibit.axes;
        let sight = Sight::new(&View::iso(&axes), axes.up, &outline(exhibit, &bounds), size);
        let crests =
            exhibit.job.as_ref().and_then(|j| j.crests.clone()).map_or(Crests::Unknown, Crests::Known);
        let clock = Clock { now_s: tracks.duration_s(), playing: false, speed: 60.0 };
        let mut desk = Desk {
            closest,
            bounds,
            seam_lines: Lines::new(&seams.strokes, 0.0),
            joint_counts: joint_counts(&seams.seams),
            seams: seams.seams,
            tracks,
            region_colours: region_colours(&exhibit.view(None)),
            marks: marks(exhibit),
            sight,
            layers: Layers::new(exhibit),
            tool: Tool::Select,
            cutting: Cutting { on: false, axis: 1, share: 0.5, flipped: false },
            clock,
            dark: false,
            picked: None,
            measured: Vec::new(),
            news: News::default(),
            crests,
            material: Material::default(),
            left: None,
            cutting_material: false,
            allowance_mm: ALLOWANCE_MM,
            painted: None,
            paintings: 0,
            said: Vec::new(),
            scene,
            exhibit,
        };
        // Only faults are shown unasked.
        desk.layers.marks = desk.marks.iter().any(|m| m.fault);
        desk.repaint();
        Ok(desk)
    }

    /// What is shown.
    #[must_use]
    pub fn exhibit(&self) -> &'a Exhibit {
        self.exhibit
    }

    /// Around everything, mm.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Colour of each region.
    #[must_use]
    pub fn region_colours(&self) -> &[Rgb] {
        &self.region_colours
    }

    /// Places of findings.
    #[must_use]
    pub fn marks(&self) -> &[Marked] {
        &self.marks
    }

    /// What was picked.
    #[must_use]
    pub fn picked(&self) -> Option<&Picked> {
        self.picked.as_ref()
    }

    /// Points taken to measure between.
    #[must_use]
    pub fn measured_points(&self) -> &[Spot] {
        &self.measured
    }

    /// What lies between the last two points.
    #[must_use]
    pub fn measured(&self) -> Option<Measured> {
        match self.measured.as_slice() {
            [a, b] => Some(Measured::between(a, b)),
            _ => None,
        }
    }

    /// Pairs of faces with a joint of each class, and open stretches, as `JointClass::ALL` lists them.
    #[must_use]
    pub fn joint_counts(&self) -> [usize; 5] {
        self.joint_counts
    }

    /// What happened since the last call, for other programs.
    pub fn take_said(&mut self) -> Vec<serde_json::Value> {
        std::mem::take(&mut self.said)
    }

    // --- camera -------------------------------------------------------------------------------------------

    /// Looks from a named side at all that is shown.
    pub fn look(&mut self, name: &str) {
        if let Some(view) = View::named(name, &self.exhibit.axes) {
            let points = self.framed();
            // A view along an axis is for measuring by eye.
            self.sight.set_perspective(view.opening_deg.is_some());
            self.sight.look(&view, &points);
        }
    }

    /// Shows all that is switched on.
    pub fn fit(&mut self) {
        let points = self.framed();
        self.sight.fit(&points);
    }

    /// Shows one region large.
    pub fn fit_region(&mut self, region: usize) {
        let points = self.exhibit.outline(|f| self.exhibit.region_of_face[f] == region);
        self.sight.fit(&points);
    }

    fn framed(&self) -> Vec<Point3> {
        let points =
            self.exhibit.outline(|f| self.layers.shows_face(self.exhibit, f) || !self.layers.surfaces);
        if points.is_empty() { self.bounds.vertices().to_vec() } else { points }
    }

    /// What a drag that begins at a place of the picture holds: the surface there, or the depth of the model's middle.
    #[must_use]
    pub fn hold(&self, at_px: [f64; 2]) -> Point3 {
        if let Some(spot) = self.spot(at_px) {
            return spot.point;
        }
        let ray = self.sight.ray(at_px, 0.0);
        let toward = ray.along.dot(&self.sight.forward());
        ray.from
            + ray.along * ((self.bounds.centre() - ray.from).dot(&self.sight.forward()) / toward.max(1e-6))
    }

    // --- section ------------------------------------------------------------------------------------------

    /// Axis of the section plane as a unit vector, with its name.
    #[must_use]
    pub fn cutting_axis(&self) -> (Vector3, &'static str) {
        let axes = self.exhibit.axes;
        match self.cutting.axis {
            0 => (axes.forward, "along"),
            1 => (axes.up.cross(&axes.forward), "across"),
            _ => (axes.up, "up"),
        }
    }

    /// Extent of the model along the section's axis, mm.
    #[must_use]
    pub fn cutting_range(&self) -> [f64; 2] {
        let (axis, _) = self.cutting_axis();
        let along = self.bounds.vertices().map(|c| axis.dot(&c.coords));
        [
            along.iter().copied().fold(f64::INFINITY, f64::min),
            along.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        ]
    }

    /// The half space that is shown, if there is a section.
    #[must_use]
    pub fn section(&self) -> Option<Section> {
        let [low, high] = self.cutting_range();
        let at_mm = low + (high - low) * self.cutting.share;
        let (axis, _) = self.cutting_axis();
        let sign = if self.cutting.flipped { -1.0 } else { 1.0 };
        self.cutting.on.then(|| Section { normal: axis * sign, at_mm: at_mm * sign })
    }

    // --- picking ------------------------------------------------------------------------------------------

    /// The exact surface under a place of the picture.
    #[must_use]
    pub fn spot(&self, at_px: [f64; 2]) -> Option<Spot> {
        let reach = self.reach_mm();
        let ray = self.sight.ray(at_px, reach);
        let length = 2.0 * reach + self.sight.eye_mm().unwrap_or(0.0);
        let shown = |f: usize| self.layers.shows_face(self.exhibit, f);
        let section = self.section();
        pick::spot(&self.closest, &self.exhibit.model.faces, &ray, length, shown, section.as_ref())
    }

    /// A line of sight that starts so far before the target and goes on as far behind it misses nothing, mm.
    fn reach_mm(&self) -> f64 {
        2.0 * self.bounds.diagonal() + (self.bounds.centre() - self.sight.target()).norm()
    }

    /// Acts on a click: picks, or takes a point to measure.
    pub fn click(&mut self, at_px: [f64; 2]) {
        match self.tool {
            Tool::Select => self.pick(at_px),
            Tool::Measure => self.take_point(at_px),
        }
    }

    fn pick(&mut self, at_px: [f64; 2]) {
        let spot = self.spot(at_px);
        let section = self.section();
        let near = |b: &Aabb| box_near(b, &self.scene.origin, &self.sight, at_px);
        let on = |lines: &Lines, spacing_mm: f32, until, shown: &dyn Fn(u32) -> bool| {
            let ranges = lines.visible(spacing_mm, until, near);
            let (spot, section) = (spot.as_ref(), section.as_ref());
            pick::line(lines, ranges, &self.scene.origin, &self.sight, at_px, shown, spot, section)
        };
        let seam_shown = |tag: u32| self.layers.shows_seam(self.exhibit, &self.seams[tag as usize]);
        let on_seam = on(&self.seam_lines, 0.0, (u32::MAX, 1.0), &seam_shown);
        let on_path = self.exhibit.job.as_ref().and_then(|job| {
            let shown = |tag: u32| self.layers.shows_move(job, &job.program.moves[tag as usize]);
            on(&self.tracks.lines, self.spacing_mm(), self.until(), &shown)
        });
        if spot.is_none() && on_path.is_none() && on_seam.is_none() {
            self.picked = None;
            return;
        }
        let heights = match &self.crests {
            Crests::Known(heights) => Some(heights.as_slice()),
            _ => None,
        };
        let facts = Facts {
            surface: spot.as_ref().map(|s| facts::surface(self.exhibit, s, heights)),
            path: on_path.and_then(|l| {
                let begins = &self.tracks.begins_s;
                facts::path(self.exhibit, l.tag as usize, l.share, begins, &l.point, heights)
            }),
            joint: on_seam.map(|l| facts::joint(self.exhibit, &self.seams[l.tag as usize], &l.point)),
        };
        let ray = self.sight.ray(at_px, self.reach_mm());
        let sight = serde_json::json!({ "from_mm": ray.from, "along": ray.along });
        self.said.push(serde_json::json!({ "at_px": at_px, "sight": sight, "picked": facts }));
        self.picked = Some(Picked { spot, on_path, on_seam, facts });
    }

    fn take_point(&mut self, at_px: [f64; 2]) {
        let Some(spot) = self.spot(at_px) else { return };
        if self.measured.len() == 2 {
            self.measured.clear();
        }
        self.measured.push(spot);
        if let Some(measured) = self.measured() {
            self.said.push(serde_json::json!({ "measured": measured }));
        }
    }

    /// Forgets what was picked and measured.
    pub fn clear(&mut self) {
        self.picked = None;
        self.measured.clear();
    }

    // --- what the picture is made of ----------------------------------------------------------------------

    /// Distance that passes keep in the picture, mm.
    pub(crate) fn spacing_mm(&self) -> f32 {
        (CLOSEST_PASSES_PX * self.sight.mm_per_px()) as f32
    }

    pub(crate) fn move_looks(&self) -> Vec<LineLook> {
        let job = self.exhibit.job.as_ref();
        job.map_or_else(Vec::new, |j| layers::move_looks(j, &self.region_colours, &self.layers))
    }

    pub(crate) fn seam_looks(&self) -> Vec<LineLook> {
        layers::seam_looks(self.exhibit, &self.seams, &self.layers)
    }

    /// Takes in what the measuring thread found and paints the surfaces as the layers say.
    pub fn repaint(&mut self) {
        if let Some(news) = self.news.lock().ok().and_then(|mut news| news.take()) {
            self.crests = news;
        }
        if self.layers.paint == Paint::Stock {
            return self.show_material();
        }
        self.left = None;
        let known = matches!(self.crests, Crests::Known(_));
        let wanted = (self.layers.paint, known && self.layers.paint == Paint::Scallop);
        if self.painted == Some(wanted) {
            return;
        }
        self.painted = Some(wanted);
        self.paintings += 1;
        let crests = self.crests.clone();
        let heights = match (&crests, &self.exhibit.job) {
            (Crests::Known(heights), Some(job)) => {
                Some((heights.as_slice(), HeatScale::of_request(&job.job.request)))
            }
            _ => None,
        };
        layers::paint(&mut self.scene, self.exhibit, self.layers.paint, heights);
    }

    /// Paints the surfaces by the material left at the time shown, as soon as it is found.
    fn show_material(&mut self) {
        let (at_s, allowance_mm) = (self.clock.now_s, self.allowance_mm);
        let (left, done) = self.material.left(self.exhibit, &self.scene, at_s, allowance_mm);
        self.cutting_material = !done;
        let same = |a: &Arc<Left>| self.left.as_ref().is_some_and(|b| Arc::ptr_eq(a, b));
        let Some(left) = left.filter(|l| !same(l)) else { return };
        for (surface, colours) in self.scene.surfaces.iter_mut().zip(&left.colours) {
            let painted = surface.vertices.iter_mut().zip(colours);
            painted.for_each(|(v, &[r, g, b, _])| v.colour = [r, g, b, v.colour[3]]);
        }
        self.scene.legend.clear();
        self.left = Some(left);
        self.painted = None;
        self.paintings += 1;
    }

    /// The surface of the material that is still to go.
    pub(crate) fn skin(&self) -> &[SurfaceMesh] {
        self.left.as_ref().map_or(&[], |l| &l.skin)
    }

    /// Whether the material shown is that of an earlier moment, until the one asked for is found.
    #[must_use]
    pub fn is_cutting_material(&self) -> bool {
        self.layers.paint == Paint::Stock && self.cutting_material
    }
}

/// What the first view frames.
fn outline(exhibit: &Exhibit, bounds: &Aabb) -> Vec<Point3> {
    let points = exhibit.outline(|_| true);
    if points.is_empty() { bounds.vertices().to_vec() } else { points }
}
