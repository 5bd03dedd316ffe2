//! Roughing by levels: the tool, how deep it goes, how far around it cuts.

use claymill_clearing::{LARGEST_LIMIT_DEG, LEAST_LIMIT_DEG};
use claymill_nurbs::Aabb;
use claymill_tooling::{LibraryTool, Material, Stage, ToolChoice};
use claymill_toolpath::Levels;

use crate::choice::chooser::is_within;
use crate::limits::{LEAST_RAMP_DEG, STEEPEST_RAMP_DEG};

/// The tool is no thicker than this share of the part's second longest side: it has to get around it, and into it.
const THICKEST: f64 = 0.2;
/// Depths are rounded down to this, mm.
const ROUND_MM: f64 = 0.1;

/// The tool for levels in a material: the thickest flat or bull-nosed end of the range that gets around the part; the thinnest where
/// none does; a ball where the range has no other ends.
pub(super) fn tool(
    tools: &[LibraryTool],
    stage: &Stage,
    range: Option<[f64; 2]>,
    part: &Aabb,
) -> Option<LibraryTool> {
    if let ToolChoice::Id(id) = &stage.tool.value {
        return tools.iter().find(|tool| tool.id == *id).cloned();
    }
    let fits = |t: &&LibraryTool| t.tool.is_straight() && is_within(range, t);
    let mut ends: Vec<&LibraryTool> = tools.iter().filter(fits).collect();
    if ends.iter().any(|t| !t.tool.is_ball()) {
        ends.retain(|t| !t.tool.is_ball());
    }
    // Of equal radii the smaller corner: it leaves less on floors beside walls.
    let key = |t: &LibraryTool| (t.tool.radius_mm(), -t.tool.corner_radius_mm());
    ends.sort_by(|a, b| {
        key(b).partial_cmp(&key(a)).unwrap_or(std::cmp::Ordering::Equal).then(a.id.cmp(&b.id))
    });
    // Setups look along any of the sides: across the thinnest of them the tool need not get around.
    let mut sides = <[f64; 3]>::from(part.max - part.min);
    sides.sort_by(f64::total_cmp);
    let widest_mm = THICKEST * sides[1];
    let thin_enough = ends.iter().find(|t| t.diameter_mm() <= widest_mm);
    thin_enough.or(ends.last()).map(|t| (*t).clone())
}

/// What is asked of levels with a tool: as the process says, else as its cutting data, else as usual; no deeper than its flutes.
pub(super) fn asked(stage: &Stage, tool: &LibraryTool, material: &Material) -> Levels {
    let cutting = tool.cutting_for(material).ok();
    let of_stage = stage.engagement_deg.as_ref().map(|deg| deg.value);
    let engagement_deg = of_stage
        .or_else(|| cutting.and_then(|c| c.engagement_deg))
        .unwrap_or(Levels::USUAL_ENGAGEMENT_DEG)
        .clamp(LEAST_LIMIT_DEG, LARGEST_LIMIT_DEG);
    let flutes_mm = tool.flute_length_mm.or(tool.tool.flute_length_mm).unwrap_or(f64::INFINITY);
    let deep_mm = stage.depth_mm.as_ref().map_or(tool.diameter_mm(), |depth| depth.value).min(flutes_mm);
    let step_down_mm = ((deep_mm / ROUND_MM).floor() * ROUND_MM).max(ROUND_MM);
    let dead_centre_mm = match tool.centre_cutting {
        Some(true) => Some(0.0),
        Some(false) | None => Some(tool.dead_centre_mm).filter(|mm| *mm > 0.0),
    };
    Levels {
        step_down_mm,
        engagement_deg,
        band_mm: Levels::USUAL_BAND * step_down_mm,
        dead_centre_mm,
        ramp_deg: tool.ramp_deg.map(|deg| deg.clamp(LEAST_RAMP_DEG, STEEPEST_RAMP_DEG)),
    }
}
