//! Virtual controls: what each control does with the blocks of a program, beside following them.

use std::path::PathBuf;

use claymill_motion::{JointRule, Limits, Looks, Rail, Schedule, Track};
use claymill_nurbs::Curve3;
use claymill_toolpath::MoveKind;
use nalgebra::Vector2;
use rayon::prelude::*;
use serde::Serialize;

use crate::biarc::{BIARCS_PER_POLE, Station, biarc};
use crate::compare::{Found, follow_program};
use crate::dialects::{Dialect, Element};
use crate::follow::deviation;
use crate::job::{MachineJob, Stroke};
use crate::lower::holds;
use crate::number::LengthFormat;
use crate::placed::placed_as_written;
use crate::{Comparison, Machine, Plane, ReadError, Shape, Units};

/// How a control runs a program.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Control {
    limits: Limits,
    /// Time of one interpolation step, s: in between it runs straight.
    cycle_s: f64,
    /// How far from a corner it may run, mm.
    corner_mm: f64,
    /// Corners beside a spline above this angle are an exact stop.
    spline_stop_deg: f64,
    /// Whether splines are run as biarcs, four for each pole.
    biarcs: bool,
    /// Blocks that it looks ahead, and the time that it takes to read one, s.
    look_ahead: usize,
    block_s: f64,
}

impl Control {
    fn of(dialect: Dialect, machine: &Machine) -> Self {
        let dynamics = machine.dynamics;
        let linuxcnc = matches!(dialect, Dialect::LinuxCnc29 | Dialect::LinuxCnc210);
        // LinuxCNC's planner limits acceleration only, and looks at its last 50 segments.
        let jerk_mm_per_s3 = if linuxcnc { f64::INFINITY } else { dynamics.jerk_mm_per_s3 };
        let usual_look_ahead = if linuxcnc { 50 } else { 200 };
        let corner_mm = if linuxcnc { machine.blend_mm } else { CORNER_MM };
        Control {
            limits: Limits { acceleration_mm_per_s2: dynamics.acceleration_mm_per_s2, jerk_mm_per_s3 },
            cycle_s: dynamics.cycle_s,
            corner_mm: machine.control.corner_mm.unwrap_or(corner_mm),
            spline_stop_deg: if dialect == Dialect::Heidenhain { 0.1 } else { 180.0 },
            biarcs: linuxcnc,
            look_ahead: machine.control.look_ahead_blocks.unwrap_or(usual_look_ahead),
            block_s: machine.control.block_s.unwrap_or(BLOCK_S),
        }
    }

    fn rule(&self, spline: bool) -> JointRule {
        JointRule::Within { mm: self.corner_mm, stop_deg: if spline { self.spline_stop_deg } else { 180.0 } }
    }

    /// Fastest speed at which it can still stop, and keep up with reading, within `length_mm` of `blocks` blocks.
    fn fastest(&self, length_mm: f64, blocks: usize) -> f64 {
        let a = self.limits.acceleration_mm_per_s2;
        let window =
            if self.limits.jerk_mm_per_s3.is_finite() { a / self.limits.jerk_mm_per_s3 } else { 0.0 };
        // v² / 2a + v·T = length
        let braking = a * (-window + (window * window + 2.0 * length_mm / a).sqrt());
        braking.min(length_mm / (blocks as f64 * self.block_s))
    }

    /// What the control runs along for a block.
    fn executed(&self, shape: &Shape) -> Vec<Shape> {
        match shape {
            Shape::Spline(curve) if self.biarcs => biarcs(curve).unwrap_or_else(|| vec![shape.clone()]),
            _ => vec![shape.clone()],
        }
    }
}

/// How far from corners controls run where the machine says nothing, mm.
const CORNER_MM: f64 = 0.005;
/// Time to read a block where the machine says nothing, s.
const BLOCK_S: f64 = 0.0005;

/// The biarcs that stand for a planar spline, at equal steps of the parameter.
fn biarcs(curve: &Curve3) -> Option<Vec<Shape>> {
    let exact = LengthFormat { units: Units::Mm, digits: 9 };
    let plane = Plane::ALL.into_iter().find(|plane| holds(curve, *plane, &exact))?;
    let [i, j, _] = plane.axes();
    let (a, b) = curve.domain();
    let parts = BIARCS_PER_POLE * curve.points().len();
    let station = |k: usize| {
        let t = a + (b - a) * k as f64 / parts as f64;
        let inset = 1e-9 * (b - a);
        let d = curve.derivatives(t.clamp(a + inset, b - inset))[1];
        let direction = Vector2::new(d[i], d[j]).try_normalize(1e-12)?;
        Some(Station { point: curve.point(t), direction })
    };
    let mut shapes = Vec::new();
    for k in 0..parts {
        shapes.extend(biarc(&station(k)?, &station(k + 1)?, plane, &exact)?);
    }
    Some(shapes)
}

/// What a control makes of a program.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Simulation {
    /// The control's dialect.
    pub control: String,
    /// Time of the whole program, s.
    pub time_s: f64,
    /// Time of its cutting moves, s.
    pub cut_time_s: f64,
    /// Times that it comes to rest.
    pub stops: u64,
    /// Largest distance of a cutting move, as executed, from the job's curve: the program's own, the control's arcs,
    /// and the chords between interpolation steps; corners aside.
    pub cut_error_mm: f64,
    /// The move where it is.
    pub cut_error_seq: u64,
    /// How far corners may be rounded, mm.
    pub corner_mm: f64,
    /// Feed of the cutting moves.
    pub feed: FeedProfile,
    /// The program held against the job.
    pub read_back: Comparison,
}

/// Feed along cutting moves, mm/min.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct FeedProfile {
    /// Programmed, on average over the length.
    pub programmed_mm_per_min: f64,
    /// A hundredth of the length is run no faster than this.
    pub slowest_hundredth_mm_per_min: f64,
    /// Length over time.
    pub mean_mm_per_min: f64,
    /// Share of the length that is run below 99 % of the programmed feed.
    pub below_share: f64,
}

/// Places below which the speed reaches the programmed one, as a share.
const REACHED: f64 = 0.99;
/// Places of the feed's profile.
const LOOKS: Looks = Looks { straight_mm: 2.0, ..Looks::COARSE };
/// Blocks that are run at a time.
const BATCH: usize = 1 << 15;

/// Runs a program on a virtual control of its dialect.
///
/// # Errors
/// A file cannot be read, or breaks a rule of its dialect.
pub fn simulate(
    job: &MachineJob,
    files: &[PathBuf],
    dialect: Dialect,
    machine: &Machine,
) -> Result<Simulation, ReadError> {
    let control = Control::of(dialect, machine);
    let mut run = Run { control, blocks: Vec::new(), moves: Vec::new(), sum: Sum::default() };
    let placed = placed_as_written(job, files, dialect, machine)?;
    let read_back = follow_program(&placed, files, dialect, machine, &mut |found| run.take(found))?;
    run.flush();
    let sum = run.sum;
    let per_min = |mm: f64, s: f64| if s > 0.0 { 60.0 * mm / s } else { 0.0 };
    Ok(Simulation {
        control: dialect.name().into(),
        time_s: sum.time_s,
        cut_time_s: sum.cut_time_s,
        stops: sum.stops,
        cut_error_mm: sum.error_mm,
        cut_error_seq: sum.error_seq,
        corner_mm: control.corner_mm,
        feed: FeedProfile {
            programmed_mm_per_min: if sum.cut_mm > 0.0 { sum.feed_mm / sum.cut_mm } else { 0.0 },
            slowest_hundredth_mm_per_min: sum.slowest_hundredth(),
            mean_mm_per_min: per_min(sum.cut_mm, sum.cut_time_s),
            below_share: if sum.cut_mm > 0.0 { sum.below_mm / sum.cut_mm } else { 0.0 },
        },
        read_back,
    })
}

/// A move and its blocks.
struct Moved {
    stroke: Option<Stroke>,
    /// Its blocks in [`Run::blocks`].
    blocks: std::ops::Range<usize>,
}

#[derive(Debug, Default)]
struct Sum {
    time_s: f64,
    cut_time_s: f64,
    stops: u64,
    error_mm: f64,
    error_seq: u64,
    cut_mm: f64,
    /// Programmed feed times length.
    feed_mm: f64,
    below_mm: f64,
    /// Length by feed, in steps of [`FEED_STEP`].
    by_feed_mm: Vec<f64>,
}

/// Step in which feeds are counted, mm/min.
const FEED_STEP: f64 = 10.0;

impl Sum {
    fn count(&mut self, feed: f64, mm: f64) {
        let step = (feed / FEED_STEP).clamp(0.0, 1e5) as usize;
        if self.by_feed_mm.len() <= step {
            self.by_feed_mm.resize(step + 1, 0.0);
        }
        self.by_feed_mm[step] += mm;
    }

    fn slowest_hundredth(&self) -> f64 {
        let mut sum = 0.0;
        let found = self.by_feed_mm.iter().position(|mm| {
            sum += mm;
            sum >= 0.01 * self.cut_mm
        });
        FEED_STEP * found.unwrap_or(0) as f64
    }
}

struct Run {
    control: Control,
    blocks: Vec<Element>,
    moves: Vec<Moved>,
    sum: Sum,
}

/// A block as the control executes it.
struct Executed {
    shapes: Vec<Shape>,
    rails: Vec<Rail>,
}

impl Run {
    fn take(&mut self, found: &Found<'_>) {
        let stroke = found.matched.then(|| found.stroke.clone());
        let rapid = stroke.as_ref().is_none_or(|s| s.kind == MoveKind::Rapid);
        // Rapids begin at a rest: the way up turns into a way across.
        if rapid && self.blocks.len() >= BATCH {
            self.flush();
        }
        let from = self.blocks.len();
        self.blocks.extend_from_slice(&found.elements);
        self.moves.push(Moved { stroke, blocks: from..self.blocks.len() });
    }

    fn flush(&mut self) {
        let (blocks, moves) = (std::mem::take(&mut self.blocks), std::mem::take(&mut self.moves));
        let control = self.control;
        let executed: Vec<Executed> = blocks
            .par_iter()
            .map(|block| {
                let shapes = control.executed(&block.shape);
                let curves = shapes.iter().filter_map(Shape::curve);
                let looks = if block.rapid { Looks::COARSE } else { LOOKS };
                let rails = curves.map(|c| Rail::new(c, looks)).collect();
                Executed { shapes, rails }
            })
            .collect();
        let speeds = self.speeds(&blocks, &executed);
        let mut track = Track::new(control.limits, control.rule(false));
        let mut last_spline = false;
        // Number of places before the end of every block.
        let mut ends = Vec::with_capacity(blocks.len());
        for ((block, done), speed) in blocks.iter().zip(&executed).zip(&speeds) {
            let spline = matches!(block.shape, Shape::Spline(_));
            track.set_rule(control.rule(spline || last_spline));
            for rail in &done.rails {
                track.add(rail, block.feed.min(60.0 * speed));
                track.set_rule(control.rule(spline));
            }
            last_spline = spline;
            ends.push(track.places().len());
        }
        let schedule = Schedule::new(&track, true);
        let sum = &mut self.sum;
        sum.stops += schedule.stops;
        sum.time_s += schedule.time_s();
        let errors: Vec<(f64, u64)> = moves
            .par_iter()
            .filter_map(|m| {
                let stroke = m.stroke.as_ref().filter(|s| s.kind == MoveKind::Cut)?;
                let shapes = executed[m.blocks.clone()].iter().flat_map(|e| &e.shapes);
                Some((deviation(&stroke.curve, shapes), stroke.seq))
            })
            .collect();
        let mut errors = errors.into_iter();
        let time_at = |place: usize| if place == 0 { 0.0 } else { schedule.places_s[place - 1] };
        for m in &moves {
            if m.stroke.as_ref().is_none_or(|s| s.kind != MoveKind::Cut) {
                continue;
            }
            let Some((far, seq)) = errors.next() else { break };
            let mut sagitta: f64 = 0.0;
            for b in m.blocks.clone() {
                let first = if b == 0 { 0 } else { ends[b - 1] };
                for place in first..ends[b] {
                    let (_, p) = track.places()[place];
                    let time = time_at(place + 1) - time_at(place);
                    let v = if time > 0.0 { p.length_mm / time } else { p.speed };
                    let chord = (v * control.cycle_s).min(p.length_mm);
                    sagitta = sagitta.max(0.125 * p.bend * chord * chord);
                    sum.cut_mm += p.length_mm;
                    sum.cut_time_s += time;
                    sum.feed_mm += blocks[b].feed * p.length_mm;
                    sum.count(60.0 * v, p.length_mm);
                    if 60.0 * v < REACHED * blocks[b].feed {
                        sum.below_mm += p.length_mm;
                    }
                }
            }
            if far + sagitta > sum.error_mm {
                (sum.error_mm, sum.error_seq) = (far + sagitta, seq);
            }
        }
    }

    /// The speed at which the control keeps up with each block: what lies ahead of it counts.
    fn speeds(&self, blocks: &[Element], executed: &[Executed]) -> Vec<f64> {
        let length = |i: usize| executed[i].rails.iter().map(Rail::length_mm).sum::<f64>();
        let n = self.control.look_ahead.max(1);
        let mut ahead: f64 = (0..n.min(blocks.len())).map(length).sum();
        let mut speeds = Vec::with_capacity(blocks.len());
        for i in 0..blocks.len() {
            let known = n.min(blocks.len() - i);
            // At the end the program's end is near anyway.
            speeds.push(if known < n { f64::INFINITY } else { self.control.fastest(ahead, known) });
            ahead -= length(i);
            if i + n < blocks.len() {
                ahead += length(i + n);
            }
        }
        speeds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_of_linuxcnc_becomes_four_biarcs_a_pole() {
        let points = [[0.0, 0.0], [10.0, 12.0], [25.0, -8.0], [40.0, 0.0]];
        let points = points.iter().map(|p| claymill_nurbs::Point3::new(p[0], p[1], 5.0)).collect();
        let knots = claymill_nurbs::KnotVector::clamped_uniform(3, 4);
        let curve = Curve3::new(knots, points, None).unwrap();
        let shapes = biarcs(&curve).unwrap();
        assert!(shapes.len() <= 32 && shapes.len() >= 30, "{}", shapes.len());
        for w in shapes.windows(2) {
            assert_eq!(w[0].end(), w[1].start());
            let ([_, a], [b, _]) = (w[0].directions().unwrap(), w[1].directions().unwrap());
            assert!(a.dot(&b) > 1.0 - 1e-6, "not tangent");
        }
        let far = deviation(&curve, &shapes);
        assert!(far > 1e-5 && far < 5e-3, "{far}");
    }

    #[test]
    fn a_heidenhain_stops_at_a_bend_that_others_pass() {
        use claymill_nurbs::{KnotVector, Point3};
        let p = |x: f64, y: f64| Point3::new(x, y, 0.0);
        // A line, and a spline that leaves it at an angle.
        let program = |degrees: f64| {
            let (s, c) = degrees.to_radians().sin_cos();
            let points = (0..4).map(|i| p(50.0 + 15.0 * f64::from(i) * c, 15.0 * f64::from(i) * s)).collect();
            let curve = Curve3::new(KnotVector::clamped_uniform(3, 4), points, None).unwrap();
            let block = |shape| Element { line: 1, rapid: false, feed: 6000.0, shape, tilt: None };
            vec![block(Shape::Line { from: p(0.0, 0.0), to: p(50.0, 0.0) }), block(Shape::Spline(curve))]
        };
        let stops = |dialect, degrees| {
            let control = Control::of(dialect, &Machine::default());
            let mut run = Run { control, blocks: program(degrees), moves: Vec::new(), sum: Sum::default() };
            run.flush();
            (run.sum.stops, run.sum.time_s)
        };
        let (passing, time_s) = stops(Dialect::Heidenhain, 0.05);
        assert_eq!((passing, stops(Dialect::Siemens, 0.5).0), (1, 1));
        // A rest costs v/a + a/j.
        let (stopping, longer_s) = stops(Dialect::Heidenhain, 0.5);
        assert_eq!(stopping, 2);
        approx::assert_relative_eq!(longer_s - time_s, 0.2, max_relative = 0.05);
    }

    #[test]
    fn a_control_is_as_fast_as_it_can_still_stop() {
        let machine = Machine::default();
        let control = Control::of(Dialect::Siemens, &machine);
        let v = control.fastest(25.0, 10);
        let a = machine.dynamics.acceleration_mm_per_s2;
        let t = a / machine.dynamics.jerk_mm_per_s3;
        approx::assert_relative_eq!(v * v / (2.0 * a) + v * t, 25.0, max_relative = 1e-9);
        // Ten blocks of 0.01 mm, one read every half millisecond.
        approx::assert_relative_eq!(control.fastest(0.1, 10), 0.995, max_relative = 0.01);
    }
}
