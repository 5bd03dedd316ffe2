//! The generated models from outside, in one program.

mod roadster;
mod write;
