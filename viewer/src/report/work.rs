//! The report's sections on the job: key figures, request, path lengths, setups, regions, and what
//! is not cut.

use std::collections::BTreeMap;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use claymill_toolpath::{
    Bounds, Contain, FaceAccount, Job, LengthByKind, LinkStyle, MachineLimits, MoveKind, RegionTotals,
    RegionsFile, UncutReason,
};
use claymill_verify::{SurfaceState, Verification};
use maud::{Markup, html};

use super::ReportInput;
use super::figures::{area, area_beside, area_of, count, crest, duration, length, plural, share};
use super::plots::{Part, stacked_bar, swatch};
use super::sheets::{axis_name, height_along};
use crate::palette::{CLAY, Rgb};
use crate::strokes::kind_colour;

/// Regions listed before the rest is folded away.
const REGIONS_SHOWN: usize = 40;
/// Faces listed for each reason why they are not cut.
const FACES_SHOWN: usize = 20;
/// Faces of which less is left are not worth a line, as a share of the model's area.
const LEAST_LEFT: f64 = 1e-6;

pub(super) fn subtitle(job: &Job) -> String {
    let [x0, y0, z0, x1, y1, z1] = job.model.box_mm;
    format!(
        "{} · {} · {:.0} × {:.0} × {:.0} mm · {}",
        job.model.path,
        plural(job.model.faces() as u64, "face"),
        x1 - x0,
        y1 - y0,
        z1 - z0,
        area(job.model.area_mm2)
    )
}

pub(super) fn key_figures(job: &Job, regions: &RegionsFile, verification: Option<&Verification>) -> Markup {
    let totals = &job.totals;
    // As measured where it was: one share of the area everywhere.
    let measured = verification.map(|v| &v.coverage);
    let cut_mm2 = match measured {
        Some(found) => found.by_state_mm2.get(&SurfaceState::Cut).copied().unwrap_or_default(),
        None => job.area.cut_mm2,
    };
    let whole_mm2 = measured.map_or(job.area.total_mm2, |found| found.total_mm2);
    let facts = [
        ("Machining time", duration(totals.time_s), "estimated".to_owned()),
        (
            "Cutting length",
            length(totals.length.cut_mm),
            share(totals.length.cut_mm, totals.length.total_mm()) + " of all motion",
        ),
        ("Area cut", area(cut_mm2), share(cut_mm2, whole_mm2) + " of the model"),
        (
            "Regions",
            count(regions.regions.len() as u64),
            format!("from {}", plural(job.model.faces() as u64, "face")),
        ),
        ("Passes", count(u64::from(totals.passes)), plural(u64::from(totals.retracts), "retract")),
        ("Control points", count(totals.control_points), plural(totals.moves, "move")),
    ];
    html! {
        dl.facts {
            @for (name, figure, note) in &facts {
                div { dt { (name) } dd { (figure) small { (note) } } }
            }
        }
    }
}

pub(super) fn asked(job: &Job) -> Markup {
    let r = &job.request;
    let link = match r.link {
        LinkStyle::Zigzag => "zigzag: every second pass runs backwards",
        LinkStyle::OneWay => "one way: every pass starts on the same side",
    };
    let list = |names: &[String]| {
        if names.is_empty() { "–".to_owned() } else { names.join(", ") }
    };
    let rows = [
        ("Tool", super::tool::mill(&r.tool)),
        ("Scallop height", format!("{} mm", r.scallop_mm)),
        ("Strategy", r.strategy.clone()),
        ("Passes are joined", link.to_owned()),
        ("Merging", r.preset.clone()),
        ("Feed", format!("{} mm/min cutting, {} mm/min rapid", r.feed_mm_per_min, r.rapid_mm_per_min)),
        ("Times", machine(&r.machine)),
        ("Axes", format!("up {}, rear to front {}", r.up, r.length)),
        ("Only", list(&r.only)),
        ("Left out", list(&r.skip)),
    ];
    let kept = (!r.bounds.is_none()).then(|| ("Tool is kept", kept(&r.bounds)));
    let rows = rows.into_iter().chain(kept);
    html! {
        h2 id="asked" { "What was asked" }
        table { tbody { @for (name, value) in rows { tr { th scope="row" { (name) } td { (value) } } } } }
    }
}

/// Where the tool is kept, in words.
fn kept(bounds: &Bounds) -> String {
    let side = |sides: &[f64; 6], k: usize| {
        let (name, low, high) = (["x", "y", "z"][k], sides[k], sides[k + 3]);
        match (low > -Bounds::FAR_MM, high < Bounds::FAR_MM) {
            (true, true) => Some(format!("{name} {low} to {high}")),
            (true, false) => Some(format!("{name} from {low}")),
            (false, true) => Some(format!("{name} up to {high}")),
            (false, false) => None,
        }
    };
    let boxed = |sides: &[f64; 6]| (0..3).filter_map(|k| side(sides, k)).collect::<Vec<_>>().join(", ");
    let (what, over) = match bounds.contain {
        Contain::Contact => ("where it touches", None),
        Contain::Centre => ("its centre", Some("its centre over what is cut")),
        Contain::Edge => ("all of the ball", Some("all of the ball over what is cut")),
    };
    let boxes: Vec<String> = bounds.within_mm.iter().map(boxed).collect();
    let within = (!boxes.is_empty()).then(|| format!("{what} within {} mm", boxes.join(" mm, or ")));
    let away = (!bounds.avoid.is_empty())
        .then(|| format!("{} mm away from {} faces", bounds.avoid_mm, bounds.avoid.len()));
    let out =
        (bounds.extend_mm > 0.0).then(|| format!("passes run out {} mm over open borders", bounds.extend_mm));
    [within, over.map(str::to_owned), away, out].into_iter().flatten().collect::<Vec<_>>().join("; ")
}

fn machine(limits: &MachineLimits) -> String {
    format!(
        "on {}: {} mm/s², {} mm/s³, corners within {} mm",
        limits.name.as_deref().unwrap_or("a clay mill as usual"),
        limits.acceleration_mm_per_s2,
        limits.jerk_mm_per_s3,
        limits.corner_mm
    )
}

pub(super) fn path_lengths(job: &Job) -> Markup {
    let l = &job.totals.length;
    let part = |label: &str, mm: f64, kind| Part {
        label: label.to_owned(),
        value: mm,
        figure: format!("{} ({})", length(mm), share(mm, l.total_mm())),
        colour: kind_colour(kind),
    };
    let parts = [
        part("cut", l.cut_mm, MoveKind::Cut),
        part("lead in and out", l.lead_mm, MoveKind::LeadIn),
        part("link", l.link_mm, MoveKind::Link),
        part("rapid", l.rapid_mm, MoveKind::Rapid),
    ];
    html! {
        h2 id="done" { "What was done" }
        (stacked_bar(&format!("Path length by kind, {} in all", length(l.total_mm())), &parts))
        p {
            @match job.totals.lifted_locations {
                0 => "Every location was proven against all faces of the model.",
                n => { (plural(n, "location")) " could not be proven safe and were lifted to a proven height." }
            }
        }
    }
}

/// Sums of the totals of several regions or setups.
#[derive(Default)]
struct Sum {
    area_mm2: f64,
    passes: u64,
    retracts: u64,
    length: LengthByKind,
    control_points: u64,
    time_s: f64,
}

impl Sum {
    fn add(&mut self, t: &RegionTotals) {
        self.area_mm2 += t.area_mm2;
        self.passes += u64::from(t.passes);
        self.retracts += u64::from(t.retracts);
        self.length.cut_mm += t.length.cut_mm;
        self.length.lead_mm += t.length.lead_mm;
        self.length.link_mm += t.length.link_mm;
        self.length.rapid_mm += t.length.rapid_mm;
        self.control_points += t.control_points;
        self.time_s += t.time_s;
    }

    fn cells(&self) -> Markup {
        if self.passes == 0 {
            return html! { @for _ in 0..7 { td.n { "–" } } };
        }
        html! {
            td.n { (count(self.passes)) }
            td.n { (count(self.retracts)) }
            td.n { (length(self.length.cut_mm)) }
            td.n { (length(self.length.lead_mm + self.length.link_mm)) }
            td.n { (length(self.length.rapid_mm)) }
            td.n { (count(self.control_points)) }
            td.n { (duration(self.time_s)) }
        }
    }
}

fn sum_headings() -> Markup {
    html! {
        th.n scope="col" { "Passes" } th.n scope="col" { "Retracts" } th.n scope="col" { "Cut" }
        th.n scope="col" { "Leads, links" } th.n scope="col" { "Rapid" } th.n scope="col" { "Points" }
        th.n scope="col" { "Time" }
    }
}

pub(super) fn setups(job: &Job) -> Markup {
    let palette = crate::palette::region_palette();
    let whole_mm2 = job.area.total_mm2;
    let parts: Vec<Part> = job
        .setups
        .iter()
        .enumerate()
        .map(|(i, s)| Part {
            label: s.name.clone(),
            value: s.area_mm2,
            figure: area_beside(s.area_mm2, whole_mm2),
            colour: palette[i % palette.len()],
        })
        .collect();
    html! {
        h3 { "Setups" }
        (stacked_bar("Area cut by setup", &parts))
        div.wide { table {
            thead { tr {
                th scope="col" { "Setup" } th scope="col" { "Tool axis" } th.n scope="col" { "Height of rapids" }
                th.n scope="col" { "Area" } (sum_headings())
            } }
            tbody { @for setup in &job.setups {
                @let sum = job.regions.iter().filter(|t| t.setup == setup.name).fold(Sum::default(), |mut s, t| { s.add(t); s });
                @let sum = Sum { time_s: setup.time_s, ..sum };
                @let [x, y, z] = setup.axis;
                tr {
                    th scope="row" { (setup.name) }
                    td { (axis_name([x, y, z])) }
                    td.n { (height_along([x, y, z], setup.clearance_mm)) }
                    td.n { (area_beside(setup.area_mm2, whole_mm2)) }
                    (sum.cells())
                }
            } }
        } }
    }
}

/// One region: where it is, what it is, what its passes leave.
fn region_row(input: &ReportInput<'_>, index: usize, sum: &Sum) -> Markup {
    let region = &input.regions.regions[index];
    let largest_mm2 = input.regions.regions.iter().map(|r| r.area_mm2).fold(0.0, f64::max);
    let id = region.id;
    let by_setup: Vec<String> = region
        .setup_area_mm2
        .iter()
        .filter(|(_, a)| **a > 0.0)
        .map(|(name, a)| format!("{name} {}", area_beside(*a, largest_mm2)))
        .collect();
    let crests = input.verification.and_then(|v| v.scallop.crests.by_region.iter().find(|c| c.region == id));
    let held = input.verification.is_some_and(|v| v.holder.is_some());
    let stick_outs: Vec<String> = (input.verification.and_then(|v| v.holder.as_ref()).into_iter())
        .flat_map(|h| h.regions.iter().filter(|r| r.region == id))
        .map(|r| format!("{} {:.2} mm", r.setup, r.stick_out_needed_mm))
        .collect();
    let colour = input.region_colours.get(id).copied().unwrap_or(CLAY);
    html! { tr {
        @if let Some(t) = input.thumbnails.get(id) {
            td.thumb { img width="108" height="63" loading="lazy" alt=(format!("Region {id} on the model, from {}", t.seen_from))
                src=(format!("data:image/png;base64,{}", STANDARD.encode(&t.png))); }
        }
        th scope="row" {
            (swatch(colour))
            @if input.space.is_some() { a href="#space" data-region=(id) { (id) } } @else { (id) }
        }
        td.n { (count(region.faces.len() as u64)) }
        td.n { (area_beside(region.area_mm2, largest_mm2)) }
        td.parts { @if by_setup.is_empty() { span.soft { "not cut" } } @for part in &by_setup { span { (part) } } }
        (sum.cells())
        @if held {
            td.n { @if stick_outs.is_empty() { "–" } @else { (stick_outs.join(", ")) } }
        }
        @match crests {
            Some(c) => { td.n { (crest(c.p99_mm)) br; small.soft { "max " (crest(c.max_mm)) } } }
            None => { td.n { "–" } }
        }
    } }
}

pub(super) fn regions(input: &ReportInput<'_>) -> Markup {
    let mut sums: BTreeMap<usize, Sum> = BTreeMap::new();
    for totals in &input.job.regions {
        sums.entry(totals.region).or_default().add(totals);
    }
    let none = Sum::default();
    let row = |index: usize| {
        let sum = sums.get(&input.regions.regions[index].id).unwrap_or(&none);
        region_row(input, index, sum)
    };
    let table = |range: std::ops::Range<usize>| {
        html! { div.wide { table {
            thead { tr {
                @if !input.thumbnails.is_empty() { th scope="col" { "Where" } }
                th scope="col" { "Region" } th.n scope="col" { "Faces" } th.n scope="col" { "Area" }
                th scope="col" { "Area by setup" } (sum_headings())
                @if input.verification.is_some_and(|v| v.holder.is_some()) { th.n scope="col" { "Stick-out needed" } }
                th.n scope="col" { "Scallop 99 %" }
            } }
            tbody { @for index in range { (row(index)) } }
        } } }
    };
    let total = input.regions.regions.len();
    let shown = total.min(REGIONS_SHOWN);
    html! {
        h2 id="regions" { "Regions" }
        p {
            "A region is a set of faces that is cut as one surface; the colours are those of the pictures, the region is the \
             dark part of its small picture, and a ring marks what is too small to be seen."
        }
        (table(0..shown))
        @if total > shown {
            details { summary { (plural((total - shown) as u64, "smaller region")) } (table(shown..total)) }
        }
    }
}

pub(super) fn not_cut(job: &Job, is_measured: bool) -> Markup {
    let whole = job.area.total_mm2;
    let part = |label: &str, mm2: f64, colour| Part {
        label: label.to_owned(),
        value: mm2,
        figure: format!("{} ({})", area_of(mm2, whole), share(mm2, whole)),
        colour,
    };
    let mut parts = vec![part("cut", job.area.cut_mm2, kind_colour(MoveKind::Cut))];
    parts.extend(job.area.uncut_mm2.iter().map(|(&r, &mm2)| {
        let (label, colour) = why_not_cut(r);
        part(label, mm2, colour)
    }));
    let unaccounted = whole - job.area.cut_mm2 - job.area.uncut_mm2.values().sum::<f64>();
    html! {
        h2 id="uncut" { "Where the model's area went" }
        @if is_measured {
            p { "The shares are measured: see " a href="#coverage" { "coverage" } ". The faces below are the planner's account, which \
                 decides triangle by triangle and so differs from the measured areas by a few triangles along every border." }
        } @else {
            (stacked_bar(&format!("{} in all, as planned", area(whole)), &parts))
        }
        @if unaccounted.abs() > 1e-6 * whole {
            p.error { b { "The account does not close: " } (area(unaccounted)) " are missing." }
        }
        (faces_not_cut(job))
    }
}

/// The faces that lost most, by reason.
fn faces_not_cut(job: &Job) -> Markup {
    let mut left: BTreeMap<UncutReason, Vec<(f64, &FaceAccount)>> = BTreeMap::new();
    for face in &job.faces {
        for (&reason, &mm2) in face.area.uncut_mm2.iter().filter(|u| *u.1 > LEAST_LEFT * job.area.total_mm2) {
            left.entry(reason).or_default().push((mm2, face));
        }
    }
    for faces in left.values_mut() {
        faces.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.face.cmp(&b.1.face)));
    }
    html! {
        @for (reason, faces) in &left {
            @let (words, _) = why_not_cut(*reason);
            @let largest_mm2 = faces.iter().map(|f| f.0).fold(0.0, f64::max);
            details open[*reason != UncutReason::Hidden] {
                summary { (plural(faces.len() as u64, "face")) " " (words) }
                div.wide { table {
                    thead { tr {
                        th scope="col" { "Face" } th scope="col" { "Entity" } th scope="col" { "Region" }
                        th.n scope="col" { "Not cut" } th.n scope="col" { "Of the face" }
                    } }
                    tbody { @for (mm2, face) in faces.iter().take(FACES_SHOWN) { tr {
                        th scope="row" { (face.face) } td { (face.entity) } td { (face.region) }
                        td.n { (area_beside(*mm2, largest_mm2)) } td.n { (share(*mm2, face.area.total_mm2)) }
                    } } }
                } }
                @if faces.len() > FACES_SHOWN {
                    p.soft { "The largest " (FACES_SHOWN) "; " code { "job.json" } " has them all." }
                }
            }
        }
    }
}

fn why_not_cut(reason: UncutReason) -> (&'static str, Rgb) {
    match reason {
        UncutReason::Hidden => ("hidden: no tool direction reaches it", [150, 152, 156]),
        UncutReason::TooTight => ("too tight for the tool", [205, 62, 0]),
        UncutReason::Excluded => ("left out on request", [230, 190, 120]),
        UncutReason::EarlierTool => ("cut by the earlier tool", [120, 170, 150]),
        UncutReason::OutOfBounds => ("out of the tool's bounds, as asked", [196, 196, 150]),
        UncutReason::Roughed => ("roughed by levels, which cut no surface", [150, 165, 190]),
        UncutReason::NotCovered => ("left out: could not be triangulated", [130, 60, 150]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_said_in_words() {
        let slice = [300.0, -1e9, -1e9, 600.0, 1e9, 900.0];
        let bounds = Bounds { contain: Contain::Edge, within_mm: vec![slice], ..Bounds::default() };
        let said = "all of the ball within x 300 to 600, z up to 900 mm; all of the ball over what is cut";
        assert_eq!(kept(&bounds), said);
        let bounds = Bounds { avoid: vec![4, 7], avoid_mm: 1.5, extend_mm: 5.0, ..Bounds::default() };
        assert_eq!(kept(&bounds), "1.5 mm away from 2 faces; passes run out 5 mm over open borders");
    }
}
