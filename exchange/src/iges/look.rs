//! The bounds of a face once more, for [`crate::audit`]: the file's own curves, as they stand.

use claymill_nurbs::{Curve2, Curve3};

use super::curves;
use super::fault::Fault;
use super::file::File;
use super::placement::Placement;
use super::roots::Root;
use super::surfaces;
use super::topology::EdgeLists;
use crate::audit::{Bounds, Carrier, Ring};
use crate::chart::{self, Quadric};

/// The bounds of a face, as far as they can be followed.
pub(super) fn bounds(file: &File, lists: &EdgeLists, root: &Root) -> Bounds {
    look(file, lists, root).unwrap_or_default()
}

/// A bound as curves in space and in the parameter plane, either of which may be missing.
type Bound = (Vec<Curve3>, Vec<Curve2>);

fn look(file: &File, lists: &EdgeLists, root: &Root) -> Result<Bounds, Fault> {
    let de = root.de;
    let placement = root.placement.of_entity(file, de)?;
    let mut record = file.record(de)?;
    let (surface, loops) = match file.entry(de)?.kind {
        // 144: surface, whether there is an outer bound, holes, outer bound, holes.
        144 => {
            let (surface, has_outer, holes) = (record.integer()?, record.integer()?, record.count()?);
            let outer = record.integer()?;
            let holes = record.required(holes, super::file::Record::integer)?;
            let outer = (has_outer != 0 && outer != 0).then_some(outer);
            // Holes in the whole surface: its sides are nowhere in the file.
            if outer.is_none() && !holes.is_empty() {
                return Ok(Bounds { listed: holes.len() + 1, ..Bounds::default() });
            }
            (surface, outer.into_iter().chain(holes).collect::<Vec<_>>())
        }
        // 143: type, surface, bounds.
        143 => {
            record.skip(1)?;
            (record.integer()?, record.pointers()?)
        }
        // 510: surface, loops, whether the first is the outer one, loops.
        510 => {
            let (surface, count) = (record.integer()?, record.count()?);
            record.skip(1)?;
            (surface, record.required(count, super::file::Record::integer)?)
        }
        _ => return Ok(Bounds::default()),
    };
    let bounds: Result<Vec<Bound>, Fault> =
        loops.iter().map(|l| bound(file, lists, *l, &placement)).collect();
    let (mut rings, mut flats) = (None, None);
    if let Ok(bounds) = bounds {
        let bounds: Vec<Bound> = bounds.into_iter().filter(|b| !(b.0.is_empty() && b.1.is_empty())).collect();
        if bounds.iter().all(|b| !b.0.is_empty()) {
            rings = Some(bounds.iter().map(|b| Ring::of_curves(&b.0)).collect());
        }
        // Only B-splines have the parameters that the face will have.
        let own = file.entry(surface).is_ok_and(|e| e.kind == 128);
        if own && bounds.iter().all(|b| !b.1.is_empty()) {
            flats = Some(bounds.into_iter().map(|b| b.1).collect());
        }
    }
    let carrier = surfaces::read(file, surface, &placement).ok().and_then(|(c, _)| carrier(&c));
    Ok(Bounds { listed: loops.len(), rings, flats, carrier, sense: true, directed: false, turned: false })
}

/// Surfaces of which edges alone tell the area.
fn carrier(read: &surfaces::Carrier) -> Option<Carrier> {
    match read {
        surfaces::Carrier::Plane(frame) => Some(Carrier::Plane { normal: frame.z }),
        surfaces::Carrier::Chart { carrier: chart::Carrier::Quadric { frame, quadric }, .. } => {
            let frame = *frame;
            match *quadric {
                Quadric::Plane => Some(Carrier::Plane { normal: frame.z }),
                Quadric::Cone { radius, slope: 0.0 } => Some(Carrier::Cylinder { frame, radius }),
                Quadric::Cone { radius, slope } => Some(Carrier::Cone { frame, radius, slope }),
                Quadric::Torus { major: 0.0, minor } => {
                    Some(Carrier::Sphere { centre: frame.origin, radius: minor })
                }
                Quadric::Torus { major, minor } => Some(Carrier::Torus { frame, major, minor }),
                Quadric::Spindle { .. } => None,
            }
        }
        _ => None,
    }
}

fn bound(file: &File, lists: &EdgeLists, de: i64, placement: &Placement) -> Result<Bound, Fault> {
    let placement = placement.of_entity(file, de)?;
    let mut record = file.record(de)?;
    let (mut space, mut flat) = (Vec::new(), Vec::new());
    let mut complete = true;
    let mut pcurves = |des: &[i64], flat: &mut Vec<Curve2>| {
        for de in des {
            match curves::read_flat(file, *de) {
                Ok(read) => flat.extend(read),
                Err(_) => complete = false,
            }
        }
        complete &= !des.is_empty();
    };
    match file.entry(de)?.kind {
        // 142: way of making, surface, curve in the parameter plane, curve in space.
        142 => {
            record.skip(2)?;
            let (plane_de, curve_de) = (record.integer()?, record.integer()?);
            if curve_de != 0 {
                space = curves::read(file, curve_de, &placement)?;
            }
            pcurves(&[plane_de].into_iter().filter(|de| *de != 0).collect::<Vec<_>>(), &mut flat);
        }
        // 141: type, preference, surface, then curve, sense and pcurves of each edge.
        141 => {
            record.skip(3)?;
            let count = record.count()?;
            let edges = record.required(count, |r| Ok((r.integer()?, r.integer()?, r.pointers()?)))?;
            for (curve, sense, flats) in edges {
                let read = curves::read(file, curve, &placement)?;
                space.extend(directed(read, sense == 2));
                pcurves(&flats, &mut flat);
            }
        }
        // 508: for each edge whether it is a vertex, list and index, sense, and its pcurves.
        508 => {
            let count = record.count()?;
            let edges = record.required(count, |r| {
                let edge = (r.integer()?, r.integer()?, r.count()?, r.integer()?);
                let count = r.count()?;
                let flats = r.required(count, |r| {
                    r.skip(1)?;
                    r.integer()
                })?;
                Ok((edge, flats))
            })?;
            for ((is_vertex, list, index, along), flats) in edges {
                // A vertex stands for a pole, which is a way in the parameter plane alone.
                if is_vertex != 1 {
                    let read = curves::read(file, lists.curve(list, index)?, &placement)?;
                    space.extend(directed(read, along == 0));
                }
                pcurves(&flats, &mut flat);
            }
        }
        kind => return Err(Fault::Kind { de, kind, wanted: "a bound" }),
    }
    if !complete {
        flat.clear();
    }
    Ok((space, flat))
}

fn directed(curves: Vec<Curve3>, backwards: bool) -> Vec<Curve3> {
    if !backwards {
        return curves;
    }
    curves.iter().rev().map(Curve3::reversed).collect()
}
