use claymill_nurbs::Vector3;

use crate::camera::Camera;
use crate::lettering::{draw_strokes, fill, text_width, write_text};
use crate::picture::Picture;
use crate::scene::{LegendEntry, Mark, Scene};
use crate::segments::emphasis_step;

const INK: [u8; 3] = [38, 42, 48];
const SOFT_INK: [u8; 3] = [92, 98, 106];

/// Sizes that follow the picture's.
struct Layout {
    /// Height of capitals, pixels.
    letter: f32,
    /// Distance of everything from the picture's border, pixels.
    border: f32,
    /// Distance between baselines, pixels.
    line: f32,
}

/// Draws caption, legend, scale bar and axes onto a picture.
pub(crate) fn annotate(picture: &mut Picture, scene: &Scene, camera: &Camera) {
    let letter = (picture.width.min(picture.height) as f32 * 0.0115).clamp(6.5, 40.0);
    let layout = Layout { letter, border: 2.2 * letter, line: 2.15 * letter };
    caption(picture, &layout, &scene.caption);
    legend(picture, &layout, &legend_entries(scene, camera));
    if camera.is_orthographic() {
        scale_bar(picture, &layout, camera.mm_per_px() as f32);
    }
    axes(picture, &layout, camera);
}

fn caption(picture: &mut Picture, layout: &Layout, lines: &[String]) {
    let mut y = layout.border + 1.4 * layout.letter;
    for (i, text) in lines.iter().enumerate() {
        let (height, ink) = if i == 0 { (1.4 * layout.letter, INK) } else { (layout.letter, SOFT_INK) };
        write_text(picture, text, layout.border, y, height, ink);
        y += layout.line;
    }
}

/// The scene's legend and what the camera adds to it.
fn legend_entries(scene: &Scene, camera: &Camera) -> Vec<(Option<LegendEntry>, String)> {
    let mut rows: Vec<(Option<LegendEntry>, String)> =
        scene.legend.iter().map(|e| (Some(e.clone()), e.text.clone())).collect();
    let mut thinned = scene.lines.iter().filter_map(|l| {
        let step = emphasis_step(l.spacing_mm, camera.mm_per_px());
        (step > 1).then_some((step, l.spacing_mm?))
    });
    if let Some((step, spacing_mm)) = thinned.next_back() {
        rows.push((None, format!("every {step}{} pass emphasised,", ordinal(step))));
        rows.push((None, format!("passes are {spacing_mm:.2} mm apart")));
    }
    rows
}

fn ordinal(n: u32) -> &'static str {
    if n % 10 == 2 { "nd" } else { "th" }
}

fn legend(picture: &mut Picture, layout: &Layout, rows: &[(Option<LegendEntry>, String)]) {
    if rows.is_empty() {
        return;
    }
    let letter = layout.letter;
    let sign = 2.4 * letter;
    let widest = rows.iter().map(|(_, text)| text_width(text, letter)).fold(0.0, f32::max);
    let width = sign + letter + widest;
    let left = picture.width as f32 - layout.border - width;
    let top = layout.border;
    let pad = letter;
    let panel = [width + 2.0 * pad, rows.len() as f32 * layout.line + 1.2 * pad];
    fill(picture, [left - pad, top - pad], panel, [255, 255, 255], 0.6);
    let mut baseline = top + 1.15 * letter;
    for (entry, text) in rows {
        if let Some(entry) = entry {
            let middle = baseline - 0.5 * letter;
            match entry.mark {
                Mark::Area => {
                    let corner = [left, middle - 0.65 * letter];
                    fill(picture, corner, [sign, 1.3 * letter], entry.colour, 1.0);
                }
                Mark::Line(width_px) => {
                    let line = [[left, middle], [left + sign, middle]];
                    draw_strokes(picture, &[line], width_px.max(0.16 * letter), entry.colour, 1.0);
                }
            }
        }
        let indent = if entry.is_some() { sign + letter } else { 0.0 };
        write_text(picture, text, left + indent, baseline, letter, INK);
        baseline += layout.line;
    }
}

/// A length of 1, 2 or 5 times a power of ten that takes about a sixth of the width.
fn scale_bar(picture: &mut Picture, layout: &Layout, mm_per_px: f32) {
    let wanted_mm = picture.width as f32 / 6.0 * mm_per_px;
    let decade = 10_f32.powf(wanted_mm.log10().floor());
    let length_mm =
        [5.0, 2.0, 1.0].map(|d| d * decade).into_iter().find(|l| *l <= wanted_mm).unwrap_or(decade);
    let text = if length_mm >= 1000.0 {
        format!("{} m", length_mm / 1000.0)
    } else {
        format!("{} mm", (length_mm * 1e6).round() / 1e6)
    };
    let (x0, x1) = (layout.border, layout.border + length_mm / mm_per_px);
    let y = picture.height as f32 - layout.border;
    let tick = 0.55 * layout.letter;
    let bar = [[[x0, y], [x1, y]], [[x0, y - tick], [x0, y + tick]], [[x1, y - tick], [x1, y + tick]]];
    draw_strokes(picture, &bar, 0.16 * layout.letter, INK, 1.0);
    write_text(picture, &text, x0 + 0.5 * layout.letter, y - 0.9 * layout.letter, layout.letter, INK);
}

/// The model axes as seen, the ones toward the eye drawn last.
fn axes(picture: &mut Picture, layout: &Layout, camera: &Camera) {
    let arm = 4.0 * layout.letter;
    let inset = layout.border + arm;
    let centre = [picture.width as f32 - inset, picture.height as f32 - inset];
    let mut axes = [
        ("x", Vector3::x(), [186, 58, 42]),
        ("y", Vector3::y(), [44, 132, 74]),
        ("z", Vector3::z(), [38, 88, 168]),
    ]
    .map(|(name, axis, colour)| (name, camera.in_picture(&axis), colour));
    axes.sort_by(|a, b| a.1.z.total_cmp(&b.1.z));
    for (name, seen, colour) in axes {
        let (x, y) = (seen.x as f32, -seen.y as f32);
        let tip = [centre[0] + arm * x, centre[1] + arm * y];
        let length = x.hypot(y);
        if length < 0.08 {
            continue;
        }
        let (ux, uy) = (x / length, y / length);
        let barb = 0.75 * layout.letter;
        let side = |s: f32| [tip[0] - barb * (ux - 0.45 * s * uy), tip[1] - barb * (uy + 0.45 * s * ux)];
        let arrow = [[centre, tip], [tip, side(1.0)], [tip, side(-1.0)]];
        // A pale border, so that the arrows stand out from whatever is behind them.
        draw_strokes(picture, &arrow, 0.55 * layout.letter, [255, 255, 255], 0.6);
        draw_strokes(picture, &arrow, 0.17 * layout.letter, colour, 1.0);
        let at = [tip[0] + 1.0 * layout.letter * ux, tip[1] + 1.0 * layout.letter * uy];
        let half = 0.5 * text_width(name, layout.letter);
        write_text(picture, name, at[0] - half, at[1] + 0.36 * layout.letter, layout.letter, colour);
    }
}
