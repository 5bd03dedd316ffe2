//! Every tolerance that the kernel uses, named and with its unit.

/// Two control points closer than this are the same point, mm.
pub const COINCIDENT_MM: f64 = 1e-6;
/// Newton iterations on surfaces stop at this residual, mm.
pub const NEWTON_MM: f64 = 1e-10;
/// Coordinates beyond this are refused as damaged, mm (1000 km).
pub const LARGEST_COORDINATE_MM: f64 = 1e9;
/// Relative spread under which a net's weights count as equal (the surface is polynomial).
pub const EQUAL_WEIGHTS: f64 = 1e-14;
