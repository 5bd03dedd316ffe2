//! Annotations of a picture: markers, scale bar, axes, caption, legend and labels, placed where the
//! model is not.

use claymill_nurbs::Vector3;

use crate::camera::Camera;
use crate::labels::draw_labels;
use crate::legend::{LegendEntry, Mark};
use crate::lettering::{draw_strokes, fill, text_width, write_text};
use crate::picture::Picture;
use crate::pins::{draw_pin, draw_pins};
use crate::placement::{Area, Corner, Covered, Page, Stand};
use crate::scene::Scene;

const INK: [u8; 3] = [38, 42, 48];
const SOFT_INK: [u8; 3] = [92, 98, 106];

/// Ground of the legend, and how much it covers where the model is below it.
const PANEL: [u8; 3] = [255, 255, 255];
const OVER_MODEL: f32 = 0.86;

/// Sizes that follow the picture's.
struct Layout {
    /// Height of capitals, pixels.
    letter: f32,
    /// Distance of everything from the picture's border, pixels.
    border: f32,
}

/// Where caption and legend of a series of pictures stand, chosen in the first one.
#[derive(Debug, Clone, Default)]
pub struct Places {
    caption: Option<Stand>,
    /// And the size of its letters.
    legend: Option<(Stand, f32)>,
}

/// Draws pins, scale bar, axes, caption and legend onto a picture, the latter three where the model is not;
/// `share`: the part of the passes that is drawn; `larger`: the letters' size, 1 as usual.
pub(crate) fn annotate(
    picture: &mut Picture,
    scene: &Scene,
    camera: &Camera,
    model: &Covered,
    (share, larger): (f32, f32),
    places: &mut Places,
) {
    let letter = (picture.width.min(picture.height) as f32 * 0.0115 * larger).clamp(6.5, 60.0);
    let layout = Layout { letter, border: 2.2 * letter };
    draw_pins(picture, &scene.pins, camera, letter);
    let mut page = Page::new([picture.width, picture.height], model, 0.5 * letter);
    scale_bar(picture, &layout, camera, &mut page);
    axes(picture, &layout, camera, &mut page);
    caption(picture, &layout, &mut page, &scene.caption, &mut places.caption);
    legend(picture, &layout, &mut page, &legend_rows(scene, share), &mut places.legend);
    let nameless = draw_labels(picture, scene, camera, &mut page, letter);
    if nameless > 0 {
        let text = format!("{nameless} more would need a closer look");
        let size = [text_width(&text, letter), 2.0 * letter];
        let (_, [left, top]) = page.place(&[size], layout.border, &[Corner::BottomLeft]);
        write_text(picture, &text, left, top + letter, letter, SOFT_INK);
    }
}

fn caption(
    picture: &mut Picture,
    layout: &Layout,
    page: &mut Page,
    lines: &[String],
    place: &mut Option<Stand>,
) {
    if lines.is_empty() {
        return;
    }
    let look = |i: usize, letter: f32| if i == 0 { (1.4 * letter, INK) } else { (letter, SOFT_INK) };
    let letters = SMALLER.map(|part| (part * layout.letter).max(SMALLEST_PX.min(layout.letter)));
    let sizes = letters.map(|letter| {
        let width = |(i, text): (usize, &String)| text_width(text, look(i, letter).0);
        let widest = lines.iter().enumerate().map(width).fold(0.0, f32::max);
        // What stands beside it keeps away by a letter.
        [widest + letter, lines.len() as f32 * LINE * letter]
    });
    let (stand, [left, top]) = match place {
        Some(stand) => (*stand, page.place_again(stand, &sizes, layout.border)),
        None => {
            let all = [Corner::TopLeft, Corner::BottomLeft, Corner::TopRight, Corner::BottomRight];
            let corners = if page.has_room(&sizes, layout.border, &all) { &all } else { &all[..2] };
            page.place(&sizes, layout.border, corners)
        }
    };
    *place = Some(stand);
    let (letter, size) = (letters[stand.size], sizes[stand.size]);
    if page.covered_share(&Area { corner: [left, top], size }) > 0.0 {
        let pad = 0.6 * letter;
        fill(picture, [left - pad, top - pad], size.map(|s| s + 2.0 * pad), PANEL, OVER_MODEL);
    }
    let mut y = top + 1.4 * letter;
    for (i, text) in lines.iter().enumerate() {
        let (height, ink) = look(i, letter);
        write_text(picture, text, left, y, height, ink);
        y += LINE * letter;
    }
}

/// The scene's legend and what the thinning adds to it.
fn legend_rows(scene: &Scene, share: f32) -> Vec<(Option<LegendEntry>, String)> {
    let mut rows: Vec<(Option<LegendEntry>, String)> =
        scene.legend.iter().map(|e| (Some(e.clone()), e.text.clone())).collect();
    if share < 0.98 {
        let one_in = (1.0 / share.max(1e-6)).round() as u32;
        rows.push((
            None,
            match one_in {
                1 => "a few passes are left out".to_owned(),
                n => format!("about 1 pass in {n} is drawn"),
            },
        ));
    }
    rows
}

/// Width of a legend's signs and of what is between its columns, in letters.
const SIGN: f32 = 2.4;
const GAP: f32 = 2.5;
/// Distance of baselines, in letters.
const LINE: f32 = 2.15;
/// Letters of captions and legends, as parts of the usual ones, and the smallest that are made smaller, pixels.
const SMALLER: [f32; 4] = [1.0, 0.85, 0.7, 0.58];
const SMALLEST_PX: f32 = 9.0;

/// Most columns of a legend.
const COLUMNS: usize = 6;

/// A legend laid out in columns.
struct Table {
    /// Rows in a column; the last may have fewer.
    lines: usize,
    /// Width of each column, pixels.
    widths: Vec<f32>,
    size: [f32; 2],
}

/// Legends in one column, two and so on, as long as they are no wider than the room.
fn tables(rows: &[(Option<LegendEntry>, String)], letter: f32, room: f32) -> Vec<Table> {
    let width = |(e, text): &(Option<LegendEntry>, String)| indent(e, letter) + text_width(text, letter);
    let table = |columns: usize| {
        let lines = rows.len().div_ceil(columns);
        let widths: Vec<f32> =
            rows.chunks(lines).map(|column| column.iter().map(width).fold(0.0, f32::max)).collect();
        let between = GAP * letter * (widths.len() - 1) as f32;
        let size =
            [widths.iter().sum::<f32>() + between + 2.0 * letter, (lines as f32 * LINE + 1.2) * letter];
        Table { lines, widths, size }
    };
    let mut tables: Vec<Table> = (1..=COLUMNS.min(rows.len())).map(table).collect();
    tables.dedup_by_key(|t| t.lines);
    let narrowest = tables.iter().map(|t| t.size[0]).fold(f32::INFINITY, f32::min);
    tables.retain(|t| t.size[0] <= room.max(narrowest));
    tables
}

fn indent(entry: &Option<LegendEntry>, letter: f32) -> f32 {
    if entry.is_some() { (SIGN + 1.0) * letter } else { 0.0 }
}

fn legend(
    picture: &mut Picture,
    layout: &Layout,
    page: &mut Page,
    rows: &[(Option<LegendEntry>, String)],
    place: &mut Option<(Stand, f32)>,
) {
    if rows.is_empty() {
        return;
    }
    let corners = [Corner::TopRight, Corner::BottomRight, Corner::TopLeft, Corner::BottomLeft];
    let border = layout.border - layout.letter;
    let room = picture.width as f32 - 2.0 * border;
    let sizes = |tables: &[Table]| tables.iter().map(|t| t.size).collect::<Vec<_>>();
    // Smaller letters rather than a legend over the model, as long as they can be read.
    let letters = SMALLER.map(|part| (part * layout.letter).max(SMALLEST_PX.min(layout.letter)));
    let has_room = |letter: &f32| page.has_room(&sizes(&tables(rows, *letter, room)), border, &corners);
    let letter = match place {
        Some((_, letter)) => *letter,
        None => letters.into_iter().find(has_room).unwrap_or(letters[SMALLER.len() - 1]),
    };
    let tables = tables(rows, letter, room);
    let (stand, [x, y]) = match place {
        Some((stand, _)) => (*stand, page.place_again(stand, &sizes(&tables), border)),
        None => page.place(&sizes(&tables), border, &corners),
    };
    *place = Some((stand, letter));
    let Some(table) = tables.get(stand.size).or(tables.last()) else { return };
    let (pad, gap, sign) = (letter, GAP * letter, SIGN * letter);
    let over_model = page.covered_share(&Area { corner: [x, y], size: table.size }) > 0.0;
    fill(picture, [x, y], table.size, PANEL, if over_model { OVER_MODEL } else { 0.6 });
    for (i, (entry, text)) in rows.iter().enumerate() {
        let before = i / table.lines;
        let left = x + pad + table.widths[..before].iter().map(|w| w + gap).sum::<f32>();
        let baseline = y + pad + 1.15 * letter + (i % table.lines) as f32 * LINE * letter;
        if let Some(entry) = entry {
            let middle = baseline - 0.5 * letter;
            match entry.mark {
                Mark::Area => {
                    let corner = [left, middle - 0.65 * letter];
                    fill(picture, corner, [sign, 1.3 * letter], entry.colour, 1.0);
                }
                Mark::Pin(shape) => {
                    draw_pin(picture, shape, entry.colour, [left + 0.5 * sign, middle], letter);
                }
                Mark::Line(width_px) => {
                    let line = [[left, middle], [left + sign, middle]];
                    draw_strokes(picture, &[line], width_px.max(0.16 * letter), entry.colour, 1.0);
                }
            }
        }
        write_text(picture, text, left + indent(entry, letter), baseline, letter, INK);
    }
}

/// A length of 1, 2 or 5 times a power of ten that takes about a sixth of the width.
fn scale_bar(picture: &mut Picture, layout: &Layout, camera: &Camera, page: &mut Page) {
    let mm_per_px = camera.mm_per_px() as f32;
    let wanted_mm = picture.width as f32 / 6.0 * mm_per_px;
    let decade = 10_f32.powf(wanted_mm.log10().floor());
    let length_mm =
        [5.0, 2.0, 1.0].map(|d| d * decade).into_iter().find(|l| *l <= wanted_mm).unwrap_or(decade);
    let text = if length_mm >= 1000.0 {
        format!("{} m", length_mm / 1000.0)
    } else {
        format!("{} mm", (length_mm * 1e6).round() / 1e6)
    };
    // In perspective a scale holds at one distance only.
    let text = if camera.is_orthographic() { text } else { format!("{text} at the middle") };
    let (x0, x1) = (layout.border, layout.border + length_mm / mm_per_px);
    let y = picture.height as f32 - layout.border;
    let tick = 0.55 * layout.letter;
    let width = (x1 - x0).max(layout.letter + text_width(&text, layout.letter));
    let pad = 0.6 * layout.letter;
    let ground = Area {
        corner: [x0 - pad, y - 3.0 * layout.letter + pad],
        size: [width + 2.0 * pad, 3.0 * layout.letter],
    };
    if page.covered_share(&ground) > 0.0 {
        fill(picture, ground.corner, ground.size, PANEL, OVER_MODEL);
    }
    let bar = [[[x0, y], [x1, y]], [[x0, y - tick], [x0, y + tick]], [[x1, y - tick], [x1, y + tick]]];
    draw_strokes(picture, &bar, 0.16 * layout.letter, INK, 1.0);
    write_text(picture, &text, x0 + 0.5 * layout.letter, y - 0.9 * layout.letter, layout.letter, INK);
    let height = 3.0 * layout.letter;
    page.take(Area { corner: [x0, y - height], size: [width, height + layout.border] });
}

/// The model axes as seen, the ones toward the eye drawn last: at the lower right, or where the model is not.
fn axes(picture: &mut Picture, layout: &Layout, camera: &Camera, page: &mut Page) {
    let arm = 4.0 * layout.letter;
    let mut axes = [
        ("x", Vector3::x(), [186, 58, 42]),
        ("y", Vector3::y(), [44, 132, 74]),
        ("z", Vector3::z(), [38, 88, 168]),
    ]
    .map(|(name, axis, colour)| (name, camera.in_picture(&axis), colour));
    axes.sort_by(|a, b| a.1.z.total_cmp(&b.1.z));
    let shown = axes.map(|(name, seen, colour)| (name, [seen.x as f32, -seen.y as f32], colour));
    let shown = shown.into_iter().filter(|(_, [x, y], _)| x.hypot(*y) >= 0.08);

    let reach = arm + 2.0 * layout.letter;
    let inset = layout.border + arm;
    let usual = [picture.width as f32 - inset, picture.height as f32 - inset];
    let area = Area { corner: usual.map(|c| c - reach), size: [2.0 * reach; 2] };
    // What is drawn at least, as seen from the centre.
    let pad = 0.8 * layout.letter;
    let (mut low, mut high) = ([-pad; 2], [pad; 2]);
    for (_, [x, y], _) in shown.clone() {
        let longer = 1.0 + layout.letter / (arm * x.hypot(y));
        for (i, v) in [x, y].into_iter().enumerate() {
            low[i] = low[i].min(arm * longer * v - pad);
            high[i] = high[i].max(arm * longer * v + pad);
        }
    }
    let size = [[high[0] - low[0], high[1] - low[1]]];
    let corners = [Corner::BottomRight, Corner::TopRight, Corner::BottomLeft, Corner::TopLeft];
    let border = layout.border - layout.letter;
    let centre = if !page.is_clear(&area) && page.has_room(&size, border, &corners) {
        let (_, at) = page.place(&size, border, &corners);
        [at[0] - low[0], at[1] - low[1]]
    } else {
        page.take(area);
        usual
    };
    for (name, [x, y], colour) in shown {
        let tip = [centre[0] + arm * x, centre[1] + arm * y];
        let length = x.hypot(y);
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
