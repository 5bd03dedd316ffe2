//! Why an entity of a STEP file cannot be used. Every message names the instance.

use claymill_nurbs::NurbsError;
use thiserror::Error;

use crate::chart::ChartError;

/// Why one entity of a STEP file cannot be used. Each message names the instance.
#[derive(Debug, Clone, PartialEq, Error)]
pub(super) enum StepError {
    #[error("#{id} is referred to but not in the file")]
    Missing { id: u64 },
    #[error("#{id} cannot be parsed (line {line})")]
    Syntax { id: u64, line: usize },
    #[error("#{id} is {found} where {expected} is needed")]
    Unexpected { id: u64, found: String, expected: &'static str },
    #[error("#{id} {name}: argument {index} should be a {expected}")]
    Argument { id: u64, name: String, index: usize, expected: &'static str },
    #[error("#{id}: {name} is not supported")]
    Unsupported { id: u64, name: String },
    #[error("#{id} is nested too deeply or refers to itself")]
    Endless { id: u64 },
    #[error("#{id} unfolds to {bytes} bytes: it refers to the same things again and again")]
    TooMuch { id: u64, bytes: u64 },
    #[error("#{id}: {source}")]
    Kernel { id: u64, source: NurbsError },
    #[error("#{id}: {what}")]
    Geometry { id: u64, what: String },
}

impl StepError {
    /// What is wrong with the loops of face `id`.
    pub(super) fn of_chart(id: u64, error: ChartError) -> Self {
        match error {
            ChartError::Loops { what } => StepError::Geometry { id, what },
            ChartError::Edge { edge, what } => StepError::Geometry { id: edge.unwrap_or(id), what },
            ChartError::Kernel { source } => StepError::Kernel { id, source },
        }
    }

    /// What the user can do about it: one whole sentence.
    pub(super) fn advice(&self) -> &'static str {
        match self {
            StepError::Unsupported { .. } => {
                "Convert this surface to a B-spline surface in the original system and export again."
            }
            StepError::Missing { .. } | StepError::Syntax { .. } => {
                "The file is damaged: copy or export it again."
            }
            _ => "Repair or rebuild this face in the original system and export again.",
        }
    }
}

/// Names the instance that a kernel error belongs to.
pub(super) trait OfEntity<T> {
    fn of(self, id: u64) -> Result<T, StepError>;
}

impl<T> OfEntity<T> for Result<T, NurbsError> {
    fn of(self, id: u64) -> Result<T, StepError> {
        self.map_err(|source| StepError::Kernel { id, source })
    }
}
