//! Labels in the graph of tools: time so far and what is cut, without those that others outdo.

use std::collections::BTreeMap;

use super::{ChainTool, ReachPatch};

/// Labels that a tool keeps at most. Up to twelve tools there are never more.
const MOST_LABELS: usize = 2048;

/// Patches that the same tools reach, as one: the sets in rising order, with their areas.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Atoms(Vec<(u64, f64)>);

impl Atoms {
    pub(super) fn new(patches: &[ReachPatch], tools: usize) -> Self {
        let all = u64::MAX >> (64 - tools.clamp(1, 64));
        let mut atoms = BTreeMap::new();
        for patch in patches.iter().filter(|p| p.area_mm2 > 0.0) {
            *atoms.entry(patch.reached_by & all).or_insert(0.0) += patch.area_mm2;
        }
        Atoms(atoms.into_iter().collect())
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Area of the atoms whose set of tools is `kept`, mm².
    pub(super) fn area(&self, kept: impl Fn(u64) -> bool) -> f64 {
        // The sum of nothing would be −0.
        self.0.iter().filter(|(by, _)| kept(*by)).fold(0.0, |sum, (_, area)| sum + area)
    }
}

/// The cheapest way to cut something.
struct Label {
    total_s: f64,
    /// Bits of the tools that were used.
    used: u64,
    /// Bits of the atoms that are cut.
    cut: Vec<u64>,
}

impl Label {
    /// Whether it took no longer and has cut at least as much as another label.
    fn outdoes(&self, other: &Label) -> bool {
        self.total_s <= other.total_s && self.cut.iter().zip(&other.cut).all(|(a, b)| a & b == *b)
    }
}

/// The cheapest chain.
pub(super) struct Cheapest {
    pub(super) tools: Vec<usize>,
    pub(super) total_s: f64,
    pub(super) is_proven: bool,
}

/// The cheapest chain that leaves at most `negligible_mm2` of what the tools reach; with `through` among those that use this
/// tool.
pub(super) fn cheapest(
    tools: &[ChainTool],
    atoms: &Atoms,
    negligible_mm2: f64,
    through: Option<usize>,
) -> Cheapest {
    let start = Label { total_s: 0.0, used: 0, cut: vec![0; atoms.len().div_ceil(64)] };
    let mut labels: Vec<Vec<Label>> = vec![vec![start]];
    let mut is_proven = true;
    for tool in 0..tools.len() {
        // Beyond a tool that must be used, only what went over it goes on.
        let from = through.filter(|must| tool > *must).map_or(0, |must| must + 1);
        let mut here: Vec<Label> = Vec::new();
        for label in labels[from..].iter().flatten() {
            if let Some(next) = step(label, tool, tools, atoms, through == Some(tool))
                && !here.iter().any(|other| other.outdoes(&next))
            {
                here.retain(|other| !next.outdoes(other));
                here.push(next);
            }
        }
        if here.len() > MOST_LABELS {
            here.sort_by(|a, b| a.total_s.total_cmp(&b.total_s));
            here.truncate(MOST_LABELS);
            is_proven = false;
        }
        labels.push(here);
    }
    let from = through.map_or(0, |must| must + 1);
    let left = |label: &Label| atoms.area(|by| by != 0 && by & label.used == 0);
    let ended = labels[from..].iter().flatten().filter(|label| left(label) <= negligible_mm2);
    // Of equal ones that with fewer tools, then that with larger ones.
    let key = |label: &Label| (label.used.count_ones(), label.used.reverse_bits());
    let best = ended.min_by(|a, b| {
        a.total_s
            .total_cmp(&b.total_s)
            .then_with(|| key(a).0.cmp(&key(b).0))
            .then_with(|| key(b).1.cmp(&key(a).1))
    });
    let best = best.map_or((0, 0.0), |label| (label.used, label.total_s));
    Cheapest {
        tools: (0..tools.len()).filter(|tool| best.0 >> tool & 1 == 1).collect(),
        total_s: best.1,
        is_proven,
    }
}

/// The label with one more tool; none where the tool has nothing to cut, unless it must be used.
fn step(label: &Label, tool: usize, tools: &[ChainTool], atoms: &Atoms, must: bool) -> Option<Label> {
    let mut cut = label.cut.clone();
    let mut area_mm2 = 0.0;
    for (index, (by, area)) in atoms.0.iter().enumerate() {
        let bit = 1 << (index % 64);
        if by >> tool & 1 == 1 && cut[index / 64] & bit == 0 {
            cut[index / 64] |= bit;
            area_mm2 += area;
        }
    }
    if area_mm2 == 0.0 && !must {
        return None;
    }
    let ChainTool { mm2_per_s, change_s, wear, .. } = &tools[tool];
    let total_s = label.total_s + area_mm2 / mm2_per_s * (1.0 + wear) + change_s;
    Some(Label { total_s, used: label.used | 1 << tool, cut })
}
