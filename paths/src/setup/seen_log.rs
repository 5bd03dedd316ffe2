//! What setups see of places, written down in the order in which it was asked: so it is kept.

use claymill_nurbs::Point2;
use claymill_toolpath::Packed;
use serde::{Deserialize, Serialize};

use crate::setup::probe::Seen;

/// What was seen of the places of one face.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct SeenLog {
    /// A byte for each setup at each place.
    codes: Packed,
    /// How well those places face the setups of which this is known, in order.
    facings: Packed,
}

/// Writes down what is seen.
#[derive(Default)]
pub(crate) struct Recorder {
    codes: Vec<u8>,
    facings: Vec<f64>,
}

impl Recorder {
    /// Takes in what the setups see of the next place.
    pub(crate) fn add(&mut self, seen: &[Seen]) {
        for one in seen {
            let (code, facing) = code(one);
            self.codes.push(code);
            self.facings.extend(facing);
        }
    }

    pub(crate) fn log(self) -> SeenLog {
        SeenLog { codes: Packed::of_bytes(self.codes), facings: Packed::doubles(self.facings) }
    }
}

impl SeenLog {
    /// Answers as it was written down for so many setups, place by place; what the log does not say is asked.
    pub(crate) fn replay(
        &self,
        setups: usize,
        mut ask: impl FnMut(Point2) -> Vec<Seen>,
    ) -> impl FnMut(Point2) -> Vec<Seen> {
        let mut places = self.codes.as_bytes().chunks_exact(setups);
        let mut facings = self.facings.rows_of_doubles().map(|[facing]| facing);
        move |uv| {
            let place = places.next();
            let known: Option<Vec<Seen>> =
                place.and_then(|codes| codes.iter().map(|&code| seen(code, &mut facings)).collect());
            known.unwrap_or_else(|| ask(uv))
        }
    }
}

fn code(seen: &Seen) -> (u8, Option<f64>) {
    match *seen {
        Seen::Reached { facing, done, in_bounds } => (u8::from(done) + 2 * u8::from(in_bounds), Some(facing)),
        Seen::Wall { other_side, done } => (4 + u8::from(done) + 2 * u8::from(other_side), None),
        Seen::Slanting { facing, done } => (8 + u8::from(done), Some(facing)),
        Seen::OutOfBounds => (10, None),
        Seen::Steep => (11, None),
        Seen::Tight { done } => (12 + u8::from(done), None),
        Seen::Hidden => (14, None),
        Seen::Material => (15, None),
    }
}

fn seen(code: u8, mut facings: impl Iterator<Item = f64>) -> Option<Seen> {
    let (low, high) = (code & 1 != 0, code & 2 != 0);
    Some(match code {
        0..4 => Seen::Reached { facing: facings.next()?, done: low, in_bounds: high },
        4..8 => Seen::Wall { done: low, other_side: high },
        8 | 9 => Seen::Slanting { facing: facings.next()?, done: low },
        10 => Seen::OutOfBounds,
        11 => Seen::Steep,
        12 | 13 => Seen::Tight { done: low },
        14 => Seen::Hidden,
        15 => Seen::Material,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_seen_is_answered_in_order() {
        let both = [false, true];
        let mut all: Vec<Seen> = vec![Seen::OutOfBounds, Seen::Steep, Seen::Hidden, Seen::Material];
        for (done, other) in both.into_iter().flat_map(|a| both.map(|b| (a, b))) {
            all.push(Seen::Reached { facing: -0.1, done, in_bounds: other });
            all.push(Seen::Wall { other_side: other, done });
            all.push(Seen::Slanting { facing: 1.0 / 3.0, done });
            all.push(Seen::Tight { done });
        }
        let mut recorder = Recorder::default();
        all.chunks(2).for_each(|place| recorder.add(place));
        let log = recorder.log();
        let mut asked = 0;
        let mut answers = log.replay(2, |_| {
            asked += 1;
            vec![Seen::Hidden; 2]
        });
        let uv = Point2::origin();
        let back: Vec<Seen> = (0..all.len() / 2).flat_map(|_| answers(uv)).collect();
        assert_eq!(back, all);
        assert_eq!(answers(uv), [Seen::Hidden; 2]);
        drop(answers);
        assert_eq!(asked, 1);
    }
}
