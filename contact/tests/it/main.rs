//! Drops on the models of the corpus, judged by exact closest points and fine meshes.

mod ends;
mod locations;
