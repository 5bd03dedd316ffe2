//! The store that a plan keeps its parts in, and what is said of it.

use std::path::{Path, PathBuf, absolute};
use std::sync::Arc;

use claymill_store::{Store, StoreError, Trouble};
use claymill_toolpath::{Kept, PartCount};

use crate::args::ReuseArgs;
use crate::console::Console;
use crate::failure::{Failure, TRY_AGAIN, advice_on};

/// The store of jobs that lie in one folder, once somebody has begun it.
const BESIDE: &str = ".claymill-store";
/// Another version of any of the crates that plan or verify may compute other parts: this is a hash of all their sources.
pub(crate) const PROGRAM: &str =
    concat!("claymill ", env!("CARGO_PKG_VERSION"), " ", env!("CLAYMILL_SOURCES"));
pub(crate) const MB: u64 = 1_000_000;

impl From<StoreError> for Failure {
    fn from(error: StoreError) -> Self {
        let advice = error.advice();
        Failure::problem(error, advice)
    }
}

/// Where a plan keeps its parts.
#[derive(Debug, Default)]
pub(crate) struct Reuse {
    store: Option<Arc<Store>>,
    pub(crate) kept: Kept,
}

impl Reuse {
    /// The store that is asked for, or the one that lies beside a job folder. One that nobody asked for and that cannot be had is
    /// done without.
    pub(crate) fn new(args: &ReuseArgs, job: &Path, console: &Console) -> Result<Self, Failure> {
        let lies_there = || Some(beside(job)).filter(|folder| folder.is_dir());
        let Some(folder) = args.store.clone().or_else(lies_there).filter(|_| !args.no_store) else {
            return Ok(Reuse::default());
        };
        let is_inside = |(store, job): (PathBuf, PathBuf)| store.starts_with(job);
        if absolute(&folder).ok().zip(absolute(job).ok()).is_some_and(is_inside) {
            let message = format!("the store {} is inside of the job folder", folder.display());
            return Err(Failure::usage(
                message,
                "Choose a folder beside it: job folders are replaced as a whole.",
            ));
        }
        let limit = args.store_limit.map_or(Store::USUAL_LIMIT_BYTES, |mb| mb.saturating_mul(MB));
        match Store::open(&folder, limit) {
            Ok(store) => Ok(Reuse::of(store)),
            Err(error) if args.store.is_none() => {
                console.say(format!("warning: nothing is kept for later plans: {error}"));
                Ok(Reuse::default())
            }
            Err(error) => Err(error.into()),
        }
    }

    /// The store of shards, of which nothing may go.
    pub(crate) fn of_shards(folder: &Path) -> Result<Self, Failure> {
        match Store::open(folder, u64::MAX) {
            Ok(store) => Ok(Reuse::of(store)),
            Err(StoreError::Io { path, source }) => {
                let message = format!("{}: {source}", path.display());
                Err(Failure::with_code(TRY_AGAIN, message, advice_on(&source)))
            }
            Err(error) => Err(error.into()),
        }
    }

    fn of(store: Store) -> Self {
        let store = Arc::new(store);
        Reuse { kept: Kept::in_store(store.clone(), PROGRAM), store: Some(store) }
    }

    /// Whether all parts could be kept.
    pub(crate) fn check_kept(&self) -> Result<(), Failure> {
        let troubles = self.store.iter().flat_map(|store| store.troubles());
        let lost = troubles.filter(|trouble| matches!(trouble, Trouble::NotKept { .. }));
        match lost.last() {
            Some(lost) => Err(Failure::with_code(
                TRY_AGAIN,
                lost,
                "Run it again when there is room and leave to write.",
            )),
            None => Ok(()),
        }
    }

    /// How many parts were reused; nothing without a store.
    pub(crate) fn count(&self) -> Option<PartCount> {
        self.store.as_ref().map(|_| self.kept.count())
    }

    /// Says how many parts were reused, and what was wrong with the store.
    pub(crate) fn say(&self, console: &Console) {
        let Some(store) = &self.store else { return };
        store.troubles().into_iter().for_each(|trouble| console.say(format!("warning: {trouble}")));
        let PartCount { reused, of } = self.kept.count();
        console.say(format!("parts     {reused} of {of} reused from {}", store.folder().display()));
    }
}

/// The store of jobs beside a job folder.
pub(crate) fn beside(job: &Path) -> PathBuf {
    job.parent().map_or_else(|| PathBuf::from(BESIDE), |parent| parent.join(BESIDE))
}
