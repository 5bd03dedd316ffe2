//! Plans over a single face, seen from above.

use claymill_nurbs::NurbsSurface;
use claymill_paths::{Orientation, Plan, PlanOptions, Regions, plan};
use claymill_surface_merge::{MergeOptions, merge};
use claymill_toolpath::Tool;

/// Plans with a ball; `asked` changes what is usual.
pub(crate) fn planned(
    surface: NurbsSurface,
    radius_mm: f64,
    scallop_mm: f64,
    asked: impl FnOnce(PlanOptions) -> PlanOptions,
) -> Plan {
    let model = claymill_tests::model_of([surface]);
    let area_mm2 = model.faces[0].area_mm2();
    let merged = merge(&model, &MergeOptions::default()).unwrap();
    let regions = Regions { merged: &merged, of_face: &[0], excluded: &[false], face_area_mm2: &[area_mm2] };
    let top = Orientation::new("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap();
    let options = asked(PlanOptions::new(Tool::ball(radius_mm), scallop_mm, top));
    plan(&model, &regions, &options, &|_, _| {}).unwrap()
}
