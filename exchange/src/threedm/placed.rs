//! Which objects show in the model, and where: objects on their own and those of placed blocks.

use std::collections::BTreeMap;

use nalgebra::Matrix4;

use super::archive::Uuid;
use super::attributes::Attributes;
use super::blocks::{self, Blocks};
use super::class::Class;
use super::fault::Fault;
use super::layers::Layers;
use super::tables::{Record, Tables};

/// Blocks are nested no deeper than this.
const DEEPEST: usize = 16;
/// Objects that blocks may unfold to, beyond those of the file: these, and one for so many bytes of it. The instance
/// of a block takes some hundred bytes.
const MOST_OBJECTS: usize = 10_000;
const BYTES_AN_OBJECT: usize = 16;

/// One object in the model.
#[derive(Debug, Clone)]
pub(super) struct Placed {
    /// Index of the record.
    pub(super) record: usize,
    /// From the object's coordinates to the model's, file units.
    pub(super) placement: Matrix4<f64>,
    /// Records of the block instances it is part of, outermost first.
    pub(super) through: Vec<usize>,
    /// Why it cannot be used, where that is known already.
    pub(super) fault: Option<Fault>,
}

/// Whether an object of this class has, or stands for, faces.
pub(super) fn is_solid(class: Class) -> bool {
    super::surfaces::is_surface(class)
        || matches!(class, Class::Brep | Class::Extrusion | Class::Mesh | Class::SubD)
}

/// Finds the objects of the model, in file order; `size` is the length of the file, bytes.
pub(super) fn all(tables: &Tables, size: usize) -> Vec<Placed> {
    let mut finder = Finder {
        records: &tables.records,
        layers: &tables.layers,
        blocks: &tables.blocks,
        by_id: BTreeMap::new(),
        visits_left: tables.records.len() + MOST_OBJECTS + size / BYTES_AN_OBJECT,
        out: Vec::new(),
    };
    for (i, record) in tables.records.iter().enumerate() {
        if let Ok((_, attributes)) = &record.object {
            finder.by_id.entry(attributes.id).or_insert(i);
        }
    }
    for (i, record) in tables.records.iter().enumerate() {
        match &record.object {
            Ok((_, attributes)) if attributes.in_block => {}
            Ok(_) => finder.visit(i, &Matrix4::identity(), &mut Vec::new()),
            Err(fault) => finder.push(i, &Matrix4::identity(), &[], Some(fault.clone())),
        }
    }
    finder.out
}

struct Finder<'a> {
    records: &'a [Record<'a>],
    layers: &'a Layers,
    blocks: &'a Blocks,
    by_id: BTreeMap<Uuid, usize>,
    visits_left: usize,
    out: Vec<Placed>,
}

impl Finder<'_> {
    fn push(&mut self, record: usize, placement: &Matrix4<f64>, through: &[usize], fault: Option<Fault>) {
        self.visits_left = self.visits_left.saturating_sub(1);
        self.out.push(Placed { record, placement: *placement, through: through.to_vec(), fault });
    }

    fn visit(&mut self, record: usize, placement: &Matrix4<f64>, through: &mut Vec<usize>) {
        let Ok((object, attributes)) = &self.records[record].object else { return };
        if object.class != Class::BlockReference {
            if is_solid(object.class) {
                self.push(record, placement, through, self.not_shown(attributes));
            }
            return;
        }
        self.visits_left = self.visits_left.saturating_sub(1);
        let fault = match self.not_shown(attributes) {
            Some(fault) => fault,
            None => match self.unfold(record, placement, through) {
                Ok(()) => return,
                Err(fault) => fault,
            },
        };
        self.push(record, placement, through, Some(fault));
    }

    /// Visits the parts of the block that is placed by `record`.
    fn unfold(
        &mut self,
        record: usize,
        placement: &Matrix4<f64>,
        through: &mut Vec<usize>,
    ) -> Result<(), Fault> {
        let Ok((object, _)) = &self.records[record].object else { return Ok(()) };
        let reference = blocks::reference(&mut object.data.clone())?;
        let blocks = self.blocks;
        let block = blocks.get(&reference.block).ok_or(Fault::NoBlock)?;
        if block.linked {
            return Err(Fault::Linked(block.name.clone()));
        }
        if through.contains(&record) || through.len() >= DEEPEST {
            return Err(Fault::NestedBlocks);
        }
        through.push(record);
        let inside = placement * reference.placement;
        for id in &block.parts {
            if self.visits_left == 0 {
                through.pop();
                return Err(Fault::TooMuch);
            }
            match self.by_id.get(id) {
                Some(&part) => self.visit(part, &inside, through),
                None => self.push(record, &inside, through, Some(Fault::NoBlock)),
            }
        }
        through.pop();
        Ok(())
    }

    fn not_shown(&self, attributes: &Attributes) -> Option<Fault> {
        if attributes.on_layout {
            return Some(Fault::Layout);
        }
        if attributes.hidden {
            return Some(Fault::Hidden);
        }
        let layer = || self.layers.path(attributes.layer).unwrap_or_default();
        self.layers.is_hidden(attributes.layer).then(|| Fault::LayerHidden(layer()))
    }
}
