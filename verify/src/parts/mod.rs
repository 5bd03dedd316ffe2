//! Findings along moves that are kept: a few dozen moves are one part, and what is found along them follows from what lies near
//! them.
//!
//! ```text
//!    ╭──────── near ────────╮       A part follows from its own moves, the faces and the moves near them, and for shanks
//!    │  ═══════════ moves   │       from all faces along the axis. Numbers of faces and moves are no part of it: they
//!    │  ▔▔▔▔▔▔▔▔▔▔▔ faces   │       count from the part's own first ones.
//!    ╰──────────────────────╯
//! ```

mod around;
mod numbers;

use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::{Cancelled, Kept, Packed, PartKey};
use rayon::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

pub(crate) use numbers::{Numbers, through};

use crate::drop::DropMesh;
use crate::mesh::Mesh;
use crate::parts::around::{Around, Surroundings};
use crate::scene::{Scene, Stage};
use crate::track::Track;

/// Parts are so many moves long on the mean, and no longer than this many.
const MEAN_MOVES: u8 = 16;
const MOST_MOVES: usize = 64;

/// What is found along a move, and the form in which it is kept.
pub(crate) trait Portable: Sized + Send {
    type Form: Serialize + DeserializeOwned + Send;

    /// Its form, with the part's own numbers; `None` where something in it is none of the part's.
    fn form(&self, numbers: &Numbers<'_>) -> Option<Self::Form>;

    /// What has this form.
    fn of_form(form: Self::Form, numbers: &Numbers<'_>) -> Option<Self>;

    /// From where faces farther away along the tool axes were asked.
    fn asks_far(&self) -> &[Outlook] {
        &[]
    }
}

/// A place of the surface and the side of it, of which it is asked whether a tool gets there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Outlook {
    pub(crate) at: Point3,
    pub(crate) normal: Vector3,
}

impl Outlook {
    fn row(&self) -> [f64; 6] {
        let Outlook { at, normal } = self;
        [at.x, at.y, at.z, normal.x, normal.y, normal.z]
    }

    fn of_row([x, y, z, nx, ny, nz]: [f64; 6]) -> Self {
        Outlook { at: Point3::new(x, y, z), normal: Vector3::new(nx, ny, nz) }
    }
}

/// Tool axes with the model as it is seen along them, the job's setups first, and as far as a tool has to go to be out of it, mm.
pub(crate) type Outward<'a> = (Vec<(Vector3, &'a DropMesh<'a>)>, Option<f64>);

/// What findings follow from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sees {
    /// Faces near the moves.
    Faces,
    /// Faces and other moves near the moves.
    Moves,
    /// Faces along the setup's axis.
    Along,
}

/// What a store says under the key of what is near.
#[derive(Serialize, Deserialize)]
enum Entry<T> {
    Found(Vec<T>),
    /// More is asked, from these places: the findings are under the key of that.
    AsksFar(Packed),
}

/// Findings along moves, where they are kept.
pub(crate) struct Parts<'a>(Option<Keeping<'a>>);

struct Keeping<'a> {
    kept: &'a Kept,
    surroundings: Surroundings<'a>,
}

impl<'a> Parts<'a> {
    /// Nothing is kept.
    pub(crate) fn nowhere() -> Self {
        Parts(None)
    }

    /// Of a scene in which nothing but faces and moves has a say, as it is seen outwards; without that nothing is kept.
    pub(crate) fn new(
        kept: &'a Kept,
        scene: &'a Scene<'_>,
        outward: Option<Outward<'a>>,
        mesh: &'a Mesh,
    ) -> Self {
        let outward = outward.filter(|_| kept.is_somewhere());
        let surroundings = outward.and_then(|outward| Surroundings::new(scene, outward, mesh));
        Parts(surroundings.map(|surroundings| Keeping { kept, surroundings }))
    }

    /// What is found along each of these moves: from the store, or as it is looked for.
    pub(crate) fn along<T: Portable>(
        &self,
        (name, sees): (&str, Sees),
        tracks: &[&'a Track],
        stage: &Stage<'_>,
        look: impl Fn(&Track) -> T + Sync,
    ) -> Result<Vec<T>, Cancelled> {
        let look = |track: &&Track| stage.part(tracks.len(), || look(track));
        let Some(keeping) = &self.0 else { return tracks.par_iter().map(look).collect() };
        let runs = tracks.chunk_by(|a, b| (a.setup, a.region) == (b.setup, b.region));
        let is_last = |track: &&Track| ends_part(keeping.surroundings.key_of(track));
        let parts: Vec<&[&Track]> = runs.flat_map(|run| cut_up(run, is_last)).collect();
        let part = |part: &&[&'a Track]| {
            let around = keeping.surroundings.around(name, sees, part);
            if let Some(found) = keeping.known(&around) {
                stage.pass(part.len(), tracks.len())?;
                return Ok(found);
            }
            let found: Vec<T> = part.par_iter().map(look).collect::<Result<_, _>>()?;
            keeping.keep(&around, &found);
            Ok(found)
        };
        let found: Vec<Vec<T>> = parts.par_iter().map(part).collect::<Result<_, Cancelled>>()?;
        Ok(found.into_iter().flatten().collect())
    }
}

/// Whether a part ends with a move of this key. What a move is says so, and not the count of moves before it: where one comes in
/// between, all parts but its own are those of before.
fn ends_part(of_move: &PartKey) -> bool {
    of_move.as_bytes()[0].is_multiple_of(MEAN_MOVES)
}

fn cut_up<T>(run: &[T], is_last: impl FnMut(&T) -> bool) -> impl Iterator<Item = &[T]> {
    run.split_inclusive(is_last).flat_map(|part| part.chunks(MOST_MOVES))
}

impl Keeping<'_> {
    fn known<T: Portable>(&self, around: &Around<'_, '_>) -> Option<Vec<T>> {
        let forms = match self.kept.known(&around.key())? {
            Entry::Found(forms) => forms,
            Entry::AsksFar(from) => {
                let from: Vec<Outlook> = from.rows_of_doubles().map(Outlook::of_row).collect();
                self.kept.known::<Vec<T::Form>>(&self.surroundings.far(around, &from))?
            }
        };
        let numbers = around.numbers();
        let found: Option<Vec<T>> = forms.into_iter().map(|form| T::of_form(form, &numbers)).collect();
        found.filter(|found| found.len() == around.moves())
    }

    fn keep<T: Portable>(&self, around: &Around<'_, '_>, found: &[T]) {
        let numbers = around.numbers();
        let Some(forms) = found.iter().map(|one| one.form(&numbers)).collect::<Option<Vec<T::Form>>>() else {
            return;
        };
        let from: Vec<Outlook> = found.iter().flat_map(T::asks_far).copied().collect();
        if from.is_empty() {
            self.kept.keep(&around.key(), &Entry::Found(forms));
        } else {
            self.kept.keep(&self.surroundings.far(around, &from), &forms);
            let from = Packed::doubles(from.iter().flat_map(Outlook::row));
            self.kept.keep(&around.key(), &Entry::<T::Form>::AsksFar(from));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use claymill_toolpath::KeyMaker;

    use super::*;

    #[test]
    fn a_move_more_changes_its_own_part_alone() {
        let key = |k: usize| KeyMaker::new("move").count(k).finish();
        let moves: Vec<PartKey> = (0..2000).map(key).collect();
        let parts = |moves: &[PartKey]| -> BTreeSet<Vec<PartKey>> {
            cut_up(moves, ends_part).map(<[PartKey]>::to_vec).collect()
        };
        let before = parts(&moves);
        assert!((80..200).contains(&before.len()), "{} parts", before.len());
        assert!(before.iter().all(|part| part.len() <= MOST_MOVES));
        for at in [0, 3, 700, 1999] {
            let mut more = moves.clone();
            more.insert(at, key(5000 + at));
            assert!(parts(&more).difference(&before).count() <= 2, "at {at}");
        }
    }
}
