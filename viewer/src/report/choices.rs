//! The report's section on strategies that `auto` considered for each region, and what they cost.

use claymill_toolpath::{Considered, Job, RegionTotals};
use maud::{Markup, html};

use super::figures::{area, count, length};

/// Regions shown before the rest is folded away.
const SHOWN: usize = 15;

/// What was weighed where the strategy was left to the planner: nothing where it was not.
pub(super) fn section(job: &Job) -> Markup {
    let mut chosen: Vec<&RegionTotals> = job.regions.iter().filter(|t| t.considered.len() > 1).collect();
    chosen.sort_by(|a, b| b.area_mm2.total_cmp(&a.area_mm2));
    let mut names: Vec<&str> = Vec::new();
    for c in chosen.iter().flat_map(|t| &t.considered) {
        if !names.contains(&c.strategy.as_str()) {
            names.push(&c.strategy);
        }
    }
    let shown = chosen.len().min(SHOWN);
    let won = |name: &str| chosen.iter().filter(|t| t.strategy == name).count();
    html! {
        @if !chosen.is_empty() {
            h2 { "Choice of strategy" }
            p {
                "For every region and direction the strategies were laid out side by side, each until it cost more than \
                 another one in length and in passes; the one that costs least was cut: "
                @for (i, name) in names.iter().enumerate() {
                    @if i > 0 { ", " } (name) " " (count(won(name) as u64)) " ×"
                } "."
            }
            (table(&chosen[..shown], &names))
            @if chosen.len() > shown {
                details { summary { (count((chosen.len() - shown) as u64)) " smaller ones" } (table(&chosen[shown..], &names)) }
            }
        }
    }
}

fn table(rows: &[&RegionTotals], names: &[&str]) -> Markup {
    let cell = |t: &RegionTotals, name: &str| {
        let found: Option<&Considered> = t.considered.iter().find(|c| c.strategy == name);
        html! { td.n { @match found {
            Some(c) => {
                @if t.strategy == name { b { "✓ " (length(c.length_mm)) } }
                @else if c.given_up { "over " (length(c.length_mm)) }
                @else { (length(c.length_mm)) }
                br; small.soft { (count(u64::from(c.passes))) " passes" }
            }
            None => { "–" }
        } } }
    };
    html! { div.wide { table {
        caption { "Length and passes as laid out; ✓ was cut, “over”: given up there" }
        thead { tr {
            th scope="col" { "Region" } th scope="col" { "Setup" } th.n scope="col" { "Area" }
            @for name in names { th.n scope="col" { (name) } }
        } }
        tbody { @for t in rows { tr {
            th scope="row" { (t.region) } td { (t.setup) } td.n { (area(t.area_mm2)) }
            @for name in names { (cell(t, name)) }
        } } }
    } } }
}
