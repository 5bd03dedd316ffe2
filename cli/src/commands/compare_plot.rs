//! How scallop heights are spread, strategy by strategy, as SVG.

use std::fmt::Write;

use claymill_verify::HISTOGRAM_BIN;

use super::compare::Comparison;

/// Size of the diagram and the space around its axes, pixels.
const SIZE: (f64, f64) = (760.0, 420.0);
const LEFT: f64 = 60.0;
const RIGHT: f64 = 190.0;
const TOP: f64 = 40.0;
const BOTTOM: f64 = 56.0;
/// Heights are shown up to this share of what was asked for.
const SHOWN: f64 = 1.5;
/// Okabe-Ito, and a dash for every line: colour is not the only sign.
const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"];
const DASHES: [&str; 4] = ["none", "7 3", "2 3", "9 3 2 3"];

/// Cumulated shares of crest length over height: the steeper near 1, the more evenly the passes lie.
pub(super) fn svg(comparison: &Comparison) -> String {
    let (right, lower) = (SIZE.0 - RIGHT, SIZE.1 - BOTTOM);
    let x = |share: f64| LEFT + (right - LEFT) * share / SHOWN;
    let y = |sum: f64| lower + (TOP - lower) * sum;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n\
         <text x=\"{LEFT}\" y=\"22\" font-weight=\"bold\">Scallop heights as measured</text>\n",
        SIZE.0, SIZE.1
    );
    // Writing to a string cannot fail.
    let mut put = |line: std::fmt::Arguments<'_>| {
        let _ = writeln!(out, "{line}");
    };
    for k in 0..=6 {
        let share = SHOWN * f64::from(k) / 6.0;
        let at = x(share);
        put(format_args!(
            "<path d=\"M{at:.1} {lower:.1}V{TOP:.1}\" stroke=\"#e4e4e4\"/>\
             <text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{share:.2}</text>",
            lower + 16.0
        ));
    }
    for k in 0..=4 {
        let at = y(f64::from(k) / 4.0);
        put(format_args!(
            "<path d=\"M{LEFT:.1} {at:.1}H{right:.1}\" stroke=\"#e4e4e4\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{} %</text>",
            LEFT - 6.0,
            at + 4.0,
            25 * k
        ));
    }
    let asked = x(1.0);
    put(format_args!(
        "<path d=\"M{asked:.1} {lower:.1}V{TOP:.1}\" stroke=\"#888\" stroke-dasharray=\"3 3\"/>"
    ));
    for (k, entry) in comparison.entries.iter().enumerate() {
        let (colour, dash) = (COLOURS[k % COLOURS.len()], DASHES[k % DASHES.len()]);
        let mut line = format!("M{:.1} {:.1}", x(0.0), y(0.0));
        let mut sum = 0.0;
        for (bin, share) in entry.histogram.iter().enumerate() {
            sum += share;
            let up_to = (bin as f64 + 1.0) * HISTOGRAM_BIN;
            if up_to <= SHOWN + 1e-9 {
                let _ = write!(line, "L{:.1} {:.1}", x(up_to), y(sum));
            }
        }
        let at = TOP + 14.0 + 20.0 * k as f64;
        put(format_args!(
            "<path d=\"{line}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\" stroke-dasharray=\"{dash}\"/>\
             <path d=\"M{:.1} {at:.1}h26\" stroke=\"{colour}\" stroke-width=\"2\" stroke-dasharray=\"{dash}\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            right + 12.0,
            right + 44.0,
            at + 4.0,
            entry.name
        ));
    }
    put(format_args!(
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">crest height ÷ scallop height asked for</text>\
         <text x=\"16\" y=\"{:.1}\" text-anchor=\"middle\" transform=\"rotate(-90 16 {:.1})\">share of the crests' \
         length</text>",
        0.5 * (LEFT + right),
        lower + 38.0,
        0.5 * (TOP + lower),
        0.5 * (TOP + lower)
    ));
    out + "</svg>\n"
}
