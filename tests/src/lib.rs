//! Checks that the tests of several crates share. They know the documented form of a job folder and share
//! nothing with planner and verifier beyond the kernel's closest point.
//!
//! ```text
//!   toolpaths.jsonl ─┬─ form ──── clamped cubics, head to tail, rapids across or along the axis
//!                    └─ ball ──── points along the curves ─ closest point ─► depth, excess, clearance
//!   report.html ─────── browser ─ a real Chromium: console, network, pixels, clicks
//!   fuzz/seeds ──────── mutation ─ what a fuzzer would make of them, again the same every time
//!   (nothing) ───────── need ──── what a machine lacks: the test is left out, visibly, or fails on demand
//!   *.png ───────────── picture ─ how much two pictures differ to an eye
//! ```

mod ball;
mod browser;
mod corpus;
mod cpu;
mod form;
mod mutation;
mod need;
mod partition;
mod picture;
mod shape;

pub use ball::{Ball, measure_ball};
pub use browser::{Browser, Screenshot};
pub use corpus::{corpus, corpus_file};
pub use cpu::{process_cpu_s, thread_cpu_s};
pub use form::check_form;
pub use mutation::{fuzz_seeds, mutate};
pub use need::{Need, is_installed, leave_out};
pub use partition::same_partition;
pub use picture::{Perceived, Pixels, perceived};
pub use shape::{lattice, model_of};
