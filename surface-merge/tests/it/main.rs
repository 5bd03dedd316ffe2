//! Merging from outside: each module has a subject, and all of them one program.

mod corpus;
mod defects;
mod dense_trims;
mod flaws;
mod joints;
mod planted;
mod region_mesh;
mod roadster;
mod scene;
mod sheets;
mod wishes;
