//! Where the tool is at any time of a job.

use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::{Move, Program, ToolRecord};

use crate::strokes::flatten;
use crate::tool::PosedTool;

/// Where the tool's tip is at some time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Station {
    pub(crate) at_s: f64,
    pub(crate) tip: Point3,
    pub(crate) axis: Vector3,
    pub(crate) radius_mm: f64,
    /// Which of the course's tools; none where it is beyond them.
    tool: usize,
}

/// What is run in one setup.
#[derive(Debug, Clone)]
pub(crate) struct Leg {
    pub(crate) setup: String,
    pub(crate) begin_s: f64,
    /// The first of its stations.
    pub(crate) first: usize,
}

/// Where the tool is at any time of a job.
#[derive(Debug, Clone)]
pub struct Course {
    /// In the order of time.
    pub(crate) stations: Vec<Station>,
    /// In machining order.
    pub(crate) setups: Vec<Leg>,
    /// As they are in each of the setups.
    tools: Vec<ToolRecord>,
}

impl Course {
    /// From the moves, the seconds that each takes, and the job's tools.
    #[must_use]
    pub fn new(program: &Program, seconds: &[f64], tools: &[ToolRecord]) -> Self {
        let (mut stations, mut setups) = (Vec::new(), Vec::<Leg>::new());
        // As they are in the setups, one leg after the other.
        let mut placed: Vec<ToolRecord> = Vec::new();
        let mut now_s = 0.0;
        for (m, &took_s) in program.moves.iter().zip(seconds) {
            if setups.last().is_none_or(|leg| leg.setup != m.setup) {
                setups.push(Leg { setup: m.setup.clone(), begin_s: now_s, first: stations.len() });
                placed.extend(tools.iter().map(|tool| tool.in_setup(&m.setup)));
            }
            let own = tools.iter().position(|t| t.id == m.tool);
            let tool = own.map_or(usize::MAX, |own| placed.len() - tools.len() + own);
            let radius_mm = placed.get(tool).map_or(1.0, |t| t.tool.radius_mm());
            let axis = Vector3::from(m.axis_start);
            let from = Station { at_s: now_s, tip: Point3::origin(), axis, radius_mm, tool };
            add_stations(&mut stations, m, &from, took_s);
            now_s += took_s;
        }
        Course { stations, setups, tools: placed }
    }

    /// How long the job takes, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.stations.last().map_or(0.0, |s| s.at_s)
    }

    /// The tool as it stands at a time; none where no tool of the job is at work.
    #[must_use]
    pub fn tool(&self, at_s: f64) -> Option<PosedTool<'_>> {
        let s = self.station(at_s)?;
        Some(PosedTool { record: self.tools.get(s.tool)?, tip: s.tip, axis: s.axis })
    }

    pub(crate) fn station(&self, at_s: f64) -> Option<Station> {
        let after = self.stations.partition_point(|s| s.at_s < at_s);
        let (b, a) =
            (self.stations.get(after).or(self.stations.last())?, self.stations.get(after.saturating_sub(1))?);
        let share = ((at_s - a.at_s) / (b.at_s - a.at_s).max(1e-12)).clamp(0.0, 1.0);
        // Between two setups the tool is nowhere: it does not tilt on the way.
        let axis = if share < 0.5 { a.axis } else { b.axis };
        Some(Station { at_s, tip: a.tip + (b.tip - a.tip) * share, axis, ..*b })
    }
}

/// Points of the tip's way; within a move the time goes with the length.
fn add_stations(stations: &mut Vec<Station>, m: &Move, from: &Station, took_s: f64) {
    const CHORD_MM: f64 = 0.5;
    let Ok(curve) = m.curve() else { return };
    let points = flatten(&curve, CHORD_MM);
    let whole_mm: f64 = points.windows(2).map(|ab| (ab[1] - ab[0]).norm()).sum();
    let mut gone_mm = 0.0;
    for (i, &tip) in points.iter().enumerate() {
        if let Some(before) = i.checked_sub(1) {
            gone_mm += (tip - points[before]).norm();
        }
        let share = if whole_mm > 0.0 { gone_mm / whole_mm } else { 1.0 };
        stations.push(Station { at_s: from.at_s + share * took_s, tip, ..*from });
    }
}
