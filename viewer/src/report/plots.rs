use maud::{Markup, html};

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
                line.limit x1=(x(limit.value)) y1="26" x2=(x(limit.value)) y2="70" {}
                text x=(x(limit.value)) y="90" text-anchor="middle" { (limit.label) " " (limit.figure) }
                @for (i, tick) in measured.iter().enumerate() {
                    circle.value cx=(x(tick.value)) cy="48" r="7" {}
                    // Every second label lower, so that close values stay readable.
                    text x=(x(tick.value)) y=(if i % 2 == 0 { 18 } else { 34 }) text-anchor="middle" {
                        (tick.label) " " (tick.figure)
                    }
                }
            }
        }
    }
}
