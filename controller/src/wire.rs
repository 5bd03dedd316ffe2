use std::fs::File;
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use sha2::{Digest, Sha256};
use thiserror::Error;

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
    /// The other side speaks something else.
    #[error("connection: {0}")]
    Format(&'static str),
    /// The machine was told to drop this stream.
    #[error("the machine was told to drop this stream")]
    Dropped,
    /// The queue at this side cannot be used.
    #[error(transparent)]
    Queue(#[from] QueueError),
}

const HELLO: &[u8; 16] = b"claymill stream1";
/// A side that says nothing for this long is gone.
const PATIENCE: Duration = Duration::from_millis(900);
/// How often a side whose queue is full says that it lives.
const BEAT: Duration = Duration::from_millis(200);
/// What it says then, in place of how far things are.
const STILL_FULL: u64 = u64::MAX;
/// What it says to whoever sends a stream that it was told to drop.
const DROPPED: u64 = u64::MAX - 1;
const NONCE: usize = 32;
const PROOF: usize = 32;
/// What a machine answers to a wrong proof, in place of its own: silence would look like a machine that has left.
const REFUSED: [u8; PROOF] = [0; PROOF];

/// HMAC with SHA-256 (RFC 2104).
fn proof(secret: &[u8], parts: &[&[u8]]) -> [u8; PROOF] {
    let mut key = [0u8; 64];
    if secret.len() > key.len() {
        key[..PROOF].copy_from_slice(&Sha256::digest(secret));
    } else {
        key[..secret.len()].copy_from_slice(secret);
    }
    let mut inner = Sha256::new();
    inner.update(key.map(|b| b ^ 0x36));
    parts.iter().for_each(|p| inner.update(p));
    let mut outer = Sha256::new();
    outer.update(key.map(|b| b ^ 0x5c));
    outer.update(inner.finalize());
    outer.finalize().into()
}

/// Compares in the same time wherever the difference is.
fn same(a: &[u8; PROOF], b: &[u8; PROOF]) -> bool {
    a.iter().zip(b).fold(0, |d, (x, y)| d | (x ^ y)) == 0
}

fn nonce() -> io::Result<[u8; NONCE]> {
    let mut bytes = [0; NONCE];
    File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn prepare(stream: &TcpStream) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))
}

/// Takes the records of one connection into a queue, after the peer has proven the secret and before it has
/// proven anything to nobody. Returns when the peer has gone.
///
/// # Errors
/// The peer does not know the secret, speaks something else or falls silent; the queue cannot be used.
pub fn serve(mut stream: TcpStream, secret: &[u8], queue: &mut Producer) -> Result<(), WireError> {
    let name = answer(&mut stream, secret)?;
    receive(stream, name, queue, &|| true)
}

/// The machine's part of proving the secret both ways; returns the connection's name.
pub(crate) fn answer(stream: &mut TcpStream, secret: &[u8]) -> Result<u64, WireError> {
    prepare(stream)?;
    let mine = nonce()?;
    stream.write_all(HELLO)?;
    stream.write_all(&mine)?;
    let (mut theirs, mut claim) = ([0; NONCE], [0; PROOF]);
    stream.read_exact(&mut theirs)?;
    stream.read_exact(&mut claim)?;
    if !same(&claim, &proof(secret, &[b"sender", &mine, &theirs])) {
        stream.write_all(&REFUSED)?;
        return Err(WireError::Secret);
    }
    stream.write_all(&proof(secret, &[b"machine", &theirs, &mine]))?;
    let mut name = [0; 8];
    stream.read_exact(&mut name)?;
    Ok(u64::from_le_bytes(name))
}

/// Tells the peer that the machine does not want its stream.
pub(crate) fn take_leave(stream: &mut TcpStream) -> io::Result<()> {
    stream.write_all(&DROPPED.to_le_bytes())
}

/// Takes the records of a stream into the queue while it is `wanted`.
pub(crate) fn receive(
    mut stream: TcpStream,
    name: u64,
    queue: &mut Producer,
    wanted: &dyn Fn() -> bool,
) -> Result<(), WireError> {
    let begun = match queue.resume(name) {
        Err(QueueError::Dropped) => {
            take_leave(&mut stream)?;
            return Err(WireError::Dropped);
        }
        other => other?,
    };
    let first = queue.next() - begun;
    stream.write_all(&begun.to_le_bytes())?;
    let mut record = Vec::new();
    loop {
        if !wanted() {
            return Err(WireError::Dropped);
        }
        let mut head = [0; 4];
        match stream.read_exact(&mut head) {
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => return Ok(()),
            other => other?,
        }
        let length = u32::from_le_bytes(head) as usize;
        if length > LONGEST_RECORD {
            return Err(WireError::Format("a record that is too long"));
        }
        if length > 0 {
            record.resize(length, 0);
            stream.read_exact(&mut record)?;
            patiently(&mut stream, wanted, || queue.push_for(&record, BEAT))?;
        } else {
            // An empty frame asks how far things are.
            patiently(&mut stream, wanted, || queue.flush_for(BEAT))?;
            stream.write_all(&(queue.next() - first).to_le_bytes())?;
        }
    }
}

/// Tries until it is done; meanwhile the peer is told that this side lives.
fn patiently(
    stream: &mut TcpStream,
    wanted: &dyn Fn() -> bool,
    mut attempt: impl FnMut() -> Result<bool, QueueError>,
) -> Result<(), WireError> {
    loop {
        match attempt() {
            Ok(true) => return Ok(()),
            // The consumer may be silent for long: he is waited for.
            Ok(false) | Err(QueueError::Silent(_)) if !wanted() => return Err(WireError::Dropped),
            Ok(false) | Err(QueueError::Silent(_)) => stream.write_all(&STILL_FULL.to_le_bytes())?,
            Err(e) => return Err(e.into()),
        }
    }
}

/// Connects, proves the secret both ways, and says what the connection is for.
pub(crate) fn call(address: &str, secret: &[u8], name: u64) -> Result<TcpStream, WireError> {
    let mut stream = TcpStream::connect(address)?;
    prepare(&stream)?;
    let mut hello = [0; HELLO.len()];
    stream.read_exact(&mut hello)?;
    if hello != *HELLO {
        return Err(WireError::Format("the other side is no machine of claymill"));
    }
    let (mut theirs, mine) = ([0; NONCE], nonce()?);
    stream.read_exact(&mut theirs)?;
    stream.write_all(&mine)?;
    stream.write_all(&proof(secret, &[b"sender", &theirs, &mine]))?;
    let mut claim = [0; PROOF];
    stream.read_exact(&mut claim)?;
    if !same(&claim, &proof(secret, &[b"machine", &mine, &theirs])) {
        return Err(WireError::Secret);
    }
    stream.write_all(&name.to_le_bytes())?;
    Ok(stream)
}

/// The sending side of a connection.
#[derive(Debug)]
pub struct Sender {
    stream: TcpStream,
    next: u64,
    unasked: usize,
}

/// Bytes between two questions how far things are, one longer record aside: what a connection holds while the other side
/// does not read, because its queue is full.
const WINDOW: usize = 1 << 15;

impl Sender {
    /// Connects, proves the secret both ways, and goes on with the stream of this name.
    ///
    /// # Errors
    /// There is no connection, or the other side does not know the secret.
    pub fn connect(address: &str, secret: &[u8], name: u64) -> Result<Self, WireError> {
        let mut stream = call(address, secret, name)?;
        let mut next = [0; 8];
        stream.read_exact(&mut next)?;
        match u64::from_le_bytes(next) {
            DROPPED => Err(WireError::Dropped),
            next => Ok(Sender { stream, next, unasked: 0 }),
        }
    }

    /// Number of the record that the machine wants next: where to go on after a break.
    #[must_use]
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Sends a record; blocks while the machine's queue is full.
    ///
    /// # Errors
    /// The connection broke: connect again and go on at [`Sender::next`].
    pub fn send(&mut self, record: &[u8]) -> Result<(), WireError> {
        if self.unasked > 0 && self.unasked + record.len() > WINDOW {
            self.confirm()?;
        }
        self.stream.write_all(&(record.len() as u32).to_le_bytes())?;
        self.stream.write_all(record)?;
        self.unasked += 4 + record.len();
        Ok(())
    }

    /// Waits until everything that was sent is in the machine's queue.
    ///
    /// # Errors
    /// As [`Sender::send`].
    pub fn confirm(&mut self) -> Result<(), WireError> {
        self.stream.write_all(&0u32.to_le_bytes())?;
        let mut next = [0; 8];
        loop {
            self.stream.read_exact(&mut next)?;
            self.next = match u64::from_le_bytes(next) {
                STILL_FULL => continue,
                next => next,
            };
            self.unasked = 0;
            return Ok(());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Consumer;

    #[test]
    fn proofs_are_hmac_sha256() {
        // RFC 4231, test cases 2 and 6.
        let hex = |b: [u8; PROOF]| b.iter().map(|x| format!("{x:02x}")).collect::<String>();
        assert_eq!(
            hex(proof(b"Jefe", &[b"what do ya want ", b"for nothing?"])),
            "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843"
        );
        assert_eq!(
            hex(proof(&[0xaa; 131], &[b"Test Using Larger Than Block-Size Key - Hash Key First"])),
            "60e431591ee0b67f0d8a26aacbf5b77f8e0bc6213728c5140546040f0ee37f54"
        );
    }

    #[test]
    fn a_machine_that_leaves_is_not_taken_for_one_with_another_secret() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let machine = std::thread::spawn(move || {
            // It leaves after its greeting and everything that the caller says.
            let (mut stream, _) = listener.accept().unwrap();
            stream.write_all(HELLO).unwrap();
            stream.write_all(&[7; NONCE]).unwrap();
            stream.read_exact(&mut [0; NONCE + PROOF]).unwrap();
        });
        assert!(matches!(call(&address, b"right", 1), Err(WireError::Io(_))));
        machine.join().unwrap();
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
                    assert_eq!(bytes[..8], seq.to_le_bytes());
                    consumer.done().unwrap();
                    seq += 1;
                }
            }
        });
        let mut sender = Sender::connect(&address, b"right", 5).unwrap();
        for seq in 0..40u64 {
            let mut record = vec![0; 9000];
            record[..8].copy_from_slice(&seq.to_le_bytes());
            sender.send(&record).unwrap();
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
                sender.send(&seq.to_le_bytes()).unwrap();
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
            assert_eq!(consumer.peek().unwrap().unwrap(), seq.to_le_bytes());
            consumer.done().unwrap();
        }
    }
}
