//! Where the first levels of a pattern lie.

use crate::pattern::levels::pattern::{Levels, Spot};
use crate::pattern::rows::raster::cheapest_step;
use crate::pattern::step_over::on_contact_mm;
use crate::setup::context::SetupContext;

/// Levels, at most, at which the step-over is asked for before the first passes are laid.
const ASKED: usize = 48;
/// Levels are spread by up to this factor rather than one more laid: crests grow by twice as much.
const SPREAD: f64 = 1.005;

impl SetupContext<'_> {
    /// Levels at a distance that wastes least: their density is asked for all over the range. Where levels count
    /// step-overs they are one apart: what single places ask for differs from that by accident.
    pub(crate) fn first_levels(&self, pattern: &dyn Levels) -> Vec<f64> {
        let (low, high) = pattern.range();
        if let Some(count) = pattern.count() {
            return (0..count).map(|k| low + (high - low) * (k as f64 + 0.5) / count as f64).collect();
        }
        let asked = if pattern.in_steps() { 1 } else { ASKED };
        let width = (high - low) / asked as f64;
        let density = |k: usize| {
            if pattern.in_steps() {
                return 1.0;
            }
            let level = low + (k as f64 + 0.5) * width;
            let needs: Vec<f32> =
                pattern.whole_lines(level).iter().flat_map(|line| self.needs(line)).collect();
            let widest = f64::from(needs.iter().copied().fold(0.0f32, f32::max));
            if widest <= 0.0 { 0.0 } else { 1.0 / cheapest_step(&needs, widest) }
        };
        let density: Vec<f64> = (0..asked).map(density).collect();
        let mut sums = vec![0.0];
        for d in &density {
            sums.push(sums[sums.len() - 1] + d * width);
        }
        let total = sums[asked];
        let count = (total / SPREAD).ceil() as usize;
        (0..count)
            .map(|k| {
                let wanted = total * (k as f64 + 0.5) / count as f64;
                let cell = sums.partition_point(|&s| s <= wanted).clamp(1, asked) - 1;
                low + width * (cell as f64 + (wanted - sums[cell]) / (sums[cell + 1] - sums[cell]))
            })
            .collect()
    }

    /// For the claimed places of a line, how far in level the next line may be; where nothing is claimed on it, for all
    /// of them: what is claimed may begin between it and the next line that is asked.
    fn needs(&self, line: &[Spot]) -> Vec<f32> {
        let places = self.places(line);
        let (mut needs, mut unclaimed) = (Vec::new(), Vec::new());
        for (a, b) in places.iter().zip(places.iter().skip(1)) {
            let (Some(a), Some(b)) = (a, b) else { continue };
            if a.spot.per_level_mm <= 0.0 {
                continue;
            }
            let jet = self.ball.surface(a.spot.face).jet(a.spot.u, a.spot.v);
            let across = a.normal.cross(&(b.point - a.point));
            let step = on_contact_mm(&jet, &across, &a.normal, self.ball.radius_mm(), self.scallop_mm);
            if let Some(step) = step {
                let kept = if a.claimed { &mut needs } else { &mut unclaimed };
                kept.push((step / a.spot.per_level_mm) as f32);
            }
        }
        if needs.is_empty() { unclaimed } else { needs }
    }
}
