//! A second look at what was read, which does not share the reader's way of putting loops on surfaces.
//!
//! ```text
//!   the file's edges ── ∮ around each bound ──► area that they enclose ─┐
//!                                                                      ├─ FaceReading: agreed, in doubt, or not judged
//!   the Face that was made ── its own loops and area ──────────────────┘
//! ```
//!
//! Planner and verifier use the same faces: a hole that is lost here is lost for both. So every face is asked
//! what its bounds say, by integrals along the edges that the file gives and by nothing else: no loop is laid out, no
//! direction believed where nesting decides, no parameter plane used. What is shared with the reader is reading of
//! entities and evaluation of curves.

mod areas;
mod flat;
mod ring;

use claymill_nurbs::{Curve2, Face, FaceArea, NurbsSurface, Vector3};
use serde::{Deserialize, Serialize};

pub(crate) use areas::Carrier;
pub(crate) use ring::{Node, Ring, over, parts};

/// Areas agree within this part ...
const AREA: f64 = 1e-5;
/// ... and what edges make of it that are off by this, beside what the file's own miss their surface by, mm. Trim curves
/// are fitted so closely.
const OFF_MM: f64 = 2e-4;
/// The same where it is not known by how much the file's edges miss their surface (or the file's tolerance, if larger), mm.
const OFF_ANY_MM: f64 = 0.01;
/// A surface is flat when its control points are in one plane to this part of its size.
const FLAT: f64 = 1e-9;

/// What a file says of a face, and what was read of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FaceReading {
    /// The entity in the file: `DE 4711`, `#4711`.
    pub entity: String,
    /// Bounds (outer loop and holes) that the file gives the face.
    pub bounds_in_file: usize,
    /// Trim loops of the face that was read; none where it is its whole surface.
    pub loops_read: usize,
    /// The area that the file's own edges enclose, mm²; `None` where the surface is no plane, cylinder, cone, sphere
    /// or torus, or a curve cannot be followed.
    pub area_in_file_mm2: Option<f64>,
    /// The area of the face that was read, mm².
    pub area_read_mm2: f64,
    /// Relative accuracy of that area, usually 1e-8; `None` where the surface is so uneven that it is a guess.
    pub area_accuracy: Option<f64>,
    /// How the two disagree; `None` where they agree, or the file does not tell.
    pub doubt: Option<String>,
}

/// The bounds of a face as the file gives them, mm, in the model's place.
#[derive(Debug, Default)]
pub(crate) struct Bounds {
    /// How many the file lists, with those that are a vertex.
    pub(crate) listed: usize,
    /// Those that have edges; `None` where a curve cannot be followed.
    pub(crate) rings: Option<Vec<Ring>>,
    /// Those that have edges, in the parameter plane of the face's own surface; `None` where the file has them not.
    pub(crate) flats: Option<Vec<Vec<Curve2>>>,
    /// What they lie on, where that is known.
    pub(crate) carrier: Option<Carrier>,
    /// Whether the face's outside is the carrier's.
    pub(crate) sense: bool,
    /// Whether the bounds run with the face on their left.
    pub(crate) directed: bool,
    /// Whether the model has the face turned over.
    pub(crate) turned: bool,
}

/// Holds a face against the bounds that its file gives it.
pub(crate) fn reading(face: &Face, bounds: &Bounds, tolerance_mm: f64) -> FaceReading {
    let FaceArea { mm2: area, accuracy } = face.area();
    let rings = bounds.rings.as_deref();
    let planar = || plane(&face.surface).map(|normal| Carrier::Plane { normal });
    let carrier = bounds.carrier.or_else(planar);
    let areas = match (rings.zip(carrier), &bounds.flats) {
        (Some((rings, carrier)), _) => carrier.enclosed(rings, bounds.sense),
        (None, Some(flats)) => {
            let enclosed = flats.iter().map(|bound| flat::enclosed(&face.surface, bound));
            areas::largest_less_the_rest(enclosed).into_iter().collect()
        }
        (None, None) => Vec::new(),
    };
    let length: f64 = rings.iter().copied().flatten().map(Ring::length).sum();
    let off_mm = match carrier.zip(rings) {
        Some((carrier, rings)) => OFF_MM + carrier.farthest(rings),
        None => OFF_ANY_MM.max(tolerance_mm),
    };
    let within = |a: f64| (a - area).abs() <= AREA * area + off_mm * length;
    let nearest = areas.iter().copied().min_by(|a, b| (a - area).abs().total_cmp(&(b - area).abs()));
    let doubt = match (nearest, rings) {
        (Some(in_file), _) if !within(in_file) => {
            Some(format!("its bounds enclose {in_file:.4} mm² in the file, {area:.4} mm² were read"))
        }
        (Some(_), Some(rings)) if matches!(carrier, Some(Carrier::Plane { .. })) => {
            let in_file = rings.iter().filter(|r| r.vector_area().norm() > crate::DEGENERATE_MM2).count();
            // The whole surface needs no loop.
            let read = face.loops.len().max(1);
            (in_file > read).then(|| format!("it has {in_file} bounds in the file, {read} were read"))
        }
        (None, Some(rings)) if bounds.directed && !rings.is_empty() => {
            let in_file = rings.iter().map(Ring::vector_area).sum::<Vector3>();
            let read =
                if face.reversed == bounds.turned { face.vector_area_mm2() } else { -face.vector_area_mm2() };
            let off = (in_file - read).norm();
            (off > AREA * read.norm() + off_mm * length).then(|| {
                format!(
                    "its bounds enclose another part of the surface: seen from the side they differ by {off:.4} mm²"
                )
            })
        }
        _ => None,
    };
    FaceReading {
        entity: face.source.entity.clone(),
        bounds_in_file: bounds.listed,
        loops_read: face.loops.len(),
        area_in_file_mm2: nearest,
        area_read_mm2: area,
        area_accuracy: accuracy.is_finite().then_some(accuracy),
        doubt,
    }
}

/// The normal of a surface that is flat; `None` of others.
fn plane(surface: &NurbsSurface) -> Option<Vector3> {
    let net: Vec<_> = surface.net().iter().map(|h| h.xyz() / h.w).collect();
    let from = net.first()?;
    let far = net.iter().map(|p| p - from).max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    let across = net.iter().map(|p| far.cross(&(p - from))).max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    let normal = across.try_normalize(0.0)?;
    net.iter().all(|p| (p - from).dot(&normal).abs() <= FLAT * far.norm()).then_some(normal)
}
