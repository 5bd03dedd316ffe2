//! The consumer's side of the queue in shared memory, and what can go wrong with either side. A
//! record leaves the queue when it has been executed, not when it is read.

use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use thiserror::Error;

use crate::RecordError;
use crate::record::FEED_SHARES;
use crate::shared::{
    ANSWER_AT, CONSUMER_AT, LETS_GO, PRODUCER_AT, PROGRESS_AT, RECALL_AT, Role, STREAM_AT, Shared, Word,
    progress,
};

/// The file is not a queue, or the other side is gone.
#[derive(Debug, Error)]
pub enum QueueError {
    /// The operating system refused.
    #[error("queue: {0}")]
    Io(#[from] io::Error),
    /// The file cannot be opened or made.
    #[error("queue {}: {source}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The file is somebody else's, or something else: it is left as it is.
    #[error("queue {}: the file {why}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// Not a queue of this version, or damaged.
    #[error("queue: {0}")]
    Format(&'static str),
    /// Another consumer takes records.
    #[error("queue: another controller takes records from it")]
    Taken,
    /// Another producer writes records.
    #[error("queue: another program writes records into it")]
    Written,
    /// Another stream has not been written to its end.
    #[error("queue: another stream in it has not ended")]
    Unfinished,
    /// A record makes no sense where it stands.
    #[error("record {seq}: {source}")]
    Record {
        /// The number that it has, or claims.
        seq: u64,
        /// What is wrong with it.
        source: Box<RecordError>,
    },
    /// The consumer was told to drop this stream.
    #[error("queue: this stream was dropped")]
    Dropped,
    /// The other side has not been heard of for this long.
    #[error("queue: the other side has not been heard of for {0:?}")]
    Silent(Duration),
}

/// In place of a stream's first record: it was dropped.
pub(crate) const DROPPED: u64 = u64::MAX;
/// The other side counts as dead after this long without a beat.
pub const SILENCE: Duration = Duration::from_millis(600);
/// How often a waiting side beats.
pub(crate) const BEAT: Duration = Duration::from_millis(50);
pub(crate) const NAP: Duration = Duration::from_micros(100);

/// Watches the beats of the other side.
#[derive(Debug)]
pub(crate) struct Watch {
    beats: u64,
    since: Instant,
}

impl Watch {
    pub(crate) fn new() -> Self {
        Watch { beats: u64::MAX, since: Instant::now() }
    }

    pub(crate) fn silent(&mut self, beats: u64) -> Option<Duration> {
        if beats != self.beats {
            (self.beats, self.since) = (beats, Instant::now());
        }
        Some(self.since.elapsed()).filter(|d| *d > SILENCE)
    }
}

/// The side that takes records; there is one at a time.
#[derive(Debug)]
pub struct Consumer {
    pub(crate) shared: Shared,
    pub(crate) word: Word,
    written: Word,
    /// Bytes read ahead, where the next record begins in them, and the next one that was not looked at.
    ahead: Vec<u8>,
    at: usize,
    seen: usize,
    /// Recalls that there were when it was looked last, and those that were obeyed.
    pub(crate) recalls: u64,
    pub(crate) obeyed: u64,
    pub(crate) looked: Instant,
    /// Since when the producer's word cannot be read.
    torn: Option<Instant>,
    watch: Watch,
    beaten: Instant,
}

impl Consumer {
    /// Opens the queue, or makes it with room for `capacity` bytes.
    ///
    /// # Errors
    /// The file cannot be used, others could use it too, it is no queue, or another consumer takes from it.
    pub fn open(path: &Path, capacity: u64) -> Result<Self, QueueError> {
        let shared = Shared::open(path, capacity)?;
        if !shared.lock(Role::Taker, LETS_GO)? {
            return Err(QueueError::Taken);
        }
        let word = shared.position(CONSUMER_AT)?;
        // What the other side has written wrongly is met later, and can be cleared.
        let written = shared.read_word(PRODUCER_AT).unwrap_or_default();
        let [recalls, obeyed] = [shared.read_word(RECALL_AT)?.beats, shared.read_word(ANSWER_AT)?.beats];
        Ok(Consumer {
            shared,
            word,
            written,
            ahead: Vec::new(),
            at: 0,
            seen: 0,
            recalls,
            obeyed,
            looked: Instant::now(),
            torn: None,
            watch: Watch::new(),
            beaten: Instant::now(),
        })
    }

    /// Number that the next record has within its stream, as far as the queue knows.
    pub(crate) fn next_of_stream(&self) -> Option<u64> {
        let stream = self.shared.read_word(STREAM_AT).ok()?;
        let nothing_waits = self.word.records == self.written.records;
        if nothing_waits && (self.written.ends() || stream.records == DROPPED) {
            return Some(0);
        }
        self.word.records.checked_sub(stream.records)
    }

    /// Records done so far: the number of the next one.
    #[must_use]
    pub fn next(&self) -> u64 {
        self.word.records
    }

    /// The next record, which stays in the queue until [`Consumer::done`]; `None` when there is none yet.
    ///
    /// # Errors
    /// The queue is damaged, or it is empty and the producer has not been heard of for [`SILENCE`]: call again
    /// to go on waiting.
    pub fn peek(&mut self) -> Result<Option<&[u8]>, QueueError> {
        if self.at == self.ahead.len() && !self.fill()? {
            let silent = self.watch.silent(self.written.beats);
            self.beat()?;
            return match silent {
                Some(silence) => {
                    self.watch = Watch::new();
                    Err(QueueError::Silent(silence))
                }
                None => Ok(None),
            };
        }
        let record = self.record(self.at)?;
        Ok(Some(&self.ahead[record]))
    }

    /// The next record that was not looked at yet, at or behind the one of [`Consumer::peek`]; it stays in the queue.
    ///
    /// # Errors
    /// The queue is damaged.
    pub fn look(&mut self) -> Result<Option<&[u8]>, QueueError> {
        if self.seen == self.ahead.len() && !self.fill()? {
            return Ok(None);
        }
        let record = self.record(self.seen)?;
        self.seen = record.end;
        Ok(Some(&self.ahead[record]))
    }

    /// Where in `ahead` the record is that begins, with its length, at `at`.
    fn record(&self, at: usize) -> Result<std::ops::Range<usize>, QueueError> {
        let bad = QueueError::Format("a record's length is damaged");
        let Some(head) = self.ahead.get(at..at + 4) else { return Err(bad) };
        let length = u32::from_le_bytes(head.try_into().unwrap_or_default()) as usize;
        if self.ahead.len() - at - 4 < length { Err(bad) } else { Ok(at + 4..at + 4 + length) }
    }

    /// Reads what was written since; whether there was anything. Never waits: the machine may be moving.
    fn fill(&mut self) -> Result<bool, QueueError> {
        match self.shared.glimpse(PRODUCER_AT)? {
            Some(word) => self.written = word.checked()?,
            None if self.torn.get_or_insert_with(Instant::now).elapsed() > SILENCE => {
                return Err(QueueError::Format("a word of the queue is damaged"));
            }
            None => return Ok(false),
        }
        self.torn = None;
        let held = (self.ahead.len() - self.at) as u64;
        let from = self.word.bytes + held;
        let length = self.written.bytes.checked_sub(from);
        let fits = |l: &u64| *l + held <= self.shared.capacity && self.written.records >= self.word.records;
        let Some(length) = length.filter(fits) else {
            return Err(QueueError::Format("the queue's words do not fit"));
        };
        if length == 0 {
            return Ok(false);
        }
        self.ahead.drain(..self.at);
        self.seen -= self.at;
        self.at = 0;
        let begin = self.ahead.len();
        self.ahead.resize(begin + length as usize, 0);
        let (shared, new) = (&self.shared, &mut self.ahead[begin..]);
        shared.ring(from, length, |at, part| shared.file.read_exact_at(&mut new[part], at))?;
        Ok(true)
    }

    /// Takes the record of the last [`Consumer::peek`] out of the queue: it has been done.
    ///
    /// # Errors
    /// The queue cannot be written.
    pub fn done(&mut self) -> Result<(), QueueError> {
        if self.at == self.ahead.len() {
            return Ok(());
        }
        let end = self.record(self.at)?.end;
        self.word.bytes += (end - self.at) as u64;
        self.at = end;
        self.seen = self.seen.max(end);
        self.word.records += 1;
        self.word.beat();
        Ok(self.shared.write_word(CONSUMER_AT, self.word)?)
    }

    /// Takes everything out that was written so far, done or not, and drops the stream that it belongs to: whoever still
    /// writes it is told so. Words that were damaged are written anew.
    ///
    /// # Errors
    /// The queue cannot be used.
    pub fn discard(&mut self) -> Result<(), QueueError> {
        if self.shared.abandon().is_err() {
            self.shared.write_word(STREAM_AT, Word { records: DROPPED, ..Word::default() })?;
        }
        // He notices at his next beat. One that has been stopped cannot, and is met by his records' numbers.
        let begun = Instant::now();
        let mut alone = self.shared.lock(Role::Writer, Duration::ZERO)?;
        while !alone && begun.elapsed() < LETS_GO {
            self.beat()?;
            std::thread::sleep(NAP);
            alone = self.shared.lock(Role::Writer, Duration::ZERO)?;
        }
        let dropped = self.drop_written(alone);
        if alone {
            self.shared.unlock(Role::Writer)?;
        }
        dropped
    }

    fn drop_written(&mut self, alone: bool) -> Result<(), QueueError> {
        let written = self.shared.position(PRODUCER_AT);
        let fits = |w: &Word| {
            let behind = w.bytes.checked_sub(self.word.bytes);
            behind.is_some_and(|b| b <= self.shared.capacity) && w.records >= self.word.records
        };
        let up_to = match written.ok().filter(fits) {
            Some(word) => word,
            None if alone => {
                self.shared.write_word(PRODUCER_AT, self.word)?;
                self.word
            }
            None => return Err(QueueError::Written),
        };
        self.written = up_to;
        self.torn = None;
        self.go_to(up_to)
    }

    /// Takes everything out up to where a word stood.
    pub(crate) fn go_to(&mut self, Word { bytes, records, .. }: Word) -> Result<(), QueueError> {
        self.word = Word { bytes, records, beats: self.word.beats };
        self.word.beat();
        self.ahead.clear();
        (self.at, self.seen) = (0, 0);
        // Progress of a record that is no longer the next one is not heeded.
        self.shared.write_word(CONSUMER_AT, self.word)?;
        Ok(self.shared.write_word(PROGRESS_AT, progress(u64::MAX, 0.0, 1.0))?)
    }

    /// Notes how far, in mm, the path of record `seq` has been run, and the part of their own feed that paths are
    /// run with, for whoever goes on after this process.
    ///
    /// # Errors
    /// The queue cannot be written.
    pub fn set_progress(&mut self, seq: u64, way_mm: f64, feed_share: f64) -> Result<(), QueueError> {
        Ok(self.shared.write_word(PROGRESS_AT, progress(seq, way_mm, feed_share))?)
    }

    /// How far the path of record `seq` was when it was last noted, mm; `None` when it was not begun.
    ///
    /// # Errors
    /// The queue cannot be read.
    pub fn progress(&self, seq: u64) -> Result<Option<f64>, QueueError> {
        let word = self.shared.read_word(PROGRESS_AT)?;
        let way_mm = f64::from_bits(word.records);
        Ok((word.bytes == seq && way_mm.is_finite() && way_mm >= 0.0).then_some(way_mm))
    }

    /// The part of their own feed that paths are run with, as last noted.
    ///
    /// # Errors
    /// The queue cannot be read.
    pub fn feed_share(&self) -> Result<f64, QueueError> {
        let share = f64::from_bits(self.shared.read_word(PROGRESS_AT)?.beats);
        Ok(if FEED_SHARES.contains(&share) { share } else { 1.0 })
    }

    /// Lets the producer know that the consumer lives.
    ///
    /// # Errors
    /// The queue cannot be written.
    pub fn beat(&mut self) -> Result<(), QueueError> {
        if self.beaten.elapsed() >= BEAT {
            self.beaten = Instant::now();
            self.word.beat();
            self.shared.write_word(CONSUMER_AT, self.word)?;
        }
        Ok(())
    }
}
