//! What is known of a place: for the panel and, as JSON, for other programs.

use std::collections::BTreeMap;

use claymill_nurbs::{Point3, SurfaceKind};
use claymill_toolpath::{MoveKind, UncutReason};
use serde::Serialize;

use crate::exhibit::Exhibit;
use crate::joints::{JointClass, Seam};
use crate::pick::Spot;
use crate::tracks::{ToolPlace, tool_at};

/// A measured scallop height counts for places this near, in radii of the tool.
const SCALLOP_NEAR_RADII: f64 = 1.0;
/// Flatter than this is flat, mm of radius.
const FLAT_MM: f64 = 1e6;

/// Everything known of a picked place.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Facts {
    /// The surface under the pointer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceFacts>,
    /// The tool path near it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub path: Option<PathFacts>,
    /// The joint near it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<JointFacts>,
}

/// A place on the exact surface.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SurfaceFacts {
    /// Index of the face, in file order.
    pub face: usize,
    /// What people call it.
    pub name: String,
    /// Its layer in the file.
    pub layer: Option<String>,
    /// What it was in the file.
    pub kind: SurfaceKind,
    /// Its region.
    pub region: usize,
    /// Area of the region, mm².
    pub region_area_mm2: Option<f64>,
    /// The point, mm.
    pub point_mm: [f64; 3],
    /// Unit normal toward the eye.
    pub normal: [f64; 3],
    /// Parameters of the surface.
    pub uv: [f64; 2],
    /// Principal radii, positive where the centre is on the eye's side (hollow), mm; `null`: flat.
    pub radii_mm: [Option<f64>; 2],
    /// Area of the face, mm².
    pub area_mm2: Option<f64>,
    /// Part of the face that is cut.
    pub cut_share: Option<f64>,
    /// Area of the face that is not, by reason, mm².
    pub uncut_mm2: BTreeMap<UncutReason, f64>,
    /// Scallop height measured near the point, mm.
    pub scallop_mm: Option<f64>,
    /// 99th percentile of the region's scallops, mm.
    pub region_scallop_p99_mm: Option<f64>,
}

/// A place on a tool path.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PathFacts {
    /// Position in machining order.
    pub seq: u64,
    /// What the move is for.
    pub kind: MoveKind,
    /// Its setup.
    pub setup: String,
    /// Its region.
    pub region: usize,
    /// Its pass within region and setup.
    pub pass: u32,
    /// Its tool.
    pub tool: String,
    /// Feed, mm/min.
    pub feed_mm_per_min: f64,
    /// Length, mm.
    pub length_mm: f64,
    /// Degree and number of control points.
    pub degree: usize,
    /// Number of control points.
    pub control_points: usize,
    /// Where the line was picked: the contact while cutting, mm.
    pub point_mm: [f64; 3],
    /// Tip of the tool there, mm.
    pub tip_mm: Option<[f64; 3]>,
    /// When it is there, s from the start of the job.
    pub at_s: f64,
    /// Scallop height measured near the point, mm.
    pub scallop_mm: Option<f64>,
}

/// A joint of two faces, or an open boundary.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointFacts {
    /// The faces.
    pub faces: Vec<usize>,
    /// What people call them.
    pub names: Vec<String>,
    /// What it is.
    pub class: &'static str,
    /// `C0`, `G1` or `G2`, as measured.
    pub continuity: Option<String>,
    /// Whether the faces are cut as one.
    pub verdict: Option<String>,
    /// Why.
    pub why: Option<String>,
    /// Length of the joint, mm.
    pub length_mm: Option<f64>,
    /// Largest gap, mm.
    pub gap_max_mm: Option<f64>,
    /// Largest angle, degrees.
    pub angle_max_deg: Option<f64>,
    /// Where it was picked, mm.
    pub point_mm: [f64; 3],
}

/// What lies between two places on the exact surface.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    /// The first place, mm.
    pub from_mm: [f64; 3],
    /// The second place, mm.
    pub to_mm: [f64; 3],
    /// Their distance, mm.
    pub distance_mm: f64,
    /// From the first to the second, mm.
    pub delta_mm: [f64; 3],
    /// Angle between the normals, degrees.
    pub angle_deg: f64,
    /// Distance along the normal of the first place, mm.
    pub along_normal_mm: f64,
}

impl Measured {
    pub(crate) fn between(a: &Spot, b: &Spot) -> Self {
        let delta = b.point - a.point;
        let angle_deg = a.normal.cross(&b.normal).norm().atan2(a.normal.dot(&b.normal)).to_degrees();
        Measured {
            from_mm: a.point.into(),
            to_mm: b.point.into(),
            distance_mm: delta.norm(),
            delta_mm: delta.into(),
            angle_deg,
            along_normal_mm: delta.dot(&a.normal),
        }
    }
}

/// Measured scallop heights, to be asked for by place.
pub(crate) type Heights = [(Point3, f64)];

fn scallop_near(exhibit: &Exhibit, heights: Option<&Heights>, p: &Point3) -> Option<f64> {
    let radius_mm = exhibit.job.as_ref()?.job.request.tool.radius_mm();
    let reach2 = (SCALLOP_NEAR_RADII * radius_mm).powi(2);
    let near = heights?.iter().map(|(q, h)| ((q - p).norm_squared(), *h)).filter(|(d2, _)| *d2 < reach2);
    near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, h)| h)
}

pub(crate) fn surface(exhibit: &Exhibit, spot: &Spot, heights: Option<&Heights>) -> SurfaceFacts {
    let Spot { face, uv: [u, v], point, normal } = *spot;
    let region = exhibit.region_of_face[face];
    let of_face = &exhibit.model.faces[face];
    let principal = of_face.surface.jet(u, v).curvature(&normal).principal();
    let radius = |k: f64| (k.abs() > 1.0 / FLAT_MM).then(|| 1.0 / k);
    let job = exhibit.job.as_ref();
    let account = job.and_then(|j| j.job.faces.get(face));
    let crests = job.and_then(|j| j.verification.as_ref()).map(|v| &v.scallop.crests.by_region);
    SurfaceFacts {
        face,
        name: exhibit.face_name(face),
        layer: of_face.source.layer.clone(),
        kind: of_face.kind,
        region,
        region_area_mm2: exhibit.regions.regions.get(region).map(|r| r.area_mm2),
        point_mm: point.into(),
        normal: normal.into(),
        uv: spot.uv,
        radii_mm: principal.map_or([None, None], |(low, high)| [radius(low), radius(high)]),
        area_mm2: account.map(|a| a.area.total_mm2),
        cut_share: account.filter(|a| a.area.total_mm2 > 0.0).map(|a| a.area.cut_mm2 / a.area.total_mm2),
        uncut_mm2: account.map(|a| a.area.uncut_mm2.clone()).unwrap_or_default(),
        scallop_mm: scallop_near(exhibit, heights, &point),
        region_scallop_p99_mm: crests.and_then(|c| c.iter().find(|r| r.region == region)).map(|r| r.p99_mm),
    }
}

pub(crate) fn path(
    exhibit: &Exhibit,
    of: usize,
    share: f64,
    begins_s: &[f64],
    point: &Point3,
    heights: Option<&Heights>,
) -> Option<PathFacts> {
    let shown = exhibit.job.as_ref()?;
    let m = shown.program.moves.get(of)?;
    let place: Option<ToolPlace> = tool_at(shown, of, share);
    let took_s = begins_s.get(of + 1)? - begins_s.get(of)?;
    Some(PathFacts {
        seq: m.seq,
        kind: m.kind,
        setup: m.setup.clone(),
        region: m.region,
        pass: m.pass,
        tool: m.tool.clone(),
        feed_mm_per_min: m.feed,
        length_mm: m.length_mm(),
        degree: m.degree,
        control_points: m.points.len(),
        point_mm: (*point).into(),
        tip_mm: place.map(|p| p.tip.into()),
        at_s: begins_s[of] + share * took_s,
        scallop_mm: scallop_near(exhibit, heights, point).filter(|_| m.kind == MoveKind::Cut),
    })
}

pub(crate) fn joint(exhibit: &Exhibit, seam: &Seam, point: &Point3) -> JointFacts {
    let record = seam.joint.map(|j| &exhibit.regions.joints[j]);
    let faces: Vec<usize> = std::iter::once(seam.faces.0).chain(seam.faces.1).collect();
    JointFacts {
        names: faces.iter().map(|f| exhibit.face_name(*f)).collect(),
        faces,
        class: match seam.class {
            JointClass::Open => "open boundary",
            JointClass::Border => "border of regions",
            JointClass::Sharp => "edge inside a region",
            JointClass::Tangent => "tangent joint",
            JointClass::Curvature => "smooth joint",
        },
        continuity: record.map(|r| r.class.clone()),
        verdict: record.map(|r| r.verdict.clone()),
        why: record.map(|r| r.why.clone()),
        length_mm: record.map(|r| r.length_mm),
        gap_max_mm: record.map(|r| r.gap_max_mm),
        angle_max_deg: record.map(|r| r.angle_max_deg),
        point_mm: (*point).into(),
    }
}

/// `1 h 02 min`, `3 min 20 s`, `4.2 s`.
#[must_use]
pub(crate) fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match seconds {
        s if s >= 3600.0 => format!("{} h {:02} min", whole / 3600, whole / 60 % 60),
        s if s >= 60.0 => format!("{} min {:02} s", whole / 60, whole % 60),
        s => format!("{s:.1} s"),
    }
}

/// `1:02:03.4`.
#[must_use]
pub(crate) fn clock(seconds: f64) -> String {
    let tenths = (seconds.max(0.0) * 10.0).floor() as u64;
    format!("{}:{:02}:{:02}.{}", tenths / 36_000, tenths / 600 % 60, tenths / 10 % 60, tenths % 10)
}

/// An area in the unit that people use for its size.
#[must_use]
pub(crate) fn area(mm2: f64) -> String {
    match mm2 {
        a if a >= 1e5 => format!("{:.3} m²", a / 1e6),
        a if a >= 1e3 => format!("{:.1} cm²", a / 1e2),
        a => format!("{a:.2} mm²"),
    }
}

/// A length in the unit that people use for its size.
#[must_use]
pub(crate) fn length(mm: f64) -> String {
    match mm.abs() {
        l if l >= 1e6 => format!("{:.2} km", mm / 1e6),
        l if l >= 1e3 => format!("{:.2} m", mm / 1e3),
        _ => format!("{mm:.2} mm"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_read_as_people_write_them() {
        assert_eq!(duration(4.2), "4.2 s");
        assert_eq!(duration(200.0), "3 min 20 s");
        assert_eq!(duration(3720.0), "1 h 02 min");
        assert_eq!(clock(3723.46), "1:02:03.4");
        assert_eq!(area(2.5e6), "2.500 m²");
        assert_eq!(length(1_535_828.0), "1.54 km");
    }
}
