//! A part made from a bar on a rotary axis: the axis, the angles, and the supports that hold it until it is severed.
//!
//! ```text
//!      z, the tool                         the part moves into the machine's frame: x is the rotary axis, and all of
//!      │     ┌──────────┐                  the work lies at x < 0, with the chuck's jaws at x = 0
//!   ═══╪═════│   part   │═════╪═══ x       a support is a cylinder from inside of the part to the bar that is left
//!   bar  support 2       support 1  bar
//! ```

use claymill_contact::{Axis, Frame};
use claymill_nurbs::analytic::{Frame as Placement, cylinder};
use claymill_nurbs::{Aabb, Face, Model, Point3, Source, SurfaceKind, Vector3};
use claymill_paths::{Orientation, open_borders};
use claymill_reach::{
    AxisView, Load, Part, ReachError, Sample, Seen, Shaft, Slices, Stiffness, axis_views, best_axis, supports,
};
use claymill_toolpath::{FreeSide, Monitor, Stock, Tool};
use rayon::prelude::*;

use crate::material::free_sides;
use crate::merged::Merged;
use crate::model_file::ModelFile;
use crate::prototype_error::PrototypeError;
use crate::reach::{DirectionsFrom, ReachAsked, ReachFound, of_part, part};

/// What is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct PrototypeAsked {
    /// Tool, holder, forced angles and share; the axis, where one is asked for.
    pub reach: ReachAsked,
    /// Diameter of the bar, mm; the smallest that will do if `None`.
    pub bar_mm: Option<f64>,
    /// The tool that roughs, if any does.
    pub rough: Option<Tool>,
    /// What the bar is made of.
    pub stiffness: Stiffness,
    /// Cutting force across the axis, N.
    pub force_n: f64,
    /// The part's tolerance, mm.
    pub tolerance_mm: f64,
    /// What fits between the chucks, mm.
    pub longest_mm: f64,
}

/// A part with all that holds it.
#[derive(Debug)]
pub struct Prototype {
    /// The axes that were looked at.
    pub axes: Vec<AxisView>,
    /// The chosen one, in the model's coordinates.
    pub axis: AxisView,
    /// Diameter of the bar, mm.
    pub bar_mm: f64,
    /// Length of the bar between the chucks, mm.
    pub length_mm: f64,
    /// The angles, and the proof that fewer do not suffice, in the machine's frame.
    pub found: ReachFound,
    /// Sizes of part and supports.
    pub shaft: Shaft,
    /// Where the supports are: their middle line in y and z, and their ends along x, mm.
    pub supports: [SupportPlace; 2],
    /// The part in the machine's frame, and the supports as faces after those of the part.
    pub model: Model,
    /// Faces of the part that are reached in part or not at all, with the area left, mm².
    pub left: Vec<(usize, f64, Seen)>,
}

/// A support in the machine's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupportPlace {
    /// Its middle line, mm.
    pub middle: [f64; 2],
    /// Its radius, mm.
    pub radius_mm: f64,
    /// Where it begins inside of the part and where the bar goes on, mm.
    pub ends_mm: [f64; 2],
}

impl PrototypeAsked {
    /// Radius of the thickest of its tools, mm.
    #[must_use]
    pub fn thickest_mm(&self) -> f64 {
        self.rough.iter().map(Tool::widest_mm).fold(self.reach.tool.widest_mm(), f64::max)
    }
}

/// No more than this share of the surface may be seen from no angle.
const UNSEEN_SHARE: f64 = 5e-3;
/// A support begins so deep in the part, as a share of its length.
const DEPTH_SHARE: f64 = 0.03;
/// Of the room for a support at most so much is used: the part's own faces around it stay.
const ROOM_SHARE: f64 = 0.8;
/// Supports are so much longer than the tool is thick: it passes all around the part's ends.
const BEYOND_TOOL: f64 = 1.2;
/// Sections in which the part's thickness is looked for.
const SECTIONS: usize = 16;
/// Triangles keep within this share of the part's length.
const DEVIATION_SHARE: f64 = 2e-4;
const X: Axis = Axis { index: 0, negative: false };
const Z: Axis = Axis { index: 2, negative: false };

/// Finds how to make a part from a bar.
///
/// # Errors
/// Why it cannot be made so, with the faces or sizes that are in the way; or the monitor ends it.
pub fn prototype(
    file: &ModelFile,
    merged: &Merged,
    asked: &PrototypeAsked,
    monitor: &dyn Monitor,
) -> Result<Prototype, PrototypeError> {
    let excluded = vec![false; file.model().faces.len()];
    let free = free_sides(&merged.record.sheets, file.model().faces.len());
    let open = open_borders(&merged.found);
    let whole = part(file, &free, &open, &excluded);
    let axes = match asked.reach.from {
        DirectionsFrom::Rotary(axis) => axis_views(&whole, &[axis], monitor)?,
        _ => axis_views(&whole, &[0, 1, 2].map(|index| Axis { index, negative: false }), monitor)?,
    };
    let axis = best_axis(&axes).cloned().ok_or(ReachError::Nothing)?;
    let bar_mm = asked.bar_mm.unwrap_or(axis.bar_mm);
    if bar_mm < axis.bar_mm {
        return Err(PrototypeError::Thin { axis: axis.axis, needed_mm: axis.bar_mm, bar_mm });
    }
    let support_mm = BEYOND_TOOL * 2.0 * asked.thickest_mm();
    let length_mm = axis.length_mm + 2.0 * support_mm;
    if length_mm > asked.longest_mm {
        return Err(PrototypeError::Long { length_mm, longest_mm: asked.longest_mm });
    }
    let mut model = in_machine(file.model(), &axis, support_mm)?;
    let own = model.faces.len();
    let bare = model.clone();
    let moved = Part { model: &bare, ..whole };
    let along_x = Frame::new("bar", X, Axis { index: 1, negative: false }).map_err(ReachError::from)?;
    let slices = Slices::new(&moved, &along_x, DEVIATION_SHARE * axis.length_mm, 90.0)?;
    let (shaft, places) = held_by(&slices, &axis, support_mm, asked)?;

    // Angles for the part with its supports, which stand in the way and are cut like it.
    let mut sides = free.clone();
    let mut areas = file.face_area_mm2.clone();
    for (k, place) in places.iter().enumerate() {
        let face = support_face(place, k)?;
        sides.push(outside_of(&face, place));
        areas.push(face.area_mm2());
        model.faces.push(face);
    }
    let excluded: Vec<bool> = (0..model.faces.len()).map(|face| face >= own).collect();
    let held =
        Part { model: &model, face_area_mm2: &areas, free_sides: &sides, open: &open, excluded: &excluded };
    let orientation = Orientation { up: Z, front: X };
    let reach = ReachAsked { from: DirectionsFrom::Rotary(X), forced: Vec::new(), ..asked.reach.clone() };
    let name = file.name();
    let found = of_part((&held, &name), orientation, &reach, monitor)?;
    let left = found.reach.unreached();
    // What the tool does not get to is left for a smaller one; what no line of sight gets to cannot be made.
    let covers_end = |face: usize| {
        let bounds = model.faces[face].bounds();
        places.iter().any(|place| touches(&bounds, place))
    };
    let is_unseen = |sample: &Sample| !covers_end(sample.face) && slices.arcs(sample).is_empty();
    let unseen = by_face(found.reach.unreached_samples().filter(|sample| is_unseen(sample)));
    let unseen_mm2: f64 = unseen.iter().map(|(_, mm2)| mm2).sum();
    let whole_mm2: f64 = file.face_area_mm2.iter().sum();
    if unseen_mm2 > UNSEEN_SHARE * whole_mm2 {
        let entity = |face: usize| (face, file.model().faces[face].source.entity.clone());
        return Err(PrototypeError::Unseen {
            axis: axis.axis,
            share_percent: 100.0 * unseen_mm2 / whole_mm2,
            faces: unseen.iter().map(|(face, ..)| entity(*face)).collect(),
        });
    }
    Ok(Prototype { axes, axis, bar_mm, length_mm, found, shaft, supports: places, model, left })
}

/// The part in the machine's frame: its axis becomes x, and it ends where the support to the right begins.
fn in_machine(model: &Model, axis: &AxisView, support_mm: f64) -> Result<Model, PrototypeError> {
    let other = Axis { index: (axis.axis.index + 1) % 3, negative: false };
    let turn = Frame::new("bar", axis.axis, other).map_err(ReachError::from)?;
    // The frame's z is the axis: that becomes the machine's x.
    let middle = turn.to_setup(&Point3::from(axis.middle));
    let right = middle.z + 0.5 * axis.length_mm + support_mm;
    let to_machine = |p: Point3| {
        let q = turn.to_setup(&p);
        Point3::new(q.z - right, q.x - middle.x, q.y - middle.y)
    };
    let faces = model.faces.par_iter();
    let faces = faces.map(|face| Face { surface: face.surface.mapped(to_machine), ..face.clone() }).collect();
    Ok(Model { faces, ..model.clone() })
}

/// Supports at both ends of a part: their sizes and places.
fn held_by(
    slices: &Slices,
    axis: &AxisView,
    support_mm: f64,
    asked: &PrototypeAsked,
) -> Result<(Shaft, [SupportPlace; 2]), PrototypeError> {
    let [low, high] = slices.along_mm();
    let depth_mm = DEPTH_SHARE * axis.length_mm;
    let place = |at_mm: f64, outward: f64| {
        let room = slices.room_at(at_mm - outward * depth_mm);
        let (middle, room_mm) = room.ok_or(PrototypeError::NoPlace { axis: axis.axis, at_mm })?;
        Ok::<_, PrototypeError>((middle, ROOM_SHARE * room_mm))
    };
    let (first, second) = (place(high, 1.0)?, place(low, -1.0)?);
    let sections = (0..SECTIONS).map(|k| low + (high - low) * (k as f64 + 0.5) / SECTIONS as f64);
    let thinnest =
        sections.filter_map(|x| slices.room_at(x)).map(|(_, room)| room).fold(f64::INFINITY, f64::min);
    let shaft = Shaft {
        support_mm,
        first_mm: 0.0,
        second_mm: 0.0,
        part_mm: axis.length_mm,
        part_radius_mm: if thinnest.is_finite() { thinnest } else { first.1.min(second.1) },
        stiffness: asked.stiffness,
    };
    let (force_n, tolerance_mm) = (asked.force_n, asked.tolerance_mm);
    let load = Load { force_n, lever_mm: 0.5 * axis.bar_mm, tolerance_mm };
    let shaft = supports(&shaft, &load, first.1.min(second.1))?;
    let support = |middle: [f64; 2], at_mm: f64, outward: f64| SupportPlace {
        middle,
        radius_mm: shaft.first_mm,
        ends_mm: [at_mm - outward * depth_mm, at_mm + outward * support_mm],
    };
    Ok((shaft, [support(first.0, high, 1.0), support(second.0, low, -1.0)]))
}

/// Area of samples, which come face by face, by face.
fn by_face<'a>(samples: impl Iterator<Item = &'a Sample>) -> Vec<(usize, f64)> {
    let mut found: Vec<(usize, f64)> = Vec::new();
    for sample in samples {
        match found.last_mut() {
            Some((face, mm2)) if *face == sample.face => *mm2 += sample.area_mm2,
            _ => found.push((sample.face, sample.area_mm2)),
        }
    }
    found
}

/// Whether a support begins in a face's box.
fn touches(bounds: &Aabb, place: &SupportPlace) -> bool {
    let [a, b] = place.ends_mm;
    let [y, z] = place.middle;
    let (low, high) = (a.min(b), a.max(b));
    bounds.min[0] <= high
        && bounds.max[0] >= low
        && (bounds.min[1]..=bounds.max[1]).contains(&y)
        && (bounds.min[2]..=bounds.max[2]).contains(&z)
}

/// The side of a support, without its ends.
fn support_face(place: &SupportPlace, number: usize) -> Result<Face, PrototypeError> {
    let [a, b] = place.ends_mm;
    let (low, high) = (a.min(b), a.max(b));
    let [y, z] = place.middle;
    let at = Placement::new(Point3::new(low, y, z), Vector3::x(), Vector3::y());
    let at = at.ok_or(claymill_nurbs::NurbsError::NotFinite { what: "axis", index: 0 })?;
    let surface = cylinder(&at, place.radius_mm, (0.0, std::f64::consts::TAU), (0.0, high - low))?;
    let source = Source { entity: format!("support {}", number + 1), ..Source::default() };
    Ok(Face { surface, loops: Vec::new(), reversed: false, kind: SurfaceKind::Cylinder, source })
}

/// The side of a support that looks away from its middle line.
fn outside_of(face: &Face, place: &SupportPlace) -> FreeSide {
    let ((u0, u1), (v0, v1)) = face.surface.domain();
    let (u, v) = (0.5 * (u0 + u1), 0.5 * (v0 + v1));
    let p = face.surface.point(u, v);
    let out = Vector3::new(0.0, p.y - place.middle[0], p.z - place.middle[1]);
    FreeSide::one(face.surface.normal(u, v).is_some_and(|(n, _)| n.dot(&out) > 0.0))
}

impl Prototype {
    /// The bar in the machine's frame, between the chucks.
    #[must_use]
    pub fn stock(&self) -> Stock {
        Stock::Bar { from_mm: [-self.length_mm, 0.0, 0.0], to_mm: [0.0; 3], diameter_mm: self.bar_mm }
    }

    /// The angles about the rotary axis, degrees.
    #[must_use]
    pub fn angles_deg(&self) -> Vec<f64> {
        let angle = |&column: &usize| self.found.record.directions[column].angle_deg;
        self.found.cover.columns.iter().filter_map(angle).collect()
    }

    /// The setups in the machine's frame, as `NAME:X,Y,Z`.
    #[must_use]
    pub fn setups(&self) -> Vec<String> {
        let setup = |&column: &usize| {
            let frame = &self.found.directions[column].frame;
            let axis = frame.axis();
            format!("{}:{},{},{}", frame.name, axis.x, axis.y, axis.z)
        };
        self.found.cover.columns.iter().map(setup).collect()
    }
}
