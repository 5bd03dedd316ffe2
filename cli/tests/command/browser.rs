//! The report as a real browser shows it.

use std::fs;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use claymill_exchange::read;
use claymill_nurbs::{ClosestPoints, Point3};
use claymill_tests::{Browser, Screenshot};
use serde_json::{Value, json};

use crate::whole_job::planned;

/// A report is there to be looked at this soon after it was opened, ms.
const LOADED_MS: f64 = 3000.0;
/// And its report is no larger.
const LARGEST_MB: f64 = 25.0;
/// A machine with other work may be late.
const TRIES: usize = 5;
/// Triangles and 16-bit positions of the view stay this near to the surfaces, mm.
const VIEW_MM: f64 = 0.5;
const DRAWN: &str = "document.getElementById('space')?.dataset.drawnMs";

/// One browser at a time: they are timed.
static ALONE: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The panel's, or another that `REPORT` names.
fn report() -> PathBuf {
    std::env::var_os("REPORT").map_or_else(|| planned().join("lace/report.html"), PathBuf::from)
}

/// The report of the panel, drawn.
fn opened() -> Option<Browser> {
    let browser = Browser::launch(&[])?;
    browser.resize(1280, 900);
    browser.open(&report());
    browser.wait_for(DRAWN);
    let _ = browser.evaluate("document.querySelector('.stage').scrollIntoView()");
    Some(browser)
}

fn press(browser: &Browser, selector: &str) {
    let _ = browser.evaluate(&format!("document.querySelector({selector:?}).click()"));
}

fn stage(browser: &Browser) -> Screenshot {
    // Without the frame's rounded corners.
    let [left, top, width, height] = browser.place("#space canvas");
    browser.screenshot([left + 10.0, top + 10.0, width - 20.0, height - 20.0])
}

/// What the page says of the region that was chosen, by name.
fn facts(browser: &Browser) -> Value {
    browser.evaluate(
        "Object.fromEntries([...document.querySelectorAll('#space-rows > div')]\
         .map(d => [d.children[0].textContent, d.children[1].textContent]))",
    )
}

#[test]
fn the_report_loads_soon_without_a_complaint_or_a_request() {
    let _alone = alone();
    let Some(browser) = opened() else { return };
    assert_eq!(browser.complaints(), Vec::<String>::new());
    assert_eq!(browser.requests(), Vec::<String>::new());
    let mut soonest = f64::INFINITY;
    for _ in 0..TRIES {
        let ms: f64 = browser.evaluate(DRAWN).as_str().unwrap().parse().unwrap();
        soonest = soonest.min(ms);
        if soonest < LOADED_MS {
            break;
        }
        browser.open(&report());
        browser.wait_for(DRAWN);
    }
    let megabytes = std::fs::metadata(report()).unwrap().len() as f64 * 1e-6;
    eprintln!("drawn after {soonest} ms, {megabytes:.1} MB");
    assert!(megabytes < LARGEST_MB, "{megabytes} MB");
    assert!(soonest < LOADED_MS, "{soonest} ms");
    // The page forbids its own requests: what slipped in would fail.
    let sent = browser.evaluate("fetch('https://example.invalid/').then(() => 'sent', () => 'refused')");
    assert_eq!(sent, json!("refused"));
    assert!(browser.complaints().iter().any(|c| c.contains("Content Security Policy")));
}

#[test]
fn layers_views_and_colours_change_what_is_drawn() {
    let _alone = alone();
    let Some(browser) = opened() else { return };
    let first = stage(&browser);
    let share = first.drawn_share();
    assert!((0.1..0.95).contains(&share), "{share} of the view is drawn");
    let mut before = first.clone();
    for (selector, least) in [
        ("#layer-cut", 0.05),
        ("[value=scallop]", 0.1),
        ("[value=clay]", 0.1),
        ("[data-view=top]", 0.1),
        ("#layer-region", 0.1),
    ] {
        press(&browser, selector);
        let after = stage(&browser);
        let changed = after.changed_share(&before);
        assert!(changed > least, "{selector} changes {changed} of the view");
        before = after;
    }
    // Only outlines are left. All the way back it is the first picture again.
    assert!(before.drawn_share() < 0.05, "{}", before.drawn_share());
    for selector in ["#layer-region", "#layer-cut", "[value=region]", "[data-view=iso]"] {
        press(&browser, selector);
    }
    let changed = stage(&browser).changed_share(&first);
    assert!(changed < 0.001, "{changed}");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn the_slider_puts_the_tool_where_the_moves_have_it() {
    let _alone = alone();
    let Some(browser) = opened() else { return };
    let before = stage(&browser);
    let set = |share: f64| {
        let script = format!(
            "(() => {{ const s = document.getElementById('space-time'); s.value = {}; \
             s.dispatchEvent(new Event('input', {{ bubbles: true }})); return document.getElementById('space').dataset.tip; }})()",
            1000.0 * share
        );
        let told = browser.evaluate(&script);
        let numbers = told.as_str().unwrap().split(' ').map(|v| v.parse::<f64>().unwrap());
        <[f64; 3]>::try_from(numbers.collect::<Vec<_>>()).unwrap()
    };
    let program = claymill_toolpath::read_moves(&planned().join("lace")).unwrap();
    let (first, last) = (&program.moves[0], program.moves.last().unwrap());
    for (share, place) in [(0.0, first.points[0]), (1.0, *last.points.last().unwrap())] {
        let tip = set(share);
        assert!((0..3).all(|i| (tip[i] - place[i]).abs() < 0.02), "{tip:?} for {place:?}");
    }
    // Halfway it is on some move.
    let tip = Point3::from(set(0.5));
    let near = program.moves.iter().filter_map(|m| m.curve().ok()).flat_map(|c| {
        let (a, b) = c.domain();
        (0..=400).map(move |k| c.point(a + (b - a) * f64::from(k) / 400.0)).collect::<Vec<_>>()
    });
    let off = near.map(|p| (p - tip).norm()).fold(f64::INFINITY, f64::min);
    assert!(off < 2.0, "{off} mm from every move");
    let changed = stage(&browser).changed_share(&before);
    assert!(changed > 0.001, "{changed} of the view changed");
    press(&browser, "#space-play");
    let clock = "document.getElementById('space-clock').textContent";
    let then = browser.evaluate(clock);
    browser.wait_for(&format!("{clock} !== {then}"));
    press(&browser, "#space-play");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn a_click_tells_the_region_and_a_place_on_the_model() {
    let _alone = alone();
    let Some(browser) = opened() else { return };
    press(&browser, "[data-view=top]");
    browser.settle();
    let model = read(&planned().join("panel.igs")).unwrap().model;
    let closest = ClosestPoints::new(&model);
    let job: Value = serde_json::from_slice(&fs::read(planned().join("lace/job.json")).unwrap()).unwrap();
    let [left, top, width, height] = browser.place("#space canvas");
    let bar_px = browser.evaluate("document.getElementById('space-scale').getBoundingClientRect().width");
    let bar_mm = browser.evaluate("parseFloat(document.getElementById('space-scale').textContent)");
    let mm_per_px = bar_mm.as_f64().unwrap() / bar_px.as_f64().unwrap();
    let mut places = Vec::new();
    for dx in [0.0, 120.0] {
        browser.click(left + 0.5 * width + dx, top + 0.5 * height);
        browser.wait_for("document.querySelector('#space-name').textContent === 'Region 0'");
        let facts = facts(&browser);
        let number = |name: char| -> f64 {
            let text = facts["Place"].as_str().unwrap_or_else(|| panic!("{facts}"));
            let after = text.split(&format!("{name} ")).nth(1).unwrap();
            after.split([',', ' ']).next().unwrap().parse().unwrap()
        };
        let place = Point3::new(number('x'), number('y'), number('z'));
        let found = closest.closest(&place, 100.0).expect("a face near");
        assert!(found.distance_mm < VIEW_MM, "{place} is {} mm off the model", found.distance_mm);
        // The face that the page names is the one that lies there, or meets it there.
        let entity = job["faces"][found.face]["entity"].as_str().unwrap();
        let named = facts["Face"].as_str().unwrap().to_owned();
        let named_face: usize = named.split(' ').next().unwrap().parse().unwrap();
        assert_eq!(named, format!("{named_face} ({})", job["faces"][named_face]["entity"].as_str().unwrap()));
        if named_face != found.face {
            eprintln!("{named} at a joint with {} ({entity})", found.face);
        }
        places.push(place);
    }
    // Farther right in the view from above, with the front on the left, is farther to the rear.
    let moved = (places[1] - places[0]).norm();
    let expected = 120.0 * mm_per_px;
    assert!((moved - expected).abs() < 0.05 * expected, "{moved} mm between clicks, {expected} expected");

    let facts = facts(&browser);
    assert!(facts["Passes"].as_str().unwrap().starts_with(|c: char| c.is_ascii_digit()), "{facts}");
    // Beside the model nothing is chosen.
    browser.click(left + 5.0, top + 0.5 * height);
    browser.wait_for("document.querySelectorAll('#space-rows > div').length === 0");
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn the_report_reads_on_a_phone_and_on_paper() {
    let _alone = alone();
    let Some(browser) = opened() else { return };
    browser.resize(390, 844);
    browser.settle();
    let width = browser.evaluate("document.documentElement.scrollWidth").as_f64().unwrap();
    assert!(width <= 390.0, "the page is {width} px wide on a phone of 390");
    let pictures = browser.evaluate("[...document.images].filter(i => !i.alt.trim()).length");
    assert_eq!(pictures, json!(0), "every picture says what it shows");
    let _ = browser.call("Emulation.setEmulatedMedia", json!({ "media": "print" }));
    browser.settle();
    let shown = |selector: &str| {
        browser
            .evaluate(&format!("getComputedStyle(document.querySelector({selector:?})).display !== 'none'"))
    };
    assert_eq!(
        (shown("#space canvas"), shown("nav"), shown(".sheet")),
        (json!(false), json!(false), json!(true))
    );
    if fs::read_to_string(report()).unwrap().contains("data:image/png") {
        let cover = "getComputedStyle(document.querySelector('#space img')).visibility";
        assert_eq!(browser.evaluate(cover), json!("visible"));
    }
    let setups = browser.evaluate("document.querySelectorAll('.sheet').length").as_u64().unwrap();
    let pdf = browser.call("Page.printToPDF", json!({ "printBackground": false }));
    let pages = browser_pages(pdf["data"].as_str().unwrap());
    assert!(pages as u64 > setups, "{pages} pages for {setups} sheets and the rest");
}

/// Pages of a PDF in base 64.
fn browser_pages(base64: &str) -> usize {
    let bytes = STANDARD.decode(base64).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    text.matches("/Type /Page\n").count()
        + text.matches("/Type /Page ").count()
        + text.matches("/Type /Page/").count()
}

#[test]
fn without_webgl_the_picture_stays() {
    let _alone = alone();
    let Some(browser) = Browser::launch(&["--disable-3d-apis"]) else { return };
    browser.resize(1280, 900);
    browser.open(&report());
    browser.wait_for("document.getElementById('space-status')?.textContent.includes('No 3-D view')");
    let shown = browser.evaluate("getComputedStyle(document.querySelector('#space canvas')).display");
    assert_eq!(shown, json!("none"));
    if fs::read_to_string(report()).unwrap().contains("data:image/png") {
        let picture = "getComputedStyle(document.querySelector('#space img')).visibility";
        assert_eq!(browser.evaluate(picture), json!("visible"));
    }
    assert_eq!(browser.complaints(), Vec::<String>::new());
}
