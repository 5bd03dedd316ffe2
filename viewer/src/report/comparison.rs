//! The page that sets several jobs on one model side by side.

use claymill_toolpath::Job;
use claymill_verify::{SurfaceState, Verification};
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::figures::{area, count, crest, deviation, duration, length, share};
use super::plots::against_each_other;
use super::{ReportPicture, head, image};

/// One job of a comparison.
#[derive(Debug, Clone)]
pub struct Compared {
    /// Name, and its folder beside the page.
    pub name: String,
    /// `job.json`.
    pub job: Job,
    /// `verify.json`.
    pub found: Verification,
    /// Area cut ÷ flat step-over ÷ length of the cuts.
    pub efficiency: f64,
    /// Map of the scallop heights.
    pub map: Option<ReportPicture>,
}

/// Jobs on one model, side by side.
#[derive(Debug, Clone, Copy)]
pub struct ComparisonInput<'a> {
    /// The model's name.
    pub title: &'a str,
    /// The jobs.
    pub jobs: &'a [Compared],
    /// How their scallop heights are spread, as SVG.
    pub plot_svg: &'a str,
    /// The command line that makes the comparison again.
    pub command: &'a str,
}

/// The page as text: needs nothing else, but refers to the reports of the jobs in their folders.
#[must_use]
pub fn comparison_html(input: &ComparisonInput<'_>) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            (head(&format!("{} – strategies side by side", input.title)))
            body {
                header {
                    h1 { (input.title) ": side by side" }
                    p.soft { (count(input.jobs.len() as u64)) " jobs on one model. Best of each row marked ✓." }
                }
                main {
                    (table(input.jobs))
                    h2 { "Time and length" }
                    (bars(input.jobs, "Machining time", |c| c.job.totals.time_s, duration))
                    (bars(input.jobs, "Cutting length", |c| c.job.totals.length.cut_mm, length))
                    h2 { "How the scallop heights are spread" }
                    // Made by this program, from numbers alone and names that it escapes.
                    figure.paper { (PreEscaped(input.plot_svg)) }
                    (maps(input.jobs))
                    h2 { "How to make this comparison again" }
                    pre { (input.command) }
                }
            }
        }
    };
    page.into_string()
}

/// What is good in a row.
#[derive(Clone, Copy, PartialEq)]
enum Better {
    Less,
    More,
    Neither,
}

struct Row {
    name: &'static str,
    better: Better,
    value: fn(&Compared) -> f64,
    words: fn(f64) -> String,
}

fn cut_mm2(c: &Compared) -> f64 {
    c.found.coverage.by_state_mm2.get(&SurfaceState::Cut).copied().unwrap_or(0.0)
}

fn whole(value: f64) -> String {
    count(value.max(0.0) as u64)
}

fn rows() -> Vec<Row> {
    use Better::{Less, More, Neither};
    let row = |name, better, value, words| Row { name, better, value, words };
    let percent: fn(f64) -> String = |v| share(v, 1.0);
    vec![
        row("Machining time", Less, |c| c.job.totals.time_s, duration),
        row("Cutting length", Less, |c| c.job.totals.length.cut_mm, length),
        row("Efficiency", More, |c| c.efficiency, |v| format!("{v:.3}")),
        row("Area cut", More, cut_mm2, area),
        row("Passes", Less, |c| f64::from(c.job.totals.passes), whole),
        row("Retracts", Less, |c| f64::from(c.job.totals.retracts), whole),
        row(
            "Not cutting",
            Less,
            |c| 1.0 - c.job.totals.length.cut_mm / c.job.totals.length.total_mm(),
            percent,
        ),
        row("Control points", Less, |c| c.job.totals.control_points as f64, whole),
        row("Scallop asked", Neither, |c| c.job.request.scallop_mm, crest),
        row("Scallop, highest", Less, |c| c.found.scallop.crests.max_mm, crest),
        row("Scallop, 99 %", Neither, |c| c.found.scallop.crests.p99_mm, crest),
        row("Scallop, mean", Neither, |c| c.found.scallop.crests.mean_mm, crest),
        row("Even crests", More, |c| c.found.scallop.crests.even_share, percent),
        row("Even crests inside of regions", More, |c| c.found.scallop.crests.even_inside_share, percent),
        row("Deepest gouge", Less, |c| c.found.gouge.deepest_mm, deviation),
        row("Computing time", Neither, |c| c.job.timings.iter().map(|t| t.seconds).sum(), duration),
    ]
}

fn table(jobs: &[Compared]) -> Markup {
    let best = |row: &Row| {
        let values = jobs.iter().map(row.value).filter(|v| v.is_finite());
        match row.better {
            _ if jobs.len() < 2 => None,
            Better::Less => values.reduce(f64::min),
            Better::More => values.reduce(f64::max),
            Better::Neither => None,
        }
    };
    html! { div.wide { table {
        thead { tr {
            th scope="col" { "" }
            @for c in jobs { th.n scope="col" { a href=(format!("{}/report.html", c.name)) { (c.name) } } }
        } }
        tbody {
            tr { th scope="row" { "Verification" } @for c in jobs { td.n {
                @if c.found.verdict.passed { "passed" } @else { b.bad { "not passed" } }
            } } }
            tr { th scope="row" { "Tool" } @for c in jobs { td.n { (c.job.request.tool) } } }
            @for row in rows() {
                @let best = best(&row);
                tr {
                    th scope="row" { (row.name) }
                    @for c in jobs {
                        @let value = (row.value)(c);
                        td.n {
                            @if best == Some(value) { b { "✓ " ((row.words)(value)) } }
                            @else if value.is_finite() { ((row.words)(value)) }
                            @else { "–" }
                        }
                    }
                }
            }
        }
    } } }
}

fn bars(jobs: &[Compared], title: &str, value: fn(&Compared) -> f64, words: fn(f64) -> String) -> Markup {
    let bars: Vec<(String, f64, String)> =
        jobs.iter().map(|c| (c.name.clone(), value(c), words(value(c)))).collect();
    against_each_other(title, &bars)
}

fn maps(jobs: &[Compared]) -> Markup {
    html! {
        @if jobs.iter().any(|c| c.map.is_some()) {
            h2 { "Scallop height on the model" }
            section.pictures {
                @for c in jobs {
                    @if let Some(map) = &c.map { figure { (image(map)) figcaption { (c.name) ": " (map.caption) } } }
                }
            }
        }
    }
}
