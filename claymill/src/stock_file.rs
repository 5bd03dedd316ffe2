//! Stock that is in a file: read once for planning, and found again from a job folder.

use std::path::Path;

use claymill_exchange::read_solid;
use claymill_nurbs::{Aabb, ClosedMesh, Inside, Model, ModelMesh, Point3};
use claymill_toolpath::{Stock, StockFile, sha256_of};
use rayon::prelude::*;

use crate::error::Error;
use crate::job_error::JobError;

/// Points of the surface that are asked for, at most.
const MOST_POINTS: usize = 20_000;
/// The surface may lie outside of its stock by this, mm: castings and what was cut before have their tolerances.
const LACK_MM: f64 = 0.1;
/// Faces are within this of the points that are asked for, mm.
const SAMPLE_DEVIATION_MM: f64 = 0.05;

/// A stock with what its file encloses, if it is in one.
#[derive(Debug, Clone)]
pub(crate) struct ReadStock {
    /// With digest and box of its file.
    pub(crate) record: Stock,
    /// What the file encloses.
    pub(crate) solid: Option<ClosedMesh>,
}

impl ReadStock {
    /// Reads the file of a stock, as seen from a job folder.
    ///
    /// # Errors
    /// It cannot be read, encloses nothing, or is another one than it was.
    pub(crate) fn of(record: &Stock, folder: &Path) -> Result<Self, Error> {
        let Stock::File(file) = record else {
            return Ok(ReadStock { record: record.clone(), solid: None });
        };
        let path = file.find(folder);
        let sha256 = sha256_of(&path)?;
        if !file.sha256.is_empty() && file.sha256 != sha256 {
            return Err(JobError::StockChanged { path }.into());
        }
        let solid = read_solid(&path, file.unit_mm)?;
        let box_mm = Some(Aabb::of(&solid.points).corners());
        let record = Stock::File(StockFile { sha256, box_mm, ..file.clone() });
        Ok(ReadStock { record, solid: Some(solid) })
    }

    /// A sentence on the surface that lies outside of what the file encloses, if some of it does.
    pub(crate) fn lack(&self, model: &Model) -> Option<String> {
        let solid = Inside::new(self.solid.as_ref()?);
        let points = ModelMesh::of(model, SAMPLE_DEVIATION_MM).points;
        let every = points.len().div_ceil(MOST_POINTS).max(1);
        let asked: Vec<&Point3> = points.iter().step_by(every).collect();
        let outside = |p: &&Point3| {
            let missing_mm = if solid.contains(p) { 0.0 } else { solid.distance_mm(p, f64::MAX.sqrt()) };
            (missing_mm > LACK_MM).then_some((missing_mm, **p))
        };
        let lacking: Vec<(f64, Point3)> = asked.par_iter().filter_map(outside).collect();
        let (most_mm, at) = lacking.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(format!(
            "the stock lacks material: of {} points on the surface {} lie more than {LACK_MM} mm outside of it, by up to {most_mm:.2} mm at ({:.1}, {:.1}, {:.1})",
            asked.len(),
            lacking.len(),
            at.x,
            at.y,
            at.z
        ))
    }
}
