//! Pictures and the report from outside, in one program.

mod pictures;
mod report;
