//! STL meshes.
#![no_main]

use claymill_exchange::MeshFormat;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| claymill_fuzz::mesh(bytes, &[MeshFormat::StlText, MeshFormat::StlBinary]));
