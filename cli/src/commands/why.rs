//! `claymill merge --why`: the longest joints that were not merged, each with its reason.

use claymill_toolpath::{JointRecord, RegionsFile};

use crate::console::outln;

/// Lists the longest joints that were not merged, those first that keep regions apart.
pub(super) fn print(record: &RegionsFile, count: usize) {
    let mut split: Vec<&JointRecord> =
        record.joints.iter().filter(|j| j.regions_if_merged.is_some()).collect();
    split.sort_by(|a, b| b.length_mm.total_cmp(&a.length_mm).then(a.faces.cmp(&b.faces)));
    let length_m: f64 = split.iter().map(|j| 1e-3 * j.length_mm).sum();
    outln!("{} joints keep regions apart, {length_m:.3} m; the longest:", split.len());
    outln!("{:>10}  {:<15} {:>7}  why", "length mm", "faces", "regions");
    for joint in split.iter().take(count) {
        let [a, b] = joint.faces;
        let regions = joint.regions_if_merged.unwrap_or(record.regions.len());
        outln!("{:>10.1}  {:<15} {regions:>7}  {}", joint.length_mm, format!("{a}, {b}"), joint.why);
    }
    outln!("regions: how many there would be if that joint were merged (now {})", record.regions.len());
}
