//! The operations of a job, chosen from material, tools and stock: each with its reason, and what was refused.
//!
//! ```text
//!   material ─ process ─► stages ─┐
//!   stock ──────────────► layers ─┤   rough …  the largest ball of its range, in layers down to the allowance; or an end mill, in
//!                         levels  │            levels
//!   tools ──────────────► balls ──┼─► finish   the ball that takes the least time with what follows it
//!   model ─► balls that fit where ┘   rest …   the cheapest chain of smaller balls for what is left
//! ```

mod chooser;
mod finish;
mod fits;
mod layers;
mod levels;
mod stock;

use std::collections::BTreeMap;
use std::path::Path;

use claymill_nurbs::{ModelMesh, Vector3};
use claymill_paths::Strategy;
use claymill_tooling::{
    Fact, Facts, Library, LibraryTool, MachineShape, Process, Profiles, StageKind, ToolingError,
};
use claymill_toolpath::{Levels, LinkStyle, Monitor, OperationKind, Stock, StockFile, Tool};

use crate::error::Error;
use crate::prepared::Prepared;
use crate::stock_file::ReadStock;

/// What a job is chosen from.
#[derive(Debug, Clone)]
pub struct Shop {
    /// Tools.
    pub library: Library,
    /// The machine.
    pub machine: MachineShape,
    /// Materials and processes.
    pub profiles: Profiles,
}

/// What is asked for.
#[derive(Debug, Clone)]
pub struct Wish {
    /// Name of the material.
    pub material: String,
    /// What the model is cut from; as usual for the material if `None`.
    pub stock: Option<StockWish>,
    /// Scallop height of the finish, mm; that of the process if `None`.
    pub scallop_mm: Option<f64>,
}

/// Stock as it is asked for, before the model is known.
#[derive(Debug, Clone, PartialEq)]
pub enum StockWish {
    /// A layer on all faces, mm.
    Layer(f64),
    /// A block around the model, larger than it by this much on every side, mm.
    BlockAround(f64),
    /// A block: xmin, ymin, zmin, xmax, ymax, zmax.
    Block([f64; 6]),
    /// A round bar about the middle of the model, as long as this is: its diameter, mm, and the axis along which it lies, 0 to 2 for
    /// x to z; that along which the model is longest if `None`.
    Round(f64, Option<usize>),
    /// What a file encloses.
    File(StockFile),
}

/// Operations in order.
#[derive(Debug, Clone)]
pub struct Choice {
    /// What the model is cut from.
    pub stock: Stock,
    /// In machining order.
    pub operations: Vec<ChosenOperation>,
    /// What was not chosen, and why, a sentence each.
    pub refusals: Vec<String>,
    /// The process with every value and its origin.
    pub process: Process,
}

/// An operation with its tool and values.
#[derive(Debug, Clone)]
pub struct ChosenOperation {
    /// Its name in the job.
    pub name: String,
    /// What it is for.
    pub kind: OperationKind,
    /// Why it is there, and what it costs.
    pub reason: String,
    /// Its tool.
    pub tool: LibraryTool,
    /// Its number in the machine.
    pub tool_number: u32,
    /// The tool before it, if it cuts that one's rest.
    pub rest_of: Option<Tool>,
    /// Levels, where it roughs by these.
    pub levels: Option<Levels>,
    /// What it leaves, mm.
    pub allowance_mm: f64,
    /// Scallop height, mm.
    pub scallop_mm: f64,
    /// Where passes run.
    pub strategy: Strategy,
    /// How passes are joined.
    pub link: LinkStyle,
    /// Feed, mm/min.
    pub feed_mm_per_min: f64,
    /// Stock that may stand above what it leaves, mm: all that there was at first.
    pub stock_above_mm: f64,
    /// Only what has more stock than this above what it leaves is cut, mm.
    pub rest_above_mm: Option<f64>,
    /// The ball's centre stays in here, where nothing is to be cut outside.
    pub within_mm: Option<[f64; 6]>,
}

impl Shop {
    /// The shipped tools, machine and profiles.
    #[must_use]
    pub fn shipped() -> Self {
        Shop { library: Library::shipped(), machine: MachineShape::shipped(), profiles: Profiles::shipped() }
    }
}

/// Chooses the operations of a job.
///
/// # Errors
/// Material, process or tools do not go together: named, with what to do. Or the monitor ends it.
pub fn choose(
    prepared: &Prepared<'_>,
    shop: &Shop,
    wish: &Wish,
    monitor: &dyn Monitor,
) -> Result<Choice, Error> {
    let mut facts = Facts::new();
    facts.insert("material", Fact::Text(wish.material.clone()));
    facts.insert("machine.axes", Fact::Number(shop.machine.axis_count() as f64));
    facts.insert("machine.name", Fact::Text(shop.machine.name.clone()));
    let failed = |fault| ToolingError::Process { process: wish.material.clone(), fault };
    let material = shop.profiles.material(&wish.material).ok_or_else(|| Error::Choice {
        what: format!("there is no material `{}`", wish.material),
        advice: format!("There are {}.", shop.profiles.material_names().collect::<Vec<_>>().join(", ")),
    })?;
    facts.insert("material", Fact::Text(material.name.clone()));
    let process = shop.profiles.choose(&facts).map_err(failed)?;
    let process = shop.profiles.resolve(process, &material.name, &BTreeMap::new())?;
    let bounds = prepared.file.bounds;
    let points = match wish.stock {
        Some(StockWish::Round(..)) => ModelMesh::of(prepared.file.model(), stock::BAR_DEVIATION_MM).points,
        _ => Vec::new(),
    };
    let read = ReadStock::of(&stock::stock(wish, material, (&bounds, &points))?, Path::new(""))?;
    let thickest_mm = layers::thickest_mm(&read, prepared.file.model());
    let stock = read.record;
    facts.insert("stock.thickness_mm", Fact::Number(thickest_mm));
    facts.insert("part.height_mm", Fact::Number((bounds.max - bounds.min).z));
    let mut chooser = chooser::Chooser {
        shop,
        material,
        facts,
        stock: &stock,
        part: bounds,
        thickest_mm,
        left_mm: thickest_mm,
        operations: Vec::new(),
        refusals: Vec::new(),
    };
    for kind in [StageKind::Rough, StageKind::Semi] {
        if let Some(stage) = process.stage(kind) {
            chooser.clear(stage)?;
        }
    }
    if let Some(finish) = process.stage(StageKind::Finish) {
        let axes: Vec<Vector3> = prepared.options.frames()?.iter().map(|frame| frame.axis()).collect();
        let most_mm = shop.library.tools.iter().map(|t| t.tool.radius_mm()).fold(0.0, f64::max);
        let balls = chooser.balls(None);
        let samples = fits::samples(prepared, &axes, (&balls, most_mm), monitor).map_err(Error::Cancelled)?;
        chooser.surface(finish, process.stage(StageKind::Rest), &samples, wish.scallop_mm)?;
    }
    for (kind, from) in &process.skipped {
        chooser.refusals.push(format!("{} is left out: {from}", kind.name()));
    }
    if process.stage(StageKind::Pencil).is_some() {
        chooser.refusals.push("pencil is left out: rest passes run along valleys".into());
    }
    let chooser::Chooser { operations, refusals, .. } = chooser;
    Ok(Choice { stock: unread(stock), operations, refusals, process })
}

/// A stock as job files have it: what its file held may have changed when it is read again.
fn unread(stock: Stock) -> Stock {
    match stock {
        Stock::File(file) => Stock::File(StockFile::at(Path::new(&file.path), file.unit_mm)),
        other => other,
    }
}
