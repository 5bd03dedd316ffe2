//! Streams over TCP: the sender and receiver of records, with answers for a full queue, a refusal
//! and a dropped stream. Secrets and sealed frames are elsewhere.

use std::io;
use std::net::TcpStream;
use std::time::{Duration, Instant};

use thiserror::Error;

use crate::frames::Line;
use crate::handshake::{PATIENCE, answer, call};
use crate::{LONGEST_RECORD, Producer, QueueError};

/// Why a connection ended.
#[derive(Debug, Error)]
pub enum WireError {
    /// The connection broke, or the other side fell silent.
    #[error("connection: {0}")]
    Io(#[from] io::Error),
    /// The other side does not know the secret.
    #[error("the other side does not know the shared secret")]
    Secret,
    /// Somebody else has written into the connection.
    #[error("connection: bytes came that the other side has not sent, or not there")]
    Forged,
    /// The other side speaks something else.
    #[error("connection: {0}")]
    Format(&'static str),
    /// The machine was told to drop this stream.
    #[error("the machine was told to drop this stream")]
    Dropped,
    /// The machine takes another stream.
    #[error("the machine does not take this stream: {0}")]
    Busy(String),
    /// The machine does not take a record.
    #[error("the machine refuses a record: {0}")]
    Refused(String),
    /// The queue at this side cannot be used.
    #[error(transparent)]
    Queue(#[from] QueueError),
}

/// How often a side whose queue is full says that it lives.
const BEAT: Duration = Duration::from_millis(200);
/// Whoever is told that his record is refused has this long to hear it.
const HEARS: Duration = Duration::from_secs(3);
/// No answer of a machine is longer.
pub(crate) const LONGEST_ANSWER: usize = 4096;

/// What a sender's frame begins with: a record follows, or nothing: it asks how far things are.
const RECORD: u8 = 1;
const QUESTION: u8 = 2;

/// What a machine answers to a sender.
#[derive(Debug, Clone, PartialEq)]
enum Answer {
    /// The number of the record that comes next.
    Next(u64),
    /// The queue is full; this side lives.
    StillFull,
    /// It was told to drop the stream.
    Dropped,
    /// It takes another stream.
    Busy(String),
    /// A record makes no sense; none behind it is taken either.
    Refused(String),
}

impl Answer {
    fn encode(&self) -> Vec<u8> {
        let (kind, rest) = match self {
            Answer::Next(next) => (1, next.to_le_bytes().to_vec()),
            Answer::StillFull => (2, Vec::new()),
            Answer::Dropped => (3, Vec::new()),
            Answer::Busy(why) => (4, short(why)),
            Answer::Refused(why) => (5, short(why)),
        };
        [vec![kind], rest].concat()
    }

    fn decode(bytes: &[u8]) -> Option<Answer> {
        let (kind, rest) = bytes.split_first()?;
        let text = || String::from_utf8_lossy(rest).into_owned();
        Some(match kind {
            1 => Answer::Next(u64::from_le_bytes(rest.try_into().ok()?)),
            2 => Answer::StillFull,
            3 => Answer::Dropped,
            4 => Answer::Busy(text()),
            5 => Answer::Refused(text()),
            _ => return None,
        })
    }

    fn say(&self, line: &mut Line) -> io::Result<()> {
        line.say(&self.encode())
    }
}

fn short(text: &str) -> Vec<u8> {
    text.bytes().take(LONGEST_ANSWER - 1).collect()
}

/// Takes the records of one connection into a queue, after the peer has proven the secret and before it has
/// proven anything to nobody. Returns when the peer has gone.
///
/// # Errors
/// The peer does not know the secret, speaks something else, falls silent or sends what makes no sense; the queue cannot be
/// used.
pub fn serve(stream: TcpStream, secret: &[u8], queue: &mut Producer) -> Result<(), WireError> {
    let (line, name) = answer(stream, secret)?;
    receive(line, name, queue, &|| true)
}

/// Tells the peer that the machine does not want its stream.
pub(crate) fn take_leave(line: &mut Line) -> Result<(), WireError> {
    Answer::Dropped.say(line)?;
    Err(WireError::Dropped)
}

/// Tells the peer that the machine takes another stream.
pub(crate) fn turn_away(line: &mut Line, why: String) -> Result<(), WireError> {
    Answer::Busy(why.clone()).say(line)?;
    Err(WireError::Busy(why))
}

/// Takes the records of a stream into the queue while it is `wanted`.
pub(crate) fn receive(
    mut line: Line,
    name: u64,
    queue: &mut Producer,
    wanted: &dyn Fn() -> bool,
) -> Result<(), WireError> {
    let taken = match queue.resume(name) {
        Err(QueueError::Dropped) => take_leave(&mut line),
        Err(why @ (QueueError::Written | QueueError::Unfinished)) => turn_away(&mut line, why.to_string()),
        Ok(begun) => take(&mut line, begun, queue, wanted),
        Err(e) => Err(e.into()),
    };
    let released = queue.release();
    taken?;
    released?;
    Ok(())
}

fn take(
    line: &mut Line,
    begun: u64,
    queue: &mut Producer,
    wanted: &dyn Fn() -> bool,
) -> Result<(), WireError> {
    let first = queue.next() - begun;
    Answer::Next(begun).say(line)?;
    let mut frame = Vec::new();
    loop {
        if !wanted() {
            return Err(WireError::Dropped);
        }
        if !line.hear(&mut frame, 1 + LONGEST_RECORD)? {
            return Ok(());
        }
        match frame.split_first() {
            Some((&RECORD, record)) => match patiently(line, wanted, || queue.push_for(record, BEAT)) {
                Err(WireError::Queue(error @ (QueueError::Record { .. } | QueueError::Format(_)))) => {
                    refuse(line, &error.to_string())?;
                    return Err(error.into());
                }
                other => other?,
            },
            Some((&QUESTION, [])) => {
                patiently(line, wanted, || queue.flush_for(BEAT))?;
                Answer::Next(queue.next() - first).say(line)?;
            }
            _ => return Err(WireError::Format("a frame that makes no sense")),
        }
    }
}

/// Says that a record is refused, and listens until the peer has heard it: whoever goes with words of the peer unheard takes
/// back what he has said.
fn refuse(line: &mut Line, why: &str) -> Result<(), WireError> {
    Answer::Refused(why.to_owned()).say(line)?;
    let begun = Instant::now();
    let mut frame = Vec::new();
    while begun.elapsed() < HEARS && line.hear(&mut frame, 1 + LONGEST_RECORD).is_ok_and(|more| more) {}
    Ok(())
}

/// Tries until it is done; meanwhile the peer is told that this side lives.
fn patiently(
    line: &mut Line,
    wanted: &dyn Fn() -> bool,
    mut attempt: impl FnMut() -> Result<bool, QueueError>,
) -> Result<(), WireError> {
    loop {
        match attempt() {
            Ok(true) => return Ok(()),
            // The consumer may be silent for long: he is waited for.
            Ok(false) | Err(QueueError::Silent(_)) if !wanted() => return Err(WireError::Dropped),
            Ok(false) | Err(QueueError::Silent(_)) => Answer::StillFull.say(line)?,
            Err(e) => return Err(e.into()),
        }
    }
}

/// The sending side of a connection.
#[derive(Debug)]
pub struct Sender {
    line: Line,
    next: u64,
    unasked: usize,
    frame: Vec<u8>,
}

/// Bytes between two questions how far things are, one longer record aside: what a connection holds while the other side
/// does not read, because its queue is full.
const WINDOW: usize = 1 << 15;

impl Sender {
    /// Connects, proves the secret both ways, and goes on with the stream of this name.
    ///
    /// # Errors
    /// There is no connection, the other side does not know the secret, or it does not take this stream.
    pub fn connect(address: &str, secret: &[u8], name: u64) -> Result<Self, WireError> {
        let line = call(address, secret, name)?;
        // The machine may wait for another connection of the same stream to be noticed as broken.
        line.set_patience(2 * PATIENCE)?;
        let mut sender = Sender { line, next: 0, unasked: 0, frame: Vec::new() };
        sender.next = sender.hear()?;
        sender.line.set_patience(PATIENCE)?;
        Ok(sender)
    }

    /// Number of the record that the machine wants next: where to go on after a break.
    #[must_use]
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Sends a record; blocks while the machine's queue is full.
    ///
    /// # Errors
    /// The connection broke: connect again and go on at [`Sender::next`]. Or the machine refused a record.
    pub fn send(&mut self, record: &[u8]) -> Result<(), WireError> {
        if self.unasked > 0 && self.unasked + record.len() > WINDOW {
            self.confirm()?;
        }
        self.frame.clear();
        self.frame.push(RECORD);
        self.frame.extend_from_slice(record);
        self.line.say(&self.frame)?;
        self.unasked += 4 + record.len();
        Ok(())
    }

    /// Waits until everything that was sent is in the machine's queue.
    ///
    /// # Errors
    /// As [`Sender::send`].
    pub fn confirm(&mut self) -> Result<(), WireError> {
        self.line.say(&[QUESTION])?;
        self.next = self.hear()?;
        self.unasked = 0;
        Ok(())
    }

    /// The number of the record that comes next, when the machine says it.
    fn hear(&mut self) -> Result<u64, WireError> {
        loop {
            if !self.line.hear(&mut self.frame, LONGEST_ANSWER)? {
                return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into());
            }
            return match Answer::decode(&self.frame) {
                Some(Answer::Next(next)) => Ok(next),
                Some(Answer::StillFull) => continue,
                Some(Answer::Dropped) => Err(WireError::Dropped),
                Some(Answer::Busy(why)) => Err(WireError::Busy(why)),
                Some(Answer::Refused(why)) => Err(WireError::Refused(why)),
                None => Err(WireError::Format("an answer that makes no sense")),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::{Curve3, KnotVector, Point3, Vector3};
    use claymill_toolpath::MoveKind;

    use super::*;
    use crate::{Consumer, Path, Record};

    /// A record that says its number and is about so long.
    fn record(seq: u64, bytes: usize) -> Vec<u8> {
        let at = |i: u64| Point3::new(i as f64, 0.0, 0.0);
        let axis = Vector3::z();
        let count = 2 + bytes / 32;
        let ends = [at(seq), at(seq + 1)];
        let points = (0..count).map(|i| ends[0] + (ends[1] - ends[0]) * (i as f64 / (count - 1) as f64));
        let inner = (1..count - 1).map(|i| i as f64);
        let knots = [0.0, 0.0].into_iter().chain(inner).chain([(count - 1) as f64; 2]).collect();
        let curve = Curve3::new(KnotVector::new(1, knots).unwrap(), points.collect(), None).unwrap();
        let path = Path { kind: MoveKind::Cut, curve, axis_start: axis, axis_end: axis, feed: 600.0 };
        let mut bytes = Vec::new();
        Record::Path(Box::new(path)).encode(seq, &mut bytes);
        bytes
    }

    #[test]
    fn answers_survive() {
        for answer in [
            Answer::Next(7),
            Answer::StillFull,
            Answer::Dropped,
            Answer::Busy("another".into()),
            Answer::Refused("why".into()),
        ] {
            assert_eq!(Answer::decode(&answer.encode()), Some(answer));
        }
        assert_eq!(Answer::decode(&[9]), None);
        assert_eq!(Answer::decode(&[1, 2]), None);
    }

    #[test]
    fn a_full_queue_is_waited_for_longer_than_silence() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("queue");
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let mut producer = Producer::open(&path, 1 << 16).unwrap();
        let machine =
            std::thread::spawn(move || serve(listener.accept().unwrap().0, b"right", &mut producer));
        let consumer = std::thread::spawn(move || {
            let mut consumer = Consumer::open(&path, 1 << 16).unwrap();
            let mut seq = 0u64;
            while seq < 40 {
                // A long cut with the queue full.
                let until = std::time::Instant::now() + if seq == 3 { 2 * PATIENCE } else { Duration::ZERO };
                while std::time::Instant::now() < until {
                    consumer.beat().unwrap();
                    std::thread::sleep(Duration::from_millis(10));
                }
                if let Ok(Some(bytes)) = consumer.peek() {
                    assert_eq!(Record::decode(bytes).unwrap().0, seq);
                    consumer.done().unwrap();
                    seq += 1;
                }
            }
        });
        let mut sender = Sender::connect(&address, b"right", 5).unwrap();
        for seq in 0..40u64 {
            sender.send(&record(seq, 9000)).unwrap();
        }
        sender.confirm().unwrap();
        assert_eq!(sender.next(), 40);
        consumer.join().unwrap();
        drop(sender);
        machine.join().unwrap().unwrap();
    }

    #[test]
    fn records_cross_and_go_on_after_a_break() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("queue");
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let mut producer = Producer::open(&path, 1 << 20).unwrap();
        let machine = std::thread::spawn(move || {
            let mut results = Vec::new();
            for stream in listener.incoming().take(3) {
                results.push(serve(stream.unwrap(), b"right", &mut producer).is_ok());
            }
            results
        });
        assert!(matches!(Sender::connect(&address, b"wrong", 9), Err(WireError::Secret)));
        for breaks in [true, false] {
            let mut sender = Sender::connect(&address, b"right", 9).unwrap();
            for seq in sender.next()..1000 {
                sender.send(&record(seq, 0)).unwrap();
                if breaks && seq == 600 {
                    sender.confirm().unwrap();
                    break;
                }
            }
            if !breaks {
                sender.confirm().unwrap();
                assert_eq!(sender.next(), 1000);
            }
        }
        assert_eq!(machine.join().unwrap(), [false, true, true]);
        let mut consumer = Consumer::open(&path, 1 << 20).unwrap();
        for seq in 0..1000u64 {
            assert_eq!(consumer.peek().unwrap().unwrap(), record(seq, 0));
            consumer.done().unwrap();
        }
    }
}
