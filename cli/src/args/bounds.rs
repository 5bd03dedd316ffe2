//! Where the tool is kept.

use clap::{Args, ValueEnum};
use claymill_toolpath::{Bounds, Contain};
use serde::{Deserialize, Serialize};

use super::{CHOICE, first_given};
use crate::failure::Failure;

/// Distance kept from what is to be avoided, where none is asked for, mm.
const USUAL_MARGIN_MM: f64 = 1.0;

#[derive(Debug, Clone, Default, Args, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct BoundsArgs {
    /// Box that the tool stays in, by two corners in the model's coordinates, mm; coordinates left out are sides left out, as in
    /// 1200,,:2400,,. With several the tool stays in one of them.
    #[arg(help_heading = CHOICE, long, value_name = "X,Y,Z:X,Y,Z", allow_hyphen_values = true)]
    pub(crate) within: Vec<String>,
    /// What of the tool stays in the box, seen along the tool axis; centre and edge also stay over what is cut [default: contact].
    #[arg(help_heading = CHOICE, long, value_enum)]
    pub(crate) contain: Option<ContainName>,
    /// Box that the centre of the ball is in on passes, same form: outside it cuts nothing, as beside the block that a model is
    /// roughed from.
    #[arg(help_heading = CHOICE, long, value_name = "X,Y,Z:X,Y,Z", allow_hyphen_values = true)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) centre_within: Option<String>,
    /// Keep away from these faces, which are not cut; same forms as --only.
    #[arg(help_heading = CHOICE, long, value_name = "WHAT", value_delimiter = ',')]
    pub(crate) avoid: Vec<String>,
    /// How far the tool keeps away from what --avoid names, mm [default: 1].
    #[arg(help_heading = CHOICE, long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) avoid_margin: Option<f64>,
    /// Let passes run on straight over open borders, mm [default: 0].
    #[arg(help_heading = CHOICE, long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) extend: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ContainName {
    /// The point where it touches the model.
    Contact,
    /// The centre of the ball.
    Centre,
    /// The whole ball.
    Edge,
}

impl BoundsArgs {
    /// These before others.
    pub(crate) fn over(self, second: BoundsArgs) -> Self {
        BoundsArgs {
            within: first_given(self.within, second.within),
            contain: self.contain.or(second.contain),
            centre_within: self.centre_within.or(second.centre_within),
            avoid: first_given(self.avoid, second.avoid),
            avoid_margin: self.avoid_margin.or(second.avoid_margin),
            extend: self.extend.or(second.extend),
        }
    }

    /// All but the faces, which are known when there is a model.
    pub(crate) fn bounds(&self) -> Result<Bounds, Failure> {
        if self.avoid_margin.is_some() && self.avoid.is_empty() {
            let example = "For example: --avoid layer:GLASS --avoid-margin 2.";
            return Err(Failure::usage("--avoid-margin is for what --avoid names", example));
        }
        Ok(Bounds {
            contain: match self.contain {
                None | Some(ContainName::Contact) => Contain::Contact,
                Some(ContainName::Centre) => Contain::Centre,
                Some(ContainName::Edge) => Contain::Edge,
            },
            within_mm: self.within.iter().map(|text| sides(text)).collect::<Result<_, _>>()?,
            centre_within_mm: self.centre_within.as_deref().map(sides).transpose()?,
            avoid: Vec::new(),
            avoid_mm: if self.avoid.is_empty() { 0.0 } else { self.avoid_margin.unwrap_or(USUAL_MARGIN_MM) },
            extend_mm: self.extend.unwrap_or(0.0),
        })
    }
}

/// The sides of a box.
pub(crate) fn sides(text: &str) -> Result<[f64; 6], Failure> {
    const EXAMPLE: &str = "For example: --within 1200,-600,0:2400,600,900, or --within 1200,,:2400,,.";
    let bad = |what: &str| Failure::usage(format!("box {text:?} {what}"), EXAMPLE);
    let corner = |text: &str, far_mm: f64| -> Option<Vec<f64>> {
        let number = |n: &str| match n.trim() {
            "" => Some(far_mm),
            n => n.parse().ok().filter(|n: &f64| n.is_finite()),
        };
        text.split(',').map(number).collect()
    };
    let corners =
        text.split_once(':').and_then(|(a, b)| corner(a, -Bounds::FAR_MM).zip(corner(b, Bounds::FAR_MM)));
    let Some((&[x0, y0, z0], &[x1, y1, z1])) =
        corners.as_ref().and_then(|(a, b)| Some((a.first_chunk::<3>()?, b.first_chunk::<3>()?)))
    else {
        return Err(bad("is not two corners of three coordinates each"));
    };
    if corners.is_some_and(|(a, b)| a.len() > 3 || b.len() > 3) {
        return Err(bad("has more than three coordinates in a corner"));
    }
    Ok([x0, y0, z0, x1, y1, z1])
}
