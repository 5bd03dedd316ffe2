//! The Rhino reader: openNURBS archives (3dm) of versions 2 to 8.
//!
//! ```text
//!   archive (chunks) ─ tables ─┬─ units, layers, blocks
//!                              └─ records ─ class ─ placed: which objects, where
//!                                                     │
//!        curves, surfaces (exact NURBS + warp) ─ brep, extrusion ─ body ─ faces ─ trim ─► Face
//! ```
//!
//! The layout of the format is that of the openNURBS toolkit (<https://github.com/mcneel/opennurbs>), from which
//! the facts were taken. Meshes are skipped as whole chunks, so that nothing is ever decompressed.

mod archive;
mod attributes;
mod blocks;
mod body;
mod brep;
mod class;
mod context;
mod curves;
#[cfg(test)]
mod damage;
mod extrusion;
mod faces;
mod fault;
mod layers;
mod object;
mod placed;
mod surfaces;
mod tables;
mod units;

use std::collections::BTreeMap;
use std::path::Path;

use claymill_nurbs::{Model, Source};
use nalgebra::Matrix4;
use rayon::prelude::*;

use crate::plausible::LARGEST_TOLERANCE_MM;
use crate::{Format, Import, ImportReport, ReadError, Skipped, Units};

pub(crate) use archive::MAGIC;

use body::Body;
use context::Context;
use faces::{Made, Site};
use fault::Fault;
use placed::Placed;
use tables::Tables;

/// Archive versions that can be read; from version 5 on they are counted in tens.
const VERSIONS: [u32; 8] = [2, 3, 4, 5, 50, 60, 70, 80];
/// Before this version of the toolkit edges had no domain of their own.
const EDGE_DOMAINS_SINCE: i64 = 200_206_180;
/// Archives from this version on always have them.
const EDGE_DOMAINS_VERSION: u32 = 4;

/// A face to be built.
struct Job<'a> {
    placed: &'a Placed,
    /// Number of `placed` among all.
    ordinal: u64,
    body: &'a Body,
    face: usize,
    fault: Option<Fault>,
}

/// Reads a 3dm file.
pub(crate) fn read(bytes: &[u8], path: &Path) -> Result<Import, ReadError> {
    read_checked(bytes, path, true)
}

/// As [`read`]; without checksums damage goes deeper, as tests want it.
fn read_checked(bytes: &[u8], path: &Path, checked: bool) -> Result<Import, ReadError> {
    let version = archive::version(bytes).ok_or_else(|| ReadError::Damaged {
        path: path.into(),
        entity: "header".into(),
        what: "the version of the archive is not a number".into(),
    })?;
    if !VERSIONS.contains(&version) {
        let what = format!("3dm archive of version {version}");
        return Err(ReadError::Unsupported { path: path.into(), what });
    }
    let tables = Tables::read(bytes, version, checked);
    if tables.records.is_empty() && !tables.complete {
        let what = "the table of objects is missing".into();
        return Err(ReadError::Truncated { path: path.into(), what });
    }
    let mut report = ImportReport::new(Format::Rhino3dm);
    report.system.clone_from(&tables.system);
    let mm = tables.units.mm_per_unit;
    report.units = Units { declared: tables.units.declared.clone(), mm_per_unit: mm };
    report.tolerance_mm = (tables.units.tolerance * mm).min(LARGEST_TOLERANCE_MM);
    report.warnings.clone_from(&tables.warnings);
    report.warnings.extend(tables.units.warning.clone());

    let old_toolkit = (1..EDGE_DOMAINS_SINCE).contains(&tables.toolkit);
    let context = Context::new(version < 3 || version < EDGE_DOMAINS_VERSION && old_toolkit, bytes.len());
    let placed = placed::all(&tables, bytes.len());
    let bodies = bodies(&tables, &placed, &context);
    let jobs = jobs(&placed, &bodies, &context);
    let names = Names { tables: &tables };
    let made: Vec<_> = jobs
        .par_iter()
        .map(|job| match job {
            Ok(job) => build(job, mm, report.tolerance_mm, &names),
            Err((_, fault)) => Err(fault.clone()),
        })
        .collect();

    let mut model = Model { tolerance_mm: report.tolerance_mm, ..Model::default() };
    report.faces_in_file = made.len();
    let mut used = vec![false; tables.records.len()];
    for (job, made) in jobs.iter().zip(made) {
        let placed = match job {
            Ok(job) => job.placed,
            Err((placed, _)) => placed,
        };
        match made {
            Ok(made) => {
                used[placed.record] = true;
                placed.through.iter().for_each(|r| used[*r] = true);
                model.faces.push(made.face);
                report.repairs.extend(made.repairs);
            }
            Err(fault) => report.skipped.push(Skipped {
                entity: names.entity(placed, job.as_ref().ok().map(|j| j.face)),
                what: names.class(placed.record).into(),
                reason: fault.to_string(),
                advice: fault.advice().into(),
            }),
        }
    }
    report.faces_read = model.faces.len();
    for (record, used) in tables.records.iter().zip(used) {
        let Ok((object, _)) = &record.object else { continue };
        let count = report.entities.entry(object.class.name().into()).or_default();
        count.in_file += 1;
        count.used += usize::from(used);
    }
    Ok(Import { model, report })
}

/// The bodies of all objects that are placed, by record.
fn bodies(tables: &Tables, placed: &[Placed], context: &Context) -> BTreeMap<usize, Result<Body, Fault>> {
    let mut bodies = BTreeMap::new();
    for record in placed.iter().filter(|p| p.fault.is_none()).map(|p| p.record) {
        if let Ok((object, _)) = &tables.records[record].object {
            bodies.entry(record).or_insert_with(|| object::read(object.clone(), context));
        }
    }
    bodies
}

/// The faces to build, in file order; objects that have none to offer stand for one that is missing.
fn jobs<'a>(
    placed: &'a [Placed],
    bodies: &'a BTreeMap<usize, Result<Body, Fault>>,
    context: &Context,
) -> Vec<Result<Job<'a>, (&'a Placed, Fault)>> {
    let mut jobs = Vec::new();
    for (ordinal, placed) in (0..).zip(placed) {
        if let Some(fault) = &placed.fault {
            jobs.push(Err((placed, fault.clone())));
            continue;
        }
        match bodies.get(&placed.record) {
            Some(Ok(body)) => jobs.extend((0..body.faces.len()).map(|face| {
                let weight = body.faces[face].as_ref().map_or(0, |raw| body.weight(raw));
                let fault = context.spend(weight).err();
                Ok(Job { placed, ordinal, body, face, fault })
            })),
            Some(Err(fault)) => jobs.push(Err((placed, fault.clone()))),
            None => {}
        }
    }
    jobs
}

fn build(job: &Job, mm: f64, tolerance_mm: f64, names: &Names) -> Result<Made, Fault> {
    if let Some(fault) = &job.fault {
        return Err(fault.clone());
    }
    let raw = job.body.faces[job.face].as_ref().map_err(Clone::clone)?;
    let placement = Matrix4::new_scaling(mm) * job.placed.placement;
    let site = Site { placement: &placement, tolerance_mm, first_edge: job.ordinal << 32 };
    site.face(job.body, raw, names.source(job, raw.colour))
}

/// What objects are called.
struct Names<'a> {
    tables: &'a Tables<'a>,
}

impl Names<'_> {
    /// The identity of a record, as Rhino shows it.
    fn id(&self, record: usize) -> String {
        match &self.tables.records[record] {
            tables::Record { object: Ok((_, a)), .. } if !a.id.is_nil() => a.id.to_string(),
            tables::Record { at, .. } => format!("object at byte {at}"),
        }
    }

    fn class(&self, record: usize) -> &'static str {
        self.tables.records[record].object.as_ref().map_or("object", |(object, _)| object.class.name())
    }

    fn entity(&self, placed: &Placed, face: Option<usize>) -> String {
        let mut name = self.id(placed.record);
        if let Some(face) = face {
            name += &format!(" face {face}");
        }
        for through in placed.through.iter().rev().filter(|r| **r != placed.record) {
            name += &format!(" in {}", self.id(*through));
        }
        name
    }

    fn source(&self, job: &Job, face_colour: Option<[u8; 3]>) -> Source {
        let entity = self.entity(job.placed, Some(job.face));
        let Ok((_, attributes)) = &self.tables.records[job.placed.record].object else {
            return Source { entity, ..Source::default() };
        };
        let layers = &self.tables.layers;
        Source {
            entity,
            name: attributes.name.clone(),
            layer: layers.path(attributes.layer),
            colour: face_colour.or(attributes.colour).or_else(|| layers.colour(attributes.layer)),
        }
    }
}
