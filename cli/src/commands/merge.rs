use std::process::ExitCode;

use claymill_surface_merge::{Merge, MergeOptions, Preset, merge as find_regions};
use claymill_toolpath::{FORMAT_VERSION, FolderWriter, JointRecord, REGIONS_FILE, RegionRecord, RegionsFile};

use super::{Context, Loaded, box_mm};
use crate::args::{MergeArgs, PresetName};
use crate::failure::Failure;

impl From<PresetName> for Preset {
    fn from(name: PresetName) -> Self {
        match name {
            PresetName::ClassA => Preset::ClassA,
            PresetName::Clay => Preset::Clay,
            PresetName::Tangent => Preset::Tangent,
            PresetName::Paper => Preset::Paper,
        }
    }
}
