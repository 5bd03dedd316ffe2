//! The directions from which a model can be cut.

use claymill_nurbs::Vector3;
use claymill_toolpath::Job;

/// Axes closer than this are one direction.
const SAME: f64 = 1e-9;

/// Tool axes, from tip to holder: those of the job's setups, in their order, then what else the model could be cut from: the
/// setups that were asked for, or else above and the four sides. Whether a place can be reached does not depend on which setups a
/// strategy has made use of.
pub(crate) fn directions(job: &Job) -> Vec<Vector3> {
    let mut all: Vec<Vector3> = job.setups.iter().map(|s| Vector3::from(s.axis).normalize()).collect();
    let named = axis(&job.request.up).zip(axis(&job.request.length));
    let five = named.into_iter().flat_map(|(up, front)| {
        let left = up.cross(&front);
        [up, left, -left, front, -front]
    });
    let asked: Vec<Vector3> = match job.request.setups.is_empty() {
        true => five.collect(),
        false => job.request.setups.iter().map(|s| Vector3::from(s.axis)).collect(),
    };
    for direction in asked.into_iter().filter(|d| (d.norm() - 1.0).abs() < SAME) {
        if all.iter().all(|known| (known - direction).norm() > SAME) {
            all.push(direction);
        }
    }
    all
}

/// The direction of an axis as jobs name it, `+z`.
pub(crate) fn axis(name: &str) -> Option<Vector3> {
    let sign = match name.as_bytes().first()? {
        b'+' => 1.0,
        b'-' => -1.0,
        _ => return None,
    };
    let unit = match name.get(1..)? {
        "x" => Vector3::x(),
        "y" => Vector3::y(),
        "z" => Vector3::z(),
        _ => return None,
    };
    Some(unit * sign)
}
