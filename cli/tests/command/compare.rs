//! Strategies side by side.

use std::fs;

use claymill_tests::{Browser, check_form};
use claymill_toolpath::{read_job, read_moves};
use serde_json::Value;

use crate::run::{panel, run};
use crate::scratch;

#[test]
fn strategies_are_compared_on_the_same_terms() {
    let folder = scratch();
    panel(folder.path());
    let line = [
        "compare",
        "panel.igs",
        "--strategies",
        "planar,isoparametric",
        "--scallop",
        "0.2,0.1",
        "-o",
        "side",
    ];
    let made = run(folder.path(), line.iter().chain(&["--json"]));
    assert_eq!(made.code, Some(0), "{made:?}");
    let side = folder.path().join("side");
    let told = made.json();
    let written: Value =
        serde_json::from_str(&fs::read_to_string(side.join("compare.json")).unwrap()).unwrap();
    assert_eq!(told, written);
    let entries = told["entries"].as_array().unwrap();
    let names: Vec<&str> = entries.iter().map(|e| e["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["planar-0.2", "isoparametric-0.2", "planar-0.1", "isoparametric-0.1"]);
    let number = |e: &Value, key: &str| e[key].as_f64().unwrap();
    for (entry, name) in entries.iter().zip(&names) {
        let job = read_job(&side.join(name)).unwrap();
        check_form(&job, &read_moves(&side.join(name)).unwrap()).unwrap();
        assert_eq!(entry["strategy"], *job.request.strategy);
        assert!(entry["passed"].as_bool().unwrap(), "{entry}");
        assert!(number(entry, "gouge_mm") < 0.002, "{entry}");
        assert!(number(entry, "scallop_p99_mm") <= 1.05 * number(entry, "scallop_mm"), "{entry}");
        assert!((0.5..1.05).contains(&number(entry, "efficiency")), "{entry}");
        let histogram = entry["histogram"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap());
        assert!((histogram.sum::<f64>() - 1.0).abs() < 1e-9);
        let of_regions: f64 =
            entry["regions"].as_array().unwrap().iter().map(|r| number(&r["length"], "cut_mm")).sum();
        assert!((of_regions - number(&entry["length"], "cut_mm")).abs() < 1e-6 * of_regions);
    }
    // Half the scallop height takes 1.4 times the way.
    for (high, low) in [(0, 2), (1, 3)] {
        let ratio = number(&entries[low]["length"], "cut_mm") / number(&entries[high]["length"], "cut_mm");
        assert!((1.3..1.5).contains(&ratio), "{ratio}");
    }
    let csv = fs::read_to_string(side.join("compare.csv")).unwrap();
    let columns: Vec<usize> = csv.lines().map(|l| l.split(',').count()).collect();
    assert!(columns.iter().all(|&c| c == columns[0]), "{columns:?}");
    let page = fs::read_to_string(side.join("compare.html")).unwrap();
    for name in &names {
        assert!(page.contains(&format!("<a href=\"{name}/report.html\">")), "no way to {name}");
    }
    let (all, names_of_forms) =
        (page.matches("http:").count(), page.matches("http://www.w3.org/2000/svg").count());
    assert!(all == names_of_forms && !page.contains("https:"), "the page needs the network");
    if let Some(browser) = Browser::launch(&[]) {
        browser.resize(1280, 900);
        browser.open(&side.join("compare.html"));
        browser.wait_for("document.readyState === 'complete' && document.querySelector('pre')");
        let ticks = "[...document.querySelectorAll('tbody tr')].map(r => [r.cells[0].textContent, \
                     [...r.cells].slice(1).findIndex(c => c.textContent.startsWith('✓'))])";
        let ticks = browser.evaluate(ticks);
        let best = |row: &str| {
            let found = ticks.as_array().unwrap().iter().find(|t| t[0] == row);
            names[found.unwrap()[1].as_u64().unwrap() as usize]
        };
        let least = |key: &str| {
            let value = |e: &Value| e.pointer(key).unwrap().as_f64().unwrap();
            let of = entries.iter().min_by(|a, b| value(a).total_cmp(&value(b)));
            of.unwrap()["name"].as_str().unwrap()
        };
        assert_eq!(best("Machining time"), least("/time_s"));
        assert_eq!(best("Cutting length"), least("/length/cut_mm"));
        assert_eq!((browser.complaints(), browser.requests()), (Vec::new(), Vec::new()));
    }
    assert!(fs::read_to_string(side.join("compare.svg")).unwrap().ends_with("</svg>\n"));
}
