//! Values of materials and stages that make no sense by themselves.

use super::condition::Condition;
use super::files::{Material, ProcessFile, StageKind, StageValues};
use crate::error::{Fault, one_line};

/// No length of a stage is larger, mm.
const LARGEST_MM: f64 = 1e4;
/// No feed is faster, mm/min.
const FASTEST: f64 = 1e7;

pub(super) fn check_material(material: &Material) -> Result<(), Fault> {
    check_name(&material.name)?;
    material.also.iter().try_for_each(|name| check_name(name))?;
    positive("web_mm", material.web_mm, LARGEST_MM)?;
    range("layer_mm", material.layer_mm, LARGEST_MM)?;
    range("armature_mm", material.armature_mm, LARGEST_MM)?;
    range("feed_mm_per_min", material.feed_mm_per_min, FASTEST)?;
    if !(0.0..=1e3).contains(&material.wear) {
        return Err(Fault::new(
            format!("a wear of {} is not from 0 to 1000", material.wear),
            "Give the seconds that a second of cutting costs in tools, for example wear = 0.05.",
        ));
    }
    if let (Some([thin, _]), Some([from, _])) = (material.layer_mm, material.armature_mm)
        && thin > from
    {
        return Err(Fault::new(
            format!(
                "a layer of at least {thin} mm does not fit over an armature {from} mm below the surface"
            ),
            "Correct `layer_mm` or `armature_mm`.",
        ));
    }
    material.stages.iter().try_for_each(|(kind, values)| check_stage(*kind, values))
}

pub(super) fn check_process(process: &ProcessFile) -> Result<(), Fault> {
    check_name(&process.name)?;
    if let Some(when) = &process.when {
        check_condition(when)?;
    }
    process.stages.iter().try_for_each(|(kind, values)| check_stage(*kind, values))
}

/// Refuses values of one file that no other file could mend.
pub(super) fn check_stage(kind: StageKind, values: &StageValues) -> Result<(), Fault> {
    let of_stage = |f: Fault| Fault::new(format!("stage {kind}: {}", f.what), f.remedy);
    check_values(kind, values).map_err(of_stage)
}

fn check_values(kind: StageKind, values: &StageValues) -> Result<(), Fault> {
    if let Some(mm) = values.allowance_mm.filter(|mm| !(0.0..=LARGEST_MM).contains(mm)) {
        return Err(Fault::new(
            format!("an allowance of {mm} mm is not from 0 to {LARGEST_MM}"),
            "Correct `allowance_mm`; it is what the stage leaves on the surface.",
        ));
    }
    positive("band_mm", values.band_mm, LARGEST_MM)?;
    positive("scallop_mm", values.scallop_mm, LARGEST_MM)?;
    positive("step_mm", values.step_mm, LARGEST_MM)?;
    positive("step_radii", values.step_radii, 2.0)?;
    positive("depth_mm", values.depth_mm, LARGEST_MM)?;
    positive("engagement_deg", values.engagement_deg, 180.0)?;
    positive("feed_mm_per_min", values.feed_mm_per_min, FASTEST)?;
    range("radius_mm", values.radius_mm, LARGEST_MM)?;
    let spacings =
        [("scallop_mm", values.scallop_mm), ("step_mm", values.step_mm), ("step_radii", values.step_radii)];
    let given: Vec<&str> = spacings.iter().filter(|(_, v)| v.is_some()).map(|(name, _)| *name).collect();
    if given.len() > 1 {
        return Err(excluding(&given.join("` and `"), "they both give the distance of passes"));
    }
    let is_id = values.tool.as_deref().is_some_and(|t| t != "auto");
    if is_id && values.radius_mm.is_some() {
        return Err(excluding("tool` and `radius_mm", "a tool that is named has its radius"));
    }
    if values.tool.as_deref().is_some_and(str::is_empty) {
        return Err(Fault::new("the tool has no id", "Give an id of the library, or auto."));
    }
    if values.cut.is_some() && kind != StageKind::Rough {
        return Err(Fault::new("`cut` is for roughing only", "Leave `cut` out."));
    }
    values.when.as_deref().map_or(Ok(()), check_condition)
}

fn excluding(names: &str, why: &str) -> Fault {
    Fault::new(format!("`{names}` exclude each other: {why}"), "Keep one of them.")
}

fn check_condition(text: &str) -> Result<(), Fault> {
    Condition::parse(text).map(|_| ()).map_err(|e| {
        Fault::new(e.to_string(), "Write comparisons joined by & and |, for example material = clay.")
    })
}

fn check_name(name: &str) -> Result<(), Fault> {
    let fitting = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_.".contains(c);
    if (1..=40).contains(&name.len()) && name.chars().all(fitting) {
        return Ok(());
    }
    Err(Fault::new(
        format!("`{}` is no name of 1 to 40 lower-case letters, digits, `-`, `_` and `.`", one_line(name)),
        "Correct `name`, for example hard-clay.",
    ))
}

fn positive(field: &str, value: Option<f64>, most: f64) -> Result<(), Fault> {
    match value.filter(|v| !(*v > 0.0 && *v <= most)) {
        None => Ok(()),
        Some(v) => Err(Fault::new(
            format!("`{field}` is {v}, which is not above 0 and at most {most}"),
            format!("Correct `{field}`, or leave it out to inherit it."),
        )),
    }
}

fn range(field: &str, value: Option<[f64; 2]>, most: f64) -> Result<(), Fault> {
    let Some([low, high]) = value else { return Ok(()) };
    positive(field, Some(low), most)?;
    positive(field, Some(high), most)?;
    if low > high {
        return Err(Fault::new(
            format!("`{field}` begins at {low} and ends at {high}"),
            "Put the smaller value first.",
        ));
    }
    Ok(())
}
