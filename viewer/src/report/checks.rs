//! The section of the report that tells whether the job may be run, and the table of measurements.

use claymill_verify::{
    Coverage, Finding, HISTOGRAM_BIN, Place, Severity, SurfaceState, TooTight, Verification,
};
use maud::{Markup, html};

use super::figures::{area_beside, area_of, count, crest, deviation, plural, point, share};
use super::plots::{Part, Tick, against_limit, histogram, stacked_bar};
use crate::palette::Rgb;

/// Findings that the verdict lists before it refers to the table.
const FINDINGS_ON_TOP: usize = 5;

/// The first thing to read: may this job be run?
pub(super) fn verdict(verification: Option<&Verification>) -> Markup {
    let Some(v) = verification else {
        return html! {
            div.verdict.open role="status" {
                strong { "Not verified" }
                "Nothing in this report has been checked against the model. Run "
                code { "claymill verify" } " on the job folder before it goes to a machine."
            }
        };
    };
    let findings = &v.verdict.findings;
    let errors = findings.iter().filter(|f| f.severity == Severity::Error).count() as u64;
    let warnings = findings.len() as u64 - errors;
    html! {
        div.verdict.(if v.verdict.passed { "passed" } else { "failed" }) role="status" {
            strong { (if v.verdict.passed { "Verified: passed" } else { "Verification failed: do not run this job" }) }
            p { (summary(v)) }
            @if !findings.is_empty() {
                (plural(errors, "error")) ", " (plural(warnings, "warning")) ":"
                ul { @for finding in findings.iter().take(FINDINGS_ON_TOP) { (finding_line(finding)) } }
                @if findings.len() > FINDINGS_ON_TOP { a href="#checks" { "All findings" } }
            }
        }
    }
}

fn summary(v: &Verification) -> String {
    let cut = v.coverage.by_state_mm2.get(&SurfaceState::Cut).copied().unwrap_or(0.0);
    format!(
        "Deepest gouge {}, scallop {} at the 99th percentile ({} asked), {} of the model's area cut.",
        deviation(v.gouge.deepest_mm),
        crest(v.scallop.crests.p99_mm),
        crest(v.scallop_mm),
        share(cut, v.coverage.total_mm2)
    )
}

fn finding_line(finding: &Finding) -> Markup {
    let (class, word) = match finding.severity {
        Severity::Error => ("error", "Error: "),
        Severity::Warning => ("warning", "Warning: "),
    };
    html! { li.(class) { b { (word) } (finding.message.trim_end_matches('.')) "." @if let Some(p) = &finding.place { " At " (place(p)) "." } } }
}

fn place(p: &Place) -> String {
    let mut text = point(&p.point_mm);
    if let Some(seq) = p.move_seq {
        text += &format!(", move {seq}");
    }
    match (&p.entity, p.face) {
        (Some(entity), Some(face)) => text += &format!(", face {face} ({entity})"),
        (None, Some(face)) => text += &format!(", face {face}"),
        _ => (),
    }
    text
}

fn place_or_dash(p: Option<&Place>) -> String {
    p.map_or_else(|| "–".into(), place)
}

/// Everything that was measured.
pub(super) fn section(verification: Option<&Verification>) -> Markup {
    let Some(v) = verification else { return html! {} };
    let crests = &v.scallop.crests;
    let asked = Tick { label: "asked", value: v.scallop_mm, figure: crest(v.scallop_mm) };
    let tick = |label, value| Tick { label, value, figure: crest(value) };
    let heights = [tick("mean", crests.mean_mm), tick("99 %", crests.p99_mm), tick("max", crests.max_mm)];
    html! {
        h2 id="checks" { "Verification" }
        p { "Measured from the written files and the exact surfaces alone, without any code of the planner. "
            "Rapids are checked against the finished model, not against stock: raw material must lie within their clearance." }
        @if !v.verdict.findings.is_empty() {
            ul { @for finding in &v.verdict.findings { (finding_line(finding)) } }
        }
        (against_limit("Scallop crests between neighbouring passes", &asked, &heights))
        @if !crests.histogram.is_empty() {
            (histogram(
                "How the heights of the crests are spread, by length",
                &crests.histogram,
                HISTOGRAM_BIN,
                v.scallop_mm,
            ))
            p { "Even, between 0.90 and 1.05 of the height asked for: " b { (share(crests.even_share, 1.0)) } "; 95 % are lower than "
                b { (crest(crests.p95_mm)) } "." }
        }
        (measurements(v))
        (coverage(&v.coverage))
    }
}

fn measurements(v: &Verification) -> Markup {
    let (g, c, r, s) = (&v.gouge, &v.contact, &v.rapids, &v.scallop);
    let on_length = || "of the length of all passes".to_owned();
    let clearance = r.clearance_min_mm.map_or_else(|| "–".into(), |mm| format!("{mm:.2} mm"));
    let mut rows = vec![
        ("Deepest gouge", deviation(g.deepest_mm), place_or_dash(g.deepest_at.as_ref()), g.samples),
        (
            "Gouges deeper than 1, 2, 5 µm",
            format!(
                "{}, {}, {}",
                count(g.deeper_than_1_um),
                count(g.deeper_than_2_um),
                count(g.deeper_than_5_um)
            ),
            "places".into(),
            g.samples,
        ),
        (
            "Largest gap under the ball",
            deviation(c.excess_max_mm),
            place_or_dash(c.excess_max_at.as_ref()),
            c.samples,
        ),
        (
            "Gap under the ball, 99 % and mean",
            format!("{}, {}", deviation(c.excess_p99_mm), deviation(c.excess_mean_mm)),
            String::new(),
            c.samples,
        ),
        ("Ball rolls over an edge", share(c.on_edge_share, 1.0), on_length(), c.samples),
        ("Ball in the air", share(c.in_air_share, 1.0), on_length(), c.samples),
        (
            "Smallest clearance of rapids from the finished model",
            clearance,
            place_or_dash(r.clearance_min_at.as_ref()),
            r.moves,
        ),
        ("Rapids that touch", count(r.touching), String::new(), r.moves),
        (
            "Highest scallop crest",
            crest(s.crests.max_mm),
            place_or_dash(s.crests.max_at.as_ref()),
            s.crests.samples,
        ),
        (
            "Scallop crests, 99 % and mean",
            format!("{}, {}", crest(s.crests.p99_mm), crest(s.crests.mean_mm)),
            format!("{} out of the ball's reach left out", count(s.crests.out_of_reach)),
            s.crests.samples,
        ),
        (
            "Material left on the surface, 99 % and mean",
            format!("{}, {}", crest(s.surface.p99_mm), crest(s.surface.mean_mm)),
            format!("{} of the cut area above the bar", share(s.surface.above_limit_share, 1.0)),
            s.surface.samples,
        ),
    ];
    if let Some(order) = &v.sequence {
        let faults = [&order.jump, &order.order, &order.feed, &order.retract, &order.totals];
        let first = faults.iter().find(|f| f.count > 0);
        rows.push((
            "Moves that do not begin where the last one ended, are out of order, have another feed",
            format!("{}, {}, {}", count(order.jump.count), count(order.order.count), count(order.feed.count)),
            first.map_or_else(|| "–".into(), |f| place_or_dash(f.first_at.as_ref())),
            order.moves,
        ));
    }
    if let Some(near) = &v.obstacles {
        let least = near.clearance_min_mm.map_or_else(|| "nothing near".into(), |mm| format!("{mm:.3} mm"));
        let at = place_or_dash(near.clearance_min_at.as_ref());
        rows.push(("Smallest distance from obstacles", least, at, near.samples));
        rows.push((
            "Moves that enter an obstacle, come too near",
            format!("{}, {}", count(near.touching), count(near.near)),
            format!("asked for were {} mm", near.asked_mm),
            near.samples,
        ));
    }
    if let Some(kept) = &v.bounds {
        rows.push((
            "Farthest beyond the tool's bounds",
            format!("{:.3} mm", kept.beyond_max_mm),
            place_or_dash(kept.beyond_at.as_ref()),
            kept.samples,
        ));
        if let Some(asked_mm) = kept.avoid_mm {
            let least = match kept.avoided_min_mm {
                Some(mm) => format!("{mm:.3} mm"),
                None => "nothing near".into(),
            };
            let near = place_or_dash(kept.avoided_min_at.as_ref());
            rows.push(("Smallest distance from avoided faces", least, near, kept.samples));
            rows.push((
                "Moves out of bounds, too near to avoided faces",
                format!("{}, {}", count(kept.beyond), count(kept.too_near)),
                format!("asked for were {asked_mm} mm"),
                kept.samples,
            ));
        } else {
            let of = String::new();
            rows.push(("Moves out of bounds", count(kept.beyond), of, kept.samples));
        }
    }
    if let Some(shank) = &v.shank {
        let entered = shank.deepest_at.as_ref();
        rows.push((
            "Moves on which the shank enters",
            count(shank.touching),
            place_or_dash(entered),
            shank.moves,
        ));
    }
    if let Some(holder) = &v.holder {
        let least = match holder.clearance_min_mm {
            Some(mm) => format!("{mm:.2} mm"),
            None => "nothing near".into(),
        };
        let moves = holder.moves;
        rows.push((
            "Smallest clearance of holders",
            least,
            place_or_dash(holder.clearance_min_at.as_ref()),
            moves,
        ));
        rows.push((
            "Moves on which a holder touches, comes too near",
            format!("{}, {}", count(holder.touching), count(holder.near)),
            format!("asked for were {} mm", holder.asked_mm),
            moves,
        ));
        for setup in holder.setups() {
            let (needed, given) = (holder.stick_out_needed_mm(Some(setup)), holder.stick_out_mm(setup));
            if let Some((needed_mm, given_mm)) = needed.zip(given) {
                let note = format!("for all regions of {setup}; it is {given_mm} mm");
                rows.push(("Stick-out needed", format!("{needed_mm:.2} mm"), note, moves));
            }
        }
    }
    html! {
        div.wide { table {
            thead { tr {
                th scope="col" { "Measured" } th.n scope="col" { "Result" } th scope="col" { "Where, or of what" }
                th.n scope="col" { "Samples" }
            } }
            tbody { @for (name, result, note, samples) in &rows {
                tr { th scope="row" { (name) } td.n { (result) } td { (note) } td.n { (count(*samples)) } }
            } }
        } }
    }
}

fn state_words(state: SurfaceState) -> (&'static str, Rgb) {
    match state {
        SurfaceState::Cut => ("cut", [0, 84, 148]),
        SurfaceState::Excluded => ("left out on request", [230, 190, 120]),
        SurfaceState::Hidden => ("in reach from no direction", [150, 152, 156]),
        SurfaceState::TooTight => ("too tight for the tool", [205, 62, 0]),
        SurfaceState::HolderInTheWay => ("out of reach for the holder", [150, 100, 30]),
        SurfaceState::ReachableLeft => ("reachable but left", [180, 30, 120]),
        SurfaceState::EarlierTool => ("cut by the earlier tool", [120, 170, 150]),
        SurfaceState::OutOfBounds => ("out of the tool's bounds, as asked", [196, 196, 150]),
        SurfaceState::NotMeasured => ("not measured", [60, 60, 64]),
    }
}

fn too_tight(tight: &TooTight) -> Markup {
    html! {
        p { "Where it is too tight, the ball bridges strips " b { (format!("{:.1} mm", tight.width_median_mm)) }
            (format!(" wide at the median, 95 % of them up to {:.1} mm, the widest {:.1} mm", tight.width_p95_mm, tight.width_max_mm))
            @if let Some(at) = &tight.width_max_at { " (" (place(at)) ")" } "." }
        div.wide { table {
            caption { "Rest milling: smaller balls, and how much of it they reach" }
            thead { tr { th.n scope="col" { "Ball radius" } th.n scope="col" { "Share" } th.n scope="col" { "Area" } } }
            tbody { @for ball in &tight.balls {
                tr { td.n { (format!("{} mm", ball.radius_mm)) } td.n { (share(ball.share, 1.0)) } td.n { (area_beside(ball.share * tight.area_mm2, tight.area_mm2)) } }
            } }
        } }
    }
}

fn coverage(c: &Coverage) -> Markup {
    let parts: Vec<Part> = c
        .by_state_mm2
        .iter()
        .map(|(&state, &mm2)| {
            let (label, colour) = state_words(state);
            Part {
                label: label.to_owned(),
                value: mm2,
                figure: format!("{} ({})", area_of(mm2, c.total_mm2), share(mm2, c.total_mm2)),
                colour,
            }
        })
        .collect();
    html! {
        h3 id="coverage" { "Coverage, as measured" }
        (stacked_bar("Area by what became of it", &parts))
        @if let Some(tight) = &c.too_tight { (too_tight(tight)) }
        @if !c.reachable_left_at.is_empty() {
            div.wide { table {
                caption { "Largest reachable areas that were left" }
                thead { tr { th.n scope="col" { "Area" } th scope="col" { "Where" } } }
                tbody { @for left in &c.reachable_left_at {
                    tr { td.n { (area_beside(left.area_mm2, c.reachable_left_at[0].area_mm2)) } td { (place(&left.at)) } }
                } }
            } }
        }
    }
}
