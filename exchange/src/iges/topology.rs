//! Loops of faces: curves on surfaces (142), boundaries (141) and B-rep loops (508, 504).

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use claymill_nurbs::{Curve2, Curve3, NurbsSurface};
use nalgebra::Vector2;

use crate::chart::{EdgeUse, Range};
use crate::subcurve::mapped;
use crate::trim::{RawEdge, head_to_tail};
use crate::warp::{self, Warp};

use super::curves;
use super::fault::Fault;
use super::file::{File, Record};
use super::placement::Placement;

/// Gaps between the ends of edges that differ by less are as wide, mm.
const SAME_END_MM: f64 = 1e-4;
/// Angles that differ by less are one, radians: files have ten digits.
const SAME_ANGLE: f64 = 1e-6;

/// A loop as the file gives it.
#[derive(Debug, Clone)]
pub(crate) enum RawLoop {
    /// Edges in order.
    Edges(Vec<RawEdge>),
    /// Curves in space and pcurves; which belong together is not said.
    Sets { curves: Vec<Curve3>, pcurves: Vec<Curve2> },
}

impl RawLoop {
    /// All curves in space.
    pub(crate) fn curves(&self) -> Vec<&Curve3> {
        match self {
            RawLoop::Edges(edges) => edges.iter().filter_map(|e| e.curve.as_ref()).collect(),
            RawLoop::Sets { curves, .. } => curves.iter().collect(),
        }
    }
}

impl RawLoop {
    fn pcurves(&self) -> Vec<&Curve2> {
        match self {
            RawLoop::Edges(edges) => edges.iter().filter_map(|e| e.pcurve.as_ref()).collect(),
            RawLoop::Sets { pcurves, .. } => pcurves.iter().collect(),
        }
    }

    /// Changes every pcurve; one that cannot be is let go.
    fn map_pcurves(&mut self, map: impl Fn(Curve2) -> Option<Curve2>) {
        match self {
            RawLoop::Edges(edges) => {
                edges.iter_mut().for_each(|e| e.pcurve = e.pcurve.take().and_then(&map));
            }
            RawLoop::Sets { pcurves, .. } => {
                let mapped = std::mem::take(pcurves).into_iter().map(map).collect::<Option<_>>();
                *pcurves = mapped.unwrap_or_default();
            }
        }
    }

    /// The edges in space, run head to tail; `None` where one has only a pcurve.
    pub(crate) fn into_chart(self) -> Option<Vec<EdgeUse>> {
        let edge = |curve, pcurve: Option<Curve2>, edge| EdgeUse {
            edge,
            curve,
            flats: pcurve.into_iter().flat_map(|p| [p.reversed(), p]).collect(),
        };
        let mut uses: Vec<EdgeUse> = match self {
            RawLoop::Edges(edges) => {
                edges.into_iter().map(|e| Some(edge(e.curve?, e.pcurve, e.shared))).collect::<Option<_>>()?
            }
            RawLoop::Sets { curves, .. } if curves.is_empty() => return None,
            RawLoop::Sets { curves, pcurves } => {
                let paired = curves.len() == pcurves.len();
                let flat = |i: usize| pcurves.get(i).filter(|_| paired).cloned();
                curves.into_iter().enumerate().map(|(i, c)| edge(c, flat(i), None)).collect()
            }
        };
        let gap = |a: &EdgeUse, b: &EdgeUse| (a.curve.end() - b.curve.start()).norm();
        let turned = |e: &EdgeUse| EdgeUse { curve: e.curve.reversed(), ..e.clone() };
        head_to_tail(&mut uses, SAME_END_MM, gap, turned);
        Some(uses)
    }
}

/// Takes the pcurves of a face from the file's parameters to the surface's.
pub(crate) fn warp_pcurves(loops: &mut [RawLoop], surface: &NurbsSurface, warps: &[Warp; 2]) {
    if warps.iter().all(Warp::is_identity) {
        return;
    }
    let (u, v) = surface.domain();
    // Angles are counted from anywhere: by whole turns to where the surface is.
    let pcurves = loops.iter().flat_map(RawLoop::pcurves);
    let Range { min, max } = Range::of(pcurves.flat_map(|p| p.points().to_vec()));
    let turn = |axis: usize, (low, high): (f64, f64)| {
        let inside = min[axis] >= low - SAME_ANGLE && max[axis] <= high + SAME_ANGLE;
        let turns = ((low + high - min[axis] - max[axis]) / (2.0 * TAU)).round();
        if inside || warps[axis].is_identity() || !turns.is_finite() { 0.0 } else { turns * TAU }
    };
    let shift = Vector2::new(turn(0, u), turn(1, v));
    let warped = |p: Curve2| {
        let turned = mapped(&p, |at| at + shift).ok()?;
        warp::pcurve(surface, warps, turned).ok()
    };
    loops.iter_mut().for_each(|l| l.map_pcurves(warped));
}

/// Curve pointers of every edge list (504) of the file.
#[derive(Debug, Default)]
pub(crate) struct EdgeLists(BTreeMap<i64, Result<Vec<i64>, Fault>>);

impl EdgeLists {
    pub(crate) fn new(file: &File) -> Self {
        let lists = file.entries().filter(|(_, e)| e.kind == 504);
        let read = |de: i64| {
            let mut record = file.record(de)?;
            let count = record.count()?;
            // Behind each curve: start and end vertex as list and index.
            record.required(count, |r| {
                let curve = r.integer()?;
                r.skip(4)?;
                Ok(curve)
            })
        };
        EdgeLists(lists.map(|(de, _)| (de, read(de))).collect())
    }

    pub(crate) fn curve(&self, list: i64, index: usize) -> Result<i64, Fault> {
        let missing = Fault::Missing { de: list };
        let edges = self.0.get(&list).ok_or(missing.clone())?.as_ref().map_err(Clone::clone)?;
        index.checked_sub(1).and_then(|i| edges.get(i)).copied().ok_or(missing)
    }
}

/// A pcurve that cannot be read is no loss where there is a curve in space.
fn pcurves(file: &File, de: i64, needed: bool) -> Result<Vec<Curve2>, Fault> {
    match curves::read_flat(file, de) {
        Err(fault) if needed => Err(fault),
        other => Ok(other.unwrap_or_default()),
    }
}

/// 142. `flat` says whether pcurves are wanted.
pub(crate) fn curve_on_surface(
    file: &File,
    de: i64,
    placement: &Placement,
    flat: bool,
) -> Result<RawLoop, Fault> {
    let kind = file.entry(de)?.kind;
    if kind != 142 {
        return Err(Fault::Kind { de, kind, wanted: "a curve on a surface" });
    }
    let mut record = file.record(de)?;
    record.skip(2)?;
    let (flat_de, curve_de) = (record.integer()?, record.integer()?);
    let placement = placement.of_entity(file, de)?;
    let curves = match curve_de {
        0 => Vec::new(),
        _ => curves::read(file, curve_de, &placement)?,
    };
    let pcurves = match flat_de {
        0 => Vec::new(),
        _ if !flat => Vec::new(),
        _ => pcurves(file, flat_de, curves.is_empty())?,
    };
    Ok(RawLoop::Sets { curves, pcurves })
}

/// 141.
pub(crate) fn boundary(file: &File, de: i64, placement: &Placement, flat: bool) -> Result<RawLoop, Fault> {
    let kind = file.entry(de)?.kind;
    if kind != 141 {
        return Err(Fault::Kind { de, kind, wanted: "a boundary" });
    }
    let placement = placement.of_entity(file, de)?;
    let mut record = file.record(de)?;
    record.skip(3)?;
    let count = record.count()?;
    let edges = record.required(count, |r| {
        let (curve, sense) = (r.integer()?, r.integer()?);
        Ok((curve, sense, r.pointers()?))
    })?;
    let mut raw = Vec::new();
    for (curve, sense, flats) in edges {
        let space = curves::read(file, curve, &placement)?;
        push_edges(file, space, &flats, flat, sense == 2, None, &mut raw)?;
    }
    Ok(RawLoop::Edges(raw))
}

/// 508.
pub(crate) fn b_rep_loop(
    file: &File,
    lists: &EdgeLists,
    de: i64,
    placement: &Placement,
    flat: bool,
) -> Result<RawLoop, Fault> {
    let kind = file.entry(de)?.kind;
    if kind != 508 {
        return Err(Fault::Kind { de, kind, wanted: "a loop" });
    }
    let mut record = file.record(de)?;
    let count = record.count()?;
    let edges = record.required(count, |r: &mut Record| {
        let is_vertex = r.integer()? == 1;
        let (list, index, along) = (r.integer()?, r.count()?, r.integer()?);
        let count = r.count()?;
        let flats = r.required(count, |r| {
            r.skip(1)?;
            r.integer()
        })?;
        Ok((is_vertex, list, index, along, flats))
    })?;
    let mut raw = Vec::new();
    for (is_vertex, list, index, along, flats) in edges {
        // A vertex stands for a pole; the loop is closed across it.
        if is_vertex {
            continue;
        }
        let curve = lists.curve(list, index)?;
        let space = curves::read(file, curve, placement)?;
        let shared = Some((list as u64) << 32 | index as u64);
        push_edges(file, space, &flats, flat, along == 0, shared, &mut raw)?;
    }
    Ok(RawLoop::Edges(raw))
}

/// Adds one edge of the file: one raw edge for each piece of its curve.
fn push_edges(
    file: &File,
    mut space: Vec<Curve3>,
    flats: &[i64],
    flat: bool,
    backwards: bool,
    shared: Option<u64>,
    raw: &mut Vec<RawEdge>,
) -> Result<(), Fault> {
    let mut plane = Vec::new();
    for de in flats.iter().filter(|_| flat) {
        plane.extend(pcurves(file, *de, space.is_empty())?);
    }
    // Pcurves follow the loop where their order tells; space curves follow their own direction.
    if backwards {
        space = space.iter().rev().map(Curve3::reversed).collect();
    }
    let single = space.len() == 1;
    if space.is_empty() {
        raw.extend(plane.into_iter().map(|p| RawEdge { pcurve: Some(p), ..RawEdge::default() }));
    } else {
        let paired = plane.len() == space.len();
        raw.extend(space.into_iter().enumerate().map(|(i, curve)| RawEdge {
            curve: Some(curve),
            pcurve: plane.get(i).filter(|_| paired).cloned(),
            shared: shared.filter(|_| single),
        }));
    }
    Ok(())
}
