//! The table that `claymill compare` prints: one row a figure, one column a combination of tool,
//! scallop height and strategy, and below it the time saved against `isoparametric`.

use super::compare::Entry;
use crate::args::StrategyName;
use crate::console::COLUMNS;

/// Columns between two combinations.
const GAP: usize = 2;

/// A figure by its name.
type Row = (&'static str, fn(&Entry) -> String);

const ROWS: [Row; 17] = [
    ("cutting length km", |e| format!("{:.3}", e.all.length.cut_mm * 1e-6)),
    ("efficiency", |e| format!("{:.3}", e.all.efficiency)),
    ("by flat step-over", |e| format!("{:.3}", e.all.flat_efficiency)),
    ("passes", |e| e.all.passes.to_string()),
    ("retracts", |e| e.all.retracts.to_string()),
    ("way not cutting", |e| format!("{:.1} %", 100.0 * e.all.non_cutting_share)),
    ("time h", |e| format!("{:.2}", e.all.time_s / 3600.0)),
    ("control points", |e| e.all.control_points.to_string()),
    ("straight / points", |e| format!("{:.1} ×", e.straight_per_point)),
    ("scallop max µm", |e| format!("{:.0}", 1e3 * e.all.scallop_max_mm)),
    ("scallop 99 % µm", |e| format!("{:.0}", 1e3 * e.all.scallop_p99_mm)),
    ("scallop mean µm", |e| format!("{:.0}", 1e3 * e.all.scallop_mean_mm)),
    ("even", |e| format!("{:.0} %", 100.0 * e.even_share)),
    ("inside of regions", |e| format!("{:.1} %", 100.0 * e.even_inside_share)),
    ("left in reach", |e| format!("{:.3} %", 100.0 * e.never_cut_share)),
    ("gouge µm", |e| format!("{:.2}", 1e3 * e.gouge_mm)),
    ("verification", |e| if e.passed { "passed" } else { "NOT PASSED" }.to_owned()),
];

/// The figures down, the combinations side by side, as many as fit on a screen; the others below. Then what the strategies
/// save against single patches.
pub(super) fn table(entries: &[Entry]) -> String {
    let first = ROWS.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let cells: Vec<Vec<String>> =
        entries.iter().map(|e| ROWS.iter().map(|(_, figure)| figure(e)).collect()).collect();
    let widest = |k: usize| {
        let figures = cells[k].iter().map(|c| c.chars().count()).max().unwrap_or(0);
        GAP + figures.max(entries[k].name.chars().count())
    };
    let mut out = String::new();
    let mut from = 0;
    while from < entries.len() {
        let mut used = first;
        let mut to = from;
        while to < entries.len() && (to == from || used + widest(to) <= COLUMNS) {
            used += widest(to);
            to += 1;
        }
        out += &format!("{:first$}", "");
        (from..to).for_each(|k| out += &format!("{:>1$}", entries[k].name, widest(k)));
        out.push('\n');
        for (row, (name, _)) in ROWS.iter().enumerate() {
            out += &format!("{name:first$}");
            (from..to).for_each(|k| out += &format!("{:>1$}", cells[k][row], widest(k)));
            out.push('\n');
        }
        out.push('\n');
        from = to;
    }
    out += &savings(entries);
    out.trim_end().to_owned()
}

fn savings(entries: &[Entry]) -> String {
    let mut out = String::new();
    for patch in entries.iter().filter(|e| e.strategy == claymill::name(&StrategyName::Isoparametric)) {
        let same = |e: &&Entry| {
            e.tool == patch.tool && e.scallop_mm == patch.scallop_mm && e.strategy != patch.strategy
        };
        for e in entries.iter().filter(same) {
            let saved_h = (patch.all.time_s - e.all.time_s) / 3600.0;
            let what = if saved_h >= 0.0 { "saves" } else { "costs" };
            out += &format!(
                "{} {what} {:.1} h of {:.1} h against patch by patch\n",
                e.name,
                saved_h.abs(),
                patch.all.time_s / 3600.0
            );
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::compare::Figures;
    use super::*;
    use claymill_toolpath::Tool;

    fn entry(name: &str, strategy: &str, hours: f64) -> Entry {
        Entry {
            name: name.to_owned(),
            strategy: strategy.to_owned(),
            tool: Tool::ball(10.0),
            scallop_mm: 0.1,
            passed: strategy != "flow",
            all: Figures { time_s: 3600.0 * hours, control_points: 1_234_567, ..Figures::default() },
            never_cut_share: 0.0,
            gouge_mm: 0.0,
            even_share: 0.64,
            even_inside_share: 0.71,
            straight_moves: 9_876_543,
            straight_per_point: 8.1,
            histogram: Vec::new(),
            regions: Vec::new(),
        }
    }

    #[test]
    fn however_many_are_compared_no_line_is_wider_than_a_screen_and_no_figure_is_lost() {
        let strategies = ["planar", "flow", "scallop", "auto", "isoparametric"];
        for count in 1..=10 {
            let name =
                |k: usize| format!("{}-ball-10-{}", strategies[k % 5], if k < 5 { "0.1" } else { "0.05" });
            let entries: Vec<Entry> =
                (0..count).map(|k| entry(&name(k), strategies[k % 5], 10.0 + k as f64)).collect();
            let text = table(&entries);
            let widest = text.lines().map(|l| l.chars().count()).max().unwrap();
            assert!(widest <= COLUMNS, "{widest}:\n{text}");
            for (k, e) in entries.iter().enumerate() {
                assert!(text.contains(&e.name) && text.contains(&format!("{}.00", 10 + k)), "{text}");
            }
            assert_eq!(text.matches("NOT PASSED").count(), entries.iter().filter(|e| !e.passed).count());
        }
        let text = table(&[entry("planar", "planar", 10.0), entry("isoparametric", "isoparametric", 13.0)]);
        assert!(text.ends_with("planar saves 3.0 h of 13.0 h against patch by patch"), "{text}");
    }
}
