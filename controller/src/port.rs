use std::collections::BTreeSet;
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::wire::{answer, call, receive, take_leave};
use crate::{Order, Panel, Producer, Status, WireError};

/// The name of a connection that brings orders; streams have others.
const ORDERS: u64 = 0;
/// A machine that is told to drop what waits comes to rest within this time.
const BRAKES: Duration = Duration::from_secs(20);
const NAP: Duration = Duration::from_millis(2);

/// The machine's side of connections: one stream at a time goes into its queue, and orders come beside it.
#[derive(Debug)]
pub struct Port {
    queue: Mutex<Producer>,
    panel: Arc<Panel>,
    /// Streams that were dropped: whoever still sends one is told so.
    dropped: Mutex<BTreeSet<u64>>,
    /// Counts orders to drop what waits: a stream that sees it change ends.
    drops: AtomicU64,
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
            dropped: Mutex::default(),
            drops: AtomicU64::new(0),
            closed: Mutex::default(),
        }
    }

    /// Takes no more orders; waits until the one that ended the machine, if one did, has been answered.
    pub fn close(&self) {
        *locked(&self.closed) = true;
    }

    /// Serves one connection until the peer has gone: a stream, or orders.
    ///
    /// # Errors
    /// The peer does not know the secret, speaks something else or falls silent; the queue cannot be used; what
    /// it sends was dropped.
    pub fn serve(&self, mut stream: TcpStream, secret: &[u8]) -> Result<(), WireError> {
        let name = answer(&mut stream, secret)?;
        if name == ORDERS {
            return self.orders(stream);
        }
        let drops = self.drops.load(Ordering::SeqCst);
        let wanted = || self.drops.load(Ordering::SeqCst) == drops;
        let mut queue = locked(&self.queue);
        if !wanted() || locked(&self.dropped).contains(&name) {
            take_leave(&mut stream)?;
            return Err(WireError::Dropped);
        }
        receive(stream, name, &mut queue, &wanted)
    }

    /// One byte an order, 0 for none; each is answered with the machine's status.
    fn orders(&self, mut stream: TcpStream) -> Result<(), WireError> {
        loop {
            let mut byte = [0];
            match stream.read_exact(&mut byte) {
                Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => return Ok(()),
                other => other?,
            }
            let order = Order::of_byte(byte[0]).ok_or(WireError::Format("no order"))?;
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
            stream.write_all(&self.panel.status().encode())?;
        }
    }

    /// Ends the stream that is being received, and has the machine drop what waits in the queue.
    fn discard(&self) -> Result<(), WireError> {
        self.drops.fetch_add(1, Ordering::SeqCst);
        // Nothing new comes before the machine has done it.
        let mut queue = locked(&self.queue);
        locked(&self.dropped).insert(queue.abandon()?);
        let before = self.panel.status().discards;
        self.panel.tell(Order::Discard);
        let begun = Instant::now();
        while self.panel.status().discards == before {
            if begun.elapsed() > BRAKES {
                return Err(WireError::Format("the machine does not come to rest"));
            }
            queue.beat()?;
            std::thread::sleep(NAP);
        }
        Ok(())
    }
}

/// Gives a machine an order, or none, and returns its status: after [`Order::Discard`] when that has been done, else
/// at once.
///
/// # Errors
/// There is no connection, or the other side does not know the secret.
pub fn tell(address: &str, secret: &[u8], order: Option<Order>) -> Result<Status, WireError> {
    let mut stream = call(address, secret, ORDERS)?;
    if order == Some(Order::Discard) {
        stream.set_read_timeout(Some(BRAKES + Duration::from_secs(2)))?;
    }
    stream.write_all(&[Order::byte(order)])?;
    let mut bytes = [0; Status::BYTES];
    stream.read_exact(&mut bytes)?;
    Status::decode(&bytes).ok_or(WireError::Format("a status that makes no sense"))
}
