//! The report's section on joints by verdict and on face boundaries.

use std::collections::BTreeMap;

use claymill_toolpath::{JointRecord, RegionsFile};
use maud::{Markup, html};

use super::figures::{count, length, plural, share};

/// Joints with one verdict.
#[derive(Default)]
struct Group<'a> {
    joints: u64,
    length_mm: f64,
    by_class: BTreeMap<&'a str, u64>,
    longest: Option<&'a JointRecord>,
}

impl<'a> Group<'a> {
    fn add(&mut self, joint: &'a JointRecord) {
        self.joints += 1;
        self.length_mm += joint.length_mm;
        *self.by_class.entry(&joint.class).or_default() += 1;
        if self.longest.is_none_or(|l| joint.length_mm > l.length_mm) {
            self.longest = Some(joint);
        }
    }
}

/// `split_angle` as people write it.
fn in_words(verdict: &str) -> String {
    let mut words = verdict.replace('_', " ");
    if let Some(first) = words.get_mut(0..1) {
        first.make_ascii_uppercase();
    }
    words
}

/// How the faces were joined into regions, and why not into fewer.
pub(super) fn section(regions: &RegionsFile) -> Markup {
    let mut groups: BTreeMap<&str, Group<'_>> = BTreeMap::new();
    let mut classes: BTreeMap<&str, u64> = BTreeMap::new();
    for joint in &regions.joints {
        groups.entry(&joint.verdict).or_default().add(joint);
        *classes.entry(&joint.class).or_default() += 1;
    }
    let mut groups: Vec<_> = groups.into_iter().collect();
    groups.sort_by(|a, b| b.1.length_mm.total_cmp(&a.1.length_mm).then(a.0.cmp(b.0)));
    let total_mm: f64 = groups.iter().map(|(_, g)| g.length_mm).sum();
    let boundary = |mm: f64| format!("{} ({})", length(mm), share(mm, regions.boundary_total_mm));
    html! {
        h2 { "How faces were joined" }
        p {
            (plural(regions.joints.len() as u64, "joint")) " between faces, within "
            (regions.tolerance_mm) " mm, preset " (regions.preset) "."
        }
        div.wide { table {
            caption { "Joints by verdict" }
            thead { tr {
                th scope="col" { "Verdict" } th.n scope="col" { "Joints" } th.n scope="col" { "Length" }
                th.n scope="col" { "Share" }
                @for class in classes.keys() { th.n scope="col" { (class) } }
                th scope="col" { "The longest one, and why" }
            } }
            tbody { @for (verdict, group) in &groups { tr {
                th scope="row" { (in_words(verdict)) }
                td.n { (count(group.joints)) }
                td.n { (length(group.length_mm)) }
                td.n { (share(group.length_mm, total_mm)) }
                @for class in classes.keys() {
                    td.n { (count(group.by_class.get(class).copied().unwrap_or(0))) }
                }
                td { @if let Some(joint) = group.longest {
                    "faces " (joint.faces[0]) " and " (joint.faces[1]) ": " (joint.why)
                } }
            } } }
        } }
        table {
            caption { "Face boundaries, " (length(regions.boundary_total_mm)) " in all" }
            tbody {
                tr { th scope="row" { "with one neighbour" } td.n { (boundary(regions.boundary_matched_mm)) } }
                @if regions.boundary_lapped_mm > 0.0 {
                    tr { th scope="row" { "on the inside of another face" }
                        td.n { (boundary(regions.boundary_lapped_mm)) } }
                }
                tr { th scope="row" { "free" } td.n { (boundary(regions.boundary_naked_mm)) } }
                tr { th scope="row" { "with several neighbours" } td.n { (boundary(regions.boundary_non_manifold_mm)) } }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_read_as_words() {
        assert_eq!(in_words("crossed_curvature_jump"), "Crossed curvature jump");
        assert_eq!(in_words(""), "");
    }
}
