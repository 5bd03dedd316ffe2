//! All tools of a library on one sheet (SVG), to one scale.

use std::fmt::Write;

use crate::drawing::{Drawing, Silhouette, TEXT_SHARE, n};
use crate::library::Library;

/// Tools in a row at most: more are too small on a screen.
const IN_A_ROW: usize = 6;
/// Width of the sheet on a screen, pixels.
const WIDTH_PX: f64 = 1600.0;

/// The tools of a library as one SVG document, in rows, all to the same scale: one unit is 1 mm. It has neither scripts
/// nor links.
#[must_use]
pub fn library_svg(library: &Library) -> String {
    let heights = library.tools.iter().map(|tool| Silhouette::of(tool).height_mm());
    let text = (TEXT_SHARE * heights.fold(0.0, f64::max)).max(0.1);
    let drawings: Vec<Drawing> = library.tools.iter().map(|tool| Drawing::of(tool, text)).collect();
    let (mut body, mut width, mut top) = (String::new(), 1.0_f64, 0.0);
    for row in drawings.chunks(IN_A_ROW) {
        let above = row.iter().map(|d| d.above).fold(0.0, f64::max);
        let mut left = 0.0;
        for d in row {
            // Writing to a text does not fail.
            let _ = writeln!(
                body,
                "<g class=\"tool\" transform=\"translate({} {})\">\n{}</g>",
                n(left + d.left),
                n(top + above),
                d.body
            );
            left += d.width();
        }
        width = width.max(left);
        top += above + row.iter().map(|d| d.below).fold(0.0, f64::max);
    }
    let tall = top.max(1.0);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" width=\"{WIDTH_PX}\" height=\"{}\" \
         font-family=\"sans-serif\" font-size=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\">\n\
         <desc>claymill tools, 1 unit = 1 mm</desc>\n{body}</svg>\n",
        n(width),
        n(tall),
        n(WIDTH_PX * tall / width),
        n(text),
        n(0.1 * text),
    )
}
