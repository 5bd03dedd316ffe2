//! Plans over few faces that do not join.

use claymill_nurbs::NurbsSurface;
use claymill_paths::{Orientation, Plan, PlanOptions, Regions, plan};
use claymill_surface_merge::{MergeOptions, merge};
use claymill_toolpath::Tool;

/// Plans with a ball over faces, each a region of its own; `asked` changes what is usual.
pub(crate) fn planned(
    surfaces: impl IntoIterator<Item = NurbsSurface>,
    radius_mm: f64,
    scallop_mm: f64,
    asked: impl FnOnce(PlanOptions) -> PlanOptions,
) -> Plan {
    let model = claymill_tests::model_of(surfaces);
    let face_area_mm2: Vec<f64> = model.faces.iter().map(|f| f.area_mm2()).collect();
    let of_face: Vec<usize> = (0..model.faces.len()).collect();
    let merged = merge(&model, &MergeOptions::default()).unwrap();
    let top = Orientation::new("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap();
    let options = asked(PlanOptions::new(Tool::ball(radius_mm), scallop_mm, top));
    let excluded: Vec<bool> =
        (0..model.faces.len()).map(|face| options.bounds.avoid.contains(&face)).collect();
    let regions =
        Regions { merged: &merged, of_face: &of_face, excluded: &excluded, face_area_mm2: &face_area_mm2 };
    plan(&model, &regions, &options, &()).unwrap()
}
