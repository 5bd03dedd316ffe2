//! The program: setup by setup the parts with the ways between them, and what they come to.

pub(crate) mod account;
pub(crate) mod in_stock;
pub(crate) mod kept_part;
pub(crate) mod kinematics;
pub(crate) mod part;
pub(crate) mod shank;

use std::collections::BTreeMap;

use claymill_toolpath::{LengthByKind, MachineLimits, Move, Program, RegionTotals, Setup, Totals};

use rayon::prelude::*;

use crate::link::descent::Standing;
use crate::link::leads::End;
use crate::link::order::{Ends, order_parts};
use crate::program::account::Account;
use crate::program::kinematics::times_s;
use crate::program::part::Part;
use crate::setup::context::SetupContext;

/// Identity of the only tool.
pub const TOOL_ID: &str = "T1";

#[derive(Default)]
pub(crate) struct Output {
    pub(crate) program: Program,
    /// Time of each move, s.
    pub(crate) seconds: Vec<f64>,
    pub(crate) setups: Vec<Setup>,
    pub(crate) regions: Vec<RegionTotals>,
    pub(crate) totals: Totals,
}

impl Output {
    /// Appends a setup: its parts with the ways between them, and with leads as short as what stands there allows.
    pub(crate) fn setup(
        &mut self,
        context: &SetupContext,
        account: &Account,
        mut parts: Vec<(usize, Part)>,
        machine: &MachineLimits,
        standing: Option<&Standing>,
    ) {
        let name = context.frame.name.as_str();
        let first_move = self.program.moves.len();
        let first_region = self.regions.len();
        // What was put off comes when all else is done.
        let most = parts.iter().map(|(_, part)| part.moves.len()).max().unwrap_or(0);
        let mut by_put_off: Vec<Vec<(usize, Vec<Move>)>> = vec![Vec::new(); most];
        for (region, part) in &mut parts {
            for (of_all, moves) in by_put_off.iter_mut().zip(std::mem::take(&mut part.moves)) {
                of_all.push((*region, moves));
            }
        }
        let of: BTreeMap<usize, Part> = parts.into_iter().collect();
        let parts: Vec<(usize, Vec<Move>)> = by_put_off.into_iter().flat_map(in_order).collect();
        let over = |w: &[(usize, Vec<Move>)]| -> Vec<Move> {
            let ends = w[0].1.last().and_then(behind).zip(w[1].1.first().and_then(before));
            ends.map_or_else(Vec::new, |(from, to)| context.lift_over(from, to))
        };
        let approach = parts.first().and_then(|(_, moves)| Some(context.approach(before(moves.first()?)?)));
        let ways: Vec<Vec<Move>> =
            approach.into_iter().chain(parts.par_windows(2).map(over).collect::<Vec<_>>()).collect();
        for (k, ((region, moves), way)) in parts.into_iter().zip(ways).enumerate() {
            let way = way.into_iter().map(|m| Move { pass: moves.first().map_or(0, |to| to.pass), ..m });
            let way: Vec<Move> = way.collect();
            self.program.moves.extend(way.into_iter().chain(moves).map(|m| Move { region, ..m }));
            let retracts = u32::from(k > 0);
            if let Some(totals) = self.regions[first_region..].iter_mut().find(|r| r.region == region) {
                totals.retracts += retracts;
                continue;
            }
            let part = &of[&region];
            self.regions.push(RegionTotals {
                region,
                setup: name.to_owned(),
                strategy: part.strategy.to_string(),
                considered: part.considered.clone(),
                area_mm2: account.region_setup_mm2[region][context.index],
                pass_direction: part.along.map(|along| along.direction(&context.frame).into()),
                passes: part.passes,
                retracts: part.retracts + retracts,
                length: LengthByKind::default(),
                control_points: 0,
                time_s: 0.0,
            });
            self.totals.locations += part.proofs.locations;
            self.totals.certified_locations += part.proofs.certified;
            self.totals.lifted_locations += part.proofs.lifted;
        }
        if let Some((end, region, pass)) =
            self.program.moves[first_move..].last().and_then(|m| Some((behind(m)?, m.region, m.pass)))
        {
            let up = context.retreat(end);
            self.program.moves.extend(up.into_iter().map(|m| Move { region, pass, ..m }));
        }
        if let Some(standing) = standing {
            context.shorten_leads(&mut self.program.moves[first_move..], standing);
        }
        let regions = &mut self.regions[first_region..];
        let times_s = times_s(&self.program.moves[first_move..], machine);
        for ((seq, m), time_s) in self.program.moves.iter_mut().enumerate().skip(first_move).zip(&times_s) {
            m.seq = seq as u64;
            name.clone_into(&mut m.setup);
            TOOL_ID.clone_into(&mut m.tool);
            if let Some(totals) = regions.iter_mut().find(|r| r.region == m.region) {
                totals.length.add(m.kind, m.length_mm());
                totals.control_points += m.points.len() as u64;
                totals.time_s += time_s;
            }
        }
        self.seconds.extend(times_s);
        if regions.is_empty() {
            return;
        }
        let sum = |f: fn(&RegionTotals) -> f64| regions.iter().map(f).sum();
        self.setups.push(Setup {
            name: name.to_owned(),
            axis: context.frame.axis().into(),
            quaternion: context.frame.quaternion(),
            clearance_mm: context.heights.highest()
                + context.stock.map_or(0.0, |s| s.1)
                + context.clearance_mm,
            area_mm2: sum(|r| r.area_mm2),
            time_s: sum(|r| r.time_s),
        });
    }

    pub(crate) fn add_up(&mut self) {
        let totals = &mut self.totals;
        totals.moves = self.program.moves.len() as u64;
        for r in &self.regions {
            totals.passes += r.passes;
            totals.retracts += r.retracts;
            totals.control_points += r.control_points;
            totals.time_s += r.time_s;
            totals.length += r.length;
        }
    }
}

fn before(first: &Move) -> Option<End> {
    Some(End::before(&first.curve().ok()?))
}

fn behind(last: &Move) -> Option<End> {
    Some(End::behind(&last.curve().ok()?))
}

/// The moves of regions, where there are any, in an order with short ways between them.
fn in_order(mut parts: Vec<(usize, Vec<Move>)>) -> impl Iterator<Item = (usize, Vec<Move>)> {
    parts.retain(|(_, moves)| !moves.is_empty());
    let ends: Vec<Ends> = parts
        .iter()
        .filter_map(|(_, moves)| Some(Ends { start: moves.first()?.start(), end: moves.last()?.end() }))
        .collect();
    let mut parts: Vec<Option<(usize, Vec<Move>)>> = parts.into_iter().map(Some).collect();
    order_parts(&ends).into_iter().filter_map(move |k| parts[k].take())
}
