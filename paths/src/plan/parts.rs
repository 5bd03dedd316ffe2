//! The parts of a plan by themselves, so that several processes may lay them: each is what one setup cuts of one region.

use std::collections::BTreeSet;

use claymill_nurbs::{Model, Point3};
use claymill_toolpath::{Monitor, PartKey};

use crate::plan::error::PlanError;
use crate::plan::laying::{Laying, Share};
use crate::plan::obstacles::among_obstacles;
use crate::plan::options::PlanOptions;
use crate::plan::regions::Regions;
use crate::plan::with_whole;

/// A part of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanPart {
    /// What it follows from.
    pub key: PartKey,
    /// The setup that cuts it, by its name.
    pub setup: String,
    /// Of which region.
    pub region: usize,
    /// Area that is cut, mm².
    pub area_mm2: f64,
    /// Whether it is in the store.
    pub is_kept: bool,
}

/// The parts that a plan would be joined from, largest first; those that are `wanted` are laid, if the store has not got them, and
/// kept. Of a plan in stock these are the passes before it is known which of them the shank cannot follow.
///
/// # Errors
/// There is no store; and as [`plan()`](crate::plan()).
pub fn lay_parts(
    model: &Model,
    regions: &Regions,
    obstacles: &[[Point3; 3]],
    options: &PlanOptions,
    wanted: &BTreeSet<PartKey>,
    monitor: &dyn Monitor,
) -> Result<Vec<PlanPart>, PlanError> {
    if !options.kept.is_somewhere() {
        return Err(PlanError::KeptNowhere);
    }
    among_obstacles(model, regions, obstacles, |model, regions, obstacles| {
        with_whole(model, regions, obstacles, options, monitor, |laying| laying.lay_wanted(wanted))
    })
}

impl Laying<'_> {
    fn lay_wanted(&self, wanted: &BTreeSet<PartKey>) -> Result<Vec<PlanPart>, PlanError> {
        let keyed = |share: &Share| self.key(share).map(|key| (*share, key));
        let keyed: Vec<(Share, PartKey)> = self.shares.iter().filter_map(keyed).collect();
        let own: Vec<Share> =
            keyed.iter().filter(|(_, key)| wanted.contains(key)).map(|(share, _)| *share).collect();
        if !own.is_empty() {
            let known = self.known(&own)?;
            let is_laid = |region: usize| {
                own.iter().zip(&known).any(|(share, known)| share.region == region && !known.is_known())
            };
            let meshes = self.meshes(is_laid)?;
            let sweeps = self.sweeps(&meshes)?;
            self.parts(&own, known, &sweeps)?;
        }
        let part = |(share, key): (Share, PartKey)| PlanPart {
            key,
            setup: self.frames[share.setup].name.to_string(),
            region: share.region,
            area_mm2: self.area_mm2(&share),
            is_kept: self.options.kept.has(&key),
        };
        Ok(keyed.into_iter().map(part).collect())
    }
}
