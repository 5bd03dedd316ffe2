//! A job as it is asked for, every option checked and every default filled in, before any model is read.

use std::path::{Path, PathBuf};

use claymill::{Job, Preset};
use claymill_controller::Machine;
use claymill_paths::{CLEARANCE_MM, STEEP_DEG, Strategy};
use claymill_toolpath::{HOLDER_CLEARANCE_MM, Holder, Levels, LinkStyle, Tool};

use super::told;
use crate::args::{CutName, JobOptions, LinkName, PresetName, StrategyName};
use crate::failure::Failure;

/// Written instead of a stick-out: the least that does.
pub(super) const LEAST: &str = "auto";
/// Where nothing else is asked for.
pub(super) const USUAL_TOOL: &str = "ball:10";
pub(super) const USUAL_SCALLOP_MM: f64 = 0.1;

/// A job with all defaults filled in.
pub(crate) struct Request {
    pub(super) model: PathBuf,
    pub(super) options: JobOptions,
    pub(super) strategy: StrategyName,
    pub(super) preset: PresetName,
    pub(super) job: Job,
}

impl Request {
    pub(crate) fn new(model: &Path, options: &JobOptions) -> Result<Self, Failure> {
        let tool = options.tool.as_deref().unwrap_or(USUAL_TOOL).parse::<Tool>();
        let tool = tool.map_err(|e| {
            Failure::usage(e, "For example: --tool ball:10, or --tool ball:5,taper:3,length:30,shank:12.")
        })?;
        let rest_of = options.rest_of.as_deref().map(str::parse::<Tool>).transpose();
        let rest_of = rest_of.map_err(|e| Failure::usage(e, "For example: --rest-of ball:10."))?;
        let strategy = options.strategy.unwrap_or(StrategyName::Planar);
        let preset = options.preset.unwrap_or(PresetName::Clay);
        let least = options.holder.as_deref().and_then(|text| text.trim().strip_prefix(LEAST));
        // What the tool has to stick out is known when there are paths; until then the ball does.
        let text = least.map(|sections| format!("{}{sections}", tool.radius_mm()));
        let text = text.as_deref().or(options.holder.as_deref());

        let mut job = Job::new(tool, options.scallop.unwrap_or(USUAL_SCALLOP_MM));
        job.holder = text.map(|text| holder(text, &tool)).transpose()?;
        job.least_stick_out = least.is_some();
        job.holder_clearance_mm = options.holder_clearance.unwrap_or(HOLDER_CLEARANCE_MM);
        job.tool_number = options.tool_number;
        job.merging = options.merging.merging(Preset::from(preset))?;
        (job.up, job.front) = told(&options.axes)?;
        job.only.clone_from(&options.only);
        job.skip.clone_from(&options.skip);
        job.avoid.clone_from(&options.bounds.avoid);
        job.setups = options.setups.iter().chain(&options.setup).cloned().collect();
        job.material_side.clone_from(&options.material_side);
        job.obstacles.clone_from(&options.check);
        job.obstacle_unit_mm = options.mesh_unit.unwrap_or(1.0);
        job.levels = levels(options, &tool)?;
        let passes = &mut job.passes;
        passes.rest_of = rest_of;
        passes.rest_above_mm = options.rest_above;
        passes.stock_above_mm = options.stock_above.unwrap_or(0.0);
        passes.allowance_mm = options.allowance.unwrap_or(0.0);
        passes.strategy = strategy.into();
        passes.steep_deg = options.steep.unwrap_or(STEEP_DEG);
        passes.lines = options.lines;
        passes.guides = options.guides()?;
        passes.pencil = options.pencil;
        passes.row_angle_deg = options.angle;
        passes.bounds = options.bounds.bounds()?;
        passes.check_clearance_mm = options.check_clearance_mm()?;
        passes.clearance_mm = options.rapid_clearance.unwrap_or(CLEARANCE_MM);
        passes.link = match options.link {
            Some(LinkName::OneWay) => LinkStyle::OneWay,
            Some(LinkName::Zigzag) | None => LinkStyle::Zigzag,
        };
        if let Some(feed) = options.feed {
            passes.feeds.cut_mm_per_min = feed;
        }
        // Said before the model is read, which may take a while.
        job.check()?;
        if let Some(machine) = options.machine.as_deref().map(Machine::read).transpose()? {
            check_feed(options.feed, &machine)?;
            job = job.machine(&machine);
        }
        Ok(Request { model: model.to_owned(), options: options.clone(), strategy, preset, job })
    }
}

/// The levels that are asked for, with what is usual.
fn levels(options: &JobOptions, tool: &Tool) -> Result<Option<Levels>, Failure> {
    if options.cut != Some(CutName::Levels) {
        let own = [
            ("step_down", options.step_down),
            ("engagement", options.engagement),
            ("band", options.band),
            ("dead_centre", options.dead_centre),
            ("ramp", options.ramp),
        ];
        return match own.into_iter().find(|(_, value)| value.is_some()) {
            Some((name, _)) => Err(Failure::usage(
                format!("`{name}` is for levels, and this operation has none"),
                "Add cut = \"levels\" to the operation, or leave it out.",
            )),
            None => Ok(None),
        };
    }
    let flutes_mm = tool.flute_length_mm.unwrap_or(f64::INFINITY);
    let step_down_mm = options.step_down.unwrap_or_else(|| (2.0 * tool.radius_mm()).min(flutes_mm));
    Ok(Some(Levels {
        step_down_mm,
        engagement_deg: options.engagement.unwrap_or(Levels::USUAL_ENGAGEMENT_DEG),
        band_mm: options.band.unwrap_or(Levels::USUAL_BAND * step_down_mm),
        dead_centre_mm: options.dead_centre,
        ramp_deg: options.ramp,
    }))
}

/// A feed that is asked for, and not only usual, is one that the machine has.
fn check_feed(asked_mm_per_min: Option<f64>, machine: &Machine) -> Result<(), Failure> {
    let most = machine.feed.max_mm_per_min;
    match asked_mm_per_min.filter(|asked| *asked > most) {
        Some(asked) => Err(Failure::usage(
            format!("feed {asked} mm/min is more than {most}, the most of {}", machine.name),
            "Give a lower --feed, or another --machine.",
        )),
        None => Ok(()),
    }
}

/// A distance that can be kept.
pub(crate) fn holder_clearance(asked_mm: Option<f64>) -> Result<Option<f64>, Failure> {
    asked_mm.map_or(Ok(()), claymill::check_holder_clearance)?;
    Ok(asked_mm)
}

/// The holder as written on the command line or in a job file.
pub(crate) fn holder(text: &str, tool: &Tool) -> Result<Holder, Failure> {
    Holder::parse(text, tool)
        .map_err(|e| Failure::usage(e, "For example: --holder 60, or --holder 60:27-34x50,63x26."))
}

impl From<LinkStyle> for LinkName {
    fn from(style: LinkStyle) -> Self {
        match style {
            LinkStyle::Zigzag => LinkName::Zigzag,
            LinkStyle::OneWay => LinkName::OneWay,
        }
    }
}

impl From<StrategyName> for Strategy {
    fn from(name: StrategyName) -> Self {
        match name {
            StrategyName::Planar => Strategy::Planar,
            StrategyName::Flow => Strategy::Flow,
            StrategyName::Scallop => Strategy::Scallop,
            StrategyName::Waterline => Strategy::Waterline,
            StrategyName::SteepShallow => Strategy::SteepShallow,
            StrategyName::Isoparametric => Strategy::Isoparametric,
            StrategyName::Auto => Strategy::Auto,
        }
    }
}
