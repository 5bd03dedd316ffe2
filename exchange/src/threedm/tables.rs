//! The tables of an archive: what is in the file, not yet what it means.

use super::archive::{self, Chunk, Reader};
use super::attributes::Attributes;
use super::blocks::{self, Blocks};
use super::class::{self, Class, Object};
use super::fault::Fault;
use super::layers::Layers;
use super::units::Units;

const COMMENT: u32 = 0x0000_0001;
const END_OF_FILE: u32 = 0x0000_7fff;
const END_OF_TABLE: u32 = 0xffff_ffff;
const LAYERS: u32 = 0x1000_0011;
const OBJECTS: u32 = 0x1000_0013;
const PROPERTIES: u32 = 0x1000_0014;
const SETTINGS: u32 = 0x1000_0015;
const BLOCKS: u32 = 0x1000_0021;
const LAYER: u32 = 0x2000_8050;
const OBJECT: u32 = 0x2000_8070;
const BLOCK: u32 = 0x2000_8076;
const APPLICATION: u32 = 0x2000_8024;
const TOOLKIT_VERSION: u32 = 0xa000_0026;
const UNITS: u32 = 0x2000_8031;
const OBJECT_TYPE: u32 = 0x8200_0071;
const OBJECT_ATTRIBUTES: u32 = 0x0200_8072;
const OBJECT_END: u32 = 0x8200_007f;

/// Everything an archive holds that matters here.
#[derive(Debug)]
pub(super) struct Tables<'a> {
    /// The program that wrote the file.
    pub(super) system: Option<String>,
    /// Version of the openNURBS toolkit that wrote the file; 0 when it does not say.
    pub(super) toolkit: i64,
    pub(super) units: Units,
    pub(super) layers: Layers,
    pub(super) blocks: Blocks,
    pub(super) records: Vec<Record<'a>>,
    pub(super) warnings: Vec<String>,
    /// The mark at the end was there.
    pub(super) complete: bool,
}

/// One record of the object table.
#[derive(Debug)]
pub(super) struct Record<'a> {
    /// Where it is in the file.
    pub(super) at: usize,
    pub(super) object: Result<(Object<'a>, Attributes), Fault>,
}

impl<'a> Tables<'a> {
    pub(super) fn read(bytes: &'a [u8], version: u32, checked: bool) -> Self {
        let mut tables = Tables {
            system: None,
            toolkit: 0,
            units: Units::unknown(),
            layers: Layers::default(),
            blocks: Blocks::default(),
            records: Vec::new(),
            warnings: Vec::new(),
            complete: false,
        };
        let mut file = archive::body(bytes, version, checked);
        while file.left() > 0 {
            let at = file.position();
            match file.chunk_or_rest() {
                Ok(chunk) if chunk.code == END_OF_FILE => {
                    tables.complete = true;
                    break;
                }
                Ok(chunk) => tables.table(chunk),
                Err(fault) => {
                    tables.warnings.push(format!(
                        "The archive cannot be followed behind byte {at} ({fault}): objects may be lost; copy the file again."
                    ));
                    return tables;
                }
            }
        }
        if !tables.complete {
            tables.warnings.push(
                "The end mark is missing: the end of the file may be lost; compare its size with the original."
                    .into(),
            );
        }
        tables
    }

    fn table(&mut self, chunk: Chunk<'a>) {
        let mut table = chunk.content;
        let outcome = match chunk.code {
            COMMENT => {
                self.comment(table);
                return;
            }
            PROPERTIES => records(&mut table, |r| self.property(r)),
            SETTINGS => records(&mut table, |r| self.setting(r)),
            LAYERS => records(&mut table, |r| self.layer(r)),
            BLOCKS => records(&mut table, |r| self.block(r)),
            OBJECTS => {
                self.objects(table);
                return;
            }
            _ => return,
        };
        if let Err(fault) = outcome {
            let what = match chunk.code {
                PROPERTIES => "properties",
                SETTINGS => "settings (the unit of length!)",
                LAYERS => "layers",
                _ => "blocks",
            };
            self.warnings.push(format!("The table of {what} is damaged: {fault}."));
        }
    }

    /// The comment begins with the name of the program.
    fn comment(&mut self, mut comment: Reader) {
        let text = comment.take(comment.left()).unwrap_or_default();
        let line = text.split(|b| matches!(b, b'\n' | b'\r' | 0 | 26)).next().unwrap_or_default();
        let line = String::from_utf8_lossy(line);
        self.system = Some(line.trim().to_string()).filter(|l| !l.is_empty());
    }

    fn property(&mut self, mut chunk: Chunk) -> Result<(), Fault> {
        match chunk.code {
            TOOLKIT_VERSION => self.toolkit = chunk.value,
            APPLICATION => {
                chunk.content.version()?;
                let name = chunk.content.text()?;
                if !name.is_empty() {
                    self.system = Some(name);
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn setting(&mut self, mut chunk: Chunk) -> Result<(), Fault> {
        if chunk.code == UNITS {
            let units = Units::read(&mut chunk.content)?;
            chunk.content.finish()?;
            self.units = units;
        }
        Ok(())
    }

    fn layer(&mut self, mut chunk: Chunk) -> Result<(), Fault> {
        if chunk.code != LAYER {
            return Ok(());
        }
        let mut object = class::object(&mut chunk.content)?;
        if object.class == Class::Layer { self.layers.add(&mut object.data) } else { Ok(()) }
    }

    fn block(&mut self, mut chunk: Chunk) -> Result<(), Fault> {
        if chunk.code != BLOCK {
            return Ok(());
        }
        let mut object = class::object(&mut chunk.content)?;
        if object.class == Class::Block {
            let (id, block) = blocks::read(&mut object.data)?;
            self.blocks.entry(id).or_insert(block);
        }
        Ok(())
    }

    fn objects(&mut self, mut table: Reader<'a>) {
        while table.left() > 0 {
            let at = table.position();
            match table.chunk() {
                Ok(chunk) if chunk.code == END_OF_TABLE => return,
                Ok(chunk) if chunk.code == OBJECT => {
                    self.records.push(Record { at, object: record(chunk.content) });
                }
                Ok(_) => {}
                // The chain of records is broken: what follows cannot be found.
                Err(fault) => {
                    self.records.push(Record { at, object: Err(fault) });
                    return;
                }
            }
        }
    }
}

/// Hands the records of a table to `each`; the first fault is told after all were tried.
fn records<'a>(
    table: &mut Reader<'a>,
    mut each: impl FnMut(Chunk<'a>) -> Result<(), Fault>,
) -> Result<(), Fault> {
    let mut outcome = Ok(());
    while table.left() > 0 {
        let chunk = table.chunk()?;
        if chunk.code == END_OF_TABLE {
            break;
        }
        outcome = outcome.and(each(chunk));
    }
    outcome
}

fn record(mut r: Reader) -> Result<(Object, Attributes), Fault> {
    let at = r.position();
    let kind = r.chunk()?;
    if kind.code != OBJECT_TYPE {
        let found = format!("a chunk of type {:#010x}", kind.code);
        return Err(Fault::Found { at, found, wanted: "the type of an object" });
    }
    let object = class::object(&mut r)?;
    let mut attributes = None;
    while r.left() > 0 {
        let mut chunk = r.chunk()?;
        match chunk.code {
            OBJECT_ATTRIBUTES => {
                attributes = Some(Attributes::read(&mut chunk.content)?);
                chunk.content.finish()?;
            }
            OBJECT_END => break,
            _ => {}
        }
    }
    let at = r.position();
    let missing = || Fault::Found { at, found: "the end".into(), wanted: "the attributes of an object" };
    Ok((object, attributes.ok_or_else(missing)?))
}
