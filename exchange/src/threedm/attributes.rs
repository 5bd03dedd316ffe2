//! What goes with an object: identity, layer, name, colour, whether it shows.

use super::archive::{Reader, Uuid};
use super::fault::Fault;

/// Where an object's colour comes from, as the archive codes it.
const FROM_OBJECT: u8 = 1;
/// `object_mode` values; the upper half of the byte says more about display.
const HIDDEN: u8 = 1;
const IN_BLOCK: u8 = 3;
const MODE: u8 = 0x0f;
/// `active_space` of page layouts.
const PAGE: u8 = 2;

/// An object's attributes.
#[derive(Debug, Clone)]
pub(super) struct Attributes {
    pub(super) id: Uuid,
    pub(super) layer: i32,
    pub(super) name: Option<String>,
    /// The object's own colour; `None` where the layer decides.
    pub(super) colour: Option<[u8; 3]>,
    pub(super) hidden: bool,
    /// Part of a block's definition: it shows only where the block is placed.
    pub(super) in_block: bool,
    pub(super) on_layout: bool,
}

impl Attributes {
    /// Reads attributes of any archive version: the major version of the record tells which.
    pub(super) fn read(r: &mut Reader) -> Result<Self, Fault> {
        match r.version()? {
            (1, minor) => fixed(r, minor),
            (2, _) => tagged(r),
            (version, _) => Err(Fault::Version { what: "object attributes", version }),
        }
    }

    fn new(id: Uuid, layer: i32) -> Self {
        Attributes { id, layer, name: None, colour: None, hidden: false, in_block: false, on_layout: false }
    }

    fn set_mode(&mut self, mode: u8) {
        self.hidden |= mode & MODE == HIDDEN;
        self.in_block = mode & MODE == IN_BLOCK;
    }
}

/// Archives up to version 4: every field in its place.
fn fixed(r: &mut Reader, minor: u8) -> Result<Attributes, Fault> {
    let mut out = Attributes::new(r.uuid()?, r.integer()?);
    // Material, and behind the colour an unused line style.
    r.integer()?;
    let colour = r.colour()?;
    r.take(20)?;
    r.integer()?;
    out.set_mode(r.byte()?);
    out.colour = colour.filter(|_| matches!(r.clone().byte(), Ok(FROM_OBJECT)));
    r.take(3)?;
    out.name = Some(r.text()?).filter(|n| !n.is_empty());
    r.text()?;
    if minor >= 1 {
        r.integers()?;
    }
    if minor >= 2 {
        out.hidden |= !r.flag()?;
    }
    if minor >= 3 {
        display_materials(r)?;
    }
    if minor >= 4 {
        // Decoration and plotting.
        r.take(4 + 1 + 4 + 1 + 8)?;
    }
    if minor >= 5 {
        r.integer()?;
    }
    if minor >= 6 {
        out.on_layout = r.byte()? == 1;
    }
    Ok(out)
}

/// Archives from version 5 on: what differs from the default, each behind its tag, in the order of tags.
fn tagged(r: &mut Reader) -> Result<Attributes, Fault> {
    let mut out = Attributes::new(r.uuid()?, r.integer()?);
    let (mut colour, mut colour_source) = (None, 0);
    loop {
        match r.byte()? {
            1 => out.name = Some(r.text()?).filter(|n| !n.is_empty()),
            2 => drop(r.text()?),
            3 | 4 | 10 => drop(r.integer()?),
            5 => drop(r.chunk()?),
            6 => colour = r.colour()?,
            7 => drop(r.colour()?),
            8 => drop(r.real()?),
            9 | 14..=17 => drop(r.byte()?),
            11 => out.hidden |= !r.flag()?,
            12 => out.set_mode(r.byte()?),
            13 => colour_source = r.byte()?,
            18 => drop(r.integers()?),
            19 => out.on_layout = r.byte()? == PAGE,
            // The end, and tags that say nothing about surfaces.
            _ => break,
        }
    }
    out.colour = colour.filter(|_| colour_source == FROM_OBJECT);
    Ok(out)
}

/// Pairs of viewport and material.
fn display_materials(r: &mut Reader) -> Result<(), Fault> {
    r.list(32, |r| r.take(32).map(drop)).map(drop)
}
