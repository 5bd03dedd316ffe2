//! From the parts of a plan to the plan: the order of its parts, the ways between them, what they come to.

use std::collections::BTreeMap;

use claymill_contact::CONTACT_EPSILON_MM;
use claymill_toolpath::{Cancelled, Move};
use rayon::prelude::*;

use crate::containment::Containment;
use crate::link::descent::Standing;
use crate::pattern::levels::sweeps::Sweeps;
use crate::plan::error::PlanError;
use crate::plan::laying::{Laying, Placed, Share};
use crate::plan::options::InProcess;
use crate::plan::planned::Plan;
use crate::program::Output;
use crate::program::in_stock::leave_out_struck;
use crate::program::part::CutShort;
use crate::program::shank::Shank;
use crate::setup::context::SetupContext;

/// Parts of which more than this is left out are laid again, as a share of their area.
const MUCH: f64 = 0.01;

impl Laying<'_> {
    /// Lays the parts that are not known, and joins all of them.
    pub(super) fn plan(&self) -> Result<Plan, PlanError> {
        let shank = self.options.in_process.as_ref().and_then(Shank::of);
        let known = self.known(&self.shares)?;
        // What the shank is struck on is laid again.
        let is_laid = |region: usize| {
            let mut own = self.shares.iter().zip(&known).filter(|(share, _)| share.region == region);
            own.any(|(_, known)| !known.is_known() || shank.is_some())
        };
        let meshes = self.meshes(is_laid)?;
        let sweeps = self.sweeps(&meshes)?;
        let mut parts = self.parts(&self.shares, known, &sweeps)?;
        parts.sort_by_key(|&(setup, region, _)| (setup, region));
        let struck_passes = match shank {
            Some(shank) => self.leave_out(&shank, &mut parts, &sweeps)?,
            None => 0,
        };
        let mut out = self.program(parts, self.options.in_process.as_ref());
        if out.program.moves.is_empty() {
            let is_rest = self.options.is_rest();
            return Err(if is_rest { PlanError::NoRest } else { PlanError::NothingToCut });
        }
        out.add_up();
        Ok(self.planned(out, struck_passes))
    }

    /// The program of parts in the order of setups and regions, with leads as short as the stock allows where it is given.
    fn program(&self, parts: Vec<Placed>, stock: Option<&InProcess>) -> Output {
        let mut out = Output::default();
        let mut parts = parts.into_iter().peekable();
        for context in &self.contexts {
            let of_setup = std::iter::from_fn(|| parts.next_if(|(setup, ..)| *setup == context.index));
            let of_setup = of_setup.map(|(_, region, part)| (region, part)).collect();
            let standing = stock.and_then(|stock| Standing::of(stock, context.frame.axis()));
            out.setup(context, self.account, of_setup, &self.options.machine, standing.as_ref());
        }
        out
    }

    /// Leaves out of parts what the shank cannot follow into the stock; how many passes are not whole.
    fn leave_out(
        &self,
        shank: &Shank,
        parts: &mut Vec<Placed>,
        sweeps: &[Option<Sweeps>],
    ) -> Result<u32, Cancelled> {
        let moves = |parts: &[Placed]| -> Vec<Move> { self.program(parts.to_vec(), None).program.moves };
        let mut cut_short = leave_out_struck(shank, &self.contexts, parts, moves, self.monitor)?;
        let is_much = |(&(setup, region), found): (&(usize, usize), &CutShort)| {
            let left_out_mm2 = found.left_out_mm * self.contexts[setup].flat_step_mm();
            left_out_mm2 > MUCH * self.area_mm2(&Share { setup, region })
        };
        let again: Vec<_> = cut_short.iter().filter(|found| is_much(*found)).map(|(of, _)| *of).collect();
        let count = |all: &BTreeMap<_, CutShort>| all.values().map(|found| found.passes).sum::<u32>();
        if again.is_empty() || !self.options.tool.is_ball() {
            return Ok(count(&cut_short));
        }
        // Again, up to where the shank stands clear. Once more would leave out as much elsewhere.
        let radius_mm = self.options.tool.radius_mm();
        let mut rooms = shank.rooms(moves(parts), self.frames, radius_mm, self.monitor)?;
        let keeps: Vec<Option<Containment>> =
            self.frames.iter().map(|f| (self.kept_in)(f, rooms.remove(f.name.as_str()))).collect();
        let contexts: Vec<SetupContext> = (self.contexts.iter().zip(&keeps))
            .map(|(context, kept)| SetupContext { containment: kept.as_ref(), ..*context })
            .collect();
        let part = |&(setup, region): &(usize, usize)| {
            self.monitor.go_on()?;
            let part = self.lay(&contexts, &Share { setup, region }, sweeps);
            Ok(part.map(|part| (setup, region, part)))
        };
        let laid = again.par_iter().with_max_len(1).map(part).collect::<Result<Vec<_>, Cancelled>>()?;
        parts.retain(|&(setup, region, _)| !again.contains(&(setup, region)));
        parts.extend(laid.into_iter().flatten());
        parts.sort_by_key(|&(setup, region, _)| (setup, region));
        cut_short.retain(|of, _| !again.contains(of));
        let others = count(&cut_short);
        Ok(others + count(&leave_out_struck(shank, &contexts, parts, moves, self.monitor)?))
    }

    fn planned(&self, out: Output, struck_passes: u32) -> Plan {
        let (area, faces) = self.account.faces(self.model, self.regions, self.free, self.bare);
        let name_areas = |region: usize| {
            let named =
                self.frames.iter().zip(self.account.region_setup_mm2[region]).filter(|(_, a)| *a > 0.0);
            named.map(|(f, a)| (f.name.to_string(), a)).collect()
        };
        Plan {
            region_setup_area_mm2: (0..self.faces_of.len()).map(name_areas).collect(),
            program: out.program,
            seconds: out.seconds,
            setups: out.setups,
            regions: out.regions,
            totals: out.totals,
            area,
            faces,
            tolerances: [
                ("contact_mm", CONTACT_EPSILON_MM),
                ("fit_bias_mm", self.tolerance.bias_mm),
                ("fit_mm", self.tolerance.fit_mm),
                ("clearance_mm", self.options.clearance_mm),
            ]
            .map(|(name, value)| (name.to_owned(), value))
            .into(),
            left_out: Vec::new(),
            struck_passes,
            notes: Vec::new(),
        }
    }
}
