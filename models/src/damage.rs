//! Flaws of single faces: missing, double, lying on others, turned over, coarsely written.

use claymill_nurbs::{Face, FaceId, NurbsSurface, Point3};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use crate::Sample;
use crate::answers::{Answers, Continuity, Region, Totals};
use crate::flaw::{Flaw, FlawError, PlantedFlaw};
use crate::shuffle::{cut_out, disguised};

/// The part of a face that a lapping patch covers, in both directions.
const LAP: (f64, f64) = (0.25, 0.75);

impl Sample {
    /// The sample with flaws of single faces planted, each on faces of its own, and the answers to match:
    /// faces are renumbered where some are deleted; copies and laps come last. Copies belong to the region
    /// of their original, laps are regions of their own; joints are those of the other faces. Rounding
    /// leaves the answers as they were: each control point is off by half a step in each coordinate at
    /// most.
    ///
    /// # Errors
    /// A flaw that needs straight lines ([`Flaw::is_on_a_line`], T-junctions), or more faces than there are.
    pub fn damaged(mut self, flaws: &[Flaw], seed: u64) -> Result<Self, FlawError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(u64::MAX);
        let rank = |flaw: &Flaw| match flaw {
            Flaw::Delete(_) => 0,
            Flaw::Flip(_) => 1,
            Flaw::Duplicate(_) => 2,
            Flaw::Lap(_) => 3,
            _ => 4,
        };
        let mut flaws = flaws.to_vec();
        flaws.sort_by_key(rank);
        let mut free: Vec<FaceId> = (0..self.model.faces.len()).collect();
        free.shuffle(&mut rng);
        for flaw in flaws {
            let mut take = |n: usize| {
                let faces = free.len();
                if n >= faces {
                    return Err(FlawError::TooMany { flaw: flaw.to_string(), faces });
                }
                Ok(free.split_off(faces - n))
            };
            match flaw {
                Flaw::Delete(n) => {
                    let gone = take(n)?;
                    let kept = self.delete(&gone, flaw);
                    free.iter_mut().for_each(|f| *f = kept[*f]);
                }
                Flaw::Flip(n) => self.flip(take(n)?, flaw),
                Flaw::Duplicate(n) => {
                    take(n)?.into_iter().for_each(|face| self.duplicate(face, flaw, &mut rng));
                }
                Flaw::Lap(n) => take(n)?.into_iter().for_each(|face| self.lap(face, flaw, &mut rng)),
                Flaw::Round(digits) => self.round(digits, flaw),
                _ => return Err(FlawError::OnlyRibbon { flaw: flaw.to_string() }),
            }
        }
        self.answers.total_up();
        Ok(self)
    }

    /// Returns the new number of each face; those of missing faces mean nothing.
    fn delete(&mut self, gone: &[FaceId], flaw: Flaw) -> Vec<FaceId> {
        let count = self.model.faces.len();
        let mut keep = vec![true; count];
        gone.iter().for_each(|&f| keep[f] = false);
        let mut new = vec![0; count];
        let mut next = 0;
        for f in 0..count {
            new[f] = next;
            next += usize::from(keep[f]);
        }
        let mut face = 0..count;
        self.model.faces.retain(|_| face.next().is_some_and(|f| keep[f]));
        let answers = &mut self.answers;
        let mut face = 0..count;
        answers.region_of_face.retain(|_| face.next().is_some_and(|f| keep[f]));
        let left_over = answers.joints.iter().filter(|j| keep[j.faces[0]] != keep[j.faces[1]]);
        let length_mm = left_over.map(|j| j.length_mm).sum();
        let both = |faces: &[FaceId; 2]| faces.iter().all(|&f| keep[f]);
        answers.joints.retain(|j| both(&j.faces));
        answers.joints.iter_mut().for_each(|j| j.faces = j.faces.map(|f| new[f]));
        for planted in &mut answers.flaws {
            planted.joints.retain(both);
            planted.joints.iter_mut().for_each(|j| *j = j.map(|f| new[f]));
            let of = |faces: &[FaceId; 2]| {
                let all = answers.joints.iter().filter(|j| j.faces == *faces);
                all.map(|j| j.length_mm).sum::<f64>()
            };
            planted.length_mm = planted.joints.iter().map(of).sum();
        }
        answers.split_regions();
        self.plant(flaw, gone.len() as f64, Vec::new(), length_mm);
        new
    }

    fn flip(&mut self, faces: Vec<FaceId>, flaw: Flaw) {
        for &face in &faces {
            let surface = &mut self.model.faces[face].surface;
            *surface = surface.reversed_u();
        }
        self.plant(flaw, 1.0, faces, 0.0);
    }

    fn duplicate(&mut self, face: FaceId, flaw: Flaw, rng: &mut ChaCha8Rng) {
        let surface = disguised(self.model.faces[face].surface.clone(), rng);
        let region = self.answers.region_of_face[face];
        let copy = self.append(surface, face, region);
        self.plant(flaw, 1.0, vec![face, copy], 0.0);
    }

    fn lap(&mut self, face: FaceId, flaw: Flaw, rng: &mut ChaCha8Rng) {
        let under = &self.model.faces[face].surface;
        let ((u0, u1), (v0, v1)) = under.domain();
        let within = |a: f64, b: f64| (a + (b - a) * LAP.0, a + (b - a) * LAP.1);
        let surface = disguised(cut_out(under, within(u0, u1), within(v0, v1)), rng);
        let region = self.answers.regions.len();
        self.answers.regions.push(Region { name: format!("lap on face {face}"), faces: Vec::new() });
        let patch = self.append(surface, face, region);
        self.plant(flaw, 1.0, vec![patch, face], 0.0);
    }

    fn append(&mut self, surface: NurbsSurface, like: FaceId, region: usize) -> FaceId {
        let face = Face { surface, ..self.model.faces[like].clone() };
        self.model.faces.push(face);
        let id = self.model.faces.len() - 1;
        self.answers.region_of_face.push(region);
        self.answers.regions[region].faces.push(id);
        id
    }

    fn round(&mut self, digits: usize, flaw: Flaw) {
        let steps = 10f64.powi(i32::try_from(digits).unwrap_or(i32::MAX));
        for face in &mut self.model.faces {
            let rounded = |x: f64| (x * steps).round() / steps;
            face.surface = face.surface.mapped(|p| Point3::new(rounded(p.x), rounded(p.y), rounded(p.z)));
        }
        self.model.coordinate_step_mm = 1.0 / steps;
        self.plant(flaw, 1.0 / steps, Vec::new(), 0.0);
    }

    fn plant(&mut self, flaw: Flaw, size: f64, faces: Vec<FaceId>, length_mm: f64) {
        let flaw = flaw.to_string();
        self.answers.flaws.push(PlantedFlaw { flaw, size, faces, joints: Vec::new(), length_mm });
    }
}

impl Answers {
    /// Takes apart regions that are no longer connected by smooth joints; empty ones go.
    fn split_regions(&mut self) {
        let count = self.region_of_face.len();
        let mut neighbours: Vec<Vec<FaceId>> = vec![Vec::new(); count];
        for joint in self.joints.iter().filter(|j| j.class != Continuity::C0) {
            let [a, b] = joint.faces;
            neighbours[a].push(b);
            neighbours[b].push(a);
        }
        let mut regions: Vec<Region> = Vec::new();
        let mut of_face: Vec<Option<usize>> = vec![None; count];
        // A region's faces need not have been connected by joints alone: what was apart stays so.
        for seed in 0..count {
            if of_face[seed].is_some() {
                continue;
            }
            let name = self.regions[self.region_of_face[seed]].name.clone();
            let (mut faces, mut queue) = (Vec::new(), vec![seed]);
            of_face[seed] = Some(regions.len());
            while let Some(face) = queue.pop() {
                faces.push(face);
                for &next in &neighbours[face] {
                    if of_face[next].is_none() && self.region_of_face[next] == self.region_of_face[seed] {
                        of_face[next] = Some(regions.len());
                        queue.push(next);
                    }
                }
            }
            faces.sort_unstable();
            regions.push(Region { name, faces });
        }
        self.regions = regions;
        self.region_of_face = of_face.into_iter().flatten().collect();
    }

    /// Counts everything anew. The least angle along creases that the generator knows stays; else it is that
    /// of the joints.
    pub(crate) fn total_up(&mut self) {
        let of = |class| self.joints.iter().filter(move |j| j.class == class);
        let least_crease_deg = match self.totals.least_crease_deg {
            0.0 => of(Continuity::C0).map(|j| j.angle_deg).fold(180.0, f64::min),
            known => known,
        };
        self.totals = Totals {
            faces: self.region_of_face.len(),
            regions: self.regions.len(),
            joints_c0: of(Continuity::C0).count(),
            joints_g1: of(Continuity::G1).count(),
            joints_g2: of(Continuity::G2).count(),
            joint_length_mm: self.joints.iter().map(|j| j.length_mm).sum(),
            least_crease_deg,
        };
    }
}
