//! One fitted surface for each region that can be laid out in the plane.

use std::path::Path;

use claymill_exchange::{Group, write_glb, write_iges, write_step};
use claymill_nurbs::{Face, Model, Source, SurfaceKind};
use claymill_surface_merge::{DriveSurface, Merge, NoDriveSurface, RegionMesh};
use claymill_viewer::Rgb;
use rayon::prelude::*;
use serde::Serialize;

use super::export::ExportFormat;
use crate::console::outln;
use crate::failure::Failure;

/// Fits are refined until they are this near to the faces, or cannot be refined further, mm.
const TOLERANCE_MM: f64 = 0.1;
/// Triangle edges across a region, and their bounds, mm.
const EDGES_ACROSS: f64 = 150.0;
const EDGE_MM: (f64, f64) = (0.5, 10.0);
/// Triangles of a glTF leave the surfaces by no more than this, mm.
const DEVIATION_MM: f64 = 0.05;

/// What became of a region's drive surface.
#[derive(Debug, Serialize)]
pub(crate) struct DriveRecord {
    region: usize,
    deviation_max_mm: Option<f64>,
    deviation_rms_mm: Option<f64>,
    /// Why there is none.
    why_not: Option<String>,
}

/// Fits and writes the drive surfaces, in the colours of their regions.
pub(crate) fn write(
    path: &Path,
    format: ExportFormat,
    model: &Model,
    merged: &Merge,
    colours: &[Rgb],
) -> Result<Vec<DriveRecord>, Failure> {
    let fits: Vec<Result<DriveSurface, NoDriveSurface>> = merged
        .regions
        .par_iter()
        .map(|region| {
            let edge_mm = (region.area_mm2.sqrt() / EDGES_ACROSS).clamp(EDGE_MM.0, EDGE_MM.1);
            RegionMesh::of_region(model, merged, region.id, edge_mm)?.drive_surface(TOLERANCE_MM)
        })
        .collect();
    let mut drives = Model { tolerance_mm: model.tolerance_mm, ..Model::default() };
    let (mut groups, mut records) = (Vec::new(), Vec::new());
    for (region, fit) in fits.into_iter().enumerate() {
        let (deviations, why_not) = match fit {
            Ok(DriveSurface { surface, loops, deviation_max_mm, deviation_rms_mm }) => {
                let faces = vec![drives.faces.len()];
                let colour = colours.get(region).copied();
                groups.push(Group { name: format!("drive surface {region}"), colour, faces });
                drives.faces.push(Face {
                    surface,
                    loops,
                    reversed: false,
                    kind: SurfaceKind::Nurbs,
                    source: Source::default(),
                });
                (Some([deviation_max_mm, deviation_rms_mm]), None)
            }
            Err(why) => (None, Some(why.to_string())),
        };
        let [deviation_max_mm, deviation_rms_mm] =
            deviations.map_or([None, None], |[max, rms]| [Some(max), Some(rms)]);
        records.push(DriveRecord { region, deviation_max_mm, deviation_rms_mm, why_not });
    }
    match format {
        ExportFormat::Iges => write_iges(path, &drives, &groups)?,
        ExportFormat::Step => write_step(path, &drives, &groups)?,
        ExportFormat::Glb => {
            let drawn: Vec<usize> =
                (0..records.len()).filter(|&r| records[r].deviation_max_mm.is_some()).collect();
            for (drive, reason) in write_glb(path, &drives, &groups, &[], DEVIATION_MM)? {
                let record = &mut records[drawn[drive]];
                (record.deviation_max_mm, record.deviation_rms_mm) = (None, None);
                record.why_not = Some(reason.to_string());
            }
        }
    }
    Ok(records)
}

/// A line for each region.
pub(crate) fn print(records: &[DriveRecord]) {
    for r in records {
        match (r.deviation_max_mm, r.deviation_rms_mm, &r.why_not) {
            (Some(max), Some(rms), _) => {
                outln!(
                    "drive surface of region {:>3}: off by {max:.3} mm at most, {rms:.4} mm rms",
                    r.region
                );
            }
            (_, _, Some(why)) => outln!("no drive surface of region {:>3}: {why}", r.region),
            _ => {}
        }
    }
}
