//! The tool in words, and drawn to scale in its holder.

use claymill_toolpath::{Tool, ToolRecord};
use maud::{Markup, html};

/// Height of the drawing of a tool, and free space around it, in its own units.
const TALL: f64 = 260.0;
const BORDER: f64 = 14.0;
/// From the axis to the dimensions on either side.
const LEFT: f64 = 92.0;
const RIGHT: f64 = 96.0;
/// Lines of text keep this distance.
const LINE: f64 = 14.0;

/// A tool by itself, in words.
pub(super) fn mill(tool: &Tool) -> String {
    let mut words = crate::tool::in_words(tool);
    if let (Some(length), false) = (tool.flute_length_mm, tool.is_straight()) {
        words += &format!(", shank ⌀ {:.2} mm from {length} mm up", 2.0 * tool.shank_radius_mm());
    }
    words
}

/// What a tool is, in words.
pub(super) fn words(tool: &ToolRecord) -> String {
    let ball = format!("{}: {} (diameter {} mm)", tool.id, mill(&tool.tool), 2.0 * tool.tool.radius_mm());
    match &tool.holder {
        Some(holder) => format!("{ball}, {} mm out of its holder", holder.stick_out_mm),
        None => ball,
    }
}

/// The tool in its holder, to scale, with the measures that whoever sets it up needs; nothing without a holder.
pub(super) fn drawing(tool: &ToolRecord) -> Markup {
    let Some(holder) = &tool.holder else { return html! {} };
    let r = tool.tool.radius_mm();
    let widest = holder.profile().flatten().map(|p| p[1]).fold(tool.tool.widest_mm(), f64::max);
    let scale = ((TALL - 2.0 * BORDER) / holder.top_mm()).min(60.0 / widest);
    let bottom = 2.0 * BORDER + holder.top_mm() * scale;
    let y = |height: f64| bottom - BORDER - height * scale;
    let number = |v: f64| format!("{v:.1}");
    // Up one side of everything below the holder and down the other.
    let side: Vec<[f64; 2]> = crate::tool::below_holder(tool).into_iter().flatten().collect();
    let mirrored = side.iter().rev().map(|[height, radius]| [*height, -radius]);
    let corners = side
        .iter()
        .copied()
        .chain(mirrored)
        .map(|[height, radius]| format!("{} {}", number(radius * scale), number(y(height))));
    let shank = format!("M{} Z", corners.collect::<Vec<_>>().join(" L"));
    let outline = |[[low, lower], [high, upper]]: [[f64; 2]; 2]| {
        let corners = [(-lower, low), (lower, low), (upper, high), (-upper, high)];
        corners.map(|(x, h)| format!("{},{}", number(x * scale), number(y(h)))).join(" ")
    };
    let spoken = format!("{}; holder from the tool up: {}", words(tool), sections(tool).join(", "));
    // Diameters beside their places, pushed apart where they are close.
    let mut labels: Vec<(f64, String)> = vec![(y(0.5 * r), format!("⌀ {}", 2.0 * r))];
    let shank_mm = 2.0 * tool.tool.shank_radius_mm();
    if shank_mm != 2.0 * r {
        labels.push((y(tool.tool.flute_length_mm.unwrap_or(r)), format!("⌀ {}", number(shank_mm))));
    }
    for [[low, lower], [high, upper]] in holder.profile() {
        if lower == upper {
            labels.push((y(0.5 * (low + high)), format!("⌀ {}", 2.0 * lower)));
        } else {
            labels.push((y(low), format!("⌀ {}", 2.0 * lower)));
            labels.push((y(high), format!("⌀ {}", 2.0 * upper)));
        }
    }
    let mut above = f64::INFINITY;
    for (at, _) in &mut labels {
        *at = at.min(above - LINE);
        above = *at;
    }
    let highest = labels.last().map_or(0.0, |l| l.0 - LINE).min(0.0);
    let edge = -0.5 * (LEFT - 20.0) - widest * scale * 0.5;
    html! {
        svg.toolside viewBox=(format!("{} {} {} {}", number(-LEFT - 8.0), number(highest), number(LEFT + RIGHT + 8.0), number(bottom - highest)))
            role="img" aria-label=(spoken) {
            @for band in holder.profile() { polygon.holder points=(outline(band)) {} }
            path.shank d=(shank) {}
            line.axis x1="0" x2="0" y1=(number(y(holder.top_mm()) - 6.0)) y2=(number(y(0.0) + 6.0)) {}
            // How far the tool sticks out.
            path.measure d=(format!("M{0} {1} H{2} M{0} {3} H{4} M{5} {1} V{3}", number(edge - 6.0), number(y(0.0)),
                "0", number(y(holder.stick_out_mm)), number(-r * scale), number(edge))) {}
            text x=(number(edge - 8.0)) y=(number(0.5 * (y(0.0) + y(holder.stick_out_mm)) + 4.0)) text-anchor="end" {
                (holder.stick_out_mm)
            }
            @for (at, text) in &labels { text x=(number(widest * scale + 10.0)) y=(number(at + 4.0)) { (text) } }
        }
    }
}

/// The sections in words.
pub(super) fn sections(tool: &ToolRecord) -> Vec<String> {
    let one = |s: &claymill_toolpath::HolderSection| {
        let (lower, upper) = (s.lower_diameter_mm, s.upper_diameter_mm);
        if lower == upper {
            format!("⌀ {lower} mm, {} mm long", s.length_mm)
        } else {
            format!("⌀ {lower} to {upper} mm, {} mm long", s.length_mm)
        }
    };
    tool.holder.iter().flat_map(|h| &h.sections).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_toolpath::Holder;

    #[test]
    fn every_kind_of_tool_has_its_words_and_its_outline() {
        for (tool, words) in [
            ("ball:5", "ball end mill, radius 5 mm"),
            ("flat:4", "flat end mill, radius 4 mm"),
            (
                "bull:5:2,taper:3,length:30",
                "bull-nose end mill, radius 5 mm, corner 2 mm, taper 3°, shank ⌀ 12.94 mm",
            ),
            ("ball:5,length:20,shank:12", "ball end mill, radius 5 mm, shank ⌀ 12.00 mm from 20 mm up"),
        ] {
            let tool: Tool = tool.parse().unwrap();
            assert!(mill(&tool).starts_with(words), "{}", mill(&tool));
            let holder = Holder::parse("60", &tool).ok();
            let text = drawing(&ToolRecord {
                id: "T1".into(),
                tool,
                holder,
                setup_stick_out_mm: Default::default(),
            })
            .into_string();
            assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
            let shank_mm = 2.0 * tool.shank_radius_mm();
            assert_eq!(
                text.contains(&format!("⌀ {shank_mm:.1}")),
                shank_mm != 2.0 * tool.radius_mm(),
                "{text}"
            );
        }
    }

    #[test]
    fn the_drawing_has_every_measure_and_a_tool_without_holder_none() {
        let tool = Tool::ball(6.0);
        let bare = ToolRecord { id: "T1".into(), tool, holder: None, setup_stick_out_mm: Default::default() };
        assert_eq!(drawing(&bare).into_string(), "");
        let holder = Holder::parse("60:27-34x50,63x26", &tool).ok();
        let text = drawing(&ToolRecord { holder, ..bare }).into_string();
        for measure in [">60<", "⌀ 12", "⌀ 27", "⌀ 34", "⌀ 63", "26 mm long"] {
            assert!(text.contains(measure), "{measure}: {text}");
        }
    }
}
