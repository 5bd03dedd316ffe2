use claymill_nurbs::{Foot, Hint, Vector3};
use claymill_toolpath::MoveKind;
use rayon::prelude::*;

use crate::distribution::Distribution;
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

/// The ball is in the material where the face around the place that is nearest to it says so too, this far away, mm.
const ALL_AROUND_MM: f64 = 0.2;

/// Deeper than this is a gouge worth a mark, mm; and how many marks a move has at most.
const GOUGE_MM: f64 = 1e-3;
const MARKED: usize = 200;

/// What was found along one track.
#[derive(Default)]
struct Along {
    samples: u64,
    deepest: Option<(f64, Place)>,
    deeper: [u64; 3],
    gouges: Vec<GougeSample>,
    excess: Option<(f64, Place)>,
    gaps: Distribution,
    contact_samples: u64,
    edge_mm: f64,
    air_mm: f64,
    cut_mm: f64,
    material: InMaterial,
}

/// Where the ball is on the side of the material.
#[derive(Default)]
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
    stage: &Stage<'_>,
) -> (Gouge, Contact, InMaterial, Vec<GougeSample>) {
    let tracks: Vec<&Track> = scene.tracks.iter().filter(|t| t.sweeps()).collect();
    let found: Vec<Along> = tracks
        .par_iter()
        .map(|track| {
            let along = Walk {
                scene,
                track,
                margin: scene.options.path_spacing_mm,
                on_path: Hint::default(),
                lifted: Hint::default(),
            }
            .run();
            stage.step(tracks.len());
            along
        })
        .collect();
    summarise(found, scene.options.excess_limit_mm)
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
        let mut along = Along::default();
        let stations = self.track.stations(self.scene.options.path_spacing_mm);
        let probes: Vec<Probe> = stations.iter().map(|&t| self.probe(t)).collect();
        for (i, probe) in probes.iter().enumerate() {
            let before = if i > 0 { probe.t - stations[i - 1] } else { 0.0 };
            let after = stations.get(i + 1).map_or(0.0, |t| t - probe.t);
            self.record(probe, &mut along);
            self.weigh(probe, 0.5 * (before + after), &mut along);
            self.tell_side(probe, 0.5 * (before + after), &mut along);
        }
        for pair in probes.windows(2) {
            self.between(&pair[0], &pair[1], HALVINGS, &mut along);
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

    /// Looks for the lowest and highest gap between two neighbouring probes.
    fn between(&mut self, a: &Probe, b: &Probe, halvings: u32, along: &mut Along) {
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
            self.record(&middle, along);
            self.between(a, &middle, halvings - 1, along);
            self.between(&middle, b, halvings - 1, along);
        } else if a.slope * b.slope < 0.0 {
            // The derivative is nearly straight here, its root is where the gap is extreme; that it can
            // differ enough from both ends to matter is seen from the tangents.
            let rise = a.slope.abs().min(b.slope.abs()) * step;
            if rise > BETWEEN_SAMPLES_MM {
                let t = a.t + step * a.slope / (a.slope - b.slope);
                let extreme = self.probe(t);
                self.record(&extreme, along);
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
        if cutting && gap > along.excess.as_ref().map_or(0.0, |e| e.0) && self.rests(probe, &foot) {
            along.excess = Some((gap, self.place(probe, &foot)));
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
                along.gaps.add(gap, length);
            }
            (Some(_), _) => along.edge_mm += length,
            (None, _) => along.air_mm += length,
        }
    }

    /// The ball is in the material where what is nearest to its centre is the inside of a face, whose material is on that side:
    /// nothing lies between.
    fn tell_side(&self, probe: &Probe, length_mm: f64, along: &mut Along) {
        let Some(foot) = probe.foot.filter(|foot| !foot.on_boundary) else { return };
        let free = self.scene.free_sides[foot.face];
        if free.is_both() {
            return;
        }
        let (centre, surface) = (self.track.centre(probe.t).0, &self.scene.model.faces[foot.face].surface);
        let is_of_material = |u: f64, v: f64| {
            let away = centre - surface.point(u, v);
            surface.normal(u, v).is_some_and(|(n, _)| !free.allows(n.dot(&away) > 0.0))
        };
        if !is_of_material(foot.u, foot.v) {
            return;
        }
        // Files let faces curl over at their borders, by less than this: it has to be so all around.
        let (jet, ((u0, u1), (v0, v1))) = (surface.jet(foot.u, foot.v), surface.domain());
        let step = |slope: Vector3| ALL_AROUND_MM / slope.norm().max(f64::MIN_POSITIVE);
        let (du, dv) = (step(jet.su), step(jet.sv));
        let around = [(du, 0.0), (-du, 0.0), (0.0, dv), (0.0, -dv)].map(|(a, b)| (foot.u + a, foot.v + b));
        let is_inside = |&(u, v): &(f64, f64)| (u0..=u1).contains(&u) && (v0..=v1).contains(&v);
        if around.iter().all(|at| is_inside(at) && is_of_material(at.0, at.1)) {
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

fn summarise(found: Vec<Along>, limit_mm: f64) -> (Gouge, Contact, InMaterial, Vec<GougeSample>) {
    let mut all = Along::default();
    for one in found {
        all.samples += one.samples;
        all.contact_samples += one.contact_samples;
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
        all.gaps.append(one.gaps);
        all.gouges.extend(one.gouges);
    }
    let share = |length: f64| {
        if all.cut_mm > 0.0 { length / all.cut_mm } else { 0.0 }
    };
    let gouge = Gouge {
        samples: all.samples,
        deepest_mm: all.deepest.as_ref().map_or(0.0, |d| -d.0),
        deepest_at: all.deepest.map(|d| d.1),
        deeper_than_1_um: all.deeper[0],
        deeper_than_2_um: all.deeper[1],
        deeper_than_5_um: all.deeper[2],
    };
    let contact = Contact {
        samples: all.contact_samples,
        excess_max_mm: all.excess.as_ref().map_or(0.0, |e| e.0),
        excess_max_at: all.excess.map(|e| e.1),
        excess_p99_mm: all.gaps.percentile(0.99),
        excess_mean_mm: all.gaps.mean(),
        within_limit_share: all.gaps.share(|gap| gap.abs() <= limit_mm),
        on_edge_share: share(all.edge_mm),
        in_air_share: share(all.air_mm),
    };
    (gouge, contact, all.material, all.gouges)
}
