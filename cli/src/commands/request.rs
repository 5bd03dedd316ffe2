//! A job as it is asked for, every option checked and every default filled in, before any model is read.

use std::path::{Path, PathBuf};

use claymill_controller::Machine;
use claymill_nurbs::Point3;
use claymill_paths::{Feeds, Strategy, check_tools};
use claymill_toolpath::{Bounds, HOLDER_CLEARANCE_MM, Holder, LinkStyle, MachineLimits, Tool};

use crate::args::{JobOptions, LinkName, PresetName, StrategyName};
use crate::failure::Failure;

/// Written instead of a stick-out: the least that does.
pub(super) const LEAST: &str = "auto";
/// Where nothing else is asked for.
pub(super) const USUAL_TOOL: &str = "ball:10";
pub(super) const USUAL_SCALLOP_MM: f64 = 0.1;
/// Largest number of a tool.
const LARGEST_TOOL: u32 = 999_999;
/// Holders are asked to keep no more than this from the model, mm.
const LARGEST_CLEARANCE_MM: f64 = 1000.0;

/// No machine cuts faster, mm/min.
const LARGEST_FEED_MM_PER_MIN: f64 = 500_000.0;
/// Passes are fitted and written to a few tenths of a micrometre: lower scallops cannot be told from that, mm.
const LOWEST_SCALLOP_MM: f64 = 0.001;

/// A job with all defaults filled in.
pub(crate) struct Request {
    pub(super) model: PathBuf,
    pub(super) options: JobOptions,
    pub(super) tool: Tool,
    pub(super) holder: Option<Holder>,
    /// The holder sticks out as far as it has to.
    pub(super) least_stick_out: bool,
    pub(super) holder_clearance_mm: f64,
    /// The tool whose rest is cut.
    pub(super) rest_of: Option<Tool>,
    pub(super) scallop_mm: f64,
    pub(super) strategy: StrategyName,
    pub(super) steep_deg: f64,
    pub(super) lines: Option<usize>,
    pub(super) guides: Vec<Point3>,
    pub(super) bounds: Bounds,
    pub(super) check_clearance_mm: f64,
    pub(super) rapid_clearance_mm: f64,
    pub(super) link: LinkStyle,
    pub(super) preset: PresetName,
    pub(super) feeds: Feeds,
    pub(super) machine: MachineLimits,
}

impl Request {
    /// Id of the tool: its number in the machine, where that is known.
    pub(super) fn tool_id(&self) -> String {
        self.options
            .tool_number
            .map_or_else(|| claymill_paths::TOOL_ID.to_owned(), |number| format!("T{number}"))
    }

    pub(crate) fn new(model: &Path, options: &JobOptions) -> Result<Self, Failure> {
        let tool = options.tool.as_deref().unwrap_or(USUAL_TOOL).parse::<Tool>();
        let tool = tool.map_err(|e| {
            Failure::usage(e, "For example: --tool ball:10, or --tool ball:5,taper:3,length:30,shank:12.")
        })?;
        let least = options.holder.as_deref().and_then(|text| text.trim().strip_prefix(LEAST));
        // What the tool has to stick out is known when there are paths; until then the ball does.
        let text = least.map(|sections| format!("{}{sections}", tool.radius_mm()));
        let text = text.as_deref().or(options.holder.as_deref());
        let holder = text.map(|text| holder(text, &tool)).transpose()?;
        let holder_clearance_mm = holder_clearance(options.holder_clearance)?;
        let rest_of = options.rest_of.as_deref().map(str::parse::<Tool>).transpose();
        let rest_of = rest_of.map_err(|e| Failure::usage(e, "For example: --rest-of ball:10."))?;
        let scallop_mm = options.scallop.unwrap_or(USUAL_SCALLOP_MM);
        if (0.0..LOWEST_SCALLOP_MM).contains(&scallop_mm) {
            return Err(Failure::usage(
                format!(
                    "scallop height {scallop_mm} mm is below {LOWEST_SCALLOP_MM} mm, to which passes are exact"
                ),
                "Usual scallop heights are 0.02 to 0.2 mm, for example --scallop 0.1.",
            ));
        }
        // Said before the model is read, which may take a while.
        check_tools(&tool, rest_of.as_ref(), scallop_mm)?;
        let machine = options.machine.as_deref().map(Machine::read).transpose()?;
        let feeds = feeds(options.feed, machine.as_ref())?;
        if options.angle.is_some_and(|angle| !angle.is_finite()) {
            return Err(Failure::usage("the angle of the rows must be a number", "For example: --angle 45."));
        }
        if options.tool_number.is_some_and(|number| !(1..=LARGEST_TOOL).contains(&number)) {
            let what = format!("a tool has a number from 1 to {LARGEST_TOOL}");
            return Err(Failure::usage(what, "For example: --tool-number 12."));
        }
        let strategy = options.strategy.unwrap_or(StrategyName::Planar);
        Ok(Request {
            model: model.to_owned(),
            tool,
            holder,
            least_stick_out: least.is_some(),
            holder_clearance_mm: holder_clearance_mm.unwrap_or(HOLDER_CLEARANCE_MM),
            rest_of,
            scallop_mm,
            strategy,
            steep_deg: options.steep_deg()?,
            lines: options.lines(strategy)?,
            guides: options.guides(strategy)?,
            bounds: options.bounds.bounds()?,
            check_clearance_mm: options.check_clearance_mm()?,
            rapid_clearance_mm: options.rapid_clearance_mm()?,
            link: match options.link {
                Some(LinkName::OneWay) => LinkStyle::OneWay,
                Some(LinkName::Zigzag) | None => LinkStyle::Zigzag,
            },
            preset: options.preset.unwrap_or(PresetName::Clay),
            feeds,
            machine: machine.map(|m| m.limits()).unwrap_or_default(),
            options: options.clone(),
        })
    }
}

/// The feeds as asked for, or as usual, as far as the machine allows them.
fn feeds(asked_mm_per_min: Option<f64>, machine: Option<&Machine>) -> Result<Feeds, Failure> {
    let usual = Feeds::default();
    let cut_mm_per_min = asked_mm_per_min.unwrap_or(usual.cut_mm_per_min);
    if !(cut_mm_per_min > 0.0 && cut_mm_per_min <= LARGEST_FEED_MM_PER_MIN) {
        let what = format!("feed {cut_mm_per_min} mm/min is not between 0 and {LARGEST_FEED_MM_PER_MIN}");
        return Err(Failure::usage(what, "For example: --feed 6000."));
    }
    let Some(machine) = machine else { return Ok(Feeds { cut_mm_per_min, ..usual }) };
    let most = machine.feed.max_mm_per_min;
    if asked_mm_per_min.is_some_and(|asked| asked > most) {
        let what = format!("feed {cut_mm_per_min} mm/min is more than {most}, the most of {}", machine.name);
        return Err(Failure::usage(what, "Give a lower --feed, or another --machine."));
    }
    Ok(Feeds {
        cut_mm_per_min: cut_mm_per_min.min(most),
        lead_mm_per_min: usual.lead_mm_per_min.min(most),
        rapid_mm_per_min: machine.feed.rapid_mm_per_min,
    })
}

/// A distance that can be kept.
pub(crate) fn holder_clearance(asked_mm: Option<f64>) -> Result<Option<f64>, Failure> {
    match asked_mm {
        Some(mm) if !(0.0..=LARGEST_CLEARANCE_MM).contains(&mm) => Err(Failure::usage(
            format!(
                "holders cannot keep {mm} mm from the model: it must be between 0 and {LARGEST_CLEARANCE_MM}"
            ),
            "For example: --holder-clearance 2.",
        )),
        asked => Ok(asked),
    }
}

/// The holder as written on the command line or in a job file.
pub(crate) fn holder(text: &str, tool: &Tool) -> Result<Holder, Failure> {
    Holder::parse(text, tool)
        .map_err(|e| Failure::usage(e, "For example: --holder 60, or --holder 60:27-34x50,63x26."))
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
