//! The times at which a machine passes the curves of a whole track. The track is cut into chains at
//! its stops; each chain is planned by itself.

use std::ops::Range;

use rayon::prelude::*;

use crate::{Chain, Track};

/// When a machine passes the places of a track that begins and ends at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Schedule {
    /// Time at the end of every curve of the track, s.
    pub ends_s: Vec<f64>,
    /// Time at the end of every place, s; empty unless asked for.
    pub places_s: Vec<f64>,
    /// Times that the machine comes to rest, the last one included.
    pub stops: u64,
}

impl Schedule {
    /// Runs over a track; `places` asks for the time at every place.
    #[must_use]
    pub fn new(track: &Track, places: bool) -> Self {
        let all = track.places();
        let mut chains = Vec::new();
        let mut begin = 0;
        while begin < all.len() {
            let stop = |p: &(crate::Joint, crate::Place)| p.0.speed <= 0.0;
            let end = all[begin + 1..].iter().position(stop).map_or(all.len(), |i| begin + 1 + i);
            chains.push(begin..end);
            begin = end;
        }
        // From rest to rest, so that none depends on another.
        let runs: Vec<Run> = chains.par_iter().map(|chain| Run::new(track, chain.clone(), places)).collect();
        let mut schedule = Schedule { ends_s: Vec::new(), places_s: Vec::new(), stops: runs.len() as u64 };
        let mut time_s = 0.0;
        for run in runs {
            schedule.ends_s.extend(run.ends_s.iter().map(|t| time_s + t));
            schedule.places_s.extend(run.places_s.iter().map(|t| time_s + t));
            time_s += run.time_s;
        }
        let ends = track.ends().iter().skip(schedule.ends_s.len());
        schedule.ends_s.extend(ends.map(|_| time_s));
        schedule
    }

    /// How long it takes, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.ends_s.last().copied().unwrap_or(0.0)
    }
}

/// A chain of places from rest to rest, with times from its beginning.
struct Run {
    ends_s: Vec<f64>,
    places_s: Vec<f64>,
    time_s: f64,
}

impl Run {
    fn new(track: &Track, range: Range<usize>, places: bool) -> Self {
        let places_of = &track.places()[range.clone()];
        let chain = Chain::plan(places_of.to_vec(), track.limits());
        let first = track.ends().partition_point(|&end| end < range.start);
        let mut ends = track.ends()[first..].iter().copied().peekable();
        let mut run = Run { ends_s: Vec::new(), places_s: Vec::new(), time_s: chain.time_s() };
        let mut at = 0.0;
        for (i, (_, place)) in range.clone().zip(places_of) {
            while ends.next_if_eq(&i).is_some() {
                run.ends_s.push(chain.time_of(at));
            }
            at += place.length_mm;
            if places {
                run.places_s.push(if i + 1 == range.end { chain.time_s() } else { chain.time_of(at) });
            }
        }
        run
    }
}
