//! How two sides of a connection prove to each other that they know a secret, within a time that nobody can stretch.

use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use hmac::{Hmac, Mac};
use sha2::Sha256;

use crate::WireError;
use crate::frames::Line;

/// What a machine says first; the last byte is the version of all that follows.
const HELLO: &[u8; 16] = b"claymill stream2";
/// The whole handshake takes no longer, however its bytes drip.
pub(crate) const HANDSHAKE: Duration = Duration::from_secs(2);
/// A side that says nothing for this long is gone.
pub(crate) const PATIENCE: Duration = Duration::from_millis(900);
const NONCE: usize = 32;
const PROOF: usize = 32;
/// What a machine answers to a wrong proof, in place of its own: silence would look like a machine that has left.
const REFUSED: [u8; PROOF] = [0; PROOF];

/// HMAC with SHA-256 (RFC 2104), to be fed or asked.
pub(crate) type Seal = Hmac<Sha256>;

/// A seal under a key, over parts of known lengths.
pub(crate) fn seal(key: &[u8], parts: &[&[u8]]) -> Result<Seal, WireError> {
    let mut seal = Seal::new_from_slice(key).map_err(|_| WireError::Format("the secret is no key"))?;
    parts.iter().for_each(|p| seal.update(p));
    Ok(seal)
}

fn nonce() -> io::Result<[u8; NONCE]> {
    let mut bytes = [0; NONCE];
    getrandom::fill(&mut bytes)?;
    Ok(bytes)
}

/// Reads all of `bytes` before the `deadline`.
fn read_by(stream: &mut TcpStream, bytes: &mut [u8], deadline: Instant) -> io::Result<()> {
    let mut have = 0;
    while have < bytes.len() {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(io::Error::new(
                io::ErrorKind::TimedOut,
                "the other side takes too long to prove itself",
            ));
        }
        stream.set_read_timeout(Some(left))?;
        match stream.read(&mut bytes[have..]) {
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => have += count,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(())
}

/// The line that both sides go on with: a key for each direction, which only those have who know the secret, and which this
/// connection alone uses.
fn line(stream: TcpStream, secret: &[u8], nonces: [&[u8]; 2], machine: bool) -> Result<Line, WireError> {
    stream.set_read_timeout(Some(PATIENCE))?;
    let key = |name: &[u8]| -> Result<_, WireError> {
        Ok(seal(secret, &[name, nonces[0], nonces[1]])?.finalize().into_bytes())
    };
    let [ours, theirs] = match machine {
        true => [key(b"from the machine")?, key(b"to the machine")?],
        false => [key(b"to the machine")?, key(b"from the machine")?],
    };
    Ok(Line::new(stream, seal(&ours, &[])?, seal(&theirs, &[])?))
}

/// The machine's part; it tells nothing before the peer has proven that it knows the secret. Returns the line, and the
/// name of what comes on it.
pub(crate) fn answer(mut stream: TcpStream, secret: &[u8]) -> Result<(Line, u64), WireError> {
    let deadline = Instant::now() + HANDSHAKE;
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let mine = nonce()?;
    stream.write_all(HELLO)?;
    stream.write_all(&mine)?;
    let (mut theirs, mut claim, mut name) = ([0; NONCE], [0; PROOF], [0; 8]);
    read_by(&mut stream, &mut theirs, deadline)?;
    read_by(&mut stream, &mut name, deadline)?;
    read_by(&mut stream, &mut claim, deadline)?;
    if seal(secret, &[b"sender", &mine, &theirs, &name])?.verify_slice(&claim).is_err() {
        stream.write_all(&REFUSED)?;
        return Err(WireError::Secret);
    }
    stream.write_all(&seal(secret, &[b"machine", &theirs, &mine, &name])?.finalize().into_bytes())?;
    Ok((line(stream, secret, [&mine, &theirs], true)?, u64::from_le_bytes(name)))
}

/// Connects, proves the secret both ways, and says what the connection is for.
pub(crate) fn call(address: &str, secret: &[u8], name: u64) -> Result<Line, WireError> {
    let mut stream = connect(address)?;
    let deadline = Instant::now() + HANDSHAKE;
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let mut hello = [0; HELLO.len()];
    read_by(&mut stream, &mut hello, deadline)?;
    if hello != *HELLO {
        let kin = hello[..HELLO.len() - 1] == HELLO[..HELLO.len() - 1];
        return Err(WireError::Format(if kin {
            "the machine there is of another version of claymill"
        } else {
            "the other side is no machine of claymill"
        }));
    }
    let (mut theirs, mine, name) = ([0; NONCE], nonce()?, name.to_le_bytes());
    read_by(&mut stream, &mut theirs, deadline)?;
    let claim = seal(secret, &[b"sender", &theirs, &mine, &name])?.finalize().into_bytes();
    stream.write_all(&[&mine[..], &name, &claim].concat())?;
    let mut claim = [0; PROOF];
    read_by(&mut stream, &mut claim, deadline)?;
    if seal(secret, &[b"machine", &mine, &theirs, &name])?.verify_slice(&claim).is_err() {
        return Err(WireError::Secret);
    }
    line(stream, secret, [&theirs, &mine], false)
}

fn connect(address: &str) -> io::Result<TcpStream> {
    let mut last = io::Error::new(io::ErrorKind::NotFound, "the address has no host");
    for place in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&place, HANDSHAKE) {
            Ok(stream) => return Ok(stream),
            Err(e) => last = e,
        }
    }
    Err(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seals_are_hmac_sha256() {
        // RFC 4231, test cases 2 and 6.
        let hex =
            |seal: Seal| seal.finalize().into_bytes().iter().map(|x| format!("{x:02x}")).collect::<String>();
        assert_eq!(
            hex(seal(b"Jefe", &[b"what do ya want ", b"for nothing?"]).unwrap()),
            "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843"
        );
        assert_eq!(
            hex(seal(&[0xaa; 131], &[b"Test Using Larger Than Block-Size Key - Hash Key First"]).unwrap()),
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
            stream.read_exact(&mut [0; NONCE + 8 + PROOF]).unwrap();
        });
        assert!(matches!(call(&address, b"right", 1), Err(WireError::Io(_))));
        machine.join().unwrap();
    }

    #[test]
    fn a_machine_of_an_earlier_version_is_refused_by_name() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let machine = std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().unwrap();
            stream.write_all(b"claymill stream1").unwrap();
            let _ = stream.read(&mut [0]);
        });
        let refused = call(&address, b"right", 1).unwrap_err().to_string();
        assert!(refused.contains("another version"), "{refused}");
        machine.join().unwrap();
    }

    #[test]
    fn no_nonce_comes_twice() {
        let nonces: Vec<[u8; NONCE]> = (0..100).map(|_| nonce().unwrap()).collect();
        let different: std::collections::BTreeSet<_> = nonces.iter().filter(|n| **n != [0; NONCE]).collect();
        assert_eq!(different.len(), nonces.len());
    }

    #[test]
    fn bytes_that_drip_do_not_stretch_the_handshake() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let dripping = std::thread::spawn(move || {
            let mut stream = TcpStream::connect(address).unwrap();
            // Sixty-four bytes would take 13 s.
            while stream.write_all(&[1]).is_ok() {
                std::thread::sleep(Duration::from_millis(200));
            }
        });
        let begun = Instant::now();
        let ended = answer(listener.accept().unwrap().0, b"right");
        assert!(matches!(ended, Err(WireError::Io(_))));
        drop(ended);
        assert!(begun.elapsed() < HANDSHAKE + Duration::from_millis(500), "{:?}", begun.elapsed());
        dripping.join().unwrap();
    }
}
