//! A vector font of strokes, and soft-edged drawing of strokes and rectangles into a picture.

use crate::picture::Picture;

/// The strokes of a character, in the manner of engineering lettering. Each point is two digits, x and y, on
/// a grid with the baseline at y = 2, small letters up to 7 and capitals up to 9. A dot after a point makes
/// it a quadratic control point (two in a row have a curve point midway); a slash starts a new stroke.
fn strokes(c: char) -> &'static str {
    match c {
        ' ' => "",
        'A' => "02 29 42/15 35",
        'B' => "02 09 29 49. 46. 26 06/26 46. 42. 22 02",
        'C' => "47 49. 29 09. 06 05 02. 22 42. 44",
        'D' => "02 09 19 49. 46 45 42. 12 02",
        'E' => "49 09 02 42/06 36",
        'F' => "49 09 02/06 36",
        'G' => "47 49. 29 09. 06 05 02. 22 42. 45 25",
        'H' => "02 09/42 49/06 46",
        'I' => "02 09",
        'J' => "39 34 32. 22 02. 04",
        'K' => "02 09/49 05/16 42",
        'L' => "09 02 42",
        'M' => "02 09 34 69 62",
        'N' => "02 09 42 49",
        'O' | '0' => "29 09. 06 05 02. 22 42. 45 46 49. 29",
        'P' => "02 09 29 49. 45. 25 05",
        'Q' => "29 09. 06 05 02. 22 42. 45 46 49. 29/34 51",
        'R' => "02 09 29 49. 45. 25 05/25 42",
        'S' => "48 49. 29 09. 07 06. 26 46. 44 42. 22 02. 03",
        'T' => "09 49/29 22",
        'U' => "09 05 02. 22 42. 45 49",
        'V' => "09 22 49",
        'W' => "09 12 37 52 69",
        'X' => "09 42/02 49",
        'Y' => "09 25 49/25 22",
        'Z' => "09 49 02 42",
        'a' => "45 47. 27 07. 05 04 02. 22 42. 44/47 42",
        'b' => "09 02/05 07. 27 47. 45 44 42. 22 02. 04",
        'c' => "46 47. 27 07. 05 04 02. 22 42. 43",
        'd' => "49 42/45 47. 27 07. 05 04 02. 22 42. 44",
        'e' => "05 45 47. 27 07. 05 04 02. 22 42. 43",
        'f' => "39 19. 17 12/07 37",
        'g' => "47 42 40. 20 00. 01/45 47. 27 07. 05 04 02. 22 42. 44",
        'h' => "09 02/05 07. 27 47. 45 42",
        'i' => "02 07/09 09",
        'j' => "17 12 10. 00/19 19",
        'k' => "09 02/37 04/15 42",
        'l' => "09 02",
        'm' => "02 07/05 07. 17 37. 35 32/35 37. 47 67. 65 62",
        'n' => "02 07/05 07. 27 47. 45 42",
        'o' => "27 07. 05 04 02. 22 42. 44 45 47. 27",
        'p' => "07 00/05 07. 27 47. 45 44 42. 22 02. 04",
        'q' => "47 40/45 47. 27 07. 05 04 02. 22 42. 44",
        'r' => "02 07/05 07. 27 37",
        's' => "37 17 07. 06 05. 15 25 35. 34 32. 22 02",
        't' => "19 14 12. 32/07 37",
        'u' => "07 04 02. 22 42. 44/47 42",
        'v' => "07 22 47",
        'w' => "07 12 36 52 67",
        'x' => "07 42/02 47",
        'y' => "07 22/47 10",
        'z' => "07 47 02 42",
        '1' => "17 29 22",
        '2' => "07 09. 29 49. 47 45. 02 42",
        '3' => "08 09. 29 49. 46. 26 16/26 46. 42. 22 02. 03",
        '4' => "32 39 04 44",
        '5' => "49 09 06 26 46. 44 42. 22 02. 03",
        '6' => "48 49. 29 09. 06 04 02. 22 42. 44 46. 26 06. 04",
        '7' => "09 49 12",
        '8' => "29 09. 06. 26 46. 49. 29/26 06. 02. 22 42. 46. 26",
        '9' => "03 02. 22 42. 45 47 49. 29 09. 07 05. 25 45. 47",
        '.' => "02 02",
        ',' => "12 01",
        ':' => "02 02/06 06",
        ';' => "12 01/16 16",
        '-' | '–' => "05 35",
        '+' => "05 45/23 27",
        '±' => "06 46/24 28/03 43",
        '=' => "04 44/06 46",
        '/' => "01 49",
        '\\' => "09 41",
        '(' => "29 05. 21",
        ')' => "09 25. 01",
        '[' => "29 09 01 21",
        ']' => "09 29 21 01",
        '<' => "48 05 42",
        '>' => "08 45 02",
        '%' => "19 29. 27. 17 07. 09. 19/34 44. 42. 32 22. 24. 34/02 49",
        '°' => "19 29. 27. 17 07. 09. 19",
        '×' => "03 47/07 43",
        '²' => "08 09. 19 29. 28 06 26",
        '³' => "09 29 17 27. 25. 15 05",
        'µ' => "07 00/04 02. 22 42. 44/47 42",
        '·' => "05 05",
        '_' => "01 41",
        '\'' => "09 07",
        '"' => "09 07/29 27",
        '#' => "13 18/33 38/04 44/06 46",
        '…' => "02 02/22 22/42 42",
        '!' => "09 05/02 02",
        _ => "07 09. 29 49. 47 46. 25 24/22 22",
    }
}

/// Grid units between characters.
const GAP: f32 = 2.1;
/// Grid units of a capital's height.
const CAPITAL: f32 = 7.0;
/// Grid units of a space.
const SPACE: f32 = 1.6;

type Xy = [f32; 2];

/// The character's strokes as line segments in grid units (baseline at 0, y up), and its width.
fn outline(c: char) -> (Vec<[Xy; 2]>, f32) {
    let mut segments = Vec::new();
    let mut width: f32 = if c == ' ' { SPACE } else { 0.0 };
    for stroke in strokes(c).split('/').filter(|s| !s.is_empty()) {
        let points: Vec<(Xy, bool)> = stroke
            .split(' ')
            .map(|p| {
                let digit = |i: usize| f32::from(p.as_bytes()[i] - b'0');
                ([digit(0), digit(1) - 2.0], p.ends_with('.'))
            })
            .collect();
        width = points.iter().filter(|p| !p.1).fold(width, |w, p| w.max(p.0[0]));
        let mut from = points[0].0;
        for i in 1..points.len() {
            let (p, soft) = points[i];
            if !soft {
                if !points[i - 1].1 {
                    segments.push([from, p]);
                }
                from = p;
                continue;
            }
            let (next, next_soft) = points[i + 1];
            let to = if next_soft { middle(p, next) } else { next };
            let start = from;
            for k in 1..=6 {
                let t = k as f32 / 6.0;
                let at = middle_at(middle_at(start, p, t), middle_at(p, to, t), t);
                segments.push([from, at]);
                from = at;
            }
        }
    }
    // Digits share one width, so that figures stand under each other.
    (segments, if c.is_ascii_digit() { 4.0 } else { width })
}

fn middle_at(a: Xy, b: Xy, t: f32) -> Xy {
    [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]
}

fn middle(a: Xy, b: Xy) -> Xy {
    middle_at(a, b, 0.5)
}

/// Width of `text` with capitals `height_px` high, pixels.
pub(crate) fn text_width(text: &str, height_px: f32) -> f32 {
    let units: f32 = text.chars().map(|c| outline(c).1 + GAP).sum();
    (units - GAP).max(0.0) * height_px / CAPITAL
}

/// Writes `text` with its baseline starting at `(x, y)`.
pub(crate) fn write_text(picture: &mut Picture, text: &str, x: f32, y: f32, height_px: f32, colour: [u8; 3]) {
    let scale = height_px / CAPITAL;
    let mut pen = x;
    for c in text.chars() {
        let (segments, width) = outline(c);
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
    fn every_character_is_well_formed_and_inside_its_box() {
        let all = (' '..='~').chain("–±°×²³µ·…".chars());
        for c in all {
            let (segments, width) = outline(c);
            assert!(c == ' ' || !segments.is_empty(), "{c}");
            for p in segments.iter().flatten() {
                assert!((0.0..=6.0).contains(&p[0]) && (-2.0..=7.0).contains(&p[1]), "{c}: {p:?}");
            }
            assert!(width <= 6.0, "{c}");
        }
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
