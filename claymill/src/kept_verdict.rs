//! A verification that is known already: of the same moves, the same job and the same model there is only one.

use claymill_nurbs::{Model, Point3};
use claymill_toolpath::{Job as JobRecord, Judged, Kept, KeyMaker, Monitor, Packed, Program};
use claymill_verify::{CrestSample, Verification, VerifyError, VerifyOptions, verify_keeping};
use serde::{Deserialize, Serialize};

/// What was measured.
#[derive(Serialize, Deserialize)]
struct KeptVerdict {
    verification: Verification,
    /// Foot and height of each crest, mm.
    crests_mm: Packed,
}

/// Measures moves as [`verify_keeping`] does, unless that was done before. The key is of the bytes that were written, of the
/// job and of the model file.
pub(crate) fn verify_or_know(
    kept: &Kept,
    judged: &Judged,
    (model, job, program): (&Model, &JobRecord, &Program),
    monitor: &dyn Monitor,
) -> Result<(Verification, Vec<CrestSample>), VerifyError> {
    let options = VerifyOptions::default();
    let key = || KeyMaker::new("verification").debug(judged).debug(&options).finish();
    let make = || {
        let (verification, crests) = verify_keeping(model, job, program, &options, kept, monitor)?;
        let of_crest = |c: &CrestSample| [c.foot.x, c.foot.y, c.foot.z, c.height_mm];
        Ok::<_, VerifyError>(KeptVerdict {
            verification,
            crests_mm: Packed::doubles(crests.iter().flat_map(of_crest)),
        })
    };
    let KeptVerdict { verification, crests_mm } = kept.part(key, make)?;
    let crest = |[x, y, z, height_mm]: [f64; 4]| CrestSample { foot: Point3::new(x, y, z), height_mm };
    Ok((verification, crests_mm.rows_of_doubles().map(crest).collect()))
}
