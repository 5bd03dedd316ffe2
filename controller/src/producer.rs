//! The producer's side of the queue in shared memory: one process at a time writes, and a restarted
//! one goes on with its stream.

use std::path::Path;
use std::time::{Duration, Instant};

use crate::judge::Judge;
use crate::queue::{BEAT, DROPPED, NAP, SILENCE, Watch};
use crate::shared::{CONSUMER_AT, LETS_GO, PRODUCER_AT, Role, STREAM_AT, Shared, Word};
use crate::{QueueError, Record, RecordError};

/// The side that writes records; one at a time does.
#[derive(Debug)]
pub struct Producer {
    pub(crate) shared: Shared,
    pub(crate) word: Word,
    taken: Word,
    /// Whether this is the one that writes.
    writes: bool,
    /// Name of the stream that is being written, once it was told.
    stream: Option<u64>,
    waiting: Vec<u8>,
    waiting_records: u64,
    /// Whether the last record that waits ends the stream.
    waiting_ends: bool,
    /// Judges what comes next; and as it was when everything had been handed over.
    judge: Judge,
    handed: Judge,
    watch: Watch,
    beaten: Instant,
}

impl Producer {
    /// Opens the queue, or makes it with room for `capacity` bytes.
    ///
    /// # Errors
    /// The file cannot be used, others could use it too, or it is no queue.
    pub fn open(path: &Path, capacity: u64) -> Result<Self, QueueError> {
        let shared = Shared::open(path, capacity)?;
        let (word, taken) = (shared.position(PRODUCER_AT)?, shared.position(CONSUMER_AT)?);
        Ok(Producer {
            shared,
            word,
            taken,
            writes: false,
            stream: None,
            waiting: Vec::new(),
            waiting_records: 0,
            waiting_ends: false,
            judge: Judge::default(),
            handed: Judge::default(),
            watch: Watch::new(),
            beaten: Instant::now(),
        })
    }

    /// Goes on with the stream of this name, or begins it when the one before has been executed to its end; returns how many
    /// of its records were written before: where a producer that was restarted goes on. What was pushed and not handed over
    /// is forgotten.
    ///
    /// # Errors
    /// The queue cannot be used, the stream was dropped, or another one has not ended.
    pub fn resume(&mut self, stream: u64) -> Result<u64, QueueError> {
        self.forget();
        let known = self.shared.read_word(STREAM_AT)?;
        if known.bytes == stream && known.records == DROPPED {
            return Err(QueueError::Dropped);
        }
        self.write_alone()?;
        // Another producer may have written meanwhile.
        let known = self.shared.read_word(STREAM_AT)?;
        if known.bytes == stream && known.records <= self.word.records {
            let count = self.word.records - known.records;
            self.judge = self.handed.clone().at(count);
            self.handed = self.judge.clone();
            self.stream = Some(stream);
            return Ok(count);
        }
        let nothing_of_it = known.records == self.word.records;
        let over = self.word.ends() || known.records == DROPPED;
        if !(nothing_of_it || over && self.done()? == self.word.records) {
            self.release()?;
            return Err(QueueError::Unfinished);
        }
        let fresh = Word { bytes: stream, records: self.word.records, beats: 0 };
        self.shared.write_word(STREAM_AT, fresh)?;
        self.judge = Judge::from(Some(0), None);
        self.handed = self.judge.clone();
        self.stream = Some(stream);
        Ok(0)
    }

    /// Drops the stream that was written last: nothing more of it comes, under its name neither. Returns the name.
    ///
    /// # Errors
    /// The queue cannot be used.
    pub fn abandon(&mut self) -> Result<u64, QueueError> {
        self.forget();
        self.stream = None;
        self.shared.abandon()
    }

    /// Becomes the one that writes. Whoever else does is waited for, not longer than he needs to notice that his stream was
    /// dropped.
    pub(crate) fn write_alone(&mut self) -> Result<(), QueueError> {
        if self.writes {
            return Ok(());
        }
        if !self.shared.lock(Role::Writer, LETS_GO)? {
            return Err(QueueError::Written);
        }
        self.writes = true;
        let word = self.shared.position(PRODUCER_AT)?;
        if (word.bytes, word.records) != (self.word.bytes, self.word.records) {
            // What others have written was judged by them.
            self.judge = Judge::default();
            self.handed = Judge::default();
        }
        self.word = word;
        Ok(())
    }

    /// Lets others write. What was pushed and not handed over is forgotten.
    ///
    /// # Errors
    /// The queue cannot be used.
    pub fn release(&mut self) -> Result<(), QueueError> {
        self.stream = None;
        self.let_go()
    }

    fn let_go(&mut self) -> Result<(), QueueError> {
        self.forget();
        if std::mem::take(&mut self.writes) {
            self.shared.unlock(Role::Writer)?;
        }
        Ok(())
    }

    fn forget(&mut self) {
        self.waiting.clear();
        self.waiting_records = 0;
        self.judge = self.handed.clone();
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
        self.taken = self.shared.position(CONSUMER_AT)?;
        Ok(self.taken.records)
    }

    /// Adds a record; it goes to the consumer with the next [`Producer::flush`], or when many are waiting.
    ///
    /// # Errors
    /// As [`Producer::flush`]; and the record makes no sense here, or is larger than the queue: it is not added.
    pub fn push(&mut self, record: &[u8]) -> Result<(), QueueError> {
        while !self.push_for(record, SILENCE)? {}
        Ok(())
    }

    /// As [`Producer::push`], but gives up after `patience`; whether the record was added.
    ///
    /// # Errors
    /// As [`Producer::push`].
    pub fn push_for(&mut self, record: &[u8], patience: Duration) -> Result<bool, QueueError> {
        self.write_alone()?;
        let size = 4 + record.len() as u64;
        if size > self.shared.capacity {
            return Err(QueueError::Format("the record is larger than the queue"));
        }
        if self.waiting.len() as u64 + size > (self.shared.capacity / 4).min(1 << 16)
            && !self.flush_for(patience)?
        {
            return Ok(false);
        }
        let refused = |source: RecordError| QueueError::Record {
            seq: Record::claimed_seq(record).unwrap_or_default(),
            source: Box::new(source),
        };
        let (_, judged) = self.judge.judge(record).map_err(refused)?;
        self.waiting_ends = judged == Record::End;
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
            self.taken = self.shared.position(CONSUMER_AT)?;
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
        self.word.beat();
        self.word.set_ends(self.waiting_ends);
        self.shared.write_word(PRODUCER_AT, self.word)?;
        self.handed = self.judge.clone();
        self.forget();
        Ok(true)
    }

    /// Lets the consumer know that the producer lives; to be called every [`SILENCE`] / 4 or so.
    ///
    /// # Errors
    /// The queue cannot be written, or the stream was dropped.
    pub fn beat(&mut self) -> Result<(), QueueError> {
        if self.writes && self.beaten.elapsed() >= BEAT {
            self.is_wanted()?;
            self.beaten = Instant::now();
            self.word.beat();
            self.shared.write_word(PRODUCER_AT, self.word)?;
        }
        Ok(())
    }

    /// Whether the stream that is being written is still the one that the queue is for; if not, another one may write.
    fn is_wanted(&mut self) -> Result<(), QueueError> {
        let Some(stream) = self.stream else { return Ok(()) };
        let known = self.shared.read_word(STREAM_AT)?;
        if known.bytes == stream && known.records != DROPPED {
            return Ok(());
        }
        self.let_go()?;
        Err(QueueError::Dropped)
    }
}

impl Shared {
    /// Drops the stream that was written last; returns its name.
    pub(crate) fn abandon(&self) -> Result<u64, QueueError> {
        let known = self.read_word(STREAM_AT)?;
        self.write_word(STREAM_AT, Word { records: DROPPED, ..known })?;
        Ok(known.bytes)
    }
}
