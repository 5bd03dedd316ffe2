//! What lies close together.

use std::collections::BTreeMap;

use claymill_nurbs::Point3;

/// Things in groups: by cells of this size that touch each other.
pub(crate) fn together<T>(things: Vec<T>, cell_mm: f64, at: impl Fn(&T) -> Point3) -> Vec<Vec<T>> {
    let mut cells: BTreeMap<[i64; 3], Vec<T>> = BTreeMap::new();
    for thing in things {
        let p = at(&thing);
        let cell = [0, 1, 2].map(|k| (p[k] / cell_mm).floor() as i64);
        cells.entry(cell).or_default().push(thing);
    }
    let mut groups = Vec::new();
    while let Some((cell, mut group)) = cells.pop_first() {
        let mut open = vec![cell];
        while let Some([x, y, z]) = open.pop() {
            for near in (0..27).map(|k| [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]) {
                if let Some(more) = cells.remove(&near) {
                    group.extend(more);
                    open.push(near);
                }
            }
        }
        groups.push(group);
    }
    groups
}
