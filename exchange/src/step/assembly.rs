//! Which faces the file holds, and where each of them stands.
//!
//! Representations form a graph: identity relationships tie representations of one part together, relationships
//! with a transformation and mapped items place one inside another. The walk starts at those that nothing
//! holds, shapes of products first, once it is known how many faces it will come by: what else names their faces names
//! them again.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use claymill_nurbs::analytic::Frame;
use memchr::memmem;
use nalgebra::{Matrix3, Rotation3, Similarity3, Translation3, UnitQuaternion};

use super::contents::{Contents, Lost, OwnFace};
use super::part21::Part21;
use super::placement::{frame, point};
use super::products::Products;
use super::unfolding::Unfolding;
use super::{Context, StepError, units};
use crate::unfolding::{Allowance, PLACEMENT, Tally, tallies};

/// Assemblies may be nested this deep.
const DEEPEST_ASSEMBLY: usize = 32;

/// One use of a face.
#[derive(Debug, Clone)]
pub(super) struct PlacedFace {
    pub(super) id: u64,
    /// From the face's representation, in millimetres, to the model.
    pub(super) placement: Similarity3<f64>,
    /// The representation's context: index into [`Faces::contexts`].
    pub(super) context: usize,
    /// Counts placements of representations: faces of one instance share edges.
    pub(super) instance: u64,
    /// The containers of the face, outermost first, and the face itself.
    pub(super) owners: Vec<u64>,
    /// Turned over by ORIENTED_FACE.
    pub(super) reversed: bool,
    /// Not a face of the file but a surface of a geometric set.
    pub(super) bare: bool,
}

/// All faces of a file.
#[derive(Debug, Default)]
pub(super) struct Faces {
    pub(super) placed: Vec<PlacedFace>,
    pub(super) contexts: Vec<Context>,
    pub(super) warnings: Vec<String>,
    /// What shells refer to that is no face.
    pub(super) lost: Vec<Lost>,
    /// Faces that alone unfold to more than a face may, and to how many bytes.
    pub(super) oversized: BTreeMap<u64, u64>,
}

/// The file unfolds to more than a file of its size may.
#[derive(Debug)]
pub(super) struct TooMuch {
    /// The representation that holds most.
    pub(super) id: u64,
    pub(super) what: String,
}

/// A representation: items and context.
struct Representation {
    items: Vec<u64>,
    /// The same in order of id.
    sorted: Vec<u64>,
    context: usize,
}

impl Representation {
    fn holds(&self, item: u64) -> bool {
        self.sorted.binary_search(&item).is_ok()
    }
}

/// `child` stands inside `parent`.
struct Placing {
    parent: u64,
    child: u64,
    placement: Similarity3<f64>,
}

/// Representations tied to each other as one.
#[derive(Default)]
struct Part {
    contents: Contents,
    /// First members of the parts that stand inside, and where.
    inside: Vec<(u64, Similarity3<f64>)>,
    /// What its own faces unfold to, bytes of text.
    size: u64,
}

pub(super) fn faces(file: &Part21) -> Result<Faces, TooMuch> {
    let mut faces = Faces::default();
    let representations = representations(file, &mut faces);
    let mut walk = Walk {
        file,
        faces,
        representations,
        placings: Vec::new(),
        same_part: BTreeMap::new(),
        parts: BTreeMap::new(),
        stands: HashSet::new(),
        twice: BTreeMap::new(),
        visited: BTreeMap::new(),
        root: 0,
        standing: BTreeSet::new(),
        places: BTreeMap::new(),
        repeated: 0,
        instance: 0,
    };
    walk.relationships();
    walk.run()?;
    Ok(walk.faces)
}

fn representations(file: &Part21, faces: &mut Faces) -> BTreeMap<u64, Representation> {
    let mut contexts = BTreeMap::new();
    let mut found = BTreeMap::new();
    let simple = |name: &[u8]| {
        name.ends_with(b"SHAPE_REPRESENTATION") && name != b"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION"
    };
    for (id, name) in file.type_names() {
        let complex = name.is_empty() && memmem::find(file.text(id), b"SHAPE_REPRESENTATION").is_some();
        if !simple(name) && !complex {
            continue;
        }
        let Ok(entity) = file.get(id) else { continue };
        let record = if complex { entity.part("REPRESENTATION") } else { entity.only() };
        let Ok(record) = record else { continue };
        let (Ok(items), Some(context)) = (record.references(1), record.optional_reference(2)) else {
            continue;
        };
        let context = *contexts.entry(context).or_insert_with(|| {
            let read = units::read(file, context).unwrap_or_else(|| {
                faces.warnings.push(format!(
                    "Representation #{id} declares no unit of length that can be read: millimetres are assumed."
                ));
                units::millimetres()
            });
            faces.contexts.push(read);
            faces.contexts.len() - 1
        });
        let mut sorted = items.clone();
        sorted.sort_unstable();
        found.insert(id, Representation { items, sorted, context });
    }
    found
}

struct Walk<'a> {
    file: &'a Part21<'a>,
    faces: Faces,
    representations: BTreeMap<u64, Representation>,
    placings: Vec<Placing>,
    /// Representations tied to each other as one part.
    same_part: BTreeMap<u64, Vec<u64>>,
    /// By their first representation.
    parts: BTreeMap<u64, Part>,
    /// What was placed, and where.
    stands: HashSet<(u64, [u64; 8])>,
    /// Parts that were to be placed where they stand already, and how often.
    twice: BTreeMap<u64, usize>,
    /// The faces that were placed, with the root from which first.
    visited: BTreeMap<u64, usize>,
    /// The shapes of products are one root, the first; what other roots name again stands already.
    root: usize,
    /// Each face with each of its places.
    standing: BTreeSet<(u64, usize)>,
    /// Every placement, told apart by its bits.
    places: BTreeMap<[u64; 8], usize>,
    /// How often a face was named again.
    repeated: usize,
    instance: u64,
}

impl Walk<'_> {
    fn relationships(&mut self) {
        let file = self.file;
        let mut mapped = Vec::new();
        for (id, name) in file.type_names() {
            let complex =
                name.is_empty() && memmem::find(file.text(id), b"REPRESENTATION_RELATIONSHIP").is_some();
            if !complex
                && !matches!(name, b"SHAPE_REPRESENTATION_RELATIONSHIP" | b"REPRESENTATION_RELATIONSHIP")
            {
                continue;
            }
            if let Err(error) = self.relationship(id) {
                self.faces.warnings.push(format!("A placement of an assembly is ignored: {error}."));
            }
        }
        for (id, representation) in &self.representations {
            for item in &representation.items {
                if file.text(*item).starts_with(b"MAPPED_ITEM") {
                    mapped.push((*id, *item));
                }
            }
        }
        for (parent, item) in mapped {
            if let Err(error) = self.mapped_item(parent, item) {
                self.faces.warnings.push(format!("A placement of an assembly is ignored: {error}."));
            }
        }
    }

    fn relationship(&mut self, id: u64) -> Result<(), StepError> {
        let entity = self.file.get(id)?;
        let record = match entity.only() {
            Ok(record) => record,
            Err(_) => entity.part("REPRESENTATION_RELATIONSHIP")?,
        };
        let (first, second) = (record.reference(2)?, record.reference(3)?);
        if !self.representations.contains_key(&first) || !self.representations.contains_key(&second) {
            return Ok(());
        }
        let Ok(with) = entity.part("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION") else {
            self.same_part.entry(first).or_default().push(second);
            self.same_part.entry(second).or_default().push(first);
            return Ok(());
        };
        let transformation = self.file.get(with.reference(0)?)?;
        let items = transformation.part("ITEM_DEFINED_TRANSFORMATION")?;
        let (mut from, mut to) = (items.reference(2)?, items.reference(3)?);
        // Some writers exchange the two items; only the right order has each in its representation.
        let holds = |representation: u64, item: u64| self.representations[&representation].holds(item);
        if !holds(first, from) && holds(first, to) && holds(second, from) {
            (from, to) = (to, from);
        }
        let placement = self.pose(second, to)? * self.pose(first, from)?.inverse();
        self.placings.push(Placing { parent: second, child: first, placement });
        Ok(())
    }

    /// MAPPED_ITEM(name, REPRESENTATION_MAP(origin, representation), target).
    fn mapped_item(&mut self, parent: u64, id: u64) -> Result<(), StepError> {
        let item = self.file.get(id)?;
        let record = item.part("MAPPED_ITEM")?;
        let map = self.file.get(record.reference(1)?)?;
        let source = map.part("REPRESENTATION_MAP")?;
        let child = source.reference(1)?;
        if !self.representations.contains_key(&child) {
            return Ok(());
        }
        let target = self.pose(parent, record.reference(2)?)?;
        let placement = target * self.pose(child, source.reference(0)?)?.inverse();
        self.placings.push(Placing { parent, child, placement });
        Ok(())
    }

    /// An axis placement or transformation operator of a representation, in millimetres.
    fn pose(&self, representation: u64, id: u64) -> Result<Similarity3<f64>, StepError> {
        let mm = self.faces.contexts[self.representations[&representation].context].mm_per_unit;
        let entity = self.file.get(id)?;
        if let Ok(operator) = entity.part("CARTESIAN_TRANSFORMATION_OPERATOR_3D") {
            // CARTESIAN_TRANSFORMATION_OPERATOR_3D(name, description, …, axis1, axis2, origin, scale, axis3)
            let at = |k| operator.optional_reference(k).map(|d| super::placement::direction(self.file, d));
            let (x, z) = (at(2).transpose()?, at(6).transpose()?);
            let origin = point(self.file, operator.reference(4)?)?;
            let turned = Frame::new(
                origin,
                z.unwrap_or_else(nalgebra::Vector3::z),
                x.unwrap_or_else(nalgebra::Vector3::x),
            );
            let turned =
                turned.ok_or(StepError::Geometry { id, what: "its direction has no length".into() })?;
            let scale = operator.number(5).ok().filter(|s| *s > 0.0).unwrap_or(1.0);
            return Ok(similarity(&turned, mm, scale));
        }
        Ok(similarity(&frame(self.file, id)?, mm, 1.0))
    }

    fn run(&mut self) -> Result<(), TooMuch> {
        let leaders = self.gather_parts();
        let products = Products::read(self.file);
        // What describes a property of a part does not hold the part.
        let holding = self.parts.iter().filter(|(leader, _)| !products.is_property(&self.part(**leader)));
        let held: BTreeSet<u64> = holding.flat_map(|(_, p)| p.inside.iter().map(|i| i.0)).collect();
        let (shapes, others): (Vec<u64>, Vec<u64>) = (leaders.into_iter().filter(|l| !held.contains(l)))
            .partition(|leader| products.is_shape(&self.part(*leader)));
        let roots = [shapes.as_slice(), &others].concat();
        // Parts that stand in nothing but themselves show nothing: their faces are read where they stand.
        let reached = self.reached(&roots);
        let own = |leader: &u64| self.parts[leader].contents.faces.iter().map(|f| f.id);
        let visited: BTreeSet<u64> = reached.iter().flat_map(own).collect();
        let face = |name: &[u8]| matches!(name, b"ADVANCED_FACE" | b"FACE_SURFACE");
        let loose: Vec<u64> = self.file.of_type(face).filter(|id| !visited.contains(id)).collect();

        let mut unfolding = Unfolding::new(self.file);
        for part in self.parts.values_mut() {
            let ids = part.contents.faces.iter().map(|f| f.id);
            part.size = measured(&mut unfolding, ids, &mut self.faces.oversized);
        }
        let size = measured(&mut unfolding, loose.iter().copied(), &mut self.faces.oversized);
        self.check(&roots, Tally { size, parts: 0, faces: loose.len() as u64 })?;
        for root in shapes {
            self.place(root, Similarity3::identity(), &mut Vec::new());
        }
        for root in others {
            self.root += 1;
            self.place(root, Similarity3::identity(), &mut Vec::new());
        }
        if self.repeated > 0 {
            self.faces.warnings.push(format!(
                "The file names {} faces again that it has already, as properties of a part or in the same place: they are \
                 read once.",
                self.repeated
            ));
        }
        for leader in reached {
            let contents = std::mem::take(&mut self.parts.entry(leader).or_default().contents);
            if contents.repeated.0 > 0 {
                let (count, first) = contents.repeated;
                self.faces.warnings.push(format!(
                    "Faces or shells are listed again {count} times in one part, the first is #{first}: each is read once."
                ));
            }
            self.faces.lost.extend(contents.lost);
        }
        for (leader, count) in &self.twice {
            self.faces.warnings.push(format!(
                "Representation #{leader} is to stand {count} more times where it stands already: it is read once there."
            ));
        }
        if !loose.is_empty() {
            self.add_loose(&loose);
        }
        Ok(())
    }

    /// Gathers the parts with their faces; gives the first representations of all, in order.
    fn gather_parts(&mut self) -> Vec<u64> {
        let mut leader_of = BTreeMap::new();
        let mut leaders = Vec::new();
        for id in self.representations.keys().copied().collect::<Vec<_>>() {
            if leader_of.contains_key(&id) {
                continue;
            }
            let members = self.part(id);
            leader_of.extend(members.iter().map(|member| (*member, members[0])));
            leaders.push(members[0]);
            let mut part = Part::default();
            for representation in members.iter().filter_map(|m| self.representations.get(m)) {
                for item in &representation.items {
                    part.contents.add(self.file, *item, representation.context);
                }
            }
            self.parts.insert(members[0], part);
        }
        let mut seen = HashSet::new();
        for Placing { parent, child, placement } in std::mem::take(&mut self.placings) {
            let (Some(parent), Some(child)) = (leader_of.get(&parent), leader_of.get(&child)) else {
                continue;
            };
            if seen.insert((*parent, *child, bits(&placement))) {
                self.parts.entry(*parent).or_default().inside.push((*child, placement));
            } else {
                *self.twice.entry(*child).or_default() += 1;
            }
        }
        leaders
    }

    /// The parts that stand in `roots`, and these, in order.
    fn reached(&self, roots: &[u64]) -> BTreeSet<u64> {
        let (mut reached, mut open) = (BTreeSet::from_iter(roots.iter().copied()), roots.to_vec());
        while let Some(leader) = open.pop() {
            for (child, _) in self.parts.get(&leader).into_iter().flat_map(|p| &p.inside) {
                if reached.insert(*child) {
                    open.push(*child);
                }
            }
        }
        reached
    }

    /// Counts what the walk will come by.
    fn check(&self, roots: &[u64], loose: Tally) -> Result<(), TooMuch> {
        let index: BTreeMap<u64, usize> = self.parts.keys().copied().zip(0..).collect();
        let own = |part: &Part| Tally {
            size: part.size.saturating_add(PLACEMENT),
            parts: 1,
            faces: part.contents.faces.len() as u64,
        };
        let own: Vec<Tally> = self.parts.values().map(own).collect();
        let inside = |part: &Part| part.inside.iter().map(|(child, _)| index[child]).collect();
        let inside: Vec<Vec<usize>> = self.parts.values().map(inside).collect();
        let sums = tallies(&own, &inside, DEEPEST_ASSEMBLY);
        let of = |root: &u64| sums[index[root]];
        let whole = roots.iter().fold(loose, |sum, root| sum.plus(of(root)));
        if Allowance::new(self.file.size()).suits_whole(whole.size) {
            return Ok(());
        }
        let id = roots.iter().copied().max_by_key(|root| of(root).size).unwrap_or(0);
        let name = self.file.get(id).ok().and_then(|e| e.only().ok().map(|r| r.text(0))).unwrap_or_default();
        let bytes = self.file.size();
        let what = format!(
            "the representation `{}` unfolds to {whole}, more than the {bytes} bytes of the file can stand for",
            crate::shortened(name)
        );
        Err(TooMuch { id, what })
    }

    /// Faces that belong to no representation, where they stand.
    fn add_loose(&mut self, loose: &[u64]) {
        self.faces.warnings.push(format!(
            "{} faces belong to no shape representation: they are read where they stand.",
            loose.len()
        ));
        if self.faces.contexts.is_empty() {
            let context = self.any_context();
            self.faces.contexts.push(context);
        }
        self.instance += 1;
        for id in loose {
            let face = OwnFace { id: *id, owners: vec![*id], reversed: false, bare: false, context: 0 };
            self.push(&face, &Similarity3::identity());
        }
    }

    /// The first context in the file that declares a length unit.
    fn any_context(&mut self) -> Context {
        let file = self.file;
        let complex = file.of_type(<[u8]>::is_empty);
        let found = complex
            .filter(|id| memmem::find(file.text(*id), b"GLOBAL_UNIT_ASSIGNED_CONTEXT").is_some())
            .find_map(|id| units::read(file, id));
        found.unwrap_or_else(|| {
            let warning = "The file declares no unit of length: millimetres are assumed.";
            self.faces.warnings.push(warning.into());
            units::millimetres()
        })
    }

    /// All representations of the part that `id` belongs to, in order.
    fn part(&self, id: u64) -> Vec<u64> {
        let (mut part, mut open) = (BTreeSet::from([id]), vec![id]);
        while let Some(next) = open.pop() {
            for other in self.same_part.get(&next).into_iter().flatten() {
                if part.insert(*other) {
                    open.push(*other);
                }
            }
        }
        part.into_iter().collect()
    }

    /// Places the part that `leader` is the first representation of; `through` is what it stands in.
    fn place(&mut self, leader: u64, placement: Similarity3<f64>, through: &mut Vec<u64>) {
        if through.len() >= DEEPEST_ASSEMBLY || through.contains(&leader) {
            let warning =
                format!("Representation #{leader} is nested too deeply or in itself: left out there.");
            if !self.faces.warnings.contains(&warning) {
                self.faces.warnings.push(warning);
            }
            return;
        }
        if !self.stands.insert((leader, bits(&placement))) {
            *self.twice.entry(leader).or_default() += 1;
            return;
        }
        self.instance += 1;
        let Some(part) = self.parts.get_mut(&leader) else { return };
        let (own, inside) = (std::mem::take(&mut part.contents.faces), std::mem::take(&mut part.inside));
        for face in &own {
            self.push(face, &placement);
        }
        through.push(leader);
        for (child, at) in &inside {
            self.place(*child, placement * at, through);
        }
        through.pop();
        if let Some(part) = self.parts.get_mut(&leader) {
            (part.contents.faces, part.inside) = (own, inside);
        }
    }

    fn push(&mut self, face: &OwnFace, placement: &Similarity3<f64>) {
        let OwnFace { id, owners, reversed, bare, context } = face.clone();
        let (count, bits) = (self.places.len(), bits(placement));
        let place = *self.places.entry(bits).or_insert(count);
        let first = *self.visited.entry(id).or_insert(self.root);
        if first < self.root || !self.standing.insert((id, place)) {
            self.repeated += 1;
            return;
        }
        let (instance, placement) = (self.instance, *placement);
        self.faces.placed.push(PlacedFace { id, placement, context, instance, owners, reversed, bare });
    }
}

/// What faces unfold to together; those that are too large alone are not built, and go to `oversized`.
fn measured(
    unfolding: &mut Unfolding,
    faces: impl Iterator<Item = u64>,
    oversized: &mut BTreeMap<u64, u64>,
) -> u64 {
    let mut sum = 0_u64;
    for id in faces {
        match unfolding.face(id) {
            Ok(size) => sum = sum.saturating_add(size),
            Err(size) => drop(oversized.insert(id, size)),
        }
    }
    sum
}

/// A placement as it can be compared: minus zero is zero.
fn bits(placement: &Similarity3<f64>) -> [u64; 8] {
    let (shift, turn) = (placement.isometry.translation.vector, placement.isometry.rotation.coords);
    [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z, turn.w, placement.scaling()]
        .map(|x| (x + 0.0).to_bits())
}

fn similarity(frame: &Frame, mm_per_unit: f64, scale: f64) -> Similarity3<f64> {
    let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[frame.x, frame.y, frame.z]));
    Similarity3::from_parts(
        Translation3::from(frame.origin.coords * mm_per_unit),
        UnitQuaternion::from_rotation_matrix(&axes),
        scale,
    )
}
