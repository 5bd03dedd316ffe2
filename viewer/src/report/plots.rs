//! Plots of the report as inline SVG: stacked bars, histograms, bars side by side, and values
//! against a limit.

use claymill_verify::SCALLOP_BAR;
use maud::{Markup, html};

use super::figures::{crest, share};

use crate::Rgb;

/// A part of a whole.
pub(super) struct Part {
    pub(super) label: String,
    pub(super) value: f64,
    pub(super) figure: String,
    pub(super) colour: Rgb,
}

/// A colour as CSS writes it.
pub(super) fn css([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// A small square of the colour; the words beside it say the same.
pub(super) fn swatch(colour: Rgb) -> Markup {
    html! { span.swatch style=(format!("background:{}", css(colour))) aria-hidden="true" {} }
}

/// Parts of a whole as one bar, with the figures listed below.
pub(super) fn stacked_bar(title: &str, parts: &[Part]) -> Markup {
    const WIDTH: f64 = 1000.0;
    let total: f64 = parts.iter().map(|p| p.value.max(0.0)).sum();
    let spoken: Vec<String> = parts.iter().map(|p| format!("{} {}", p.label, p.figure)).collect();
    let mut left = 0.0;
    html! {
        figure.plot {
            figcaption { (title) }
            @if total > 0.0 {
                svg viewBox="0 0 1000 34" preserveAspectRatio="none" role="img"
                    aria-label=(format!("{title}: {}", spoken.join(", "))) {
                    @for part in parts.iter().filter(|p| p.value > 0.0) {
                        @let width = WIDTH * part.value / total;
                        rect x=(format!("{left:.2}")) y="0" width=(format!("{width:.2}")) height="34"
                            fill=(css(part.colour)) {}
                        ({ left += width; "" })
                    }
                }
            }
            ul.key {
                @for part in parts {
                    li { (swatch(part.colour)) (part.label) " " b { (part.figure) } }
                }
            }
        }
    }
}

/// Shares in bins of a height, over the height; bins up to the bar are filled, those above striped, so that they are told
/// apart without colours.
pub(super) fn histogram(title: &str, shares: &[f64], bin: f64, asked_mm: f64) -> Markup {
    const BASE: f64 = 190.0;
    const TALL: f64 = 160.0;
    let most = shares.iter().copied().fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let width = 940.0 / shares.len() as f64;
    let left = |k: f64| 30.0 + k * width;
    let below: f64 = shares.iter().take((SCALLOP_BAR / bin).round() as usize).sum();
    let percent = |x: f64| share(x, 1.0);
    let spoken = format!(
        "{title}: {} up to the bar, {SCALLOP_BAR} of the height asked for, {} above; the fullest bin holds {}",
        percent(below),
        percent((1.0 - below).max(0.0)),
        percent(most)
    );
    let ticks = [0.0, 0.5, 1.0, 1.5, 2.0].map(|share| (left(share / bin), share * asked_mm));
    html! {
        figure.plot {
            figcaption { (title) }
            svg.axis viewBox="0 0 1000 230" role="img" aria-label=(spoken) {
                defs { pattern id="stripes" width="7" height="7" patternUnits="userSpaceOnUse" patternTransform="rotate(45)" {
                    rect.over width="3.5" height="7" {}
                } }
                @for (k, &part) in shares.iter().enumerate().filter(|s| *s.1 > 0.0) {
                    @let tall = (TALL * part / most).max(1.0);
                    rect class=(if (k as f64 + 0.5) * bin < SCALLOP_BAR { "value" } else { "above" })
                        x=(format!("{:.1}", left(k as f64) + 1.0)) y=(format!("{:.1}", BASE - tall))
                        width=(format!("{:.1}", width - 2.0)) height=(format!("{tall:.1}")) {}
                }
                line.base x1="30" y1="190" x2="970" y2="190" {}
                @for (x, side, name) in [(left(1.0 / bin), -8.0, "asked"), (left(SCALLOP_BAR / bin), 8.0, "bar")] {
                    line.limit x1=(format!("{x:.1}")) y1="10" x2=(format!("{x:.1}")) y2="190" {}
                    text x=(format!("{:.1}", x + side)) y="22" text-anchor=(if side < 0.0 { "end" } else { "start" }) { (name) }
                }
                @for (i, (x, mm)) in ticks.iter().enumerate() {
                    @let last = i + 1 == ticks.len();
                    @let (x, anchor) = if last { (998.0, "end") } else if i == 0 { (2.0, "start") } else { (*x, "middle") };
                    text x=(format!("{x:.1}")) y="210" text-anchor=(anchor) {
                        (crest(*mm)) @if last { "+" }
                    }
                }
                text x="34" y="22" { (percent(most)) " in the fullest bin" }
            }
        }
    }
}

/// Named values as bars from zero.
pub(super) fn against_each_other(title: &str, bars: &[(String, f64, String)]) -> Markup {
    const ROW: usize = 34;
    let most = bars.iter().map(|b| b.1).fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let spoken: Vec<String> = bars.iter().map(|(name, _, figure)| format!("{name} {figure}")).collect();
    html! {
        figure.plot {
            figcaption { (title) }
            svg.axis viewBox=(format!("0 0 1000 {}", ROW * bars.len())) role="img"
                aria-label=(format!("{title}: {}", spoken.join(", "))) {
                @for (i, (name, value, figure)) in bars.iter().enumerate() {
                    @let width = 560.0 * value.max(0.0) / most;
                    text x="220" y=(ROW * i + 22) text-anchor="end" { (name) }
                    rect.value x="232" y=(ROW * i + 6) width=(format!("{width:.1}")) height="22" {}
                    text x=(format!("{:.1}", 242.0 + width)) y=(ROW * i + 22) { (figure) }
                }
            }
        }
    }
}

/// A value on a scale.
pub(super) struct Tick {
    pub(super) label: &'static str,
    pub(super) value: f64,
    pub(super) figure: String,
}

/// Measured values on a line from zero, against the limit that was asked for.
pub(super) fn against_limit(title: &str, limit: &Tick, measured: &[Tick]) -> Markup {
    let largest = measured.iter().map(|t| t.value).fold(limit.value, f64::max);
    let scale = if largest > 0.0 { 940.0 / (1.1 * largest) } else { 0.0 };
    let x = |value: f64| format!("{:.1}", 30.0 + value.max(0.0) * scale);
    let spoken: Vec<String> = measured.iter().map(|t| format!("{} {}", t.label, t.figure)).collect();
    html! {
        figure.plot {
            figcaption { (title) }
            svg.axis viewBox="0 0 1000 96" role="img"
                aria-label=(format!("{title}: {}; {} {}", spoken.join(", "), limit.label, limit.figure)) {
                rect.within x="30" y="40" width=(format!("{:.1}", limit.value * scale)) height="16" {}
                line.base x1="30" y1="48" x2="970" y2="48" {}
                line.limit x1=(x(limit.value)) y1="36" x2=(x(limit.value)) y2="70" {}
                text x=(x(limit.value)) y="90" text-anchor="middle" { (limit.label) " " (limit.figure) }
                @for (i, tick) in measured.iter().enumerate() {
                    circle.value cx=(x(tick.value)) cy="48" r="7" {}
                    // Every second label lower, so that close values stay readable.
                    text x=(x(tick.value)) y=(if i % 2 == 0 { 14 } else { 31 }) text-anchor="middle" {
                        (tick.label) " " (tick.figure)
                    }
                }
            }
        }
    }
}
