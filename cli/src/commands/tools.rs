//! `claymill tools`: the tools of a library as a table, as JSON and as a drawing, with what is wrong with them.

use std::path::Path;
use std::process::ExitCode;

use claymill_tooling::{
    CheckAgainst, Finding, LengthUnit, Library, LibraryTool, MachineShape, Profiles, ReadOptions, Severity,
    check_library, library_svg, library_table, read_library,
};
use claymill_toolpath::{End, HolderSection, Kind};
use serde::Serialize;

use super::Context;
use crate::args::{TableUnit, ToolsArgs};
use crate::console::{counted, outln};
use crate::failure::{Failure, NOT_PASSED};
use crate::output;

/// A library as `--json` prints it.
#[derive(Debug, Serialize)]
struct Listing {
    library: String,
    tools: Vec<Line>,
    skipped: Vec<Skipped>,
    notes: Vec<String>,
    findings: Vec<Found>,
}

/// A tool of the list.
#[derive(Debug, Serialize)]
struct Line {
    number: Option<u32>,
    id: String,
    name: String,
    end: &'static str,
    /// As `--tool` takes it.
    tool: String,
    diameter_mm: f64,
    corner_mm: f64,
    flutes: Option<u32>,
    flute_length_mm: Option<f64>,
    stick_out_mm: Option<f64>,
    holder: Option<Vec<HolderSection>>,
    in_spindle_mm: Option<f64>,
    materials: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Skipped {
    tool: String,
    reason: String,
}

#[derive(Debug, Serialize)]
struct Found {
    tool: String,
    severity: &'static str,
    what: String,
    remedy: String,
}

/// `claymill tools`.
pub(crate) fn tools(context: &Context, args: &ToolsArgs) -> Result<ExitCode, Failure> {
    let mut listing = Listing {
        library: String::new(),
        tools: Vec::new(),
        skipped: Vec::new(),
        notes: Vec::new(),
        findings: Vec::new(),
    };
    let library = match &args.library {
        Some(file) => read(file, args.table_unit, &mut listing)?,
        None => Library::shipped(),
    };
    let machine = args.machine.as_deref().map(MachineShape::read).transpose()?.map(|(machine, notes)| {
        listing.notes.extend(notes);
        machine
    });
    let mut profiles = Profiles::shipped();
    let material = match args.material.as_deref() {
        Some(file) if file.ends_with(".toml") => Some(profiles.add_file(Path::new(file))?),
        named => named.map(str::to_owned),
    };
    let material = material.map(|name| {
        profiles.material(&name).ok_or_else(|| {
            Failure::usage(
                format!("no material is named `{name}`"),
                "Shipped are clay, foam and aluminium; others come from a file, for example --material oak.toml.",
            )
        })
    });
    let against = CheckAgainst { machine: machine.as_ref(), material: material.transpose()?, depth_mm: None };
    let findings = check_library(&library, &against);
    listing.library.clone_from(&library.name);
    listing.tools = library.tools.iter().map(line).collect();
    if let Some(svg) = &args.svg {
        let inputs: Vec<_> = args.library.iter().chain(&args.machine).cloned().collect();
        output::make_parent(svg)?;
        let out = output::begin_beside_text(context, svg, Kind::Picture, &inputs)?;
        output::write(out, Kind::Picture, library_svg(&library).as_bytes())?;
        context.console.say(svg.display());
    }
    listing.findings = findings.iter().map(found).collect();
    if context.json {
        context.print_json(&listing)?;
    } else {
        say(context, &library, &listing);
    }
    let is_usable = findings.iter().all(|f| f.severity != Severity::Error);
    Ok(if is_usable { ExitCode::SUCCESS } else { ExitCode::from(NOT_PASSED) })
}

fn read(file: &Path, unit: TableUnit, listing: &mut Listing) -> Result<Library, Failure> {
    let table_unit = if unit == TableUnit::Mm { LengthUnit::Mm } else { LengthUnit::Inch };
    let reading = read_library(file, &ReadOptions { table_unit })?;
    listing.notes = reading.notes;
    let skipped = reading.skipped.into_iter();
    listing.skipped = skipped.map(|s| Skipped { tool: s.tool, reason: s.reason }).collect();
    Ok(reading.library)
}

fn line(tool: &LibraryTool) -> Line {
    Line {
        number: tool.number,
        id: tool.id.clone(),
        name: tool.name.clone(),
        end: match tool.tool.end {
            End::Ball { .. } => "ball",
            End::Flat { .. } => "flat",
            End::Bull { .. } => "bull",
        },
        tool: tool.tool.to_string(),
        diameter_mm: tool.diameter_mm(),
        corner_mm: tool.tool.corner_radius_mm(),
        flutes: tool.flutes,
        flute_length_mm: tool.flute_length_mm,
        stick_out_mm: tool.stick_out_mm,
        holder: tool.holder.as_ref().map(|h| h.sections.clone()),
        in_spindle_mm: tool.length_in_spindle_mm(),
        materials: tool.cutting.keys().cloned().collect(),
    }
}

fn found(finding: &Finding) -> Found {
    let severity = match finding.severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
    };
    Found { tool: finding.tool.clone(), severity, what: finding.what.clone(), remedy: finding.remedy.clone() }
}

fn say(context: &Context, library: &Library, listing: &Listing) {
    outln!("{}", library_table(library).trim_end());
    for s in &listing.skipped {
        context.console.say_long("skipped", &format!("{}: {}", s.tool, s.reason));
    }
    for note in &listing.notes {
        context.console.say_long("note", note);
    }
    for f in &listing.findings {
        context
            .console
            .say_long(&format!("{}:", f.severity), &format!("{}: {}. {}", f.tool, f.what, f.remedy));
    }
    let skipped = match listing.skipped.len() {
        0 => String::new(),
        n => format!(", {n} skipped"),
    };
    context.console.say_long("library", &format!("{}{skipped}", counted(library.tools.len(), "tool")));
}
