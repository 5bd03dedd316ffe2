//! The time that is shown: a job runs along its moves, forwards, by steps or at once.

use claymill_toolpath::ToolRecord;

use crate::desk::Desk;
use crate::tracks::{ToolPlace, tool_at};

/// The time shown, and how fast it goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    /// Time since the start of the job, s.
    pub now_s: f64,
    /// Whether it runs.
    pub playing: bool,
    /// Seconds of the machine a second.
    pub speed: f64,
}

impl Desk<'_> {
    /// How long the job takes, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.tracks.duration_s()
    }

    /// Lets time pass; returns whether anything moved.
    pub fn tick(&mut self, passed_s: f64) -> bool {
        if !self.clock.playing {
            return false;
        }
        self.clock.now_s = (self.clock.now_s + passed_s * self.clock.speed).min(self.duration_s());
        if self.clock.now_s >= self.duration_s() {
            self.clock.playing = false;
        }
        true
    }

    /// Starts or stops; from the end it starts anew.
    pub fn play(&mut self) {
        if !self.clock.playing && self.clock.now_s >= self.duration_s() {
            self.clock.now_s = 0.0;
        }
        self.clock.playing = !self.clock.playing && self.duration_s() > 0.0;
    }

    /// Goes to the start of the next move, or back to the start of this one or the one before.
    pub fn step(&mut self, forward: bool) {
        let begins = &self.tracks.begins_s;
        if begins.len() < 2 {
            return;
        }
        self.clock.playing = false;
        let after = begins.partition_point(|b| *b <= self.clock.now_s);
        let before = begins.partition_point(|b| *b < self.clock.now_s);
        let to = if forward { begins.get(after) } else { before.checked_sub(1).map(|b| &begins[b]) };
        self.clock.now_s = to.copied().unwrap_or(if forward { self.duration_s() } else { 0.0 });
    }

    /// The move that is on and the part of it that is done; `None` when the job is over.
    #[must_use]
    pub fn now(&self) -> Option<(usize, f64)> {
        if self.clock.now_s >= self.duration_s() {
            return None;
        }
        let of = self.tracks.move_at(self.clock.now_s);
        let (from, to) = (self.tracks.begins_s[of], self.tracks.begins_s[of + 1]);
        Some((of, ((self.clock.now_s - from) / (to - from).max(1e-12)).clamp(0.0, 1.0)))
    }

    /// The tool at the time shown; none when the job is over.
    #[must_use]
    pub fn tool_place(&self) -> Option<ToolPlace> {
        let (of, share) = self.now()?;
        tool_at(self.exhibit.job.as_ref()?, of, share)
    }

    /// The job's tool at a place, as it is in the setup there.
    pub(crate) fn tool_record(&self, place: &ToolPlace) -> Option<ToolRecord> {
        let job = self.exhibit.job.as_ref()?;
        let at = job.program.moves.get(place.of)?;
        job.job.tools.iter().find(|t| t.id == at.tool).map(|t| t.in_setup(&at.setup))
    }

    /// Moves up to here are drawn.
    pub(crate) fn until(&self) -> (u32, f32) {
        self.now().map_or((u32::MAX, 1.0), |(of, share)| (of as u32, share as f32))
    }
}
