//! Faces: trimmed (144), bounded (143), of B-reps (510), and bare surfaces.

use std::collections::BTreeSet;

use claymill_nurbs::analytic::{self, Frame};
use claymill_nurbs::{Curve2, Face, NurbsSurface, Point2, Source, SurfaceKind, TrimEdge, TrimLoop};

use crate::chart::{self, Limits, SplineChart};
use crate::import::Repair;
use crate::nesting;
use crate::trim::{RawEdge, TrimError, Trimmer};
use crate::warp::Warp;

use super::attributes;
use super::fault::Fault;
use super::file::File;
use super::roots::Root;
use super::surfaces::{self, Carrier, Window};
use super::topology::{self, EdgeLists, RawLoop};

/// Pcurves on closed surfaces follow their edges this closely, mm.
const FIT_MM: f64 = 1e-4;
/// The file's tolerance counts within these limits, mm, when points on closed surfaces are compared.
const SAME_POINT_MM: (f64, f64) = (1e-3, 0.1);
/// An edge may miss its neighbour or its closed surface by this (or ten times the file's tolerance), mm.
const MISFIT_MM: f64 = 0.5;

/// Builds the faces of a file.
#[derive(Debug)]
pub(crate) struct FaceReader<'a> {
    pub(crate) file: &'a File,
    pub(crate) edge_lists: EdgeLists,
    pub(crate) tolerance_mm: f64,
}

/// A face and what was mended in it.
#[derive(Debug)]
pub(crate) struct Made {
    pub(crate) face: Face,
    pub(crate) repairs: Vec<Repair>,
}

impl FaceReader<'_> {
    pub(crate) fn face(&self, root: &Root) -> Result<Made, Fault> {
        let (file, de) = (self.file, root.de);
        let entry = file.entry(de)?;
        if let Some(fault) = &root.fault {
            return Err(fault.clone());
        }
        if root.blanked {
            return Err(Fault::Blanked);
        }
        let (mut made, repeated) = match entry.kind {
            144 => self.trimmed(root),
            143 => self.bounded(root),
            510 => self.of_b_rep(root),
            _ => {
                let (carrier, properties) = surfaces::read(file, de, &root.placement)?;
                let source = attributes::source(file, de, &properties, None);
                self.assemble(carrier, Vec::new(), false, source).map(|made| (made, 0))
            }
        }?;
        made.face.reversed = root.reversed;
        made.face.source.entity = root.label();
        if repeated > 0 {
            let what = format!("{repeated} repeated trim loops left out");
            made.repairs.push(Repair { entity: root.label(), what, size_mm: 0.0 });
        }
        Ok(made)
    }

    fn trimmed(&self, root: &Root) -> Result<(Made, usize), Fault> {
        let (file, de) = (self.file, root.de);
        let placement = root.placement.of_entity(file, de)?;
        let mut record = file.record(de)?;
        let surface = record.integer()?;
        let has_outer = record.integer()? != 0;
        let holes = record.count()?;
        let outer = record.integer()?;
        let holes = record.required(holes, super::file::Record::integer)?;
        let (carrier, under) = surfaces::read(file, surface, &placement)?;
        let loops = (has_outer && outer != 0).then_some(outer).into_iter().chain(holes).collect();
        let (loops, repeated) = once_each(loops);
        let flat = carrier.warps().is_some();
        let raw = loops
            .iter()
            .map(|de| topology::curve_on_surface(file, *de, &placement, flat))
            .collect::<Result<Vec<_>, _>>()?;
        let source = attributes::source(file, de, &record.properties(), Some((surface, &under)));
        Ok((self.assemble(carrier, raw, !has_outer, source)?, repeated))
    }

    fn bounded(&self, root: &Root) -> Result<(Made, usize), Fault> {
        let (file, de) = (self.file, root.de);
        let placement = root.placement.of_entity(file, de)?;
        let mut record = file.record(de)?;
        record.skip(1)?;
        let surface = record.integer()?;
        let (loops, repeated) = once_each(record.pointers()?);
        let (carrier, under) = surfaces::read(file, surface, &placement)?;
        let flat = carrier.warps().is_some();
        let raw = loops
            .iter()
            .map(|de| topology::boundary(file, *de, &placement, flat))
            .collect::<Result<Vec<_>, _>>()?;
        let source = attributes::source(file, de, &record.properties(), Some((surface, &under)));
        Ok((self.assemble(carrier, raw, false, source)?, repeated))
    }

    fn of_b_rep(&self, root: &Root) -> Result<(Made, usize), Fault> {
        let (file, de) = (self.file, root.de);
        let placement = root.placement.of_entity(file, de)?;
        let mut record = file.record(de)?;
        let surface = record.integer()?;
        let count = record.count()?;
        record.skip(1)?;
        let (loops, repeated) = once_each(record.required(count, super::file::Record::integer)?);
        let (carrier, under) = surfaces::read(file, surface, &placement)?;
        let flat = carrier.warps().is_some();
        let raw = loops
            .iter()
            .map(|de| topology::b_rep_loop(file, &self.edge_lists, *de, &placement, flat))
            .collect::<Result<Vec<_>, _>>()?;
        let source = attributes::source(file, de, &record.properties(), Some((surface, &under)));
        Ok((self.assemble(carrier, raw, false, source)?, repeated))
    }

    /// The face from its parts. `whole` adds the natural boundary as outer loop.
    fn assemble(
        &self,
        carrier: Carrier,
        mut raw: Vec<RawLoop>,
        whole: bool,
        source: Source,
    ) -> Result<Made, Fault> {
        let mut repairs = Vec::new();
        let (surface, kind, window) = match carrier {
            Carrier::Bounded { surface, kind, window, warps, deviation_mm } => {
                if let Some(warps) = warps {
                    topology::warp_pcurves(&mut raw, &surface, &warps);
                }
                if deviation_mm > 0.0 {
                    repairs.push(Repair {
                        entity: source.entity.clone(),
                        what: format!("{} surface approximated by a B-spline", name_of(kind)),
                        size_mm: deviation_mm,
                    });
                }
                (surface, kind, window)
            }
            Carrier::Plane(frame) => (plane_under(&frame, &mut raw)?, SurfaceKind::Plane, None),
            Carrier::Chart { carrier, kind } => return self.on_chart(&carrier, kind, raw, source),
        };
        if nesting::has_no_area(&surface) {
            return Err(Fault::NoArea);
        }
        match self.on_rectangle(&surface, &raw, whole, window) {
            Ok((loops, bridged)) => {
                let bridged = bridged.into_iter().map(|gap| bridged_gap(&source, gap));
                repairs.extend(bridged);
                let face = Face { surface, loops, reversed: false, kind, source };
                Ok(Made { face, repairs })
            }
            Err(fault) => {
                // Loops that run round a closed surface do not close in its rectangle.
                let chart = SplineChart::new(surface);
                if whole || chart.periods() == [None, None] {
                    return Err(fault);
                }
                let made = self.on_chart(&chart::Carrier::Spline(chart), kind, raw, source);
                let made = made.map_err(|_| fault)?;
                repairs.extend(made.repairs);
                Ok(Made { repairs, ..made })
            }
        }
    }

    /// The loops on a surface's own rectangle of parameters, and the gaps that were bridged.
    fn on_rectangle(
        &self,
        surface: &NurbsSurface,
        raw: &[RawLoop],
        whole: bool,
        window: Option<Window>,
    ) -> Result<(Vec<TrimLoop>, Vec<f64>), Fault> {
        let (mut loops, mut bridged) = (Vec::new(), Vec::new());
        let trimmer = Trimmer::new(surface, self.tolerance_mm);
        for raw in raw {
            let closed = match raw {
                RawLoop::Edges(edges) => trimmer.closed(edges),
                RawLoop::Sets { curves, pcurves } => trimmer.closed_from_sets(curves, pcurves),
            }?;
            if closed.bridged_mm > 0.0 {
                bridged.push(closed.bridged_mm);
            }
            loops.push(closed.trim);
        }
        if whole && !loops.is_empty() || loops.is_empty() && window.is_some() {
            loops.insert(0, rectangle(window.unwrap_or_else(|| surface.domain())));
        }
        if !loops.is_empty() {
            loops = nesting::orient(surface, loops)?;
        }
        if nesting::is_natural(surface, &loops) {
            loops.clear();
        }
        Ok((loops, bridged))
    }

    /// The face on a carrier that closes on itself, from its edges in space.
    fn on_chart(
        &self,
        carrier: &chart::Carrier,
        kind: SurfaceKind,
        raw: Vec<RawLoop>,
        source: Source,
    ) -> Result<Made, Fault> {
        let limits = Limits {
            fit: FIT_MM,
            same: self.tolerance_mm.clamp(SAME_POINT_MM.0, SAME_POINT_MM.1),
            misfit: MISFIT_MM.max(10.0 * self.tolerance_mm),
            mm_per_unit: 1.0,
        };
        let bounds: Option<Vec<_>> = raw.into_iter().map(RawLoop::into_chart).collect();
        let bounds = bounds.ok_or(Fault::Trim(TrimError::Projection))?;
        let patch = chart::trimmed(carrier, &bounds, true, false, &limits)?;
        let repairs = patch.bridged.iter().map(|gap| bridged_gap(&source, *gap)).collect();
        let face = Face { surface: patch.surface, loops: patch.loops, reversed: false, kind, source };
        Ok(Made { face, repairs })
    }
}

/// The loops of a face, each once, and how many it lists again.
fn once_each(mut loops: Vec<i64>) -> (Vec<i64>, usize) {
    let listed = loops.len();
    let mut seen = BTreeSet::new();
    loops.retain(|de| seen.insert(*de));
    let repeated = listed - loops.len();
    (loops, repeated)
}

fn bridged_gap(source: &Source, size_mm: f64) -> Repair {
    Repair { entity: source.entity.clone(), what: "gap in a trim loop bridged".into(), size_mm }
}

fn name_of(kind: SurfaceKind) -> &'static str {
    match kind {
        SurfaceKind::Offset => "offset",
        SurfaceKind::Ruled => "ruled",
        _ => "swept",
    }
}

impl Carrier {
    /// From the parameters of the file's pcurves to the surface's, where that is known.
    fn warps(&self) -> Option<&[Warp; 2]> {
        match self {
            Carrier::Bounded { warps, .. } => warps.as_ref(),
            Carrier::Plane(_) | Carrier::Chart { .. } => None,
        }
    }
}

/// The plane just large enough for the loops, which get their exact pcurves.
fn plane_under(frame: &Frame, raw: &mut [RawLoop]) -> Result<NurbsSurface, Fault> {
    let mut low = Point2::new(f64::INFINITY, f64::INFINITY);
    let mut high = -low;
    for point in raw.iter().flat_map(RawLoop::curves).flat_map(claymill_nurbs::Curve3::points) {
        let local = frame.local(point).xy();
        (low, high) = (low.inf(&local), high.sup(&local));
    }
    // A plane without loops has no size of its own.
    let surface =
        analytic::plane_patch(frame, (low.x, high.x), (low.y, high.y)).map_err(|_| Fault::NoArea)?;
    for raw in raw {
        let edges = match raw {
            RawLoop::Edges(edges) => std::mem::take(edges),
            RawLoop::Sets { curves, .. } => {
                let edge = |c| RawEdge { curve: Some(c), ..RawEdge::default() };
                std::mem::take(curves).into_iter().map(edge).collect()
            }
        };
        let flattened = edges.into_iter().map(|edge| RawEdge {
            pcurve: edge.curve.as_ref().and_then(|c| {
                let points = c.points().iter().map(|p| frame.local(p).xy()).collect();
                Curve2::new(c.knots().clone(), points, c.weights().map(<[f64]>::to_vec)).ok()
            }),
            ..edge
        });
        *raw = RawLoop::Edges(flattened.collect());
    }
    Ok(surface)
}

fn rectangle(((u0, u1), (v0, v1)): Window) -> TrimLoop {
    let corners = [(u0, v0), (u1, v0), (u1, v1), (u0, v1)].map(|(u, v)| Point2::new(u, v));
    let edge = |i: usize| TrimEdge { pcurve: Curve2::line(corners[i], corners[(i + 1) % 4]), shared: None };
    TrimLoop { edges: (0..4).map(edge).collect() }
}
