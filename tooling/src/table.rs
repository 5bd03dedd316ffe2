//! A library as a table of text.

use claymill_toolpath::End;

use crate::drawing::measure;
use crate::library::{Library, LibraryTool};

const HEADINGS: [&str; 10] =
    ["id", "no.", "end", "D mm", "corner", "flutes", "flute mm", "stick-out", "in spindle", "name"];

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
            // Names begin at the left, numbers end at the right.
            if [0, 2, 9].contains(&column) { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        });
        text += cells.collect::<Vec<_>>().join("  ").trim_end();
        text.push('\n');
    }
    text
}

fn row(tool: &LibraryTool) -> [String; 10] {
    let or_dash = |mm: Option<f64>| mm.map_or_else(|| "-".to_owned(), measure);
    let end = match tool.tool.end {
        End::Ball { .. } => "ball",
        End::Flat { .. } => "flat",
        End::Bull { .. } => "bull",
    };
    [
        tool.id.clone(),
        tool.number.map_or_else(|| "-".to_owned(), |n| n.to_string()),
        end.to_owned(),
        measure(tool.diameter_mm()),
        measure(tool.tool.corner_radius_mm()),
        tool.flutes.map_or_else(|| "-".to_owned(), |n| n.to_string()),
        or_dash(tool.flute_length_mm),
        or_dash(tool.stick_out_mm),
        or_dash(tool.length_in_spindle_mm()),
        tool.name.clone(),
    ]
}
