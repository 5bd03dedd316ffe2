//! One face: its surface in place, in millimetres, and its trim loops.

use claymill_nurbs::{Face, NurbsSurface, Point3, Source};
use nalgebra::Matrix4;

use crate::import::Repair;
use crate::nesting;
use crate::trim::{RawEdge, Trimmer};
use crate::warp;

use super::body::{Body, RawFace};
use super::fault::Fault;

/// Where and as what a face is built.
#[derive(Debug)]
pub(super) struct Site<'a> {
    /// From the object's coordinates to millimetres in the model.
    pub(super) placement: &'a Matrix4<f64>,
    pub(super) tolerance_mm: f64,
    /// Added to the body's edge numbers, so that edges of different bodies differ.
    pub(super) first_edge: u64,
}

/// A face and what was mended in it.
#[derive(Debug)]
pub(super) struct Made {
    pub(super) face: Face,
    pub(super) repairs: Vec<Repair>,
}

impl Site<'_> {
    pub(super) fn face(&self, body: &Body, raw: &RawFace, source: Source) -> Result<Made, Fault> {
        let missing = || Fault::Missing { what: "surface", index: raw.surface as i64 };
        let carrier = body.surfaces.get(raw.surface).ok_or_else(missing)?.as_ref().map_err(Clone::clone)?;
        let surface = self.surface(&carrier.surface)?;
        if nesting::has_no_area(&surface) {
            return Err(Fault::NoArea);
        }
        let mut loops = Vec::with_capacity(raw.loops.len());
        let mut repairs = Vec::new();
        let trimmer = Trimmer::new(&surface, self.tolerance_mm);
        for raw in &raw.loops {
            let edges: Result<Vec<_>, Fault> = raw
                .iter()
                .map(|trim| {
                    Ok(RawEdge {
                        curve: None,
                        pcurve: Some(warp::pcurve(&surface, &carrier.warps, trim.pcurve.clone())?),
                        shared: trim.edge.map(|e| self.first_edge + e as u64),
                    })
                })
                .collect();
            let closed = trimmer.closed(&edges?)?;
            if closed.bridged_mm > 0.0 {
                repairs.push(Repair {
                    entity: source.entity.clone(),
                    what: "gap in a trim loop bridged".into(),
                    size_mm: closed.bridged_mm,
                });
            }
            loops.push(closed.trim);
        }
        if !loops.is_empty() {
            loops = nesting::orient(&surface, loops)?;
        }
        if nesting::is_natural(&surface, &loops) {
            loops.clear();
        }
        // A mirrored surface looks to the other side.
        let mirrored = self.placement.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        let reversed = raw.reversed != mirrored;
        Ok(Made { face: Face { surface, loops, reversed, kind: carrier.kind, source }, repairs })
    }

    fn point(&self, p: &Point3) -> Point3 {
        self.placement.transform_point(p)
    }

    fn surface(&self, surface: &NurbsSurface) -> Result<NurbsSurface, Fault> {
        let net = surface.net();
        let points = net.iter().map(|h| self.point(&Point3::from(h.xyz() / h.w))).collect();
        let weights = surface.is_rational().then(|| net.iter().map(|h| h.w).collect());
        let (u, v) = (surface.knots_u().clone(), surface.knots_v().clone());
        Ok(NurbsSurface::new(u, v, points, weights)?)
    }
}
