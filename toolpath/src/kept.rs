//! Parts of a plan that are kept: each is a pure function of what its key is made of, so whoever has computed it may keep
//! it, and whoever needs it may take it.
//!
//! ```text
//!   all that a part follows from ── SHA-256 ──► key ──► somebody keeps it? ── yes ──► part
//!                                                            │ no                      ▲
//!                                                            └──► compute, keep ───────┘
//! ```

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use claymill_nurbs::{Face, KnotVector, NurbsCurve, TrimEdge};
use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};
use thiserror::Error;

/// What a part follows from, as one number: SHA-256.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PartKey([u8; 32]);

impl PartKey {
    /// The key that these bytes are.
    #[must_use]
    pub const fn of_bytes(bytes: [u8; 32]) -> Self {
        PartKey(bytes)
    }

    /// Its bytes.
    #[must_use]
    pub const fn as_bytes(&self) -> &[u8; 32] {
        &self.0
    }
}

/// Hexadecimal.
impl fmt::Display for PartKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// A text is the key of no part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("a key has 64 hexadecimal digits")]
pub struct NoKey;

impl FromStr for PartKey {
    type Err = NoKey;

    fn from_str(text: &str) -> Result<Self, NoKey> {
        let mut bytes = [0; 32];
        if text.len() != 2 * bytes.len() || !text.bytes().all(|digit| digit.is_ascii_hexdigit()) {
            return Err(NoKey);
        }
        for (byte, digits) in bytes.iter_mut().zip(text.as_bytes().chunks_exact(2)) {
            let digits = str::from_utf8(digits).map_err(|_| NoKey)?;
            *byte = u8::from_str_radix(digits, 16).map_err(|_| NoKey)?;
        }
        Ok(PartKey(bytes))
    }
}

/// Makes a key of what a part follows from, item by item. No two different lists of items give the same bytes to hash.
#[derive(Debug, Clone)]
pub struct KeyMaker(Sha256);

impl KeyMaker {
    /// Begins with the name of a stage.
    #[must_use]
    pub fn new(stage: &str) -> Self {
        KeyMaker(Sha256::new()).text(stage)
    }

    /// Goes on with bytes.
    #[must_use]
    pub fn bytes(self, bytes: &[u8]) -> Self {
        self.item(b'b', bytes)
    }

    /// An item of a kind: a count and a number may have the same bytes.
    fn item(mut self, kind: u8, bytes: &[u8]) -> Self {
        self.0.update([kind]);
        self.0.update((bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
        self
    }

    /// Goes on with a text.
    #[must_use]
    pub fn text(self, text: &str) -> Self {
        self.item(b't', text.as_bytes())
    }

    /// Goes on with how a value is written for programmers: numbers come with all their digits.
    #[must_use]
    pub fn debug(self, value: &impl fmt::Debug) -> Self {
        let mut text = Text(Sha256::new());
        // The hash takes everything; what a value itself cannot write is missing every time.
        let _ = fmt::write(&mut text, format_args!("{value:?}"));
        self.item(b'd', &text.0.finalize())
    }

    /// Goes on with numbers, bit for bit.
    #[must_use]
    pub fn numbers(self, numbers: impl IntoIterator<Item = f64>) -> Self {
        let bytes: Vec<u8> = numbers.into_iter().flat_map(|number| number.to_bits().to_le_bytes()).collect();
        self.item(b'n', &bytes)
    }

    /// Goes on with a face as it lies in space: its surface and its trims, without its number and what the file says of it.
    #[must_use]
    pub fn face(self, face: &Face) -> Self {
        let surface = &face.surface;
        let knots = [surface.knots_u(), surface.knots_v()];
        let key =
            self.debug(&(knots.map(KnotVector::degree), surface.is_rational(), face.reversed, face.kind));
        let key = knots.into_iter().fold(key, |key, knots| key.numbers(knots.as_slice().iter().copied()));
        let key = key.numbers(surface.net().iter().flat_map(|p| [p.x, p.y, p.z, p.w]));
        let edge = |key: KeyMaker, edge: &TrimEdge| key.curve(&edge.pcurve);
        face.loops.iter().fold(key.count(face.loops.len()), |key, trim| {
            trim.edges.iter().fold(key.count(trim.edges.len()), edge)
        })
    }

    /// Goes on with a curve.
    #[must_use]
    pub fn curve<const D: usize>(self, curve: &NurbsCurve<D>) -> Self {
        self.count(curve.knots().degree())
            .numbers(curve.knots().as_slice().iter().copied())
            .numbers(curve.points().iter().flat_map(|p| p.iter().copied()))
            .numbers(curve.weights().unwrap_or_default().iter().copied())
    }

    /// Goes on with a count.
    #[must_use]
    pub fn count(self, count: usize) -> Self {
        self.item(b'c', &(count as u64).to_le_bytes())
    }

    /// Goes on with the key of something else.
    #[must_use]
    pub fn key(self, key: &PartKey) -> Self {
        self.item(b'k', &key.0)
    }

    /// The key.
    #[must_use]
    pub fn finish(self) -> PartKey {
        PartKey(self.0.finalize().into())
    }
}

/// A text of which only the hash is kept.
struct Text(Sha256);

impl fmt::Write for Text {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.update(text);
        Ok(())
    }
}

/// Whoever keeps parts. Nothing follows from what is kept but time: a part that cannot be had is computed, and one that cannot
/// be kept is computed again the next time. All functions are called from several threads.
pub trait PartStore: fmt::Debug + Send + Sync {
    /// The bytes that were put under this key, unless they were lost or damaged.
    fn get(&self, key: &PartKey) -> Option<Vec<u8>>;

    /// Whether bytes were put under this key; they may be damaged.
    fn has(&self, key: &PartKey) -> bool;

    /// Keeps bytes, if that is possible.
    fn put(&self, key: &PartKey, payload: &[u8]);
}

/// Where the parts of a plan are kept, if anywhere, and how many of them came from there. Clones share the count.
#[derive(Debug, Clone, Default)]
pub struct Kept(Option<Arc<Keeping>>);

#[derive(Debug)]
struct Keeping {
    store: Arc<dyn PartStore>,
    program: String,
    reused: AtomicUsize,
    of: AtomicUsize,
}

/// How many parts a plan consists of, and how many of these came from a store.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct PartCount {
    /// Taken from the store.
    pub reused: usize,
    /// All of them.
    pub of: usize,
}

impl Kept {
    /// Nowhere.
    #[must_use]
    pub fn nowhere() -> Self {
        Kept(None)
    }

    /// In a store, by a program: everything that computes parts has to be told apart by its name, for another version may
    /// compute others.
    #[must_use]
    pub fn in_store(store: Arc<dyn PartStore>, program: impl Into<String>) -> Self {
        let (reused, of) = (AtomicUsize::new(0), AtomicUsize::new(0));
        Kept(Some(Arc::new(Keeping { store, program: program.into(), reused, of })))
    }

    /// Whether there is a store.
    #[must_use]
    pub fn is_somewhere(&self) -> bool {
        self.0.is_some()
    }

    /// How many parts were asked for.
    #[must_use]
    pub fn count(&self) -> PartCount {
        self.0.as_ref().map_or_else(PartCount::default, |keeping| PartCount {
            reused: keeping.reused.load(Ordering::Relaxed),
            of: keeping.of.load(Ordering::Relaxed),
        })
    }

    /// A part from the store, if it is there. The key need not know the program.
    #[must_use]
    pub fn known<T: DeserializeOwned>(&self, key: &PartKey) -> Option<T> {
        let keeping = self.0.as_ref()?;
        keeping.of.fetch_add(1, Ordering::Relaxed);
        let bytes = keeping.store.get(&keeping.own(key))?;
        let part = ciborium::from_reader(&*bytes).ok()?;
        keeping.reused.fetch_add(1, Ordering::Relaxed);
        Some(part)
    }

    /// Whether a part is in the store; it may be damaged.
    #[must_use]
    pub fn has(&self, key: &PartKey) -> bool {
        self.0.as_ref().is_some_and(|keeping| keeping.store.has(&keeping.own(key)))
    }

    /// Whether a part is in the store, undamaged.
    #[must_use]
    pub fn is_whole(&self, key: &PartKey) -> bool {
        self.0.as_ref().is_some_and(|keeping| keeping.store.get(&keeping.own(key)).is_some())
    }

    /// Keeps a part that was not known.
    pub fn keep<T: Serialize>(&self, key: &PartKey, part: &T) {
        let Some(keeping) = &self.0 else { return };
        let mut bytes = Vec::new();
        // A part that has no bytes is computed every time.
        if ciborium::into_writer(part, &mut bytes).is_ok() {
            keeping.store.put(&keeping.own(key), &bytes);
        }
    }

    /// A part from the store; if it is not there, as it is made, which is kept.
    ///
    /// # Errors
    /// Those of whoever makes it.
    pub fn part<T: Serialize + DeserializeOwned, E>(
        &self,
        key: impl FnOnce() -> PartKey,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<T, E> {
        if !self.is_somewhere() {
            return make();
        }
        let key = key();
        if let Some(part) = self.known(&key) {
            return Ok(part);
        }
        let part = make()?;
        self.keep(&key, &part);
        Ok(part)
    }
}

impl Keeping {
    /// The key of a part that this program computes.
    fn own(&self, key: &PartKey) -> PartKey {
        KeyMaker::new(&self.program).key(key).finish()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::convert::Infallible;
    use std::sync::Mutex;

    use super::*;

    /// Keeps parts in memory.
    #[derive(Debug, Default)]
    struct InMemory(Mutex<BTreeMap<PartKey, Vec<u8>>>);

    impl PartStore for InMemory {
        fn get(&self, key: &PartKey) -> Option<Vec<u8>> {
            self.0.lock().unwrap().get(key).cloned()
        }

        fn has(&self, key: &PartKey) -> bool {
            self.0.lock().unwrap().contains_key(key)
        }

        fn put(&self, key: &PartKey, payload: &[u8]) {
            self.0.lock().unwrap().insert(*key, payload.to_vec());
        }
    }

    fn part(kept: &Kept, key: PartKey, made: &mut u32) -> Vec<f64> {
        let numbers = vec![0.1, -0.0, 1.0 / 3.0, f64::MIN_POSITIVE / 7.0, 1e300];
        let make = || -> Result<Vec<f64>, Infallible> {
            *made += 1;
            Ok(numbers.clone())
        };
        let got = kept.part(|| key, make).unwrap();
        let bits = |numbers: &[f64]| numbers.iter().map(|n| n.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&got), bits(&numbers));
        got
    }

    #[test]
    fn a_part_is_made_once_and_comes_back_bit_for_bit() {
        let store = Arc::new(InMemory::default());
        let kept = Kept::in_store(store.clone(), "1");
        let (key, mut made) = (KeyMaker::new("stage").finish(), 0);
        part(&kept, key, &mut made);
        part(&kept, key, &mut made);
        assert_eq!((made, kept.count()), (1, PartCount { reused: 1, of: 2 }));
        // Another program computes its own.
        part(&Kept::in_store(store.clone(), "2"), key, &mut made);
        assert_eq!(made, 2);
        // What is no part is made again.
        store.0.lock().unwrap().values_mut().for_each(|bytes| bytes.truncate(3));
        part(&kept, key, &mut made);
        part(&kept, key, &mut made);
        assert_eq!(made, 3);
        part(&Kept::nowhere(), key, &mut made);
        assert_eq!((made, Kept::nowhere().count()), (4, PartCount::default()));
    }

    #[test]
    fn keys_differ_in_every_item_and_in_where_items_end() {
        let all = [
            KeyMaker::new("a"),
            KeyMaker::new("b"),
            KeyMaker::new("a").text("bc"),
            KeyMaker::new("a").text("b").text("c"),
            KeyMaker::new("a").numbers([0.0]),
            KeyMaker::new("a").numbers([-0.0]),
            KeyMaker::new("a").numbers([]),
            KeyMaker::new("a").numbers([0.0]).numbers([]),
            KeyMaker::new("a").count(0),
        ];
        let mut keys: Vec<PartKey> = all.into_iter().map(KeyMaker::finish).collect();
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), 9);
        let text = keys[0].to_string();
        assert_eq!((text.len(), text.parse()), (64, Ok(keys[0])));
        for wrong in ["", "00", &text[1..], &format!("{text}0"), &text.replace(&text[..1], "x")] {
            assert_eq!(wrong.parse::<PartKey>(), Err(NoKey));
        }
    }
}
