use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::time::{Duration, Instant};

use thiserror::Error;

use crate::record::FEED_SHARES;
use crate::shared::{
    ANSWER_AT, CONSUMER_AT, PRODUCER_AT, PROGRESS_AT, RECALL_AT, STREAM_AT, Shared, Word, progress,
};

/// The file is not a queue, or the other side is gone.
#[derive(Debug, Error)]
pub enum QueueError {
    /// The operating system refused.
    #[error("queue: {0}")]
    Io(#[from] io::Error),
    /// Not a queue of this version, or damaged.
    #[error("queue: {0}")]
    Format(&'static str),
    /// The consumer was told to drop this stream.
    #[error("queue: this stream was dropped")]
    Dropped,
    /// The other side has not been heard of for this long.
    #[error("queue: the other side has not been heard of for {0:?}")]
    Silent(Duration),
}

/// In place of a stream's first record: it was dropped.
const DROPPED: u64 = u64::MAX;
/// The other side counts as dead after this long without a beat.
pub const SILENCE: Duration = Duration::from_millis(600);
/// How often a waiting side beats.
pub(crate) const BEAT: Duration = Duration::from_millis(50);
const NAP: Duration = Duration::from_micros(100);

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

/// The side that writes records.
#[derive(Debug)]
pub struct Producer {
    pub(crate) shared: Shared,
    pub(crate) word: Word,
    taken: Word,
    /// Name of the stream that is being written, once it was told.
    stream: Option<u64>,
    waiting: Vec<u8>,
    waiting_records: u64,
    watch: Watch,
    beaten: Instant,
}

impl Producer {
    /// Opens the queue, or makes it with room for `capacity` bytes.
    ///
    /// # Errors
    /// The file cannot be used, or is no queue.
    pub fn open(path: &Path, capacity: u64) -> Result<Self, QueueError> {
        let shared = Shared::open(path, capacity)?;
        let (word, taken) = (shared.read_word(PRODUCER_AT)?, shared.read_word(CONSUMER_AT)?);
        let (waiting, waiting_records) = (Vec::new(), 0);
        Ok(Producer {
            shared,
            word,
            taken,
            stream: None,
            waiting,
            waiting_records,
            watch: Watch::new(),
            beaten: Instant::now(),
        })
    }

    /// Goes on with the stream of this name, or begins it behind what is in the queue already; returns how many
    /// of its records were written before: where a producer that was restarted goes on.
    ///
    /// # Errors
    /// The queue cannot be used, or the stream was dropped.
    pub fn resume(&mut self, stream: u64) -> Result<u64, QueueError> {
        let known = self.shared.read_word(STREAM_AT)?;
        if known.bytes == stream && known.records == DROPPED {
            return Err(QueueError::Dropped);
        }
        self.flush()?;
        // Another producer may have written meanwhile.
        self.word = self.shared.read_word(PRODUCER_AT)?;
        self.stream = Some(stream);
        if known.bytes != stream || known.records > self.word.records {
            let fresh = Word { bytes: stream, records: self.word.records, beats: 0 };
            self.shared.write_word(STREAM_AT, fresh)?;
            return Ok(0);
        }
        Ok(self.word.records - known.records)
    }

    /// Drops the stream that was written last: nothing more of it comes, under its name neither. Returns the name.
    ///
    /// # Errors
    /// The queue cannot be used.
    pub fn abandon(&mut self) -> Result<u64, QueueError> {
        self.waiting.clear();
        self.waiting_records = 0;
        self.stream = None;
        let known = self.shared.read_word(STREAM_AT)?;
        self.shared.write_word(STREAM_AT, Word { records: DROPPED, ..known })?;
        Ok(known.bytes)
    }

    /// Number of the record that comes next.
    #[must_use]
    pub fn next(&self) -> u64 {
        self.word.records + self.waiting_records
    }

    /// Records that the consumer has done.
    ///
    /// # Errors
    /// The queue cannot be read.
    pub fn done(&mut self) -> Result<u64, QueueError> {
        self.taken = self.shared.read_word(CONSUMER_AT)?;
        Ok(self.taken.records)
    }

    /// Adds a record; it goes to the consumer with the next [`Producer::flush`], or when many are waiting.
    ///
    /// # Errors
    /// As [`Producer::flush`]; and the record is larger than the queue.
    pub fn push(&mut self, record: &[u8]) -> Result<(), QueueError> {
        while !self.push_for(record, SILENCE)? {}
        Ok(())
    }

    /// As [`Producer::push`], but gives up after `patience`; whether the record was added.
    ///
    /// # Errors
    /// As [`Producer::push`].
    pub fn push_for(&mut self, record: &[u8], patience: Duration) -> Result<bool, QueueError> {
        let size = 4 + record.len() as u64;
        if size > self.shared.capacity {
            return Err(QueueError::Format("the record is larger than the queue"));
        }
        if self.waiting.len() as u64 + size > (self.shared.capacity / 4).min(1 << 16)
            && !self.flush_for(patience)?
        {
            return Ok(false);
        }
        self.waiting.extend((record.len() as u32).to_le_bytes());
        self.waiting.extend_from_slice(record);
        self.waiting_records += 1;
        Ok(true)
    }

    /// Hands over what is waiting; blocks while the queue is full.
    ///
    /// # Errors
    /// The queue cannot be written, or it is full and the consumer has not been heard of for [`SILENCE`]: call
    /// again to go on waiting.
    pub fn flush(&mut self) -> Result<(), QueueError> {
        while !self.flush_for(SILENCE)? {}
        Ok(())
    }

    /// As [`Producer::flush`], but gives up after `patience`; whether everything was handed over.
    ///
    /// # Errors
    /// As [`Producer::flush`].
    pub fn flush_for(&mut self, patience: Duration) -> Result<bool, QueueError> {
        if self.waiting.is_empty() {
            return Ok(true);
        }
        self.is_wanted()?;
        let size = self.waiting.len() as u64;
        let begun = Instant::now();
        while self.word.bytes + size > self.taken.bytes + self.shared.capacity {
            self.taken = self.shared.read_word(CONSUMER_AT)?;
            if self.word.bytes + size <= self.taken.bytes + self.shared.capacity {
                break;
            }
            if let Some(silence) = self.watch.silent(self.taken.beats) {
                self.watch = Watch::new();
                return Err(QueueError::Silent(silence));
            }
            self.beat()?;
            if begun.elapsed() >= patience {
                return Ok(false);
            }
            std::thread::sleep(NAP);
        }
        let (shared, waiting) = (&self.shared, &self.waiting);
        shared.ring(self.word.bytes, size, |at, part| shared.file.write_all_at(&waiting[part], at))?;
        self.word.bytes += size;
        self.word.records += self.waiting_records;
        self.word.beats += 1;
        self.shared.write_word(PRODUCER_AT, self.word)?;
        self.waiting.clear();
        self.waiting_records = 0;
        Ok(true)
    }

    /// Lets the consumer know that the producer lives; to be called every [`SILENCE`] / 4 or so.
    ///
    /// # Errors
    /// The queue cannot be written.
    pub fn beat(&mut self) -> Result<(), QueueError> {
        if self.beaten.elapsed() >= BEAT {
            self.is_wanted()?;
            self.beaten = Instant::now();
            self.word.beats += 1;
            self.shared.write_word(PRODUCER_AT, self.word)?;
        }
        Ok(())
    }

    /// Whether the stream that is being written is still the one that the queue is for.
    fn is_wanted(&self) -> Result<(), QueueError> {
        let Some(stream) = self.stream else { return Ok(()) };
        let known = self.shared.read_word(STREAM_AT)?;
        if known.bytes == stream && known.records != DROPPED { Ok(()) } else { Err(QueueError::Dropped) }
    }
}

/// The side that takes records.
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
    watch: Watch,
    beaten: Instant,
}

impl Consumer {
    /// Opens the queue, or makes it with room for `capacity` bytes.
    ///
    /// # Errors
    /// The file cannot be used, or is no queue.
    pub fn open(path: &Path, capacity: u64) -> Result<Self, QueueError> {
        let shared = Shared::open(path, capacity)?;
        let (word, written) = (shared.read_word(CONSUMER_AT)?, shared.read_word(PRODUCER_AT)?);
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
            watch: Watch::new(),
            beaten: Instant::now(),
        })
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

    /// Reads what was written since; whether there was anything.
    fn fill(&mut self) -> Result<bool, QueueError> {
        self.written = self.shared.read_word(PRODUCER_AT)?;
        let held = (self.ahead.len() - self.at) as u64;
        let from = self.word.bytes + held;
        let length = self.written.bytes.checked_sub(from);
        let Some(length) = length.filter(|l| *l + held <= self.shared.capacity) else {
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
        self.word.beats += 1;
        Ok(self.shared.write_word(CONSUMER_AT, self.word)?)
    }

    /// Takes everything out that was written so far, done or not.
    ///
    /// # Errors
    /// The queue cannot be used.
    pub fn discard(&mut self) -> Result<(), QueueError> {
        self.written = self.shared.read_word(PRODUCER_AT)?;
        self.go_to(self.written)
    }

    /// Takes everything out up to where a word stood.
    pub(crate) fn go_to(&mut self, Word { bytes, records, .. }: Word) -> Result<(), QueueError> {
        self.word = Word { bytes, records, beats: self.word.beats + 1 };
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
            self.word.beats += 1;
            self.shared.write_word(CONSUMER_AT, self.word)?;
        }
        Ok(())
    }
}
