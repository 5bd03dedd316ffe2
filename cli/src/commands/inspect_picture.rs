//! The picture of `claymill inspect -o`: the model with a marker at every defect, and a legend of
//! the defect codes.

use std::path::Path;

use claymill::ModelFile;
use claymill_surface_merge::Merge;
use claymill_surface_merge::defects::{Defect, DefectCode};
use claymill_toolpath::SheetRecord;
use claymill_viewer::{LegendEntry, Mark, PictureOptions, Pin, PinShape, Renderer, Rgb};

use super::render::{named_view, parse_size};
use super::{Context, orientation, pictures};
use crate::args::{InspectArgs, ShowName};
use crate::console::counted;
use crate::failure::Failure;

/// How a defect is marked: gaps and laps of a model by rings and squares in strong colours, since they matter most to
/// milling; what only travels badly in quieter ones.
fn sign(code: DefectCode) -> (PinShape, Rgb) {
    use DefectCode as D;
    match code {
        D::Gap => (PinShape::Ring, [214, 30, 36]),
        D::NonManifold => (PinShape::Ring, [122, 40, 160]),
        D::InconsistentNormals => (PinShape::Ring, [20, 110, 200]),
        D::Duplicate => (PinShape::Square, [214, 30, 36]),
        D::Overlap => (PinShape::Square, [122, 40, 160]),
        D::TinyFace => (PinShape::Square, [20, 110, 200]),
        D::TinyEdge => (PinShape::Diamond, [20, 110, 200]),
        D::CrossingLoop => (PinShape::Diamond, [214, 30, 36]),
        D::Folded => (PinShape::Triangle, [214, 30, 36]),
        D::Degenerate => (PinShape::Triangle, [122, 40, 160]),
        D::CloseKnots => (PinShape::Cross, [20, 110, 200]),
        D::HighDegree => (PinShape::Cross, [24, 130, 70]),
        D::SmallRadius => (PinShape::Diamond, [176, 98, 8]),
    }
}

/// The model in clay with a sign at every defect, also behind it, and a legend of the codes.
pub(crate) fn save_picture(
    context: &Context,
    args: &InspectArgs,
    loaded: &ModelFile,
    merged: &Merge,
    defects: &[Defect],
    sheets: &[SheetRecord],
    path: &Path,
) -> Result<(), Failure> {
    let axes = pictures::axes(orientation(context.console, &args.axes, loaded)?);
    let view = named_view(&args.view, &axes)?;
    let options = PictureOptions { size: parse_size(&args.size)?, ..pictures::options(&axes) };
    let model = &loaded.import.model;
    let album = pictures::Album::new(model, &merged.region_of_face, None, merged.tolerance.value_mm)
        .with_sides(sheets);
    let mut scene = album.scene(&loaded.name(), None, &[ShowName::Model, ShowName::Trims])?;
    scene.caption[1] =
        format!("{}, {}", counted(model.faces.len(), "face"), counted(defects.len(), "defect"));
    for of_code in defects.chunk_by(|a, b| a.code == b.code) {
        let code = of_code[0].code;
        let (shape, colour) = sign(code);
        scene.pins.extend(of_code.iter().map(|d| Pin { at: d.at, shape, colour }));
        let what = code.words().split(',').next().unwrap_or_default();
        let text = format!("{} × {} {what}", of_code.len(), code.code());
        scene.legend.push(LegendEntry { mark: Mark::Pin(shape), colour, text });
    }
    claymill_viewer::render_png(&Renderer::new()?, &scene, &view, &options, path)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_codes_have_the_same_sign() {
        use DefectCode as D;
        let codes = [
            D::Gap,
            D::NonManifold,
            D::InconsistentNormals,
            D::Duplicate,
            D::Overlap,
            D::TinyFace,
            D::TinyEdge,
            D::CrossingLoop,
            D::Folded,
            D::Degenerate,
            D::CloseKnots,
            D::HighDegree,
            D::SmallRadius,
        ];
        for (i, a) in codes.iter().enumerate() {
            assert!(codes[..i].iter().all(|b| sign(*a) != sign(*b)), "{a:?}");
        }
    }
}
