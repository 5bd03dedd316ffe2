//! What can be wrong with a store, and with a part in it.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Why a store cannot be used.
#[derive(Debug, Error)]
pub enum StoreError {
    /// A folder or file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The folder or file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The folder holds something else.
    #[error("{} is not empty and is no store of parts", path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
    },
    /// Another version of claymill made it.
    #[error("{} is a store of another form ({found}; this version reads {read})", path.display())]
    Version {
        /// The folder.
        path: PathBuf,
        /// What its form is.
        found: String,
        /// The only one that can be read.
        read: u32,
    },
}

impl StoreError {
    /// What to do about it.
    #[must_use]
    pub fn advice(&self) -> String {
        match self {
            StoreError::Io { source, .. } => claymill_toolpath::advice_on(source).to_owned(),
            StoreError::Foreign { .. } => {
                "Name a folder that is empty or not there yet, or plan with --no-store.".to_owned()
            }
            StoreError::Version { .. } => {
                "Remove that folder or name another one: only time is lost with it.".to_owned()
            }
        }
    }

    pub(crate) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| StoreError::Io { path, source }
    }
}

/// What is wrong with the file of a part.
#[derive(Debug, Error)]
pub enum Damage {
    /// It cannot be read.
    #[error("it cannot be read: {0}")]
    Unreadable(#[from] io::Error),
    /// It does not begin as a part.
    #[error("it is no part")]
    NoPart,
    /// It was written in another form.
    #[error("it has form {found}")]
    Version {
        /// Which one.
        found: u32,
    },
    /// It has the name of another part.
    #[error("it is another part than its name says")]
    OtherKey,
    /// It is shorter or longer than its header says.
    #[error("it has {found} bytes where its header says {stated}")]
    Length {
        /// Behind the header.
        found: u64,
        /// According to the header.
        stated: u64,
    },
    /// Its content is not what was written.
    #[error("its content is not what was written")]
    Content,
}

/// What went wrong with a part. The plan goes on without it.
#[derive(Debug, Error)]
pub enum Trouble {
    /// A part is damaged: it is computed again.
    #[error("{}: {damage}; it is computed again", path.display())]
    Damaged {
        /// Its file.
        path: PathBuf,
        /// What is wrong.
        damage: Damage,
    },
    /// A part cannot be kept. Nothing more is written from then on.
    #[error("{}: parts cannot be kept: {source}", path.display())]
    NotKept {
        /// Its file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}
