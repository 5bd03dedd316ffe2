//! `claymill demo`: the built-in vehicle, from the generated model to the finished job: rough, finish and rest out of a layer of clay.

use std::process::ExitCode;

use super::operations::{self, Source};
use super::request::Request;
use super::{Context, plan, sample};
use crate::args::{DemoArgs, ReuseArgs, StrategyName};
use crate::failure::{Failure, PROBLEM};

/// What the vehicle is milled in where nothing else is asked for.
const MATERIAL: &str = "clay";

/// `claymill demo`.
pub(crate) fn demo(context: &Context, args: &DemoArgs) -> Result<ExitCode, Failure> {
    let model = args.out.with_file_name("roadster.igs");
    context.console.stage("generating");
    let asked = sample::Asked {
        name: "roadster",
        patches: args.patches,
        seed: args.seed,
        scale: args.scale,
        flaws: &[],
        edit_mm: None,
    };
    let planted = sample::write(context, &asked, &model)?;
    let mut job = args.job.options();
    job.axes.up.get_or_insert_with(|| "+z".to_owned());
    job.axes.length.get_or_insert_with(|| "-x".to_owned());
    // A tool that is named makes one operation.
    let material = args.process.material.as_deref().or(job.tool.is_none().then_some(MATERIAL));
    let done = if let Some(material) = material {
        // Rows run over the whole vehicle, and are the quickest to plan.
        job.strategy.get_or_insert(StrategyName::Planar);
        let source = Source::for_material(material, &args.process, job)?;
        operations::run(context, &model, source, &args.out, &ReuseArgs::nowhere())?
    } else {
        plan::run(context, &Request::new(&model, &job)?, &args.out, &ReuseArgs::nowhere())?
    };

    let equal = same_partition(&done.region_of_face, &planted.answers.region_of_face);
    context.console.say(format!(
        "regions   {} found, {} planted: {}",
        done.region_of_face.iter().max().map_or(0, |m| m + 1),
        planted.answers.totals.regions,
        if equal { "the same partition" } else { "NOT the same partition" }
    ));
    Ok(if equal { done.exit } else { ExitCode::from(PROBLEM) })
}

/// Whether two numberings group the faces alike.
fn same_partition(a: &[usize], b: &[usize]) -> bool {
    let forth: std::collections::BTreeMap<_, _> = a.iter().zip(b).collect();
    let back: std::collections::BTreeMap<_, _> = b.iter().zip(a).collect();
    a.len() == b.len() && a.iter().zip(b).all(|(x, y)| forth[x] == y && back[y] == x)
}
