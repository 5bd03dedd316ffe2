//! Bounds and edges of a face, before they meet their surface.

use claymill_nurbs::{Curve2, Curve3, Point3};

use super::curves::{plane_curve, polyline, space_curve};
use super::part21::Part21;
use super::placement::vertex;
use super::{Context, StepError};
use crate::along::samples;
use crate::chart;

/// One use of an edge, run in the direction of its loop.
#[derive(Debug, Clone)]
pub(super) struct EdgeUse {
    /// The EDGE_CURVE; `None` for sides of a POLY_LOOP.
    pub(super) edge: Option<u64>,
    pub(super) curve: Curve3,
    /// PCURVE instances of the edge, on whatever surface.
    pub(super) pcurves: Vec<u64>,
    /// The file's own parameters at the two ends of the curve, in the direction of the pcurves.
    pub(super) range: (f64, f64),
    /// Whether the loop runs the curve against the pcurves' direction.
    pub(super) backward: bool,
}

/// The edges of a loop, in order; empty for a loop that is a single vertex.
pub(super) fn bound(file: &Part21, id: u64, context: &Context) -> Result<Vec<EdgeUse>, StepError> {
    let entity = file.get(id)?;
    let record = match entity.part("FACE_OUTER_BOUND") {
        Ok(record) => record,
        Err(_) => entity.part("FACE_BOUND")?,
    };
    let forward = record.flag(2)?;
    let mut uses = edge_loop(file, record.reference(1)?, context)?;
    if !forward {
        uses.reverse();
        uses.iter_mut().for_each(EdgeUse::reverse);
    }
    Ok(uses)
}

impl EdgeUse {
    fn reverse(&mut self) {
        self.curve = self.curve.reversed();
        self.backward = !self.backward;
    }

    /// Points along the edge that span its extent.
    pub(super) fn extent(&self) -> impl Iterator<Item = Point3> {
        samples(&self.curve, 8).into_iter().map(|t| self.curve.point(t))
    }

    /// The edge as it lies on a surface, with its pcurves on `flats_of`.
    pub(super) fn on_surface(self, file: &Part21, flats_of: Option<u64>) -> chart::EdgeUse {
        let flat = |id: &u64| -> Option<Curve2> {
            let entity = file.get(*id).ok()?;
            let record = entity.part("PCURVE").ok()?;
            if Some(record.reference(1).ok()?) != flats_of {
                return None;
            }
            let representation = file.get(record.reference(2).ok()?).ok()?;
            let items = representation.part("DEFINITIONAL_REPRESENTATION").ok()?.references(1).ok()?;
            let curve = plane_curve(file, *items.first()?, self.range).ok()?;
            Some(if self.backward { curve.reversed() } else { curve })
        };
        let wanted = flats_of.is_some();
        let flats = self.pcurves.iter().filter(|_| wanted).filter_map(flat).collect();
        chart::EdgeUse { edge: self.edge, curve: self.curve, flats }
    }
}

fn edge_loop(file: &Part21, id: u64, context: &Context) -> Result<Vec<EdgeUse>, StepError> {
    let entity = file.get(id)?;
    match entity.simple_name() {
        "EDGE_LOOP" => {
            let edges = entity.only()?.references(1)?;
            let uses: Result<Vec<_>, _> = edges.iter().map(|e| oriented_edge(file, *e, context)).collect();
            Ok(uses?.into_iter().flatten().collect())
        }
        "VERTEX_LOOP" => Ok(Vec::new()),
        "POLY_LOOP" => {
            let corners = entity.only()?.references(1)?;
            let sides = corners.iter().zip(corners.iter().cycle().skip(1));
            sides
                .filter(|(a, b)| a != b)
                .map(|(a, b)| {
                    Ok(EdgeUse {
                        edge: None,
                        curve: polyline(file, id, &[*a, *b])?,
                        pcurves: Vec::new(),
                        range: (0.0, 1.0),
                        backward: false,
                    })
                })
                .collect()
        }
        _ => Err(entity.unexpected("a loop")),
    }
}

/// ORIENTED_EDGE(name, *, *, edge, orientation) of EDGE_CURVE(name, start, end, curve, same sense); `None`
/// for an edge without length.
fn oriented_edge(file: &Part21, id: u64, context: &Context) -> Result<Option<EdgeUse>, StepError> {
    let oriented = file.get(id)?;
    let record = oriented.part("ORIENTED_EDGE")?;
    let (edge_id, forward) = (record.reference(3)?, record.flag(4)?);
    let edge = file.get(edge_id)?;
    let r = edge.part("EDGE_CURVE")?;
    let (from, to) = (r.reference(1)?, r.reference(2)?);
    let (start, end) = (vertex(file, from)?, vertex(file, to)?);
    let space = space_curve(file, r.reference(3)?, context.angle_unit)?;
    let same_sense = r.flag(4)?;
    let is_line = matches!(space.curve, super::curves::Curve::Line { .. });
    if is_line && (start - end).norm() <= f64::EPSILON * start.coords.amax() {
        return Ok(None);
    }
    let (curve, range) = space.curve.between(edge_id, &start, &end, same_sense, context.limits.same)?;
    let mut edge_use =
        EdgeUse { edge: Some(edge_id), curve, pcurves: space.pcurves, range, backward: !same_sense };
    if !forward {
        edge_use.reverse();
    }
    Ok(Some(edge_use))
}
