//! How a stream begins anew in a queue: the machine comes to rest, drops what it has, and says where it stands.

use std::time::{Duration, Instant};

use claymill_nurbs::{Point3, Vector3};

use crate::queue::{BEAT, Watch};
use crate::shared::{ANSWER_AT, AXIS_AT, CONSUMER_AT, RECALL_AT, TIP_AT, Word};
use crate::{Consumer, Producer, QueueError};

const NAP: Duration = Duration::from_millis(2);

impl Producer {
    /// Drops what is in the queue, what the machine is doing included, and waits until it stands still; returns where
    /// (tip in mm, tool axis), if it has moved at all. Whoever still writes the old stream is told that it was dropped.
    ///
    /// # Errors
    /// The queue cannot be used, nobody takes from it, or another program writes and does not let go.
    pub fn recall(&mut self) -> Result<Option<(Point3, Vector3)>, QueueError> {
        self.abandon()?;
        // Whoever still writes notices, and lets go.
        self.write_alone()?;
        let count = self.shared.read_word(RECALL_AT)?.beats.wrapping_add(1);
        self.shared.write_word(RECALL_AT, Word { beats: count, ..self.word })?;
        let mut watch = Watch::new();
        while self.shared.read_word(ANSWER_AT)?.beats != count {
            if let Some(silence) = watch.silent(self.shared.read_word(CONSUMER_AT)?.beats) {
                return Err(QueueError::Silent(silence));
            }
            self.beat()?;
            std::thread::sleep(NAP);
        }
        let [tip, axis] = [TIP_AT, AXIS_AT].map(|at| self.shared.read_word(at).map(Word::numbers));
        let (tip, axis) = (Point3::from(tip?), Vector3::from(axis?));
        Ok(tip.iter().chain(axis.iter()).all(|c| c.is_finite()).then_some((tip, axis)))
    }
}

impl Consumer {
    /// Whether the producer has recalled what it wrote, and that was not obeyed yet. Asked at every set point: the queue
    /// is looked at as often as it beats.
    ///
    /// # Errors
    /// The queue cannot be read.
    pub fn recalled(&mut self) -> Result<bool, QueueError> {
        if self.looked.elapsed() >= BEAT {
            self.looked = Instant::now();
            // A word that is being written is looked at again: the machine may be moving.
            self.recalls = self.shared.glimpse(RECALL_AT)?.map_or(self.recalls, |word| word.beats);
        }
        Ok(self.recalls != self.obeyed)
    }

    /// Obeys a recall: takes out what was written before it, done or not, and says where the machine stands.
    ///
    /// # Errors
    /// The queue cannot be used.
    pub fn give_back(&mut self, stands: Option<(Point3, Vector3)>) -> Result<(), QueueError> {
        let recall = self.shared.position(RECALL_AT)?;
        // A recall from before this process may lie behind what was done since.
        let behind = recall.bytes < self.word.bytes || recall.records < self.word.records;
        self.go_to(if behind { self.word } else { recall })?;
        let (tip, axis) = stands.map_or(([f64::NAN; 3], [f64::NAN; 3]), |(t, a)| (t.into(), a.into()));
        self.shared.write_word(TIP_AT, Word::of_numbers(tip))?;
        self.shared.write_word(AXIS_AT, Word::of_numbers(axis))?;
        self.shared.write_word(ANSWER_AT, Word { beats: recall.beats, ..Word::default() })?;
        (self.recalls, self.obeyed) = (recall.beats, recall.beats);
        Ok(())
    }
}
