//! Frames of a connection behind its handshake: none can be changed, left out, repeated or brought in by anybody else.

use std::io::{self, BufReader, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use hmac::Mac;

use crate::WireError;
use crate::handshake::Seal;

/// Bytes of a frame's seal.
const SEAL: usize = 32;

/// A connection between two sides that know each other. A frame: length u32, that many bytes, and the HMAC-SHA256 of the
/// frame's number in its direction (u64), its length and its bytes under the direction's key.
pub(crate) struct Line {
    stream: BufReader<TcpStream>,
    ours: Direction,
    theirs: Direction,
    frame: Vec<u8>,
}

impl std::fmt::Debug for Line {
    /// Without the keys.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Line").field("peer", &self.stream.get_ref().peer_addr()).finish_non_exhaustive()
    }
}

struct Direction {
    /// The seal before anything was put under it.
    key: Seal,
    frames: u64,
}

impl Direction {
    /// The seal of the next frame.
    fn next(&mut self, length: [u8; 4], bytes: &[u8]) -> Seal {
        let mut seal = self.key.clone();
        seal.update(&self.frames.to_le_bytes());
        seal.update(&length);
        seal.update(bytes);
        self.frames += 1;
        seal
    }
}

impl Line {
    pub(crate) fn new(stream: TcpStream, ours: Seal, theirs: Seal) -> Self {
        let direction = |key| Direction { key, frames: 0 };
        let [ours, theirs] = [ours, theirs].map(direction);
        Line { stream: BufReader::new(stream), ours, theirs, frame: Vec::new() }
    }

    /// Sends a frame.
    pub(crate) fn say(&mut self, bytes: &[u8]) -> io::Result<()> {
        let length = (bytes.len() as u32).to_le_bytes();
        let seal = self.ours.next(length, bytes).finalize().into_bytes();
        self.frame.clear();
        self.frame.extend(length);
        self.frame.extend_from_slice(bytes);
        self.frame.extend_from_slice(&seal);
        self.stream.get_mut().write_all(&self.frame)
    }

    /// Reads a frame of no more than `longest` bytes; `false` where the peer has gone before it began.
    ///
    /// # Errors
    /// The connection broke, or these are not the bytes that the peer sent next.
    pub(crate) fn hear(&mut self, bytes: &mut Vec<u8>, longest: usize) -> Result<bool, WireError> {
        let mut length = [0; 4];
        match self.stream.read_exact(&mut length) {
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => return Ok(false),
            other => other?,
        }
        let count = u32::from_le_bytes(length) as usize;
        if count > longest {
            return Err(WireError::Format("a frame that is too long"));
        }
        bytes.resize(count, 0);
        self.stream.read_exact(bytes)?;
        let mut seal = [0; SEAL];
        self.stream.read_exact(&mut seal)?;
        match self.theirs.next(length, bytes).verify_slice(&seal) {
            Ok(()) => Ok(true),
            Err(_) => Err(WireError::Forged),
        }
    }

    pub(crate) fn set_patience(&self, patience: Duration) -> io::Result<()> {
        self.stream.get_ref().set_read_timeout(Some(patience))
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;
    use crate::handshake::seal;

    /// Both ends of a line, with somebody between them who may change what goes from the first to the second.
    fn between(
        change: impl Fn(Vec<Vec<u8>>) -> Vec<Vec<u8>>,
        frames: &[&[u8]],
    ) -> Vec<Result<Vec<u8>, String>> {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let connect = || {
            let near = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
            (near, listener.accept().unwrap().0)
        };
        let [(near, mut caught), (mut on, far)] = [connect(), connect()];
        let [a, b] = [b"a", b"b"].map(|key| seal(key, &[]).unwrap());
        let mut speaker = Line::new(near, a.clone(), b.clone());
        let mut sent = Vec::new();
        for frame in frames {
            speaker.say(frame).unwrap();
            let mut bytes = vec![0; 4 + frame.len() + SEAL];
            caught.read_exact(&mut bytes).unwrap();
            sent.push(bytes);
        }
        change(sent).iter().for_each(|bytes| on.write_all(bytes).unwrap());
        drop(on);
        let mut listener = Line::new(far, b, a);
        let mut heard = Vec::new();
        loop {
            let mut bytes = Vec::new();
            match listener.hear(&mut bytes, 100) {
                Ok(true) => heard.push(Ok(bytes)),
                Ok(false) => return heard,
                Err(e) => {
                    heard.push(Err(e.to_string()));
                    return heard;
                }
            }
        }
    }

    #[test]
    fn frames_arrive_as_they_were_sent_or_not_at_all() {
        let frames: [&[u8]; 3] = [b"one", b"", b"three"];
        let whole: Vec<_> = frames.iter().map(|f| Ok(f.to_vec())).collect();
        assert_eq!(between(|sent| sent, &frames), whole);
        let forged = Err(WireError::Forged.to_string());
        // Left out, repeated, exchanged: the first one that is not in its place ends the line.
        let left_out = between(|sent| vec![sent[0].clone(), sent[2].clone()], &frames);
        assert_eq!(left_out, [whole[0].clone(), forged.clone()]);
        let repeated = between(|sent| vec![sent[0].clone(), sent[0].clone()], &frames);
        assert_eq!(repeated, [whole[0].clone(), forged.clone()]);
        // Any bit of a frame.
        for bit in 32..8 * (4 + 3 + SEAL) {
            let changed = between(
                |mut sent| {
                    sent[0][bit / 8] ^= 1 << (bit % 8);
                    sent
                },
                &frames,
            );
            assert_eq!(changed, std::slice::from_ref(&forged), "bit {bit}");
        }
        let longer = between(|_| vec![101u32.to_le_bytes().to_vec(), vec![0; 200]], &frames);
        assert_eq!(longer.len(), 1);
        assert!(longer[0].is_err());
    }
}
