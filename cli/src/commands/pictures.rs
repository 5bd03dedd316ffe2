//! The pictures of a job or a model: what each shows, how finely it is triangulated, its caption.

use std::path::Path;

use claymill::{Finished, free_sides};
use claymill_controller::Frame;
use claymill_nurbs::{Aabb, FaceMesh, MeshOptions, Model, Point3, Vector3, tessellate};
use claymill_paths::Orientation;
use claymill_toolpath::{
    FreeSide, Job, LONGEST_MADE, MoveKind, Program, Request, Setup, SheetRecord, read_plain,
};
use claymill_verify::CrestSample;
use claymill_viewer::{
    Axes, BrowserInput, Colouring, HeatScale, Label, LegendEntry, LineKind, MATERIAL_SIDE, Mark, ModelView,
    Picture, PictureOptions, Renderer, ReportPicture, Rgb, Scene, SetupSheet, StrokeStyle, Thumbnail, View,
    ViewError, browser_glb, deflated, region_colours, region_legend, region_thumbnails, shows_material,
};
use rayon::prelude::*;

use super::finished::title;
use super::stages::{self, StockState};
use crate::args::ShowName;
use crate::console::{Console, counted};
use crate::failure::{Failure, advice_on};

/// Fine enough for pictures of a whole vehicle: half a pixel is about 1 mm there.
pub(crate) const PICTURE_MESH: MeshOptions = MeshOptions { deviation_mm: 0.5, longest_edge_mm: 60.0 };
/// Smaller models have smaller triangles.
const VEHICLE_MM: f64 = 2000.0;
/// Finer than this no picture needs it.
const FINEST_MM: f64 = 0.005;
/// Fine enough for reflections, which see the normals between vertices.
const REFLECTION_MESH: MeshOptions = MeshOptions { deviation_mm: 0.05, longest_edge_mm: 15.0 };
/// Fine enough for a map of heights.
const MAP_MESH: MeshOptions = MeshOptions { deviation_mm: 0.5, longest_edge_mm: 12.0 };
/// What previews show: ways through the air would hide what is cut.
const PREVIEWED: [ShowName; 6] =
    [ShowName::Regions, ShowName::Joints, ShowName::Trims, ShowName::Cut, ShowName::Link, ShowName::Labels];
/// The map of scallop heights.
const SCALLOP_FILE: &str = "scallop-iso.png";
/// So many faces that could not be drawn are named.
const NAMED: usize = 3;
/// Captions of pictures that others look for.
const COVER: &str = "Tool paths over the regions";
const SCALLOP_MAP: &str = "Scallop height as measured";
/// Previews that would be in the report twice: setup sheets have the same views.
const SHOWN_ON_SHEETS: [&str; 2] = ["preview-top.png", "preview-side.png"];
/// Size of the pictures on setup sheets, pixels.
const SHEET_SIZE: [u32; 2] = [1280, 720];
/// Letters of pictures that the report shows at a third of their size.
pub(super) const SHOWN_SMALL: f32 = 1.7;
/// Drawn lines leave their curves by no more than this, mm.
pub(crate) const CHORD_MM: f64 = 0.3;
/// Layers that are surfaces.
const SURFACES: [ShowName; 5] =
    [ShowName::Model, ShowName::Regions, ShowName::Stock, ShowName::Scallop, ShowName::Uncut];

impl From<ViewError> for Failure {
    fn from(error: ViewError) -> Self {
        let advice = match &error {
            ViewError::Size { .. } => {
                return Failure::usage(error, "Choose a size such as --size 1920x1080.");
            }
            ViewError::EmptyScene => "Check the model with `claymill inspect`.",
            ViewError::Write { source, .. } => advice_on(source),
            _ => "",
        };
        Failure::problem(error, advice)
    }
}

/// Tool paths and how they are drawn.
#[derive(Clone, Copy)]
pub(crate) struct Paths<'a> {
    pub(crate) program: &'a Program,
    pub(crate) style: StrokeStyle<'a>,
}

/// A model that is ready to be drawn.
pub(crate) struct Album<'a> {
    model: &'a Model,
    meshes: Vec<FaceMesh>,
    region_of_face: &'a [usize],
    cut: Option<&'a [bool]>,
    tolerance_mm: f64,
    /// The side of each face that is free of material.
    free_sides: Option<Vec<FreeSide>>,
    /// Some face can be seen from the other side.
    shows_material: bool,
}

impl<'a> Album<'a> {
    pub(crate) fn new(
        model: &'a Model,
        region_of_face: &'a [usize],
        cut: Option<&'a [bool]>,
        tolerance_mm: f64,
    ) -> Self {
        let meshes = meshes(model, &sized(PICTURE_MESH, model));
        Album { model, meshes, region_of_face, cut, tolerance_mm, free_sides: None, shows_material: false }
    }

    /// The same with the two sides of sheets told apart.
    pub(crate) fn with_sides(self, sheets: &[SheetRecord]) -> Self {
        let shows_material = shows_material(sheets);
        let free_sides = (!sheets.is_empty()).then(|| free_sides(sheets, self.model.faces.len()));
        Album { free_sides, shows_material, ..self }
    }

    /// The same with triangles fine enough for reflections.
    pub(crate) fn for_reflections(self) -> Self {
        Album { meshes: meshes(self.model, &sized(REFLECTION_MESH, self.model)), ..self }
    }

    /// The same with triangles fine enough for maps.
    pub(crate) fn for_maps(self) -> Self {
        Album { meshes: meshes(self.model, &sized(MAP_MESH, self.model)), ..self }
    }

    /// The same with triangles for a picture in which a pixel is `mm_per_px`.
    pub(crate) fn for_scale(self, mm_per_px: f64) -> Self {
        let usual = sized(PICTURE_MESH, self.model);
        let deviation_mm = (0.4 * mm_per_px).max(FINEST_MM).min(usual.deviation_mm);
        let finer = MeshOptions { deviation_mm, ..usual };
        Album { meshes: meshes(self.model, &finer), ..self }
    }

    /// A number on each region.
    fn labels(&self, colours: &[Rgb]) -> Vec<Label> {
        let mut faces = vec![Vec::new(); colours.len()];
        for (face, &region) in self.region_of_face.iter().enumerate() {
            faces[region].push(face);
        }
        let label = |(region, faces): (usize, Vec<usize>)| Label {
            text: region.to_string(),
            colour: colours[region],
            faces,
        };
        faces.into_iter().enumerate().map(label).collect()
    }

    fn view(&self) -> ModelView<'_> {
        ModelView {
            model: self.model,
            meshes: &self.meshes,
            region_of_face: self.region_of_face,
            cut: self.cut,
            joint_tolerance_mm: self.tolerance_mm,
            free_sides: self.free_sides.as_deref(),
        }
    }

    pub(crate) fn colours(&self) -> Vec<Rgb> {
        region_colours(&self.view())
    }

    /// The model with what is to be shown.
    pub(crate) fn scene(
        &self,
        title: &str,
        paths: Option<Paths<'_>>,
        show: &[ShowName],
    ) -> Result<Scene, Failure> {
        let shown = |what: ShowName| show.contains(&what);
        let colours = self.colours();
        let colouring = if shown(ShowName::Regions) { Colouring::Region } else { Colouring::Clay };
        let mut scene = Scene::of_model(&self.view(), colouring)?;
        scene.lines.retain(|l| match l.kind {
            LineKind::Patches => shown(ShowName::Trims),
            LineKind::Regions => shown(ShowName::Joints),
            _ => true,
        });
        let facts =
            format!("{} in {}", counted(self.model.faces.len(), "face"), counted(colours.len(), "region"));
        scene.caption = vec![title.to_owned(), facts];
        scene.caption.extend(undrawn(self.model, &self.meshes));
        if shown(ShowName::Regions) && !shown(ShowName::Labels) {
            scene.legend.extend(region_legend(&colours));
        }
        if self.shows_material && SURFACES.iter().any(|s| shown(*s)) {
            let text = "hatched: side of the material, not cut".to_owned();
            scene.legend.push(LegendEntry { mark: Mark::Area, colour: MATERIAL_SIDE, text });
        }
        if shown(ShowName::Labels) {
            scene.labels = self.labels(&colours);
        }
        if let Some(Paths { program, style }) = paths {
            let moves = program.moves.iter().filter(|m| shown(shown_as(m.kind))).cloned().collect();
            scene.add_paths(&Program { moves }, &style);
        }
        if !SURFACES.iter().any(|s| shown(*s)) {
            // Only now: paths are drawn where they touch the surfaces.
            scene.surfaces.clear();
        }
        Ok(scene)
    }

    /// The model painted by the height of the scallop crests on it.
    fn scallop_map(&self, title: &str, crests: &[CrestSample], request: &Request) -> Result<Scene, Failure> {
        let meshes = meshes(self.model, &sized(MAP_MESH, self.model));
        let mut scene = Scene::of_model(&ModelView { meshes: &meshes, ..self.view() }, Colouring::Clay)?;
        scene.lines.retain(|l| l.kind == LineKind::Regions);
        scene.caption = vec![title.to_owned()];
        scene.caption.extend(undrawn(self.model, &meshes));
        paint_scallops(&mut scene, crests, request);
        Ok(scene)
    }

    /// One picture of the regions alone.
    pub(crate) fn save_regions(
        &self,
        console: &Console,
        orientation: Orientation,
        folder: &Path,
    ) -> Result<(), Failure> {
        let Some(renderer) = renderer(console) else {
            return Ok(());
        };
        let scene = self.scene("regions", None, &PREVIEWED)?;
        let axes = axes(orientation);
        renderer.render(&scene, &View::iso(&axes), &options(&axes))?.save(&folder.join("regions.png"))?;
        Ok(())
    }
}

/// What is to be seen of a job.
pub(crate) struct Sights {
    /// Colour of each region, by its id.
    pub(crate) colours: Vec<Rgb>,
    /// Pictures for the report, the cover first; none without a graphics adapter.
    pub(crate) shots: Vec<ReportPicture>,
    /// What is to be seen on each setup's sheet.
    pub(crate) sheets: Vec<SetupSheet>,
    /// Where each region is, by its id.
    pub(crate) thumbnails: Vec<Thumbnail>,
    /// The job for the report's 3-D view, deflated.
    pub(crate) space: Vec<u8>,
}

/// Takes all pictures of a job: previews as files in `folder`, and what the report shows.
pub(super) fn take(
    console: &Console,
    renderer: Option<&Renderer>,
    finished: &Finished<'_>,
    states: &[StockState],
    folder: &Path,
) -> Result<Sights, Failure> {
    let Finished { model, job, region_of_face, program, .. } = *finished;
    let cut = cut_faces(job);
    let tolerance_mm = finished.regions.tolerance_mm;
    let album =
        Album::new(model, region_of_face, Some(&cut), tolerance_mm).with_sides(&finished.regions.sheets);
    warn_of_undrawn(console, model, &album.meshes);
    let axes = axes(finished.orientation);
    let crests = heights(finished.crests);
    let input = BrowserInput {
        model,
        region_of_face,
        cut: Some(&cut),
        joint_tolerance_mm: tolerance_mm,
        axes,
        job,
        program,
        crests: &crests,
    };
    // The adapter draws one picture after the other, and between them waits for what is to be drawn.
    std::thread::scope(|scope| {
        let space = scope.spawn(|| browser_glb(&input).map(|glb| deflated(&glb)));
        let shots = match renderer {
            Some(renderer) => {
                let mut shots = album.save_previews(console, renderer, finished, &axes, folder)?;
                let of_stock = (model, &*title(job));
                shots.extend(stages::save(console, renderer, states, of_stock, &axes, folder)?);
                shots
            }
            None => Vec::new(),
        };
        let sheets = album.sheets(console, renderer, finished, &axes)?;
        let colours = album.colours();
        let thumbnails = region_thumbnails(&album.view(), &axes, &colours);
        let space = space.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
        Ok(Sights { colours, shots, sheets, thumbnails, space })
    })
}

/// What a picture is to those who cannot see it.
fn alt(caption: &str, title: &str, view: &str) -> String {
    format!("{caption}, {title}, view {view}")
}

/// The map of scallop heights of a job that was drawn before.
pub(crate) fn kept_scallop_map(job: &Job, folder: &Path) -> Option<ReportPicture> {
    let png = read_plain(&folder.join(SCALLOP_FILE), LONGEST_MADE).ok()?;
    let alt = alt(SCALLOP_MAP, &title(job), "iso");
    Some(ReportPicture { caption: SCALLOP_MAP.to_owned(), alt, png })
}

impl Sights {
    /// The map of scallop heights.
    pub(crate) fn scallop_map(&self) -> Option<&ReportPicture> {
        self.shots.iter().find(|p| p.caption == SCALLOP_MAP)
    }
}

impl Album<'_> {
    /// The model from every setup's direction, with the passes that are cut from there.
    fn sheets(
        &self,
        console: &Console,
        renderer: Option<&Renderer>,
        finished: &Finished<'_>,
        axes: &Axes,
    ) -> Result<Vec<SetupSheet>, Failure> {
        let title = title(finished.job);
        let bare = self.scene(&title, None, &PREVIEWED)?;
        let colours = self.colours();
        let tools = &finished.job.tools;
        let style = StrokeStyle {
            region_colours: Some(&colours),
            tools,
            rapids: false,
            ..StrokeStyle::new(CHORD_MM)
        };
        let count = finished.job.setups.len();
        let sheet = |(k, setup): (usize, &Setup)| {
            console.at("setup sheets", k as f64 / count as f64);
            let axis = Vector3::from(setup.axis);
            let frame = Frame::new(axis, axes.up, axes.forward, Point3::origin());
            let along = |v: Vector3| frame.map_or(v, |f| f.to_model(&Point3::from(v)).coords);
            let picture = |renderer: &Renderer| -> Result<ReportPicture, Failure> {
                let mine = finished.program.moves.iter().filter(|m| m.setup == setup.name);
                let mut scene = bare.clone();
                scene.caption = vec![format!("{title}: setup {}", setup.name)];
                scene.legend.clear();
                scene.add_paths(&Program { moves: mine.cloned().collect() }, &style);
                // As the operator sees it: the machine's X to the right, its Y away.
                let view = View::looking(&setup.name, -axis, along(Vector3::y()));
                let options = PictureOptions { size: SHEET_SIZE, lettering: SHOWN_SMALL, ..options(axes) };
                Ok(ReportPicture {
                    caption: format!(
                        "Setup {} on the machine: X to the right, Y up, the tool towards you",
                        setup.name
                    ),
                    alt: format!("{title} seen along the tool axis of setup {}, with its passes", setup.name),
                    png: renderer.render(&scene, &view, &options)?.png(),
                })
            };
            Ok(SetupSheet {
                picture: renderer.map(picture).transpose()?,
                axes: [Vector3::x(), Vector3::y(), Vector3::z()].map(|v| along(v).into()),
            })
        };
        finished.job.setups.iter().enumerate().map(sheet).collect()
    }

    /// Writes the previews; the report shows those that its setup sheets do not.
    fn save_previews(
        &self,
        console: &Console,
        renderer: &Renderer,
        finished: &Finished<'_>,
        axes: &Axes,
        folder: &Path,
    ) -> Result<Vec<ReportPicture>, Failure> {
        let (job, title) = (finished.job, title(finished.job));
        let colours = self.colours();
        let style =
            StrokeStyle { region_colours: Some(&colours), tools: &job.tools, ..StrokeStyle::new(CHORD_MM) };
        let paths = Paths { program: finished.program, style };
        let painted = self.scene(&title, Some(paths), &PREVIEWED)?;
        let bare = self.scene(&title, None, &PREVIEWED)?;
        let heights = self.scallop_map(&title, finished.crests, &job.request)?;
        let shots = [
            ("preview-iso.png", View::iso(axes), &painted, COVER),
            ("preview-top.png", View::top(axes), &painted, "Tool paths from above"),
            ("preview-side.png", View::left(axes), &painted, "Tool paths from the left"),
            ("regions-iso.png", View::iso(axes), &bare, "Regions: each colour is cut as one surface"),
            (SCALLOP_FILE, View::iso(axes), &heights, SCALLOP_MAP),
        ];
        let mut pictures = Vec::new();
        for (k, (file, view, scene, caption)) in shots.iter().enumerate() {
            console.at("pictures", k as f64 / 5.0);
            let lettering = if *caption == COVER { 1.0 } else { SHOWN_SMALL };
            let picture = renderer.render(scene, view, &PictureOptions { lettering, ..options(axes) })?;
            pictures.push((file, view, caption, picture));
        }
        let save = |(file, view, caption, picture): (&&str, &View, &&str, Picture)| {
            let png = picture.save(&folder.join(file))?;
            let alt = alt(caption, &title, &view.name);
            let shown = !SHOWN_ON_SHEETS.contains(file);
            Ok(shown.then(|| ReportPicture { caption: (*caption).to_owned(), alt, png }))
        };
        let saved: Vec<Option<ReportPicture>> =
            pictures.into_par_iter().map(save).collect::<Result<_, Failure>>()?;
        Ok(saved.into_iter().flatten().collect())
    }
}

/// Triangles for a whole vehicle, made for a smaller model: as fine in its picture.
fn sized(options: MeshOptions, model: &Model) -> MeshOptions {
    let net = model.faces.iter().flat_map(|f| f.surface.net()).map(|p| Point3::from(p.xyz() / p.w));
    let size_mm = net.fold(Aabb::empty(), |mut b, p| {
        b.add(&p);
        b
    });
    let part = if size_mm.is_empty() { 1.0 } else { (size_mm.diagonal() / VEHICLE_MM).clamp(1e-3, 1.0) };
    MeshOptions { deviation_mm: part * options.deviation_mm, longest_edge_mm: part * options.longest_edge_mm }
}

/// What is said of faces without triangles; `None` where there are none.
fn undrawn(model: &Model, meshes: &[FaceMesh]) -> Option<String> {
    let bare: Vec<usize> = (0..meshes.len()).filter(|&f| meshes[f].triangles.is_empty()).collect();
    let named = bare.iter().take(NAMED).map(|&face| match model.faces[face].source.entity.as_str() {
        "" => face.to_string(),
        entity => format!("{face} ({entity})"),
    });
    let mut names = named.collect::<Vec<_>>().join(", ");
    if bare.len() > NAMED {
        names = format!("{names} and {} more", bare.len() - NAMED);
    }
    (!bare.is_empty()).then(|| format!("not drawn: face{} {names}", if bare.len() == 1 { "" } else { "s" }))
}

/// Says which faces pictures leave out.
pub(crate) fn warn_of_undrawn(console: &Console, model: &Model, meshes: &[FaceMesh]) {
    if let Some(undrawn) = undrawn(model, meshes) {
        console.say(format!("warning: {undrawn}: it could not be triangulated"));
    }
}

/// A face that cannot be triangulated is left out of the picture, which says so, and not of the job.
pub(crate) fn meshes(model: &Model, options: &MeshOptions) -> Vec<FaceMesh> {
    model.faces.par_iter().map(|face| tessellate(face, options).unwrap_or_default()).collect()
}

fn shown_as(kind: MoveKind) -> ShowName {
    match kind {
        MoveKind::Cut => ShowName::Cut,
        MoveKind::Link => ShowName::Link,
        MoveKind::LeadIn | MoveKind::LeadOut => ShowName::Lead,
        MoveKind::Rapid => ShowName::Rapid,
    }
}

/// Which faces of a job are cut by more than a rim.
pub(crate) fn cut_faces(job: &Job) -> Vec<bool> {
    job.faces.iter().map(|f| f.area.cut_mm2 > 0.02 * f.area.total_mm2).collect()
}

/// The viewer's axes.
pub(crate) fn axes(orientation: Orientation) -> Axes {
    Axes { up: orientation.up.vector(), forward: orientation.front.vector() }
}

pub(crate) fn options(axes: &Axes) -> PictureOptions {
    PictureOptions { sky: axes.up, ..PictureOptions::default() }
}

/// The renderer, or a warning: a job is not worth less without pictures.
pub(super) fn renderer(console: &Console) -> Option<Renderer> {
    Renderer::new().map_err(|e| console.say(format!("warning: no pictures: {e}"))).ok()
}

/// Paints a scene by the height of the scallop crests on it, and says so.
pub(crate) fn paint_scallops(scene: &mut Scene, crests: &[CrestSample], request: &Request) {
    scene.paint_heights(&heights(crests), &HeatScale::of_request(request));
    scene.caption.push(format!("scallop height, {} mm asked for", request.scallop_mm));
}

/// Places of crests with their heights, as pictures take them.
fn heights(crests: &[CrestSample]) -> Vec<(Point3, f64)> {
    crests.iter().map(|c| (c.foot, c.height_mm)).collect()
}
