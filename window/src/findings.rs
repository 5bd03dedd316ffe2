//! Places that verification names.

use claymill_nurbs::Point3;
use claymill_verify::Severity;

use crate::exhibit::Exhibit;

/// A place worth a look.
#[derive(Debug, Clone, PartialEq)]
pub struct Marked {
    /// Where, mm.
    pub at: Point3,
    /// What is there.
    pub text: String,
    /// Whether it is a fault.
    pub fault: bool,
}

/// Places of findings, the deepest gouge first.
pub(crate) fn marks(exhibit: &Exhibit) -> Vec<Marked> {
    let Some(found) = exhibit.job.as_ref().and_then(|j| j.verification.as_ref()) else {
        return Vec::new();
    };
    let gouge = found.gouge.deepest_at.as_ref().map(|p| Marked {
        at: Point3::from(p.point_mm),
        text: format!("deepest gouge: {:.4} mm", found.gouge.deepest_mm),
        fault: found.gouge.deeper_than_5_um > 0,
    });
    let highest = found.scallop.crests.max_at.as_ref().map(|p| Marked {
        at: Point3::from(p.point_mm),
        text: format!("highest scallop: {:.4} mm", found.scallop.crests.max_mm),
        fault: false,
    });
    let findings = found.verdict.findings.iter().filter_map(|f| {
        let at = Point3::from(f.place.as_ref()?.point_mm);
        Some(Marked { at, text: f.message.clone(), fault: f.severity == Severity::Error })
    });
    let left = found.coverage.reachable_left_at.iter().map(|l| Marked {
        at: Point3::from(l.at.point_mm),
        text: format!("{:.1} mm² within reach were left", l.area_mm2),
        fault: false,
    });
    gouge.into_iter().chain(highest).chain(findings).chain(left).collect()
}
