use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::time::Instant;

use crate::QueueError;
use crate::queue::SILENCE;

/// A bounded queue of records between two processes, in a file that lives in memory (`/dev/shm`).
///
/// ```text
///   0     magic, version, capacity
///   64    the producer's word:  bytes written, records written, beats
///   128   the consumer's word:  bytes taken,   records taken,   beats
///   192   the consumer's progress: the record that it is doing, how far it is (mm of its path), the feed's share
///   224   the stream that the producer is writing: its name, and the number of its first record
///   256   the producer's recall: what was written up to here is to be dropped; how many recalls there were
///   288   the consumer's answer: the recalls that it has obeyed; where it stood then: 320 tip (mm), 352 tool axis
///   4096  the ring: records, each behind its length (u32), byte b of the stream at b mod capacity
/// ```
///
/// Each word belongs to one side, and is written with its own check sum by one call, so that a reader who meets
/// it half-written reads it again. The producer writes records first and its word afterwards: a record that
/// was being written when the producer died was never there. The consumer moves its word on when it has *done*
/// a record: one that it was doing when it died is still there. Mapping the file would need `unsafe`; reading and
/// writing it does not, and with many records a call the calls cost little.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) file: File,
    pub(crate) capacity: u64,
}

const MAGIC: u64 = 0x3251_4c4d_5941_4c43;
pub(crate) const PRODUCER_AT: u64 = 64;
pub(crate) const CONSUMER_AT: u64 = 128;
pub(crate) const PROGRESS_AT: u64 = 192;
pub(crate) const STREAM_AT: u64 = 224;
pub(crate) const RECALL_AT: u64 = 256;
pub(crate) const ANSWER_AT: u64 = 288;
pub(crate) const TIP_AT: u64 = 320;
pub(crate) const AXIS_AT: u64 = 352;
const RING_AT: u64 = 4096;

/// Where one side is in the stream.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Word {
    pub(crate) bytes: u64,
    pub(crate) records: u64,
    pub(crate) beats: u64,
}

impl Shared {
    pub(crate) fn open(path: &Path, capacity: u64) -> Result<Self, QueueError> {
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        // Both sides may come first at the same time: one makes the queue, the other waits until it is whole.
        file.lock()?;
        let mut head = [0; 16];
        if file.metadata()?.len() < RING_AT {
            file.set_len(RING_AT + capacity)?;
            head[8..].copy_from_slice(&capacity.to_le_bytes());
            head[..8].copy_from_slice(&MAGIC.to_le_bytes());
            file.write_all_at(&head, 0)?;
            let shared = Shared { file, capacity };
            shared.write_word(PRODUCER_AT, Word::default())?;
            shared.write_word(CONSUMER_AT, Word::default())?;
            for at in [STREAM_AT, RECALL_AT, ANSWER_AT, TIP_AT, AXIS_AT] {
                shared.write_word(at, Word::default())?;
            }
            shared.write_word(PROGRESS_AT, progress(u64::MAX, 0.0, 1.0))?;
            shared.file.unlock()?;
            return Ok(shared);
        }
        file.read_exact_at(&mut head, 0)?;
        let number = |at: usize| u64::from_le_bytes(head[at..at + 8].try_into().unwrap_or_default());
        if number(0) != MAGIC {
            return Err(QueueError::Format("the file is no queue of this version"));
        }
        let capacity = number(8);
        if !(4096..=1 << 32).contains(&capacity) || file.metadata()?.len() != RING_AT + capacity {
            return Err(QueueError::Format("the queue's size is damaged"));
        }
        file.unlock()?;
        Ok(Shared { file, capacity })
    }

    pub(crate) fn write_word(&self, at: u64, word: Word) -> io::Result<()> {
        let mut bytes = [0; 32];
        let check = sum(&word);
        for (i, v) in [word.bytes, word.records, word.beats, check].into_iter().enumerate() {
            bytes[8 * i..8 * i + 8].copy_from_slice(&v.to_le_bytes());
        }
        self.file.write_all_at(&bytes, at)
    }

    pub(crate) fn read_word(&self, at: u64) -> Result<Word, QueueError> {
        let begun = Instant::now();
        loop {
            let mut bytes = [0; 32];
            self.file.read_exact_at(&mut bytes, at)?;
            let v = |i: usize| u64::from_le_bytes(bytes[8 * i..8 * i + 8].try_into().unwrap_or_default());
            let word = Word { bytes: v(0), records: v(1), beats: v(2) };
            if v(3) == sum(&word) {
                return Ok(word);
            }
            if begun.elapsed() > SILENCE {
                return Err(QueueError::Format("a word of the queue is damaged"));
            }
        }
    }

    /// Copies to or from the ring, round its end.
    pub(crate) fn ring(
        &self,
        at: u64,
        length: u64,
        mut part: impl FnMut(u64, std::ops::Range<usize>) -> io::Result<()>,
    ) -> io::Result<()> {
        let begin = at % self.capacity;
        let first = length.min(self.capacity - begin);
        part(RING_AT + begin, 0..first as usize)?;
        if first < length {
            part(RING_AT, first as usize..length as usize)?;
        }
        Ok(())
    }
}

fn sum(word: &Word) -> u64 {
    MAGIC ^ word.bytes.rotate_left(7) ^ word.records.rotate_left(23) ^ word.beats.rotate_left(41)
}

pub(crate) fn progress(seq: u64, way_mm: f64, feed_share: f64) -> Word {
    Word { bytes: seq, records: way_mm.to_bits(), beats: feed_share.to_bits() }
}

impl Word {
    /// Three numbers in a word.
    pub(crate) fn of_numbers([x, y, z]: [f64; 3]) -> Self {
        Word { bytes: x.to_bits(), records: y.to_bits(), beats: z.to_bits() }
    }

    /// The numbers of [`Word::of_numbers`].
    pub(crate) fn numbers(self) -> [f64; 3] {
        [self.bytes, self.records, self.beats].map(f64::from_bits)
    }
}
