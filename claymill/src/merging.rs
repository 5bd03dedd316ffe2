//! What regions are made by: limits, and wishes that go before all limits.

use std::collections::BTreeSet;

use claymill_nurbs::Model;
use claymill_surface_merge::{Constraints, MergeOptions, Preset};
use thiserror::Error;

use crate::select::{SelectError, colour_name, faces};

/// What regions are made by.
#[derive(Debug, Clone, PartialEq)]
pub struct Merging {
    /// The limits. The constraints in it are replaced: they follow from the two lists below and the model.
    pub options: MergeOptions,
    /// Keep faces apart whatever their joints: `layer` or `colour` (each by itself), or some from all others:
    /// `layer:NAME`, `colour:#RRGGBB`, `face:10-20`, several with commas.
    pub keep_apart: Vec<String>,
    /// Join these faces over every joint among them, creases too; the same forms but the first two.
    pub keep_together: Vec<String>,
}

/// Why faces cannot be kept apart or together as asked for.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum WishError {
    /// All faces are alike in what they are to be kept apart by.
    #[error("faces cannot be kept apart by {}: all are of one kind", apart.join(" and "))]
    OneKind {
        /// What they were to be kept apart by.
        apart: Vec<String>,
    },
    /// A wish names no faces.
    #[error(transparent)]
    Select(#[from] SelectError),
}

impl WishError {
    /// What to do about it, in one sentence.
    #[must_use]
    pub fn advice(&self) -> String {
        match self {
            WishError::OneKind { .. } => "Name faces, as in face:10-20.".to_owned(),
            WishError::Select(e) => e.advice(),
        }
    }
}

impl Default for Merging {
    fn default() -> Self {
        Merging::new(Preset::default())
    }
}

impl Merging {
    /// By the limits of a preset alone.
    #[must_use]
    pub fn new(preset: Preset) -> Self {
        Merging { options: preset.options(), keep_apart: Vec::new(), keep_together: Vec::new() }
    }

    /// The options for one model.
    ///
    /// # Errors
    /// A wish names nothing of this model.
    pub fn options_for(&self, model: &Model) -> Result<MergeOptions, WishError> {
        Ok(MergeOptions { constraints: self.constraints(model)?, ..self.options.clone() })
    }

    fn constraints(&self, model: &Model) -> Result<Constraints, WishError> {
        let of_model = &model.faces;
        let mut classes: Vec<Vec<String>> = vec![Vec::new(); of_model.len()];
        for what in &self.keep_apart {
            let mut add = |name: &dyn Fn(usize) -> String| {
                classes.iter_mut().enumerate().for_each(|(face, class)| class.push(name(face)));
            };
            match what.as_str() {
                "layer" => add(&|f| of_model[f].source.layer.clone().unwrap_or_default()),
                "colour" => add(&|f| of_model[f].source.colour.map(colour_name).unwrap_or_default()),
                _ => {
                    let named = faces(model, what)?;
                    add(&|f| named[f].to_string());
                }
            }
        }
        let together = self.keep_together.iter().map(|what| {
            let named = faces(model, what)?;
            Ok((0..of_model.len()).filter(|&f| named[f]).collect())
        });
        let together = together.collect::<Result<Vec<Vec<usize>>, WishError>>()?;
        if self.keep_apart.is_empty() {
            return Ok(Constraints { class_of_face: Vec::new(), together });
        }
        let all: BTreeSet<&Vec<String>> = classes.iter().collect();
        if all.len() == 1 {
            return Err(WishError::OneKind { apart: self.keep_apart.clone() });
        }
        let all: Vec<&Vec<String>> = all.into_iter().collect();
        let class_of_face = classes.iter().map(|c| all.partition_point(|other| *other < c)).collect();
        Ok(Constraints { class_of_face, together })
    }
}
