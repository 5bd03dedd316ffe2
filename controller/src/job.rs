//! A job in machine coordinates: sections with one setup and one tool each, and their moves as
//! curves with the feed that the machine has.

use std::path::Path;

use claymill_nurbs::{Curve3, KnotVector, Point3, Vector3};
use claymill_toolpath::{Job, Move, MoveKind, Program, read_job, read_moves};

use crate::frame::signed_axis;
use crate::tilt::Placed;
use crate::{AxisName, Frame, Machine, PostError};

/// One move of the job in its setup's machine coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Stroke {
    /// The move's place in the job.
    pub seq: u64,
    /// What it is for.
    pub kind: MoveKind,
    /// Region.
    pub region: usize,
    /// Pass.
    pub pass: u32,
    /// Feed, mm/min, brought down to what the machine does.
    pub feed: f64,
    /// The tip's curve, mm.
    pub curve: Curve3,
}

/// Moves with one setup and one tool.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Setup.
    pub setup: String,
    /// Tool id, `T1`.
    pub tool: String,
    /// Its number in the machine.
    pub tool_number: u32,
    /// Its speed, 1/min; 0 where none is known.
    pub speed_rpm: f64,
    /// Radius of its ball, mm.
    pub radius_mm: f64,
    /// How far the tool sticks out of its holder in this setup, mm, where that is known.
    pub stick_out_mm: Option<f64>,
    /// Setup whose work offset and zero hold.
    pub place: String,
    /// From model to machine coordinates.
    pub frame: Frame,
    /// The tool axis as the job has it, model coordinates: angles of a control are rounded.
    pub tool_axis: Vector3,
    /// How the machine turns to the setup, where nobody turns the part.
    pub placed: Option<Placed>,
    /// Height above which nothing is in the way, machine mm.
    pub clearance_mm: f64,
    /// Height out of the way of hands and holders, as far as the machine's travel is known, machine mm.
    pub retreat_mm: f64,
    /// Its moves.
    pub strokes: Vec<Stroke>,
}

/// A job as a machine sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct MachineJob {
    /// The job's record.
    pub job: Job,
    /// Sections in machining order.
    pub sections: Vec<Section>,
    /// What stands in the header of every program of it.
    pub notes: Vec<String>,
    /// Moves that ask for a higher feed than the machine has, and run at that.
    pub slowed: u64,
}

impl MachineJob {
    /// Reads a job folder into the machine's coordinates.
    ///
    /// # Errors
    /// The folder cannot be read, a move is no curve or names an unknown setup, or there are no moves.
    pub fn read(folder: &Path, machine: &Machine) -> Result<Self, PostError> {
        Self::new(read_job(folder)?, &read_moves(folder)?, machine)
    }

    /// The moves of a job in the machine's coordinates.
    ///
    /// # Errors
    /// A move is no curve or names an unknown setup, or there are no moves.
    pub fn new(job: Job, program: &Program, machine: &Machine) -> Result<Self, PostError> {
        let mut sections: Vec<Section> = Vec::new();
        let mut slowed = 0;
        for m in &program.moves {
            if !sections.last().is_some_and(|s| s.setup == m.setup && s.tool == m.tool) {
                sections.push(section(&job, m, machine)?);
            }
            let Some(section) = sections.last_mut() else { continue };
            if (Vector3::from(m.axis_start) - section.frame.axis()).norm() > 1e-6
                || (Vector3::from(m.axis_end) - section.frame.axis()).norm() > 1e-6
            {
                return Err(PostError::Job(format!(
                    "move {} tilts the tool; posts are for three axes and one tool axis a setup",
                    m.seq
                )));
            }
            slowed += u64::from(m.feed > machine.feed.of(m.kind));
            section.strokes.push(Stroke {
                seq: m.seq,
                kind: m.kind,
                region: m.region,
                pass: m.pass,
                feed: m.feed.min(machine.feed.of(m.kind)),
                curve: turned(&m.curve()?, |p| section.frame.to_machine(p)),
            });
        }
        if sections.is_empty() {
            return Err(PostError::Job("the job has no moves".into()));
        }
        Ok(MachineJob { job, sections, notes: Vec::new(), slowed })
    }

    /// Number of moves.
    #[must_use]
    pub fn strokes(&self) -> usize {
        self.sections.iter().map(|s| s.strokes.len()).sum()
    }
}

fn section(job: &Job, m: &Move, machine: &Machine) -> Result<Section, PostError> {
    let setup = job.setups.iter().find(|s| s.name == m.setup).ok_or_else(|| {
        PostError::Job(format!("move {} names setup `{}`, which is not listed", m.seq, m.setup))
    })?;
    let axis = |text: &str| {
        signed_axis(text).ok_or_else(|| PostError::Job(format!("`{text}` is no axis; it should be like +z")))
    };
    let (up, front) = (axis(&job.request.up)?, axis(&job.request.length)?);
    let zero = Point3::from(machine.place(&m.setup).zero_mm);
    let frame = match setup.quaternion {
        Some(quaternion) => Frame::of_quaternion(quaternion, zero),
        None => Frame::new(Vector3::from(setup.axis), up, front, zero),
    };
    let frame = frame.ok_or_else(|| PostError::Job(format!("setup `{}` has no tool axis", m.setup)))?;
    let record = job.tools.iter().find(|t| t.id == m.tool);
    let tool = record.map_or(job.request.tool, |t| t.tool);
    let holder = record.and_then(|t| t.in_setup(&m.setup).holder);
    let clearance_mm = setup.clearance_mm - frame.axis().dot(&zero.coords);
    let top_mm = machine.axes.get(&AxisName::Z).map_or(f64::INFINITY, |[_, top]| *top);
    Ok(Section {
        setup: m.setup.clone(),
        place: m.setup.clone(),
        tool_axis: frame.axis(),
        placed: None,
        tool: m.tool.clone(),
        tool_number: machine.tool_number(&m.tool),
        speed_rpm: machine.speed_rpm(&m.tool),
        radius_mm: tool.radius_mm(),
        stick_out_mm: holder.map(|h| h.stick_out_mm),
        clearance_mm,
        retreat_mm: (clearance_mm + machine.retreat_mm).min(top_mm).max(clearance_mm),
        frame,
        strokes: Vec::new(),
    })
}

/// The curve with its points taken elsewhere by a rigid motion.
pub(crate) fn turned(curve: &Curve3, to: impl Fn(&Point3) -> Point3) -> Curve3 {
    let points = curve.points().iter().map(to).collect();
    let knots: KnotVector = curve.knots().clone();
    // A rigid motion keeps finite what is finite; should it not, the curve stays and the comparison tells.
    Curve3::new(knots, points, curve.weights().map(<[f64]>::to_vec)).unwrap_or_else(|_| curve.clone())
}
