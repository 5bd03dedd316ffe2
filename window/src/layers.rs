//! What is shown and in which colours.

use claymill_toolpath::{Move, MoveKind, UncutReason};
use claymill_viewer::{
    CLAY, Colouring, HeatScale, NOT_CUT, Rgb, Scene, face_colours, kind_colour, region_palette, stroke_shade,
};

use crate::exhibit::{Exhibit, JobToShow};
use crate::joints::{JointClass, Seam};

/// What decides the colour of the surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Paint {
    /// A colour a region.
    Regions,
    /// Clay.
    Clay,
    /// The colours of the file.
    File,
    /// Measured scallop height.
    Scallop,
    /// The material left at the time shown.
    Stock,
    /// How much of each face is cut, and why the rest is not.
    Coverage,
}

/// What decides the colour of the passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PathPaint {
    /// A dark shade of the region's colour.
    Region,
    /// A colour a kind of move.
    Kind,
    /// Slow to fast.
    Feed,
    /// A colour a setup.
    Setup,
}

/// Kinds of moves as layers.
pub(crate) const KINDS: [(&str, &[MoveKind]); 4] = [
    ("Cut", &[MoveKind::Cut]),
    ("Links", &[MoveKind::Link]),
    ("Leads", &[MoveKind::LeadIn, MoveKind::LeadOut]),
    ("Rapids", &[MoveKind::Rapid]),
];

/// Colours of faces by what became of them.
pub(crate) const CUT: Rgb = [156, 196, 170];
/// No tool direction reaches it.
pub(crate) const HIDDEN: Rgb = NOT_CUT;
/// The ball does not fit.
pub(crate) const TOO_TIGHT: Rgb = [222, 142, 60];
/// Left out on request.
pub(crate) const EXCLUDED: Rgb = [150, 140, 190];

/// The state of the layer tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers {
    /// The surfaces.
    pub surfaces: bool,
    /// Their colours.
    pub paint: Paint,
    /// Stripes mirrored in them.
    pub zebra: bool,
    /// Regions, by id.
    pub regions: Vec<bool>,
    /// Joints, as [`JointClass::ALL`] lists them.
    pub seams: [bool; 5],
    /// Tool paths: cuts, links, leads, rapids.
    pub kinds: [bool; 4],
    /// Colours of the passes.
    pub path_paint: PathPaint,
    /// Setups, in machining order.
    pub setups: Vec<bool>,
    /// Places of findings.
    pub marks: bool,
    /// The tool where it is at the time.
    pub tool: bool,
}

impl Layers {
    pub(crate) fn new(exhibit: &Exhibit) -> Self {
        let count = exhibit.region_of_face.iter().max().map_or(0, |m| m + 1);
        let setups = exhibit.job.as_ref().map_or(0, |j| j.job.setups.len());
        Layers {
            surfaces: true,
            paint: Paint::Regions,
            zebra: false,
            regions: vec![true; count],
            seams: [true, false, false, false, true],
            kinds: [true, true, false, false],
            path_paint: PathPaint::Region,
            setups: vec![true; setups],
            marks: false,
            tool: true,
        }
    }

    /// Whether a face is shown.
    #[must_use]
    pub fn shows_face(&self, exhibit: &Exhibit, face: usize) -> bool {
        self.surfaces && self.regions.get(exhibit.region_of_face[face]).is_none_or(|r| *r)
    }

    /// Whether a seam is shown.
    #[must_use]
    pub fn shows_seam(&self, exhibit: &Exhibit, seam: &Seam) -> bool {
        let on = JointClass::ALL.iter().zip(&self.seams).any(|(c, on)| *c == seam.class && *on);
        let face = |f: usize| self.regions.get(exhibit.region_of_face[f]).is_none_or(|r| *r);
        on && (face(seam.faces.0) || seam.faces.1.is_some_and(face))
    }

    /// Whether a move is shown.
    #[must_use]
    pub fn shows_move(&self, shown: &JobToShow, m: &Move) -> bool {
        let kind = KINDS.iter().zip(&self.kinds).any(|((_, kinds), on)| *on && kinds.contains(&m.kind));
        let setup = shown.job.setups.iter().position(|s| s.name == m.setup);
        kind && setup.and_then(|s| self.setups.get(s)).is_none_or(|on| *on)
            && self.regions.get(m.region).is_none_or(|on| *on)
    }
}

/// Colour and width of a line; no opacity, no line.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct LineLook {
    pub(crate) rgba: [u8; 4],
    /// Sixteenths of a pixel.
    pub(crate) width: u32,
}

impl LineLook {
    pub(crate) const NONE: LineLook = LineLook { rgba: [0; 4], width: 0 };

    pub(crate) fn new(colour: Rgb, opacity: f32, width_px: f32) -> Self {
        let [r, g, b] = colour;
        LineLook { rgba: [r, g, b, (opacity * 255.0).round() as u8], width: (width_px * 16.0).round() as u32 }
    }
}

/// Colour of a class of joints, in the order of the Okabe-Ito set where it matters.
#[must_use]
pub(crate) fn class_colour(class: JointClass, dark: bool) -> Rgb {
    match class {
        JointClass::Border if dark => [236, 238, 242],
        JointClass::Border => [24, 26, 32],
        JointClass::Sharp => [213, 94, 0],
        JointClass::Tangent => [204, 121, 167],
        JointClass::Curvature => [0, 114, 178],
        JointClass::Open => [214, 30, 36],
    }
}

/// How each seam is drawn.
pub(crate) fn seam_looks(exhibit: &Exhibit, seams: &[Seam], layers: &Layers) -> Vec<LineLook> {
    let look = |seam: &Seam| match (layers.shows_seam(exhibit, seam), seam.class) {
        (false, _) => LineLook::NONE,
        (true, JointClass::Border) => LineLook::new(class_colour(seam.class, false), 1.0, 1.8),
        (true, JointClass::Curvature) => LineLook::new(class_colour(seam.class, false), 0.75, 1.1),
        (true, class) => LineLook::new(class_colour(class, false), 1.0, 1.8),
    };
    seams.iter().map(look).collect()
}

/// How each move is drawn.
pub(crate) fn move_looks(shown: &JobToShow, colours: &[Rgb], layers: &Layers) -> Vec<LineLook> {
    let feeds = shown.program.moves.iter().filter(|m| m.kind != MoveKind::Rapid).map(|m| m.feed);
    let (slow, fast) = (feeds.clone().fold(f64::INFINITY, f64::min), feeds.fold(0.0, f64::max));
    let look = |m: &Move| {
        if !layers.shows_move(shown, m) {
            return LineLook::NONE;
        }
        let colour = match (layers.path_paint, m.kind) {
            (PathPaint::Region, MoveKind::Cut) => {
                colours.get(m.region).map_or(kind_colour(m.kind), |c| stroke_shade(*c))
            }
            (PathPaint::Setup, MoveKind::Cut) => {
                let setup = shown.job.setups.iter().position(|s| s.name == m.setup).unwrap_or(0);
                setup_colour(setup)
            }
            (PathPaint::Feed, kind) if kind != MoveKind::Rapid => {
                feed_colour((m.feed - slow) / (fast - slow).max(1e-9))
            }
            _ => kind_colour(m.kind),
        };
        let width_px = if m.kind == MoveKind::Cut { 1.5 } else { 1.3 };
        LineLook::new(colour, if m.kind == MoveKind::Rapid { 0.7 } else { 1.0 }, width_px)
    };
    shown.program.moves.iter().map(look).collect()
}

/// Colour of the passes of a setup.
#[must_use]
pub(crate) fn setup_colour(setup: usize) -> Rgb {
    let palette = region_palette();
    stroke_shade(palette[setup % palette.len()])
}

/// Colour of a feed between the slowest and the fastest.
#[must_use]
pub(crate) fn feed_colour(share: f64) -> Rgb {
    let (slow, fast) = ([176.0, 38.0, 60.0], [18.0, 96.0, 150.0]);
    let x = share.clamp(0.0, 1.0);
    [0, 1, 2].map(|i: usize| (slow[i] + (fast[i] - slow[i]) * x) as u8)
}

/// Paints the surfaces of `scene`, whose vertices are those of the faces' meshes in order.
pub(crate) fn paint(
    scene: &mut Scene,
    exhibit: &Exhibit,
    paint: Paint,
    heights: Option<(&[(claymill_nurbs::Point3, f64)], HeatScale)>,
) {
    if let (Paint::Scallop, Some((heights, scale))) = (paint, heights) {
        scene.legend.clear();
        scene.paint_heights(heights, &scale);
        return;
    }
    let colours = match paint {
        Paint::Regions => face_colours(&exhibit.view(None), Colouring::Region),
        Paint::File => face_colours(&exhibit.view(None), Colouring::File),
        Paint::Coverage => exhibit.job.as_ref().map_or_else(Vec::new, coverage_colours),
        Paint::Clay | Paint::Scallop | Paint::Stock => Vec::new(),
    };
    let mut vertices = scene.surfaces.iter_mut().flat_map(|s| &mut s.vertices);
    for (face, mesh) in exhibit.meshes.iter().enumerate() {
        let [r, g, b] = colours.get(face).copied().unwrap_or(CLAY);
        for v in vertices.by_ref().take(mesh.points.len()) {
            v.colour = [r, g, b, v.colour[3]];
        }
    }
}

/// Between cut and the chief reason why not, by the share of the area.
fn coverage_colours(shown: &JobToShow) -> Vec<Rgb> {
    let colour = |f: &claymill_toolpath::FaceAccount| {
        let chief = f.area.uncut_mm2.iter().max_by(|a, b| a.1.total_cmp(b.1));
        let uncut = match chief.map(|c| c.0) {
            Some(UncutReason::TooTight) => TOO_TIGHT,
            Some(
                UncutReason::Excluded
                | UncutReason::EarlierTool
                | UncutReason::OutOfBounds
                | UncutReason::NotCovered
                | UncutReason::Roughed,
            ) => EXCLUDED,
            Some(UncutReason::Hidden) | None => HIDDEN,
        };
        let share = if f.area.total_mm2 > 0.0 { f.area.cut_mm2 / f.area.total_mm2 } else { 0.0 };
        let mixed = |i: usize| f64::from(CUT[i]) * share + f64::from(uncut[i]) * (1.0 - share);
        [0, 1, 2].map(|i| mixed(i).round() as u8)
    };
    shown.job.faces.iter().map(colour).collect()
}
