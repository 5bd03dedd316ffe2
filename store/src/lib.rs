//! A folder that keeps the parts of plans, by what they are made of.
//!
//! ```text
//!   .claymill-store ─┬─ STORE              what this folder is, and the version of its form
//!                    ├─ 3f…9a.part         header: mark, version, key, SHA-256 and length of what follows
//!                    ├─ 07…c2.part
//!                    └─ .07…c2.811.partial what process 811 is writing; removed when that is dead
//! ```
//!
//! A part is written beside its place, brought to the disk, and renamed, so that it is there as a whole or not at all.
//! Whatever is wrong with a part costs the time to compute it again, and nothing else: parts that are damaged count as absent.
//! Any number of processes may use one store.
//!
//! ```
//! use claymill_store::Store;
//! use claymill_toolpath::{KeyMaker, PartStore};
//! let folder = tempfile::tempdir()?;
//! let store = Store::open(&folder.path().join("parts"), Store::USUAL_LIMIT_BYTES)?;
//! let key = KeyMaker::new("squares").count(12).finish();
//! assert_eq!(store.get(&key), None);
//! store.put(&key, b"144");
//! assert_eq!(store.get(&key).as_deref(), Some(&b"144"[..]));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod contents;
mod error;
mod part_file;
mod store;

pub use contents::Contents;
pub use error::{Damage, StoreError, Trouble};
pub use store::Store;
