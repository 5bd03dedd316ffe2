//! Limits of what values a job can hold: what is read from a file may be anything.

use crate::holder::LONGEST_MM;
use crate::{Holder, Job, LATEST_FORMAT_VERSION, Move, MoveError, RegionsFile, ToolRecord};

/// Coordinates of the tool lie no farther from zero than this, mm: 10 km.
const FARTHEST_MM: f64 = 1e7;
/// No move is faster, mm/min: 100 times what a quick mill does.
const FASTEST_MM_PER_MIN: f64 = 1e7;
/// No distance that is to be kept from something is larger, mm.
const LARGEST_CLEARANCE_MM: f64 = 1e4;
/// Heights for rapids lie no farther above the model than this, beside its own size, mm.
const HIGHEST_ABOVE_MM: f64 = 1e4;
/// Accelerations and jerks of machines, mm/s² and mm/s³.
const DYNAMICS: (f64, f64) = (1e-3, 1e9);
/// Moves and regions have no larger numbers.
const LARGEST_NUMBER: u64 = 1 << 50;
/// Unit vectors are so long.
const UNIT: (f64, f64) = (0.999, 1.001);

/// The first value of a job that no job has, in words: what is read from a file may be anything.
pub(crate) fn implausible(job: &Job) -> Option<String> {
    let r = &job.request;
    let b = &job.model.box_mm;
    let size = [0, 1, 2].map(|k| b[k + 3] - b[k]);
    let far = |v: &f64| v.abs() > FARTHEST_MM;
    if b.iter().any(far) || size.iter().any(|s| *s < 0.0) {
        return Some(format!("model.box_mm is {b:?}, which is no box of a model"));
    }
    let within = |name: &str, value: f64, low: f64, high: f64| {
        (!(low..=high).contains(&value))
            .then(|| format!("{name} is {value}: it must be from {low} to {high}"))
    };
    let rate = |name, value| within(name, value, 1e-3, FASTEST_MM_PER_MIN);
    let distance = |name, value| within(name, value, 0.0, LARGEST_CLEARANCE_MM);
    let dynamic = |name, value| within(name, value, DYNAMICS.0, DYNAMICS.1);
    let asked = rate("request.feed_mm_per_min", r.feed_mm_per_min)
        .or_else(|| rate("request.rapid_mm_per_min", r.rapid_mm_per_min))
        .or_else(|| within("request.scallop_mm", r.scallop_mm, 1e-6, 1e3))
        .or_else(|| distance("request.stock_above_mm", r.stock_above_mm))
        .or_else(|| r.rest_above_mm.and_then(|mm| distance("request.rest_above_mm", mm)))
        .or_else(|| within("request.allowance_mm", r.allowance_mm, -1e3, 1e3))
        .or_else(|| distance("request.holder_clearance_mm", r.holder_clearance_mm))
        .or_else(|| distance("request.bounds.avoid_mm", r.bounds.avoid_mm))
        .or_else(|| within("request.bounds.extend_mm", r.bounds.extend_mm, 0.0, LONGEST_MM))
        .or_else(|| dynamic("request.machine.acceleration_mm_per_s2", r.machine.acceleration_mm_per_s2))
        .or_else(|| dynamic("request.machine.jerk_mm_per_s3", r.machine.jerk_mm_per_s3))
        .or_else(|| distance("request.machine.corner_mm", r.machine.corner_mm));
    if asked.is_some() {
        return asked;
    }
    if let Some(place) = r.guides.iter().find(|place| place.iter().any(far)) {
        return Some(format!("request.guides has {place:?}, where no model is"));
    }
    for obstacle in &r.check {
        if let Some(what) = within("request.check: unit_mm", obstacle.unit_mm, 1e-9, 1e9) {
            return Some(what);
        }
    }
    let largest = size.iter().fold(0.0_f64, |a, s| a.max(*s));
    for setup in &job.setups {
        let name = &setup.name;
        let length = setup.axis.iter().map(|c| c * c).sum::<f64>().sqrt();
        if !(UNIT.0..=UNIT.1).contains(&length) {
            return Some(format!(
                "the axis of the setup {name} is {:?}, which is no unit vector",
                setup.axis
            ));
        }
        // The model's highest and lowest place along the axis.
        let along =
            |k: usize, up: bool| setup.axis[k] * if (setup.axis[k] > 0.0) == up { b[k + 3] } else { b[k] };
        let [top, bottom] = [true, false].map(|up| (0..3).map(|k| along(k, up)).sum::<f64>());
        let field = format!("clearance_mm of the setup {name}");
        let above = largest + HIGHEST_ABOVE_MM;
        if let Some(what) = within(&field, setup.clearance_mm, bottom - above, top + above) {
            return Some(what);
        }
    }
    let of_operation = |index: usize| {
        let name = &job.operations.get(index)?.name;
        Some(format!("operation {name}: {}", implausible(&job.of_operation(index)?)?))
    };
    let has_version = (job.format_version == LATEST_FORMAT_VERSION) != job.operations.is_empty();
    if !has_version && job.format_version <= LATEST_FORMAT_VERSION {
        return Some(format!(
            "format_version is {}, and it has {} operations: version {LATEST_FORMAT_VERSION} has some, earlier ones none",
            job.format_version,
            job.operations.len()
        ));
    }
    let is_known = |id: &String| job.tools.iter().any(|tool| tool.id == *id);
    if let Some(operation) = job.operations.iter().find(|o| !is_known(&o.tool)) {
        return Some(format!(
            "operation {} has the tool {}, which is not listed",
            operation.name, operation.tool
        ));
    }
    (0..job.operations.len()).find_map(of_operation).or_else(|| job.tools.iter().find_map(of_tool))
}

fn of_tool(tool: &ToolRecord) -> Option<String> {
    let held = tool.holder.as_ref().and_then(|holder| of_holder(&tool.id, holder));
    held.or_else(|| {
        let (setup, mm) =
            tool.setup_stick_out_mm.iter().find(|(_, mm)| !(**mm > 0.0 && **mm <= LONGEST_MM))?;
        Some(format!("{} sticks out {mm} mm in {setup}: it must be above 0 and up to {LONGEST_MM}", tool.id))
    })
}

fn of_holder(tool: &str, holder: &Holder) -> Option<String> {
    let sections = holder.sections.iter();
    let sizes = sections.flat_map(|s| [s.lower_diameter_mm, s.upper_diameter_mm, s.length_mm]);
    let wrong = sizes.chain([holder.stick_out_mm]).find(|mm| !(*mm > 0.0 && *mm <= LONGEST_MM))?;
    Some(format!("the holder of {tool} has a size of {wrong} mm: it must be above 0 and up to {LONGEST_MM}"))
}

/// Refuses a move that no machine makes.
pub(crate) fn check_move(m: &Move) -> Result<(), MoveError> {
    let fault = |what| Err(MoveError::Field { seq: m.seq, what });
    if m.points.iter().flatten().any(|c| c.abs() > FARTHEST_MM) {
        return fault("a control point lies more than 10 km away");
    }
    if m.feed > FASTEST_MM_PER_MIN {
        return fault("the feed is faster than any machine");
    }
    if m.seq > LARGEST_NUMBER || m.region as u64 > LARGEST_NUMBER {
        return fault("its number or its region is beyond all that a job has");
    }
    Ok(())
}

/// The first region of a file that cannot be, in words: they are counted from 0.
pub(crate) fn impossible_region(file: &RegionsFile) -> Option<String> {
    let count = file.regions.len();
    let region = file.regions.iter().find(|r| r.id >= count)?;
    Some(format!("it has {count} regions, and one of them is number {}", region.id))
}
