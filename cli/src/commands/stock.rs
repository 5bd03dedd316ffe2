//! `claymill stock`: how much of the stock each operation of a job leaves, and what is left as a closed mesh.

use std::process::ExitCode;

use claymill::InProcessStock;
use claymill_exchange::stl_bytes;
use claymill_toolpath::{Kind, read_job, read_moves};
use serde::Serialize;

use super::Context;
use crate::args::StockArgs;
use crate::console::outln;
use crate::failure::Failure;
use crate::output;

/// Cubic millimetres in a litre.
const LITRE_MM3: f64 = 1e6;

/// The stock between two operations.
#[derive(Serialize)]
struct State<'j> {
    /// The operation before; `null` before the first one.
    after: Option<&'j str>,
    volume_mm3: f64,
    removed_mm3: f64,
}

/// `claymill stock`.
pub(crate) fn stock(context: &Context, args: &StockArgs) -> Result<ExitCode, Failure> {
    let folder = &args.folder;
    let job = read_job(folder)?;
    if job.stock.is_none() {
        return Err(Failure::problem(
            format!("{}: the job knows of no stock", folder.display()),
            "Plan it with --material and --stock, or with a [stock] in its job file.",
        ));
    }
    let names: Vec<&str> = job.operations.iter().map(|o| o.name.as_str()).collect();
    let chosen = match &args.after {
        None => names.len(),
        Some(name) => {
            1 + names.iter().position(|n| n == name).ok_or_else(|| {
                Failure::usage(
                    format!("--after {name}: the job has no such operation"),
                    format!("Its operations are {}.", names.join(", ")),
                )
            })?
        }
    };
    if let Some(mm) = args.pitch.filter(|mm| !(*mm > 0.0 && mm.is_finite())) {
        return Err(Failure::usage(format!("--pitch {mm} is no distance"), "For example: --pitch 0.5."));
    }
    let inputs = output::inputs(folder, Some(&job), args.model.as_deref());
    let out = args.out.as_deref().map(|out| output::begin_beside_text(context, out, Kind::Model, &inputs));
    let out = out.transpose()?;
    let loaded = context.load_of_job(folder, &job, args.model.as_deref())?;
    let program = read_moves(folder)?;
    context.console.stage("stock");
    let states =
        InProcessStock::states_of(loaded.model(), (&job, folder), &program, args.pitch, context.console)?;
    if let (Some(out), Some(state)) = (out, states.get(chosen)) {
        let surface = state.closed_surface()?;
        output::write(out, Kind::Model, &stl_bytes(&surface.points_mm, &surface.triangles))?;
    }
    context.console.finish();
    let mut before_mm3 = states.first().map_or(0.0, InProcessStock::volume_mm3);
    let names = std::iter::once(None).chain(names.iter().map(|name| Some(*name)));
    let state = |(after, state): (_, &InProcessStock)| {
        let volume_mm3 = state.volume_mm3();
        let removed_mm3 = std::mem::replace(&mut before_mm3, volume_mm3) - volume_mm3;
        State { after, volume_mm3, removed_mm3 }
    };
    let table: Vec<State<'_>> = names.zip(&states).map(state).collect();
    if context.json {
        context.print_json(&table)?;
        return Ok(ExitCode::SUCCESS);
    }
    outln!("{:<24} {:>12} {:>12}", "after", "left, l", "removed, l");
    for State { after, volume_mm3, removed_mm3 } in &table {
        let [left, removed] = [volume_mm3, removed_mm3].map(|mm3| mm3 / LITRE_MM3);
        outln!("{:<24} {left:>12.3} {removed:>12.3}", after.unwrap_or("(before the first)"));
    }
    Ok(ExitCode::SUCCESS)
}
