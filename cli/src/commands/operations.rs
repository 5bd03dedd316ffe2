//! `claymill plan` of a job with several operations: from a job file, in the order that it has them.

use std::path::Path;

use claymill::{OperationJob, OperationKind, PlannedOperations, Stock};
use claymill_toolpath::{FolderWriter, LONGEST_WRITTEN, read_plain_text};
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::job_file::JOB_TOML;
use super::plan::{Done, finish};
use super::request::Request;
use super::{Context, plan_summary, say_axes};
use crate::args::{JobOptions, PlanArgs};
use crate::failure::{Failure, advice_on};
use crate::interrupt;

/// The key of a job file that holds its operations.
const OPERATIONS: &str = "operations";
const ADVICE: &str = "docs/operations.md describes job files with operations.";

/// A job of operations as its file has it.
#[derive(Debug, Clone, Default)]
pub(super) struct OperationsFile {
    /// What the model is cut from.
    pub(super) stock: Option<Stock>,
    /// In machining order.
    pub(super) operations: Vec<OperationOptions>,
}

/// One operation: what it is for, and the options of a job.
#[derive(Debug, Clone)]
pub(super) struct OperationOptions {
    pub(super) head: Head,
    pub(super) options: JobOptions,
}

/// What an operation has beside the options of a job.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Head {
    pub(super) name: String,
    pub(super) kind: OperationKind,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub(super) reason: String,
}

/// The job of operations that is asked for, if it is one.
pub(super) fn asked(args: &PlanArgs) -> Result<Option<OperationsFile>, Failure> {
    let Some(file) = args.job_file.as_deref() else { return Ok(None) };
    let text = read_plain_text(file, LONGEST_WRITTEN)
        .map_err(|e| Failure::problem(format!("{}: {e}", file.display()), advice_on(&e)))?;
    // What is no TOML is told by whoever reads the options.
    let Ok(table) = text.parse::<Table>() else { return Ok(None) };
    if !table.contains_key(OPERATIONS) {
        return Ok(None);
    }
    let in_file = |what: String| Failure::problem(format!("{}: {what}", file.display()), ADVICE);
    parsed(table, &args.job.options()).map(Some).map_err(in_file)
}

/// Options that stand before the operations are those of all of them; those of the command line go before both.
fn parsed(mut table: Table, first: &JobOptions) -> Result<OperationsFile, String> {
    let stock = table.remove("stock").map(Value::try_into::<Stock>).transpose();
    let stock = stock.map_err(|e| format!("stock: {}", e.message()))?;
    let Some(Value::Array(operations)) = table.remove(OPERATIONS) else {
        return Err("operations are tables: [[operations]]".into());
    };
    let mut parsed = OperationsFile { stock, operations: Vec::new() };
    for (index, value) in operations.into_iter().enumerate() {
        let Value::Table(mut own) = value else {
            return Err(format!("operation {} is not a table", index + 1));
        };
        let named =
            own.get("name").and_then(Value::as_str).map_or_else(|| (index + 1).to_string(), str::to_owned);
        let wrong = |e: toml::de::Error| format!("operation {named}: {}", e.message());
        let head: Table =
            ["name", "kind", "reason"].into_iter().filter_map(|key| own.remove_entry(key)).collect();
        let head = Value::Table(head).try_into::<Head>().map_err(wrong)?;
        for (key, value) in &table {
            own.entry(key.clone()).or_insert_with(|| value.clone());
        }
        let options = Value::Table(own).try_into::<JobOptions>().map_err(wrong)?;
        let options = super::job_file::over(first.clone(), options);
        parsed.operations.push(OperationOptions { head, options });
    }
    Ok(parsed)
}

/// A job file with these operations.
pub(super) fn text(job: &OperationsFile) -> Result<String, Failure> {
    let failed = |e: toml::ser::Error| {
        Failure::problem(format!("the job cannot be written as TOML: {e}"), "Please report it.")
    };
    let mut all = Table::new();
    if let Some(stock) = &job.stock {
        all.insert("stock".into(), Value::try_from(stock).map_err(failed)?);
    }
    let mut tables = Vec::new();
    for operation in &job.operations {
        let mut table = Table::try_from(&operation.head).map_err(failed)?;
        table.extend(Table::try_from(&operation.options).map_err(failed)?);
        tables.push(Value::Table(table));
    }
    all.insert(OPERATIONS.into(), Value::Array(tables));
    toml::to_string(&all).map_err(failed)
}

/// Plans all operations, verifies them as one job, and puts its folder into place.
pub(super) fn run(
    context: &Context,
    model: &Path,
    job: &OperationsFile,
    out: &Path,
) -> Result<Done, Failure> {
    let console = context.console;
    let mut operations = Vec::new();
    for OperationOptions { head, options } in &job.operations {
        let request = Request::new(model, options)?;
        operations.push(OperationJob {
            name: head.name.clone(),
            kind: head.kind,
            reason: head.reason.clone(),
            job: request.job,
        });
    }
    let folder = FolderWriter::begin(out)?;
    folder.leftovers().into_iter().for_each(interrupt::remove_on_interrupt);
    let loaded = context.load(model)?;

    console.stage("planning");
    let told = |operation: &OperationJob, plan: Result<&claymill::Planned<'_>, &claymill::Error>| {
        let tool = operation.job.tool();
        let allowance_mm = operation.job.passes.allowance_mm;
        console.say(format!(
            "operation {} ({}): {tool}, allowance {allowance_mm} mm, {}",
            operation.name, operation.kind, operation.job.passes.strategy
        ));
        if !operation.reason.is_empty() {
            console.say_long("", &operation.reason);
        }
        match plan {
            Ok(plan) => plan_summary::say_plan(console, plan.plan()),
            Err(error) => console.say_long("", &format!("left out: {error}")),
        }
    };
    let planned = PlannedOperations::new(&loaded, job.stock.clone(), &operations, console, told)?;
    if let Some((_, plan)) = planned.iter().next() {
        say_axes(console, &job.operations[0].options.axes, plan.orientation());
    }

    console.stage("writing");
    folder.text(JOB_TOML, &text(job)?)?;

    console.stage("verifying");
    let verified = planned.verify_into(folder, console)?;
    finish(context, verified, out)
}
