//! The way to a move in mid-job: up to the clearance height, across by rapids, and down by the
//! job's lead-in or at the feed of leads.

use std::fmt;

use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::{Job, Move, MoveKind, Program, Setup};

/// Ends of moves that are farther apart than this are not joined, mm.
pub(crate) const GAP_MM: f64 = 1e-3;
/// A tool that stands in a cut goes up this far at the feed of leads before it is fast, mm; the job may say another.
pub(crate) const LIFT_MM: f64 = 5.0;

/// Moves chosen from a job, with a safe way to each that begins where the one before it does not end.
///
/// ```text
///   ▲ rapid  ──── rapid, at the clearance height ───► │
///   │                                                 │ rapid down to a lead-in of the job; where there is none,
///   ▲ feed                                            │ at the feed of leads all the way, for nobody has proven
///  end or where the machine stands                    ▼ what stands beside it
/// ```
///
/// A choice that begins on a rapid, a link or a lead-out begins with the cut behind it, and a cut behind a lead-in with
/// the lead-in. What is added bears the number of the move that it leads to, or comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// The moves.
    pub moves: Vec<Move>,
    /// So many of them, at the beginning, lead up from where the machine stands: tool and spindle are changed behind them.
    pub departs: usize,
    /// How it comes to the first move; `None` where that is how the job itself begins.
    pub approach: Option<Approach>,
}

/// A way down to a move in the middle of a job.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Approach {
    /// The cut that it leads to.
    pub seq: u64,
    /// The height that it comes over, along the tool axis, mm.
    pub over_mm: f64,
    /// Whether it comes down by a lead-in of the job.
    pub lead: bool,
    /// Length of its way at feed, mm.
    pub plunge_mm: f64,
    /// That feed, mm/min.
    pub feed: f64,
}

impl fmt::Display for Approach {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Approach { seq, over_mm, plunge_mm, feed, .. } = self;
        write!(f, "over {over_mm:.1} mm to move {seq}, ")?;
        if self.lead {
            write!(f, "by its lead-in, {plunge_mm:.1} mm at {feed:.0} mm/min")
        } else {
            write!(
                f,
                "the last {plunge_mm:.1} mm straight down at {feed:.0} mm/min: the job has no lead-in there"
            )
        }
    }
}

impl Route {
    /// The wanted moves of a job, from where the machine stands (tip in mm, tool axis) if that is known. To a cut without
    /// a lead-in the feed begins `plunge_mm` above it, where that is said: whoever says so knows that the way is free.
    #[must_use]
    pub fn new(
        job: &Job,
        program: &Program,
        wanted: impl Fn(&Move) -> bool,
        stands: Option<(Point3, Vector3)>,
        plunge_mm: Option<f64>,
    ) -> Route {
        let mut way = Way { job, all: &program.moves, moves: Vec::new(), plunge_mm };
        let mut route = Route { moves: Vec::new(), departs: 0, approach: None };
        let mut last: Option<usize> = None;
        let mut next = 0;
        while let Some(i) = (next..way.all.len()).find(|&i| wanted(&way.all[i])) {
            if last.is_some_and(|l| l + 1 == i) {
                way.moves.push(way.all[i].clone());
                (last, next) = (Some(i), i + 1);
                continue;
            }
            let Some(entry) = way.entry(i, &wanted) else { break };
            let approach = match (last, stands) {
                (Some(l), _) => {
                    way.depart(l);
                    way.arrive(entry, way.moves.last().map(|m| (m.end(), m.axis_end.into())))
                }
                (None, Some((tip, axis))) => {
                    let tip = way.up(tip, axis, true, entry);
                    route.departs = way.moves.len();
                    way.arrive(entry, Some((tip, axis)))
                }
                (None, None) => way.arrive(entry, None),
            };
            if last.is_none() && !way.opens(entry) {
                route.approach = approach;
            }
            way.moves.push(way.all[entry].clone());
            (last, next) = (Some(entry), entry + 1);
        }
        if let Some(l) = last {
            way.depart(l);
        }
        route.moves = way.moves;
        route
    }
}

struct Way<'a> {
    job: &'a Job,
    all: &'a [Move],
    moves: Vec<Move>,
    plunge_mm: Option<f64>,
}

impl<'a> Way<'a> {
    fn setup(&self, m: &Move) -> Option<&'a Setup> {
        self.job.setups.iter().find(|s| s.name == m.setup)
    }

    /// Whether it is the first move of a setup: the job comes to it from anywhere.
    fn opens(&self, i: usize) -> bool {
        i == 0 || self.all[i - 1].setup != self.all[i].setup
    }

    /// Whether the move follows the one before it without a gap.
    fn follows(&self, i: usize) -> bool {
        !self.opens(i) && (self.all[i - 1].end() - self.all[i].start()).norm() <= GAP_MM
    }

    /// The move to begin with for what was chosen from `i` on.
    fn entry(&self, i: usize, wanted: impl Fn(&Move) -> bool) -> Option<usize> {
        let enters =
            |&k: &usize| self.opens(k) || matches!(self.all[k].kind, MoveKind::Cut | MoveKind::LeadIn);
        let k = (i..self.all.len()).filter(|&k| wanted(&self.all[k])).find(enters)?;
        let led =
            self.all[k].kind == MoveKind::Cut && self.follows(k) && self.all[k - 1].kind == MoveKind::LeadIn;
        Some(if led { k - 1 } else { k })
    }

    /// The feed of the leads about a move: that of the nearest lead-in before it, or of the first one behind it.
    fn lead_feed(&self, i: usize) -> f64 {
        let lead = |m: &&Move| m.kind == MoveKind::LeadIn;
        let found = self.all[..=i].iter().rev().find(lead).or_else(|| self.all[i..].iter().find(lead));
        found.map_or(0.5 * self.job.request.feed_mm_per_min, |m| m.feed)
    }

    fn lift_mm(&self) -> f64 {
        self.job.tolerances.get("clearance_mm").copied().filter(|c| *c > 0.0).unwrap_or(LIFT_MM)
    }

    /// Up to the clearance height of its setup behind a move of the job, by the job's own lead-out if there is one.
    fn depart(&mut self, i: usize) {
        let m = &self.all[i];
        let mut tip = m.end();
        let mut leads = matches!(m.kind, MoveKind::Cut | MoveKind::Link | MoveKind::LeadIn);
        if let Some(out) = self.all.get(i + 1).filter(|o| o.kind == MoveKind::LeadOut)
            && leads
            && self.follows(i + 1)
        {
            self.moves.push(out.clone());
            (tip, leads) = (out.end(), false);
        }
        self.up(tip, m.axis_end.into(), leads, i);
    }

    /// Up to the clearance height of the setup with this axis, at first at the feed of leads if the tool may stand in a cut.
    /// Returns the end.
    fn up(&mut self, tip: Point3, axis: Vector3, leads: bool, like: usize) -> Point3 {
        let job = self.job;
        let setup = job.setups.iter().find(|s| (Vector3::from(s.axis) - axis).norm() < 1e-6);
        let Some(setup) = setup else { return tip };
        let rise = setup.clearance_mm - axis.dot(&tip.coords);
        if rise <= GAP_MM {
            return tip;
        }
        let lead = tip + axis * if leads { rise.min(self.lift_mm()) } else { 0.0 };
        let top = tip + axis * rise;
        self.straight(MoveKind::LeadOut, tip, lead, setup, like);
        self.straight(MoveKind::Rapid, lead, top, setup, like);
        top
    }

    /// Across from a place above everything, if it is known and of the same setup, and down to the start of a move.
    fn arrive(&mut self, entry: usize, from: Option<(Point3, Vector3)>) -> Option<Approach> {
        let m = &self.all[entry];
        let setup = self.setup(m)?;
        let axis = Vector3::from(setup.axis);
        let from = from.filter(|(_, a)| (a - axis).norm() < 1e-6).map(|(p, _)| p);
        let height = |p: &Point3| axis.dot(&p.coords);
        let to = m.start();
        let over_mm = [Some(to), from].iter().flatten().map(height).fold(setup.clearance_mm, f64::max);
        let lifted = |p: Point3| p + axis * (over_mm - height(&p));
        if let Some(from) = from {
            self.straight(MoveKind::Rapid, from, lifted(from), setup, entry);
            self.straight(MoveKind::Rapid, lifted(from), lifted(to), setup, entry);
        }
        let lead = m.kind != MoveKind::Cut;
        let way_mm = over_mm - height(&to);
        let feed_mm = if lead { 0.0 } else { self.plunge_mm.unwrap_or(f64::INFINITY).clamp(0.0, way_mm) };
        self.straight(MoveKind::Rapid, lifted(to), to + axis * feed_mm, setup, entry);
        self.straight(MoveKind::LeadIn, to + axis * feed_mm, to, setup, entry);
        let (plunge_mm, seq) = match m.kind {
            MoveKind::LeadIn => ((m.end() - to).norm(), self.all.get(entry + 1).map_or(m.seq, |c| c.seq)),
            _ => (feed_mm, m.seq),
        };
        Some(Approach { seq, over_mm, lead, plunge_mm, feed: self.lead_feed(entry) })
    }

    /// Adds a straight way with the names of move `like`, if it has a length.
    fn straight(&mut self, kind: MoveKind, from: Point3, to: Point3, setup: &Setup, like: usize) {
        if (to - from).norm() <= GAP_MM {
            return;
        }
        let feed =
            if kind == MoveKind::Rapid { self.job.request.rapid_mm_per_min } else { self.lead_feed(like) };
        let m = &self.all[like];
        let way = Move::straight(kind, from, to, setup.axis.into(), feed);
        let (setup, tool) = (setup.name.clone(), m.tool.clone());
        self.moves.push(Move { seq: m.seq, setup, tool, region: m.region, pass: m.pass, ..way });
    }
}
