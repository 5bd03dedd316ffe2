//! Rhino files.
#![no_main]

use claymill_exchange::Format;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| claymill_fuzz::model(bytes, Format::Rhino3dm));
