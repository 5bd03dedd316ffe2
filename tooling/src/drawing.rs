//! A tool as a drawing (SVG): flutes, shank and holder with their measures.

use std::fmt::Write;

use claymill_toolpath::{Holder, Tool};

use crate::library::LibraryTool;

/// Straight pieces of the drawn corner.
const CORNER_PIECES: u32 = 16;
/// Share of the height that is text, and the gap between dimension lines in heights of text.
pub(crate) const TEXT_SHARE: f64 = 0.03;
const LINE_GAP: f64 = 2.2;
/// Width of a bold letter in heights of text, rather wide.
const LETTER: f64 = 0.62;

/// Parts of a silhouette, each a closed outline of half the section: radius and height above the tip, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Silhouette {
    /// What cuts.
    pub flutes: Vec<[f64; 2]>,
    /// What does not cut, up to the holder or the end of the tool.
    pub shank: Vec<[f64; 2]>,
    /// Sections of the holder.
    pub holder: Vec<Vec<[f64; 2]>>,
}

impl Silhouette {
    /// The silhouette of a tool. Where its length is not known, half the flutes' length is drawn of the shank.
    #[must_use]
    pub fn of(tool: &LibraryTool) -> Self {
        let top = top_of_shank_mm(tool);
        let cut = tool.flute_length_mm.or(tool.tool.flute_length_mm).unwrap_or(0.7 * top).min(top);
        let outline = outline(&tool.tool, top);
        let section = |[[low, r_low], [high, r_high]]: [[f64; 2]; 2]| {
            vec![[0.0, low], [r_low, low], [r_high, high], [0.0, high]]
        };
        Silhouette {
            flutes: between(&outline, 0.0, cut),
            shank: between(&outline, cut, top),
            holder: tool.holder.iter().flat_map(Holder::profile).map(section).collect(),
        }
    }

    /// Height above the tip, mm.
    #[must_use]
    pub fn height_mm(&self) -> f64 {
        self.points().map(|p| p[1]).fold(0.0, f64::max)
    }

    /// Largest radius, mm.
    #[must_use]
    pub fn radius_mm(&self) -> f64 {
        self.points().map(|p| p[0]).fold(0.0, f64::max)
    }

    fn points(&self) -> impl Iterator<Item = &[f64; 2]> {
        self.flutes.iter().chain(&self.shank).chain(self.holder.iter().flatten())
    }
}

/// How high the tool alone is drawn, mm.
fn top_of_shank_mm(tool: &LibraryTool) -> f64 {
    let flutes = tool.flute_length_mm.unwrap_or(0.0).max(tool.tool.flute_length_mm.unwrap_or(0.0));
    let known = tool.stick_out_mm.or(tool.overall_length_mm);
    known.unwrap_or(1.5 * flutes).max(flutes).max(2.0 * tool.tool.radius_mm())
}

/// Radius and height of the tool's outline from the tip up to a height.
fn outline(tool: &Tool, top_mm: f64) -> Vec<[f64; 2]> {
    let (radius, corner) = (tool.radius_mm(), tool.corner_radius_mm());
    let lean = tool.taper_deg.unwrap_or(0.0).to_radians();
    let mut points = vec![[0.0, 0.0]];
    // From straight below the corner's centre to where the flank leaves it.
    let end = std::f64::consts::FRAC_PI_2 - lean;
    for piece in 0..=CORNER_PIECES {
        let angle = end * f64::from(piece) / f64::from(CORNER_PIECES);
        points.push([radius - corner + corner * angle.sin(), corner - corner * angle.cos()]);
    }
    for [[low, r_low], [high, r_high]] in tool.sides() {
        if low < top_mm {
            points.extend([[r_low, low], [r_high, high.min(top_mm)]]);
        }
    }
    // A flank that is cut off ends where the line meets the top.
    if let [.., [r_low, low], last] = &mut points[..]
        && let Some([_, [high, r_high]]) = tool.sides().into_iter().find(|[from, _]| from[0] == *low)
        && high.is_finite()
        && high > top_mm
    {
        last[0] = *r_low + (r_high - *r_low) * (top_mm - *low) / (high - *low);
    }
    points
}

/// The part of an outline between two heights, closed along the axis. A step in radius at its upper or lower end belongs to
/// the neighbour, but the tip's disc to the lowest part.
fn between(outline: &[[f64; 2]], low_mm: f64, high_mm: f64) -> Vec<[f64; 2]> {
    if high_mm <= low_mm {
        return Vec::new();
    }
    let mut part = vec![[0.0, low_mm]];
    for pair in outline.windows(2) {
        let [[r0, z0], [r1, z1]] = [pair[0], pair[1]];
        let is_step = z1 <= z0;
        let is_inside = (z0 > low_mm || low_mm == 0.0) && z0 < high_mm;
        if is_step && is_inside {
            part.extend([[r0, z0], [r1, z1]]);
        } else if !is_step && z1 > low_mm && z0 < high_mm {
            let at = |z: f64| [r0 + (r1 - r0) * (z - z0) / (z1 - z0), z];
            part.extend([at(z0.max(low_mm)), at(z1.min(high_mm))]);
        }
    }
    part.push([0.0, high_mm]);
    part.dedup();
    part
}

/// A tool as an SVG document: tip below, dimensions to the right in mm. It has neither scripts nor links.
#[must_use]
pub fn tool_svg(tool: &LibraryTool) -> String {
    let drawing = Drawing::of(tool, TEXT_SHARE * Silhouette::of(tool).height_mm());
    let [width, tall] = [drawing.width(), drawing.tall()];
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{} {} {} {}\" width=\"{}\" height=\"600\" \
         font-family=\"sans-serif\" font-size=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\">\n\
         <title>{}</title>\n",
        n(-drawing.left),
        n(-drawing.above),
        n(width),
        n(tall),
        n((600.0 * width / tall).clamp(100.0, 1200.0)),
        n(drawing.text),
        n(0.1 * drawing.text),
        escaped(&heading(tool)),
    );
    svg += &drawing.body;
    svg + "</svg>\n"
}

/// A drawn tool in mm, its tip at the origin, y down.
pub(crate) struct Drawing {
    /// Shapes and texts.
    pub(crate) body: String,
    /// Height of the text.
    pub(crate) text: f64,
    /// How far the drawing reaches to each side of the tip.
    pub(crate) left: f64,
    pub(crate) right: f64,
    pub(crate) above: f64,
    pub(crate) below: f64,
}

impl Drawing {
    /// Draws a tool with text of a height, mm.
    pub(crate) fn of(tool: &LibraryTool, text_mm: f64) -> Self {
        let shape = Silhouette::of(tool);
        let (height, radius, text) = (shape.height_mm(), shape.radius_mm(), text_mm.max(1e-3));
        let left = radius + 2.0 * text;
        #[expect(clippy::cast_precision_loss, reason = "a name of at most a few hundred characters")]
        let heading_width = (heading(tool).chars().count() as f64 * LETTER + 2.0) * text;
        let right = (radius + 14.0 * text).max(heading_width - left);
        let mut body = String::new();
        for section in &shape.holder {
            polygon(&mut body, section, "#9aa3ad", "holder");
        }
        polygon(&mut body, &shape.shank, "#d5d9de", "shank");
        polygon(&mut body, &shape.flutes, "#e8b04a", "flutes");
        // Writing to a text does not fail.
        let _ = writeln!(
            body,
            "<path d=\"M0 {}V{}\" stroke=\"#333\" stroke-dasharray=\"{} {}\" fill=\"none\"/>",
            n(text),
            n(-height - text),
            n(text),
            n(0.4 * text)
        );
        dimensions(&mut body, tool, (height, radius), text);
        diameters(&mut body, tool, text);
        let _ = writeln!(
            body,
            "<text x=\"{}\" y=\"{}\" font-weight=\"bold\">{}</text>",
            n(-left + text),
            n(-height - 2.0 * text),
            escaped(&heading(tool))
        );
        Drawing { body, text, left, right, above: height + 4.0 * text, below: 4.0 * text }
    }

    pub(crate) fn width(&self) -> f64 {
        self.left + self.right
    }

    pub(crate) fn tall(&self) -> f64 {
        self.above + self.below
    }
}

/// Dimension lines beside a tool of a height and radius.
fn dimensions(svg: &mut String, tool: &LibraryTool, (height, radius): (f64, f64), text: f64) {
    let mut column = 0.0;
    for (name, mm) in heights(tool, height) {
        column += 1.0;
        let x = radius + LINE_GAP * text * column - text;
        let _ = writeln!(
            svg,
            "<path d=\"M{x} 0V{top}M{a} 0H{b}M{a} {top}H{b}\" stroke=\"#333\" fill=\"none\"/>\
             <text x=\"{tx}\" y=\"{ty}\" transform=\"rotate(-90 {tx} {ty})\">{name} {mm}</text>",
            x = n(x),
            top = n(-mm),
            a = n(x - 0.3 * text),
            b = n(x + 0.3 * text),
            tx = n(x + 1.2 * text),
            ty = n(-0.1 * mm),
            mm = measure(mm),
        );
    }
}

fn heading(tool: &LibraryTool) -> String {
    format!("{} {} ({})", tool.id, tool.name, tool.tool)
}

/// What is measured from the tip, the shortest first.
fn heights(tool: &LibraryTool, height: f64) -> Vec<(&'static str, f64)> {
    let known = [
        ("flutes", tool.flute_length_mm.or(tool.tool.flute_length_mm)),
        ("stick-out", tool.stick_out_mm),
        ("in spindle", tool.length_in_spindle_mm()),
    ];
    let drawn = known.into_iter().filter_map(|(name, mm)| mm.map(|mm| (name, mm)));
    drawn.filter(|(_, mm)| *mm <= height * (1.0 + 1e-9)).collect()
}

/// Diameters: of the end below the tip, the others beside the axis in the middle of what has them.
fn diameters(svg: &mut String, tool: &LibraryTool, text: f64) {
    let mut label = |x: f64, y: f64, anchor: &str, mm: &str| {
        let (x, y) = (n(x), n(y));
        let _ = writeln!(svg, "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\">⌀{mm}</text>");
    };
    label(0.0, 2.2 * text, "middle", &measure(tool.diameter_mm()));
    let beside = 0.4 * text;
    let shank = 2.0 * tool.tool.shank_radius_mm();
    if let (Some(from), Some(out)) = (tool.tool.flute_length_mm, tool.stick_out_mm)
        && shank != tool.diameter_mm()
        && out > from
    {
        label(beside, -0.5 * (from + out), "start", &measure(shank));
    }
    for [[low, r_low], [high, r_high]] in tool.holder.iter().flat_map(Holder::profile) {
        if high - low > 1.2 * text {
            let (lower, upper) = (measure(2.0 * r_low), measure(2.0 * r_high));
            let both = if lower == upper { lower } else { format!("{lower}–{upper}") };
            label(beside, -0.5 * (low + high) + 0.35 * text, "start", &both);
        }
    }
}

/// Half an outline and its mirror image.
fn polygon(svg: &mut String, half: &[[f64; 2]], fill: &str, class: &str) {
    if half.is_empty() {
        return;
    }
    let right = half.iter().map(|[r, z]| (*r, -*z));
    let left = half.iter().rev().map(|[r, z]| (-*r, -*z));
    let points: Vec<String> = right.chain(left).map(|(x, y)| format!("{},{}", n(x), n(y))).collect();
    let _ = writeln!(
        svg,
        "<polygon class=\"{class}\" points=\"{}\" fill=\"{fill}\" stroke=\"#333\"/>",
        points.join(" ")
    );
}

/// A coordinate with three decimals.
pub(crate) fn n(v: f64) -> String {
    let text = format!("{v:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// A measure with at most two decimals.
pub(crate) fn measure(mm: f64) -> String {
    let text = format!("{mm:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn escaped(text: &str) -> String {
    let clean = text.chars().filter(|c| !c.is_control());
    clean.fold(String::new(), |mut out, c| {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c => out.push(c),
        }
        out
    })
}
