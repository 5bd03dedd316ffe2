//! A job of several operations: planned one after the other on the same regions, written as one program, verified as one job.

use std::path::Path;

use claymill_clearing::ClearingError;
use claymill_paths::{InProcess, PlanOptions};
use claymill_toolpath::{
    FilePlace, FolderWriter, Holder, Job as JobRecord, LATEST_FORMAT_VERSION, Monitor, Operation,
    OperationKind, Program, Setup, Stock, Tool, Totals,
};

use crate::error::Error;
use crate::in_process::InProcessStock;
use crate::job::Job;
use crate::job_error::JobError;
use crate::job_record::job_record;
use crate::planned::Planned;
use crate::prepared::Prepared;
use crate::stock_file::ReadStock;
use crate::verified::Verified;

/// Most operations of a job.
const MOST_OPERATIONS: usize = 64;

/// One operation as it is asked for.
#[derive(Debug, Clone)]
pub struct OperationJob {
    /// Its name in the job: no two have the same one.
    pub name: String,
    /// What it is for.
    pub kind: OperationKind,
    /// Why it is there, in one sentence.
    pub reason: String,
    /// Tool, allowance and passes. Every tool has a number of its own.
    pub job: Job,
}

/// Operations that are planned and not verified yet. There is no way from them to a file but through
/// [`PlannedOperations::verify_into`].
#[derive(Debug)]
pub struct PlannedOperations<'m> {
    stock: Option<Stock>,
    /// Before the first operation, and after each; empty without a stock.
    states: Vec<InProcessStock>,
    planned: Vec<(OperationJob, Planned<'m>)>,
}

impl<'m> PlannedOperations<'m> {
    /// Plans operations one after the other, on the regions that were found for a job on this model, mostly that of the operation
    /// that finishes the surface; `planned` is told of each one. An operation for which there is nothing to do is left out, if it is
    /// not the only one. The stock is followed: an operation may ask what those before it left.
    ///
    /// # Errors
    /// There are none or too many, two have one name or different tools one number, or one cannot be planned.
    pub fn new(
        regions: &Prepared<'m>,
        record: Option<Stock>,
        operations: &[OperationJob],
        monitor: &dyn Monitor,
        mut planned: impl FnMut(&OperationJob, Result<&Planned<'m>, &Error>),
    ) -> Result<Self, Error> {
        check(operations)?;
        let (mut done, mut nothing) = (Vec::new(), None);
        let asked = operations.iter().map(|o| (o.job.passes.rest_above_mm, o.job.levels));
        let slim = operations.iter().filter_map(|o| InProcessStock::shank_pitch_mm(&o.job.passes.tool));
        let largest_mm = InProcessStock::largest_pitch_mm(asked).into_iter().chain(slim).reduce(f64::min);
        // No folder is there yet: paths are as they were given.
        let stock = record.map(|record| ReadStock::of(&record, Path::new(""))).transpose()?;
        let begin = |stock: &ReadStock| InProcessStock::new(stock, regions.file.model(), largest_mm);
        let mut states: Vec<InProcessStock> = stock.as_ref().map(begin).transpose()?.into_iter().collect();
        let lack = stock.as_ref().and_then(|stock| stock.lack(regions.file.model()));
        let record = stock.map(|stock| stock.record);
        for operation in operations {
            let mut prepared = regions.again(&operation.job)?;
            let PlanOptions { tool, allowance_mm, .. } = prepared.options;
            let holder = prepared.options.holder.clone();
            prepared.options.rest_holder = holder_before(&done, prepared.options.rest_of);
            let stock = states.last().map(|state| state.stock().clone());
            prepared.options.in_process = stock.map(|stock| InProcess { stock, tool, holder, allowance_mm });
            let followed = record.as_ref().zip(states.last());
            let plan = match (operation.job.levels, followed) {
                (Some(levels), Some(of)) => prepared.plan_by_levels(levels, of, states.len() == 1, monitor),
                _ => prepared.plan(monitor),
            };
            match plan {
                Ok(mut plan) => {
                    plan.plan.notes.extend(lack.clone().filter(|_| done.is_empty()));
                    if let Some(mut state) = states.last().cloned() {
                        state.cut(&plan.plan.program, operation.job.tool(), monitor)?;
                        states.push(state);
                    }
                    planned(operation, Ok(&plan));
                    done.push((operation.clone(), plan));
                }
                Err(error) if is_idle(&error) => {
                    planned(operation, Err(&error));
                    nothing = Some(error);
                }
                Err(error) => return Err(error),
            }
        }
        match nothing {
            Some(error) if done.is_empty() => Err(error),
            _ => Ok(PlannedOperations { stock: record, states, planned: done }),
        }
    }

    /// The stock before the first operation, and after each; nothing without a stock.
    #[must_use]
    pub fn states(&self) -> &[InProcessStock] {
        &self.states
    }

    /// The operations that do something, in machining order.
    pub fn iter(&self) -> impl Iterator<Item = (&OperationJob, &Planned<'m>)> {
        self.planned.iter().map(|(operation, plan)| (operation, plan))
    }

    /// Writes the moves of all operations, one after the other, reads them back, and measures what was read against the model.
    ///
    /// # Errors
    /// As [`Planned::verify_into`].
    pub fn verify_into(self, folder: FolderWriter, monitor: &dyn Monitor) -> Result<Verified<'m>, Error> {
        let main = self.main();
        let records: Vec<JobRecord> =
            self.planned.iter().map(|(_, plan)| job_record(plan, folder.destination())).collect();
        let job = JobRecord { stock: self.stock_in(folder.destination()), ..self.record(&records, main) };
        let (mut program, mut seconds) = (Program::default(), Vec::new());
        let mut prepared: Option<Prepared<'m>> = None;
        for (op, (_, Planned { prepared: own, plan })) in self.planned.into_iter().enumerate() {
            for mut m in plan.program.moves {
                m.seq = program.moves.len() as u64;
                m.op = Some(op as u32);
                program.moves.push(m);
            }
            seconds.extend(plan.seconds);
            if op == main {
                prepared = Some(own);
            }
        }
        folder.moves(&program)?;
        drop(program);
        let prepared = prepared.ok_or(JobError::Operations { most: MOST_OPERATIONS })?;
        Verified::of_record(prepared, job, seconds, folder, monitor)
    }

    /// The stock as a job folder refers to it.
    fn stock_in(&self, folder: &Path) -> Option<Stock> {
        let mut stock = self.stock.clone();
        if let Some(Stock::File(file)) = &mut stock {
            file.place = Some(FilePlace::of(Path::new(&file.path), folder));
        }
        stock
    }

    fn main(&self) -> usize {
        OperationKind::main_of(self.planned.iter().map(|(operation, _)| operation.kind)).unwrap_or(0)
    }

    /// The record of all operations, of which `main` finishes the surface.
    fn record(&self, records: &[JobRecord], main: usize) -> JobRecord {
        let operation = |((operation, _), record): (&(OperationJob, Planned<'_>), &JobRecord)| Operation {
            name: operation.name.clone(),
            kind: operation.kind,
            reason: operation.reason.clone(),
            tool: operation.job.tool_id(),
            request: record.request.clone(),
            tolerances: record.tolerances.clone(),
            setups: record.setups.clone(),
            regions: record.regions.clone(),
            totals: record.totals,
            area: record.area.clone(),
            faces: record.faces.clone(),
        };
        let mut tools = Vec::new();
        for tool in records.iter().flat_map(|record| &record.tools) {
            if !tools.contains(tool) {
                tools.push(tool.clone());
            }
        }
        let mut totals = Totals::default();
        records.iter().for_each(|record| totals += record.totals);
        JobRecord {
            format_version: LATEST_FORMAT_VERSION,
            tools,
            setups: together(records.iter().flat_map(|record| &record.setups)),
            totals,
            operations: self.planned.iter().zip(records).map(operation).collect(),
            ..records[main].clone()
        }
    }
}

/// What held a tool in the last one of operations that are done.
fn holder_before(done: &[(OperationJob, Planned<'_>)], tool: Option<Tool>) -> Option<Holder> {
    let last = done.iter().rev().find(|(operation, _)| Some(*operation.job.tool()) == tool);
    last.and_then(|(operation, _)| operation.job.holder_in_the_way().cloned())
}

/// Setups of all operations: of one name the highest clearance, the largest area and all of the time.
fn together<'a>(setups: impl Iterator<Item = &'a Setup>) -> Vec<Setup> {
    let mut all: Vec<Setup> = Vec::new();
    for setup in setups {
        match all.iter_mut().find(|known| known.name == setup.name) {
            Some(known) => {
                known.clearance_mm = known.clearance_mm.max(setup.clearance_mm);
                known.area_mm2 = known.area_mm2.max(setup.area_mm2);
                known.time_s += setup.time_s;
            }
            None => all.push(setup.clone()),
        }
    }
    all
}

/// Whether an operation has nothing to do, which is no fault.
fn is_idle(error: &Error) -> bool {
    use claymill_paths::PlanError;
    let is_done = matches!(error, Error::Plan(PlanError::NothingToCut | PlanError::NoRest));
    is_done || matches!(error, Error::Clearing(ClearingError::NoRoom { .. }))
}

fn check(operations: &[OperationJob]) -> Result<(), Error> {
    if operations.is_empty() || operations.len() > MOST_OPERATIONS {
        return Err(JobError::Operations { most: MOST_OPERATIONS }.into());
    }
    for (k, operation) in operations.iter().enumerate() {
        let before = &operations[..k];
        if before.iter().any(|o| o.name == operation.name) {
            return Err(JobError::TwiceNamed { name: operation.name.clone() }.into());
        }
        let (id, tool) = (operation.job.tool_id(), operation.job.tool());
        if before.iter().any(|o| o.job.tool_id() == id && o.job.tool() != tool) {
            return Err(JobError::OneNumber { id, name: operation.name.clone() }.into());
        }
    }
    Ok(())
}
