//! Lines of a legend.

use crate::palette::Rgb;
use crate::pins::PinShape;

/// How a legend line shows its colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mark {
    /// A filled square.
    Area,
    /// A line of this width, pixels.
    Line(f32),
    /// The sign of pins.
    Pin(PinShape),
}

/// A line of the legend.
#[derive(Debug, Clone, PartialEq)]
pub struct LegendEntry {
    /// The sign.
    pub mark: Mark,
    /// Its colour.
    pub colour: Rgb,
    /// What it means.
    pub text: String,
}

/// The legend of regions coloured by [`crate::colour_regions`]: a line a colour, with the numbers of all regions that have it.
#[must_use]
pub fn region_legend(colours: &[Rgb]) -> Vec<LegendEntry> {
    const NAMED: usize = 6;
    let mut of_colour: Vec<(Rgb, Vec<usize>)> = Vec::new();
    for (region, &colour) in colours.iter().enumerate() {
        match of_colour.iter_mut().find(|(c, _)| *c == colour) {
            Some((_, regions)) => regions.push(region),
            None => of_colour.push((colour, vec![region])),
        }
    }
    let entry = |(colour, regions): (Rgb, Vec<usize>)| {
        let numbers: Vec<String> = regions.iter().take(NAMED).map(ToString::to_string).collect();
        let word = if regions.len() == 1 { "region" } else { "regions" };
        let more = match regions.len().saturating_sub(NAMED) {
            0 => String::new(),
            n => format!(" and {n} more"),
        };
        LegendEntry { mark: Mark::Area, colour, text: format!("{word} {}{more}", numbers.join(", ")) }
    };
    of_colour.into_iter().map(entry).collect()
}
