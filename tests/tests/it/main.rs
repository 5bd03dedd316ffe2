//! The shared checks, the rules of the tree, and small models from end to end, in one program.

mod checks;
mod small_models;
mod tidy;
