//! What regions are made by: the preset, other limits, and wishes.

use clap::Args;
use claymill::Merging;
use claymill_surface_merge::{Absorption, CurvatureLimit, Limits, Preset};
use serde::{Deserialize, Deserializer, Serialize};

use crate::args::JOINING;
use crate::failure::Failure;

/// Farther apart edges are no neighbours whatever the file, mm.
const LARGEST_TOLERANCE_MM: f64 = 10.0;

/// Limits other than the preset's, and what goes before all limits.
#[derive(Debug, Clone, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct MergingArgs {
    /// Edges within this distance are neighbours [default: found from the gaps of the model].
    #[arg(help_heading = JOINING, long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) joint_tolerance: Option<f64>,
    /// Largest gap along the normal across which faces merge [default: the preset's].
    #[arg(help_heading = JOINING, long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) joint_gap: Option<f64>,
    /// Largest gap in the tangent plane across which faces merge [default: the preset's].
    #[arg(help_heading = JOINING, long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) joint_lateral_gap: Option<f64>,
    /// Largest angle between normals, for faces alone and, after a colon, for whole borders of regions: 0.5:1
    /// [default: the preset's; without a colon as many times higher for borders as in the preset].
    #[arg(help_heading = JOINING, long, value_name = "DEG[:DEG]", allow_hyphen_values = true)]
    #[serde(deserialize_with = "text_or_number")]
    pub(crate) joint_angle: Option<String>,
    /// Largest curvature jump R·|Δκ|, in the same way [default: the preset's; twice as high for borders].
    #[arg(
        help_heading = JOINING,
        long,
        value_name = "X[:X]",
        allow_hyphen_values = true,
        conflicts_with = "joint_relative_curvature"
    )]
    #[serde(deserialize_with = "text_or_number")]
    pub(crate) joint_curvature: Option<String>,
    /// Largest relative difference of curvatures, in the same way.
    #[arg(help_heading = JOINING, long, value_name = "X[:X]", allow_hyphen_values = true)]
    #[serde(deserialize_with = "text_or_number")]
    pub(crate) joint_relative_curvature: Option<String>,
    /// Keep faces apart whatever their joints: `layer` or `colour` (each by itself), or some from all others:
    /// `layer:NAME`, `colour:#RRGGBB`, `face:10-20`, several with commas; may be repeated.
    #[arg(help_heading = JOINING, long, value_name = "WHAT")]
    pub(crate) keep_apart: Vec<String>,
    /// Join these faces over every joint among them, creases too: `layer:NAME`, `colour:#RRGGBB`, `face:10-20`,
    /// several with commas; may be repeated.
    #[arg(help_heading = JOINING, long, value_name = "WHAT")]
    pub(crate) keep_together: Vec<String>,
    /// Regions of a smaller area join the neighbour that they run into most smoothly.
    #[arg(help_heading = JOINING, long, value_name = "MM2", allow_negative_numbers = true)]
    pub(crate) absorb_area: Option<f64>,
    /// Narrower regions too.
    #[arg(help_heading = JOINING, long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) absorb_width: Option<f64>,
}

impl MergingArgs {
    /// These before others.
    pub(crate) fn or(self, other: MergingArgs) -> MergingArgs {
        let list = |a: Vec<String>, b: Vec<String>| if a.is_empty() { b } else { a };
        // One measure of curvature decides: naming one drops the other.
        let own = self.joint_curvature.is_some() || self.joint_relative_curvature.is_some();
        let curvature = |a: Option<String>, b: Option<String>| if own { a } else { b };
        MergingArgs {
            joint_tolerance: self.joint_tolerance.or(other.joint_tolerance),
            joint_gap: self.joint_gap.or(other.joint_gap),
            joint_lateral_gap: self.joint_lateral_gap.or(other.joint_lateral_gap),
            joint_angle: self.joint_angle.or(other.joint_angle),
            joint_curvature: curvature(self.joint_curvature, other.joint_curvature),
            joint_relative_curvature: curvature(
                self.joint_relative_curvature,
                other.joint_relative_curvature,
            ),
            keep_apart: list(self.keep_apart, other.keep_apart),
            keep_together: list(self.keep_together, other.keep_together),
            absorb_area: self.absorb_area.or(other.absorb_area),
            absorb_width: self.absorb_width.or(other.absorb_width),
        }
    }

    /// What regions are made by: `preset` with these in its place.
    pub(crate) fn merging(&self, preset: Preset) -> Result<Merging, Failure> {
        let mut options = preset.options();
        let positive = |name: &str, value: Option<f64>| match value {
            Some(v) if !(v > 0.0 && v.is_finite()) => Err(Failure::usage(
                format!("--{name} {v} must be positive"),
                "Leave it out for the preset's.",
            )),
            value => Ok(value),
        };
        options.tolerance_mm = positive("joint-tolerance", self.joint_tolerance)?;
        if let Some(mm) = options.tolerance_mm.filter(|mm| *mm > LARGEST_TOLERANCE_MM) {
            return Err(Failure::usage(
                format!("--joint-tolerance {mm}: faces that far apart are no neighbours"),
                format!("At most {LARGEST_TOLERANCE_MM} mm; leave it out to have it found from the gaps."),
            ));
        }
        let gap = positive("joint-gap", self.joint_gap)?;
        let lateral = positive("joint-lateral-gap", self.joint_lateral_gap)?;
        let angles = self.joint_angle.as_deref().map(|text| pair("joint-angle", text)).transpose()?;
        let curvature = self.curvature()?;
        let ratio = options.high.angle_deg / options.low.angle_deg;
        for (k, limits) in [&mut options.low, &mut options.high].into_iter().enumerate() {
            let Limits { gap_normal_mm, gap_lateral_mm, angle_deg, .. } = *limits;
            limits.gap_normal_mm = gap.unwrap_or(gap_normal_mm);
            limits.gap_lateral_mm = lateral.unwrap_or(gap_lateral_mm);
            limits.angle_deg = angles
                .map_or(angle_deg, |(low, high)| if k == 0 { low } else { high.unwrap_or(ratio * low) });
            if let Some(limit) = curvature {
                limits.curvature = limit[k];
            }
        }
        let [area, width] =
            [positive("absorb-area", self.absorb_area)?, positive("absorb-width", self.absorb_width)?];
        options.absorption = (area.is_some() || width.is_some())
            .then(|| Absorption { area_mm2: area.unwrap_or(0.0), width_mm: width.unwrap_or(0.0) });
        Ok(Merging {
            options,
            keep_apart: self.keep_apart.clone(),
            keep_together: self.keep_together.clone(),
        })
    }

    fn curvature(&self) -> Result<Option<[CurvatureLimit; 2]>, Failure> {
        let limits = |name, text: &Option<String>, limit: fn(f64) -> CurvatureLimit| {
            let parsed = text.as_deref().map(|text| pair(name, text)).transpose()?;
            Ok::<_, Failure>(parsed.map(|(low, high)| [limit(low), limit(high.unwrap_or(2.0 * low))]))
        };
        let machining = limits("joint-curvature", &self.joint_curvature, CurvatureLimit::Machining)?;
        let relative =
            limits("joint-relative-curvature", &self.joint_relative_curvature, CurvatureLimit::Relative)?;
        Ok(machining.or(relative))
    }
}

/// In a job file a limit may be written as a number too.
fn text_or_number<'de, D: Deserializer<'de>>(file: D) -> Result<Option<String>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Limit {
        Text(String),
        Number(f64),
    }
    let limit = Option::<Limit>::deserialize(file)?;
    Ok(limit.map(|limit| match limit {
        Limit::Text(text) => text,
        Limit::Number(number) => number.to_string(),
    }))
}

/// `LOW` or `LOW:HIGH`.
fn pair(name: &str, text: &str) -> Result<(f64, Option<f64>), Failure> {
    let number = |t: &str| t.trim().parse::<f64>().ok().filter(|v| *v > 0.0 && v.is_finite());
    let parsed = match text.split_once(':') {
        None => number(text).map(|low| (low, None)),
        Some((low, high)) => number(low).zip(number(high)).map(|(low, high)| (low, Some(high))),
    };
    let parsed = parsed.filter(|(low, high)| high.is_none_or(|high| high >= *low));
    parsed.ok_or_else(|| {
        Failure::usage(
            format!("--{name} {text}: not a limit"),
            format!("Write --{name} 0.5, or --{name} 0.5:1 with the higher limit for whole borders."),
        )
    })
}

#[cfg(test)]
mod tests {
    use crate::args::JobOptions;

    #[test]
    fn job_files_need_not_name_these_options_but_may() {
        let old: JobOptions = toml::from_str("tool = \"ball:6\"\nup = \"+z\"").unwrap();
        assert_eq!(old.merging, super::MergingArgs::default());
        let new: JobOptions =
            toml::from_str("joint_angle = 0.7\nkeep_apart = [\"layer\"]\nup = \"+z\"").unwrap();
        assert_eq!(new.merging.joint_angle.as_deref(), Some("0.7"));
        assert_eq!((new.merging.keep_apart.len(), new.axes.up.as_deref()), (1, Some("+z")));
        let again: JobOptions = toml::from_str(&toml::to_string(&new).unwrap()).unwrap();
        assert_eq!(again.merging, new.merging);
        let wrong = toml::from_str::<JobOptions>("joint_angel = 0.7").unwrap_err();
        assert!(wrong.to_string().contains("joint_angel"), "{wrong}");
    }
}
