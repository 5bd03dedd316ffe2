//! Readers and writers from outside, in one program. Tests that count the memory or the time of a whole process are
//! programs of their own beside this folder.

mod corpus_answers;
mod corpus_solids;
mod glb;
mod iges_analytic;
mod iges_corpus;
mod iges_damage;
mod iges_entities;
mod iges_text;
mod mesh_file;
mod step;
mod threedm;
mod threedm_written;
mod write_and_read;
