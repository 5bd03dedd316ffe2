//! The exact paths of a part, and by which strategy it is cut.
//!
//! ```text
//!   planar   ████████████                  whole: nothing was missing any more
//!   iso      ████████████▒▒▒·              given up: already costs more
//!   scallop  ██████████▒▒▒▒▒               cost so far ──►
//! ```
//!
//! Strategies are laid side by side, round by round, and always the one goes on that costs least so far. A round only adds
//! to the cost: the first that is whole has won.

pub(crate) mod end_cut;
pub(crate) mod end_step;
pub(crate) mod gaps;
pub(crate) mod levels;
pub(crate) mod near;
pub(crate) mod part_region;
pub(crate) mod pencil;
pub(crate) mod rows;
pub(crate) mod step_over;
pub(crate) mod strategy;
pub(crate) mod together;
pub(crate) mod walls;

use std::collections::BTreeSet;

use claymill_nurbs::FaceId;
use claymill_toolpath::Considered;

use crate::follow::profile::Profile;
use crate::follow::proofs::Proofs;
use crate::pattern::levels::LevelRounds;
use crate::pattern::levels::patch::PatchLevels;
use crate::pattern::levels::pattern::Levels;
use crate::pattern::levels::waterline::CentreHeights;
use crate::pattern::part_region::PartRegion;
use crate::pattern::rows::RowRounds;
use crate::pattern::rows::crests::PlannedPass;
use crate::setup::context::{SetupContext, TURN_MM};
use crate::setup::slopes::{Limit, Slopes};
use crate::{RowsAlong, Strategy};

/// Parts smaller than this are cut by the first candidate, in squares of the step-over on a plane: there is little to gain, and
/// rows leave the least at rims.
const WORTH_A_CHOICE_STEPS2: f64 = 25.0;

/// Ground shallower than this has no waterlines but rows, degrees: contour lines wander there, and for the same scallop
/// height their levels would be closer than a quarter of the step-over.
const SHALLOWEST_DEG: f64 = 15.0;

/// The exact paths of a part by one strategy.
pub(crate) struct Layout<'p> {
    pub(crate) strategy: Strategy,
    /// Cut one after the other.
    pub(crate) groups: Vec<Vec<PlannedPass>>,
    pub(crate) proofs: Proofs,
    /// Direction of straight rows.
    pub(crate) along: Option<RowsAlong>,
    rest: Rest<'p>,
}

/// What is still to be laid.
enum Rest<'p> {
    Nothing,
    Rows(RowRounds),
    Levels(LevelRounds<'p>),
}

impl<'p> Layout<'p> {
    fn new(strategy: Strategy, along: Option<RowsAlong>, rest: Rest<'p>) -> Self {
        Layout { strategy, groups: vec![Vec::new()], proofs: Proofs::default(), along, rest }
    }

    fn goes_on(&self) -> bool {
        match &self.rest {
            Rest::Nothing => false,
            // In the end what they leave out is mended.
            Rest::Rows(_) | Rest::Levels(_) => true,
        }
    }

    fn is_empty(&self) -> bool {
        self.groups.iter().flatten().all(|laid| laid.chains.is_empty())
    }

    fn considered(&self) -> Considered {
        let chains = || self.groups.iter().flatten().flat_map(|l| &l.chains);
        let length_mm = chains().flatten().map(Profile::length_mm).sum();
        let (strategy, passes) = (self.strategy.to_string(), chains().count() as u32);
        Considered { strategy, length_mm, passes, given_up: self.goes_on() }
    }
}

impl SetupContext<'_> {
    /// The paths by the strategy that costs least, in length and turns, and what each one came to.
    pub(crate) fn choose<'b, 'a: 'b, 'm: 'b>(
        &'b self,
        ground: &PartRegion<'_, 'a, 'm>,
    ) -> Option<(Layout<'b>, Vec<Considered>)> {
        let tiny = ground.area_mm2 < WORTH_A_CHOICE_STEPS2 * self.flat_step_mm().powi(2);
        let candidates = match self.strategy.candidates() {
            [first, _, ..] if tiny => std::slice::from_ref(first).iter(),
            all => all.iter(),
        };
        let mut layouts: Vec<Layout> = candidates.filter_map(|&s| self.begin(s, ground)).collect();
        loop {
            let considered: Vec<Considered> = layouts.iter().map(Layout::considered).collect();
            let cost_mm = |c: &Considered| c.length_mm + TURN_MM * f64::from(c.passes);
            let costs_mm = considered.iter().map(cost_mm).enumerate();
            let (best, _) = costs_mm.min_by(|a, b| a.1.total_cmp(&b.1))?;
            if layouts[best].goes_on() {
                self.lay_more(&mut layouts[best], ground);
            } else if layouts[best].is_empty() && layouts.len() > 1 {
                layouts.remove(best);
            } else {
                return Some((layouts.swap_remove(best), considered));
            }
        }
    }

    /// All of the paths by one strategy.
    fn lay<'b, 'a: 'b, 'm: 'b>(
        &'b self,
        strategy: Strategy,
        ground: &PartRegion<'_, 'a, 'm>,
    ) -> Option<Layout<'b>> {
        Some(self.lay_rest(self.begin(strategy, ground)?, ground))
    }

    fn lay_rest<'b>(&self, mut layout: Layout<'b>, ground: &PartRegion) -> Layout<'b> {
        while layout.goes_on() {
            self.lay_more(&mut layout, ground);
        }
        layout
    }

    /// The first round of the paths by one strategy.
    fn begin<'b, 'a: 'b, 'm: 'b>(
        &'b self,
        strategy: Strategy,
        ground: &PartRegion<'_, 'a, 'm>,
    ) -> Option<Layout<'b>> {
        let mut layout = match strategy {
            Strategy::Planar => {
                let rounds = self.begin_rows(ground, |_, _| true)?;
                Layout::new(strategy, Some(rounds.along), Rest::Rows(rounds))
            }
            Strategy::Waterline => return self.lay_by_slope(strategy, SHALLOWEST_DEG, ground),
            Strategy::SteepShallow => return self.lay_by_slope(strategy, self.steep_deg, ground),
            Strategy::Flow | Strategy::Scallop | Strategy::Isoparametric | Strategy::Auto => {
                let sweep = ground.sweeps.and_then(|sweeps| sweeps.of(strategy, self));
                let covered = sweep.as_ref().map(|sweep| sweep.faces()).unwrap_or_default();
                let fields = sweep.iter().flat_map(|sweep| sweep.levels(self));
                let rounds = self.begin_levels(self.patterns(ground.faces, &covered, fields));
                Layout::new(strategy, None, Rest::Levels(rounds))
            }
        };
        self.lay_more(&mut layout, ground);
        Some(layout)
    }

    /// Lays one more round.
    fn lay_more(&self, layout: &mut Layout, ground: &PartRegion) {
        let Some(laid) = layout.groups.first_mut() else { return };
        layout.proofs += match &mut layout.rest {
            Rest::Nothing => Proofs::default(),
            Rest::Rows(rounds) if rounds.go_on() => self.lay_rows(rounds, laid, ground),
            Rest::Levels(rounds) if rounds.go_on() => self.lay_levels(rounds, laid, ground),
            Rest::Rows(_) | Rest::Levels(_) => {
                layout.rest = Rest::Nothing;
                // So many lines were asked for, whatever they leave.
                if self.lines.is_some() {
                    return;
                }
                let (rows, proofs) = self.mend(laid, ground);
                layout.groups.push(rows);
                proofs
            }
        };
    }

    /// Fields, and what they do not cover patch by patch.
    fn patterns<'b>(
        &'b self,
        faces: &[FaceId],
        covered: &BTreeSet<FaceId>,
        fields: impl IntoIterator<Item = impl Levels + 'b>,
    ) -> Vec<Box<dyn Levels + 'b>> {
        let alone = faces.iter().filter(|&&f| self.claims.any(f) && !covered.contains(&f));
        let mut patterns: Vec<Box<dyn Levels + 'b>> =
            alone.map(|&f| Box::new(PatchLevels::new(f, &self.model.faces[f], self.lines)) as _).collect();
        patterns.extend(fields.into_iter().map(|f| Box::new(f) as _));
        patterns
    }

    /// Rows where the surface is shallow, then waterlines where it is steep; both overlap by a step-over.
    fn lay_by_slope<'b, 'a: 'b, 'm: 'b>(
        &'b self,
        strategy: Strategy,
        limit_deg: f64,
        ground: &PartRegion<'_, 'a, 'm>,
    ) -> Option<Layout<'b>> {
        let limit = Limit::new(limit_deg, self.flat_step_mm());
        let steep = SetupContext { slopes: Slopes::Steeper(limit), ..*self };
        let shallow = SetupContext { slopes: Slopes::Shallower(limit), ..*self };
        let heights = ground.sweeps.map(|sweeps| CentreHeights::new(sweeps.mesh, &steep));
        let covered = heights.as_ref().map(CentreHeights::faces).unwrap_or_default();
        let fields = heights.iter().flat_map(CentreHeights::waterlines);
        let waterlines = steep.begin_levels(steep.patterns(ground.faces, &covered, fields));
        let steep_layout = steep.lay_rest(Layout::new(strategy, None, Rest::Levels(waterlines)), ground);
        let rows = shallow.lay(Strategy::Planar, ground);
        let mut layout = Layout::new(strategy, rows.as_ref().and_then(|r| r.along), Rest::Nothing);
        layout.proofs += [rows.iter().map(|r| r.proofs).sum(), steep_layout.proofs].into_iter().sum();
        if steep_layout.is_empty() {
            layout.strategy = Strategy::Planar;
        }
        layout.groups = rows.map_or_else(Vec::new, |r| r.groups);
        layout.groups.extend(steep_layout.groups);
        (!layout.is_empty()).then_some(layout)
    }
}
