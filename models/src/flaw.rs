//! Flaws of known size that can be planted into a generated model, and their text form, for example
//! `gap:0.005` or `kink:0.5`.

use std::fmt;
use std::str::FromStr;

use claymill_nurbs::FaceId;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A flaw to plant into a model. Written `kind:size`, for example `kink:0.5`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Flaw {
    /// `gap:MM` – the rest of the ribbon is lifted along the normal of a line across it.
    Gap(f64),
    /// `shift:MM` – the rest is moved away in the tangent plane, at right angles to the line.
    Shift(f64),
    /// `kink:DEG` – the rest is turned about the line.
    Kink(f64),
    /// `curvature:PER_MM` – the curvature across the line jumps by this much, 1/mm; tangent planes agree.
    Curvature(f64),
    /// `t-junctions` – rows of patches are cut at places of their own.
    TJunctions,
    /// `duplicate:N` – N faces come twice.
    Duplicate(usize),
    /// `lap:N` – a patch lies on the middle of each of N faces.
    Lap(usize),
    /// `flip:N` – N faces have their outside on the other side.
    Flip(usize),
    /// `delete:N` – N faces are missing.
    Delete(usize),
    /// `round:DIGITS` – coordinates of control points are rounded to so many digits after the point.
    Round(usize),
}

/// A flaw as it was planted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlantedFlaw {
    /// What was asked for, for example `kink:0.5`.
    pub flaw: String,
    /// Its size: mm, degrees or 1/mm as [`Flaw`] says; 1 where a face is there or not; for rounding the step
    /// of coordinates in mm.
    pub size: f64,
    /// The faces concerned. Duplicates: the original and its copy. Laps: the patch and the face under it.
    /// Empty where a flaw concerns joints, or where the face is missing.
    pub faces: Vec<FaceId>,
    /// The joints concerned, by their two faces, the smaller first.
    pub joints: Vec<[FaceId; 2]>,
    /// Length of the joints concerned, mm. A missing face: of the sides of its neighbours that it leaves
    /// without one.
    pub length_mm: f64,
}

/// Why a flaw cannot be planted.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FlawError {
    /// It is not a known kind with a size.
    #[error(
        "`{text}` is no flaw: write gap:MM, shift:MM, kink:DEG, curvature:PER_MM, t-junctions, duplicate:N, \
         lap:N, flip:N, delete:N or round:DIGITS"
    )]
    Unknown {
        /// What was written.
        text: String,
    },
    /// Its size makes no sense.
    #[error("{flaw}: the size must be {range}")]
    Size {
        /// The flaw.
        flaw: String,
        /// What it may be.
        range: &'static str,
    },
    /// The sample has no straight lines across it.
    #[error("{flaw} can be planted into the sample `ribbon` only, whose lines are straight")]
    OnlyRibbon {
        /// The flaw.
        flaw: String,
    },
    /// There are not as many faces.
    #[error("{flaw}: the model has {faces} faces only")]
    TooMany {
        /// The flaw.
        flaw: String,
        /// Faces of the model that can carry it.
        faces: usize,
    },
}

impl Flaw {
    /// Whether it concerns a line between patches, not single faces.
    #[must_use]
    pub fn is_on_a_line(self) -> bool {
        matches!(self, Flaw::Gap(_) | Flaw::Shift(_) | Flaw::Kink(_) | Flaw::Curvature(_))
    }

    fn check(self) -> Result<Self, FlawError> {
        let (fine, range) = match self {
            Flaw::Gap(mm) | Flaw::Shift(mm) => (mm > 0.0 && mm <= 1.0, "above 0 and at most 1 mm"),
            Flaw::Kink(deg) => (deg > 0.0 && deg <= 60.0, "above 0 and at most 60 degrees"),
            Flaw::Curvature(k) => (k > 0.0 && k <= 0.01, "above 0 and at most 0.01 per mm"),
            Flaw::TJunctions => (true, ""),
            Flaw::Duplicate(n) | Flaw::Lap(n) | Flaw::Flip(n) | Flaw::Delete(n) => {
                (n > 0, "a number of faces above 0")
            }
            Flaw::Round(digits) => (digits <= 9, "0 to 9 digits"),
        };
        if fine { Ok(self) } else { Err(FlawError::Size { flaw: self.to_string(), range }) }
    }
}

impl FromStr for Flaw {
    type Err = FlawError;

    fn from_str(text: &str) -> Result<Self, FlawError> {
        let unknown = || FlawError::Unknown { text: text.to_owned() };
        if text == "t-junctions" {
            return Ok(Flaw::TJunctions);
        }
        let (kind, size) = text.split_once(':').ok_or_else(unknown)?;
        let measure = || size.parse::<f64>().map_err(|_| unknown());
        let number = || size.parse::<usize>().map_err(|_| unknown());
        match kind {
            "gap" => Flaw::Gap(measure()?),
            "shift" => Flaw::Shift(measure()?),
            "kink" => Flaw::Kink(measure()?),
            "curvature" => Flaw::Curvature(measure()?),
            "duplicate" => Flaw::Duplicate(number()?),
            "lap" => Flaw::Lap(number()?),
            "flip" => Flaw::Flip(number()?),
            "delete" => Flaw::Delete(number()?),
            "round" => Flaw::Round(number()?),
            _ => return Err(unknown()),
        }
        .check()
    }
}

impl fmt::Display for Flaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Flaw::Gap(size) => write!(f, "gap:{size}"),
            Flaw::Shift(size) => write!(f, "shift:{size}"),
            Flaw::Kink(size) => write!(f, "kink:{size}"),
            Flaw::Curvature(size) => write!(f, "curvature:{size}"),
            Flaw::TJunctions => write!(f, "t-junctions"),
            Flaw::Duplicate(n) => write!(f, "duplicate:{n}"),
            Flaw::Lap(n) => write!(f, "lap:{n}"),
            Flaw::Flip(n) => write!(f, "flip:{n}"),
            Flaw::Delete(n) => write!(f, "delete:{n}"),
            Flaw::Round(digits) => write!(f, "round:{digits}"),
        }
    }
}
