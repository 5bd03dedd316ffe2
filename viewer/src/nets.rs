//! Control points: of the surfaces, and of the tool paths.

use claymill_nurbs::{Model, Point3, Vector3};
use claymill_toolpath::{MoveKind, Program, ToolRecord};

use crate::legend::{LegendEntry, Mark};
use crate::palette::Rgb;
use crate::scene::Scene;
use crate::shapes::LineLayer;
use crate::strokes::consecutive_passes;

const NET: Rgb = [108, 58, 150];
const POLYGON: Rgb = [20, 96, 110];

impl Scene {
    /// Adds the control net of every surface: lines between neighbouring control points, with dots from near by.
    pub fn add_control_nets(&mut self, model: &Model) {
        let lines = model.faces.iter().flat_map(|face| {
            let surface = &face.surface;
            let (rows, columns) = surface.size();
            let along =
                move |i: usize| (0..columns).map(move |j| surface.control_point(i, j)).collect::<Vec<_>>();
            let across =
                move |j: usize| (0..rows).map(move |i| surface.control_point(i, j)).collect::<Vec<_>>();
            (0..rows).map(along).chain((0..columns).map(across)).collect::<Vec<_>>()
        });
        let points: usize = model.faces.iter().map(|f| f.surface.net().len()).sum();
        let lines: Vec<(Vec<Point3>, u32)> = lines.map(|l| (l, 0)).collect();
        self.add_net(&lines, NET, false);
        self.say(NET, format!("control nets: {points} points"));
    }

    /// Adds the control polygons of cuts and links, with dots from near by. They are drawn at the ball's middle, where
    /// no surface hides them; moves hold the tip.
    pub fn add_control_polygons(&mut self, program: &Program, tools: &[ToolRecord]) {
        let passes = consecutive_passes(&program.moves);
        let shown = |kind: MoveKind| matches!(kind, MoveKind::Cut | MoveKind::Link);
        let lines: Vec<(Vec<Point3>, u32)> = (program.moves.iter().zip(passes))
            .filter(|(m, _)| shown(m.kind))
            .map(|(m, pass)| {
                let radius_mm = tools.iter().find(|t| t.id == m.tool).map_or(0.0, |t| t.tool.radius_mm());
                let up = Vector3::from(m.axis_start) * radius_mm;
                (m.points.iter().map(|p| Point3::from(*p) + up).collect(), pass)
            })
            .collect();
        let points: usize = lines.iter().map(|(l, _)| l.len()).sum();
        self.add_net(&lines, POLYGON, true);
        self.say(POLYGON, format!("control polygons of the ball's middle: {points} points"));
    }

    fn add_net(&mut self, lines: &[(Vec<Point3>, u32)], colour: Rgb, thinned: bool) {
        let mut layer =
            LineLayer { width_px: 1.0, opacity: 1.0, dots_px: 4.5, thinned, ..LineLayer::default() };
        for (line, pass) in lines {
            layer.add(line.iter(), &self.origin, colour, *pass);
        }
        self.lines.push(layer);
    }

    fn say(&mut self, colour: Rgb, text: String) {
        self.legend.push(LegendEntry { mark: Mark::Line(2.0), colour, text });
    }
}
