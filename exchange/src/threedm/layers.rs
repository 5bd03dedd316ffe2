//! The layer table.

use std::collections::BTreeMap;

use super::archive::{Reader, Uuid};
use super::fault::Fault;

/// Layers are nested no deeper than this.
const DEEPEST: usize = 64;

/// One layer.
#[derive(Debug, Clone)]
struct Layer {
    name: String,
    colour: Option<[u8; 3]>,
    hidden: bool,
    id: Option<Uuid>,
    parent: Option<Uuid>,
}

/// All layers, by the index that objects use.
#[derive(Debug, Clone, Default)]
pub(super) struct Layers {
    by_index: BTreeMap<i32, Layer>,
    by_id: BTreeMap<Uuid, i32>,
}

impl Layers {
    /// Adds the layer whose data `r` reads.
    pub(super) fn add(&mut self, r: &mut Reader) -> Result<(), Fault> {
        let minor = match r.version()? {
            (1, minor) => minor,
            (version, _) => return Err(Fault::Version { what: "a layer", version }),
        };
        let mode = r.integer()?;
        let index = r.integer()?;
        // IGES level, material and an obsolete number.
        r.take(12)?;
        let colour = r.colour()?;
        // An unused line style.
        r.take(20)?;
        let name = r.text()?;
        let mut layer = Layer { name, colour, hidden: mode == 1, id: None, parent: None };
        if minor >= 1 {
            layer.hidden |= !r.flag()?;
        }
        if minor >= 5 {
            // Line type, plot colour and weight, lock.
            r.take(4 + 4 + 8 + 1)?;
            layer.id = Some(r.uuid()?);
        }
        if minor >= 6 {
            layer.parent = Some(r.uuid()?).filter(|id| !id.is_nil());
        }
        if let Some(id) = layer.id {
            self.by_id.entry(id).or_insert(index);
        }
        self.by_index.entry(index).or_insert(layer);
        Ok(())
    }

    /// The layer and those around it, innermost first.
    fn chain(&self, index: i32) -> impl Iterator<Item = &Layer> {
        let around = |l: &&Layer| self.by_index.get(self.by_id.get(&l.parent?)?);
        std::iter::successors(self.by_index.get(&index), around).take(DEEPEST)
    }

    /// The name with those of the layers around it, as Rhino writes it: `body::skin`.
    pub(super) fn path(&self, index: i32) -> Option<String> {
        let mut names: Vec<_> = self.chain(index).map(|l| l.name.as_str()).collect();
        names.reverse();
        Some(names.join("::")).filter(|path| !path.is_empty())
    }

    pub(super) fn colour(&self, index: i32) -> Option<[u8; 3]> {
        self.by_index.get(&index)?.colour
    }

    pub(super) fn is_hidden(&self, index: i32) -> bool {
        self.chain(index).any(|l| l.hidden)
    }
}
