//! The number of regions over a limit, as SVG.

use std::fmt::Write;

use claymill_surface_merge::SweptLimit;

use super::sweep::Tree;

/// Size of one diagram and the space around its axes, pixels.
const SIZE: (f64, f64) = (640.0, 360.0);
const MARGIN: (f64, f64, f64, f64) = (70.0, 20.0, 36.0, 50.0);

/// One diagram below the other, both axes logarithmic: the tree as a step line, merging as usual as points.
pub(super) fn svg(trees: &[Tree]) -> String {
    let height = SIZE.1 * trees.len() as f64;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {height}\" width=\"{0}\" \
         height=\"{height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"{0}\" height=\"{height}\" fill=\"white\"/>\n",
        SIZE.0
    );
    for (k, tree) in trees.iter().enumerate() {
        diagram(&mut out, tree, SIZE.1 * k as f64);
    }
    out + "</svg>\n"
}

fn diagram(out: &mut String, tree: &Tree, top: f64) {
    let (title, axis) = match tree.tree.limit {
        SweptLimit::Angle => ("Regions by the angle allowed at joints", "angle, degrees"),
        SweptLimit::CurvatureMachining => ("Regions by the curvature jump allowed at joints", "R·|Δκ|"),
        SweptLimit::CurvatureRelative => ("Regions by the relative curvature difference allowed", "μ"),
    };
    let grown = &tree.tree.grown;
    let (Some(first), Some(last)) = (grown.first(), grown.last()) else { return };
    let x_range = (first.at.log10(), last.at.log10());
    let start = tree.tree.regions_at(first.at);
    let counts = || grown.iter().map(|s| s.regions).chain([start, tree.tree.regions_at(last.at)]);
    let least = counts().min().unwrap_or(1).max(1) as f64;
    let most = counts().max().unwrap_or(1).max(1) as f64;
    let y_range = (least.log10().floor(), most.log10().ceil().max(least.log10().floor() + 1.0));

    let (left, right) = (MARGIN.0, SIZE.0 - MARGIN.1);
    let (upper, lower) = (top + MARGIN.2, top + SIZE.1 - MARGIN.3);
    let x = |at: f64| left + (right - left) * (at.log10() - x_range.0) / (x_range.1 - x_range.0);
    let y = |n: f64| lower + (upper - lower) * (n.log10() - y_range.0) / (y_range.1 - y_range.0);
    // Writing to a string cannot fail.
    let mut put = |line: std::fmt::Arguments<'_>| {
        let _ = writeln!(out, "{line}");
    };
    put(format_args!("<text x=\"{left}\" y=\"{:.1}\" font-weight=\"bold\">{title}</text>", upper - 14.0));
    for step in grown {
        let at = x(step.at);
        put(format_args!(
            "<path d=\"M{at:.1} {lower:.1}V{upper:.1}\" stroke=\"#e4e4e4\"/>\
             <text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            lower + 16.0,
            step.at
        ));
    }
    for decade in y_range.0 as i32..=y_range.1 as i32 {
        for n in [1.0, 2.0, 5.0].map(|n| n * 10f64.powi(decade)) {
            if n.log10() <= y_range.1 + 1e-9 {
                let at = y(n);
                put(format_args!(
                    "<path d=\"M{left:.1} {at:.1}H{right:.1}\" stroke=\"#e4e4e4\"/>\
                     <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{n}</text>",
                    left - 6.0,
                    at + 4.0
                ));
            }
        }
    }
    let mut line = format!("M{left:.1} {:.1}", y(start.max(1) as f64));
    for step in tree.curve.iter().filter(|s| s.at > first.at && s.at <= last.at) {
        let _ = write!(line, "H{:.1}V{:.1}", x(step.at), y(step.regions.max(1) as f64));
    }
    put(format_args!(
        "<path d=\"{line}H{right:.1}\" fill=\"none\" stroke=\"#3465a4\" stroke-width=\"1.5\"/>"
    ));
    for step in grown {
        let (at, n) = (x(step.at), y(step.regions.max(1) as f64));
        put(format_args!(
            "<circle cx=\"{at:.1}\" cy=\"{n:.1}\" r=\"3.5\" fill=\"#cc0000\"/>\
             <text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#cc0000\">{}</text>",
            n - 8.0,
            step.regions
        ));
    }
    put(format_args!(
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{axis} – line: smooth joints alone, points: \
         nearly smooth borders too</text>",
        0.5 * (left + right),
        lower + 36.0
    ));
}
