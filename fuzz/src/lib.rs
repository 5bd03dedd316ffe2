//! What must hold of every reader, whatever the bytes: no panic, every face accounted for, only finite numbers, and
//! memory in proportion to the input. What must hold of programs, streams and machine definitions is in `control.rs`.

use std::path::Path;

use claymill_exchange::{Format, MeshFormat, read_bytes, read_mesh_bytes};
use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// A reader may take this many bytes for each of the input ...
const TIMES_INPUT: usize = 50;
/// ... and these besides: small files hold shapes that take some room whatever their length (a torus is 81 control
/// points), and the thread pool is made on first use.
const BESIDES: usize = 1 << 20;

/// Reads a model; anything that is not of this format is left to the target that it belongs to.
pub fn model(bytes: &[u8], format: Format) {
    if Format::of(bytes) != Ok(format) {
        return;
    }
    let ((), peak) = with_peak(|| {
        let Ok(import) = read_bytes(bytes, Path::new("fuzzed")) else { return };
        let report = &import.report;
        assert_eq!(report.faces_in_file, report.faces_read + report.skipped.len());
        assert_eq!(report.faces_read, import.model.faces.len());
        for face in &import.model.faces {
            assert!(face.surface.net().iter().all(|h| h.iter().all(|c| c.is_finite())));
        }
    });
    bounded(peak, bytes);
}

/// Reads an obstacle mesh.
pub fn mesh(bytes: &[u8], formats: &[MeshFormat]) {
    if MeshFormat::of(bytes).is_none_or(|found| !formats.contains(&found)) {
        return;
    }
    let ((), peak) = with_peak(|| {
        let Ok(mesh) = read_mesh_bytes(bytes, Path::new("fuzzed"), 1.0) else { return };
        assert!(mesh.triangles.iter().flatten().all(|corner| (*corner as usize) < mesh.vertices.len()));
        assert!(mesh.vertices.iter().all(|v| v.iter().all(|c| c.is_finite())));
    });
    bounded(peak, bytes);
}

fn with_peak<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let result = work();
    (result, MEMORY.peak_usage().saturating_sub(before))
}

fn bounded(peak: usize, bytes: &[u8]) {
    let limit = TIMES_INPUT * bytes.len() + BESIDES;
    assert!(peak <= limit, "{peak} bytes of memory for {} bytes of input; allowed are {limit}", bytes.len());
}
