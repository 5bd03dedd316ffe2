//! Machine definitions.
#![no_main]

#[allow(dead_code, reason = "each target has its own")]
#[path = "../src/control.rs"]
mod control;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| control::machine(bytes));
