//! The sample `ribbon`: blocks of patches with straight lines between them, and on each line a gap,
//! shift, kink or curvature jump of exactly known size.

use claymill_nurbs::{Face, Model, NurbsSurface, Point3, Source, SurfaceKind, Vector3};
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::Sample;
use crate::answers::{Answers, Continuity, Joint, Region, Totals, generator};
use crate::flaw::{Flaw, FlawError, PlantedFlaw};
use crate::joints::{gauss, overlaps};
use crate::shuffle::{cut_out, disguised};

/// Side of a patch, mm; finer where there are more than [`PATCHES_AT_FULL_SIZE`], so that the ribbon stays
/// the size of a car.
const PATCH_MM: f64 = 40.0;
const PATCHES_AT_FULL_SIZE: f64 = 2000.0;
/// Knot spans of a block along the ribbon: enough for its third row of control points to bear on one side
/// of the block alone.
const SPANS: usize = 4;
/// Height of the waves as a share of the length of a block.
const WAVE: f64 = 0.05;
/// How far rows are cut beside the places of their neighbours, as a share of a patch.
const STAGGER: std::ops::Range<f64> = 0.1..0.35;

/// Generates a wavy ribbon of about `patches` patches: blocks one behind the other, with straight lines
/// across the ribbon between them, and on each line one of `flaws`.
///
/// ```text
///         block 0     block 1     block 2
///       ┌──┬──┬──┬ ╷ ┬──┬──┬──┬ ╷ ┬──┬──┬──┐
///       ├──┼──┼──┼ ╎ ┼──┼──┼──┼ ╎ ┼──┼──┼──┤        ─► along (u), wavy
///       └──┴──┴──┴ ╵ ┴──┴──┴──┴ ╵ ┴──┴──┴──┘        ▲ across (v), straight
///              gap:0.005    kink:0.5
/// ```
///
/// Since a line is straight and everything behind it is moved as one rigid body, the flaw has exactly its
/// size along the whole line, and no joint elsewhere is touched. A curvature jump is planted by moving the
/// third row of control points of the block behind the line along the normal (see [`Flaw::Curvature`]),
/// which changes nothing else on the line. All faces have their normals on one side.
///
/// # Errors
/// More faces to damage than there are.
pub fn ribbon(patches: usize, seed: u64, flaws: &[Flaw]) -> Result<Sample, FlawError> {
    let on_lines: Vec<Flaw> = flaws.iter().copied().filter(|f| f.is_on_a_line()).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let ribbon = Ribbon::new(patches, &on_lines, flaws.contains(&Flaw::TJunctions), &mut rng);
    let mut sample = ribbon.shuffled(seed, &mut rng);
    if flaws.contains(&Flaw::TJunctions) {
        sample.answers.flaws.push(ribbon.t_junctions(&sample));
    }
    let on_faces: Vec<Flaw> =
        flaws.iter().copied().filter(|f| !f.is_on_a_line() && *f != Flaw::TJunctions).collect();
    sample.damaged(&on_faces, seed)
}

struct Ribbon {
    blocks: Vec<NurbsSurface>,
    width_mm: f64,
    /// What is planted on the line before each block; `None` before the first one and where all is well.
    lines: Vec<Option<Flaw>>,
    patches: Vec<Patch>,
}

#[derive(Debug, Clone, Copy)]
struct Patch {
    block: usize,
    row: usize,
    u: (f64, f64),
    v: (f64, f64),
}

/// A patch with its range of `v` on a line across the ribbon.
type Rim = (usize, (f64, f64));

/// Two patches and what they share.
struct Contact {
    patches: [usize; 2],
    length_mm: f64,
    /// The line between their blocks, by the block behind it.
    line: Option<usize>,
}

impl Ribbon {
    fn new(count: usize, flaws: &[Flaw], staggered: bool, rng: &mut ChaCha8Rng) -> Self {
        let mut lines = vec![None];
        lines.extend(flaws.iter().copied().map(Some));
        if lines.len() < 2 {
            lines.push(None);
        }
        let in_block = count as f64 / lines.len() as f64;
        let columns = (in_block.sqrt().round() as usize).max(3);
        let rows = ((in_block / columns as f64).round() as usize).max(3);
        let size_mm = PATCH_MM * (PATCHES_AT_FULL_SIZE / count as f64).sqrt().min(1.0);
        let (length_mm, width_mm) = (size_mm * columns as f64, size_mm * rows as f64);
        let master = master(lines.len(), length_mm, width_mm);

        let (mut blocks, mut patches) = (Vec::new(), Vec::new());
        let mut moved = Isometry3::identity();
        let mut stagger = |index: usize, of: usize| -> f64 {
            let side = if index.is_multiple_of(2) { 1.0 } else { -1.0 };
            if staggered { side * rng.random_range(STAGGER) / of as f64 } else { 0.0 }
        };
        for (block, flaw) in lines.iter().enumerate() {
            let start = block as f64;
            let mut surface = cut_out(&master, (start, start + 1.0), (0.0, 1.0));
            if let Some(flaw) = *flaw {
                let motion = motion(flaw, block, &master);
                surface = bent(&surface, flaw);
                moved *= motion;
            }
            blocks.push(surface.mapped(|p| moved * p));
            let v_cuts = cuts(0.0, rows, stagger(block, rows));
            for (row, v) in v_cuts.windows(2).enumerate() {
                let u_cuts = cuts(start, columns, stagger(row, columns));
                let along = u_cuts.windows(2);
                patches.extend(along.map(|u| Patch { block, row, u: (u[0], u[1]), v: (v[0], v[1]) }));
            }
        }
        Ribbon { blocks, width_mm, lines, patches }
    }

    fn contacts(&self) -> Vec<Contact> {
        let mut found = Vec::new();
        let row_of = |block: usize, row: usize| {
            let in_row = move |p: &&Patch| p.block == block && p.row == row;
            let first = self.patches.iter().position(|p| in_row(&p)).unwrap_or(self.patches.len());
            let cuts: Vec<f64> = self.patches[first..].iter().take_while(in_row).map(|p| p.u.0).collect();
            (first, cuts)
        };
        let mut rims: Vec<[Vec<Rim>; 2]> = vec![Default::default(); self.lines.len()];
        for block in 0..self.lines.len() {
            let surface = &self.blocks[block];
            let mut below: Option<(usize, Vec<f64>)> = None;
            for row in 0.. {
                let (first, mut cuts) = row_of(block, row);
                if cuts.is_empty() {
                    break;
                }
                let (count, v) = (cuts.len(), self.patches[first].v);
                cuts.push(block as f64 + 1.0);
                found.extend((1..count).map(|c| Contact {
                    patches: [first + c - 1, first + c],
                    length_mm: (v.1 - v.0) * self.width_mm,
                    line: None,
                }));
                if let Some((first_below, cuts_below)) = &below {
                    found.extend(overlaps(cuts_below, &cuts).into_iter().map(|(a, b, range)| Contact {
                        patches: [first_below + a, first + b],
                        length_mm: gauss(range, |u| surface.jet(u, v.0).su.norm()),
                        line: None,
                    }));
                }
                rims[block][0].push((first, v));
                rims[block][1].push((first + count - 1, v));
                below = Some((first, cuts));
            }
        }
        for line in 1..self.lines.len() {
            for (a, va) in &rims[line - 1][1] {
                for (b, vb) in &rims[line][0] {
                    let shared = va.1.min(vb.1) - va.0.max(vb.0);
                    // Rounding of a shared corner is no contact.
                    if shared > 1e-9 {
                        let length_mm = shared * self.width_mm;
                        found.push(Contact { patches: [*a, *b], length_mm, line: Some(line) });
                    }
                }
            }
        }
        found
    }

    fn shuffled(&self, seed: u64, rng: &mut ChaCha8Rng) -> Sample {
        let mut order: Vec<usize> = (0..self.patches.len()).collect();
        order.shuffle(rng);
        let mut face_of_patch = vec![0; order.len()];
        order.iter().enumerate().for_each(|(face, &patch)| face_of_patch[patch] = face);
        let faces = order.iter().enumerate().map(|(face, &patch)| {
            let p = self.patches[patch];
            Face {
                surface: disguised_upright(cut_out(&self.blocks[p.block], p.u, p.v), rng),
                loops: Vec::new(),
                reversed: false,
                kind: SurfaceKind::Nurbs,
                source: Source { entity: format!("patch {face}"), ..Source::default() },
            }
        });
        let model = Model { faces: faces.collect(), tolerance_mm: 1e-6, coordinate_step_mm: 0.0 };

        // A region goes on across every line that is no kink.
        let mut region_of_block = Vec::new();
        let mut names: Vec<String> = Vec::new();
        for (block, flaw) in self.lines.iter().enumerate() {
            if block == 0 || matches!(flaw, Some(Flaw::Kink(_))) {
                names.push(format!("from block {block}"));
            }
            region_of_block.push(names.len() - 1);
        }
        let region_of_face: Vec<usize> =
            order.iter().map(|&p| region_of_block[self.patches[p].block]).collect();
        let members = |id: usize| (0..order.len()).filter(|&f| region_of_face[f] == id).collect();
        let regions =
            names.into_iter().enumerate().map(|(id, name)| Region { name, faces: members(id) }).collect();

        let mut joints = Vec::new();
        let mut planted: Vec<Option<PlantedFlaw>> =
            self.lines.iter().map(|flaw| flaw.map(planted_on_line)).collect();
        for contact in self.contacts() {
            let [a, b] = contact.patches.map(|p| face_of_patch[p]);
            let faces = [a.min(b), a.max(b)];
            let mut joint =
                Joint { faces, length_mm: contact.length_mm, class: Continuity::G2, angle_deg: 0.0 };
            if let Some(flaw) = contact.line.and_then(|line| planted[line].as_mut()) {
                flaw.joints.push(faces);
                flaw.length_mm += contact.length_mm;
            }
            match contact.line.and_then(|line| self.lines[line]) {
                Some(Flaw::Kink(deg)) => (joint.class, joint.angle_deg) = (Continuity::C0, deg),
                Some(Flaw::Curvature(_)) => joint.class = Continuity::G1,
                _ => {}
            }
            joints.push(joint);
        }
        joints.sort_by(|a, b| a.faces.cmp(&b.faces).then(a.length_mm.total_cmp(&b.length_mm)));
        let mut flaws: Vec<PlantedFlaw> = planted.into_iter().flatten().collect();
        flaws.iter_mut().for_each(|f| f.joints.sort_unstable());
        let mut answers = Answers {
            generator: generator(),
            name: "ribbon".to_owned(),
            seed,
            totals: Totals::default(),
            regions,
            region_of_face,
            joints,
            flaws,
        };
        answers.total_up();
        Sample { model, answers }
    }

    /// All joints on which one side goes on beyond a corner of the other.
    fn t_junctions(&self, sample: &Sample) -> PlantedFlaw {
        let mut of_face = vec![0; sample.model.faces.len()];
        for joint in &sample.answers.joints {
            joint.faces.iter().for_each(|&f| of_face[f] += 1);
        }
        // A patch of a plain grid has four neighbours at most.
        let joints = sample.answers.joints.iter();
        let partial: Vec<_> = joints.filter(|j| j.faces.iter().any(|&f| of_face[f] > 4)).collect();
        PlantedFlaw {
            flaw: Flaw::TJunctions.to_string(),
            size: 1.0,
            faces: Vec::new(),
            joints: partial.iter().map(|j| j.faces).collect(),
            length_mm: partial.iter().map(|j| j.length_mm).sum(),
        }
    }
}

fn planted_on_line(flaw: Flaw) -> PlantedFlaw {
    let size = match flaw {
        Flaw::Gap(size) | Flaw::Shift(size) | Flaw::Kink(size) | Flaw::Curvature(size) => size,
        _ => 1.0,
    };
    PlantedFlaw { flaw: flaw.to_string(), size, faces: Vec::new(), joints: Vec::new(), length_mm: 0.0 }
}

/// Where a block or row from `start` to `start + 1` is cut.
fn cuts(start: f64, count: usize, stagger: f64) -> Vec<f64> {
    let mut cuts = vec![start];
    cuts.extend((1..count).map(|k| start + k as f64 / count as f64 + stagger));
    cuts.push(start + 1.0);
    cuts
}

/// The whole ribbon without flaws, twice continuously differentiable: block `k` over `[k, k + 1] × [0, 1]`.
fn master(blocks: usize, length_mm: f64, width_mm: f64) -> NurbsSurface {
    let spans = blocks * SPANS;
    let knots = |spans: usize, end: f64| {
        let mut knots = vec![0.0; 3];
        knots.extend((0..=spans).map(|k| end * k as f64 / spans as f64));
        knots.extend([end; 3]);
        knots
    };
    let (knots_u, knots_v) = (knots(spans, blocks as f64), knots(1, 1.0));
    let mut net = Vec::new();
    for i in 0..spans + 3 {
        let along = (knots_u[i + 1] + knots_u[i + 2] + knots_u[i + 3]) / 3.0;
        let height = WAVE * ((2.1 * along).sin() + 0.4 * (3.7 * along + 1.0).cos());
        for j in 0..4 {
            net.push(Point3::new(
                length_mm * along,
                width_mm * (f64::from(j) / 3.0 - 0.5),
                length_mm * height,
            ));
        }
    }
    crate::sheet::surface(knots_u, knots_v, net)
}

/// How everything behind the line before `block` moves.
fn motion(flaw: Flaw, block: usize, master: &NurbsSurface) -> Isometry3<f64> {
    let jet = master.jet(block as f64, 0.5);
    let normal = jet.su.cross(&jet.sv).normalize();
    let translation = |by: Vector3| Isometry3::from(Translation3::from(by));
    match flaw {
        Flaw::Gap(mm) => translation(normal * mm),
        Flaw::Shift(mm) => translation(jet.su.normalize() * mm),
        Flaw::Kink(deg) => {
            // Up and down in turn, so that many kinks do not roll the ribbon up.
            let side = if block.is_multiple_of(2) { 1.0 } else { -1.0 };
            let turn = UnitQuaternion::from_axis_angle(&Unit::new_normalize(jet.sv), side * deg.to_radians());
            let about = Translation3::from(jet.p.coords);
            about * turn * about.inverse()
        }
        _ => Isometry3::identity(),
    }
}

/// The block with a curvature jump at its start, where that is the flaw.
///
/// Moving the third row of control points by `δ` along the normal changes the second derivative at the start
/// by `p (p − 1) δ / (h₁ (h₁ + h₂))` for first knot spans `h₁`, `h₂`, hence the normal curvature across the
/// line by that over `|Su|²` (`Su` is at right angles to the line), and nothing else there.
fn bent(block: &NurbsSurface, flaw: Flaw) -> NurbsSurface {
    let Flaw::Curvature(jump_per_mm) = flaw else {
        return block.clone();
    };
    let knots = block.knots_u().as_slice();
    let (h1, h2) = (knots[4] - knots[3], knots[5] - knots[4]);
    let jet = block.jet(knots[3], 0.5);
    let normal = jet.su.cross(&jet.sv).normalize();
    let delta = jump_per_mm * jet.su.norm_squared() * h1 * (h1 + h2) / 6.0;
    let (rows, columns) = block.size();
    let net = (0..rows)
        .flat_map(|i| (0..columns).map(move |j| (i, j)))
        .map(|(i, j)| block.control_point(i, j) + normal * if i == 2 { delta } else { 0.0 })
        .collect();
    crate::sheet::surface(knots.to_vec(), block.knots_v().as_slice().to_vec(), net)
}

/// Other parameters, but the normal on the same side.
fn disguised_upright(part: NurbsSurface, rng: &mut ChaCha8Rng) -> NurbsSurface {
    let normal = |s: &NurbsSurface| {
        let ((u0, u1), (v0, v1)) = s.domain();
        let jet = s.jet(0.5 * (u0 + u1), 0.5 * (v0 + v1));
        jet.su.cross(&jet.sv)
    };
    let before = normal(&part);
    let after = disguised(part, rng);
    if normal(&after).dot(&before) < 0.0 { after.reversed_u() } else { after }
}
