//! What the parts of a plan follow from, as keys under which they are kept.
//!
//! ```text
//!      axis ↑      ┌╌╌╌╌╌╌╌╌┐         A part follows from the faces whose boxes meet the columns over the faces that it cuts: the
//!           │      ╎ ╭────╮ ╎         tool goes no farther aside than its margin, and up along the axis it may meet anything.
//!           │   ───╎─┴────┴─╎───      A face is its geometry and what is asked of it, never its number, so that parts of a
//!                  ╎ column ╎         model are those of its variants where nothing differs. Rapids between the columns
//!                  └╌╌╌╌╌╌╌╌┘         follow from the map of heights.
//! ```

use std::collections::BTreeSet;
use std::convert::Infallible;

use claymill_contact::{BallDrop, Covering, Frame};
use claymill_nurbs::{Aabb, BoxSet, FaceId, Model};
use claymill_surface_merge::{EdgeStretch, Joint};
use claymill_toolpath::{Bounds, Kept, KeyMaker, MachineLimits, PartKey};
use rayon::prelude::*;

use crate::plan::kept_plan::KeptPlan;
use crate::plan::options::PlanOptions;
use crate::plan::planned::Plan;
use crate::plan::regions::Regions;
use crate::program::kept_part::KeptPart;
use crate::program::part::Part;
use crate::setup::assignment::{Assignment, Assignments, Packed};
use crate::setup::context::SetupContext;

/// The tool goes no farther beside what a part cuts than this and three times its own width: leads go aside by millimetres, and
/// rows run over gaps of 30 mm.
const MARGIN_MM: f64 = 50.0;
const MARGIN_WIDTHS: f64 = 3.0;
/// Nor farther down below all that a part cuts, where rows run over gaps.
const BELOW_MM: f64 = 500.0;

/// What all parts of a plan follow from, and where they are kept.
pub(crate) struct PlanKeys<'a> {
    kept: &'a Kept,
    options: &'a PlanOptions,
    /// Of what is asked for, and of what of the whole model all parts follow from.
    asked: PartKey,
    faces: Vec<PartKey>,
    /// Which faces are one region, by the first of them.
    first_of_region: Vec<FaceId>,
}

/// Faces that are not just to be cut.
#[derive(Clone, Copy)]
pub(crate) struct Aside<'a> {
    /// They could not be covered.
    pub(crate) bare: &'a [FaceId],
    /// They only stand in the way.
    pub(crate) obstacles: &'a [FaceId],
}

impl<'a> PlanKeys<'a> {
    /// `None` where nothing is kept.
    pub(crate) fn new(
        model: &Model,
        regions: &Regions,
        options: &'a PlanOptions,
        aside: &Aside,
        fineness_mm: f64,
    ) -> Option<Self> {
        if !options.kept.is_somewhere() {
            return None;
        }
        let area_mm2: f64 = regions.face_area_mm2.iter().sum();
        let asked = PlanOptions {
            kept: Kept::nowhere(),
            in_process: None,
            // Faces know what is asked of them, and times are added up when parts are joined.
            free_sides: Vec::new(),
            bounds: Bounds { avoid: Vec::new(), ..options.bounds.clone() },
            machine: MachineLimits::default(),
            setups: Vec::new(),
            ..options.clone()
        };
        let asked = KeyMaker::new("asked").debug(&asked).numbers([
            fineness_mm,
            Covering::longest_edge_mm(area_mm2, fineness_mm),
            model.tolerance_mm,
            model.coordinate_step_mm,
        ]);
        let copies: BTreeSet<FaceId> = regions.merged.duplicates.iter().map(|d| d.copy).collect();
        let avoided: BTreeSet<FaceId> = options.bounds.avoid.iter().copied().collect();
        let mut open: Vec<Vec<f64>> = vec![Vec::new(); model.faces.len()];
        for naked in &regions.merged.naked {
            open[naked.stretch.face].extend(stretch(&naked.stretch).into_iter().chain([naked.length_mm]));
        }
        let mut joints: Vec<Vec<&Joint>> = vec![Vec::new(); model.faces.len()];
        for joint in &regions.merged.joints {
            let [a, b] = joint.sides.each_ref().map(|side| side.face);
            joints[a].push(joint);
            if b != a {
                joints[b].push(joint);
            }
        }
        let mut firsts = vec![usize::MAX; regions.of_face.iter().max().map_or(0, |m| m + 1)];
        for (face, &region) in regions.of_face.iter().enumerate() {
            firsts[region] = firsts[region].min(face);
        }
        let face = |face: FaceId| {
            let flags = [
                regions.excluded[face],
                avoided.contains(&face),
                aside.bare.contains(&face),
                aside.obstacles.binary_search(&face).is_ok(),
                copies.contains(&face),
            ];
            let free = options.free_sides.get(face).copied().unwrap_or_default();
            let key = KeyMaker::new("face").face(&model.faces[face]).bytes(&flags.map(u8::from));
            let key =
                key.debug(&free).numbers([regions.face_area_mm2[face]]).numbers(open[face].iter().copied());
            joints[face].iter().fold(key, |key, joint| of_joint(key, joint, face)).finish()
        };
        Some(PlanKeys {
            kept: &options.kept,
            options,
            asked: asked.finish(),
            faces: (0..model.faces.len()).into_par_iter().map(face).collect(),
            first_of_region: regions.of_face.iter().map(|&region| firsts[region]).collect(),
        })
    }

    /// The whole plan, if it is known.
    pub(crate) fn known_plan(&self, model: &Model, regions: &Regions) -> Option<Plan> {
        Some(self.kept.known::<KeptPlan>(&self.of_plan(model, regions))?.plan())
    }

    /// Keeps the whole plan.
    pub(crate) fn keep_plan(&self, model: &Model, regions: &Regions, plan: &Plan) {
        if let Some(plan) = KeptPlan::of(plan) {
            self.kept.keep(&self.of_plan(model, regions), &plan);
        }
    }

    /// A whole plan has numbers of faces and regions, names, and times.
    fn of_plan(&self, model: &Model, regions: &Regions) -> PartKey {
        let PlanOptions { setups, machine, orientation, in_process, .. } = self.options;
        let key = KeyMaker::new("plan").key(&self.asked).debug(setups).debug(machine).debug(orientation);
        // Stock is named by what is in it: its numbers as text would be hundreds of megabytes.
        let key = match in_process {
            Some(of) => key.bytes(&of.stock.digest()).debug(&of.tool).numbers([of.allowance_mm]),
            None => key,
        };
        let key = key.debug(&regions.of_face);
        let entities = model.faces.iter().map(|face| &face.source.entity);
        self.faces.iter().zip(entities).fold(key, |key, (face, entity)| key.key(face).text(entity)).finish()
    }

    /// Where parts are kept.
    pub(crate) fn kept(&self) -> &Kept {
        self.kept
    }

    /// The key of each face: its geometry and what is asked of it.
    pub(crate) fn faces(&self) -> &[PartKey] {
        &self.faces
    }

    /// Begins the key of something that setups decide.
    pub(crate) fn asked_of_setups(&self, what: &str, frames: &[Frame]) -> KeyMaker {
        let key = KeyMaker::new(what).key(&self.asked).debug(&frames);
        // The stock is asked where there is something left.
        match self.options.rest() {
            Ok(Some(rest)) => key.bytes(&rest.stock.digest()).numbers([rest.above_mm]),
            _ => key,
        }
    }

    /// What each setup cuts: of the whole model at once, for setups take the lead in whole regions.
    pub(crate) fn assignments(&self, frames: &[Frame], make: impl FnOnce() -> Assignments) -> Assignments {
        let key = || {
            let mut key = self.asked_of_setups("assignments", frames);
            for (face, first) in self.faces.iter().zip(&self.first_of_region) {
                key = key.key(face).count(*first);
            }
            key.finish()
        };
        let made = self.kept.part(key, || Ok::<_, Infallible>(make()));
        made.unwrap_or_else(|never| match never {})
    }

    /// Keys of passes, where it is known who cuts what.
    pub(crate) fn of_passes(&'a self, assignments: &'a Assignments, boxes: &'a [Vec<Aabb>]) -> PassKeys<'a> {
        let assigned = |face: FaceId| {
            let mut key = KeyMaker::new("assigned");
            for &assignment in &assignments.of[face] {
                let (bits, cut, walls_cut, not_cut) = Packed::from(assignment);
                let shares = cut.into_iter().chain(walls_cut).chain(not_cut).map(f64::from);
                key = key.bytes(&bits).numbers(shares);
            }
            for border in &assignments.borders[face] {
                let inside_mm = border.inside_mm.map(f64::from);
                key = key.count(border.triangle as usize).bytes(&[border.setup]).numbers(inside_mm);
            }
            let missed = assignments.missed[face].iter().flatten();
            key.numbers(missed.flat_map(|uv| [uv.x, uv.y])).finish()
        };
        PassKeys {
            plan: self,
            assignments,
            assigned: (0..assignments.of.len()).into_par_iter().map(assigned).collect(),
            boxes,
        }
    }
}

/// Keys of the passes of a plan.
pub(crate) struct PassKeys<'a> {
    plan: &'a PlanKeys<'a>,
    assignments: &'a Assignments,
    assigned: Vec<PartKey>,
    /// By setup, around each face, in its coordinates.
    boxes: &'a [Vec<Aabb>],
}

impl PassKeys<'_> {
    /// The key of the passes over what a setup cuts of a region with these faces.
    pub(crate) fn of(&self, context: &SetupContext, faces: &[FaceId], area_mm2: f64) -> PartKey {
        let boxes = &self.boxes[context.index];
        let is_cut = |a: &Assignment| a.is_cut_by(context.index) || a.is_a_wall_of(context.index);
        let cut = faces.iter().filter(|&&face| self.assignments.of[face].iter().any(is_cut));
        let margin_mm = self.margin_mm(context);
        let cut: Vec<Aabb> = cut.map(|&face| boxes[face].inflated(margin_mm)).collect();
        let lowest = cut.iter().map(|b| b.min.z).fold(f64::INFINITY, f64::min);
        let columns = BoxSet::of(cut.iter().map(|b| b.upwards_from(lowest - BELOW_MM)));
        let sides = [0, 1].map(|k| [columns.around().min[k], columns.around().max[k]]);
        let in_region = |face: FaceId| faces.binary_search(&face).is_ok();
        let mut key = KeyMaker::new("passes")
            .key(&self.plan.asked)
            .debug(&context.frame)
            .debug(&(self.assignments.slants, context.ball.has_rims(), context.ball.has_material()))
            .numbers([area_mm2])
            .numbers(context.heights.within(sides));
        for (face, own) in self.plan.faces.iter().enumerate() {
            if in_region(face) || columns.meets(&boxes[face]) {
                key = key.key(own).key(&self.assigned[face]).count(usize::from(in_region(face)));
            }
        }
        key.finish()
    }

    fn margin_mm(&self, context: &SetupContext) -> f64 {
        let options = self.plan.options;
        MARGIN_MM
            + MARGIN_WIDTHS * context.ball.widest_mm()
            + context.earlier.map_or(0.0, BallDrop::widest_mm)
            + options.stock_above_mm
            + options.bounds.avoid_mm
            + options.bounds.extend_mm
            + context.obstacle_mm
            + context.clearance_mm
    }

    /// Passes that are known; the second `None` where nothing is cut.
    pub(crate) fn known(&self, key: &PartKey) -> Option<Option<Part>> {
        self.plan.kept.known::<KeptPart>(key)?.part().ok()
    }

    /// Keeps passes that were not known.
    pub(crate) fn keep(&self, key: &PartKey, part: &Option<Part>) {
        self.plan.kept.keep(key, &KeptPart::from(part));
    }
}

/// A joint as one of its faces sees it.
fn of_joint(key: KeyMaker, joint: &Joint, face: FaceId) -> KeyMaker {
    let [a, b] = &joint.sides;
    let gaps = [&joint.gap_normal_mm, &joint.gap_lateral_mm].map(|gap| gap.max);
    key.count(usize::from(a.face == face))
        .numbers(stretch(a).into_iter().chain(stretch(b)))
        .numbers([joint.length_mm].into_iter().chain(gaps))
        .debug(&(joint.continuity, joint.verdict, joint.normals_agree, joint.non_manifold, joint.outdone))
}

fn stretch(stretch: &EdgeStretch) -> [f64; 4] {
    [stretch.loop_index as f64, stretch.edge_index as f64, stretch.from, stretch.to]
}
