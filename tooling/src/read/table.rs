//! LinuxCNC tool tables: a tool a line, `T1 P1 Z85.2 D10 ; ball`.
//!
//! The table has diameters and lengths, but no shapes. The remark says the shape: it contains `ball`, `flat` or
//! `endmill`, or `bull` with the corner radius (`bull R2`). Other tools are skipped by name.

use std::path::Path;

use claymill_toolpath::{End, Tool};

use super::fields::tidy;
use super::length::plain;
use super::{Gathered, ReadOptions};
use crate::error::{ToolingError, one_line};
use crate::library::LibraryTool;

/// Words of a line that are understood.
const LETTERS: &str = "TPXYZABCUVWDIJQ";

/// Whether the first line that holds anything begins with `T` and `P` and their numbers.
pub(super) fn looks_like(text: &str) -> bool {
    let first = text.lines().map(content).find(|line| !line.is_empty()).unwrap_or_default();
    let mut words = first.split_whitespace();
    let mut begins = |letter: char| {
        let digits = words.next().and_then(|w| w.strip_prefix([letter, letter.to_ascii_lowercase()]));
        digits.is_some_and(|d| !d.is_empty() && d.chars().all(|c| c.is_ascii_digit()))
    };
    begins('T') && begins('P')
}

/// A line without its remark.
fn content(line: &str) -> &str {
    line.split(';').next().unwrap_or_default().trim()
}

pub(super) fn read(
    text: &str,
    path: &Path,
    options: &ReadOptions,
    gathered: &mut Gathered,
) -> Result<(), ToolingError> {
    let lines = || text.lines().enumerate().filter(|(_, line)| !content(line).is_empty());
    Gathered::bound(lines().count(), path)?;
    for (index, line) in lines() {
        let remark = line.split_once(';').map(|(_, remark)| remark.trim()).unwrap_or_default();
        let words = words(content(line))
            .map_err(|what| ToolingError::syntax(path, format!("line {}: {what}", index + 1)))?;
        let value = |letter: char| words.iter().find(|(l, _)| *l == letter).map(|(_, v)| *v);
        let number = value('T').and_then(whole);
        let name = match (remark, number) {
            ("", Some(n)) => format!("T{n}"),
            ("", None) => format!("line {}", index + 1),
            (remark, _) => remark.to_owned(),
        };
        let mm = |letter| value(letter).map(|v| tidy(v * options.table_unit.mm())).filter(|v| *v > 0.0);
        let read = mm('D').ok_or_else(|| "it has no diameter (`D`)".to_owned()).and_then(|diameter| {
            let end = end(remark, 0.5 * diameter, options)?;
            Ok(LibraryTool {
                number,
                gauge_length_mm: mm('Z'),
                ..LibraryTool::new("", one_line(&name), Tool::of(end))
            })
        });
        gathered.add(&name, read);
    }
    let unit = match options.table_unit {
        super::LengthUnit::Mm => "mm",
        super::LengthUnit::Inch => "inches",
    };
    gathered.note(format!("a tool table has no unit: its lengths were taken as {unit}"));
    gathered.note("a tool table has no shapes: they were taken from the remarks");
    Ok(())
}

/// A whole number from 1.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the range is checked")]
fn whole(v: f64) -> Option<u32> {
    (v.fract() == 0.0 && (1.0..=99_999_999.0).contains(&v)).then_some(v as u32)
}

/// Letters and numbers of a line; each letter once.
fn words(line: &str) -> Result<Vec<(char, f64)>, String> {
    let mut words: Vec<(char, f64)> = Vec::new();
    for word in line.split_whitespace() {
        let letter = word.chars().next().map(|c| c.to_ascii_uppercase()).filter(|c| LETTERS.contains(*c));
        let value = letter.and_then(|_| plain(&word[1..]));
        let (Some(letter), Some(value)) = (letter, value) else {
            return Err(format!("`{}` is no word of a tool table", one_line(word)));
        };
        if words.iter().any(|(l, _)| *l == letter) {
            return Err(format!("`{letter}` occurs twice"));
        }
        words.push((letter, value));
    }
    if !words.iter().any(|(l, _)| *l == 'T') {
        return Err("there is no tool number (`T`)".into());
    }
    Ok(words)
}

fn end(remark: &str, radius_mm: f64, options: &ReadOptions) -> Result<End, String> {
    let remark = remark.to_ascii_lowercase();
    let says = |word: &str| remark.contains(word);
    match () {
        () if says("ball") => Ok(End::Ball { radius_mm }),
        () if says("bull") || says("torus") => {
            let corner = remark
                .split(|c: char| c.is_whitespace() || c == ',')
                .find_map(|word| plain(word.strip_prefix('r')?.trim_start_matches('=')));
            let corner = corner.ok_or("its remark says bull, but no corner radius, for example `bull R2`")?;
            Ok(End::Bull { radius_mm, corner_radius_mm: tidy(corner * options.table_unit.mm()) })
        }
        () if says("flat") || says("endmill") || says("end mill") => Ok(End::Flat { radius_mm }),
        () => {
            Err("its remark does not say its shape; write `ball`, `flat` or `bull R2` behind the semicolon"
                .into())
        }
    }
}
