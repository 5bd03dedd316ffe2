//! Bodies: the faces of one object, before they are put in their place.

use std::cell::Cell;

use claymill_nurbs::Curve2;

use super::class::{Class, Object};
use super::fault::Fault;
use super::surfaces::{self, Carrier};
use super::{brep, extrusion};

/// Control points that even the smallest file may unfold to.
const POINTS_OF_ANY_FILE: usize = 200_000;

/// What reading an object needs to know.
#[derive(Debug)]
pub(super) struct Context {
    /// Edges have no domain of their own (toolkits before June 2002).
    pub(super) legacy_edges: bool,
    /// Control points that may still be made out of the file.
    points_left: Cell<usize>,
}

impl Context {
    /// For a file of `size` bytes. Curves and blocks that are used again and again multiply what the file
    /// holds; real models stay far below this.
    pub(super) fn new(legacy_edges: bool, size: usize) -> Self {
        Context { legacy_edges, points_left: Cell::new(size.saturating_add(POINTS_OF_ANY_FILE)) }
    }

    /// Accounts for `points` that are about to be made.
    pub(super) fn spend(&self, points: usize) -> Result<(), Fault> {
        let left = self.points_left.get().checked_sub(points).ok_or(Fault::TooMuch)?;
        self.points_left.set(left);
        Ok(())
    }
}

/// The faces of an object, file units.
#[derive(Debug)]
pub(super) struct Body {
    pub(super) surfaces: Vec<Result<Carrier, Fault>>,
    pub(super) faces: Vec<Result<RawFace, Fault>>,
}

/// A face as the archive gives it.
#[derive(Debug)]
pub(super) struct RawFace {
    /// Index of the body's surface.
    pub(super) surface: usize,
    /// Trim edges in order; no loop where the face is the whole surface.
    pub(super) loops: Vec<Vec<Trim>>,
    pub(super) reversed: bool,
    pub(super) colour: Option<[u8; 3]>,
}

/// One edge of a loop.
#[derive(Debug, Clone)]
pub(super) struct Trim {
    /// In the archive's parameters of the surface. It alone says where the face ends: the curve in space is only
    /// near it, within the file's tolerance.
    pub(super) pcurve: Curve2,
    /// The edge among those of the body.
    pub(super) edge: Option<usize>,
}

impl Body {
    /// Reads the body of an object.
    pub(super) fn read(object: Object, context: &Context) -> Result<Self, Fault> {
        match object.class {
            Class::Brep => brep::read(object.data, context),
            Class::Extrusion => extrusion::read(object.data, context),
            class if surfaces::is_surface(class) => {
                let face = RawFace { surface: 0, loops: Vec::new(), reversed: false, colour: None };
                let surface = surfaces::read(object, context)?;
                Ok(Body { surfaces: vec![Ok(surface)], faces: vec![Ok(face)] })
            }
            class => Err(Fault::Unsupported(class.name())),
        }
    }

    /// Control points that the face needs when it is built.
    pub(super) fn weight(&self, face: &RawFace) -> usize {
        let surface = self.surfaces.get(face.surface).and_then(|s| s.as_ref().ok());
        let net = surface.map_or(0, |s| s.surface.net().len());
        let trims = face.loops.iter().flatten();
        net + trims.map(|t| t.pcurve.points().len()).sum::<usize>()
    }
}
