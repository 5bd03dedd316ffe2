//! Which entities are faces.
//!
//! Faces are found by what refers to what, not by the subordinate flags, which writers set as they please: a
//! surface that a trimmed face or a shell stands on is not a face of its own; every other surface is.

use std::collections::{BTreeMap, BTreeSet};

use claymill_nurbs::Vector3;

use super::fault::Fault;
use super::file::File;
use super::placement::Placement;
use super::surfaces::{is_face_alone, is_surface};

/// Subfigures nest no deeper than this.
const DEEPEST: usize = 16;

/// An entity that is a face.
#[derive(Debug, Clone)]
pub(crate) struct Root {
    pub(crate) de: i64,
    /// The subfigure instances (408) it is reached through.
    instances: Vec<i64>,
    pub(crate) placement: Placement,
    pub(crate) reversed: bool,
    pub(crate) blanked: bool,
}

impl Root {
    pub(crate) fn label(&self) -> String {
        let instances = self.instances.iter().map(|de| format!(" in instance DE {de}"));
        format!("DE {}{}", self.de, instances.collect::<String>())
    }
}

/// All faces in file order; instances behind.
pub(crate) fn find(file: &File, mm_per_unit: f64) -> Vec<Root> {
    let under = carriers(file);
    let reversed = reversed_in_shells(file);
    let subfigures = subfigures(file);
    let inside: BTreeSet<i64> = subfigures.values().flatten().copied().collect();
    let scale = Placement::scale(mm_per_unit);
    let is_face = |de: i64, kind: i64, role: u8| match kind {
        143 | 144 | 510 => true,
        // Construction geometry is no face; definitions are, where nothing else uses them.
        _ => is_face_alone(kind) && !under.contains(&de) && role != 6,
    };
    let root = |de: i64, blanked: bool, placement: Placement, instances: &[i64]| Root {
        de,
        instances: instances.to_vec(),
        placement,
        reversed: reversed.contains(&de),
        blanked,
    };
    let mut roots: Vec<_> = file
        .entries()
        .filter(|(de, e)| is_face(*de, e.kind, e.role) && !inside.contains(de))
        .map(|(de, e)| root(de, e.blanked, scale, &[]))
        .collect();
    let mut pending: Vec<_> = file
        .entries()
        .filter(|(de, e)| e.kind == 408 && !inside.contains(de))
        .map(|(de, _)| (vec![de], scale))
        .rev()
        .collect();
    // Every instance adds the faces of its subfigure; cycles end at the depth limit.
    while let Some((path, placement)) = pending.pop() {
        let Some((instance, definition, placement)) =
            path.last().and_then(|de| placed_instance(file, *de, &placement).ok().map(|(d, p)| (*de, d, p)))
        else {
            continue;
        };
        let hidden = file.entry(instance).is_ok_and(|e| e.blanked);
        for member in subfigures.get(&definition).into_iter().flatten() {
            let Ok(entry) = file.entry(*member) else { continue };
            if entry.kind == 408 && path.len() < DEEPEST && roots.len() < 1_000_000 {
                let mut path = path.clone();
                path.push(*member);
                pending.push((path, placement));
            } else if is_face(*member, entry.kind, entry.role) {
                roots.push(root(*member, hidden || entry.blanked, placement, &path));
            }
        }
    }
    roots
}

/// Surfaces that something else stands on.
fn carriers(file: &File) -> BTreeSet<i64> {
    let carrier = |de: i64, kind: i64| -> Result<i64, Fault> {
        let mut record = file.record(de)?;
        match kind {
            140 => record.skip(4)?,
            141 => record.skip(2)?,
            142 | 143 => record.skip(1)?,
            _ => {}
        }
        record.integer()
    };
    file.entries()
        .filter(|(_, e)| matches!(e.kind, 140..=144 | 510))
        .filter_map(|(de, e)| carrier(de, e.kind).ok())
        .filter(|de| file.entry(*de).is_ok_and(|e| is_surface(e.kind)))
        .collect()
}

/// Faces (510) that their shell (514) uses with the other orientation.
fn reversed_in_shells(file: &File) -> BTreeSet<i64> {
    let flags = |de: i64| -> Result<Vec<(i64, i64)>, Fault> {
        let mut record = file.record(de)?;
        let count = record.count()?;
        record.required(count, |r| Ok((r.integer()?, r.integer()?)))
    };
    file.entries()
        .filter(|(_, e)| e.kind == 514)
        .flat_map(|(de, _)| flags(de).unwrap_or_default())
        .filter(|(_, along)| *along == 0)
        .map(|(face, _)| face)
        .collect()
}

/// Members of each subfigure definition (308), those of groups and shells in it included.
fn subfigures(file: &File) -> BTreeMap<i64, Vec<i64>> {
    let members = |de: i64| -> Result<Vec<i64>, Fault> {
        let mut record = file.record(de)?;
        record.skip(2)?;
        record.pointers()
    };
    file.entries()
        .filter(|(_, e)| e.kind == 308)
        .map(|(de, _)| {
            let mut all = Vec::new();
            let mut seen = BTreeSet::new();
            let mut pending = members(de).unwrap_or_default();
            pending.reverse();
            while let Some(member) = pending.pop() {
                if seen.insert(member) {
                    all.push(member);
                    pending.extend(parts(file, member).unwrap_or_default().into_iter().rev());
                }
            }
            (de, all)
        })
        .collect()
}

/// What a group, solid or shell consists of.
fn parts(file: &File, de: i64) -> Result<Vec<i64>, Fault> {
    let mut record = file.record(de)?;
    match file.entry(de)?.kind {
        402 => record.pointers(),
        186 => Ok(vec![record.integer()?]),
        514 => {
            let count = record.count()?;
            record.required(count, |r| {
                let face = r.integer()?;
                r.skip(1)?;
                Ok(face)
            })
        }
        _ => Ok(Vec::new()),
    }
}

/// 408: definition, shift and scale.
fn placed_instance(file: &File, de: i64, placement: &Placement) -> Result<(i64, Placement), Fault> {
    let placement = placement.of_entity(file, de)?;
    let mut record = file.record(de)?;
    let definition = record.integer()?;
    let [x, y, z] = record.reals()?;
    let scale = match record.real()? {
        0.0 => 1.0,
        scale => scale,
    };
    let own = Placement::scale_and_shift(scale, Vector3::new(x, y, z));
    Ok((definition, placement.after(&own)))
}
