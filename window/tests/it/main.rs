//! The window from outside, in one program.

mod driven;
