//! Colours and layers.

use std::collections::BTreeMap;

use super::part21::Part21;
use crate::shortened;

/// From a style to its colour it is at most this many references.
const LONGEST_CHAIN: usize = 9;
/// A style leads to a handful of instances, and not by thousands of ways.
const MOST_STEPS: usize = 200;

/// Colour and layer by the instance that they are given to: a face, a shell, a solid.
#[derive(Debug, Default)]
pub(super) struct Styles {
    colours: BTreeMap<u64, [u8; 3]>,
    layers: BTreeMap<u64, String>,
}

impl Styles {
    pub(super) fn read(file: &Part21) -> Self {
        let mut styles = Styles::default();
        for id in file.of_type(|name| matches!(name, b"STYLED_ITEM" | b"OVER_RIDING_STYLED_ITEM")) {
            let Ok(entity) = file.get(id) else { continue };
            let Ok(record) = entity.only() else { continue };
            let (Ok(list), Some(item)) = (record.references(1), record.optional_reference(2)) else {
                continue;
            };
            if let Some(colour) = colour_of(file, list) {
                styles.colours.insert(item, colour);
            }
        }
        for id in file.of_type(|name| name == b"PRESENTATION_LAYER_ASSIGNMENT") {
            let Ok(entity) = file.get(id) else { continue };
            let Ok(record) = entity.only() else { continue };
            let name = shortened(record.text(0));
            for item in record.references(2).unwrap_or_default() {
                styles.layers.insert(item, name.clone());
            }
        }
        styles
    }

    /// The colour of the innermost of `owners` that has one.
    pub(super) fn colour(&self, owners: &[u64]) -> Option<[u8; 3]> {
        owners.iter().rev().find_map(|id| self.colours.get(id).copied())
    }

    /// The layer of the innermost of `owners` that has one.
    pub(super) fn layer(&self, owners: &[u64]) -> Option<String> {
        owners.iter().rev().find_map(|id| self.layers.get(id).cloned())
    }
}

/// The first colour that one of the styles leads to.
fn colour_of(file: &Part21, styles: Vec<u64>) -> Option<[u8; 3]> {
    let mut steps = MOST_STEPS;
    styles.into_iter().find_map(|style| colour(file, style, LONGEST_CHAIN, &mut steps))
}

/// The first colour of a surface style, or of any style, that `#id` leads to.
fn colour(file: &Part21, id: u64, chain: usize, steps: &mut usize) -> Option<[u8; 3]> {
    let chain = chain.checked_sub(1)?;
    *steps = steps.checked_sub(1)?;
    let entity = file.get(id).ok()?;
    if let Ok(rgb) = entity.part("COLOUR_RGB") {
        let byte = |i| rgb.number(i).map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8).ok();
        return Some([byte(1)?, byte(2)?, byte(3)?]);
    }
    if let Ok(named) = entity.part("DRAUGHTING_PRE_DEFINED_COLOUR") {
        return match named.text(0).as_str() {
            "red" => Some([255, 0, 0]),
            "green" => Some([0, 255, 0]),
            "blue" => Some([0, 0, 255]),
            "yellow" => Some([255, 255, 0]),
            "magenta" => Some([255, 0, 255]),
            "cyan" => Some([0, 255, 255]),
            "black" => Some([0, 0, 0]),
            "white" => Some([255, 255, 255]),
            _ => None,
        };
    }
    // A style leads to a handful of instances; a longer list is no style.
    let next = entity.references();
    next.into_iter().take(8).find_map(|id| colour(file, id, chain, steps))
}
