//! Where the time goes: what the crates say of their work, as a trace that `ui.perfetto.dev` and Chrome draw.
//!
//! ```text
//!   thread 1  ├─ part setup=0 region=0 ──────────────────────┤├─ verify stage=gouge and contact ─┤
//!             ├─ pattern ─────┤├─ fit ────┤├─ link ─┤
//!   thread 2  ├─ part setup=0 region=3 ─────────┤
//! ```
//!
//! The file is a list of events, one a line, written as they happen: also what is interrupted or killed can be looked at. The format
//! allows for a list without its end.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use serde_json::{Map, Value, json};
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Metadata, Subscriber};

use crate::failure::{Failure, advice_on};

/// What is said by others than the crates of this project is left out.
const OWN: &str = "claymill";
/// A trace is known by so much of it.
const START_BYTES: u64 = 1000;

/// Writes what is said from now on into a file. One that is there already is replaced if it is such a trace.
pub(crate) fn begin(path: &Path) -> Result<(), Failure> {
    let mut options = OpenOptions::new();
    options.write(true);
    let opened = if is_trace(path) { options.truncate(true) } else { options.create_new(true) };
    let failed = |error: std::io::Error| {
        let advice = match error.kind() {
            std::io::ErrorKind::AlreadyExists => "Name another file: only an earlier trace is replaced.",
            _ => advice_on(&error),
        };
        Failure::problem(format!("{}: {error}", path.display()), advice)
    };
    let mut file = opened.open(path).map_err(failed)?;
    file.write_all(b"[\n").map_err(failed)?;
    let trace = Trace {
        begun: Instant::now(),
        file: Mutex::new(file),
        spans: Mutex::default(),
        next: AtomicU64::new(1),
        threads: AtomicU64::new(0),
    };
    // Nobody else sets one.
    let _ = tracing::subscriber::set_global_default(trace);
    Ok(())
}

fn is_trace(path: &Path) -> bool {
    // To open a pipe is to wait for whoever writes into it.
    if !path.is_file() {
        return false;
    }
    let mut start = Vec::new();
    let read = File::open(path).and_then(|file| file.take(START_BYTES).read_to_end(&mut start));
    let text = String::from_utf8_lossy(&start);
    read.is_ok() && text.strip_prefix("[\n").is_some_and(|e| e.is_empty() || e.contains("\"ph\":"))
}

struct Trace {
    begun: Instant,
    file: Mutex<File>,
    spans: Mutex<BTreeMap<u64, Span>>,
    next: AtomicU64,
    threads: AtomicU64,
}

struct Span {
    name: &'static str,
    values: Values,
    /// Who holds it.
    holders: usize,
}

thread_local! {
    /// The number of this thread, from 1, and since when it is in which spans, µs.
    static THREAD: RefCell<(u64, Vec<(u64, f64)>)> = const { RefCell::new((0, Vec::new())) };
}

fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Trace {
    fn now_us(&self) -> f64 {
        (self.begun.elapsed().as_nanos() as f64 * 1e-3).round()
    }

    fn with_thread<T>(&self, with: impl FnOnce(u64, &mut Vec<(u64, f64)>) -> T) -> T {
        THREAD.with_borrow_mut(|(number, inside)| {
            if *number == 0 {
                *number = self.threads.fetch_add(1, Ordering::Relaxed) + 1;
            }
            with(*number, inside)
        })
    }

    /// A trace that cannot be written, on a full disk say, ends; the job does not.
    fn write(&self, event: &Value) {
        let _ = locked(&self.file).write_all(format!("{event},\n").as_bytes());
    }
}

/// Values of a span or an event.
#[derive(Default, Clone)]
struct Values(Map<String, Value>);

impl Visit for Values {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        self.0.insert(field.name().to_owned(), format!("{value:?}").into());
    }

    fn record_str(&mut self, field: &Field, value: &str) {
        self.0.insert(field.name().to_owned(), value.into());
    }

    fn record_u64(&mut self, field: &Field, value: u64) {
        self.0.insert(field.name().to_owned(), value.into());
    }

    fn record_f64(&mut self, field: &Field, value: f64) {
        self.0.insert(field.name().to_owned(), value.into());
    }
}

impl Subscriber for Trace {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.target().starts_with(OWN)
    }

    fn new_span(&self, attributes: &Attributes<'_>) -> Id {
        let mut values = Values::default();
        attributes.record(&mut values);
        let id = self.next.fetch_add(1, Ordering::Relaxed);
        locked(&self.spans).insert(id, Span { name: attributes.metadata().name(), values, holders: 1 });
        Id::from_u64(id)
    }

    fn record(&self, span: &Id, values: &Record<'_>) {
        if let Some(span) = locked(&self.spans).get_mut(&span.into_u64()) {
            values.record(&mut span.values);
        }
    }

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, event: &Event<'_>) {
        let mut values = Values::default();
        event.record(&mut values);
        let name = values.0.remove("message").unwrap_or_else(|| event.metadata().name().into());
        let thread = self.with_thread(|number, _| number);
        self.write(&json!({
            "ph": "i", "s": "g", "name": name, "ts": self.now_us(), "pid": 1, "tid": thread, "args": values.0,
        }));
    }

    fn enter(&self, span: &Id) {
        self.with_thread(|_, inside| inside.push((span.into_u64(), self.now_us())));
    }

    fn exit(&self, span: &Id) {
        let id = span.into_u64();
        let (thread, since) = self.with_thread(|number, inside| {
            let at = inside.iter().rposition(|(inside, _)| *inside == id);
            (number, at.map(|at| inside.remove(at).1))
        });
        let about = locked(&self.spans).get(&id).map(|span| (span.name, span.values.clone()));
        let (Some(since), Some((name, values))) = (since, about) else { return };
        self.write(&json!({
            "ph": "X", "name": name, "ts": since, "dur": self.now_us() - since, "pid": 1, "tid": thread,
            "args": values.0,
        }));
    }

    fn clone_span(&self, span: &Id) -> Id {
        if let Some(span) = locked(&self.spans).get_mut(&span.into_u64()) {
            span.holders += 1;
        }
        span.clone()
    }

    fn try_close(&self, span: Id) -> bool {
        let mut spans = locked(&self.spans);
        let Some(held) = spans.get_mut(&span.into_u64()) else { return false };
        held.holders -= 1;
        let is_last = held.holders == 0;
        if is_last {
            spans.remove(&span.into_u64());
        }
        is_last
    }
}
