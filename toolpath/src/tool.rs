use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A cutting tool.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "shape", rename_all = "snake_case")]
pub enum Tool {
    /// A ball end mill.
    Ball {
        /// Ball radius, mm.
        radius_mm: f64,
    },
}

/// Why a tool could not be understood.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ToolError {
    /// Not of the form `ball:R`.
    #[error("`{0}` is not a tool; write ball:R with the radius in mm, for example ball:10")]
    Syntax(String),
    /// A shape of tool that no strategy cuts with.
    #[error("tool `{0}` is not supported yet: only ball-end tools are, for example ball:10")]
    Shape(String),
    /// The radius is not a positive, finite number.
    #[error("tool radius {0} mm must be a positive number")]
    Radius(f64),
}

impl Tool {
    /// Radius of the ball, mm.
    #[must_use]
    pub fn radius_mm(&self) -> f64 {
        match *self {
            Tool::Ball { radius_mm } => radius_mm,
        }
    }
}

impl FromStr for Tool {
    type Err = ToolError;

    fn from_str(text: &str) -> Result<Self, ToolError> {
        let syntax = || ToolError::Syntax(text.to_owned());
        let (shape, size) = text.split_once(':').ok_or_else(syntax)?;
        if shape != "ball" {
            return Err(ToolError::Shape(text.to_owned()));
        }
        let radius_mm: f64 = size.trim().parse().map_err(|_| syntax())?;
        if !(radius_mm.is_finite() && radius_mm > 0.0) {
            return Err(ToolError::Radius(radius_mm));
        }
        Ok(Tool::Ball { radius_mm })
    }
}

impl fmt::Display for Tool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ball:{}", self.radius_mm())
    }
}
