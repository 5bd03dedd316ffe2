//! Tool holders as stacked cones and cylinders above a stick-out, their one-line text form, and the
//! usual shrink-fit chuck for a shank.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::Tool;

/// What holds a tool: cones and cylinders stacked over the shank, turned about the tool axis.
///
/// Heights are counted from the tip, so that moves, which hold the tip, say where the holder is. Written on one line
/// it is the stick-out and, after a colon, the sections from the tool up: `60:27-34x50,63x26`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Holder {
    /// From the tip to the lower end of the holder, mm: so much of the tool sticks out.
    pub stick_out_mm: f64,
    /// From the tool up.
    pub sections: Vec<HolderSection>,
}

/// A frustum of a holder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HolderSection {
    /// Diameter at the end towards the tip, mm.
    pub lower_diameter_mm: f64,
    /// Diameter at the end towards the spindle, mm.
    pub upper_diameter_mm: f64,
    /// Length along the axis, mm.
    pub length_mm: f64,
}

/// Why a holder could not be understood.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum HolderError {
    /// Not of the form that is asked for.
    #[error(
        "`{0}` is not a holder; write the stick-out in mm, for example 60, and if the usual chuck is not meant its \
         sections from the tool up as diameters and length: 60:27-34x50,63x26"
    )]
    Syntax(String),
    /// The ball would not stick out.
    #[error(
        "a stick-out of {stick_out_mm} mm leaves nothing of a ball of radius {radius_mm} mm below the holder"
    )]
    StickOut {
        /// As asked for.
        stick_out_mm: f64,
        /// Of the tool.
        radius_mm: f64,
    },
}

/// No holder is longer or thicker, mm.
pub(crate) const LONGEST_MM: f64 = 1e4;
/// Shrink-fit chucks on HSK-A63 (DIN 69882-8): largest shank, diameters of the nose's lower and upper end, mm.
const SHRINK_FIT_MM: [[f64; 3]; 5] =
    [[8.0, 21.0, 27.0], [12.0, 24.0, 32.0], [16.0, 27.0, 34.0], [20.0, 33.0, 42.0], [32.0, 44.0, 53.0]];
/// Length of their nose, and the flange's diameter and length, mm.
const NOSE_MM: f64 = 54.0;
const FLANGE_MM: [f64; 2] = [63.0, 26.0];

impl Holder {
    /// The usual chuck for a tool: shrink-fit on HSK-A63; for thicker shanks one that grows with them.
    #[must_use]
    pub fn usual(stick_out_mm: f64, tool: &Tool) -> Self {
        let shank_mm = 2.0 * tool.shank_radius_mm();
        let fitting = SHRINK_FIT_MM.iter().find(|[largest, ..]| shank_mm <= *largest);
        let [lower_diameter_mm, upper_diameter_mm] =
            fitting.map_or([shank_mm + 12.0, shank_mm + 21.0], |[_, lower, upper]| [*lower, *upper]);
        let [flange_mm, length_mm] = FLANGE_MM;
        let flange_mm = flange_mm.max(upper_diameter_mm + 10.0);
        Holder {
            stick_out_mm,
            sections: vec![
                HolderSection { lower_diameter_mm, upper_diameter_mm, length_mm: NOSE_MM },
                HolderSection { lower_diameter_mm: flange_mm, upper_diameter_mm: flange_mm, length_mm },
            ],
        }
    }

    /// The holder that is written on one line, for a tool: `60` with the usual chuck, `60:27-34x50,63x26` with its own.
    ///
    /// # Errors
    /// Not of that form; a size that is not positive; a stick-out that does not leave the ball free.
    pub fn parse(text: &str, tool: &Tool) -> Result<Self, HolderError> {
        let syntax = || HolderError::Syntax(text.to_owned());
        let size = |t: &str| {
            t.trim().parse::<f64>().ok().filter(|v| *v > 0.0 && *v <= LONGEST_MM).ok_or_else(syntax)
        };
        let (stick_out, sections) = text.split_once(':').map_or((text, None), |(s, more)| (s, Some(more)));
        let stick_out_mm = size(stick_out)?;
        if stick_out_mm < tool.radius_mm() {
            return Err(HolderError::StickOut { stick_out_mm, radius_mm: tool.radius_mm() });
        }
        let Some(sections) = sections else {
            return Ok(Holder::usual(stick_out_mm, tool));
        };
        let section = |t: &str| {
            let (diameters, length) = t.split_once('x').ok_or_else(syntax)?;
            let (lower, upper) = diameters.split_once('-').unwrap_or((diameters, diameters));
            Ok(HolderSection {
                lower_diameter_mm: size(lower)?,
                upper_diameter_mm: size(upper)?,
                length_mm: size(length)?,
            })
        };
        Ok(Holder { stick_out_mm, sections: sections.split(',').map(section).collect::<Result<_, _>>()? })
    }

    /// The outline in a plane through the axis: height above the tip and radius at the ends of every section, mm.
    pub fn profile(&self) -> impl Iterator<Item = [[f64; 2]; 2]> {
        self.sections.iter().scan(self.stick_out_mm, |height, s| {
            let lower = *height;
            *height += s.length_mm;
            Some([[lower, 0.5 * s.lower_diameter_mm], [*height, 0.5 * s.upper_diameter_mm]])
        })
    }

    /// Height of the upper end above the tip, mm.
    #[must_use]
    pub fn top_mm(&self) -> f64 {
        self.stick_out_mm + self.sections.iter().map(|s| s.length_mm).sum::<f64>()
    }
}

impl std::fmt::Display for Holder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.stick_out_mm)?;
        for (i, s) in self.sections.iter().enumerate() {
            write!(f, "{}{}", if i == 0 { ':' } else { ',' }, s.lower_diameter_mm)?;
            if s.upper_diameter_mm != s.lower_diameter_mm {
                write!(f, "-{}", s.upper_diameter_mm)?;
            }
            write!(f, "x{}", s.length_mm)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BALL: Tool = Tool::ball(6.0);

    #[test]
    fn a_holder_reads_what_it_writes_and_stands_on_its_stick_out() {
        for text in ["60:27-34x50,63x26", "45.5:30x40", "12:20-10x3.25"] {
            let holder = Holder::parse(text, &BALL).unwrap();
            assert_eq!(holder.to_string(), text);
            assert_eq!(Holder::parse(&holder.to_string(), &BALL), Ok(holder));
        }
        let holder = Holder::parse("60:27-34x50,63x26", &BALL).unwrap();
        let profile: Vec<_> = holder.profile().collect();
        assert_eq!(profile, [[[60.0, 13.5], [110.0, 17.0]], [[110.0, 31.5], [136.0, 31.5]]]);
        assert_eq!(holder.top_mm(), 136.0);
    }

    #[test]
    fn the_usual_chuck_is_thicker_than_any_shank() {
        for radius_mm in [0.5, 3.0, 6.0, 10.0, 16.0, 30.0, 80.0] {
            let holder = Holder::usual(200.0, &Tool::ball(radius_mm));
            let radii: Vec<f64> = holder.profile().flatten().map(|p| p[1]).collect();
            assert!(radii[0] > radius_mm && radii.is_sorted(), "{radii:?}");
        }
        assert_eq!(Holder::parse("60", &BALL), Ok(Holder::usual(60.0, &BALL)));
    }

    #[test]
    fn what_is_no_holder_is_refused() {
        for text in [
            "", "sixty", "60:", "60:27", "60:27x", "60:27-x5", "60:0x5", "60:-3x5", "nan", "inf:3x4",
            "60:1x1,",
        ] {
            assert_eq!(Holder::parse(text, &BALL), Err(HolderError::Syntax(text.to_owned())));
        }
        let error = Holder::parse("5", &BALL).unwrap_err();
        assert!(error.to_string().contains("5 mm leaves nothing"), "{error}");
    }
}
