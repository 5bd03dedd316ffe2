//! `claymill diff`: what differs between the model of a job and another one, and what of the job that touches.

use std::collections::BTreeMap;
use std::process::ExitCode;

use claymill::{Changed, Difference, difference};
use claymill_nurbs::FaceId;
use claymill_toolpath::{read_job, read_regions};
use serde::Serialize;

use super::{Context, region_of_face};
use crate::args::DiffArgs;
use crate::console::{counted, outln};
use crate::failure::Failure;

/// Rows of each table at most; `--json` has all.
const LISTED: usize = 20;

/// What `claymill diff --json` prints.
#[derive(Serialize)]
struct Summary<'a> {
    #[serde(flatten)]
    difference: &'a Difference,
    /// The farthest that any face has moved, mm.
    moved_mm: f64,
    /// Regions of the job with faces that were changed or removed.
    regions: Vec<TouchedRegion>,
}

/// A region that is not as it was.
#[derive(Serialize)]
struct TouchedRegion {
    region: usize,
    faces: usize,
    area_mm2: f64,
    /// How long the job is in this region, s.
    time_s: f64,
}

/// `claymill diff`.
pub(crate) fn diff(context: &Context, args: &DiffArgs) -> Result<ExitCode, Failure> {
    let job = read_job(&args.job)?;
    let before = context.load_of_job(&args.job, &job, args.old_model.as_deref())?;
    let after = context.load(&args.model, job.model.mirror)?;
    context.console.stage("comparing");
    let found = difference(&before, &after);
    context.console.finish();
    let of_face = region_of_face(&read_regions(&args.job)?, before.model().faces.len())?;
    let gone = found.changed.iter().map(|c| c.before).chain(found.removed.iter().map(|at| at.face));
    let mut touched: BTreeMap<usize, Vec<FaceId>> = BTreeMap::new();
    for face in gone {
        touched.entry(of_face[face]).or_default().push(face);
    }
    let region = |(region, faces): (usize, Vec<FaceId>)| TouchedRegion {
        region,
        faces: faces.len(),
        area_mm2: faces.iter().map(|&face| before.face_area_mm2[face]).sum(),
        time_s: job.regions.iter().filter(|totals| totals.region == region).map(|totals| totals.time_s).sum(),
    };
    let regions: Vec<TouchedRegion> = touched.into_iter().map(region).collect();
    if context.json {
        context.print_json(&Summary { difference: &found, moved_mm: found.moved_mm(), regions })?;
    } else {
        say(&found, &regions);
    }
    Ok(ExitCode::SUCCESS)
}

fn say(found: &Difference, regions: &[TouchedRegion]) {
    let square_metres = |mm2: f64| format!("{:.4} m²", mm2 * 1e-6);
    // Of nothing it is a negative nothing.
    let sum = |areas: &mut dyn Iterator<Item = f64>| square_metres(areas.sum::<f64>() + 0.0);
    outln!("unchanged {}, {}", counted(found.unchanged, "face"), square_metres(found.unchanged_mm2));
    let Difference { added, removed, changed, .. } = found;
    outln!("added     {}, {}", counted(added.len(), "face"), sum(&mut added.iter().map(|at| at.area_mm2)));
    outln!(
        "removed   {}, {}",
        counted(removed.len(), "face"),
        sum(&mut removed.iter().map(|at| at.area_mm2))
    );
    outln!(
        "changed   {}, {}, moved by up to {:.4} mm",
        counted(changed.len(), "face"),
        sum(&mut changed.iter().map(|c| c.after.area_mm2)),
        found.moved_mm()
    );
    let mut farthest: Vec<&Changed> = changed.iter().collect();
    farthest.sort_by(|a, b| b.moved_mm.total_cmp(&a.moved_mm).then(a.before.cmp(&b.before)));
    if !farthest.is_empty() {
        outln!("\n  face before   face now    moved, mm    area, mm²  entity");
    }
    for Changed { before, after, moved_mm } in farthest.iter().take(LISTED) {
        let (face, area_mm2, entity) = (after.face, after.area_mm2, &after.entity);
        outln!("  {before:>11} {face:>10} {moved_mm:>12.4} {area_mm2:>12.1}  {entity}");
    }
    if farthest.len() > LISTED {
        outln!("  ... and {} more; --json lists all", farthest.len() - LISTED);
    }
    if !regions.is_empty() {
        outln!("\n  region of the job   faces    area, mm²   time of the job, min");
    }
    for TouchedRegion { region, faces, area_mm2, time_s } in regions.iter().take(LISTED) {
        outln!("  {region:>17} {faces:>7} {area_mm2:>12.1} {:>22.1}", time_s / 60.0 + 0.0);
    }
}
