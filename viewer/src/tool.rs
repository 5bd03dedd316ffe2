//! The tool as a body: its end, flutes, shank and holder, turned about the axis.

use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::{End, Tool, ToolRecord};

use crate::legend::{LegendEntry, Mark};
use crate::palette::Rgb;
use crate::scene::Scene;
use crate::shapes::SurfaceVertex;

const BALL: Rgb = [236, 196, 74];
const SHANK: Rgb = [168, 172, 180];
const HOLDER: Rgb = [92, 98, 110];
/// Where nothing is known of the holder the shank is drawn this many radii long.
const SHANK_RADII: f64 = 14.0;
/// Where nothing is known of their length, flutes are drawn this many radii long.
const FLUTE_RADII: f64 = 2.0;
/// Corners of a circle, and rings of the end's round.
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
        let record = ToolRecord {
            id: String::new(),
            tool: Tool::ball(radius_mm),
            holder: None,
            setup_stick_out_mm: Default::default(),
        };
        self.add_posed_tool(&PosedTool { record: &record, tip: *tip, axis: *axis });
    }

    /// Adds a tool: its end and the flutes, the shank, and the holder if the tool has one.
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
        let shape = format!("{}: {}", tool.id, in_words(&tool.tool));
        let mut entry = |colour, text| self.legend.push(LegendEntry { mark: Mark::Area, colour, text });
        entry(BALL, shape);
        match tool.stick_out_range_mm() {
            Some((least_mm, most_mm)) => {
                let sticks =
                    if least_mm < most_mm { format!("{least_mm} to {most_mm}") } else { most_mm.to_string() };
                entry(SHANK, format!("shank, {sticks} mm stick out"));
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

/// The same without colours for what is below the holder.
pub(crate) fn below_holder(record: &ToolRecord) -> Vec<[[f64; 2]; 2]> {
    let bands = bands(record).into_iter().filter(|b| b.colour != HOLDER).map(|b| b.ends);
    let shank_top = record.holder.as_ref().map_or(f64::INFINITY, |h| h.stick_out_mm);
    bands.filter(|ends| ends.iter().all(|[height, _]| *height <= shank_top)).collect()
}

/// What a tool is but for its shank.
pub(crate) fn in_words(tool: &Tool) -> String {
    let r = tool.radius_mm();
    let end = match tool.end {
        End::Ball { .. } => format!("ball end mill, radius {r} mm"),
        End::Flat { .. } => format!("flat end mill, radius {r} mm"),
        End::Bull { corner_radius_mm, .. } => {
            format!("bull-nose end mill, radius {r} mm, corner {corner_radius_mm} mm")
        }
    };
    tool.taper_deg.map_or(end.clone(), |deg| format!("{end}, taper {deg}°"))
}

fn bands(record: &ToolRecord) -> Vec<Band> {
    let tool = &record.tool;
    let (r, corner) = (tool.radius_mm(), tool.corner_radius_mm());
    let mut bands = Vec::new();
    let disc = |height: f64, from: f64, to: f64, along: f64, colour| Band {
        ends: [[height, from], [height, to]],
        along: [along; 2],
        colour,
    };
    if corner < r {
        bands.push(disc(0.0, 0.0, r - corner, -1.0, BALL));
    }
    // The round of the end goes as far as the flank leaves it.
    let quarter = 0.5 * std::f64::consts::PI - tool.taper_deg.unwrap_or(0.0).to_radians();
    let on_corner = |k: u32| {
        let (sin, cos) = (quarter * f64::from(k) / f64::from(LEVELS)).sin_cos();
        ([corner * (1.0 - cos), r - corner + corner * sin], -cos)
    };
    for k in (0..LEVELS).filter(|_| corner > 0.0) {
        let ((low, low_along), (high, high_along)) = (on_corner(k), on_corner(k + 1));
        bands.push(Band { ends: [low, high], along: [low_along, high_along], colour: BALL });
    }
    let sides = tool.sides();
    let known = tool.flute_length_mm.unwrap_or(0.0);
    let top =
        record.holder.as_ref().map_or((SHANK_RADII * r).max(1.3 * known), |h| h.stick_out_mm).max(corner);
    let flutes = tool.flute_length_mm.unwrap_or(FLUTE_RADII * r).min(top);
    let wall = |[[low, lower], [high, upper]]: [[f64; 2]; 2], colour| {
        let along = (lower - upper) / (high - low).hypot(lower - upper).max(f64::MIN_POSITIVE);
        Band { ends: [[low, lower], [high, upper]], along: [along; 2], colour }
    };
    let [[low, lower], [high, upper]] = sides[0];
    let reached =
        if high.is_finite() { lower + (upper - lower) * (flutes - low) / (high - low) } else { upper };
    bands.push(wall([[low, lower], [flutes, reached]], BALL));
    let mut radius = reached;
    if flutes < top {
        let shank = tool.shank_radius_mm();
        if shank != radius {
            bands.push(disc(flutes, radius, shank, if shank > radius { -1.0 } else { 1.0 }, SHANK));
        }
        bands.push(wall([[flutes, shank], [top, shank]], SHANK));
        radius = shank;
    }
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
    fn every_kind_of_tool_is_drawn_as_it_is() {
        // Height and radius of places on the outline of each.
        for (tool, places) in [
            ("flat:5", vec![[0.0, 5.0], [10.0, 5.0]]),
            ("bull:5:2", vec![[0.0, 3.0], [2.0, 5.0]]),
            (
                "ball:5,length:20,shank:16",
                vec![[0.0, 0.0], [5.0, 5.0], [20.0, 5.0], [20.0, 8.0], [70.0, 8.0]],
            ),
            (
                "bull:10:2,taper:30,length:20,shank:12",
                vec![[1.0, 8.0 + 3f64.sqrt()], [20.0, 6.0], [140.0, 6.0]],
            ),
        ] {
            let record = ToolRecord {
                id: String::new(),
                tool: tool.parse().unwrap(),
                holder: None,
                setup_stick_out_mm: Default::default(),
            };
            let bands = bands(&record);
            for [height, radius] in places {
                let drawn = bands.iter().flat_map(|b| b.ends);
                let nearest =
                    drawn.map(|[h, r]| (h - height).hypot(r - radius)).fold(f64::INFINITY, f64::min);
                assert!(nearest < 1e-9, "{tool}: nothing at {height}, {radius}");
            }
            // It is closed: each band begins where the one before ended.
            let apart = |[h, r]: [f64; 2], [k, s]: [f64; 2]| (h - k).hypot(r - s);
            assert!(bands.windows(2).all(|b| apart(b[0].ends[1], b[1].ends[0]) < 1e-9), "{tool}");
            assert_eq!(bands[0].ends[0][1], 0.0);
        }
    }

    #[test]
    fn the_body_is_as_tall_and_as_wide_as_tool_and_holder() {
        let tool = Tool::ball(6.0);
        let holder = Holder::parse("60:27-34x50,63x26", &tool).unwrap();
        let record = ToolRecord {
            id: "T1".into(),
            tool,
            holder: Some(holder),
            setup_stick_out_mm: Default::default(),
        };
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
