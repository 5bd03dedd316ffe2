//! One face: surface and bounds become a trimmed NURBS, still in the file's unit and place.

use std::collections::BTreeSet;

use claymill_nurbs::{Face, NurbsSurface, Source, SurfaceKind};

use super::edges::{EdgeUse, bound};
use super::part21::Part21;
use super::surfaces::{Read, carrier};
use super::{Context, StepError, bare};
use crate::chart::{Carrier, trimmed};
use crate::offset::OFFSET_MM;

/// A face and the gaps that were bridged in it, in file units.
pub(super) struct BuiltFace {
    pub(super) face: Face,
    pub(super) name: String,
    pub(super) bridged: Vec<f64>,
    /// How far the surface is from what the file describes, in file units.
    pub(super) deviation: f64,
    /// Loops that the face lists again.
    pub(super) repeated: usize,
}

/// Builds ADVANCED_FACE or FACE_SURFACE `#id`.
pub(super) fn build(file: &Part21, id: u64, context: &Context) -> Result<BuiltFace, StepError> {
    let entity = file.get(id)?;
    let record = match entity.part("ADVANCED_FACE") {
        Ok(record) => record,
        Err(_) => entity.part("FACE_SURFACE")?,
    };
    let (surface_id, sense) = (record.reference(2)?, record.flag(3)?);
    let bounds = record.references(1)?;
    if bounds.is_empty() && bare::is_surface(file.text(surface_id)) {
        let BuiltFace { face, bridged, deviation, .. } = bare::build(file, surface_id, context)?;
        let face = Face { reversed: !sense, ..face };
        return Ok(BuiltFace { face, name: record.text(0), bridged, deviation, repeated: 0 });
    }
    let listed = bounds.len();
    let mut seen = BTreeSet::new();
    let bounds = bounds.iter().filter(|b| seen.insert(**b)).map(|b| bound(file, *b, context));
    let mut bounds = bounds.collect::<Result<Vec<Vec<EdgeUse>>, _>>()?;
    let mut rounds = BTreeSet::new();
    bounds.retain(|uses| round(uses).is_none_or(|round| rounds.insert(round)));
    let repeated = listed - bounds.len();
    let extent: Vec<_> = bounds.iter().flatten().flat_map(EdgeUse::extent).collect();
    let Read { carrier, kind, deviation } =
        carrier(file, surface_id, context.angle_unit, &extent, OFFSET_MM / context.mm_per_unit)?;
    // Analytic carriers have parameters of their own, which pcurves of the file are not in.
    let flats_of = matches!(carrier, Carrier::Spline(_)).then_some(surface_id);
    let chart_edges = |uses: Vec<EdgeUse>| uses.into_iter().map(|e| e.on_surface(file, flats_of)).collect();
    let bounds: Vec<Vec<_>> = bounds.into_iter().map(chart_edges).collect();
    // A spline stays as the designer made it; patches of endless surfaces are cut to size.
    let uncut = kind == SurfaceKind::Nurbs;
    let patch =
        trimmed(&carrier, &bounds, sense, uncut, &context.limits).map_err(|e| StepError::of_chart(id, e))?;
    Ok(BuiltFace {
        face: Face {
            surface: patch.surface,
            loops: patch.loops,
            reversed: !sense,
            kind,
            source: Source::default(),
        },
        name: record.text(0),
        bridged: patch.bridged,
        deviation,
        repeated,
    })
}

/// The edges of a loop and which way it runs them, from the first of them on: the same for whichever edge the file
/// begins with. `None` where edges have no identity. A loop and its reverse differ: between them may be all of a torus.
fn round(uses: &[EdgeUse]) -> Option<Vec<(u64, bool)>> {
    let mut round = uses.iter().map(|e| Some((e.edge?, e.backward))).collect::<Option<Vec<_>>>()?;
    let first = (0..round.len()).min_by_key(|k| round[*k])?;
    round.rotate_left(first);
    Some(round)
}

/// The face moved to its place in the model, in millimetres.
pub(super) fn placed(
    face: &Face,
    move_to: impl Fn(claymill_nurbs::Point3) -> claymill_nurbs::Point3,
) -> Result<Face, claymill_nurbs::NurbsError> {
    let s = &face.surface;
    let (rows, columns) = s.size();
    let (mut points, mut weights) = (Vec::with_capacity(rows * columns), Vec::with_capacity(rows * columns));
    for i in 0..rows {
        for j in 0..columns {
            points.push(move_to(s.control_point(i, j)));
            weights.push(s.weight(i, j));
        }
    }
    let weights = s.is_rational().then_some(weights);
    Ok(Face {
        surface: NurbsSurface::new(s.knots_u().clone(), s.knots_v().clone(), points, weights)?,
        ..face.clone()
    })
}
