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
        let mut schedule = Schedule { ends_s: Vec::new(), places_s: Vec::new(), stops: 0 };
        let (mut begin, mut time_s) = (0, 0.0);
        let mut ends = track.ends().iter().copied().peekable();
        while begin < all.len() {
            let stop = |p: &(crate::Joint, crate::Place)| p.0.speed <= 0.0;
            let end = all[begin + 1..].iter().position(stop).map_or(all.len(), |i| begin + 1 + i);
            let chain = Chain::plan(all[begin..end].to_vec(), track.limits());
            let mut at = 0.0;
            for i in begin..end {
                while ends.next_if_eq(&i).is_some() {
                    schedule.ends_s.push(time_s + chain.time_of(at));
                }
                at += all[i].1.length_mm;
                if places {
                    schedule
                        .places_s
                        .push(time_s + if i + 1 == end { chain.time_s() } else { chain.time_of(at) });
                }
            }
            time_s += chain.time_s();
            schedule.stops += 1;
            begin = end;
        }
        schedule.ends_s.extend(ends.map(|_| time_s));
        schedule
    }

    /// How long it takes, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.ends_s.last().copied().unwrap_or(0.0)
    }
}
