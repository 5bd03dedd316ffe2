//! The machine's side of TCP connections: one stream at a time goes into its queue, orders come
//! beside it. Also the client call that gives an order.

use std::collections::{BTreeSet, VecDeque};
use std::io;
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::frames::Line;
use crate::handshake::{HANDSHAKE, answer, call};
use crate::wire::{LONGEST_ANSWER, receive, take_leave, turn_away};
use crate::{Order, Panel, Producer, Status, WireError};

/// The name of a connection that brings orders; streams have others.
const ORDERS: u64 = 0;
/// A machine that is told to drop what waits comes to rest within this time.
const BRAKES: Duration = Duration::from_secs(20);
const NAP: Duration = Duration::from_millis(2);
/// So many connections may be about to prove that they know the secret; the oldest one goes for another one more.
const STRANGERS: usize = 64;
/// An order that meets no machine, or is pushed out at its door, is tried again within this time.
const TRIES: Duration = Duration::from_secs(4);
const TRIES_AGAIN: Duration = Duration::from_millis(50);

/// The machine's side of connections: one stream at a time goes into its queue, and orders come beside it.
#[derive(Debug)]
pub struct Port {
    queue: Mutex<Producer>,
    panel: Arc<Panel>,
    /// The stream that is being received.
    receives: Mutex<Option<u64>>,
    /// Streams that were dropped: whoever still sends one is told so.
    dropped: Mutex<BTreeSet<u64>>,
    /// Counts orders to drop what waits: a stream that sees it change ends.
    drops: AtomicU64,
    /// Connections that have proven nothing yet, the oldest first.
    strangers: Mutex<VecDeque<(u64, TcpStream)>>,
    /// Whether the machine has left; held from an order until its answer is on the way.
    closed: Mutex<bool>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A connection that panicked leaves the queue as it is after any kill: usable.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Port {
    /// A port into `queue`, with orders to `panel`.
    #[must_use]
    pub fn new(queue: Producer, panel: Arc<Panel>) -> Self {
        Port {
            queue: Mutex::new(queue),
            panel,
            receives: Mutex::default(),
            dropped: Mutex::default(),
            drops: AtomicU64::new(0),
            strangers: Mutex::default(),
            closed: Mutex::default(),
        }
    }

    /// Takes no more orders; waits until the one that ended the machine, if one did, has been answered.
    pub fn close(&self) {
        *locked(&self.closed) = true;
    }

    /// Takes connections for ever, each on a thread of its own; `report` gets what went wrong on one.
    pub fn listen(
        self: Arc<Self>,
        listener: &TcpListener,
        secret: &Arc<[u8]>,
        report: impl Fn(WireError) + Clone + Send + 'static,
    ) {
        for number in 0.. {
            let Ok((stream, _)) = listener.accept() else {
                // Nothing is left to open it with; that passes as strangers go.
                std::thread::sleep(NAP);
                continue;
            };
            self.admit(number, &stream);
            let (port, secret, report) = (Arc::clone(&self), Arc::clone(secret), report.clone());
            let serve = move || {
                if let Err(error) = port.serve(number, stream, &secret) {
                    report(error);
                }
            };
            // Without a thread the connection is closed.
            if std::thread::Builder::new().spawn(serve).is_err() {
                self.knows(number);
            }
        }
    }

    /// Lets a connection in that has proven nothing yet; the oldest one goes where there are too many.
    fn admit(&self, number: u64, stream: &TcpStream) {
        let mut strangers = locked(&self.strangers);
        if let Ok(stream) = stream.try_clone() {
            strangers.push_back((number, stream));
        }
        if strangers.len() > STRANGERS
            && let Some((_, oldest)) = strangers.pop_front()
        {
            // Its thread notices, and ends.
            let _ = oldest.shutdown(Shutdown::Both);
        }
    }

    /// The connection has proven itself, or has gone.
    fn knows(&self, number: u64) {
        locked(&self.strangers).retain(|(n, _)| *n != number);
    }

    /// Serves one connection until the peer has gone: a stream, or orders.
    fn serve(&self, number: u64, stream: TcpStream, secret: &[u8]) -> Result<(), WireError> {
        let answered = answer(stream, secret);
        self.knows(number);
        let (mut line, name) = answered?;
        if name == ORDERS {
            return self.orders(line);
        }
        let drops = self.drops.load(Ordering::SeqCst);
        let wanted = || self.drops.load(Ordering::SeqCst) == drops;
        // A broken connection of the same stream is waited for, another stream is not.
        if locked(&self.receives).is_some_and(|other| other != name) {
            return turn_away(&mut line, "another one is being received".into());
        }
        let mut queue = locked(&self.queue);
        if !wanted() || locked(&self.dropped).contains(&name) {
            return take_leave(&mut line);
        }
        *locked(&self.receives) = Some(name);
        let received = receive(line, name, &mut queue, &wanted);
        *locked(&self.receives) = None;
        received
    }

    /// Orders, each answered with the machine's status.
    fn orders(&self, mut line: Line) -> Result<(), WireError> {
        let mut frame = Vec::new();
        let mut number = 0;
        while line.hear(&mut frame, Request::BYTES)? {
            let request = Request::decode(&frame).ok_or(WireError::Format("no order"))?;
            if request.number != number {
                return Err(WireError::Format("an order that is not the next one"));
            }
            number += 1;
            let order = request.order;
            if order == Some(Order::Discard) {
                self.discard()?;
            }
            let closed = locked(&self.closed);
            if *closed {
                return Ok(());
            }
            if let Some(order) = order.filter(|o| *o != Order::Discard) {
                self.panel.tell(order);
            }
            line.say(&[&request.number.to_le_bytes()[..], &self.panel.status().encode()].concat())?;
        }
        Ok(())
    }

    /// Ends the stream that is being received, and has the machine drop what waits in the queue.
    fn discard(&self) -> Result<(), WireError> {
        self.drops.fetch_add(1, Ordering::SeqCst);
        // The machine brakes at once; the stream that is being received ends meanwhile, and nothing new comes before the
        // machine has dropped everything.
        let before = self.panel.status().discards;
        self.panel.tell(Order::Hold);
        let mut queue = locked(&self.queue);
        // A queue that is damaged is dropped all the same.
        locked(&self.dropped).extend(queue.abandon());
        let _ = queue.release();
        self.panel.tell(Order::Discard);
        let begun = Instant::now();
        while self.panel.status().discards == before {
            if self.panel.order() != Order::Discard {
                // Another order came, or it could not be done: the status says which.
                return Ok(());
            }
            if begun.elapsed() > BRAKES {
                return Err(WireError::Format("the machine does not come to rest"));
            }
            std::thread::sleep(NAP);
        }
        Ok(())
    }
}

/// An order in a connection, or none.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Request {
    /// Its number in the connection, from 0.
    number: u64,
    order: Option<Order>,
}

impl Request {
    /// Version u8, order u8, number u64, CRC-32 of these.
    const BYTES: usize = 14;
    const VERSION: u8 = 2;

    fn encode(self) -> Vec<u8> {
        let mut bytes = vec![Request::VERSION, Order::byte(self.order)];
        bytes.extend(self.number.to_le_bytes());
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        bytes
    }

    fn decode(bytes: &[u8]) -> Option<Request> {
        let (fields, sum) = bytes.split_at_checked(Request::BYTES - 4)?;
        if sum != crc32fast::hash(fields).to_le_bytes() || fields[0] != Request::VERSION {
            return None;
        }
        let number = u64::from_le_bytes(fields[2..].try_into().ok()?);
        Some(Request { number, order: Order::of_byte(fields[1])? })
    }
}

/// Gives a machine an order, or none, and returns its status: after [`Order::Discard`] when that has been done, else
/// at once.
///
/// # Errors
/// There is no connection, or the other side does not know the secret.
pub fn tell(address: &str, secret: &[u8], order: Option<Order>) -> Result<Status, WireError> {
    let mut line = reach(address, secret)?;
    if order == Some(Order::Discard) {
        line.set_patience(BRAKES + HANDSHAKE)?;
    }
    let request = Request { number: 0, order };
    line.say(&request.encode())?;
    let mut bytes = Vec::new();
    if !line.hear(&mut bytes, LONGEST_ANSWER)? {
        return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into());
    }
    let answer = bytes.split_at_checked(8).filter(|(number, _)| *number == request.number.to_le_bytes());
    answer
        .and_then(|(_, status)| Status::decode(status))
        .ok_or(WireError::Format("a status that makes no sense"))
}

/// Reaches the machine, also where many strangers crowd at its door: nothing was said yet, so that trying again is safe.
fn reach(address: &str, secret: &[u8]) -> Result<Line, WireError> {
    let begun = Instant::now();
    loop {
        match call(address, secret, ORDERS) {
            Err(WireError::Io(e))
                if e.kind() != io::ErrorKind::ConnectionRefused && begun.elapsed() < TRIES =>
            {
                std::thread::sleep(TRIES_AGAIN);
            }
            other => return other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_survive_and_damaged_ones_are_none() {
        for order in [None, Some(Order::Hold), Some(Order::Discard)] {
            let request = Request { number: 3, order };
            let bytes = request.encode();
            assert_eq!(bytes.len(), Request::BYTES);
            assert_eq!(Request::decode(&bytes), Some(request));
            for bit in 0..8 * bytes.len() {
                let mut damaged = bytes.clone();
                damaged[bit / 8] ^= 1 << (bit % 8);
                assert_eq!(Request::decode(&damaged), None);
            }
        }
    }
}
