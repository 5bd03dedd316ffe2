//! The material that is left, at any time of a job: a height in each cell of a grid for every setup.
//!
//! ```text
//!   model from a setup's direction ──► top of each cell + allowance ──► ball swept along the tip's way ──► heights
//!   heights, and what earlier setups left ──► colour of the model's vertices; a skin over cells not yet cut
//! ```
//!
//! The ball is put down at places that do not depend on which times are asked for: the material of a time is the same
//! to the bit however one came there. Heights lie in tiles that states share until one of them is cut, so that
//! [`checkpoints`] are light.

mod checkpoints;
mod grid;
mod heights;
mod skin;
#[cfg(test)]
mod tests;

use claymill_nurbs::Vector3;
use rayon::prelude::*;

use self::checkpoints::Checkpoints;
use self::grid::Grid;
use self::heights::Heights;
use crate::course::Course;
use crate::legend::{LegendEntry, Mark};
use crate::palette::Rgb;
use crate::scene::Scene;
use crate::shapes::LineKind;

/// Material that is still to go, and what has been cut.
const TO_GO: Rgb = [124, 92, 68];
const DONE: Rgb = [214, 206, 194];
/// What checkpoints hold at most, bytes.
const CHECKPOINT_BYTES: usize = 96 << 20;

/// The material over a model that is being cut.
#[derive(Debug)]
pub struct Stock {
    allowance_mm: f64,
    /// One a setup, in machining order.
    grids: Vec<Grid>,
    /// Of the setups that were ever begun: the heights at first, and which vertices of the model were cut before.
    fresh: Vec<Heights>,
    cut_before: Vec<Vec<Vec<bool>>>,
    /// Of the setups that were ever done: the heights at last.
    last: Vec<Heights>,
    now: Option<Cut>,
    checkpoints: Checkpoints,
}

/// The first sample of the ball that was not cut yet: number of the station that it comes after, and its own.
type Place = (usize, u32);

/// What is cut so far.
#[derive(Debug, Clone, PartialEq)]
struct Cut {
    setup: usize,
    next: Place,
    /// Cut in this setup.
    samples: u64,
    heights: Heights,
}

impl Stock {
    /// Every setup of a job begins with `allowance_mm` along its tool axis over whatever was not cut before.
    #[must_use]
    pub fn of(bare: &Scene, course: &Course, allowance_mm: f64) -> Self {
        let stations = &course.stations;
        let radius_mm = stations.iter().map(|s| s.radius_mm).fold(f64::INFINITY, f64::min);
        let axis = |first: usize| stations.get(first).map_or(Vector3::z(), |s| s.axis);
        Stock {
            allowance_mm,
            grids: course.setups.iter().map(|leg| Grid::new(bare, axis(leg.first), radius_mm)).collect(),
            fresh: Vec::new(),
            cut_before: Vec::new(),
            last: Vec::new(),
            now: None,
            checkpoints: Checkpoints::of(0),
        }
    }

    /// Keeps states on the way, 96 MB at most, so that going back need not cut from the beginning.
    #[must_use]
    pub fn with_checkpoints(mut self) -> Self {
        self.checkpoints = Checkpoints::of(CHECKPOINT_BYTES);
        self
    }

    /// The allowance over the model, mm.
    #[must_use]
    pub fn allowance_mm(&self) -> f64 {
        self.allowance_mm
    }

    /// Begins anew with another allowance.
    pub fn begin_anew(&mut self, allowance_mm: f64) {
        self.allowance_mm = allowance_mm;
        self.fresh.clear();
        self.cut_before.clear();
        self.last.clear();
        self.now = None;
        self.checkpoints.forget();
    }

    /// Makes it the material at a time of the job, s.
    pub fn go_to(&mut self, bare: &Scene, course: &Course, at_s: f64) {
        let setup = course.setups.partition_point(|leg| leg.begin_s <= at_s.max(0.0)).max(1) - 1;
        if setup >= self.grids.len() {
            return;
        }
        while self.fresh.len() <= setup {
            if let Some(before) = self.fresh.len().checked_sub(1) {
                self.reach(course, before, self.end(course, before));
                self.last.extend(self.now.as_ref().map(|now| now.heights.clone()));
            }
            self.begin(bare);
        }
        self.reach(course, setup, self.place(course, setup, at_s));
    }

    /// Where a setup's way ends; nothing is cut between two setups.
    fn end(&self, course: &Course, setup: usize) -> Place {
        let end = course.setups.get(setup + 1).map_or(course.stations.len(), |leg| leg.first);
        (end.saturating_sub(1).max(course.setups[setup].first), 1)
    }

    /// What is cut at a time of a setup.
    fn place(&self, course: &Course, setup: usize, at_s: f64) -> Place {
        let stations = &course.stations;
        let (first, end) = (course.setups[setup].first, self.end(course, setup));
        let Some(from) = stations.partition_point(|s| s.at_s <= at_s).checked_sub(1) else { return (0, 0) };
        if from < first {
            return (first, 0);
        }
        let Some([a, b]) = stations.get(from..from + 2) else { return end };
        let share = (at_s - a.at_s) / (b.at_s - a.at_s).max(1e-12);
        let place = (from, (share * f64::from(self.grids[setup].samples(a, b))) as u32 + 1);
        place.min(end)
    }

    /// Cuts in a setup that was begun, from the nearest state that is known.
    fn reach(&mut self, course: &Course, setup: usize, goal: Place) {
        let begun = || Cut {
            setup,
            next: (course.setups[setup].first, 0),
            samples: 0,
            heights: self.fresh[setup].clone(),
        };
        let known = self.checkpoints.before(setup, goal);
        let least = known.map_or((0, 0), |k| k.next);
        let going_on = self.now.take().filter(|n| n.setup == setup && (least..=goal).contains(&n.next));
        let mut now = going_on.or_else(|| known.cloned()).unwrap_or_else(begun);
        let grid = &self.grids[setup];
        while now.next < goal {
            let (station, sample) = now.next;
            let Some([a, b]) = course.stations.get(station..station + 2) else { break };
            let samples = grid.samples(a, b);
            let (until, next) =
                if station < goal.0 { (samples, (station + 1, 1)) } else { (goal.1 - 1, goal) };
            for k in sample..=until {
                if let Some(ball) = grid.ball(a, b, f64::from(k) / f64::from(samples)) {
                    now.heights.lower(&ball);
                }
            }
            now.samples += u64::from((until + 1).saturating_sub(sample));
            now.next = next;
            self.checkpoints.keep(&now, &self.fresh);
        }
        self.now = Some(now);
    }

    /// Puts the allowance over what no setup has cut so far.
    fn begin(&mut self, bare: &Scene) {
        let setup = self.fresh.len();
        let grid = &self.grids[setup];
        let before = || self.grids.iter().zip(&self.last);
        let [width, height] = grid.size;
        let heights: Vec<f32> = (0..width * height)
            .into_par_iter()
            .map(|i| {
                let model = grid.model[i];
                if !model.is_finite() {
                    return model;
                }
                let top = grid.place(i, model);
                // What earlier setups cut has no material left.
                let cut = before().any(|(g, heights)| {
                    let cell = g.cell_under(&top, bare.deviation_mm);
                    cell.is_some_and(|cell| g.is_cut(heights, cell, self.allowance_mm))
                });
                if cut { model } else { model + self.allowance_mm as f32 }
            })
            .collect();
        let none = || bare.surfaces.iter().map(|s| vec![false; s.vertices.len()]).collect();
        let mut cut: Vec<Vec<bool>> = self.cut_before.last().cloned().unwrap_or_else(none);
        if let Some((grid, heights)) = before().last() {
            let more = grid.cut_vertices(bare, heights, self.allowance_mm);
            cut.iter_mut().flatten().zip(more.iter().flatten()).for_each(|(c, more)| *c |= more);
        }
        self.fresh.push(Heights::new(grid.size, |x, y| heights[y * width + x]));
        self.cut_before.push(cut);
    }

    /// Puts the material into a scene of the same model at the time that was gone to, in place of the paths.
    pub fn show(&self, bare: &Scene, scene: &mut Scene) {
        scene.lines.retain(|l| !matches!(l.kind, LineKind::Cut | LineKind::Link | LineKind::Lead));
        for (mesh, colours) in scene.surfaces.iter_mut().zip(self.colours(bare)) {
            mesh.vertices
                .iter_mut()
                .zip(colours)
                .for_each(|(v, [r, g, b, _])| v.colour = [r, g, b, v.colour[3]]);
        }
        self.add_skin(scene);
        for (colour, text) in
            [(TO_GO, format!("material, {} mm over the model", self.allowance_mm)), (DONE, "cut".to_owned())]
        {
            scene.legend.push(LegendEntry { mark: Mark::Area, colour, text });
        }
    }

    /// Colours of the vertices of the model's surfaces by whether they are cut, surface by surface.
    #[must_use]
    pub fn colours(&self, bare: &Scene) -> Vec<Vec<[u8; 4]>> {
        let Some(now) = &self.now else { return Vec::new() };
        let cut = self.grids[now.setup].cut_vertices(bare, &now.heights, self.allowance_mm);
        let colour = |(now, before): (&bool, &bool)| {
            let [r, g, b] = if *now || *before { DONE } else { TO_GO };
            [r, g, b, 255]
        };
        let surfaces = cut.iter().zip(&self.cut_before[now.setup]);
        surfaces.map(|(now, before)| now.iter().zip(before).map(colour).collect()).collect()
    }

    /// Adds the surface of what is still to go in the setup that is on.
    pub fn add_skin(&self, scene: &mut Scene) {
        if let Some(now) = &self.now {
            skin::add_skin(scene, &self.grids[now.setup], &now.heights, self.allowance_mm);
        }
    }

    /// Colours of the material and of what has been cut.
    #[must_use]
    pub fn palette() -> [Rgb; 2] {
        [TO_GO, DONE]
    }
}
