//! Gouge and contact along the paths: the distance of the ball from all faces, proven between samples.

use claymill_nurbs::{Foot, Hint};
use claymill_toolpath::{Cancelled, MoveKind};
use serde::{Deserialize, Serialize};

use crate::distribution::Distribution;
use crate::end::contact::EndWalk;
use crate::parts::{Numbers, Parts, Portable, Sees, through};
use crate::reach::Reach;
use crate::report::{Contact, Gouge, GougeSample, Place};
use crate::scene::{Scene, Stage};
use crate::track::Track;

/// What lies between two samples is looked for down to this, mm.
const BETWEEN_SAMPLES_MM: f64 = 1e-4;
/// Intervals are halved at most this often where the ball changes from one contact to another.
const HALVINGS: u32 = 7;
/// Between two samples the distance to any fixed point of the model falls below the straight line between
/// their values by `step² / 8R` at most if the path is straight; this factor allows for its curvature.
const SAG_MARGIN: f64 = 1.5;
/// Intervals so short that the sag is below this need no proof that nothing else is near, mm.
const UNSEEN_MM: f64 = 3e-4;

/// The ball at one place of a track.
#[derive(Debug, Clone, Copy)]
struct Probe {
    t: f64,
    /// Distance of the ball's surface from the nearest face; `None` beyond the margin.
    gap: Option<f64>,
    /// Its derivative with respect to the curve parameter.
    slope: f64,
    foot: Option<Foot>,
}

/// Deeper than this is a gouge worth a mark, mm; and how many marks a move has at most.
pub(crate) const GOUGE_MM: f64 = 1e-3;
pub(crate) const MARKED: usize = 200;

/// What was found along one track.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(crate) struct Along {
    pub(crate) samples: u64,
    pub(crate) deepest: Option<(f64, Place)>,
    pub(crate) deeper: [u64; 3],
    /// Marks for a picture; they are not kept.
    #[serde(skip)]
    pub(crate) gouges: Vec<GougeSample>,
    pub(crate) excess: Option<(f64, Place)>,
    pub(crate) edge_excess: Option<(f64, Place)>,
    pub(crate) gaps: Distribution,
    pub(crate) contact_samples: u64,
    /// Of these, those beyond a bar.
    pub(crate) outside: u64,
    pub(crate) outside_mm: f64,
    pub(crate) contact_mm: f64,
    pub(crate) edge_mm: f64,
    pub(crate) air_mm: f64,
    pub(crate) cut_mm: f64,
    pub(crate) material: InMaterial,
}

/// Where the ball is on the side of the material.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(crate) struct InMaterial {
    pub(crate) length_mm: f64,
    /// The first place.
    pub(crate) at: Option<Place>,
}

/// Measures gouges on all kinds of moves but rapids and the contact along passes: samples at equal spacing
/// and at knots. What lies between two samples is settled in one of three ways:
///
/// - both gaps exceed the sag: nothing can reach the ball in between;
/// - the derivatives predict the gaps and a larger ball at the same contact is empty: the gap is a smooth
///   curve, and its extremum is where the derivative vanishes;
/// - otherwise the interval is halved.
pub(crate) fn measure(
    scene: &Scene<'_>,
    reach: &Reach<'_>,
    parts: &Parts<'_>,
    stage: &Stage<'_>,
) -> Result<(Gouge, Contact, InMaterial, Vec<GougeSample>), Cancelled> {
    let tracks: Vec<&Track> = scene.tracks.iter().filter(|t| t.sweeps()).collect();
    let margin_mm = scene.options.path_spacing_mm;
    let look = |track: &Track| match track.end {
        None => {
            let [on_path, lifted] = [Hint::default(), Hint::default()];
            Walk { scene, track, margin: margin_mm, on_path, lifted }.run()
        }
        Some(body) => EndWalk { scene, reach, track, body, margin_mm }.run(),
    };
    let found: Vec<Along> = parts.along(("contact", Sees::Faces), &tracks, stage, look)?;
    Ok(summarise(found, limits_mm(scene)))
}

/// How far the ball may enter a face, and how far off it may run.
pub(crate) fn limits_mm(scene: &Scene<'_>) -> [f64; 2] {
    [scene.options.gouge_limit_mm, scene.options.excess_limit_mm]
}

impl Portable for Along {
    type Form = Along;

    fn form(&self, numbers: &Numbers<'_>) -> Option<Along> {
        let own = |at: &Option<(f64, Place)>| numbers.own_at(at.as_ref());
        Some(Along {
            deepest: own(&self.deepest)?,
            excess: own(&self.excess)?,
            edge_excess: own(&self.edge_excess)?,
            material: InMaterial {
                at: through(self.material.at.as_ref(), |at| numbers.own(at))?,
                ..self.material
            },
            ..self.clone()
        })
    }

    fn of_form(own: Along, numbers: &Numbers<'_>) -> Option<Along> {
        Some(Along {
            deepest: numbers.at(own.deepest)?,
            excess: numbers.at(own.excess)?,
            edge_excess: numbers.at(own.edge_excess)?,
            material: InMaterial { at: through(own.material.at, |at| numbers.place(at))?, ..own.material },
            ..own
        })
    }
}

struct Walk<'a> {
    scene: &'a Scene<'a>,
    track: &'a Track,
    /// Gaps beyond the spacing are not measured: the ball cannot come back to a face between two samples
    /// that far from it.
    margin: f64,
    on_path: Hint,
    lifted: Hint,
}

impl Walk<'_> {
    fn run(mut self) -> Along {
        let stations = self.track.stations(self.scene.options.path_spacing_mm);
        let stations: Vec<Probe> = stations.into_iter().map(|t| self.probe(t)).collect();
        let mut probes = Vec::with_capacity(stations.len());
        for pair in stations.windows(2) {
            probes.push(pair[0]);
            self.between(&pair[0], &pair[1], HALVINGS, &mut probes);
        }
        probes.extend(stations.last());
        // All that is said is said of the same places: each stands for the way to halfway to its neighbours.
        let mut along = Along::default();
        for (i, probe) in probes.iter().enumerate() {
            let before = if i > 0 { probe.t - probes[i - 1].t } else { 0.0 };
            let after = probes.get(i + 1).map_or(0.0, |next| next.t - probe.t);
            self.record(probe, &mut along);
            self.weigh(probe, 0.5 * (before + after), &mut along);
            self.tell_side(probe, 0.5 * (before + after), &mut along);
        }
        along
    }

    fn probe(&mut self, t: f64) -> Probe {
        let (centre, speed) = self.track.centre(t);
        let radius = self.track.radius_mm;
        let foot = (self.scene.closest).closest_from(&centre, radius + self.margin, &mut self.on_path);
        Probe {
            t,
            gap: foot.map(|f| f.distance_mm - radius),
            slope: foot.map_or(0.0, |f| speed.dot(&(centre - f.point)) / f.distance_mm.max(1e-9)),
            foot,
        }
    }

    /// Looks for the lowest and highest gap between two neighbouring probes, and appends the probes that this takes, in order.
    fn between(&mut self, a: &Probe, b: &Probe, halvings: u32, found: &mut Vec<Probe>) {
        let step = b.t - a.t;
        let gap = |p: &Probe| p.gap.unwrap_or(self.margin);
        let sag = SAG_MARGIN * step * step / (8.0 * self.track.radius_mm);
        if gap(a).min(gap(b)) > sag {
            return;
        }
        let surprise = gap(b) - gap(a) - 0.5 * step * (a.slope + b.slope);
        let smooth = surprise.abs() <= BETWEEN_SAMPLES_MM;
        if halvings > 0 && !(smooth && (sag <= UNSEEN_MM || self.alone(a, b))) {
            let middle = self.probe(0.5 * (a.t + b.t));
            self.between(a, &middle, halvings - 1, found);
            found.push(middle);
            self.between(&middle, b, halvings - 1, found);
        } else if a.slope * b.slope < 0.0 {
            // The derivative is nearly straight here, its root is where the gap is extreme; that it can
            // differ enough from both ends to matter is seen from the tangents.
            let rise = a.slope.abs().min(b.slope.abs()) * step;
            if rise > BETWEEN_SAMPLES_MM {
                let t = a.t + step * a.slope / (a.slope - b.slope);
                found.push(self.probe(t));
            }
        }
    }

    /// Whether nothing but the contact itself comes near the ball between two probes: a ball of twice the
    /// size that touches at the same place is empty. It holds the whole ball at mid-interval, and away
    /// from the contact with room to spare.
    fn alone(&mut self, a: &Probe, b: &Probe) -> bool {
        let (Some(foot_a), Some(foot_b), Some(gap_a), Some(gap_b)) = (a.foot, b.foot, a.gap, b.gap) else {
            return false;
        };
        let away = |p: &Probe, foot: &Foot| self.track.centre(p.t).0 - foot.point;
        let Some(up) = (away(a, &foot_a) + away(b, &foot_b)).try_normalize(1e-9) else {
            return false;
        };
        let radius = self.track.radius_mm;
        let predicted = 0.5 * (gap_a + gap_b) + 0.125 * (b.t - a.t) * (a.slope - b.slope);
        let lifted = self.track.centre(0.5 * (a.t + b.t)).0 + up * radius;
        let empty = 2.0 * radius + predicted.min(0.0) - BETWEEN_SAMPLES_MM;
        let nearest =
            (self.scene.closest).closest_from(&lifted, 2.0 * radius + self.margin, &mut self.lifted);
        nearest.is_none_or(|foot| foot.distance_mm >= empty)
    }

    /// Takes extremes and counts.
    fn record(&self, probe: &Probe, along: &mut Along) {
        along.samples += 1;
        let (Some(gap), Some(foot)) = (probe.gap, probe.foot) else {
            return;
        };
        for (count, limit) in along.deeper.iter_mut().zip([1e-3, 2e-3, 5e-3]) {
            *count += u64::from(gap < -limit);
        }
        if gap < -GOUGE_MM && along.gouges.len() < MARKED {
            let move_seq = self.track.seq;
            along.gouges.push(GougeSample { foot: foot.point, depth_mm: -gap, move_seq });
        }
        if gap < along.deepest.as_ref().map_or(0.0, |d| d.0) {
            along.deepest = Some((gap, self.place(probe, &foot)));
        }
        let cutting = self.track.kind == MoveKind::Cut;
        if !cutting || self.scene.is_over_a_box(&foot, &self.track.centre(probe.t).0) {
            return;
        }
        let highest = if self.rests(probe, &foot) { &mut along.excess } else { &mut along.edge_excess };
        if gap > highest.as_ref().map_or(0.0, |e| e.0) {
            *highest = Some((gap, self.place(probe, &foot)));
        }
    }

    /// Takes a sample of a pass into the statistics with the length it stands for.
    fn weigh(&self, probe: &Probe, length: f64, along: &mut Along) {
        if self.track.kind != MoveKind::Cut {
            return;
        }
        along.cut_mm += length;
        match (probe.gap, probe.foot) {
            (Some(gap), Some(foot)) if self.rests(probe, &foot) => {
                along.contact_samples += 1;
                along.contact_mm += length;
                along.gaps.add(gap, length);
                let [below, above] = limits_mm(self.scene);
                if !(-below..=above).contains(&gap) {
                    along.outside += 1;
                    along.outside_mm += length;
                }
            }
            (Some(_), _) => along.edge_mm += length,
            (None, _) => along.air_mm += length,
        }
    }

    /// Adds to the length in the material.
    fn tell_side(&self, probe: &Probe, length_mm: f64, along: &mut Along) {
        let Some(foot) = probe.foot else { return };
        if self.scene.is_in_material(&foot, &self.track.centre(probe.t).0) {
            along.material.length_mm += length_mm;
            along.material.at.get_or_insert_with(|| self.place(probe, &foot));
        }
    }

    fn rests(&self, probe: &Probe, foot: &Foot) -> bool {
        self.scene.faces_squarely(foot, &self.track.centre(probe.t).0)
    }

    fn place(&self, probe: &Probe, foot: &Foot) -> Place {
        Place {
            move_seq: Some(self.track.seq),
            parameter: Some(probe.t),
            ..self.scene.place(foot.point, Some(foot.face))
        }
    }
}

fn summarise(found: Vec<Along>, limits_mm: [f64; 2]) -> (Gouge, Contact, InMaterial, Vec<GougeSample>) {
    let mut all = Along::default();
    for one in found {
        all.samples += one.samples;
        all.contact_samples += one.contact_samples;
        all.contact_mm += one.contact_mm;
        all.outside += one.outside;
        all.outside_mm += one.outside_mm;
        all.edge_mm += one.edge_mm;
        all.material.length_mm += one.material.length_mm;
        all.material.at = all.material.at.or(one.material.at);
        all.air_mm += one.air_mm;
        all.cut_mm += one.cut_mm;
        for (sum, count) in all.deeper.iter_mut().zip(one.deeper) {
            *sum += count;
        }
        if let Some(d) = one.deepest
            && all.deepest.as_ref().is_none_or(|best| d.0 < best.0)
        {
            all.deepest = Some(d);
        }
        if let Some(e) = one.excess
            && all.excess.as_ref().is_none_or(|best| e.0 > best.0)
        {
            all.excess = Some(e);
        }
        if let Some(e) = one.edge_excess
            && all.edge_excess.as_ref().is_none_or(|best| e.0 > best.0)
        {
            all.edge_excess = Some(e);
        }
        all.gaps.append(one.gaps);
        all.gouges.extend(one.gouges);
    }
    let share = |length: f64| {
        if all.cut_mm > 0.0 { length / all.cut_mm } else { 0.0 }
    };
    let gouge = Gouge {
        samples: all.samples,
        deepest_mm: all.deepest.as_ref().map_or(0.0, |d| -d.0),
        deepest_at: all.deepest.as_ref().map(|d| d.1.clone()),
        deeper_than_1_um: all.deeper[0],
        deeper_than_2_um: all.deeper[1],
        deeper_than_5_um: all.deeper[2],
    };
    let contact = Contact {
        samples: all.contact_samples,
        excess_max_mm: all.excess.as_ref().map_or(0.0, |e| e.0),
        excess_max_at: all.excess.as_ref().map(|e| e.1.clone()),
        edge_excess_max_mm: all.edge_excess.as_ref().map_or(0.0, |e| e.0),
        edge_excess_max_at: all.edge_excess.as_ref().map(|e| e.1.clone()),
        excess_p99_mm: all.gaps.percentile(0.99),
        excess_mean_mm: all.gaps.mean(),
        within_limit_share: within_share(&all),
        outside: all.outside,
        limits_mm,
        on_edge_share: share(all.edge_mm),
        in_air_share: share(all.air_mm),
    };
    (gouge, contact, all.material, all.gouges)
}

/// The share of the contact within the bars, below 1 as soon as one place is not.
fn within_share(all: &Along) -> f64 {
    match all.outside {
        0 if all.contact_samples > 0 => 1.0,
        0 => 0.0,
        _ => (1.0 - all.outside_mm / all.contact_mm.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0 - f64::EPSILON),
    }
}
