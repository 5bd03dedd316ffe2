//! Blocks (instance definitions) and where they are placed.

use std::collections::BTreeMap;

use nalgebra::Matrix4;

use super::archive::{ANONYMOUS, IDENTITY, Reader, Uuid};
use super::fault::Fault;

/// The kind of block whose objects stay in another file.
const LINKED: i32 = 3;

/// Says that a field follows.
const PRESENT: u8 = 1;

/// One block.
#[derive(Debug, Clone)]
pub(super) struct Block {
    pub(super) name: String,
    pub(super) linked: bool,
    /// The objects it consists of.
    pub(super) parts: Vec<Uuid>,
}

/// All blocks by identity.
pub(super) type Blocks = BTreeMap<Uuid, Block>;

/// Reads a block's data; gives its identity too.
pub(super) fn read(r: &mut Reader) -> Result<(Uuid, Block), Fault> {
    // A version in one byte can not look like this type code.
    if r.peek() == Some(ANONYMOUS) { in_chunk(r) } else { plain(r) }
}

/// Archives up to version 5 and early ones of version 6.
fn plain(r: &mut Reader) -> Result<(Uuid, Block), Fault> {
    match r.version()? {
        (1, _) => {}
        (version, _) => return Err(Fault::Version { what: "a block", version }),
    }
    let id = r.uuid()?;
    let parts = r.list(16, Reader::uuid)?;
    let name = r.text()?;
    for _description_and_addresses in 0..3 {
        r.text()?;
    }
    let _bounds = r.reals::<6>()?;
    let linked = r.integer()? == LINKED;
    Ok((id, Block { name, linked, parts }))
}

/// Archives from version 6 on.
fn in_chunk(r: &mut Reader) -> Result<(Uuid, Block), Fault> {
    let (mut block, _) = r.long_part(ANONYMOUS, "a block")?;
    let r = &mut block;
    let (mut common, _) = r.long_part(IDENTITY, "identity and name of a block")?;
    let at = common.position();
    // Each field is there where the byte before it says so: serial numbers, identity, type, index, name.
    if common.byte()? == PRESENT {
        common.take(12)?;
    }
    let nameless = Fault::Found { at, found: "no identity".into(), wanted: "that of a block" };
    let id = if common.byte()? == PRESENT { common.uuid()? } else { return Err(nameless) };
    for _type_and_index in 0..2 {
        if common.byte()? == PRESENT {
            common.integer()?;
        }
    }
    let name = if common.byte()? == PRESENT { common.text()? } else { String::new() };
    let linked = r.integer()? == LINKED;
    let _units = r.chunk()?;
    for _description_and_addresses in 0..3 {
        r.text()?;
    }
    let _bounds = r.reals::<6>()?;
    let parts = if r.flag()? { r.list(16, Reader::uuid)? } else { Vec::new() };
    Ok((id, Block { name, linked, parts }))
}

/// A block put somewhere.
#[derive(Debug, Clone)]
pub(super) struct Reference {
    pub(super) block: Uuid,
    /// Where it is put, file units.
    pub(super) placement: Matrix4<f64>,
}

/// Reads the data of a block instance.
pub(super) fn reference(r: &mut Reader) -> Result<Reference, Fault> {
    match r.version()? {
        (1, _) => {}
        (version, _) => return Err(Fault::Version { what: "a block instance", version }),
    }
    let block = r.uuid()?;
    let placement = Matrix4::from_row_slice(&r.reals::<16>()?);
    let affine = placement.row(3) == nalgebra::RowVector4::new(0.0, 0.0, 0.0, 1.0);
    let determinant = placement.fixed_view::<3, 3>(0, 0).determinant();
    if !affine || !placement.iter().all(|x| x.is_finite()) || determinant == 0.0 {
        return Err(Fault::Placement);
    }
    Ok(Reference { block, placement })
}
