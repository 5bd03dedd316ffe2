//! Cutting tools: ball, flat or bull end with taper, flutes and shank, their one-line text form,
//! and the sizes that no tool has.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};
use thiserror::Error;

/// A cutting tool: its end, and what stands above it.
///
/// ```text
///      │     │  shank        written on one line: the end, then in any order
///    ╭─┴─────┴─╮             the rest, lengths in mm and angles in degrees
///    │         │ length        ball:10      flat:10      bull:10:2
///     ╲       ╱  taper         ball:5,taper:3,length:30,shank:12
///      ╰─────╯   end
/// ```
///
/// The end is a disc swollen by a ball, the corner radius: all disc when flat, all ball when a ball. A taper goes on from it
/// as a tangent, up to the flutes' length; there the shank begins. Without a shank of its own the tool goes on as thick
/// as it is there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Tool {
    /// What cuts below.
    #[serde(flatten)]
    pub end: End,
    /// Angle between flank and axis, degrees: the tool grows wider upwards by it. None: a cylinder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub taper_deg: Option<f64>,
    /// Height above the tip at which the shank begins, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flute_length_mm: Option<f64>,
    /// Diameter of the shank, mm. None: as thick as the flutes are at their upper end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shank_diameter_mm: Option<f64>,
}

/// The end of a tool.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "shape", rename_all = "snake_case")]
pub enum End {
    /// A ball.
    Ball {
        /// Ball radius, mm.
        radius_mm: f64,
    },
    /// Flat, with a sharp corner.
    Flat {
        /// Radius, mm.
        radius_mm: f64,
    },
    /// Flat in the middle with a rounded corner (bull-nosed, toroidal).
    Bull {
        /// Radius over the corner, mm.
        radius_mm: f64,
        /// Radius of the corner, mm.
        corner_radius_mm: f64,
    },
}

/// Why a tool could not be understood.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ToolError {
    /// Not of the form `SHAPE:SIZE,...`.
    #[error(
        "`{0}` is not a tool; write ball:R, flat:R or bull:R:CORNER with radii in mm, and if need be taper:DEG, \
         length:MM and shank:DIAMETER after commas, for example ball:10 or ball:5,taper:3,length:30,shank:12"
    )]
    Syntax(String),
    /// An end that is not known.
    #[error("`{0}` is not a tool's end; there are ball:R, flat:R and bull:R:CORNER, for example ball:10")]
    Shape(String),
    /// No tool has the radius.
    #[error("tool radius {0} mm must be a positive number, from {low} to {high}", low = RADII_MM.0, high = RADII_MM.1)]
    Radius(f64),
    /// No tool is as long, or as thick.
    #[error("a length or shank of {0} mm must be at most {LONGEST_MM} mm")]
    Long(f64),
    /// The corner is not smaller than the tool.
    #[error(
        "a corner radius of {corner_mm} mm does not suit a tool of radius {radius_mm} mm: it must be more than 0, as \
         flat:{radius_mm} has it, and less than the radius, as ball:{radius_mm} has it"
    )]
    Corner {
        /// Corner radius asked for.
        corner_mm: f64,
        /// The tool's radius.
        radius_mm: f64,
    },
    /// Not an angle that a flank can have.
    #[error("a taper of {0}° must be more than 0 and at most {LARGEST_TAPER_DEG}")]
    Taper(f64),
    /// A taper or a shank without the height at which it ends or begins.
    #[error(
        "a tool with a taper or a shank needs the height above the tip where the shank begins: length:MM"
    )]
    NoLength,
    /// The shank would begin within the tool's end.
    #[error("a length of {length_mm} mm must be more than the {end_mm} mm that the end is high")]
    Length {
        /// Length asked for.
        length_mm: f64,
        /// Height of the end.
        end_mm: f64,
    },
    /// The shank's diameter is not a positive, finite number.
    #[error("a shank of diameter {0} mm must be positive")]
    Shank(f64),
}

/// The smallest and the largest radius that a tool has, mm.
const RADII_MM: (f64, f64) = (1e-3, 1e3);
/// No tool is longer or thicker, mm.
const LONGEST_MM: f64 = 1e4;
/// Flanks lean no further than this, degrees.
const LARGEST_TAPER_DEG: f64 = 75.0;

impl Tool {
    /// A ball end mill whose shank is as thick as the ball.
    #[must_use]
    pub const fn ball(radius_mm: f64) -> Self {
        Tool::of(End::Ball { radius_mm })
    }

    /// An end with a shank as thick as it.
    #[must_use]
    pub const fn of(end: End) -> Self {
        Tool { end, taper_deg: None, flute_length_mm: None, shank_diameter_mm: None }
    }

    /// Radius of the end, mm.
    #[must_use]
    pub fn radius_mm(&self) -> f64 {
        match self.end {
            End::Ball { radius_mm } | End::Flat { radius_mm } | End::Bull { radius_mm, .. } => radius_mm,
        }
    }

    /// Radius of the end's corner, mm: that of a ball is its own, that of a flat end 0.
    #[must_use]
    pub fn corner_radius_mm(&self) -> f64 {
        match self.end {
            End::Ball { radius_mm } => radius_mm,
            End::Flat { .. } => 0.0,
            End::Bull { corner_radius_mm, .. } => corner_radius_mm,
        }
    }

    /// Whether the end is a ball.
    #[must_use]
    pub fn is_ball(&self) -> bool {
        matches!(self.end, End::Ball { .. })
    }

    /// Whether flutes and shank are as thick as the end, all the way up.
    #[must_use]
    pub fn is_straight(&self) -> bool {
        self.taper_deg.is_none() && self.shank_diameter_mm.is_none_or(|d| d == 2.0 * self.radius_mm())
    }

    /// The outline above the end in a plane through the axis, from the tip up: height above the tip and radius at both
    /// ends of the flutes and of the shank, mm. What is last has no end (infinite height).
    #[must_use]
    pub fn sides(&self) -> Vec<[[f64; 2]; 2]> {
        let (radius, corner) = (self.radius_mm(), self.corner_radius_mm());
        let (sine, cosine) = self.taper_deg.unwrap_or(0.0).to_radians().sin_cos();
        // Where the flank leaves the corner as a tangent.
        let from = [corner * (1.0 - sine), radius - corner * (1.0 - cosine)];
        let Some(length) = self.flute_length_mm else {
            return vec![[from, [f64::INFINITY, radius]]];
        };
        let top = [length, from[1] + (length - from[0]) * sine / cosine];
        let shank = self.shank_diameter_mm.map_or(top[1], |d| 0.5 * d);
        vec![[from, top], [[length, shank], [f64::INFINITY, shank]]]
    }

    /// The largest radius of the tool, mm.
    #[must_use]
    pub fn widest_mm(&self) -> f64 {
        self.sides().iter().flatten().map(|end| end[1]).fold(self.radius_mm(), f64::max)
    }

    /// Radius of the shank, mm.
    #[must_use]
    pub fn shank_radius_mm(&self) -> f64 {
        self.sides().last().map_or_else(|| self.radius_mm(), |[_, top]| top[1])
    }

    fn checked(self) -> Result<Self, ToolError> {
        let positive = |v: f64| v.is_finite() && v > 0.0;
        let (radius_mm, corner_mm) = (self.radius_mm(), self.corner_radius_mm());
        if !(RADII_MM.0..=RADII_MM.1).contains(&radius_mm) {
            return Err(ToolError::Radius(radius_mm));
        }
        let long = [self.shank_diameter_mm, self.flute_length_mm].into_iter().flatten();
        if let Some(mm) = long.filter(|mm| *mm > LONGEST_MM).reduce(f64::max) {
            return Err(ToolError::Long(mm));
        }
        if matches!(self.end, End::Bull { .. }) && !(positive(corner_mm) && corner_mm < radius_mm) {
            return Err(ToolError::Corner { corner_mm, radius_mm });
        }
        if let Some(deg) = self.taper_deg.filter(|&deg| !(positive(deg) && deg <= LARGEST_TAPER_DEG)) {
            return Err(ToolError::Taper(deg));
        }
        if let Some(mm) = self.shank_diameter_mm.filter(|&mm| !positive(mm)) {
            return Err(ToolError::Shank(mm));
        }
        match self.flute_length_mm {
            Some(mm) if !(mm.is_finite() && mm > corner_mm) => {
                Err(ToolError::Length { length_mm: mm, end_mm: corner_mm })
            }
            None if self.taper_deg.is_some() || self.shank_diameter_mm.is_some() => Err(ToolError::NoLength),
            _ => Ok(self),
        }
    }
}

/// A tool as it is written, before it is known to make sense.
#[derive(Deserialize)]
struct Unchecked {
    #[serde(flatten)]
    end: End,
    #[serde(default)]
    taper_deg: Option<f64>,
    #[serde(default)]
    flute_length_mm: Option<f64>,
    #[serde(default)]
    shank_diameter_mm: Option<f64>,
}

impl<'de> Deserialize<'de> for Tool {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Unchecked { end, taper_deg, flute_length_mm, shank_diameter_mm } =
            Unchecked::deserialize(deserializer)?;
        let tool = Tool { end, taper_deg, flute_length_mm, shank_diameter_mm };
        tool.checked().map_err(serde::de::Error::custom)
    }
}

impl FromStr for Tool {
    type Err = ToolError;

    fn from_str(text: &str) -> Result<Self, ToolError> {
        let syntax = || ToolError::Syntax(text.to_owned());
        let number = |t: &str| t.trim().parse::<f64>().map_err(|_| syntax());
        let mut parts = text.split(',');
        let (shape, sizes) = parts.next().and_then(|end| end.split_once(':')).ok_or_else(syntax)?;
        let mut tool = Tool::of(match shape.trim() {
            "ball" => End::Ball { radius_mm: number(sizes)? },
            "flat" => End::Flat { radius_mm: number(sizes)? },
            "bull" => {
                let (radius, corner) = sizes.split_once(':').ok_or_else(syntax)?;
                End::Bull { radius_mm: number(radius)?, corner_radius_mm: number(corner)? }
            }
            _ => return Err(ToolError::Shape(text.to_owned())),
        });
        for part in parts {
            let (name, value) = part.split_once(':').ok_or_else(syntax)?;
            let place = match name.trim() {
                "taper" => &mut tool.taper_deg,
                "length" => &mut tool.flute_length_mm,
                "shank" => &mut tool.shank_diameter_mm,
                _ => return Err(syntax()),
            };
            if place.replace(number(value)?).is_some() {
                return Err(syntax());
            }
        }
        tool.checked()
    }
}

impl fmt::Display for Tool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.end {
            End::Ball { radius_mm } => write!(f, "ball:{radius_mm}")?,
            End::Flat { radius_mm } => write!(f, "flat:{radius_mm}")?,
            End::Bull { radius_mm, corner_radius_mm } => write!(f, "bull:{radius_mm}:{corner_radius_mm}")?,
        }
        let more =
            [("taper", self.taper_deg), ("length", self.flute_length_mm), ("shank", self.shank_diameter_mm)];
        for (name, value) in more {
            if let Some(value) = value {
                write!(f, ",{name}:{value}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tool_reads_what_it_writes() {
        for text in [
            "ball:10",
            "flat:6.5",
            "bull:10:2",
            "ball:5,taper:3,length:30,shank:12",
            "ball:5,length:20,shank:8",
            "flat:4,taper:1.5,length:40",
        ] {
            let tool: Tool = text.parse().unwrap();
            assert_eq!(tool.to_string(), text);
            let json = serde_json::to_string(&tool).unwrap();
            assert_eq!(serde_json::from_str::<Tool>(&json).unwrap(), tool, "{json}");
        }
        let any_order: Tool = " ball:5 , shank:12 , length:30 , taper:3".trim().parse().unwrap();
        assert_eq!(any_order.to_string(), "ball:5,taper:3,length:30,shank:12");
    }

    /// The form of job folders that know of balls only.
    #[test]
    fn a_plain_ball_is_written_as_ever() {
        let json = r#"{"shape":"ball","radius_mm":10.0}"#;
        assert_eq!(serde_json::from_str::<Tool>(json).unwrap(), Tool::ball(10.0));
        assert_eq!(serde_json::to_string(&Tool::ball(10.0)).unwrap(), json);
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let error = |text: &str| text.parse::<Tool>().unwrap_err();
        for text in [
            "",
            "ball",
            "ball:",
            "ball:x",
            "bull:10",
            "ball:5,taper",
            "ball:5,hat:3",
            "ball:5,taper:3,taper:4",
        ] {
            assert_eq!(error(text), ToolError::Syntax(text.to_owned()));
        }
        assert_eq!(error("drill:5"), ToolError::Shape("drill:5".to_owned()));
        assert_eq!(error("flat:-1"), ToolError::Radius(-1.0));
        assert!(matches!(error("ball:nan"), ToolError::Radius(_)));
        assert_eq!(error("bull:5:6"), ToolError::Corner { corner_mm: 6.0, radius_mm: 5.0 });
        assert_eq!(error("bull:5:0"), ToolError::Corner { corner_mm: 0.0, radius_mm: 5.0 });
        assert_eq!(error("ball:5,taper:90,length:9"), ToolError::Taper(90.0));
        assert_eq!(error("ball:5,taper:3"), ToolError::NoLength);
        assert_eq!(error("ball:5,shank:3"), ToolError::NoLength);
        assert_eq!(error("ball:5,shank:0,length:9"), ToolError::Shank(0.0));
        assert_eq!(error("ball:5,shank:8,length:4"), ToolError::Length { length_mm: 4.0, end_mm: 5.0 });
        let json = r#"{"shape":"bull","radius_mm":5.0,"corner_radius_mm":7.0}"#;
        let said = serde_json::from_str::<Tool>(json).unwrap_err().to_string();
        assert!(said.contains("a corner radius of 7 mm does not suit"), "{said}");
    }

    #[test]
    fn the_flank_leaves_the_corner_as_a_tangent() {
        let tool: Tool = "bull:10:2,taper:30,length:20,shank:50".parse().unwrap();
        let [[from, top], [below, above]] = tool.sides()[..] else { panic!() };
        let approx = |a: f64, b: f64| approx::assert_abs_diff_eq!(a, b, epsilon = 1e-12);
        // The corner's circle about (8, 2): its point with a normal 30° below the level.
        approx(from[0], 1.0);
        approx(from[1], 8.0 + 3f64.sqrt());
        approx(top[1], from[1] + 19.0 / 3f64.sqrt());
        assert_eq!((below, above), ([20.0, 25.0], [f64::INFINITY, 25.0]));
        assert_eq!((tool.widest_mm(), tool.shank_radius_mm()), (25.0, 25.0));
        let straight = Tool::ball(4.0);
        assert!(straight.is_straight() && straight.sides() == [[[4.0, 4.0], [f64::INFINITY, 4.0]]]);
    }
}
