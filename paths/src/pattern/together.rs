//! What lies close together.

use std::collections::BTreeMap;

use claymill_nurbs::Point3;

/// A cube of space among others of its size.
pub(crate) type Cell = [i64; 3];

/// The cell of a place.
pub(crate) fn cell_of(p: &Point3, cell_mm: f64) -> Cell {
    [0, 1, 2].map(|k| (p[k] / cell_mm).floor() as i64)
}

/// A cell and those that touch it.
pub(crate) fn around([x, y, z]: Cell) -> impl Iterator<Item = Cell> {
    (0..27).map(move |k| [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1])
}

/// Things in groups: by cells of this size that touch each other.
pub(crate) fn together<T>(things: Vec<T>, cell_mm: f64, at: impl Fn(&T) -> Point3) -> Vec<Vec<T>> {
    let mut cells: BTreeMap<Cell, Vec<T>> = BTreeMap::new();
    for thing in things {
        cells.entry(cell_of(&at(&thing), cell_mm)).or_default().push(thing);
    }
    let mut groups = Vec::new();
    while let Some((cell, mut group)) = cells.pop_first() {
        let mut open = vec![cell];
        while let Some(cell) = open.pop() {
            for near in around(cell) {
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
