//! The stock between the operations of a job, as it is followed while they are planned.
//!
//! ```text
//!   stock ──── operation 1 ───► less ──── operation 2 ───► less …
//!     │           its moves      │            its moves     │
//!     ▼                          ▼                          ▼
//!   pictures           what is left for operation 2   what is left for operation 3
//! ```
//!
//! It decides where an operation is worth its passes, and what pictures show. The verifier has a stock of its own.

use std::path::Path;
use std::sync::Arc;

use claymill_nurbs::{Aabb, Model, ModelMesh, Vector3};
use claymill_stock::{Chords, Family, Grid, Stock, StockError, SurfaceMesh, Sweep, ToolBody};
use claymill_toolpath::{
    Job as JobRecord, Levels, Monitor, Move, MoveKind, Program, Stage, Stock as StockRecord, Tool,
};
use rayon::prelude::*;

use crate::error::Error;
use crate::job_error::JobError;
use crate::stock_file::ReadStock;

/// Rays along the longest side of the stock, where nothing finer is asked for.
const USUAL_RAYS: f64 = 400.0;
/// Rays along the longest side at most.
const MOST_RAYS: f64 = 2000.0;
/// Chords deviate from moves by so many pitches at most,
const CHORD_PITCHES: f64 = 0.1;
/// and by so many millimetres: what a picture shows as left is more than scallop heights.
const MOST_CHORD_MM: f64 = 0.05;
/// Faces are within this share of a layer's thickness of their triangles.
const LAYER_DEVIATION: f64 = 0.004;
/// Levels know outlines of stock to a share of the rays' distance, which is to be small in their band: rays are no farther apart than
/// this many bands.
const BANDS: f64 = 1.4;
/// A shank is slimmer than its tool by so many rays' distances at least, that it is seen to go where the tool has been.
const PITCHES_SLIMMER: f64 = 5.0;
/// A curve whose points differ less in height is level, mm.
const LEVEL_MM: f64 = 1e-7;
/// Moves are cut so many at a time.
const BATCH: usize = 20_000;

/// The stock of a job after some of its operations.
#[derive(Debug, Clone)]
pub struct InProcessStock {
    stock: Arc<Stock>,
    chord_mm: f64,
}

impl InProcessStock {
    /// How far apart rays may be for operations, of which each has stock above which it cuts, or levels; `None` where none asks.
    pub(crate) fn largest_pitch_mm(
        operations: impl Iterator<Item = (Option<f64>, Option<Levels>)>,
    ) -> Option<f64> {
        let asked = |(rest_above_mm, levels): (Option<f64>, Option<Levels>)| {
            [rest_above_mm, levels.map(|levels| BANDS * levels.band_mm)]
        };
        operations.flat_map(asked).flatten().reduce(f64::min)
    }

    /// How far apart rays may be to tell that a slim shank follows its tool; `None` for one that is no slimmer.
    pub(crate) fn shank_pitch_mm(tool: &Tool) -> Option<f64> {
        let slimmer_mm = tool.radius_mm() - tool.shank_radius_mm();
        (slimmer_mm > 0.0).then_some(slimmer_mm / PITCHES_SLIMMER)
    }

    /// The stock of a job before its first operation, on rays that are no farther apart than told, within limits of memory.
    ///
    /// # Errors
    /// It is empty, or too far out.
    pub(crate) fn new(
        stock: &ReadStock,
        model: &Model,
        largest_pitch_mm: Option<f64>,
    ) -> Result<Self, Error> {
        let record = &stock.record;
        let bounds = match *record {
            StockRecord::Layer { thickness_mm } => {
                let faces = model.faces.iter().fold(Aabb::empty(), |all, face| all.union(&face.bounds()));
                faces.inflated(1.01 * thickness_mm)
            }
            StockRecord::Block { .. } | StockRecord::Bar { .. } | StockRecord::File(_) => {
                Aabb::of_corners(record.box_mm().unwrap_or_default())
            }
        };
        let longest_mm = (bounds.max - bounds.min).amax();
        let usual_mm = longest_mm / USUAL_RAYS;
        let pitch_mm = largest_pitch_mm.map_or(usual_mm, |mm| mm.min(usual_mm)).max(longest_mm / MOST_RAYS);
        let grid = match Grid::over(&bounds, pitch_mm) {
            Err(StockError::TooFine { fitting_mm, .. }) => Grid::over(&bounds, fitting_mm)?,
            other => other?,
        };
        let stock = match *record {
            StockRecord::File(_) => match &stock.solid {
                Some(solid) => Stock::solid(grid, &solid.points, &solid.triangles)?,
                None => return Err(StockError::Empty { pitch_mm: grid.pitch_mm() }.into()),
            },
            StockRecord::Block { .. } => Stock::block_in(grid, &bounds)?,
            StockRecord::Bar { from_mm, to_mm, diameter_mm } => {
                let along = record.bar_axis().ok_or(JobError::Bar { from_mm, to_mm })?;
                let length_mm = to_mm[along] - from_mm[along];
                Stock::cylinder_in(grid, Family::ALL[along], from_mm.into(), 0.5 * diameter_mm, length_mm)?
            }
            StockRecord::Layer { thickness_mm } => {
                let mesh = ModelMesh::of(model, LAYER_DEVIATION * thickness_mm);
                Stock::layer(grid, &mesh.points, &mesh.triangles, thickness_mm)?
            }
        };
        let chord_mm = (CHORD_PITCHES * grid.pitch_mm()).min(MOST_CHORD_MM);
        Ok(InProcessStock { stock: Arc::new(stock), chord_mm })
    }

    /// The stock of a job before its first operation, and after each, from its moves; nothing of a job without stock. What the
    /// job names is found from its folder. Rays are no farther apart than `pitch_mm`, within limits of memory.
    ///
    /// # Errors
    /// The stock is empty or too far out, a move is no curve, or the monitor ends it.
    pub fn states_of(
        model: &Model,
        (job, folder): (&JobRecord, &Path),
        program: &Program,
        pitch_mm: Option<f64>,
        monitor: &dyn Monitor,
    ) -> Result<Vec<Self>, Error> {
        let Some(record) = &job.stock else { return Ok(Vec::new()) };
        let stock = ReadStock::of(record, folder)?;
        let asked = job.operations.iter().map(|o| (o.request.rest_above_mm, o.request.levels));
        let largest_mm = Self::largest_pitch_mm(asked.chain([(pitch_mm, None)]));
        let mut state = InProcessStock::new(&stock, model, largest_mm)?;
        let mut states = vec![state.clone()];
        for (index, operation) in job.operations.iter().enumerate() {
            if let Some(tool) = job.tools.iter().find(|tool| tool.id == operation.tool) {
                state.cut(&program.of_operation(index), &tool.tool, monitor)?;
            }
            states.push(state.clone());
        }
        Ok(states)
    }

    /// Takes away what the moves of an operation cut. Rapids cut nothing.
    ///
    /// # Errors
    /// A move is no curve, or the monitor ends it.
    pub(crate) fn cut(&mut self, program: &Program, tool: &Tool, monitor: &dyn Monitor) -> Result<(), Error> {
        let bodies = Bodies::of(tool, self.chord_mm)?;
        let stock = Arc::make_mut(&mut self.stock);
        let cutting: Vec<_> = program.moves.iter().filter(|m| m.kind != MoveKind::Rapid).collect();
        for (k, batch) in cutting.chunks(BATCH).enumerate() {
            monitor.go_on().map_err(Error::Cancelled)?;
            monitor.at(Stage::Stock, (k * BATCH) as f64 / cutting.len() as f64);
            let sweeps = batch
                .par_iter()
                .map(|m| Chords::of_move(m, self.chord_mm)?.sweeps(bodies.along(m), m.axis_start.into()));
            let sweeps: Vec<Sweep<'_>> = sweeps.collect::<Result<Vec<_>, _>>()?.concat();
            stock.cut_all(&sweeps);
        }
        Ok(())
    }

    /// The material.
    #[must_use]
    pub fn stock(&self) -> &Arc<Stock> {
        &self.stock
    }

    /// Its surface for a picture.
    ///
    /// # Errors
    /// It has too many vertices.
    pub fn surface(&self) -> Result<SurfaceMesh, Error> {
        // Finer than the usual rays no picture needs it.
        let counts = self.stock.grid().cells();
        let most = counts.iter().copied().max().unwrap_or(1);
        Ok(self.stock.surface((f64::from(most) / USUAL_RAYS).floor().max(1.0) as u32)?)
    }

    /// Its surface by all rays, as a closed mesh.
    ///
    /// # Errors
    /// It has too many vertices.
    pub fn closed_surface(&self) -> Result<SurfaceMesh, Error> {
        Ok(self.stock.surface(1)?)
    }

    /// How much there is, mm³.
    #[must_use]
    pub fn volume_mm3(&self) -> f64 {
        self.stock.volume().best_mm3()
    }
}

/// What a tool cuts for certain where chords stand for its curves.
struct Bodies {
    whole: ToolBody,
    /// Where curves stay at one height: what is level is cut to its height.
    narrower: Option<ToolBody>,
    smaller: ToolBody,
}

impl Bodies {
    fn of(tool: &Tool, chord_mm: f64) -> Result<Self, StockError> {
        let whole = ToolBody::cutting(tool)?;
        Ok(Bodies { narrower: whole.narrowed(chord_mm), smaller: whole.offset(-chord_mm)?, whole })
    }

    fn along(&self, m: &Move) -> &ToolBody {
        let axis = Vector3::from(m.axis_start);
        let height = |p: &[f64; 3]| Vector3::from(*p).dot(&axis);
        let is_level = || {
            let first = height(&m.points[0]);
            m.points.iter().all(|p| (height(p) - first).abs() < LEVEL_MM)
        };
        match &self.narrower {
            _ if m.points.len() == 2 => &self.whole,
            Some(narrower) if is_level() => narrower,
            _ => &self.smaller,
        }
    }
}
