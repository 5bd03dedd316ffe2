//! What the faces of a file unfold to.

use super::fault::Fault;
use super::file::{File, Record};
use super::topology::EdgeLists;
use crate::unfolding::{Allowance, Sizes};

/// Measures entities with all that the reader follows from them.
#[derive(Debug)]
pub(crate) struct Unfolding<'a> {
    file: &'a File,
    lists: &'a EdgeLists,
    sizes: Sizes,
}

impl<'a> Unfolding<'a> {
    pub(crate) fn new(file: &'a File, lists: &'a EdgeLists) -> Self {
        Unfolding { file, lists, sizes: Sizes::new(file.size()) }
    }

    /// The unfolded size of the face `DE de`, bytes of parameter data; an error where it is too large for one face.
    pub(crate) fn face(&mut self, de: i64, allowance: Allowance) -> Result<u64, Fault> {
        let (file, lists) = (self.file, self.lists);
        let look = |at: usize| {
            let de = 2 * at as i64 + 1;
            let parts = references(file, lists, de).unwrap_or_default();
            (file.data_length(de), parts.into_iter().filter_map(super::file::index).collect())
        };
        let bytes = super::file::index(de).map_or(0, |at| self.sizes.of(at, look));
        if allowance.suits_face(bytes) { Ok(bytes) } else { Err(Fault::TooMuch { de, bytes }) }
    }
}

/// What the reader follows from an entity, in as far as that is more than a few numbers. It does not go from a curve
/// on a surface to the surface below.
fn references(file: &File, lists: &EdgeLists, de: i64) -> Result<Vec<i64>, Fault> {
    let mut record = file.unused_record(de)?;
    let r = &mut record;
    Ok(match file.entry(de)?.kind {
        102 => r.pointers()?,
        118 | 120 => vec![r.integer()?, r.integer()?],
        122 | 130 => vec![r.integer()?],
        140 => {
            r.skip(4)?;
            vec![r.integer()?]
        }
        141 => {
            r.skip(3)?;
            let count = r.count()?;
            let edges = r.required(count, |r| {
                let mut curves = vec![r.integer()?];
                r.skip(1)?;
                curves.extend(r.pointers()?);
                Ok(curves)
            })?;
            edges.concat()
        }
        142 => {
            r.skip(2)?;
            vec![r.integer()?, r.integer()?]
        }
        143 => {
            r.skip(1)?;
            let surface = r.integer()?;
            once_each(surface, r.pointers()?)
        }
        144 => {
            let (surface, _) = (r.integer()?, r.skip(1)?);
            let (holes, outer) = (r.count()?, r.integer()?);
            let mut loops = r.required(holes, Record::integer)?;
            loops.push(outer);
            once_each(surface, loops)
        }
        508 => {
            let count = r.count()?;
            let edges = r.required(count, |r| {
                r.skip(1)?;
                let (list, index, _) = (r.integer()?, r.count()?, r.skip(1)?);
                let flats = r.count()?;
                let mut curves = r.required(flats, |r| {
                    r.skip(1)?;
                    r.integer()
                })?;
                curves.extend(lists.curve(list, index));
                Ok(curves)
            })?;
            edges.concat()
        }
        510 => {
            let (surface, count) = (r.integer()?, r.count()?);
            r.skip(1)?;
            once_each(surface, r.required(count, Record::integer)?)
        }
        _ => Vec::new(),
    })
}

/// A face's surface and loops: a loop that it lists again is no other loop.
fn once_each(surface: i64, mut loops: Vec<i64>) -> Vec<i64> {
    loops.sort_unstable();
    loops.dedup();
    loops.push(surface);
    loops
}
