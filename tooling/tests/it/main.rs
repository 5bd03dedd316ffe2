//! The crate from outside: readers on files with the structure of others, damage, profiles, chains.

mod chain;
mod check;
mod damaged;
mod documents;
mod drawing;
mod files;
mod foreign;
mod library;
mod machine;
mod process;
mod public;
