//! The 3-D view of the report: data, controls and scripts.

use std::collections::BTreeMap;
use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use claymill_toolpath::{Job, LengthByKind, MoveKind, RegionsFile, Setup};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use maud::{Markup, PreEscaped, html};
use serde_json::{Value, json};

use super::figures::{area, count, deviation, duration, length, plural};
use super::plots::{css, swatch};
use super::{ReportInput, ReportPicture};
use crate::browser::{NO_CREST, step_over_mm, way};
use crate::heat::{heat_colour, heat_legend};
use crate::palette::{CLAY, MATERIAL_SIDE, NOT_CUT};
use crate::scene::shows_material;
use crate::strokes::kind_colour;

/// The library that draws, with its licence: see `assets/make-three.sh`.
const LIBRARY: &str = include_str!("../../assets/three.min.js");
const LICENCE: &str = include_str!("../../assets/three.LICENSE");
const PROGRAM: &str = include_str!("space.js");

/// The cover picture, and over it, where the browser can, the job to turn.
pub(super) fn section(input: &ReportInput<'_>, cover: Option<&ReportPicture>) -> Markup {
    let live = input.space.is_some();
    html! {
        section id="space" aria-label="The job" {
            figure.stage {
                @if let Some(cover) = cover { (super::image(cover)) }
                @if live {
                    canvas tabindex="0" role="img" aria-label="The job in three dimensions. Arrow keys turn it, plus and minus zoom; \
                        the lists below choose regions and layers." {}
                    div id="space-scale" aria-hidden="true" {}
                    p id="space-thinned" hidden { "Passes are thinned out: zoom in to see every one" }
                }
                @if let Some(cover) = cover { figcaption.still { (cover.caption) } }
            }
            @if live { (heat_key(input.job)) }
            p id="space-status" role="status" { @if live { "Loading the 3-D view" } }
            @if live { (controls(input)) }
        }
    }
}

fn heat_key(job: &Job) -> Markup {
    html! {
        ul id="space-heat" hidden {
            @for (colour, text) in heat_legend(job.request.scallop_mm) { li { (swatch(colour)) (text) } }
            li { (swatch(NOT_CUT)) "no passes" }
        }
    }
}

fn controls(input: &ReportInput<'_>) -> Markup {
    let layer = |kind: &str, on: bool, sign: Option<MoveKind>, words: &str| {
        html! { label {
            input id=(format!("layer-{kind}")) type="checkbox" checked[on] autocomplete="off";
            @if let Some(sign) = sign { (swatch(kind_colour(sign))) }
            (words)
        } }
    };
    let colouring = |value: &str, words: &str| {
        html! { label {
            input type="radio" name="space-colour" value=(value) checked[value == "region"] autocomplete="off"; (words)
        } }
    };
    html! {
        div.controls {
            div.views role="group" aria-label="Views" {
                @for (view, words) in [("iso", "Fit"), ("top", "Top"), ("left", "Left"), ("right", "Right"),
                    ("front", "Front"), ("rear", "Rear")] { button type="button" data-view=(view) { (words) } }
                button id="space-full" type="button" { "Full screen" }
            }
            @if in_time(input) {
                fieldset.time { legend { "Time: the tool on its way" }
                    button id="space-play" type="button" aria-pressed="false" { "Play" }
                    input id="space-time" type="range" min="0" max="1000" step="any" value="0" autocomplete="off"
                        aria-label="Time of the job";
                    output id="space-clock" for="space-time" {}
                    label { "Speed "
                        select id="space-speed" autocomplete="off" {
                            @for (times, words) in [(10, "10 ×"), (60, "60 ×"), (600, "600 ×")] {
                                option value=(times) selected[times == 60] { (words) }
                            }
                        }
                    }
                }
            }
            fieldset { legend { "Colours" }
                (colouring("region", "regions")) (colouring("scallop", "scallop height")) (colouring("clay", "clay"))
                @if shows_material(&input.regions.sheets) {
                    span { (swatch(MATERIAL_SIDE)) "hatched: side of the material, not cut" }
                }
            }
            fieldset { legend { "Shown" }
                (layer("region", true, None, "surfaces")) (layer("outlines", true, None, "outlines"))
                (layer("patches", false, None, "patches")) (layer("cut", true, None, "passes"))
                (layer("link", true, Some(MoveKind::Link), "links")) (layer("lead", false, Some(MoveKind::LeadIn), "leads"))
                (layer("rapid", false, Some(MoveKind::Rapid), "rapids"))
                label { input id="space-all" type="checkbox" autocomplete="off"; "every pass" }
            }
            div.choices {
                label { "Direction "
                    select id="space-direction" autocomplete="off" {
                        option value="all" { "all" }
                        @for setup in &input.job.setups { option value=(setup.name) { (setup.name) } }
                    }
                }
                label { "Region "
                    select id="space-region" autocomplete="off" {
                        option value="" { "none" }
                        @for region in &input.regions.regions { option value=(region.id) { (region.id) " – " (area(region.area_mm2)) } }
                    }
                }
                label { input id="space-alone" type="checkbox" autocomplete="off"; "only this region" }
            }
            div.chosen aria-live="polite" { h3 id="space-name" {} dl id="space-rows" {} }
        }
    }
}

/// Data and programs of the 3-D view, for the end of the page.
pub(super) fn scripts(input: &ReportInput<'_>) -> Markup {
    let Some(glb) = input.space else { return html! {} };
    let way = in_time(input).then(|| way::way(input.program, input.seconds));
    let mut facts = facts(input);
    if let Some(way) = &way {
        facts["way"] = way.facts.clone();
        let outline = |setup: &Setup| -> Value {
            let tool = input.job.tools.first().map(|tool| tool.in_setup(&setup.name));
            let bands = tool.as_ref().map(crate::tool::outline).unwrap_or_default();
            bands.iter().map(|(ends, colour)| json!([ends, css(*colour)])).collect()
        };
        let outlines = input.job.setups.iter().map(|setup| (setup.name.clone(), outline(setup)));
        facts["tools"] = Value::Object(outlines.collect());
    }
    html! {
        script id="space-facts" type="application/json" { (PreEscaped(in_script(&facts))) }
        script id="space-model" type="application/octet-stream" { (PreEscaped(STANDARD.encode(glb))) }
        @if let Some(way) = &way { script id="space-way" type="application/octet-stream" { (PreEscaped(STANDARD.encode(deflated(&way.bytes)))) } }
        (PreEscaped(format!("<!--\n{}\n-->", LICENCE.replace("--", "- -"))))
        script { (PreEscaped(LIBRARY)) }
        script { (PreEscaped(PROGRAM)) }
    }
}

/// Whether the tool can be shown at any time of the job.
fn in_time(input: &ReportInput<'_>) -> bool {
    !input.program.moves.is_empty() && input.seconds.len() == input.program.moves.len()
}

/// JSON that nothing in it can end the element of.
fn in_script(value: &Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

/// Bytes as the page's programs unpack them: a stream of zlib.
#[must_use]
pub fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    let packed = encoder.write_all(bytes).and_then(|()| encoder.finish());
    debug_assert!(packed.is_ok(), "writing to memory cannot fail");
    packed.unwrap_or_default()
}

fn facts(input: &ReportInput<'_>) -> Value {
    let job = input.job;
    let heat: Vec<String> = (0..=NO_CREST)
        .map(|h| css(if h == NO_CREST { NOT_CUT } else { heat_colour(f64::from(h) / 100.0) }))
        .collect();
    let entities: Vec<&str> = job.faces.iter().map(|f| f.entity.as_str()).collect();
    json!({
        "scallop_mm": job.request.scallop_mm,
        "step_mm": step_over_mm(&job.request),
        "clay": css(CLAY),
        "heat": heat,
        "entities": entities,
        "regions": region_facts(input),
    })
}

/// Name and rows of facts of every region, by id.
fn region_facts(input: &ReportInput<'_>) -> BTreeMap<usize, Value> {
    let (inside, around) = joints(input.regions);
    let facts = |r: &claymill_toolpath::RegionRecord| {
        let mut rows = vec![
            ("Area".to_owned(), area(r.area_mm2)),
            (
                "Faces".to_owned(),
                format!(
                    "{}, {}",
                    count(r.faces.len() as u64),
                    plural(inside[r.id], "joint") + " between them"
                ),
            ),
            ("Joints at its border".to_owned(), count(around[r.id])),
        ];
        let (mut way, mut passes, mut retracts, mut time_s) = (LengthByKind::default(), 0, 0, 0.0);
        for t in input.job.regions.iter().filter(|t| t.region == r.id) {
            let strategy = if t.strategy.is_empty() { String::new() } else { format!(", {}", t.strategy) };
            rows.push((format!("From {}", t.setup), format!("{}{strategy}", area(t.area_mm2))));
            way += t.length;
            passes += u64::from(t.passes);
            retracts += u64::from(t.retracts);
            time_s += t.time_s;
        }
        if passes == 0 {
            rows.push(("Passes".to_owned(), "none: it is not cut".to_owned()));
        } else {
            rows.push(("Passes".to_owned(), format!("{}, {}", count(passes), plural(retracts, "retract"))));
            rows.push(("Cutting length".to_owned(), length(way.cut_mm)));
            rows.push(("Time".to_owned(), duration(time_s)));
        }
        let crests =
            input.verification.and_then(|v| v.scallop.crests.by_region.iter().find(|c| c.region == r.id));
        if let Some(c) = crests {
            let [max, p99, mean] = [c.max_mm, c.p99_mm, c.mean_mm].map(deviation);
            rows.push(("Scallop max, 99 %, mean".to_owned(), format!("{max}, {p99}, {mean}")));
        }
        (r.id, json!({ "name": format!("Region {}", r.id), "rows": rows }))
    };
    input.regions.regions.iter().map(facts).collect()
}

/// Joints inside each region, and joints between it and others.
fn joints(regions: &RegionsFile) -> (Vec<u64>, Vec<u64>) {
    let size = regions.regions.iter().map(|r| r.id + 1).max().unwrap_or(0);
    let (mut inside, mut around) = (vec![0; size], vec![0; size]);
    let of_face: BTreeMap<usize, usize> =
        regions.regions.iter().flat_map(|r| r.faces.iter().map(|&f| (f, r.id))).collect();
    for joint in &regions.joints {
        match joint.faces.map(|f| of_face.get(&f).copied()) {
            [Some(a), Some(b)] if a == b => inside[a] += 1,
            ends => ends.into_iter().flatten().for_each(|r| around[r] += 1),
        }
    }
    (inside, around)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_from_outside_cannot_end_the_script() {
        let text = in_script(&json!({ "name": "</script><script>alert(1)" }));
        assert!(!text.contains('<'));
        assert_eq!(serde_json::from_str::<Value>(&text).unwrap()["name"], "</script><script>alert(1)");
    }

    #[test]
    fn the_library_can_stand_in_a_script_element() {
        for text in [LIBRARY, PROGRAM] {
            assert!(!text.contains("</script") && !text.contains("<!--"));
        }
        assert!(LICENCE.contains("three.js authors"));
    }
}
