//! How large a ball fits where: area-weighted samples of the surface, each with the largest ball that touches there and enters
//! no face, and with the tools of which shank and holder enter none.
//!
//! ```text
//!     │ ( ) │      Balls along the axis of a tool stand for its shank and holder. In corners under the rim of a holder they miss
//!     │ ( ) │      something: this is for choosing tools, and what they cut is planned with the whole of them.
//!      │(_)│
//!       │o│
//! ```

use claymill_nurbs::{Aabb, ClosestPoints, Domain, Face, Point3, Vector3};
use claymill_tooling::LibraryTool;
use claymill_toolpath::{Cancelled, Holder, Monitor};
use rayon::prelude::*;

use crate::prepared::Prepared;

/// Samples of the whole model, at most about so many.
const SAMPLES: f64 = 6_000.0;
/// Of each face along each parameter.
const MOST_ALONG: usize = 24;
/// A ball that is entered by less fits: that is what passes leave, mm.
const FITS_MM: f64 = 0.02;
/// Beads of a tool at most, and how far they are apart at least, mm.
const MOST_BEADS: usize = 200;
const LEAST_STEP_MM: f64 = 1.0;
/// What leans away from all setups by more than this is reached by none (sine, 10°).
const LEAST_FACING: f64 = 0.1736;
/// Along walls a tool stands, whatever rounding makes of them.
const UPRIGHT: f64 = -2e-3;

/// A place of the surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    /// Area that it stands for, mm².
    pub(crate) area_mm2: f64,
    /// Radius of the largest ball that fits there, mm: at most the one that was asked about.
    pub(crate) fits_mm: f64,
    /// Least radius of the surface where it is hollow there, mm; infinity where it is not.
    pub(crate) hollow_mm: f64,
    /// The tools of which shank and holder enter no face there, from some setup: a bit for each.
    pub(crate) stands: u64,
}

/// A ball on the axis of a tool that stands for a part of it.
struct Bead {
    above_tip_mm: f64,
    radius_mm: f64,
}

/// What is above the ball of a tool, from the tip up, as far as `high_mm`; nothing where it is no wider than the ball.
fn beads(tool: &LibraryTool, high_mm: f64) -> Vec<Bead> {
    let holder = tool.holder.iter().flat_map(Holder::profile);
    let sides = tool.tool.sides().into_iter().filter(|_| !tool.tool.is_straight());
    let mut beads = Vec::new();
    for [[low, r_low], [high, r_high]] in sides.chain(holder) {
        let gained = ((r_high - r_low) / (high - low)).max(0.0);
        let mut at = low + r_low;
        // What is above a holder is as wide.
        while beads.len() < MOST_BEADS && at < high.min(high_mm).max(low + 2.0 * r_low) {
            let wide_mm = r_low.min(r_high) + gained * (at - low).min(high - low);
            let radius_mm = (wide_mm / gained.hypot(1.0)).min(at - low);
            beads.push(Bead { above_tip_mm: at, radius_mm });
            at += radius_mm.max(LEAST_STEP_MM);
        }
    }
    beads
}

/// Samples of what the setups see, with the largest balls up to `most_mm` that fit, and those of the tools that stand there.
///
/// # Errors
/// The monitor ends it.
pub(crate) fn samples(
    prepared: &Prepared<'_>,
    axes: &[Vector3],
    (tools, most_mm): (&[LibraryTool], f64),
    monitor: &dyn Monitor,
) -> Result<Vec<Sample>, Cancelled> {
    let model = prepared.file.model();
    let closest = ClosestPoints::new(model);
    let areas = &prepared.file.face_area_mm2;
    let whole_mm2: f64 = areas.iter().sum();
    let high_mm = prepared.file.bounds.diagonal();
    let beads: Vec<Vec<Bead>> = tools.iter().map(|tool| beads(tool, high_mm)).collect();
    let tops: Vec<f64> = axes.iter().map(|axis| top_mm(&prepared.file.bounds, axis)).collect();
    let stands = |p: &Point3, n: &Vector3, k: usize| {
        let radius_mm = tools[k].tool.radius_mm();
        let from = |(axis, top_mm): (&Vector3, &f64)| {
            let tip = p + n * radius_mm - axis * radius_mm;
            let below_mm = top_mm - tip.coords.dot(axis);
            let met = beads[k].iter().filter(|bead| bead.above_tip_mm - bead.radius_mm < below_mm);
            let enters =
                |bead: &Bead| closest.any_within(&(tip + axis * bead.above_tip_mm), bead.radius_mm - FITS_MM);
            !met.into_iter().any(enters)
        };
        let mut facing = axes.iter().zip(&tops).filter(|(axis, _)| axis.dot(n) > UPRIGHT);
        beads[k].is_empty() || facing.any(from)
    };
    let of_face = |face: usize| {
        monitor.go_on()?;
        let along = (SAMPLES * areas[face] / whole_mm2).sqrt().ceil();
        let along = if along.is_finite() { (along as usize).clamp(1, MOST_ALONG) } else { 1 };
        let free = prepared.options.free_sides.get(face).copied();
        let places = places(&model.faces[face], along);
        let area_mm2 = areas[face] / places.len().max(1) as f64;
        let sample = |&(p, n, bends): &(Point3, Vector3, [f64; 2])| {
            let sides = [(n, bends[1], true), (-n, -bends[0], false)].into_iter();
            let allowed = sides.filter(|(.., positive)| free.is_none_or(|free| free.allows(*positive)));
            let seen = allowed.filter(|(n, ..)| axes.iter().any(|a| a.dot(n) > LEAST_FACING));
            let samples = seen.map(|(n, most, _)| {
                let fits_mm = closest.largest_ball_mm(&p, &n, [0.0, most_mm], FITS_MM);
                let fits = |k: &usize| tools[*k].tool.radius_mm() <= fits_mm + FITS_MM;
                let standing = (0..tools.len()).filter(fits).filter(|&k| stands(&p, &n, k));
                Sample {
                    area_mm2,
                    fits_mm,
                    hollow_mm: if most > 0.0 { 1.0 / most } else { f64::INFINITY },
                    stands: standing.fold(0, |bits, k| bits | 1 << k),
                }
            });
            samples.reduce(|a, b| if b.fits_mm > a.fits_mm { b } else { a })
        };
        let samples = places.iter().filter_map(sample);
        Ok(samples.collect::<Vec<_>>())
    };
    let cut = (0..model.faces.len()).into_par_iter().filter(|&face| !prepared.excluded[face]);
    Ok(cut.map(of_face).collect::<Result<Vec<_>, Cancelled>>()?.into_iter().flatten().collect())
}

/// How far a box goes along an axis, mm.
fn top_mm(bounds: &Aabb, axis: &Vector3) -> f64 {
    (0..3).map(|k| (bounds.min[k] * axis[k]).max(bounds.max[k] * axis[k])).sum()
}

/// Places on a face, evenly in its parameters, with unit normals and the least and the largest curvature towards these, 1/mm.
fn places(face: &Face, along: usize) -> Vec<(Point3, Vector3, [f64; 2])> {
    let domain = (!face.loops.is_empty()).then(|| Domain::new(face));
    let ((u0, u1), (v0, v1)) = face.surface.domain();
    let at = |i: usize, from: f64, to: f64| from + (to - from) * (i as f64 + 0.5) / along as f64;
    let grid = (0..along).flat_map(|i| (0..along).map(move |j| (i, j)));
    grid.map(|(i, j)| (at(i, u0, u1), at(j, v0, v1)))
        .filter(|&(u, v)| domain.as_ref().is_none_or(|d| d.contains(u, v)))
        .filter_map(|(u, v)| {
            let (jet, (n, _)) = (face.surface.jet(u, v), face.surface.normal(u, v)?);
            // Where the surface has no curvature, none is hollow.
            let bends = jet.curvature(&n).principal().map_or([0.0; 2], |(least, most)| [least, most]);
            Some((jet.p, n, bends))
        })
        .filter(|(p, n, _)| p.iter().chain(n.iter()).all(|c| c.is_finite()))
        .collect()
}

#[cfg(test)]
mod tests {
    use claymill_toolpath::Tool;

    use super::*;

    fn tool(text: &str, holder: Option<&str>) -> LibraryTool {
        let tool: Tool = text.parse().unwrap();
        let holder = holder.map(|text| Holder::parse(text, &tool).unwrap());
        let mut shipped = claymill_tooling::Library::shipped().tools.swap_remove(0);
        (shipped.tool, shipped.holder) = (tool, holder);
        shipped
    }

    /// No bead sticks out of the tool: half as wide at heights as the beads are there.
    #[test]
    fn beads_are_inside_of_shank_and_holder() {
        assert!(beads(&tool("ball:5", None), 300.0).is_empty());
        for (text, holder) in [("ball:5", "40:20-30x10,50x20"), ("ball:4,taper:3,length:40,shank:12", "60")] {
            let tool = tool(text, Some(holder));
            let holder = tool.holder.clone().unwrap();
            let sides = || tool.tool.sides().into_iter().chain(holder.profile());
            let wide_at = |height: f64| {
                let wide = |[[low, r_low], [high, r_high]]: [[f64; 2]; 2]| {
                    let share = if high.is_finite() { (height - low) / (high - low) } else { 0.0 };
                    (low..=high).contains(&height).then_some(r_low + share * (r_high - r_low))
                };
                sides().filter_map(wide).fold(0.0, f64::max)
            };
            let found = beads(&tool, 300.0);
            assert!(found.len() >= 2 && found.iter().any(|bead| bead.radius_mm > 20.0));
            for Bead { above_tip_mm, radius_mm } in found {
                for k in 0..=20 {
                    let up = f64::from(k).mul_add(0.1, -1.0) * radius_mm;
                    let (height, half) =
                        (above_tip_mm + up, (radius_mm * radius_mm - up * up).max(0.0).sqrt());
                    // Above a holder it goes on.
                    let wide = if height > holder.top_mm() { f64::INFINITY } else { wide_at(height) };
                    assert!(half <= wide + 1e-6, "{text}: {half} at {height}, {wide}");
                }
            }
        }
    }
}
