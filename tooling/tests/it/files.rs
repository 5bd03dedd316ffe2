//! Test inputs with the structure that other programs write; the tools are made up.

/// A Fusion library: a flat mill with a holder and presets in mm, a ball in inches, a bull nose, and what is not read.
pub(crate) const FUSION: &str = r#"{"data": [
 {"description": "Flat 12, long", "type": "flat end mill", "unit": "millimeters", "guid": "a",
  "geometry": {"CSP": false, "DC": 12, "HAND": true, "LB": 55, "LCF": 30, "NOF": 4, "OAL": 90, "SFDM": 14, "shoulder-length": 40},
  "holder": {"description": "chuck", "type": "holder", "unit": "millimeters",
   "segments": [{"height": 20, "lower-diameter": 28, "upper-diameter": 32}, {"height": 12.5, "lower-diameter": 50, "upper-diameter": 50}]},
  "post-process": {"number": 4, "turret": 0},
  "start-values": {"presets": [
   {"name": "Alu rough", "n": 9000, "v_c": 339.29, "f_z": 0.1, "v_f": 3600, "v_f_plunge": 300, "v_f_ramp": 500, "v_f_leadIn": 900,
    "use-stepdown": true, "stepdown": 6, "use-stepover": false, "stepover": 4},
   {"name": "Alu rough", "v_c": 200, "v_f": 1200},
   {"name": "no speed", "f_z": 0.1}]}},
 {"description": "1/2 in ball", "type": "ball end mill", "unit": "inches", "guid": "b",
  "geometry": {"DC": 0.5, "LB": 2, "LCF": 1, "NOF": 2, "OAL": 4, "SFDM": 0.5},
  "post-process": {"number": 4},
  "start-values": {"presets": [{"name": "x", "material": {"category": "Foam"}, "v_c": 1000, "f_z": 0.002}]}},
 {"description": "bull 10 r1.5", "type": "bull nose end mill", "unit": "millimeters", "guid": "c",
  "geometry": {"DC": 10, "RE": 1.5, "LCF": 22, "NOF": 4, "OAL": 72, "SFDM": 10, "HAND": false}},
 {"description": "drill 8", "type": "drill", "unit": "millimeters", "geometry": {"DC": 8, "SIG": 118}},
 {"description": "chamfer", "type": "chamfer mill", "unit": "millimeters", "geometry": {"DC": 8, "TA": 45}},
 {"description": "tapered", "type": "ball end mill", "unit": "millimeters", "geometry": {"DC": 8, "TA": 3}},
 {"description": "too round", "type": "bull nose end mill", "unit": "millimeters", "geometry": {"DC": 8, "RE": 5}},
 {"description": "no unit", "type": "flat end mill", "geometry": {"DC": 8}},
 {"description": "chuck alone", "type": "holder", "unit": "millimeters", "segments": []}
], "version": 2}"#;

/// `FUSION` of one ball as a `.tools` archive, made with Python's `zipfile` (deflate, entry `tools.json`).
pub(crate) fn tools_archive() -> Vec<u8> {
    let hex: String = include_str!("tools_archive.hex").split_whitespace().collect();
    (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect()
}

/// A FreeCAD tool bit.
pub(crate) const BALL_BIT: &str = r#"{"version": 2, "name": "Ball 8 long", "shape": "ballend.fcstd", "shape-type": "Ballend",
 "parameter": {"CuttingEdgeHeight": "25.0000 mm", "Diameter": "8.0000 mm", "Flutes": "2", "Length": "80.0000 mm",
 "ShankDiameter": "10.0000 mm", "Units": "Metric"}, "attribute": {}}"#;
/// One in inches, with the shape's file only.
pub(crate) const BULL_BIT: &str = r#"{"version": 2, "name": "Bull 1/2", "shape": "bullnose.fcstd",
 "parameter": {"CuttingEdgeHeight": "1.00 in", "Diameter": "1/2\"", "CornerRadius": "0.05 in", "Length": "3 in",
 "ShankDiameter": "0.5 in"}, "attribute": {"Flutes": 4}}"#;

/// A FreeCAD machine with a rotary axis that turns about z under the name A.
pub(crate) const MACHINE: &str = r#"{"freecad_version": "1.2.0", "machine": {
 "axes": {
  "X": {"type": "linear", "role": "table_linear", "joint": {"origin": [0,0,0], "axis": [1,0,0]}, "limits": {"min": 0, "max": 800}, "max_velocity": 20000},
  "Y": {"type": "linear", "role": "table_linear", "joint": {"origin": [0,0,0], "axis": [0,1,0]}, "limits": {"min": -10, "max": 500}, "max_velocity": 20000},
  "Z": {"type": "linear", "role": "head_linear", "joint": {"origin": [0,0,0], "axis": [0,0,1]}, "limits": {"min": -450, "max": 0}, "max_velocity": 12000},
  "A": {"type": "rotary", "role": "table_rotary", "joint": {"origin": [1,2,3], "axis": [0,0,1]}, "limits": {"min": -180, "max": 180}, "max_velocity": 9000}
 }, "manufacturer": "Example", "name": "V800", "units": "metric",
 "toolheads": [{"id": "t1", "toolhead_type": "rotary", "max_power_kw": 7.5, "min_rpm": 50, "max_rpm": 12000}]}, "version": 1}"#;

/// A LinuxCNC tool table.
pub(crate) const TABLE: &str = "; tool table of a router\n\nT1 P1 Z85.25 D10 ;ball, 2 flutes\nT12 P3 D16.0 Z0 ;bull R2\n\
    T3 P4 D6 ;End Mill\nT4 P5 D8 ;drill\nT5 P6 ;ball\nT6 P7 D+10.5 ;bull\n";
