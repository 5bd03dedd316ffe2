//! A job in time: the tool on its way, and what it has cut by then.
//!
//! ```text
//!   moves ──► polylines with the times between which they are drawn ─┐
//!   seconds of each move (kinematics) ──► where the tool is ─────────┴─► a scene at any time
//! ```

use claymill_nurbs::{Aabb, Vector3};
use claymill_toolpath::{MoveKind, Program};

use crate::camera::View;
use crate::course::Course;
use crate::palette::Rgb;
use crate::pins::{Pin, PinShape};
use crate::scene::Scene;
use crate::shapes::{LineKind, LineLayer, Strip};
use crate::strokes::{PathColours, StrokeStyle, consecutive_passes, drawn_moves};
use crate::tool::PosedTool;

/// Colour of the mark at the tool's tip.
const MARK: Rgb = [205, 62, 0];
/// Free border around the model, for the tool beside it.
const MARGIN: f64 = 0.1;

/// A polyline and when it is drawn, s.
#[derive(Debug, Clone, Copy)]
struct Timed {
    strip: Strip,
    from_s: f64,
    to_s: f64,
}

/// A job that can be seen at any time.
#[derive(Debug, Clone)]
pub struct Reel {
    bare: Scene,
    layers: Vec<(LineLayer, Vec<Timed>)>,
    course: Course,
}

impl Reel {
    /// From a scene of the model without paths, the moves, and the seconds that each takes.
    #[must_use]
    pub fn new(mut bare: Scene, program: &Program, seconds: &[f64], style: &StrokeStyle<'_>) -> Self {
        let drawn = drawn_moves(&bare, program, style);
        let passes = consecutive_passes(&program.moves);
        let colours = PathColours::new(program, style);
        let mut layers: Vec<(LineLayer, Vec<Timed>)> =
            [(LineKind::Link, 1.4), (LineKind::Lead, 1.4), (LineKind::Cut, 1.5)]
                .map(|(kind, width_px)| {
                    let thinned = kind != LineKind::Lead;
                    (LineLayer { kind, width_px, opacity: 1.0, thinned, ..LineLayer::default() }, Vec::new())
                })
                .into();
        bare.framed = bare.points().collect();
        let mut now_s = 0.0;
        for (((m, parts), &pass), &took_s) in program.moves.iter().zip(&drawn).zip(&passes).zip(seconds) {
            let layer = match m.kind {
                MoveKind::Link => Some(0),
                MoveKind::LeadIn | MoveKind::LeadOut => Some(1),
                MoveKind::Cut => Some(2),
                MoveKind::Rapid => None,
            };
            if let Some((layer, times)) = layer.map(|l| &mut layers[l]) {
                let colour = colours.of(m);
                for part in parts.iter().flatten() {
                    let before = layer.strips.len();
                    layer.add(part.iter(), &bare.origin, colour, pass);
                    let added = layer.strips[before..].iter();
                    times.extend(added.map(|&strip| Timed { strip, from_s: now_s, to_s: now_s + took_s }));
                }
            }
            now_s += took_s;
        }
        for (layer, _) in &mut layers {
            layer.strips.clear();
        }
        Reel { bare, layers, course: Course::new(program, seconds, style.tools) }
    }

    /// How long the job takes, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.course.duration_s()
    }

    /// The view that holds the model all the time; or, with `follow_mm`, a box of that size around the tip.
    #[must_use]
    pub fn view(&self, view: &View, at_s: f64, follow_mm: Option<f64>) -> View {
        let name = view.name.clone();
        match (follow_mm, self.course.station(at_s)) {
            (Some(size), Some(s)) => {
                let half = Vector3::repeat(0.5 * size);
                view.clone().focused(&name, Aabb { min: s.tip - half, max: s.tip + half })
            }
            _ => View { margin: MARGIN, ..view.clone() },
        }
    }

    /// What is to be seen at a time.
    #[must_use]
    pub fn scene(&self, at_s: f64) -> Scene {
        let mut scene = self.bare.clone();
        for (layer, times) in &self.layers {
            let strips = times.iter().take_while(|t| t.from_s <= at_s).map(|t| Strip {
                count: if t.to_s <= at_s {
                    t.strip.count
                } else {
                    let share = (at_s - t.from_s) / (t.to_s - t.from_s).max(1e-9);
                    ((t.strip.count as f64 * share) as usize).max(2)
                },
                ..t.strip
            });
            let strips: Vec<Strip> = strips.collect();
            if !strips.is_empty() {
                scene.lines.push(LineLayer { strips, ..layer.clone() });
            }
        }
        let setup = self.course.setups.iter().rfind(|l| l.begin_s <= at_s).map_or("", |l| l.setup.as_str());
        let clock = |s: f64| format!("{}:{:02}:{:02}", s as u64 / 3600, s as u64 / 60 % 60, s as u64 % 60);
        scene.caption.truncate(1);
        scene.caption.push(format!("setup {setup}, {} of {}", clock(at_s), clock(self.duration_s())));
        if let Some(tool) = self.tool(at_s) {
            scene.add_posed_tool(&tool);
            scene.pins.push(Pin { at: tool.tip, shape: PinShape::Ring, colour: MARK });
        }
        scene
    }

    /// The model without paths and tool.
    #[must_use]
    pub fn bare(&self) -> &Scene {
        &self.bare
    }

    /// Where the tool is.
    #[must_use]
    pub fn course(&self) -> &Course {
        &self.course
    }

    /// The tool as it stands at a time; none where no tool of the job is at work.
    #[must_use]
    pub fn tool(&self, at_s: f64) -> Option<PosedTool<'_>> {
        self.course.tool(at_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::SurfaceVertex;
    use claymill_nurbs::Point3;
    use claymill_toolpath::{Move, Tool, ToolRecord};

    /// Two passes of 100 mm, ten seconds each, with a link of two seconds between them.
    fn reel() -> Reel {
        let step = |kind, pass, from: [f64; 3], to: [f64; 3]| Move {
            setup: "top".into(),
            tool: "T1".into(),
            pass,
            ..Move::straight(kind, from.into(), to.into(), Vector3::z(), 6000.0)
        };
        let moves = vec![
            step(MoveKind::Cut, 1, [0.0, 0.0, 0.0], [100.0, 0.0, 0.0]),
            step(MoveKind::Link, 2, [100.0, 0.0, 0.0], [100.0, 3.0, 0.0]),
            step(MoveKind::Cut, 2, [100.0, 3.0, 0.0], [0.0, 3.0, 0.0]),
        ];
        let tools = [ToolRecord {
            id: "T1".into(),
            tool: Tool::ball(5.0),
            holder: None,
            setup_stick_out_mm: Default::default(),
        }];
        let style = StrokeStyle { tools: &tools, ..StrokeStyle::new(0.1) };
        let mut bare = Scene::new(Point3::origin());
        let corner =
            |x, y| SurfaceVertex { position: [x, y, -9.0], normal: [0.0, 0.0, 1.0], colour: [90; 4] };
        bare.add_triangles(&[corner(0.0, 0.0), corner(100.0, 0.0), corner(0.0, 3.0)], &[[0, 1, 2]]);
        Reel::new(bare, &Program { moves }, &[10.0, 2.0, 10.0], &style)
    }

    #[test]
    fn the_tool_is_where_the_time_says() {
        let reel = reel();
        assert_eq!(reel.duration_s(), 22.0);
        for (at_s, x, y) in
            [(0.0, 0.0, 0.0), (5.0, 50.0, 0.0), (11.0, 100.0, 1.5), (17.0, 50.0, 3.0), (22.0, 0.0, 3.0)]
        {
            let s = reel.course.station(at_s).unwrap();
            approx::assert_abs_diff_eq!(s.tip, Point3::new(x, y, 0.0), epsilon = 1e-9);
            let scene = reel.scene(at_s);
            let drawn =
                scene.surfaces[0].vertices[3..].iter().map(|v| Point3::from(v.position.map(f64::from)));
            let lowest = drawn.min_by(|a, b| a.z.total_cmp(&b.z)).unwrap();
            approx::assert_abs_diff_eq!(lowest, s.tip, epsilon = 1e-4);
        }
    }

    #[test]
    fn only_what_was_cut_by_then_is_drawn_and_the_view_stands_still() {
        let reel = reel();
        let strips = |at_s: f64| {
            let of = |kind| move |l: &&LineLayer| l.kind == kind;
            let scene = reel.scene(at_s);
            [LineKind::Cut, LineKind::Link]
                .map(|kind| scene.lines.iter().find(of(kind)).map_or(0, |l| l.strips.len()))
        };
        assert_eq!([strips(3.0), strips(10.5), strips(13.0)], [[1, 0], [1, 1], [2, 1]]);
        let view = View::looking("top", -Vector3::z(), Vector3::y());
        let framed = |at_s: f64| reel.scene(at_s).points().collect::<Vec<_>>();
        assert_eq!(framed(0.0), framed(15.0));
        assert!(reel.view(&view, 15.0, None).focus.is_none());
        let near = reel.view(&view, 5.0, Some(40.0)).focus.unwrap();
        approx::assert_abs_diff_eq!(near.centre(), Point3::new(50.0, 0.0, 0.0), epsilon = 1e-9);
    }
}
