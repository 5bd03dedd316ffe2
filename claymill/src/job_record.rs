//! `job.json` of a plan: what was asked for, what was planned, totals.

use std::collections::BTreeMap;
use std::path::Path;

use claymill_toolpath::{
    AskedSetup, FORMAT_VERSION, FilePlace, Job, ModelFacts, Obstacle, Request, Skipped, ToolRecord,
};

use crate::planned::Planned;
use crate::record::name;

/// The record of a plan whose folder will be `out`.
pub(crate) fn job_record(planned: &Planned<'_>, out: &Path) -> Job {
    let plan = &planned.plan;
    Job {
        format_version: FORMAT_VERSION,
        claymill_version: env!("CARGO_PKG_VERSION").to_owned(),
        model: model_facts(planned, out),
        request: request(planned, out),
        tolerances: plan.tolerances.clone(),
        tools: vec![ToolRecord {
            id: planned.prepared.job.tool_id(),
            tool: *planned.prepared.job.tool(),
            holder: planned.prepared.job.holder.clone(),
            setup_stick_out_mm: BTreeMap::new(),
        }],
        setups: plan.setups.clone(),
        regions: plan.regions.clone(),
        totals: plan.totals,
        area: plan.area.clone(),
        faces: plan.faces.clone(),
        left_out: planned.left_out(),
        stock: None,
        operations: Vec::new(),
        timings: Vec::new(),
        peak_memory_mb: 0.0,
    }
}

fn model_facts(planned: &Planned<'_>, out: &Path) -> ModelFacts {
    let file = planned.prepared.file;
    let report = &file.import.report;
    let skipped =
        |s: &claymill_exchange::Skipped| Skipped { entity: s.entity.clone(), reason: s.reason.clone() };
    ModelFacts {
        path: file.path.display().to_string(),
        place: Some(FilePlace::of(&file.path, out)),
        sha256: planned.prepared.model_sha256.clone(),
        units: report.units.declared.clone(),
        unit_mm: report.units.mm_per_unit,
        faces_in_file: report.faces_in_file,
        faces_read: report.faces_read,
        mirror: file.mirror,
        skipped: report.skipped.iter().map(skipped).collect(),
        area_mm2: file.face_area_mm2.iter().sum(),
        box_mm: file.bounds.corners(),
    }
}

fn request(planned: &Planned<'_>, out: &Path) -> Request {
    let (job, options) = (&planned.prepared.job, &planned.prepared.options);
    let obstacles = planned.prepared.obstacles.iter().map(|o| Obstacle {
        path: o.path.display().to_string(),
        place: Some(FilePlace::of(&o.path, out)),
        sha256: o.sha256.clone(),
        unit_mm: job.obstacle_unit_mm,
    });
    Request {
        tool: options.tool,
        rest_of: options.rest_of,
        allowance_mm: options.allowance_mm,
        rest_above_mm: options.rest_above_mm,
        stock_above_mm: options.stock_above_mm,
        levels: job.levels,
        lines: options.lines,
        guides: options.guides.iter().map(|at| (*at).into()).collect(),
        pencil: options.pencil,
        scallop_mm: options.scallop_mm,
        strategy: options.strategy.to_string(),
        link: options.link,
        preset: name(&job.merging.options.preset),
        up: options.orientation.up.to_string(),
        length: options.orientation.front.to_string(),
        setups: (options.setups.iter())
            .map(|f| AskedSetup { name: f.name.to_string(), axis: f.axis().into() })
            .collect(),
        only: job.only.clone(),
        skip: job.skip.clone(),
        material_side: job.material_side.clone(),
        bounds: options.bounds.clone(),
        check: obstacles.collect(),
        check_clearance_mm: if job.obstacles.is_empty() { 0.0 } else { options.check_clearance_mm },
        holder_clearance_mm: job.holder_clearance_mm,
        feed_mm_per_min: options.feeds.cut_mm_per_min,
        lead_mm_per_min: Some(options.feeds.lead_mm_per_min),
        rapid_mm_per_min: options.feeds.rapid_mm_per_min,
        machine: options.machine.clone(),
    }
}
