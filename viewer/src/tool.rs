//! The tool as a body: ball, shank and holder, turned about the axis.

use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::{Tool, ToolRecord};

use crate::palette::Rgb;
use crate::scene::{LegendEntry, Mark, Scene, SurfaceVertex};

const BALL: Rgb = [236, 196, 74];
const SHANK: Rgb = [168, 172, 180];
const HOLDER: Rgb = [92, 98, 110];
/// Where nothing is known of the holder the shank is drawn this many radii long.
const SHANK_RADII: f64 = 14.0;
/// Corners of a circle, and rings of the ball's quarter.
const ROUND: u32 = 32;
const LEVELS: u32 = 10;

/// A tool at one place.
#[derive(Debug, Clone, Copy)]
pub struct PosedTool<'a> {
    /// What it is.
    pub record: &'a ToolRecord,
    /// Where its tip is, mm.
    pub tip: Point3,
    /// From tip to holder, unit.
    pub axis: Vector3,
}

/// A band between two circles about the axis: height above the tip and radius of each.
struct Band {
    ends: [[f64; 2]; 2],
    /// Slope of the normal at each end: its part along the axis.
    along: [f64; 2],
    colour: Rgb,
}

impl Scene {
    /// Adds a ball and a shank of its diameter, turned about the unit vector `axis`, with its lowest point at `tip`.
    pub fn add_tool(&mut self, tip: &Point3, axis: &Vector3, radius_mm: f64) {
        let record = ToolRecord { id: String::new(), tool: Tool::Ball { radius_mm }, holder: None };
        self.add_posed_tool(&PosedTool { record: &record, tip: *tip, axis: *axis });
    }

    /// Adds a tool: the ball and what cuts with it, the shank, and the holder if the tool has one.
    pub fn add_posed_tool(&mut self, tool: &PosedTool<'_>) {
        let side = if tool.axis.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
        let u = tool.axis.cross(&side).normalize();
        let v = tool.axis.cross(&u);
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for band in bands(tool.record) {
            let first = vertices.len() as u32;
            for ([height, radius], along) in band.ends.into_iter().zip(band.along) {
                for k in 0..ROUND {
                    let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(ROUND)).sin_cos();
                    let out = u * cos + v * sin;
                    let normal = out * (1.0 - along * along).max(0.0).sqrt() + tool.axis * along;
                    let p = tool.tip + tool.axis * height + out * radius - self.origin.coords;
                    vertices.push(SurfaceVertex {
                        position: [p.x as f32, p.y as f32, p.z as f32],
                        normal: [normal.x as f32, normal.y as f32, normal.z as f32],
                        colour: [band.colour[0], band.colour[1], band.colour[2], 255],
                    });
                }
            }
            for k in 0..ROUND {
                let [a, b] = [k, (k + 1) % ROUND].map(|k| first + k);
                triangles.extend([[a, b, b + ROUND], [a, b + ROUND, a + ROUND]]);
            }
        }
        self.add_triangles(&vertices, &triangles);
    }

    /// Says in the legend what the parts of a tool are.
    pub fn explain_tool(&mut self, tool: &ToolRecord) {
        let shape = format!("{}: ball, radius {} mm", tool.id, tool.tool.radius_mm());
        let mut entry = |colour, text| self.legend.push(LegendEntry { mark: Mark::Area, colour, text });
        entry(BALL, shape);
        match &tool.holder {
            Some(holder) => {
                entry(SHANK, format!("shank, {} mm stick out", holder.stick_out_mm));
                entry(HOLDER, "holder".to_owned());
            }
            None => entry(SHANK, "shank; no holder was given".to_owned()),
        }
    }
}

/// The tool's outline, for those who turn it about its axis themselves: height and radius at both ends of every band,
/// mm, and its colour.
pub(crate) fn outline(record: &ToolRecord) -> Vec<([[f64; 2]; 2], Rgb)> {
    bands(record).into_iter().map(|b| (b.ends, b.colour)).collect()
}

fn bands(record: &ToolRecord) -> Vec<Band> {
    let r = record.tool.radius_mm();
    let mut bands = Vec::new();
    let on_ball = |k: u32| {
        let (sin, cos) = (0.5 * std::f64::consts::PI * f64::from(k) / f64::from(LEVELS)).sin_cos();
        ([r * (1.0 - cos), r * sin], -cos)
    };
    for k in 0..LEVELS {
        let ((low, low_along), (high, high_along)) = (on_ball(k), on_ball(k + 1));
        bands.push(Band { ends: [low, high], along: [low_along, high_along], colour: BALL });
    }
    // Fluted as far as the ball is thick.
    let flutes = 2.0 * r;
    let top = record.holder.as_ref().map_or(SHANK_RADII * r, |h| h.stick_out_mm).max(r);
    let wall = |low: f64, high: f64, colour| Band { ends: [[low, r], [high, r]], along: [0.0; 2], colour };
    bands.push(wall(r, flutes.min(top), BALL));
    if flutes < top {
        bands.push(wall(flutes, top, SHANK));
    }
    let disc = |height: f64, from: f64, to: f64, along: f64, colour| Band {
        ends: [[height, from], [height, to]],
        along: [along; 2],
        colour,
    };
    let mut radius = r;
    let mut last = (top, SHANK);
    for [[low, lower], [high, upper]] in record.holder.iter().flat_map(|h| h.profile()) {
        let along = (lower - upper) / (high - low).hypot(lower - upper);
        let faces_down = if lower > radius { -1.0 } else { 1.0 };
        bands.push(disc(low, radius, lower, faces_down, HOLDER));
        bands.push(Band { ends: [[low, lower], [high, upper]], along: [along; 2], colour: HOLDER });
        (radius, last) = (upper, (high, HOLDER));
    }
    bands.push(disc(last.0, radius, 0.0, 1.0, last.1));
    bands
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_toolpath::Holder;

    #[test]
    fn the_body_is_as_tall_and_as_wide_as_tool_and_holder() {
        let tool = Tool::Ball { radius_mm: 6.0 };
        let holder = Holder::parse("60:27-34x50,63x26", &tool).unwrap();
        let record = ToolRecord { id: "T1".into(), tool, holder: Some(holder) };
        for axis in [Vector3::z(), -Vector3::x(), Vector3::new(0.6, 0.0, 0.8)] {
            let tip = Point3::new(100.0, -20.0, 5.0);
            let mut scene = Scene::new(Point3::new(90.0, 0.0, 0.0));
            scene.add_posed_tool(&PosedTool { record: &record, tip, axis });
            let mut widest = std::collections::BTreeMap::new();
            for v in &scene.surfaces[0].vertices {
                let from_tip = Point3::from(v.position.map(f64::from)) + scene.origin.coords - tip;
                let height = from_tip.dot(&axis);
                let radius = (from_tip - axis * height).norm();
                let n = Vector3::from(v.normal.map(f64::from));
                approx::assert_abs_diff_eq!(n.norm(), 1.0, epsilon = 1e-5);
                let at = widest.entry((height * 10.0).round() as i64).or_insert(0.0_f64);
                *at = at.max(radius);
            }
            let radius_at = |mm: f64| widest[&((mm * 10.0).round() as i64)];
            for (height, radius) in [(0.0, 0.0), (6.0, 6.0), (60.0, 13.5), (110.0, 31.5), (136.0, 31.5)] {
                approx::assert_abs_diff_eq!(radius_at(height), radius, epsilon = 1e-3);
            }
            assert_eq!(widest.last_key_value().unwrap().0, &1360);
        }
    }
}
