//! The verifier from outside: each module has a subject, and all of them one program.

mod bounds;
mod crest_peaks;
mod defects;
mod ends;
mod folder;
mod holder;
mod kept;
mod scallop_tables;
mod sequence;
mod sides;
mod synthetic;
