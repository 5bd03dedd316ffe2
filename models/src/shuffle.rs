//! From master surfaces to a model file's disorder: cut into patches, each with its own
//! parametrisation, sense and place. The answers follow along.

use claymill_nurbs::{Face, KnotVector, Model, NurbsSurface, Point3, Source, SurfaceKind};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::Sample;
use crate::answers::{Answers, Continuity, Joint, Region, Totals, generator};
use crate::joints::{contacts, patches};
use crate::layout::lay_out;
use crate::sheet::Sheet;

/// Cuts the sheets into about `patches` faces and shuffles these as files from many hands are: each with its
/// own parametrisation, sense and place in the file. The answers follow along.
pub(crate) fn shuffled(name: &str, sheets: &[Sheet], count: usize, seed: u64) -> Sample {
    shuffled_as(name, sheets, sheets, count, seed)
}

/// The same, cut and shuffled as other sheets are, which are these before somebody changed them.
pub(crate) fn shuffled_as(name: &str, sheets: &[Sheet], before: &[Sheet], count: usize, seed: u64) -> Sample {
    let layout = lay_out(before, count, seed);
    let patches = patches(&layout);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut order: Vec<usize> = (0..patches.len()).collect();
    order.shuffle(&mut rng);
    let mut face_of_patch = vec![0; order.len()];
    for (face, &patch) in order.iter().enumerate() {
        face_of_patch[patch] = face;
    }
    let faces = order.iter().enumerate().map(|(face, &patch)| {
        let p = patches[patch];
        Face {
            surface: disguised(cut_out(&sheets[p.sheet].surface, p.u, p.v), &mut rng),
            loops: Vec::new(),
            reversed: false,
            kind: SurfaceKind::Nurbs,
            source: Source { entity: format!("patch {face}"), ..Source::default() },
        }
    });
    let model = Model { faces: faces.collect(), tolerance_mm: 1e-6, coordinate_step_mm: 0.0 };

    let region_of_face: Vec<usize> = order.iter().map(|&patch| patches[patch].sheet).collect();
    let region = |(id, sheet): (usize, &Sheet)| Region {
        name: sheet.name.clone(),
        faces: (0..order.len()).filter(|&face| region_of_face[face] == id).collect(),
    };
    let mut totals =
        Totals { faces: order.len(), regions: sheets.len(), least_crease_deg: 180.0, ..Totals::default() };
    let mut joints = Vec::new();
    for contact in contacts(sheets, &layout) {
        let [a, b] = contact.patches.map(|p| face_of_patch[p]);
        match contact.class {
            Continuity::C0 => totals.joints_c0 += 1,
            Continuity::G1 => totals.joints_g1 += 1,
            Continuity::G2 => totals.joints_g2 += 1,
        }
        totals.joint_length_mm += contact.length_mm;
        if contact.class == Continuity::C0 {
            totals.least_crease_deg = totals.least_crease_deg.min(contact.angle_deg.0);
        }
        joints.push(Joint {
            faces: [a.min(b), a.max(b)],
            length_mm: contact.length_mm,
            class: contact.class,
            angle_deg: contact.angle_deg.1,
        });
    }
    joints.sort_by(|a, b| a.faces.cmp(&b.faces).then(a.length_mm.total_cmp(&b.length_mm)));
    let answers = Answers {
        generator: generator(),
        name: name.to_owned(),
        seed,
        totals,
        regions: sheets.iter().enumerate().map(region).collect(),
        region_of_face,
        joints,
        flaws: Vec::new(),
    };
    Sample { model, answers }
}

/// The part of `surface` over a box of its domain, by knot insertion.
pub(crate) fn cut_out(surface: &NurbsSurface, u: (f64, f64), v: (f64, f64)) -> NurbsSurface {
    let mut part = surface.clone();
    if let Some((below, _)) = part.split_u(u.1) {
        part = below;
    }
    if let Some((_, above)) = part.split_u(u.0) {
        part = above;
    }
    if let Some((below, _)) = part.split_v(v.1) {
        part = below;
    }
    if let Some((_, above)) = part.split_v(v.0) {
        part = above;
    }
    part
}

/// The same surface with other parameters: a knot range of its own in each direction, run either way, `u`
/// and `v` exchanged or not.
pub(crate) fn disguised(part: NurbsSurface, rng: &mut ChaCha8Rng) -> NurbsSurface {
    let mut part = part;
    for _ in 0..2 {
        if rng.random_bool(0.5) {
            part = part.reversed_u();
        }
        part = part.transposed();
    }
    if rng.random_bool(0.5) {
        part = part.transposed();
    }
    let mut stretched = |knots: &KnotVector| {
        let (a, b) = knots.domain();
        let (start, length) = match rng.random_range(0..3) {
            0 => (0.0, 1.0),
            1 => (0.0, f64::from(rng.random_range(1..2000))),
            _ => (rng.random_range(-50.0..50.0), rng.random_range(0.1..30.0)),
        };
        let knots = knots.as_slice().iter().map(|k| start + (k - a) / (b - a) * length).collect();
        KnotVector::new(3, knots).expect("an affine map keeps knots in order")
    };
    let (knots_u, knots_v) = (stretched(part.knots_u()), stretched(part.knots_v()));
    let points: Vec<Point3> = part.net().iter().map(|h| Point3::from(h.xyz())).collect();
    NurbsSurface::new(knots_u, knots_v, points, None).expect("the net is unchanged")
}
