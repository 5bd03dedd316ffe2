//! Which triangles are neighbours, and the loops around the mesh.

use std::collections::{BTreeMap, VecDeque};

/// A side without a neighbour.
pub(super) const NONE: u32 = u32::MAX;

/// A closed run along the border of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundaryLoop {
    /// The vertices in order, the first not repeated; the mesh lies on the left as seen from its outside.
    pub vertices: Vec<u32>,
    /// Length, mm.
    pub length_mm: f64,
}

/// For each side `3·triangle + k`, from corner `k` to the next, the side of the neighbour; [`NONE`] on the
/// border and where more than two triangles meet.
pub(super) fn twins(triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut sides: Vec<([u32; 2], u32)> = (0..3 * triangles.len())
        .map(|s| {
            let (a, b) = (triangles[s / 3][s % 3], triangles[s / 3][(s + 1) % 3]);
            ([a.min(b), a.max(b)], s as u32)
        })
        .collect();
    sides.sort_unstable();
    let mut twins = vec![NONE; sides.len()];
    for run in sides.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, s), (_, t)] = *run {
            twins[s as usize] = t;
            twins[t as usize] = s;
        }
    }
    twins
}

/// Which triangles to turn over so that neighbours agree. Each part takes its side from the first of `seeds`
/// in it, a triangle and whether it is turned, or else from its first triangle.
pub(super) fn turned(triangles: &[[u32; 3]], twins: &[u32], seeds: &[(usize, bool)]) -> Vec<bool> {
    let mut turned: Vec<Option<bool>> = vec![None; triangles.len()];
    let start = |s: usize| triangles[s / 3][s % 3];
    let mut queue = VecDeque::new();
    for (seed, turn) in seeds.iter().copied().chain((0..triangles.len()).map(|t| (t, false))) {
        if turned[seed].is_none() {
            turned[seed] = Some(turn);
            queue.push_back((seed, turn));
        }
        while let Some((triangle, turn)) = queue.pop_front() {
            for s in 3 * triangle..3 * triangle + 3 {
                if twins[s] == NONE {
                    continue;
                }
                let next = twins[s] as usize;
                if turned[next / 3].is_none() {
                    // Neighbours that agree run along their common side against each other.
                    let turn = turn != (start(s) == start(next));
                    turned[next / 3] = Some(turn);
                    queue.push_back((next / 3, turn));
                }
            }
        }
    }
    turned.into_iter().map(Option::unwrap_or_default).collect()
}

/// The loops of sides without a neighbour, longest first.
pub(super) fn loops(
    triangles: &[[u32; 3]],
    twins: &[u32],
    length: impl Fn(u32, u32) -> f64,
) -> Vec<BoundaryLoop> {
    let mut leaving: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for s in (0..twins.len()).filter(|&s| twins[s] == NONE) {
        leaving.entry(triangles[s / 3][s % 3]).or_default().push(s as u32);
    }
    let end = |s: u32| triangles[s as usize / 3][(s as usize + 1) % 3];
    let mut found = Vec::new();
    while let Some((&start, _)) = leaving.first_key_value() {
        let mut vertices = vec![start];
        let mut at = start;
        while let Some(sides) = leaving.get_mut(&at) {
            let Some(side) = sides.pop() else { break };
            if sides.is_empty() {
                leaving.remove(&at);
            }
            at = end(side);
            // Where a loop touches itself or another one, what has come round is cut off.
            if let Some(k) = vertices.iter().rposition(|&v| v == at) {
                let ring = vertices.split_off(k);
                let next = ring.iter().cycle().skip(1);
                let length_mm = ring.iter().zip(next).map(|(&a, &b)| length(a, b)).sum();
                found.push(BoundaryLoop { vertices: ring, length_mm });
                if vertices.is_empty() {
                    break;
                }
            }
            vertices.push(at);
        }
    }
    found.sort_by(|a, b| b.length_mm.total_cmp(&a.length_mm).then(a.vertices.cmp(&b.vertices)));
    found
}
