//! A tool and its holder as convex bodies of revolution: what cuts, and what must not touch.

use claymill_toolpath::{Holder, Tool, ToolRecord};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::body::Shape;
use super::error::{FARTHEST_MM, StockError, sized};

/// A part of what moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ToolPart {
    /// End and flutes: they cut.
    Flutes,
    /// The shank above the flutes.
    Shank,
    /// The holder, and the spindle as thick as its upper end.
    Holder,
}

/// One convex body of a tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ToolBody {
    pub(super) part: ToolPart,
    pub(super) shape: Shape,
}

/// The bodies of a tool. `above_mm` is the height above the tip beyond which there is no stock on any move: what has no end of
/// its own ends there.
pub(super) fn bodies_of(record: &ToolRecord, above_mm: f64) -> Result<Vec<ToolBody>, StockError> {
    let tool = &record.tool;
    checked(tool, record.holder.as_ref())?;
    let corner = tool.corner_radius_mm();
    let stick_out = record.holder.as_ref().map_or(f64::INFINITY, |h| h.stick_out_mm);
    // Whatever happens to be in the way of no stock has some length all the same.
    let above = above_mm.max(4.0 * tool.widest_mm());
    let top = above.min(stick_out);
    let mut bodies = Vec::new();
    let add = |bodies: &mut Vec<ToolBody>, part, shape| bodies.push(ToolBody { part, shape });
    if corner > 0.0 {
        let cap = tool.flute_length_mm.filter(|length| *length < 2.0 * corner).unwrap_or(f64::INFINITY);
        let disc = tool.radius_mm() - corner;
        add(&mut bodies, ToolPart::Flutes, Shape::End { disc, corner, centre: corner, cap });
    }
    for (k, [[low, lower], [high, upper]]) in tool.sides().into_iter().enumerate() {
        let high = high.min(top);
        if high > low {
            let part = if k == 0 { ToolPart::Flutes } else { ToolPart::Shank };
            // A cut-off flank has kept its slope.
            let upper = if upper > lower && k == 0 { upper_at(tool, [low, lower], high) } else { upper };
            add(&mut bodies, part, Shape::frustum([low, lower], [high, upper]));
        }
    }
    if let Some(holder) = &record.holder {
        let mut last = None;
        for [from, to] in holder.profile() {
            add(&mut bodies, ToolPart::Holder, Shape::frustum(from, to));
            last = Some(to);
        }
        if let Some([height, radius]) = last.filter(|[height, _]| *height < above) {
            add(&mut bodies, ToolPart::Holder, Shape::frustum([height, radius], [above, radius]));
        }
    }
    Ok(bodies)
}

/// Radius of a tapered flank at a height.
fn upper_at(tool: &Tool, [low, lower]: [f64; 2], high: f64) -> f64 {
    lower + (high - low) * tool.taper_deg.unwrap_or(0.0).to_radians().tan()
}

/// Refuses sizes that no tool has: a tool that was not read from text has been checked by nobody.
fn checked(tool: &Tool, holder: Option<&Holder>) -> Result<(), StockError> {
    let radius = sized("tool radius, mm,", tool.radius_mm(), 1e-3, 1e3)?;
    sized("corner radius, mm,", tool.corner_radius_mm(), 0.0, radius)?;
    sized("taper, °,", tool.taper_deg.unwrap_or(0.0), 0.0, 75.0)?;
    if let Some(length) = tool.flute_length_mm {
        sized("flute length, mm,", length, tool.corner_radius_mm(), 1e4)?;
    }
    if let Some(shank) = tool.shank_diameter_mm {
        sized("shank diameter, mm,", shank, 1e-6, 1e4)?;
    }
    let Some(holder) = holder else { return Ok(()) };
    sized("stick-out, mm,", holder.stick_out_mm, 0.0, 1e4)?;
    for s in &holder.sections {
        sized("length of a holder's section, mm,", s.length_mm, 1e-6, 1e4)?;
        sized("diameter of a holder, mm,", s.lower_diameter_mm, 0.0, 1e4)?;
        sized("diameter of a holder, mm,", s.upper_diameter_mm, 0.0, 1e4)?;
    }
    sized("sections of a holder", holder.sections.len() as f64, 0.0, 64.0)?;
    sized("height of a holder, mm,", holder.top_mm(), 0.0, FARTHEST_MM).map(|_| ())
}
