//! The whole program judged: every rapid, link and lead-in, every shank and holder, what is left,
//! volumes and the largest engagement.

use std::collections::BTreeMap;

use claymill_toolpath::MoveKind;
use rayon::prelude::*;

use super::check::StockCheck;
use super::engagement::Engagement;
use super::error::{KeepGoing, StockError, sized};
use super::left::{StockSample, Thickness};
use super::report::{EngagementAt, StockContact, StockLeft, StockProof, StockReport};
use super::sweeps::Time;
use crate::report::Place;

/// What should be left over the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftBand {
    /// Allowance that the program was to leave, mm along the normal; 0 after finishing.
    pub allowance_mm: f64,
    /// How much less may be left, mm; 0.005 is the bar for gouges.
    pub less_mm: f64,
    /// How much more may be left, mm.
    pub more_mm: f64,
    /// How far along the normal stock is looked for on both sides, mm. What is higher may be of another part of the model.
    pub reach_mm: f64,
}

/// Directions about the tool are scanned in steps of this for a report, degrees.
const SCAN_DEG: f64 = 3.0;

/// What is known of one move.
struct Proofs {
    /// Of all of the tool, where the move should be clear of stock.
    clear: Option<StockProof>,
    /// Of shank and holder, where the move cuts.
    body: Option<StockProof>,
}

impl StockCheck<'_> {
    /// Stock left over samples of the surface at the end of the program, against a band.
    ///
    /// # Errors
    /// A number is not finite or no size; stopped.
    pub fn stock_left(
        &self,
        samples: &[StockSample],
        band: &LeftBand,
        keep_going: KeepGoing<'_>,
    ) -> Result<StockLeft, StockError> {
        let reach = sized("reach of what is left, mm,", band.reach_mm, 1e-6, 1e4)?;
        for (what, value) in [
            ("allowance, mm,", band.allowance_mm),
            ("band below, mm,", band.less_mm),
            ("band above, mm,", band.more_mm),
        ] {
            sized(what, value, -1e4, 1e4)?;
        }
        let found: Vec<Thickness> = samples
            .par_iter()
            .map(|s| {
                if keep_going() {
                    Ok(self.thickness(&s.point, &s.normal, reach.min(s.ahead_mm)))
                } else {
                    Err(StockError::Stopped)
                }
            })
            .collect::<Result<_, _>>()?;
        let (low, high) = (band.allowance_mm - band.less_mm, band.allowance_mm + band.more_mm);
        let mut left =
            StockLeft { samples: samples.len() as u64, band_mm: [low, high], ..StockLeft::default() };
        let mut known_mm2 = 0.0;
        let mut thin: Option<(f64, usize)> = None;
        let mut thick: Option<(f64, usize)> = None;
        for (k, (sample, found)) in samples.iter().zip(&found).enumerate() {
            left.area_mm2 += sample.area_mm2;
            let is_beyond = *found == Thickness::Beyond && sample.ahead_mm >= reach;
            let height = match found {
                Thickness::Known(d) => *d,
                // All there is over this place is stock.
                Thickness::Beyond => reach.min(sample.ahead_mm.max(low)),
                Thickness::Nothing => -reach,
            };
            left.beyond += u64::from(is_beyond);
            left.nothing += u64::from(*found == Thickness::Nothing);
            let part = if height < low {
                &mut left.below
            } else if height > high || is_beyond {
                &mut left.above
            } else {
                &mut left.within
            };
            *part += sample.area_mm2;
            if thin.is_none_or(|t| height < t.0) {
                thin = Some((height, k));
            }
            if thick.is_none_or(|t| height > t.0) {
                thick = Some((height, k));
            }
            if let Thickness::Known(d) = found {
                known_mm2 += sample.area_mm2;
                left.mean_mm += d * sample.area_mm2;
                let [least, most] = left.extremes_mm.unwrap_or([*d, *d]);
                left.extremes_mm = Some([least.min(*d), most.max(*d)]);
            }
        }
        if known_mm2 > 0.0 {
            left.mean_mm /= known_mm2;
        }
        if left.area_mm2 > 0.0 {
            for part in [&mut left.within, &mut left.below, &mut left.above] {
                *part /= left.area_mm2;
            }
        }
        let place = |k: usize| Place {
            point_mm: samples[k].point.into(),
            move_seq: None,
            parameter: None,
            face: None,
            entity: None,
        };
        left.thinnest_at = thin.map(|t| place(t.1));
        left.thickest_at = thick.map(|t| place(t.1));
        Ok(left)
    }

    /// Judges the whole program. `left` has samples of the surface and the band for what is left there, if that is wanted.
    ///
    /// # Errors
    /// Stopped, or a number of the band is absurd.
    pub fn report(
        &self,
        left: Option<(&[StockSample], &LeftBand)>,
        keep_going: KeepGoing<'_>,
    ) -> Result<StockReport, StockError> {
        let boxes = self.options.share(self.moves.len());
        let judged: Vec<Proofs> = (0..self.moves.len())
            .into_par_iter()
            .map(|k| {
                if !keep_going() {
                    return Err(StockError::Stopped);
                }
                let kind = self.moves[k].kind;
                let should_be_clear = match kind {
                    MoveKind::Rapid => true,
                    MoveKind::Link | MoveKind::LeadIn => self.options.links_clear,
                    MoveKind::Cut | MoveKind::LeadOut => false,
                };
                let clear =
                    should_be_clear.then(|| self.clear_of_all(k, self.time_of(k)?, boxes)).transpose()?;
                let body = if kind == MoveKind::Rapid { None } else { Some(self.body_clear(k, boxes)?) };
                Ok(Proofs { clear, body })
            })
            .collect::<Result<_, _>>()?;
        let mut clear: BTreeMap<MoveKind, StockContact> = BTreeMap::new();
        let mut body = StockContact::default();
        for (m, proofs) in self.moves.iter().zip(judged) {
            if let Some(proof) = proofs.clear {
                clear.entry(m.kind).or_default().add(proof);
            }
            if let Some(proof) = proofs.body {
                body.add(proof);
            }
        }
        Ok(StockReport {
            pieces: self.pieces().0 as u64,
            clear,
            body,
            left: left.map(|(samples, band)| self.stock_left(samples, band, keep_going)).transpose()?,
            volumes: self.volumes(keep_going)?,
            engagement: self.largest_engagement(keep_going)?,
        })
    }

    /// The largest engagement of poses spread evenly over the chords that cut, each at its middle; `None` where nothing cuts.
    ///
    /// # Errors
    /// Stopped.
    pub fn largest_engagement(&self, keep_going: KeepGoing<'_>) -> Result<Option<EngagementAt>, StockError> {
        let cuts = |time: &Time| {
            let of_move = self.sweeps.steps[*time as usize].of_move as usize;
            matches!(self.moves[of_move].kind, MoveKind::Cut | MoveKind::Link | MoveKind::LeadIn)
        };
        let times: Vec<Time> = (0..self.sweeps.steps.len() as Time).filter(cuts).collect();
        let wanted = self.options.engagement_poses.min(times.len() as u64);
        let poses: Vec<Time> =
            (0..wanted).map(|k| times[((2 * k + 1) * times.len() as u64 / (2 * wanted)) as usize]).collect();
        let found: Vec<Option<(Engagement, Place)>> = poses
            .par_iter()
            .map(|&time| if keep_going() { self.engaged_at(time) } else { Err(StockError::Stopped) })
            .collect::<Result<_, _>>()?;
        let larger = |a: (Engagement, Place), b: (Engagement, Place)| {
            if b.0.angle_deg > a.0.angle_deg { b } else { a }
        };
        let largest = found.into_iter().flatten().reduce(larger);
        Ok(largest.map(|(engagement, at)| EngagementAt { engagement, at, poses: wanted }))
    }

    /// The largest engagement over the tool's heights in the middle of a chord.
    fn engaged_at(&self, time: Time) -> Result<Option<(Engagement, Place)>, StockError> {
        let Some((of_move, chord)) = self.chord_at(time) else { return Ok(None) };
        let parameter = 0.5 * (chord.parameters[0] + chord.parameters[1]);
        let tip = nalgebra::center(&chord.tips[0], &chord.tips[1]);
        let mut largest: Option<Engagement> = None;
        for height in self.heights_of(of_move) {
            let found = self.engagement(of_move, parameter, height, SCAN_DEG)?;
            if let Some(e) = found.filter(|e| largest.as_ref().is_none_or(|l| e.angle_deg > l.angle_deg)) {
                largest = Some(e);
            }
        }
        Ok(largest.map(|e| (e, self.place(of_move, chord, &tip))))
    }
}
