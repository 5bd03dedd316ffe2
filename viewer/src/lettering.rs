//! Soft-edged drawing of text, strokes and rectangles into a picture.

use crate::picture::Picture;
use crate::stroke_font::{Xy, outlines};

/// Grid units between characters.
const GAP: f32 = 2.1;
/// Grid units of a capital's height.
const CAPITAL: f32 = 7.0;

/// Width of `text` with capitals `height_px` high, pixels.
pub(crate) fn text_width(text: &str, height_px: f32) -> f32 {
    let units: f32 = outlines(text).map(|(_, width)| width + GAP).sum();
    (units - GAP).max(0.0) * height_px / CAPITAL
}

/// Writes `text` with its baseline starting at `(x, y)`.
pub(crate) fn write_text(picture: &mut Picture, text: &str, x: f32, y: f32, height_px: f32, colour: [u8; 3]) {
    let scale = height_px / CAPITAL;
    let mut pen = x;
    for (segments, width) in outlines(text) {
        let place = |p: Xy| [pen + p[0] * scale, y - p[1] * scale];
        let placed: Vec<[Xy; 2]> = segments.iter().map(|s| s.map(place)).collect();
        draw_strokes(picture, &placed, (0.135 * height_px).max(1.15), colour, 1.0);
        pen += (width + GAP) * scale;
    }
}

/// Draws line segments as one soft-edged shape: where they overlap nothing is painted twice.
pub(crate) fn draw_strokes(
    picture: &mut Picture,
    segments: &[[Xy; 2]],
    width_px: f32,
    colour: [u8; 3],
    opacity: f32,
) {
    let reach = 0.5 * width_px + 1.0;
    let bound = |axis: usize, largest: u32| {
        let ends = segments.iter().flatten().map(|p| p[axis]);
        let low = ends.clone().fold(f32::INFINITY, f32::min) - reach;
        let high = ends.fold(f32::NEG_INFINITY, f32::max) + reach;
        // Float to integer conversion saturates, so that everything outside the picture falls away.
        low.floor() as u32..(high.ceil() as u32).min(largest)
    };
    for py in bound(1, picture.height) {
        for px in bound(0, picture.width) {
            let p = [px as f32 + 0.5, py as f32 + 0.5];
            let distance = segments.iter().map(|s| distance(p, s)).fold(f32::INFINITY, f32::min);
            blend(picture, px, py, colour, opacity * (0.5 * width_px + 0.5 - distance).clamp(0.0, 1.0));
        }
    }
}

/// Fills a rectangle.
pub(crate) fn fill(picture: &mut Picture, corner: Xy, size: Xy, colour: [u8; 3], opacity: f32) {
    let range = |axis: usize, largest: u32| {
        let low = corner[axis].round() as u32;
        low..((corner[axis] + size[axis]).round() as u32).min(largest)
    };
    for py in range(1, picture.height) {
        for px in range(0, picture.width) {
            blend(picture, px, py, colour, opacity);
        }
    }
}

fn distance(p: Xy, [a, b]: &[Xy; 2]) -> f32 {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let length2 = dx * dx + dy * dy;
    let t = if length2 > 0.0 {
        (((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / length2).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p[0] - a[0] - t * dx).hypot(p[1] - a[1] - t * dy)
}

fn blend(picture: &mut Picture, x: u32, y: u32, colour: [u8; 3], opacity: f32) {
    if opacity <= 0.0 {
        return;
    }
    let at = 4 * (y as usize * picture.width as usize + x as usize);
    let Some(pixel) = picture.rgba.get_mut(at..at + 4) else {
        return;
    };
    let below = f32::from(pixel[3]) / 255.0;
    let covered = opacity + below * (1.0 - opacity);
    for c in 0..3 {
        let mixed = f32::from(colour[c]) * opacity + f32::from(pixel[c]) * below * (1.0 - opacity);
        pixel[c] = (mixed / covered).round() as u8;
    }
    pixel[3] = (covered * 255.0).round() as u8;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page() -> Picture {
        Picture { width: 200, height: 40, rgba: vec![255; 200 * 40 * 4] }
    }

    #[test]
    fn text_takes_the_width_it_says_and_leaves_the_rest_alone() {
        let mut picture = page();
        write_text(&mut picture, "H", 20.0, 30.0, 14.0, [0, 0, 0]);
        let dark: Vec<(u32, u32)> = (0..40)
            .flat_map(|y| (0..200).map(move |x| (x, y)))
            .filter(|&(x, y)| picture.pixel(x, y)[0] < 128)
            .collect();
        let x_range = (dark.iter().map(|p| p.0).min().unwrap(), dark.iter().map(|p| p.0).max().unwrap());
        let y_range = (dark.iter().map(|p| p.1).min().unwrap(), dark.iter().map(|p| p.1).max().unwrap());
        assert_eq!(x_range, (19, 28), "four grid units of two pixels and the stroke");
        assert_eq!(y_range, (15, 30), "capitals 14 pixels high and the stroke");
        assert_eq!(text_width("H", 14.0), 8.0);
    }

    #[test]
    fn drawing_outside_the_picture_is_harmless() {
        let mut picture = page();
        write_text(&mut picture, "far away", -500.0, 9000.0, 12.0, [0, 0, 0]);
        fill(&mut picture, [-10.0, -10.0], [5.0, 5.0], [0, 0, 0], 1.0);
        assert_eq!(picture, page());
    }
}
