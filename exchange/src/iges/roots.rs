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
use super::topology::EdgeLists;
use super::unfolding::Unfolding;
use crate::unfolding::{Allowance, PLACEMENT, Tally, tallies};

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
    /// Why it cannot be built, where that is known already.
    pub(crate) fault: Option<Fault>,
}

/// Subfigures unfold to more than a file of its length may stand for.
#[derive(Debug)]
pub(crate) struct TooMuch {
    /// The definition that unfolds to most.
    pub(crate) de: i64,
    pub(crate) sum: Tally,
}

impl Root {
    pub(crate) fn label(&self) -> String {
        let instances = self.instances.iter().map(|de| format!(" in instance DE {de}"));
        format!("DE {}{}", self.de, instances.collect::<String>())
    }
}

/// All faces in file order; instances behind, and subfigures that cannot be placed.
///
/// # Errors
/// They are too many.
pub(crate) fn find(
    file: &File,
    lists: &EdgeLists,
    mm_per_unit: f64,
    allowance: Allowance,
) -> Result<Vec<Root>, TooMuch> {
    let under = carriers(file);
    let reversed = reversed_in_shells(file);
    let subfigures = subfigures(file);
    let inside: BTreeSet<i64> = subfigures.values().flatten().flatten().copied().collect();
    let scale = Placement::scale(mm_per_unit);
    let is_face = |de: i64, kind: i64, role: u8| match kind {
        143 | 144 | 510 => true,
        // Construction geometry is no face; definitions are, where nothing else uses them.
        _ => is_face_alone(kind) && !under.contains(&de) && role != 6,
    };
    // Of two types that differ, in directory and data, either may be the damaged one.
    let is_face = |de: i64, kind: i64, role: u8| {
        is_face(de, kind, role) || file.other_kind(de).is_some_and(|other| is_face(de, other, role))
    };
    let faces: Vec<_> =
        file.entries().filter(|(de, e)| is_face(*de, e.kind, e.role)).map(|(de, _)| de).collect();
    let sizes = measured(file, lists, &faces, allowance);
    check(file, &subfigures, &inside, &sizes, allowance)?;

    let root = |de: i64, blanked: bool, placement: Placement, instances: &[i64]| Root {
        de,
        instances: instances.to_vec(),
        placement,
        reversed: reversed.contains(&de),
        blanked,
        fault: sizes.get(&de).and_then(|size| size.as_ref().err().cloned()),
    };
    let mut roots: Vec<_> = file
        .entries()
        .filter(|(de, _)| sizes.contains_key(de) && !inside.contains(de))
        .map(|(de, e)| root(de, e.blanked, scale, &[]))
        .collect();
    let mut pending: Vec<_> = file
        .entries()
        .filter(|(de, e)| e.kind == 408 && !inside.contains(de))
        .map(|(de, _)| (vec![de], scale))
        .rev()
        .collect();
    // Every instance adds the faces of its subfigure; cycles end at the depth limit.
    while let Some((mut path, placement)) = pending.pop() {
        let Some(instance) = path.last().copied() else { continue };
        let placed = placed_instance(file, instance, &placement).and_then(|(definition, placement)| {
            let members = subfigures.get(&definition).ok_or(Fault::Missing { de: definition })?;
            Ok((members.as_ref().map_err(Clone::clone)?, placement))
        });
        let (members, placement) = match placed {
            Ok(placed) => placed,
            Err(fault) => {
                path.pop();
                roots.push(Root { fault: Some(fault), ..root(instance, false, scale, &path) });
                continue;
            }
        };
        let hidden = file.entry(instance).is_ok_and(|e| e.blanked);
        for member in members {
            let Ok(entry) = file.entry(*member) else { continue };
            if entry.kind == 408 && path.len() < DEEPEST {
                let mut path = path.clone();
                path.push(*member);
                pending.push((path, placement));
            } else if sizes.contains_key(member) {
                roots.push(root(*member, hidden || entry.blanked, placement, &path));
            }
        }
    }
    Ok(roots)
}

/// What every face unfolds to; a fault where that is too much for one face.
type Sizes = BTreeMap<i64, Result<u64, Fault>>;

fn measured(file: &File, lists: &EdgeLists, faces: &[i64], allowance: Allowance) -> Sizes {
    let mut unfolding = Unfolding::new(file, lists);
    faces.iter().map(|de| (*de, unfolding.face(*de, allowance))).collect()
}

/// Counts what faces and subfigures unfold to.
fn check(
    file: &File,
    subfigures: &Subfigures,
    inside: &BTreeSet<i64>,
    sizes: &Sizes,
    allowance: Allowance,
) -> Result<(), TooMuch> {
    let index: BTreeMap<i64, usize> = subfigures.keys().copied().zip(0..).collect();
    let face = |de: &i64| match sizes.get(de) {
        Some(Ok(size)) => Tally { size: *size, parts: 0, faces: 1 },
        Some(Err(_)) => Tally { size: 0, parts: 0, faces: 1 },
        None => Tally::default(),
    };
    let definition = |de: i64| -> Option<usize> {
        let is_instance = file.entry(de).is_ok_and(|e| e.kind == 408);
        let mut record = is_instance.then(|| file.unused_record(de).ok())??;
        index.get(&record.integer().ok()?).copied()
    };
    let placed = Tally { size: PLACEMENT, parts: 1, faces: 0 };
    let members = || subfigures.values().map(|members| members.as_deref().unwrap_or_default());
    let own: Vec<_> = members().map(|m| m.iter().map(face).fold(placed, Tally::plus)).collect();
    let held: Vec<Vec<usize>> =
        members().map(|m| m.iter().filter_map(|de| definition(*de)).collect()).collect();
    let sums = tallies(&own, &held, DEEPEST);
    let alone = sizes.keys().filter(|de| !inside.contains(de)).map(face);
    let instances = file.entries().map(|(de, _)| de).filter(|de| !inside.contains(de)).filter_map(definition);
    let sum = alone.chain(instances.map(|k| sums[k])).fold(Tally::default(), Tally::plus);
    if allowance.suits_whole(sum.size) {
        return Ok(());
    }
    let largest = index.iter().max_by_key(|(_, k)| sums[**k].size).map_or(1, |(de, _)| *de);
    Err(TooMuch { de: largest, sum })
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
        .filter(|de| {
            file.entry(*de).is_ok_and(|e| is_surface(e.kind)) || file.other_kind(*de).is_some_and(is_surface)
        })
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
type Subfigures = BTreeMap<i64, Result<Vec<i64>, Fault>>;

fn subfigures(file: &File) -> Subfigures {
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
            let mut pending = match members(de) {
                Ok(members) => members,
                Err(fault) => return (de, Err(fault)),
            };
            pending.reverse();
            while let Some(member) = pending.pop() {
                if seen.insert(member) {
                    all.push(member);
                    pending.extend(parts(file, member).unwrap_or_default().into_iter().rev());
                }
            }
            (de, Ok(all))
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
