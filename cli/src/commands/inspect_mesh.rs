//! `claymill inspect` of an obstacle mesh (STL, OBJ, glTF): size, unit and open edges. A mesh is
//! never a model to be cut.

use std::process::ExitCode;

use claymill_exchange::{MeshFormat, ObstacleMesh};
use serde::Serialize;

use super::Context;
use crate::args::InspectArgs;
use crate::console::outln;
use crate::failure::Failure;

/// What `claymill inspect --json` prints of a mesh.
#[derive(Debug, Serialize)]
struct MeshInspection<'a> {
    file: String,
    format: MeshFormat,
    triangles: usize,
    vertices: usize,
    area_mm2: f64,
    box_mm: [f64; 6],
    unit_mm: f64,
    open_edges: usize,
    crowded_edges: usize,
    without_area: usize,
    warnings: &'a [String],
}

/// Whether `claymill inspect` is asked about an obstacle.
pub(crate) fn is_mesh(args: &InspectArgs) -> bool {
    MeshFormat::of_file(&args.model).is_some()
}

/// `claymill inspect` of an STL, OBJ or glTF file.
pub(crate) fn inspect_mesh(context: &Context, args: &InspectArgs) -> Result<ExitCode, Failure> {
    context.console.stage("reading");
    let mesh = claymill_exchange::read_mesh(&args.model, args.mesh_unit)?;
    context.console.finish();
    let found = MeshInspection {
        file: args.model.display().to_string(),
        format: mesh.format,
        triangles: mesh.triangles.len(),
        vertices: mesh.vertices.len(),
        area_mm2: mesh.area_mm2(),
        box_mm: mesh.bounds().corners(),
        unit_mm: mesh.mm_per_unit,
        open_edges: mesh.open_edges(),
        crowded_edges: mesh.crowded_edges(),
        without_area: mesh.without_area,
        warnings: &mesh.warnings,
    };
    if context.json {
        context.print_json(&found)?;
    } else {
        print_mesh(&found, &mesh);
    }
    Ok(ExitCode::SUCCESS)
}

fn print_mesh(found: &MeshInspection, mesh: &ObstacleMesh) {
    let b = found.box_mm;
    outln!("{}", found.file);
    outln!("  format      {}: an obstacle, not a model to be cut", mesh.format.words());
    let source = if mesh.format.has_unit() { "declared by the format" } else { "see --mesh-unit" };
    outln!("  unit        {} mm ({source})", found.unit_mm);
    outln!("  triangles   {}, {} without area left out", found.triangles, found.without_area);
    outln!("  vertices    {}", found.vertices);
    outln!("  area        {:.4} m²", found.area_mm2 * 1e-6);
    outln!("  size        {:.1} x {:.1} x {:.1} mm", b[3] - b[0], b[4] - b[1], b[5] - b[2]);
    outln!("  from        {:.3} {:.3} {:.3}", b[0], b[1], b[2]);
    outln!("  to          {:.3} {:.3} {:.3}", b[3], b[4], b[5]);
    outln!("  open edges  {}, edges of more than two triangles {}", found.open_edges, found.crowded_edges);
    for warning in found.warnings {
        outln!("  warning     {warning}");
    }
}
