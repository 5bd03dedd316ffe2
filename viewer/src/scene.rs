//! A scene of a model: coloured faces, borders, pins, labels and legend, built without a graphics card.

use std::collections::HashSet;
use std::ops::Range;

use claymill_nurbs::{Aabb, Curve2, Face, FaceMesh, Point3, Vector3};
use claymill_toolpath::{FreeSide, SheetRecord};
use rayon::prelude::*;

use crate::ViewError;
use crate::borders::{BorderKind, classify_borders};
use crate::legend::LegendEntry;
use crate::model_view::{Colouring, ModelView, mesh_deviation_mm};
use crate::palette::{CLAY, NOT_CUT, RegionExtent, Rgb, colour_regions};
use crate::pins::Pin;
use crate::shapes::{
    BOTH_SIDES, FREE_AGAINST, FREE_ALONG, Label, LineKind, LineLayer, SurfaceMesh, SurfaceVertex, relative,
};

/// Everything that is drawn, ready for the graphics card but built without one.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// Coordinates of surfaces and lines are relative to this point, so that single precision suffices.
    pub origin: Point3,
    /// The surfaces.
    pub surfaces: Vec<SurfaceMesh>,
    /// The lines, in drawing order.
    pub lines: Vec<LineLayer>,
    /// Marked places, drawn over everything.
    pub pins: Vec<Pin>,
    /// Names of faces, drawn over everything where they hide least.
    pub labels: Vec<Label>,
    /// Which surface holds each face of the model, and which of its vertices are the face's.
    pub face_vertices: Vec<(usize, Range<u32>)>,
    /// The legend, top to bottom.
    pub legend: Vec<LegendEntry>,
    /// Caption lines, the first one larger.
    pub caption: Vec<String>,
    /// Largest distance of the triangles from the true surface, mm: lines this far behind still show.
    pub deviation_mm: f64,
    /// The surfaces are a map: they keep the colours of the legend, unlit.
    pub is_map: bool,
    /// What the camera frames instead of everything, so that pictures of a series stand still; empty: everything.
    pub framed: Vec<Point3>,
}

/// Vertices a surface buffer holds at most: 56 MB, well below the smallest limit of any adapter.
const LARGEST_MESH: usize = 2_000_000;

impl Scene {
    /// An empty scene whose coordinates are kept relative to `origin`: best the middle of the model.
    #[must_use]
    pub fn new(origin: Point3) -> Self {
        Scene { origin, ..Scene::default() }
    }

    /// A scene of a model: shaded faces, thin patch borders, strong region borders.
    ///
    /// # Errors
    /// The lists of the view do not have one entry a face.
    pub fn of_model(view: &ModelView<'_>, colouring: Colouring) -> Result<Self, ViewError> {
        let faces = view.model.faces.len();
        let lists = [
            ("meshes", view.meshes.len()),
            ("regions", view.region_of_face.len()),
            ("cut marks", view.cut.map_or(faces, <[bool]>::len)),
            ("sides", view.free_sides.map_or(faces, <[FreeSide]>::len)),
        ];
        if let Some(&(what, given)) = lists.iter().find(|(_, given)| *given != faces) {
            return Err(ViewError::Mismatch { what, given, faces });
        }
        let bounds = view.meshes.iter().fold(Aabb::empty(), |b, m| b.union(&Aabb::of(&m.points)));
        let mut scene = Scene::new(if bounds.is_empty() { Point3::origin() } else { bounds.centre() });
        scene.deviation_mm = f64::from(mesh_deviation_mm(view.meshes));
        scene.add_faces(view, &face_colours(view, colouring));
        scene.add_borders(view);
        Ok(scene)
    }

    fn add_faces(&mut self, view: &ModelView<'_>, colours: &[Rgb]) {
        let origin = self.origin;
        let parts: Vec<Vec<SurfaceVertex>> = (0..view.meshes.len())
            .into_par_iter()
            .map(|f| face_vertices(view, f, colours[f], &origin))
            .collect();
        for (mesh, vertices) in view.meshes.iter().zip(parts) {
            self.add_triangles(&vertices, &mesh.triangles);
            let end = self.surfaces.last().map_or(0, |s| s.vertices.len() as u32);
            let surface = self.surfaces.len().saturating_sub(1);
            self.face_vertices.push((surface, end - vertices.len() as u32..end));
        }
    }

    /// Adds shaded triangles; `vertices` must be relative to [`Scene::origin`].
    pub fn add_triangles(&mut self, vertices: &[SurfaceVertex], triangles: &[[u32; 3]]) {
        let full = |m: &SurfaceMesh| m.vertices.len() + vertices.len() > LARGEST_MESH;
        if self.surfaces.last().is_none_or(full) {
            self.surfaces.push(SurfaceMesh::default());
        }
        let Some(mesh) = self.surfaces.last_mut() else {
            return;
        };
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend_from_slice(vertices);
        mesh.indices.extend(triangles.iter().flatten().map(|i| i + first));
    }

    /// Adds triangles that have no faces behind them, of one colour a corner, with round edges.
    pub fn add_solid(&mut self, points: &[Point3], triangles: &[[u32; 3]], colours: &[Rgb]) {
        let normals = facet_normals(points, triangles);
        let vertices = points.iter().zip(normals).zip(colours).map(|((p, n), c)| SurfaceVertex {
            position: relative(p, &self.origin),
            normal: [n.x as f32, n.y as f32, n.z as f32],
            colour: [c[0], c[1], c[2], BOTH_SIDES],
        });
        self.add_triangles(&vertices.collect::<Vec<_>>(), triangles);
    }

    fn add_borders(&mut self, view: &ModelView<'_>) {
        let layer = |kind, width_px, opacity| LineLayer { kind, width_px, opacity, ..LineLayer::default() };
        let (mut patch, mut region) =
            (layer(LineKind::Patches, 1.0, 0.28), layer(LineKind::Regions, 2.4, 1.0));
        for border in classify_borders(view) {
            let (layer, colour) = match border.kind {
                BorderKind::Patch => (&mut patch, [40, 40, 44]),
                BorderKind::Region => (&mut region, [28, 28, 34]),
            };
            layer.add(border.points.iter(), &self.origin, colour, 0);
        }
        self.lines.push(patch);
        self.lines.push(region);
    }

    /// Whether there is nothing to draw.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.surfaces.iter().all(|s| s.indices.is_empty()) && self.lines.iter().all(|l| l.strips.is_empty())
    }

    /// All points that the camera has to frame: those it is told to, or the surfaces', or without any the lines'.
    pub fn points(&self) -> impl Iterator<Item = Point3> + Clone {
        let surface = self.surfaces.iter().flat_map(|s| s.vertices.iter().map(|v| v.position));
        let only_lines = self.surfaces.iter().all(|s| s.vertices.is_empty());
        let lines = self.lines.iter().filter(move |_| only_lines).flat_map(|l| l.points.iter().copied());
        let origin = self.origin.coords;
        let told = !self.framed.is_empty();
        let all = surface.chain(lines).filter(move |_| !told);
        self.framed.iter().copied().chain(all.map(move |p| Point3::from(p.map(f64::from)) + origin))
    }
}

/// Colours of the faces of `view`, by face.
#[must_use]
pub fn face_colours(view: &ModelView<'_>, colouring: Colouring) -> Vec<Rgb> {
    let by_region = match colouring {
        Colouring::Region => region_colours(view),
        Colouring::Clay | Colouring::File => Vec::new(),
    };
    let cut = |f: usize| view.cut.is_none_or(|cut| cut[f]);
    let colour = |f: usize| match colouring {
        _ if !cut(f) => NOT_CUT,
        Colouring::Clay => CLAY,
        Colouring::Region => by_region[view.region_of_face[f]],
        Colouring::File => view.model.faces[f].source.colour.unwrap_or(CLAY),
    };
    (0..view.model.faces.len()).map(colour).collect()
}

/// Colours of the regions of `view`, by region id: the same in every picture of the model, however fine its triangles.
#[must_use]
pub fn region_colours(view: &ModelView<'_>) -> Vec<Rgb> {
    let count = view.region_of_face.iter().max().map_or(0, |m| m + 1);
    let nothing = RegionExtent { area: 0.0, boxes: Vec::new() };
    let mut regions = vec![nothing; count];
    let boxes: Vec<Aabb> = view.model.faces.par_iter().map(outline_box).collect();
    for (bounds, &r) in boxes.into_iter().zip(view.region_of_face) {
        if !bounds.is_empty() {
            let side = bounds.max - bounds.min;
            regions[r].area += (side.x * side.y).hypot(side.y * side.z).hypot(side.z * side.x);
            regions[r].boxes.push(bounds);
        }
    }
    colour_regions(&regions)
}

/// Box of places along the face's outline.
fn outline_box(face: &Face) -> Aabb {
    const PLACES: u32 = 8;
    let along = |pcurve: &Curve2| {
        let (t0, t1) = pcurve.domain();
        let at = |k: u32| t0 + (t1 - t0) * f64::from(k) / f64::from(PLACES);
        (0..=PLACES).map(|k| face.surface.point_on(pcurve, at(k))).collect::<Vec<_>>()
    };
    let points: Vec<Point3> =
        face.boundary().iter().flat_map(|l| &l.edges).flat_map(|e| along(&e.pcurve)).collect();
    Aabb::of(&points)
}

/// Whether some sheet can be seen from the side of the material.
#[must_use]
pub fn shows_material(sheets: &[SheetRecord]) -> bool {
    let is_one_sided = |sheet: &SheetRecord| sheet.free_sides.iter().any(|side| !side.is_both());
    sheets.iter().any(|sheet| sheet.open_mm > 0.0 && is_one_sided(sheet))
}

pub(crate) fn face_vertices(
    view: &ModelView<'_>,
    f: usize,
    colour: Rgb,
    origin: &Point3,
) -> Vec<SurfaceVertex> {
    let (mesh, surface) = (&view.meshes[f], &view.model.faces[f].surface);
    let normals = facet_normals(&mesh.points, &mesh.triangles);
    let outward = outward_on_rings(mesh);
    // Chords of two faces along one edge are apart by what both deviate at most: wider by that, no gap shows between them.
    let wider_mm = f64::from(mesh.deviation_mm.iter().copied().fold(0.0, f32::max)) + HAIR_MM;
    let sides = match view.free_sides.map_or(FreeSide::Both, |sides| sides[f]) {
        FreeSide::Both => BOTH_SIDES,
        FreeSide::Along => FREE_ALONG,
        FreeSide::Against => FREE_AGAINST,
    };
    let vertex = |i: usize| {
        let exact = surface.normal(mesh.uv[i].x, mesh.uv[i].y).map(|(n, _)| n);
        let n = exact.unwrap_or(normals[i]);
        let out = outward[i].try_normalize(1e-9).map_or(Vector3::zeros(), |o| o * wider_mm);
        SurfaceVertex {
            position: relative(&(mesh.points[i] + out), origin),
            normal: [n.x as f32, n.y as f32, n.z as f32],
            colour: [colour[0], colour[1], colour[2], sides],
        }
    };
    (0..mesh.points.len()).map(vertex).collect()
}

/// Edges that touch exactly would show gaps where pixels fall between them, mm.
const HAIR_MM: f64 = 0.02;

/// For vertices on a mesh's rings a direction away from the triangles there; zero inside.
fn outward_on_rings(mesh: &FaceMesh) -> Vec<Vector3> {
    let mut outward = vec![Vector3::zeros(); mesh.points.len()];
    let mut on_ring = vec![false; mesh.points.len()];
    let mut edges: HashSet<[u32; 2]> = HashSet::new();
    for ring in &mesh.rings {
        for i in 0..ring.len() {
            let (a, b) = (ring[i], ring[(i + 1) % ring.len()]);
            edges.insert([a.min(b), a.max(b)]);
            on_ring[a as usize] = true;
        }
    }
    for t in &mesh.triangles {
        for k in 0..3 {
            let [a, b, c] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
            if on_ring[a as usize] && on_ring[b as usize] && edges.contains(&[a.min(b), a.max(b)]) {
                let [pa, pb, pc] = [a, b, c].map(|i| mesh.points[i as usize]);
                let along = (pb - pa).try_normalize(0.0).unwrap_or(Vector3::zeros());
                let inward = (pc - pa) - along * (pc - pa).dot(&along);
                let out = -inward.try_normalize(0.0).unwrap_or(Vector3::zeros());
                outward[a as usize] += out;
                outward[b as usize] += out;
            }
        }
    }
    outward
}

/// Area-weighted normals of the triangles around each vertex: for where the surface itself has none.
fn facet_normals(points: &[Point3], triangles: &[[u32; 3]]) -> Vec<Vector3> {
    let mut normals = vec![Vector3::zeros(); points.len()];
    for t in triangles {
        let [a, b, c] = t.map(|i| points[i as usize]);
        let n = (b - a).cross(&(c - a));
        for &i in t {
            normals[i as usize] += n;
        }
    }
    let unit = |n: Vector3| n.try_normalize(0.0).unwrap_or(Vector3::z());
    normals.into_iter().map(unit).collect()
}
