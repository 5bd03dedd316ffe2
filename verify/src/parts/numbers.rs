//! Numbers of faces and moves as a part counts them.

use claymill_nurbs::{FaceId, Model};

use crate::report::Place;
use crate::track::Track;

/// The moves of a part and the faces around them, which places in it are counted by.
pub(crate) struct Numbers<'a> {
    pub(super) model: &'a Model,
    pub(super) moves: &'a [&'a Track],
    /// In rising order.
    pub(super) faces: &'a [FaceId],
}

impl Numbers<'_> {
    /// A place by the part's own numbers; `None` where it is not near.
    pub(crate) fn own(&self, place: &Place) -> Option<Place> {
        let own_move = |seq: u64| Some(self.moves.iter().position(|track| track.seq == seq)? as u64);
        let own_face = |face: FaceId| self.faces.binary_search(&face).ok();
        Some(Place {
            point_mm: place.point_mm,
            move_seq: through(place.move_seq, own_move)?,
            parameter: place.parameter,
            face: through(place.face, own_face)?,
            entity: None,
        })
    }

    /// The place that a part's own numbers tell; `None` where there is none.
    pub(crate) fn place(&self, own: Place) -> Option<Place> {
        let face = through(own.face, |face| self.faces.get(face).copied())?;
        let seq = |own: u64| Some(self.moves.get(usize::try_from(own).ok()?)?.seq);
        Some(Place {
            move_seq: through(own.move_seq, seq)?,
            face,
            entity: face.map(|f| self.model.faces[f].source.entity.clone()),
            ..own
        })
    }

    /// A height or depth and its place by the part's own numbers.
    pub(crate) fn own_at(&self, at: Option<&(f64, Place)>) -> Option<Option<(f64, Place)>> {
        through(at, |(mm, place)| Some((*mm, self.own(place)?)))
    }

    /// The reverse of [`Numbers::own_at`].
    pub(crate) fn at(&self, own: Option<(f64, Place)>) -> Option<Option<(f64, Place)>> {
        through(own, |(mm, place)| Some((mm, self.place(place)?)))
    }
}

/// What becomes of something that may be missing, unless that fails.
pub(crate) fn through<T, U>(one: Option<T>, with: impl FnOnce(T) -> Option<U>) -> Option<Option<U>> {
    match one {
        Some(one) => with(one).map(Some),
        None => Some(None),
    }
}
