//! Decides the material side of a sheet from its volume, from what each side sees, from how level
//! it lies, and from the file; names the evidence.

use claymill_nurbs::{FaceMesh, Model, Point3, Vector3};

use super::hanging::Group;
use super::sight::Sight;
use super::{Evidence, Sheet, SheetOptions};
use crate::{EdgeStretch, Merge};

/// A border shorter than this share of the root of the area is a slit, not an opening.
const SLIT: f64 = 1e-4;
/// A volume means something when it is larger than the area times the deviation of the triangles, times this.
const TRIANGLES_TELL: f64 = 4.0;
/// One side encloses something when it sees less than the other by this share of both, and all but wholly when by the first
/// share; by less than the last it does not bulge at all.
const ENCLOSES_MOST: f64 = 0.5;
const ENCLOSES: f64 = 0.1;
const BULGES: f64 = 0.01;
/// A level sheet, or one with a level brim, may be hollow from above by this much and be clear: it has pockets.
const POCKETS: f64 = 0.25;
/// From less than this share of all directions neither side is seen.
const UNSEEN: f64 = 0.01;
/// A sheet is level where the mean of its normals points up by this much, or of those along its open border: that of a plate
/// with pockets is a level brim, that of a hull an upright one. Rather up than down it points from the last on.
const LEVEL: f64 = 0.8;
const LEVEL_BRIM: f64 = 0.6;
const RATHER_UP: f64 = 0.3;
/// Normals along a stretch of border are taken in so many places.
const PLACES: usize = 3;
/// The file is consistent where so much of the area has the same outside.
const CONSISTENT: f64 = 0.98;
/// Joints that turn over count where they are longer than this share of the root of the area.
const TURNS_OVER: f64 = 1e-2;

/// What all decisions are made from.
pub(super) struct Known<'a> {
    pub(super) model: &'a Model,
    pub(super) merged: &'a Merge,
    pub(super) meshes: &'a [FaceMesh],
    pub(super) sight: &'a Sight,
    pub(super) open_of_face_mm: Vec<f64>,
    /// Normals along the free border of each face, each as long as the stretch that it stands for, mm.
    brim_of_face_mm: Vec<Vector3>,
    free_of_face_mm: Vec<f64>,
}

impl<'a> Known<'a> {
    pub(super) fn new(model: &'a Model, merged: &'a Merge, meshes: &'a [FaceMesh], sight: &'a Sight) -> Self {
        let mut open_of_face_mm = vec![0.0; model.faces.len()];
        let naked = merged.naked.iter().map(|n| (n.stretch.face, n.length_mm));
        let laps = merged.laps.iter().map(|l| (l.stretch.face, l.length_mm));
        // Where more than two faces meet, none goes on in one other.
        let many = merged.joints.iter().filter(|j| j.non_manifold || j.outdone);
        let many = many.flat_map(|j| j.sides.map(|side| (side.face, j.length_mm)));
        naked.chain(laps).chain(many).for_each(|(face, length_mm)| open_of_face_mm[face] += length_mm);
        let (mut brim_of_face_mm, mut free_of_face_mm) =
            (vec![Vector3::zeros(); model.faces.len()], vec![0.0; model.faces.len()]);
        for of_face in merged.naked.chunk_by(|a, b| a.stretch.face == b.stretch.face) {
            let face = of_face[0].stretch.face;
            let (boundary, surface) = (model.faces[face].boundary(), &model.faces[face].surface);
            for naked in of_face {
                let EdgeStretch { loop_index, edge_index, from, to, .. } = naked.stretch;
                let edge = boundary.get(loop_index).and_then(|l| l.edges.get(edge_index));
                for normal in edge.into_iter().flat_map(|edge| {
                    (0..PLACES).filter_map(move |k| {
                        let at = edge.pcurve.point(from + (to - from) * (k as f64 + 0.5) / PLACES as f64);
                        surface.normal(at.x, at.y)
                    })
                }) {
                    brim_of_face_mm[face] += normal.0 * (naked.length_mm / PLACES as f64);
                }
                free_of_face_mm[face] += naked.length_mm;
            }
        }
        Known { model, merged, meshes, sight, open_of_face_mm, brim_of_face_mm, free_of_face_mm }
    }

    /// The mean of the normals along the free border of a group, on the side of the first face's.
    fn brim(&self, group: &Group) -> Vector3 {
        let faces = || group.faces.iter().zip(&group.turned);
        let turned = |(&face, &turned): (&usize, &bool)| {
            let sum = self.brim_of_face_mm[face];
            if turned { -sum } else { sum }
        };
        let length_mm: f64 = group.faces.iter().map(|&face| self.free_of_face_mm[face]).sum();
        faces().map(turned).sum::<Vector3>() / length_mm.max(f64::MIN_POSITIVE)
    }
}

/// Finds the side of a group of faces on which the material is.
pub(super) fn decide(known: &Known<'_>, group: &Group, options: &SheetOptions) -> Sheet {
    let Known { model, merged, meshes, sight, open_of_face_mm, .. } = known;
    let Group { faces, turned, contrary_mm } = group;
    let areas: Vec<f64> = faces
        .iter()
        .map(|&face| meshes[face].triangles.iter().map(|t| area(&meshes[face], t)).sum())
        .collect();
    let mesh_mm2: f64 = areas.iter().sum();
    let size_mm = mesh_mm2.sqrt();
    let open_mm: f64 = faces.iter().map(|&face| open_of_face_mm[face]).sum();
    // Measured on the side of the first face's `Su × Sv`.
    let turned_mm = if *contrary_mm > TURNS_OVER * size_mm { *contrary_mm } else { 0.0 };
    let agrees = |k: usize| turned[k] == model.faces[faces[k]].reversed;
    let in_file = if mesh_mm2 > 0.0 {
        (0..faces.len()).filter(|&k| agrees(k)).map(|k| areas[k]).sum::<f64>() / mesh_mm2
    } else {
        0.5
    };
    let sees_out = sight.sees_out(group);
    let mean_normal = mean_normal(meshes, group) / mesh_mm2.max(f64::MIN_POSITIVE);
    let measured = Measured {
        volume: volume(meshes, group).filter(|_| open_mm <= SLIT * size_mm && turned_mm == 0.0),
        sees_out,
        in_file,
        up: options.up.map_or(0.0, |up| mean_normal.dot(&up)),
        brim_up: options.up.map_or(0.0, |up| known.brim(group).dot(&up)),
    };
    let mut sheet = Sheet {
        faces: faces.clone(),
        free_along: Vec::new(),
        area_mm2: faces.iter().map(|&face| merged.area_of_face_mm2[face]).sum(),
        open_mm,
        turned_mm,
        sees_out,
        mean_free_normal: mean_normal,
        file_agrees: in_file,
        evidence: Evidence::FaceByFace,
        clear: false,
    };
    if turned_mm > 0.0 && faces.len() > 1 {
        // Every face by itself; what was said of the whole means nothing.
        let alone = |&face: &usize| {
            let group = Group { faces: vec![face], turned: vec![false], contrary_mm: 0.0 };
            decide(known, &group, options).free_along[0]
        };
        sheet.free_along = faces.iter().map(alone).collect();
        return sheet;
    }
    let (first_is_free, evidence, clear) = measured.decide(options);
    (sheet.evidence, sheet.clear) = (evidence, clear && turned_mm == 0.0);
    if turned_mm > 0.0 {
        sheet.evidence = Evidence::FaceByFace;
    }
    sheet.free_along = turned.iter().map(|turned| *turned != first_is_free).collect();
    if !first_is_free {
        sheet.sees_out.reverse();
        sheet.mean_free_normal = -mean_normal;
        sheet.file_agrees = 1.0 - in_file;
    }
    sheet
}

/// What is known of a group, as if the side of the first face's `Su × Sv` were free.
struct Measured {
    /// Of a closed one, mm³.
    volume: Option<f64>,
    sees_out: [f64; 2],
    in_file: f64,
    /// Mean of the normals' share upwards, of all and of those along the border.
    up: f64,
    brim_up: f64,
}

impl Measured {
    /// Whether that side is free, by what, and whether that is clear.
    fn decide(&self, options: &SheetOptions) -> (bool, Evidence, bool) {
        if let Some(volume) = self.volume {
            return (volume > 0.0, Evidence::Closed, true);
        }
        let [a, b] = self.sees_out;
        let bulge = if a + b > UNSEEN { (a - b) / (a + b) } else { 0.0 };
        let file_says = options.file_states_sides && !(1.0 - CONSISTENT..=CONSISTENT).contains(&self.in_file);
        let contradicted = |free: bool| file_says && (self.in_file > 0.5) != free;
        if bulge.abs() >= ENCLOSES_MOST {
            return (bulge > 0.0, Evidence::Encloses, true);
        }
        let is_level = self.up.abs() >= LEVEL || self.brim_up.abs() >= LEVEL_BRIM;
        if is_level && self.up * self.brim_up > 0.0 {
            let free = self.up > 0.0;
            let is_hollow = bulge.abs() >= POCKETS && (bulge > 0.0) != free;
            return (free, Evidence::Level, !is_hollow);
        }
        if bulge.abs() >= ENCLOSES {
            // A bowl may be meant where a hull lies on its back.
            let is_bowl = self.up.abs() >= RATHER_UP && (self.up > 0.0) != (bulge > 0.0);
            return (bulge > 0.0, Evidence::Encloses, !contradicted(bulge > 0.0) && !is_bowl);
        }
        if file_says {
            return (self.in_file > 0.5, Evidence::File, true);
        }
        let first_is_free = if bulge.abs() >= BULGES {
            bulge > 0.0
        } else if self.up.abs() >= RATHER_UP {
            self.up > 0.0
        } else {
            self.in_file >= 0.5
        };
        // What nobody sees nobody cuts.
        (first_is_free, Evidence::Assumed, a + b <= UNSEEN)
    }
}

fn area(mesh: &FaceMesh, t: &[u32; 3]) -> f64 {
    0.5 * double_area(mesh, t).norm()
}

fn double_area(mesh: &FaceMesh, t: &[u32; 3]) -> Vector3 {
    let [a, b, c] = t.map(|i| mesh.points[i as usize]);
    (b - a).cross(&(c - a))
}

/// Sum of all triangles' normals, each as long as its area.
fn mean_normal(meshes: &[FaceMesh], group: &Group) -> Vector3 {
    let of_face = |(&face, &turned): (&usize, &bool)| {
        let sum: Vector3 = meshes[face].triangles.iter().map(|t| 0.5 * double_area(&meshes[face], t)).sum();
        if turned { -sum } else { sum }
    };
    group.faces.iter().zip(&group.turned).map(of_face).sum()
}

/// Volume enclosed by a closed group, mm³ (divergence theorem); nothing where the triangles are too rough to tell it from 0.
fn volume(meshes: &[FaceMesh], group: &Group) -> Option<f64> {
    let points = group.faces.iter().flat_map(|&face| &meshes[face].points);
    let centre: Point3 = claymill_nurbs::Aabb::of(points).centre();
    let (mut volume, mut doubt) = (0.0, 0.0);
    for (&face, &turned) in group.faces.iter().zip(&group.turned) {
        let mesh = &meshes[face];
        for (t, deviation_mm) in mesh.triangles.iter().zip(&mesh.deviation_mm) {
            let double = double_area(mesh, t);
            let cone = (mesh.points[t[0] as usize] - centre).dot(&double) / 6.0;
            volume += if turned { -cone } else { cone };
            doubt += 0.5 * double.norm() * f64::from(*deviation_mm);
        }
    }
    (volume.abs() > TRIANGLES_TELL * doubt && volume != 0.0).then_some(volume)
}
