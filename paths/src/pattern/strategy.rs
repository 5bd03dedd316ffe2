//! The names of the strategies, and which ones `auto` lays out to choose from. The patterns
//! themselves are elsewhere.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Where passes run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Strategy {
    /// Parallel rows over whole regions, seen along the tool axis, closer where the surface asks for it.
    Planar,
    /// Lines that sweep a whole region from one side to the other: level curves of a harmonic field.
    Flow,
    /// Lines at a constant scallop height from one side of a region.
    Scallop,
    /// Lines on which the ball's centre keeps its height along the tool axis; parallel rows where the surface is too
    /// shallow for them.
    Waterline,
    /// Parallel rows where the surface is shallow, waterlines where it is steep, with an overlap.
    SteepShallow,
    /// Parameter lines of every patch by itself.
    Isoparametric,
    /// For each region whatever costs least of planar, flow, scallop and the parameter lines of its patches.
    Auto,
}

impl Strategy {
    /// Whether passes run on region meshes.
    pub(crate) fn sweeps_regions(self) -> bool {
        !matches!(self, Strategy::Planar | Strategy::Isoparametric)
    }

    /// What is laid out for a part, to choose from.
    pub(crate) fn candidates(self) -> &'static [Strategy] {
        match self {
            Strategy::Planar => &[Strategy::Planar],
            Strategy::Flow => &[Strategy::Flow],
            Strategy::Scallop => &[Strategy::Scallop],
            Strategy::Waterline => &[Strategy::Waterline],
            Strategy::SteepShallow => &[Strategy::SteepShallow],
            Strategy::Isoparametric => &[Strategy::Isoparametric],
            Strategy::Auto => &[Strategy::Planar, Strategy::Flow, Strategy::Scallop, Strategy::Isoparametric],
        }
    }
}

impl fmt::Display for Strategy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Strategy::Planar => "planar",
            Strategy::Flow => "flow",
            Strategy::Scallop => "scallop",
            Strategy::Waterline => "waterline",
            Strategy::SteepShallow => "steep-shallow",
            Strategy::Isoparametric => "isoparametric",
            Strategy::Auto => "auto",
        })
    }
}
