//! How controls are told of a tilted plane, and how that is read again: CYCLE800, G68.2 with G53.1, PLANE SPATIAL.

use claymill_nurbs::Point3;

use crate::number::decimal;
use crate::tilt::{Angles, Placed, Tilt, Turn};
use crate::words::{Word, first_chars, number};
use crate::{Machine, Refusal};

use super::flavour::Flavour;

/// Decimals are the control's; the angles have been rounded to them.
const DIGITS: u8 = 6;
/// CYCLE800 axis by axis about x, y and z: `_MODE` has the axes from bit 0 on, two bits each.
const MODE_XYZ: u32 = 0b11_10_01;

/// Blocks that tilt the plane, or index the part.
pub(crate) fn begin(flavour: Flavour, placed: &Placed, machine: &Machine) -> Vec<String> {
    match (flavour, placed.by) {
        (Flavour::Siemens, Turn::Plane { deg }) => vec![cycle800(deg, machine)],
        (Flavour::Fanuc, Turn::Plane { deg }) => {
            let [i, j, k] = deg.map(|a| decimal(a, DIGITS));
            vec![format!("G68.2 X0. Y0. Z0. I{i} J{j} K{k}"), "G53.1".into()]
        }
        (_, Turn::Plane { .. }) => Vec::new(),
        (_, Turn::Index { deg, .. }) => vec![format!("G0 A{}", decimal(deg, DIGITS))],
    }
}

/// Blocks that end the plane while the tool is above the part.
pub(crate) fn end(flavour: Flavour, placed: &Placed, machine: &Machine) -> Vec<String> {
    match (flavour, placed.by) {
        (Flavour::Siemens, Turn::Plane { .. }) => vec![cycle800([0.0; 3], machine), "CYCLE800()".into()],
        (Flavour::Fanuc, Turn::Plane { .. }) => vec!["G69".into()],
        _ => Vec::new(),
    }
}

/// What must follow when the tool is out of the way: G69 leaves the rotary axes where they are, so an upright plane takes them
/// back.
pub(crate) fn back(flavour: Flavour, placed: &Placed) -> &'static [&'static str] {
    match (flavour, placed.by) {
        (Flavour::Fanuc, Turn::Plane { .. }) => &["G68.2 X0. Y0. Z0. I0. J0. K0.", "G53.1", "G69"],
        _ => &[],
    }
}

/// The parameters: retract along the machine's Z, swivel data, new swivel, mode, zero, angles, shift behind the turn,
/// direction of the first rotary axis, length of an incremental retract, plane G17.
fn cycle800(deg: [f64; 3], machine: &Machine) -> String {
    let [a, b, c] = deg.map(|a| decimal(a, DIGITS));
    let (data, direction) = (&machine.tilt.swivel_data, machine.tilt.direction);
    format!("CYCLE800(1,\"{data}\",0,{MODE_XYZ},0,0,0,{a},{b},{c},0,0,0,{direction},0,1)")
}

/// A bad plane.
fn bad(detail: impl Into<String>) -> Refusal {
    Refusal::new("tilted-plane", detail)
}

/// What a block `CYCLE800(…)` does: `Some(None)` ends the plane. `None` where it is another block.
pub(crate) fn read_cycle800(text: &str, unit_mm: f64) -> Result<Option<Option<Tilt>>, Refusal> {
    let Some(list) = text.strip_prefix("CYCLE800") else { return Ok(None) };
    let list = list.trim().strip_prefix('(').and_then(|l| l.strip_suffix(')'));
    let list = list.ok_or_else(|| bad("CYCLE800 without its parameters in parentheses"))?;
    if list.trim().is_empty() {
        return Ok(Some(None));
    }
    let fields: Vec<&str> = list.split(',').map(str::trim).collect();
    let value = |i: usize| match fields.get(i) {
        None | Some(&"") => Ok(0.0),
        Some(text) => Ok(number(text)?.0),
    };
    if fields.get(1).is_some_and(|name| *name == "\"0\"") {
        return Ok(Some(None));
    }
    if value(2)? % 10.0 != 0.0 {
        return Err(bad("CYCLE800 adds to the plane before it; only new planes are read"));
    }
    let mode = value(3)? as u32;
    let axes = [mode & 3, mode >> 2 & 3, mode >> 4 & 3];
    if mode >> 6 != 0 || axes.contains(&0) {
        return Err(bad(format!("CYCLE800 with _MODE {mode}: only swivelling axis by axis is read")));
    }
    if (10..13).any(|i| value(i).is_ok_and(|v| v != 0.0)) {
        return Err(bad("CYCLE800 with a shift behind the turn is not read"));
    }
    let origin = Point3::new(value(4)?, value(5)?, value(6)?) * unit_mm;
    let turns = [(axes[0], value(7)?), (axes[1], value(8)?), (axes[2], value(9)?)];
    Ok(Some(Some(Tilt::by_turns(turns.map(|(axis, deg)| (axis as usize - 1, deg)), origin))))
}

/// The plane of a block `G68.2`.
pub(crate) fn read_g68_2(words: &[Word], unit_mm: f64) -> Result<Tilt, Refusal> {
    let value = |key: &str| {
        let found = words.iter().find(|w| w.key == key).and_then(Word::number);
        found.ok_or_else(|| bad(format!("G68.2 without {key}: X, Y, Z, I, J and K must stand in its block")))
    };
    if let Some(other) = words.iter().find(|w| !["G", "X", "Y", "Z", "I", "J", "K"].contains(&w.key)) {
        return Err(bad(format!("`{}` has no place in a block with G68.2", first_chars(other.key))));
    }
    let origin = Point3::new(value("X")?, value("Y")?, value("Z")?) * unit_mm;
    Ok(Tilt::by(Angles::Zxz, [value("I")?, value("J")?, value("K")?], origin))
}

/// `PLANE SPATIAL SPA+0 SPB+45 SPC+0 TURN FMAX`
pub(crate) fn spatial([a, b, c]: [f64; 3]) -> String {
    let signed = |v: f64| {
        let text = decimal(v, DIGITS);
        let text = text.strip_suffix('.').unwrap_or(&text).to_owned();
        if text.starts_with('-') { text } else { format!("+{text}") }
    };
    format!("PLANE SPATIAL SPA{} SPB{} SPC{} TURN FMAX", signed(a), signed(b), signed(c))
}

/// Ends the plane and turns the rotary axes back.
pub(crate) const PLANE_RESET: &str = "PLANE RESET TURN FMAX";

/// The plane of a block that begins with `PLANE`; `None` where it ends.
pub(crate) fn read_plane(rest: &str) -> Result<Option<Tilt>, Refusal> {
    let mut words = rest.split_whitespace();
    match words.next() {
        Some("RESET") => return Ok(None),
        Some("SPATIAL") => {}
        other => {
            let other = first_chars(other.unwrap_or_default());
            return Err(bad(format!("PLANE {other}: only SPATIAL and RESET are read")));
        }
    }
    let mut deg = [None; 3];
    for word in words {
        match ["SPA", "SPB", "SPC"].iter().position(|key| word.starts_with(key)) {
            Some(i) => deg[i] = Some(number(&word[3..])?.0),
            None if ["TURN", "MOVE", "FMAX"].contains(&word) => {}
            None if word == "STAY" => {
                return Err(bad("PLANE SPATIAL with STAY: the tool would not be along the plane's axis"));
            }
            None => return Err(bad(format!("`{}` is not read behind PLANE SPATIAL", first_chars(word)))),
        }
    }
    let [Some(a), Some(b), Some(c)] = deg else {
        return Err(bad("PLANE SPATIAL must have SPA, SPB and SPC"));
    };
    Ok(Some(Tilt::by(Angles::SpatialXyz, [a, b, c], Point3::origin())))
}
