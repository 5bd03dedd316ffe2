//! Bodies: the faces of one object, before they are put in their place.

use claymill_nurbs::Curve2;

use super::fault::Fault;
use super::surfaces::Carrier;

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
    /// Control points that the face needs when it is built.
    pub(super) fn weight(&self, face: &RawFace) -> usize {
        let surface = self.surfaces.get(face.surface).and_then(|s| s.as_ref().ok());
        let net = surface.map_or(0, |s| s.surface.net().len());
        let trims = face.loops.iter().flatten();
        net + trims.map(|t| t.pcurve.points().len()).sum::<usize>()
    }
}
