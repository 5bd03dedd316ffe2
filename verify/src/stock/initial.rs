//! What a program starts from: block, cylinder, closed mesh, or a model with a layer on it.

use claymill_nurbs::{Aabb, MeshOptions, Model, Point3, Vector3};

use super::error::{FARTHEST_MM, StockError, placed, sized};
use super::layer_stock::LayerStock;
use super::mesh_stock::MeshStock;

/// The stock before the first move, with exact membership.
///
/// ```
/// use claymill_nurbs::Point3;
/// use claymill_verify::stock::InitialStock;
/// let block = InitialStock::block(Point3::origin(), Point3::new(100.0, 60.0, 20.0))?;
/// assert!(block.contains(&Point3::new(50.0, 30.0, 19.9)));
/// assert_eq!(block.signed_mm(&Point3::new(50.0, 30.0, 25.0)), 5.0);
/// # Ok::<(), claymill_verify::stock::StockError>(())
/// ```
pub struct InitialStock<'a>(Kind<'a>);

enum Kind<'a> {
    Block(Aabb),
    Cylinder { foot: Point3, axis: Vector3, radius: f64, length: f64 },
    Mesh(Box<MeshStock>),
    Layer(Box<LayerStock<'a>>),
}

/// How a box lies to the stock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoxInStock {
    /// No point of it is stock.
    Outside,
    /// All of it is stock.
    Inside,
    /// Not known without dividing it.
    Undecided,
}

/// Where the region below a model ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Table {
    /// The way down, of any length: from the tool into the material.
    pub down: Vector3,
    /// Height of the table along `−down`, as a unit vector, from the origin; mm. Nothing below is stock.
    pub height_mm: f64,
}

/// A stop of [`InitialStock::last_inside`]: closer than this to the surface is on it, mm.
const ON_SURFACE_MM: f64 = 1e-9;
/// Steps of [`InitialStock::last_inside`].
const MOST_STEPS: u32 = 4096;

impl<'a> InitialStock<'a> {
    /// An upright block between two corners, mm.
    ///
    /// # Errors
    /// Coordinates are not finite or beyond 1e6 mm; the block has no volume.
    pub fn block(low: Point3, high: Point3) -> Result<Self, StockError> {
        placed("corner of a block, mm,", low.coords.as_slice())?;
        placed("corner of a block, mm,", high.coords.as_slice())?;
        for k in 0..3 {
            sized("side of a block, mm,", high[k] - low[k], 1e-6, FARTHEST_MM)?;
        }
        Ok(InitialStock(Kind::Block(Aabb { min: low, max: high })))
    }

    /// A cylinder from the centre of its lower end along an axis of any length, mm.
    ///
    /// # Errors
    /// A number is not finite or no size; the axis has no length.
    pub fn cylinder(foot: Point3, axis: Vector3, radius_mm: f64, length_mm: f64) -> Result<Self, StockError> {
        placed("centre of a cylinder, mm,", foot.coords.as_slice())?;
        let axis = direction("the axis of a cylinder", &axis)?;
        let radius = sized("radius of a cylinder, mm,", radius_mm, 1e-6, FARTHEST_MM)?;
        let length = sized("length of a cylinder, mm,", length_mm, 1e-6, FARTHEST_MM)?;
        Ok(InitialStock(Kind::Cylinder { foot, axis, radius, length }))
    }

    /// What a closed mesh encloses: points about which it winds at least once, so that solids which run into each other are
    /// their union. Vertices at the same place count as one.
    ///
    /// # Errors
    /// No triangles, an edge without counterpart, a vertex that is not there or not finite.
    pub fn mesh(points: &[Point3], triangles: &[[u32; 3]]) -> Result<Self, StockError> {
        Ok(InitialStock(Kind::Mesh(Box::new(MeshStock::new(points, triangles)?))))
    }

    /// A model with a layer on it. A point is stock
    /// - if it is no farther than `layer_mm` from a face, on either side; this is exact;
    /// - or, with a table, if it is above the table and a line from it straight up meets a face. For this faces stand as
    ///   triangles within `mesh.deviation_mm`, so that with a layer at least as thick only the border of what lies below an
    ///   edge of the model is known to no better than that.
    ///
    /// Without a table open sheets are stock as thick as the layer on both sides and nothing else.
    ///
    /// # Errors
    /// The layer is not between 0 and 1e4 mm, the way down has no length, no face has triangles.
    pub fn layer(
        model: &'a Model,
        layer_mm: f64,
        table: Option<Table>,
        mesh: &MeshOptions,
    ) -> Result<Self, StockError> {
        sized("layer on the model, mm,", layer_mm, 0.0, 1e4)?;
        let table = match table {
            None => None,
            Some(Table { down, height_mm }) => {
                placed("height of the table, mm,", &[height_mm])?;
                Some((-direction("the way down", &down)?, height_mm))
            }
        };
        Ok(InitialStock(Kind::Layer(Box::new(LayerStock::new(model, layer_mm, table, mesh)?))))
    }

    /// Whether a point is stock, the surface included.
    #[must_use]
    pub fn contains(&self, p: &Point3) -> bool {
        match &self.0 {
            Kind::Mesh(mesh) => mesh.contains(p),
            Kind::Layer(layer) => layer.contains(p),
            _ => self.signed_mm(p) <= 0.0,
        }
    }

    /// A signed distance, mm: negative inside, never more than the true distance on either side, and never changing faster than the
    /// point moves. Exact for meshes; for block and cylinder exact but beside edges and corners outside.
    #[must_use]
    pub fn signed_mm(&self, p: &Point3) -> f64 {
        match &self.0 {
            Kind::Block(b) => (b.min - p).sup(&(p - b.max)).max(),
            Kind::Cylinder { foot, axis, radius, length } => {
                let w = p - foot;
                let height = w.dot(axis);
                ((w - axis * height).norm() - radius).max(-height).max(height - length)
            }
            Kind::Mesh(mesh) => mesh.signed_mm(p),
            Kind::Layer(layer) => layer.signed_mm(p),
        }
    }

    /// How the box lies to the stock: by the box around that, and by the signed distance of its middle.
    #[must_use]
    pub fn over_box(&self, b: &Aabb) -> BoxInStock {
        let around = self.bounds();
        if (0..3).any(|k| b.min[k] > around.max[k] || b.max[k] < around.min[k]) {
            return BoxInStock::Outside;
        }
        let (middle, half) = (self.signed_mm(&b.centre()), 0.5 * b.diagonal());
        if middle > half {
            BoxInStock::Outside
        } else if middle < -half {
            BoxInStock::Inside
        } else {
            BoxInStock::Undecided
        }
    }

    /// Its volume where that is known in closed form (block and cylinder), mm³.
    #[must_use]
    pub fn exact_volume_mm3(&self) -> Option<f64> {
        match &self.0 {
            Kind::Block(b) => Some((b.max - b.min).product()),
            Kind::Cylinder { radius, length, .. } => Some(std::f64::consts::PI * radius * radius * length),
            Kind::Mesh(_) | Kind::Layer(_) => None,
        }
    }

    /// A box around all stock.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        match &self.0 {
            Kind::Block(b) => *b,
            Kind::Cylinder { foot, axis, radius, length } => {
                let aside = axis.map(|a| (1.0 - a * a).max(0.0).sqrt() * radius);
                let ends = [*foot, foot + axis * *length];
                Aabb { min: ends[0].inf(&ends[1]) - aside, max: ends[0].sup(&ends[1]) + aside }
            }
            Kind::Mesh(mesh) => mesh.bounds(),
            Kind::Layer(layer) => layer.bounds(),
        }
    }

    /// The largest `t` between two limits at which `p + t·n` (`n` a unit vector) is stock; `None` if it is nowhere. Exact to 1e-9 mm
    /// but where the line runs along the surface: after 4096 steps it is taken to be there, which is too much rather than too
    /// little.
    #[must_use]
    pub fn last_inside(&self, p: &Point3, n: &Vector3, [low, high]: [f64; 2]) -> Option<f64> {
        let mut t = high;
        for _ in 0..MOST_STEPS {
            if t < low {
                return None;
            }
            let away = self.signed_mm(&(p + n * t));
            if away <= ON_SURFACE_MM {
                return Some(t);
            }
            t -= away;
        }
        Some(t)
    }
}

impl std::fmt::Debug for InitialStock<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kind = match &self.0 {
            Kind::Block(_) => "block",
            Kind::Cylinder { .. } => "cylinder",
            Kind::Mesh(_) => "mesh",
            Kind::Layer(_) => "layer",
        };
        f.debug_struct("InitialStock").field("kind", &kind).field("bounds", &self.bounds()).finish()
    }
}

/// The unit vector of a direction.
fn direction(what: &'static str, v: &Vector3) -> Result<Vector3, StockError> {
    let size = v.norm();
    if size.is_finite() && size > 1e-9 { Ok(v / size) } else { Err(StockError::Direction(what)) }
}
