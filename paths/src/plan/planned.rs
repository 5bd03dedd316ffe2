//! A plan: the program and its totals.

use std::collections::BTreeMap;

use claymill_toolpath::{Area, FaceAccount, Program, RegionTotals, Setup, Totals, UncutReason, raise_tips};

use crate::plan::covered::LeftOut;
use crate::plan::regions::Regions;

/// The program and its totals.
#[derive(Debug, Clone)]
pub struct Plan {
    /// All moves, in machining order.
    pub program: Program,
    /// Time of each, s.
    pub seconds: Vec<f64>,
    /// Setups that cut something.
    pub setups: Vec<Setup>,
    /// Totals by region and setup.
    pub regions: Vec<RegionTotals>,
    /// Totals.
    pub totals: Totals,
    /// Where the area went.
    pub area: Area,
    /// The same by face.
    pub faces: Vec<FaceAccount>,
    /// Area by region and setup name, mm².
    pub region_setup_area_mm2: Vec<BTreeMap<String, f64>>,
    /// Tolerances used, by name.
    pub tolerances: BTreeMap<String, f64>,
    /// Faces that could not be covered with triangles; their boxes were kept clear.
    pub left_out: Vec<LeftOut>,
    /// Passes of which something was left out since shank or holder would run into stock.
    pub struck_passes: u32,
    /// What else was left out, a sentence each.
    pub notes: Vec<String>,
}

impl Plan {
    /// The plan for the ball that leaves this much where the planned one touches: with the same centres.
    pub(crate) fn with_allowance(mut self, allowance_mm: f64) -> Self {
        raise_tips(&mut self.program.moves, allowance_mm);
        for setup in &mut self.setups {
            setup.clearance_mm += allowance_mm;
        }
        self
    }

    /// The accounts of a plan without the faces that were added to the regions' own.
    pub(crate) fn of_own_faces(mut self, regions: &Regions) -> Self {
        self.faces.truncate(regions.of_face.len());
        self.region_setup_area_mm2.truncate(regions.of_face.iter().max().map_or(0, |m| m + 1));
        self.area = self.faces.iter().fold(Area::default(), |mut sum, face| {
            sum.total_mm2 += face.area.total_mm2;
            sum.cut_mm2 += face.area.cut_mm2;
            let uncut: &BTreeMap<UncutReason, f64> = &face.area.uncut_mm2;
            uncut.iter().for_each(|(reason, area)| *sum.uncut_mm2.entry(*reason).or_default() += area);
            sum
        });
        self
    }
}
