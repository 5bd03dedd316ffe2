//! What to do when the operating system refuses to read or write.

use std::io::{Error, ErrorKind as Kind};

/// What to do when the operating system refuses to read or write: one whole sentence.
#[must_use]
pub fn advice_on(error: &Error) -> &'static str {
    match error.kind() {
        Kind::NotFound => "Check the path.",
        Kind::IsADirectory | Kind::InvalidInput => "Name a file.",
        Kind::FileTooLarge | Kind::InvalidData => "Check the path: this is another kind of file.",
        Kind::PermissionDenied | Kind::ReadOnlyFilesystem => "Choose a folder that you may write to.",
        Kind::NotADirectory | Kind::AlreadyExists => {
            "A file is in the way where a folder is needed: choose another folder."
        }
        Kind::StorageFull | Kind::QuotaExceeded | Kind::WriteZero => {
            "The disk is full: free some space or choose another one. Nothing was left behind."
        }
        _ => "Nothing was left behind; correct the cause and run the command again.",
    }
}
