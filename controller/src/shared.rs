//! The file behind the queue: layout, check sums, locks and the ring of records. Readers and
//! writers survive the death of either side; producer and consumer are built on it.

use std::io;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::QueueError;
use crate::private_file::PrivateFile;
use crate::queue::SILENCE;

/// A bounded queue of records between two processes, in a file that lives in memory (`/dev/shm`).
///
/// ```text
///   0     magic, version, capacity
///   64    the producer's word:  bytes written, records written, beats (and whether the last record ends its stream)
///   128   the consumer's word:  bytes taken,   records taken,   beats
///   192   the consumer's progress: the record that it is doing, how far it is (mm of its path), the feed's share
///   224   the stream that the producer is writing: its name, and the number of its first record
///   256   the producer's recall: what was written up to here is to be dropped; how many recalls there were
///   288   the consumer's answer: the recalls that it has obeyed; where it stood then: 320 tip (mm), 352 tool axis
///   384   what the consumer has told the machine: tool, spindle, coolant; 416 outputs that it has told, and those on
///   4096  the ring: records, each behind its length (u32), byte b of the stream at b mod capacity
/// ```
///
/// Each word belongs to one side, and is written with its own check sum by one call, so that a reader who meets
/// it half-written reads it again. The producer writes records first and its word afterwards: a record that
/// was being written when the producer died was never there. The consumer moves its word on when it has *done*
/// a record: one that it was doing when it died is still there. Mapping the file would need `unsafe`; reading and
/// writing it does not, and with many records a call the calls cost little.
///
/// One process at a time writes, and one takes: each side locks the byte where its word begins (a file beside
/// the queue of that number where the system has no such locks), and loses that lock when
/// it dies, however it dies.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) file: PrivateFile,
    pub(crate) capacity: u64,
}

/// `CLAYMLQ` and the version's digit.
const NAME: u64 = 0x0051_4c4d_5941_4c43;
const VERSION: u8 = 3;
const MAGIC: u64 = NAME | (((b'0' + VERSION) as u64) << 56);
/// A queue whose maker has not come to the end.
const MAKING: u64 = NAME | ((b'~' as u64) << 56);
pub(crate) const PRODUCER_AT: u64 = 64;
pub(crate) const CONSUMER_AT: u64 = 128;
pub(crate) const PROGRESS_AT: u64 = 192;
pub(crate) const STREAM_AT: u64 = 224;
pub(crate) const RECALL_AT: u64 = 256;
pub(crate) const ANSWER_AT: u64 = 288;
pub(crate) const TIP_AT: u64 = 320;
pub(crate) const AXIS_AT: u64 = 352;
pub(crate) const SWITCHES_AT: u64 = 384;
pub(crate) const OUTPUTS_AT: u64 = 416;
const RING_AT: u64 = 4096;

/// More bytes or records than this no queue has ever seen.
const MOST: u64 = 1 << 62;
/// A word that is being written is whole after a few looks.
const LOOKS: usize = 16;
/// How long a lock that its owner gives back soon is waited for.
pub(crate) const LETS_GO: Duration = Duration::from_millis(500);
const NAP: Duration = Duration::from_micros(500);

/// What one process at a time may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    /// Make the queue.
    Maker,
    /// Write records.
    Writer,
    /// Take records.
    Taker,
}

impl Role {
    fn at(self) -> u64 {
        match self {
            Role::Maker => 0,
            Role::Writer => PRODUCER_AT,
            Role::Taker => CONSUMER_AT,
        }
    }
}

/// Where one side is in the stream.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Word {
    pub(crate) bytes: u64,
    pub(crate) records: u64,
    pub(crate) beats: u64,
}

impl Shared {
    pub(crate) fn open(path: &Path, capacity: u64) -> Result<Self, QueueError> {
        let file = PrivateFile::open(path)?;
        let mut shared = Shared { file, capacity };
        // Both sides may come first at the same time: one makes the queue, the other waits until it is whole.
        if !shared.lock(Role::Maker, SILENCE)? {
            return Err(QueueError::Format("another process keeps it locked"));
        }
        let length = shared.file.len()?;
        let mut head = [0; 16];
        if length >= 16 {
            shared.file.read_exact_at(&mut head, 0)?;
        }
        let number = |at: usize| u64::from_le_bytes(head[at..at + 8].try_into().unwrap_or_default());
        let magic = number(0);
        if length == 0 || magic == MAKING {
            shared.make()?;
        } else if magic == MAGIC {
            shared.capacity = number(8);
            if !(4096..=1 << 32).contains(&shared.capacity) || length != RING_AT + shared.capacity {
                return Err(QueueError::Format("the queue's size is damaged"));
            }
        } else if magic & (u64::MAX >> 8) == NAME {
            return Err(QueueError::Format("the queue is of another version of claymill"));
        } else {
            return Err(QueueError::Foreign {
                path: path.to_owned(),
                why: "is no queue, and not empty".into(),
            });
        }
        shared.unlock(Role::Maker)?;
        Ok(shared)
    }

    /// Makes the queue in an empty file; where its maker dies, the next one begins anew.
    fn make(&self) -> io::Result<()> {
        let mut head = [0; 16];
        head[8..].copy_from_slice(&self.capacity.to_le_bytes());
        head[..8].copy_from_slice(&MAKING.to_le_bytes());
        self.file.write_all_at(&head, 0)?;
        self.file.set_len(RING_AT + self.capacity)?;
        for at in [PRODUCER_AT, CONSUMER_AT, STREAM_AT, RECALL_AT, ANSWER_AT, TIP_AT, AXIS_AT, OUTPUTS_AT] {
            self.write_word(at, Word::default())?;
        }
        self.write_word(PROGRESS_AT, progress(u64::MAX, 0.0, 1.0))?;
        self.write_word(SWITCHES_AT, Word { bytes: u64::MAX, records: u64::MAX, beats: u64::MAX })?;
        head[..8].copy_from_slice(&MAGIC.to_le_bytes());
        self.file.write_all_at(&head, 0)
    }

    /// Takes a role that one process at a time may have; `false` where another one does not let go of it within `patience`.
    pub(crate) fn lock(&self, role: Role, patience: Duration) -> io::Result<bool> {
        let begun = Instant::now();
        while !self.file.try_lock(role.at())? {
            if begun.elapsed() >= patience {
                return Ok(false);
            }
            std::thread::sleep(NAP);
        }
        Ok(true)
    }

    pub(crate) fn unlock(&self, role: Role) -> io::Result<()> {
        self.file.unlock(role.at())
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
            if let Some(word) = self.glimpse(at)? {
                return Ok(word);
            }
            if begun.elapsed() > SILENCE {
                return Err(QueueError::Format("a word of the queue is damaged"));
            }
        }
    }

    /// A word, if it is whole; does not wait.
    pub(crate) fn glimpse(&self, at: u64) -> io::Result<Option<Word>> {
        for _ in 0..LOOKS {
            let mut bytes = [0; 32];
            self.file.read_exact_at(&mut bytes, at)?;
            let v = |i: usize| u64::from_le_bytes(bytes[8 * i..8 * i + 8].try_into().unwrap_or_default());
            let word = Word { bytes: v(0), records: v(1), beats: v(2) };
            if v(3) == sum(&word) {
                return Ok(Some(word));
            }
        }
        Ok(None)
    }

    /// A word that says where a side is.
    pub(crate) fn position(&self, at: u64) -> Result<Word, QueueError> {
        self.read_word(at)?.checked()
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
    /// Beside the producer's beats: the last record that was written ends its stream.
    const ENDS: u64 = 1 << 63;

    pub(crate) fn checked(self) -> Result<Self, QueueError> {
        if self.bytes.max(self.records) > MOST {
            return Err(QueueError::Format("the queue's words do not fit"));
        }
        Ok(self)
    }

    pub(crate) fn beat(&mut self) {
        self.beats = (self.beats & Word::ENDS) | (self.beats.wrapping_add(1) & !Word::ENDS);
    }

    pub(crate) fn ends(self) -> bool {
        self.beats & Word::ENDS != 0
    }

    pub(crate) fn set_ends(&mut self, ends: bool) {
        self.beats = (self.beats & !Word::ENDS) | if ends { Word::ENDS } else { 0 };
    }

    /// Three numbers in a word.
    pub(crate) fn of_numbers([x, y, z]: [f64; 3]) -> Self {
        Word { bytes: x.to_bits(), records: y.to_bits(), beats: z.to_bits() }
    }

    /// The numbers of [`Word::of_numbers`].
    pub(crate) fn numbers(self) -> [f64; 3] {
        [self.bytes, self.records, self.beats].map(f64::from_bits)
    }
}
