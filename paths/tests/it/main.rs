//! Plans over few faces, judged by closed forms.

mod bounds;
mod even_passes;
mod few_faces;
mod leads;
mod pencil;
mod setups;
mod sharp_edges;
mod walls;
