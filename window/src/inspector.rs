//! The panel that says what is known.

use claymill_toolpath::MoveKind;
use egui::{RichText, ScrollArea, Ui};

use crate::desk::{Desk, Tool};
use crate::facts::{self, Facts, JointFacts, PathFacts, SurfaceFacts};
use crate::widgets::{fact, heading};

/// What is known of what was picked, measured, and of the whole job.
pub(crate) fn inspector(ui: &mut Ui, desk: &Desk<'_>) {
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        if let Some(measured) = desk.measured() {
            heading(ui, "Measured");
            fact(ui, "Distance", &format!("{:.4} mm", measured.distance_mm));
            for (name, v) in ["ΔX", "ΔY", "ΔZ"].into_iter().zip(measured.delta_mm) {
                fact(ui, name, &format!("{v:.4} mm"));
            }
            fact(ui, "Along normal", &format!("{:.4} mm", measured.along_normal_mm));
            fact(ui, "Normals", &format!("{:.3}°", measured.angle_deg));
            fact(ui, "A", &place(&measured.from_mm));
            fact(ui, "B", &place(&measured.to_mm));
        } else if desk.tool == Tool::Measure {
            heading(ui, "Measure");
            let next = if desk.measured_points().is_empty() { "first" } else { "second" };
            ui.label(RichText::new(format!("Click the {next} point on a surface.")).weak());
        }
        match desk.picked() {
            Some(picked) => picked_facts(ui, &picked.facts),
            None => {
                heading(ui, "Nothing selected");
                ui.label(RichText::new("Click a surface, a tool path or a joint.").weak());
            }
        }
        summary(ui, desk);
        ui.add_space(8.0);
    });
}

fn place(p: &[f64; 3]) -> String {
    format!("{:.3}  {:.3}  {:.3}", p[0], p[1], p[2])
}

fn picked_facts(ui: &mut Ui, facts: &Facts) {
    if let Some(path) = &facts.path {
        path_facts(ui, path);
    }
    if let Some(joint) = &facts.joint {
        joint_facts(ui, joint);
    }
    if let Some(surface) = &facts.surface {
        surface_facts(ui, surface);
    }
}

fn surface_facts(ui: &mut Ui, s: &SurfaceFacts) {
    heading(ui, "Surface");
    fact(ui, "Face", &format!("{} · no. {}", s.name, s.face));
    if let Some(layer) = &s.layer {
        fact(ui, "Layer", layer);
    }
    fact(ui, "Kind", &format!("{:?}", s.kind));
    let region_area = s.region_area_mm2.map_or(String::new(), |a| format!(" · {}", facts::area(a)));
    fact(ui, "Region", &format!("{}{region_area}", s.region));
    fact(ui, "Position", &format!("{} mm", place(&s.point_mm)));
    fact(ui, "Normal", &format!("{:.4}  {:.4}  {:.4}", s.normal[0], s.normal[1], s.normal[2]));
    fact(ui, "Radii", &radii(s.radii_mm));
    if let Some(area) = s.area_mm2 {
        let share = s.cut_share.map_or(String::new(), |c| format!(" · {:.1} % cut", 100.0 * c));
        fact(ui, "Face area", &format!("{}{share}", facts::area(area)));
    }
    for (reason, area) in &s.uncut_mm2 {
        let why = match reason {
            claymill_toolpath::UncutReason::Hidden => "Hidden",
            claymill_toolpath::UncutReason::TooTight => "Too tight",
            claymill_toolpath::UncutReason::Excluded => "Left out",
            claymill_toolpath::UncutReason::EarlierTool => "Earlier tool",
            claymill_toolpath::UncutReason::OutOfBounds => "Out of bounds",
            claymill_toolpath::UncutReason::Roughed => "Roughed by levels",
            claymill_toolpath::UncutReason::NotCovered => "Not triangulated",
        };
        fact(ui, why, &facts::area(*area));
    }
    match (s.scallop_mm, s.region_scallop_p99_mm) {
        (Some(h), _) => fact(ui, "Scallop", &format!("{h:.4} mm, measured here")),
        (None, Some(p99)) => fact(ui, "Scallop", &format!("{p99:.4} mm in the region (p99)")),
        _ => {}
    }
}

/// Of the tightest bends, with the side that they are hollow on.
fn radii(radii_mm: [Option<f64>; 2]) -> String {
    let side = |r: f64| if r > 0.0 { "hollow" } else { "crowned" };
    match radii_mm {
        [None, None] => "flat".to_owned(),
        [Some(a), Some(b)] if a * b > 0.0 => format!("{:.2} and {:.2} mm {}", a.abs(), b.abs(), side(a)),
        [Some(a), Some(b)] => format!("{:.2} mm {}, {:.2} mm {}", a.abs(), side(a), b.abs(), side(b)),
        [Some(r), None] | [None, Some(r)] => format!("{:.2} mm {}, flat across", r.abs(), side(r)),
    }
}

pub(crate) fn kind_name(kind: MoveKind) -> &'static str {
    match kind {
        MoveKind::Cut => "cut",
        MoveKind::LeadIn => "lead in",
        MoveKind::LeadOut => "lead out",
        MoveKind::Link => "link",
        MoveKind::Rapid => "rapid",
    }
}

fn path_facts(ui: &mut Ui, p: &PathFacts) {
    heading(ui, "Tool path");
    fact(ui, "Move", &format!("{} · {}", p.seq, kind_name(p.kind)));
    fact(ui, "Setup", &p.setup);
    fact(ui, "Region", &format!("{} · pass {}", p.region, p.pass));
    fact(ui, "Feed", &format!("{:.0} mm/min · {}", p.feed_mm_per_min, p.tool));
    fact(ui, "Length", &facts::length(p.length_mm));
    fact(ui, "NURBS", &format!("degree {}, {} control points", p.degree, p.control_points));
    fact(ui, "Contact", &format!("{} mm", place(&p.point_mm)));
    if let Some(tip) = &p.tip_mm {
        fact(ui, "Tip", &format!("{} mm", place(tip)));
    }
    fact(ui, "Time", &facts::clock(p.at_s));
    if let Some(h) = p.scallop_mm {
        fact(ui, "Scallop", &format!("{h:.4} mm beside it"));
    }
}

fn joint_facts(ui: &mut Ui, j: &JointFacts) {
    heading(ui, "Joint");
    fact(ui, "Kind", j.class);
    fact(ui, "Faces", &j.names.join(" – "));
    if let (Some(class), Some(verdict)) = (&j.continuity, &j.verdict) {
        fact(ui, "Class", &format!("{class} · {}", verdict.replace('_', " ")));
    }
    if let (Some(gap), Some(angle)) = (j.gap_max_mm, j.angle_max_deg) {
        fact(ui, "Gap", &format!("{gap:.4} mm at most"));
        fact(ui, "Angle", &format!("{angle:.3}° at most"));
    }
    if let Some(length) = j.length_mm {
        fact(ui, "Length", &facts::length(length));
    }
    if let Some(why) = &j.why {
        fact(ui, "Why", why);
    }
}

fn summary(ui: &mut Ui, desk: &Desk<'_>) {
    let exhibit = desk.exhibit();
    heading(ui, if exhibit.job.is_some() { "Job" } else { "Model" });
    fact(ui, "File", &exhibit.title);
    let size = desk.bounds();
    let size = size.max - size.min;
    let model_area: f64 = exhibit.regions.regions.iter().map(|r| r.area_mm2).sum();
    match &exhibit.job {
        None => {
            fact(
                ui,
                "Faces",
                &format!("{} in {} regions", exhibit.model.faces.len(), desk.layers.regions.len()),
            );
            fact(ui, "Area", &facts::area(model_area));
            fact(ui, "Size", &format!("{:.0} × {:.0} × {:.0} mm", size.x, size.y, size.z));
        }
        Some(shown) => {
            let (job, totals) = (&shown.job, &shown.job.totals);
            fact(
                ui,
                "Faces",
                &format!("{} in {} regions", exhibit.model.faces.len(), desk.layers.regions.len()),
            );
            let share = 100.0 * job.area.cut_mm2 / job.area.total_mm2.max(1e-9);
            fact(
                ui,
                "Cut",
                &format!(
                    "{} of {} · {share:.1} %",
                    facts::area(job.area.cut_mm2),
                    facts::area(job.area.total_mm2)
                ),
            );
            fact(ui, "Tool", &format!("{} · {:.0} mm/min", job.request.tool, job.request.feed_mm_per_min));
            fact(
                ui,
                "Strategy",
                &format!("{} · scallop {} mm", job.request.strategy, job.request.scallop_mm),
            );
            fact(ui, "Passes", &format!("{} · {} retracts", totals.passes, totals.retracts));
            fact(ui, "Length", &facts::length(totals.length.total_mm()));
            fact(ui, "Time", &facts::duration(desk.duration_s()));
            if let Some(v) = &shown.verification {
                let gouge = match v.gouge.deepest_mm {
                    d if d > 0.0 => format!("{d:.4} mm deep at most"),
                    _ => "none".to_owned(),
                };
                fact(ui, "Gouges", &gouge);
                fact(ui, "Scallop", &format!("{:.4} mm (p99)", v.scallop.crests.p99_mm));
                fact(ui, "Verdict", if v.verdict.passed { "passed" } else { "not passed" });
            } else {
                fact(ui, "Verdict", "not verified");
            }
        }
    }
}
