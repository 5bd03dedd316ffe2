//! What a scene is made of: triangles, polylines and names, as plain data.

use claymill_nurbs::Point3;

use crate::palette::Rgb;

/// A vertex of a shaded surface, as the graphics card reads it.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct SurfaceVertex {
    /// Position relative to [`crate::Scene::origin`], mm.
    pub position: [f32; 3],
    /// Unit normal, `Su × Sv` side.
    pub normal: [f32; 3],
    /// sRGB, and whether one of the two sides is drawn as that of the material: [`BOTH_SIDES`], [`FREE_ALONG`] or
    /// [`FREE_AGAINST`].
    pub colour: [u8; 4],
}

/// Both sides of a surface are alike.
pub const BOTH_SIDES: u8 = 255;
/// The side that the normal does not point to is the material's.
pub const FREE_ALONG: u8 = 254;
/// The side that the normal points to is the material's.
pub const FREE_AGAINST: u8 = 253;

/// Triangles that share one vertex buffer.
#[derive(Debug, Clone, Default)]
pub struct SurfaceMesh {
    /// The vertices.
    pub vertices: Vec<SurfaceVertex>,
    /// Corners of the triangles, three each.
    pub indices: Vec<u32>,
}

/// One polyline of a [`LineLayer`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strip {
    /// Its points are `points[first..first + count]` of the layer.
    pub first: usize,
    /// Number of points.
    pub count: usize,
    /// Colour.
    pub colour: Rgb,
    /// Pass number, for layers that thin out passes: strips in a row with the same number belong together.
    pub pass: u32,
}

/// What the lines of a layer are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum LineKind {
    /// Lines of the caller's own.
    #[default]
    Other,
    /// Joints between patches of one region.
    Patches,
    /// Outlines of regions.
    Regions,
    /// Rapid moves.
    Rapid,
    /// Moves onto and off the model.
    Lead,
    /// Moves between passes, down on the model.
    Link,
    /// Cutting moves.
    Cut,
}

/// Polylines of one kind. Layers are drawn in order, later ones over earlier ones.
#[derive(Debug, Clone, Default)]
pub struct LineLayer {
    /// What they are.
    pub kind: LineKind,
    /// Points of all strips relative to [`crate::Scene::origin`], mm.
    pub points: Vec<[f32; 3]>,
    /// The strips.
    pub strips: Vec<Strip>,
    /// Line width, pixels.
    pub width_px: f32,
    /// Size of a dot at each point, pixels, where points are farther apart than a few dots; 0: none.
    pub dots_px: f32,
    /// 1 covers, 0 is invisible.
    pub opacity: f32,
    /// Whether strips of different passes are thinned out where they would come closer together in the
    /// picture than [`crate::CLOSEST_PASSES_PX`]; else all are drawn.
    pub thinned: bool,
}

/// The name of some faces of a scene that was made of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    /// The name.
    pub text: String,
    /// Colour of its frame and of its line.
    pub colour: Rgb,
    /// The faces, by their number in the model.
    pub faces: Vec<usize>,
}

impl LineLayer {
    /// Appends a polyline; fewer than two points are nothing to draw.
    pub fn add<'a>(
        &mut self,
        points: impl Iterator<Item = &'a Point3>,
        origin: &Point3,
        colour: Rgb,
        pass: u32,
    ) {
        let first = self.points.len();
        self.points.extend(points.map(|p| relative(p, origin)));
        let count = self.points.len() - first;
        if count < 2 {
            self.points.truncate(first);
            return;
        }
        self.strips.push(Strip { first, count, colour, pass });
    }
}

/// A place relative to the origin of a scene, in single precision.
pub(crate) fn relative(p: &Point3, origin: &Point3) -> [f32; 3] {
    let q = p - origin;
    [q.x as f32, q.y as f32, q.z as f32]
}
