//! Operations that rough by levels: how far around the tool cuts, and how much stock they leave.

use claymill_verify::stock::ENGAGEMENT_BIN_DEG;
use claymill_verify::{LevelsFound, Verification};
use maud::{Markup, html};

use super::figures::{length, point, share};
use super::plots::{Part, stacked_bar};
use crate::palette::Rgb;

/// From a tool that cuts nothing to one that cuts as far around as it may, and beyond.
const ENDS: [Rgb; 2] = [[222, 226, 230], [40, 90, 150]];
const BEYOND: Rgb = [205, 62, 0];

/// The section of the report; nothing where no operation has levels.
pub(super) fn section(verification: Option<&Verification>) -> Markup {
    let operations = verification.into_iter().flat_map(|v| &v.operations);
    let found: Vec<(&str, &LevelsFound)> =
        operations.filter_map(|o| Some((o.name.as_str(), o.levels.as_ref()?))).collect();
    if found.is_empty() {
        return html! {};
    }
    html! {
        h2 id="levels" { "Levels" }
        p { "The engagement is the angle about the tool along which it cuts, measured in the plane of each level along all moves that "
            "stay on it. Entries by a helix are apart." }
        @for (name, levels) in found { (operation(name, levels)) }
    }
}

fn operation(name: &str, levels: &LevelsFound) -> Markup {
    let (engagement, left) = (&levels.engagement, &levels.left);
    let limit_deg = levels.asked.engagement_deg;
    let largest = engagement.largest.as_ref();
    let most = largest.map_or_else(|| "–".into(), |pose| format!("{:.1}°", pose.angle_deg));
    let [low_mm, high_mm] = left.band_mm;
    let title = format!("{name}: length of moves by engagement, {limit_deg}° allowed");
    html! {
        (stacked_bar(&title, &bins(levels)))
        table {
            tbody {
                tr { th scope="row" { "Largest engagement" } td.num { (most) }
                    td { @if let Some(pose) = largest { (point(&pose.at.point_mm)) } } }
                tr { th scope="row" { "Levels and entries" } td.num { (engagement.levels) ", " (engagement.entries) } td {} }
                tr { th scope="row" { "Stock within the band" } td.num { (share(left.within, 1.0)) }
                    td { (format!("{low_mm:.3} to {high_mm:.2} mm, of what the levels reach")) } }
                tr { th scope="row" { "More stock than the band" } td.num { (share(left.above, 1.0)) }
                    td { @if let Some(at) = &left.thickest_at { "thickest at " (point(&at.point_mm)) } } }
                @if let Some(at) = &levels.closed.at {
                    tr { th scope="row" { "Pockets without a way in" } td.num { (share(levels.closed.share, 1.0)) }
                        td { (format!("of what the tool fits into; it does not cut within {:.2} mm about its axis; one is at ", levels.closed.dead_centre_mm)) (point(&at.point_mm)) } }
                }
            }
        }
    }
}

/// Lengths in bins of engagement that have any.
fn bins(levels: &LevelsFound) -> Vec<Part> {
    let limit_deg = levels.asked.engagement_deg;
    let bin = |(k, mm): (usize, &f64)| {
        let from_deg = k as f64 * ENGAGEMENT_BIN_DEG;
        let part = (from_deg / limit_deg).min(1.0);
        let mixed = |i: usize| (f64::from(ENDS[0][i]) * (1.0 - part) + f64::from(ENDS[1][i]) * part) as u8;
        let colour = if from_deg > limit_deg { BEYOND } else { [mixed(0), mixed(1), mixed(2)] };
        let label = format!("{from_deg:.0}° to {:.0}°", from_deg + ENGAGEMENT_BIN_DEG);
        Part { label, value: *mm, figure: length(*mm), colour }
    };
    let histogram = levels.engagement.histogram_mm.iter().enumerate();
    histogram.filter(|(_, mm)| **mm > 0.0).map(bin).collect()
}
