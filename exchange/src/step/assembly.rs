//! Which faces the file holds, and where each of them stands.
//!
//! Representations form a graph: identity relationships tie representations of one part together, relationships
//! with a transformation and mapped items place one inside another. The walk starts at those that nothing
//! holds, shapes of products first: what else names their faces names them again.

use std::collections::{BTreeMap, BTreeSet};

use claymill_nurbs::analytic::Frame;
use memchr::memmem;
use nalgebra::{Matrix3, Rotation3, Similarity3, Translation3, UnitQuaternion};

use super::part21::Part21;
use super::placement::{frame, point};
use super::products::Products;
use super::{Context, StepError, bare, units};

/// Assemblies may be nested this deep.
const DEEPEST_ASSEMBLY: usize = 32;
/// Solids hold shells hold faces: nesting of containers.
const DEEPEST_CONTAINER: usize = 8;
/// More placed faces than this are refused: a few kilobytes of nested assemblies can ask for billions.
const MOST_FACES: usize = 2_000_000;
const MOST_INSTANCES: u64 = 100_000;

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
}

/// A representation: items and context.
struct Representation {
    items: Vec<u64>,
    context: usize,
}

/// `child` stands inside `parent`.
struct Placing {
    parent: u64,
    child: u64,
    placement: Similarity3<f64>,
}

pub(super) fn faces(file: &Part21) -> Faces {
    let mut faces = Faces::default();
    let representations = representations(file, &mut faces);
    let mut walk = Walk {
        file,
        faces,
        representations,
        placings: Vec::new(),
        same_part: BTreeMap::new(),
        visited: BTreeMap::new(),
        root: 0,
        standing: BTreeSet::new(),
        places: BTreeMap::new(),
        repeated: 0,
        instance: 0,
    };
    walk.relationships();
    walk.run();
    walk.faces
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
        found.insert(id, Representation { items, context });
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
        let holds =
            |representation: u64, item: u64| self.representations[&representation].items.contains(&item);
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

    fn run(&mut self) {
        let products = Products::read(self.file);
        // What describes a property of a part does not hold the part.
        let holding = self.placings.iter().filter(|p| !products.is_property(&self.part(p.parent)));
        let children: BTreeSet<u64> = holding.map(|p| p.child).collect();
        let mut done = BTreeSet::new();
        let parts = self.representations.keys().map(|id| self.part(*id)).filter(|part| done.insert(part[0]));
        let (shapes, others): (Vec<_>, Vec<_>) = parts
            .filter(|part| !part.iter().any(|r| children.contains(r)))
            .partition(|part| products.is_shape(part));
        for part in shapes {
            self.place(&part, Similarity3::identity(), DEEPEST_ASSEMBLY);
        }
        for part in others {
            self.root += 1;
            self.place(&part, Similarity3::identity(), DEEPEST_ASSEMBLY);
        }
        if self.repeated > 0 {
            self.faces.warnings.push(format!(
                "The file names {} faces again that it has already, as properties of a part or in the same \
                 place: they are read once.",
                self.repeated
            ));
        }
        let face = |name: &[u8]| matches!(name, b"ADVANCED_FACE" | b"FACE_SURFACE");
        let left: Vec<u64> = self.file.of_type(face).filter(|id| !self.visited.contains_key(id)).collect();
        if left.is_empty() {
            return;
        }
        self.faces.warnings.push(format!(
            "{} faces belong to no shape representation: they are read where they stand.",
            left.len()
        ));
        if self.faces.contexts.is_empty() {
            let context = self.any_context();
            self.faces.contexts.push(context);
        }
        self.instance += 1;
        for id in left {
            self.collect(id, 0, Similarity3::identity(), &mut Vec::new(), false, 1);
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

    fn place(&mut self, part: &[u64], placement: Similarity3<f64>, depth: usize) {
        if self.faces.placed.len() > MOST_FACES || self.instance > MOST_INSTANCES {
            let warning = "The assembly has millions of parts or faces: the rest is left out.";
            if self.faces.warnings.last().is_none_or(|w| w != warning) {
                self.faces.warnings.push(warning.into());
            }
            return;
        }
        let Some(depth) = depth.checked_sub(1) else {
            let warning =
                format!("Representation #{} is nested too deeply or in itself: left out there.", part[0]);
            if !self.faces.warnings.contains(&warning) {
                self.faces.warnings.push(warning);
            }
            return;
        };
        self.instance += 1;
        for id in part {
            let Some(representation) = self.representations.get(id) else {
                continue;
            };
            let context = representation.context;
            for item in representation.items.clone() {
                self.collect(item, context, placement, &mut Vec::new(), false, DEEPEST_CONTAINER);
            }
        }
        let inside: Vec<(u64, Similarity3<f64>)> = self
            .placings
            .iter()
            .filter(|p| part.contains(&p.parent))
            .map(|p| (p.child, placement * p.placement))
            .collect();
        for (child, placement) in inside {
            let part = self.part(child);
            self.place(&part, placement, depth);
        }
    }

    /// Adds the faces of a solid, shell or face.
    fn collect(
        &mut self,
        id: u64,
        context: usize,
        placement: Similarity3<f64>,
        owners: &mut Vec<u64>,
        reversed: bool,
        depth: usize,
    ) {
        let Some(depth) = depth.checked_sub(1) else { return };
        let text = self.file.text(id);
        let name = &text[..super::part21::name_length(text)];
        owners.push(id);
        match name {
            b"ADVANCED_FACE" | b"FACE_SURFACE" => {
                self.push(id, context, placement, owners, reversed, false);
            }
            _ if bare::is_surface(text) => self.push(id, context, placement, owners, false, true),
            b"MANIFOLD_SOLID_BREP"
            | b"BREP_WITH_VOIDS"
            | b"FACETED_BREP"
            | b"SHELL_BASED_SURFACE_MODEL"
            | b"FACE_BASED_SURFACE_MODEL"
            | b"CONNECTED_FACE_SET"
            | b"OPEN_SHELL"
            | b"CLOSED_SHELL"
            | b"ORIENTED_CLOSED_SHELL"
            | b"ORIENTED_OPEN_SHELL"
            | b"ORIENTED_FACE"
            | b"GEOMETRIC_SET" => {
                let Ok(entity) = self.file.get(id) else {
                    owners.pop();
                    return;
                };
                let turned =
                    name.starts_with(b"ORIENTED_") && entity.only().and_then(|r| r.flag(3)) == Ok(false);
                for item in entity.references() {
                    self.collect(item, context, placement, owners, reversed != turned, depth);
                }
            }
            _ => {}
        }
        owners.pop();
    }

    fn push(
        &mut self,
        id: u64,
        context: usize,
        placement: Similarity3<f64>,
        owners: &[u64],
        reversed: bool,
        bare: bool,
    ) {
        let (count, bits) = (self.places.len(), bits(&placement));
        let place = *self.places.entry(bits).or_insert(count);
        let first = *self.visited.entry(id).or_insert(self.root);
        if first < self.root || !self.standing.insert((id, place)) {
            self.repeated += 1;
            return;
        }
        let (instance, owners) = (self.instance, owners.to_vec());
        self.faces.placed.push(PlacedFace { id, placement, context, instance, owners, reversed, bare });
    }
}

fn bits(placement: &Similarity3<f64>) -> [u64; 8] {
    let (at, turn) = (placement.isometry.translation.vector, placement.isometry.rotation.coords);
    [at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w, placement.scaling()].map(f64::to_bits)
}

fn similarity(frame: &Frame, mm_per_unit: f64, scale: f64) -> Similarity3<f64> {
    let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[frame.x, frame.y, frame.z]));
    Similarity3::from_parts(
        Translation3::from(frame.origin.coords * mm_per_unit),
        UnitQuaternion::from_rotation_matrix(&axes),
        scale,
    )
}
