//! A library as a table of text.

use claymill_toolpath::{End, Holder};

use crate::drawing::measure;
use crate::library::{Library, LibraryTool};

const HEADINGS: [&str; 12] = [
    "no.",
    "id",
    "end",
    "D mm",
    "corner",
    "flutes",
    "flute mm",
    "stick-out",
    "holder",
    "in spindle",
    "materials",
    "name",
];
/// Columns of words, which begin at the left; numbers end at the right.
const WORDS: [usize; 4] = [1, 2, 10, 11];

/// The tools of a library, one a line, under headings. What is not known is `-`.
#[must_use]
pub fn library_table(library: &Library) -> String {
    let mut rows = vec![HEADINGS.map(str::to_owned)];
    rows.extend(library.tools.iter().map(row));
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..HEADINGS.len()).map(width).collect();
    let mut text = String::new();
    for row in &rows {
        let cells = row.iter().zip(&widths).enumerate().map(|(column, (cell, width))| {
            if WORDS.contains(&column) { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        });
        text += cells.collect::<Vec<_>>().join("  ").trim_end();
        text.push('\n');
    }
    text
}

fn row(tool: &LibraryTool) -> [String; 12] {
    let or_dash = |mm: Option<f64>| mm.map_or_else(|| "-".to_owned(), measure);
    let end = match tool.tool.end {
        End::Ball { .. } => "ball",
        End::Flat { .. } => "flat",
        End::Bull { .. } => "bull",
    };
    let materials: Vec<&str> = tool.cutting.keys().map(String::as_str).collect();
    [
        tool.number.map_or_else(|| "-".to_owned(), |n| n.to_string()),
        tool.id.clone(),
        end.to_owned(),
        measure(tool.diameter_mm()),
        measure(tool.tool.corner_radius_mm()),
        tool.flutes.map_or_else(|| "-".to_owned(), |n| n.to_string()),
        or_dash(tool.flute_length_mm),
        or_dash(tool.stick_out_mm),
        tool.holder.as_ref().map_or_else(|| "-".to_owned(), holder),
        or_dash(tool.length_in_spindle_mm()),
        if materials.is_empty() { "-".to_owned() } else { materials.join(",") },
        tool.name.clone(),
    ]
}

/// A holder by its largest diameter and its length.
fn holder(holder: &Holder) -> String {
    let widest =
        holder.sections.iter().map(|s| s.lower_diameter_mm.max(s.upper_diameter_mm)).fold(0.0, f64::max);
    let length: f64 = holder.sections.iter().map(|s| s.length_mm).sum();
    format!("⌀{}x{}", measure(widest), measure(length))
}
