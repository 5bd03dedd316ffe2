//! The form in which a whole plan is kept.

use std::collections::BTreeMap;

use claymill_toolpath::{Area, FaceAccount, Move, Program, RegionTotals, Setup, Totals};
use serde::{Deserialize, Serialize};

use crate::plan::planned::Plan;

/// A plan of which no face was left out.
#[derive(Serialize, Deserialize)]
pub(crate) struct KeptPlan {
    moves: Vec<Move>,
    seconds: Vec<f64>,
    setups: Vec<Setup>,
    regions: Vec<RegionTotals>,
    totals: Totals,
    area: Area,
    faces: Vec<FaceAccount>,
    region_setup_area_mm2: Vec<BTreeMap<String, f64>>,
    tolerances: BTreeMap<String, f64>,
    struck_passes: u32,
}

impl KeptPlan {
    /// `None` where faces were left out: why is found out anew each time.
    pub(crate) fn of(plan: &Plan) -> Option<Self> {
        plan.left_out.is_empty().then(|| KeptPlan {
            moves: plan.program.moves.clone(),
            seconds: plan.seconds.clone(),
            setups: plan.setups.clone(),
            regions: plan.regions.clone(),
            totals: plan.totals,
            area: plan.area.clone(),
            faces: plan.faces.clone(),
            region_setup_area_mm2: plan.region_setup_area_mm2.clone(),
            tolerances: plan.tolerances.clone(),
            struck_passes: plan.struck_passes,
        })
    }

    /// The plan.
    pub(crate) fn plan(self) -> Plan {
        Plan {
            program: Program { moves: self.moves },
            seconds: self.seconds,
            setups: self.setups,
            regions: self.regions,
            totals: self.totals,
            area: self.area,
            faces: self.faces,
            region_setup_area_mm2: self.region_setup_area_mm2,
            tolerances: self.tolerances,
            left_out: Vec::new(),
            notes: Vec::new(),
            struck_passes: self.struck_passes,
        }
    }
}
