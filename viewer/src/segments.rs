//! From line layers to the segments that one picture needs: thinned passes, decimated points,
//! nothing outside the frame, lifted off the surface.

use claymill_nurbs::{Point3, Vector3};
use rayon::prelude::*;

use crate::camera::Camera;
use crate::palette::Rgb;
use crate::scene::Scene;
use crate::shapes::LineLayer;
use crate::thinning::evenly_spaced;

/// Passes that would come closer together than this in a picture are thinned out, pixels.
pub const CLOSEST_PASSES_PX: f64 = 4.0;
/// A point that moves the drawn line by less than this is left out, pixels.
const DECIMATION_PX: f64 = 0.3;
/// The same along the line of sight: a chord that sinks into a surface by more is hidden by it. Lines are
/// lifted by more than this.
const DEPTH_DECIMATION_PX: f64 = 0.6;
/// Points that one drawn segment may stand for: bounds the work of testing them again.
const LONGEST_RUN: usize = 64;
/// A line segment as the graphics card reads it.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Segment {
    pub(crate) a: [f32; 3],
    pub(crate) width_px: f32,
    pub(crate) b: [f32; 3],
    pub(crate) lift_mm: f32,
    pub(crate) colour: [u8; 4],
}

/// What of a layer is drawn in a picture.
#[derive(Debug, Default)]
pub(crate) struct VisibleLines {
    pub(crate) segments: Vec<Segment>,
    /// Drawn part of what a thinned layer holds within the frame; 1 when nothing is left out.
    pub(crate) share: f32,
}

/// The segments of a layer that matter in this picture, in drawing order: passes are thinned out where they
/// crowd, and points that do not show and segments outside the frame are dropped.
pub(crate) fn visible_lines(
    scene: &Scene,
    layer: &LineLayer,
    camera: &Camera,
    size: [u32; 2],
) -> VisibleLines {
    // Enough for the whole width of a line on a surface that slopes at 45 degrees to the line of sight.
    let lift_px = 1.0 + 0.5 * f64::from(layer.width_px);
    let lift_mm = (scene.deviation_mm + lift_px * camera.mm_per_px()) as f32;
    let frame = Frame { scene, camera, size, border_px: f64::from(layer.width_px) + 1.0 };
    let draw = |(colour, points): (Rgb, &[[f32; 3]])| {
        let colour = [colour[0], colour[1], colour[2], (layer.opacity * 255.0).round() as u8];
        let lines = frame.segments(points).into_iter().map(|ends| (ends, layer.width_px));
        let dots = frame.dots(points, layer.dots_px).into_iter().map(|p| ([p, p], layer.dots_px));
        let all: Vec<_> = lines.chain(dots).collect();
        all.into_iter().map(move |([a, b], width_px)| Segment { a, width_px, b, lift_mm, colour })
    };
    if !layer.thinned {
        let strips = layer.strips.par_iter();
        let all = strips.map(|s| (s.colour, &layer.points[s.first..s.first + s.count]));
        return VisibleLines { segments: all.flat_map_iter(draw).collect(), share: 1.0 };
    }
    let spacing_mm = (CLOSEST_PASSES_PX * camera.mm_per_px()) as f32;
    let whole = frame.holds(&layer.points);
    let thinned = evenly_spaced(layer, spacing_mm, |a, b| whole || frame.touches(a, b));
    let runs = thinned.runs.par_iter().map(|r| (layer.strips[r.strip].colour, r.points.as_slice()));
    VisibleLines { segments: runs.flat_map_iter(draw).collect(), share: thinned.share }
}

/// The picture's rectangle as segments meet it.
struct Frame<'a> {
    scene: &'a Scene,
    camera: &'a Camera,
    size: [u32; 2],
    border_px: f64,
}

impl Frame<'_> {
    fn project(&self, p: &[f32; 3]) -> Option<[f64; 2]> {
        self.camera.project(&(Point3::from(p.map(f64::from)) + self.scene.origin.coords))
    }

    fn outside(&self, p: &[f64], q: &[f64]) -> bool {
        (0..2).any(|i| {
            p[i].max(q[i]) < -self.border_px || p[i].min(q[i]) > f64::from(self.size[i]) + self.border_px
        })
    }

    /// Whether all points are in the picture, as the corners of a box around them are.
    fn holds(&self, points: &[[f32; 3]]) -> bool {
        let around = |[low, high]: [[f32; 3]; 2], p: &[f32; 3]| {
            [[0, 1, 2].map(|k| low[k].min(p[k])), [0, 1, 2].map(|k| high[k].max(p[k]))]
        };
        let bounds = points.iter().fold([[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]], around);
        (0..8_usize).all(|i| {
            let corner = [0, 1, 2].map(|k| bounds[i >> k & 1][k]);
            self.project(&corner).is_some_and(|p| !self.outside(&p, &p))
        })
    }

    fn touches(&self, a: &[f32; 3], b: &[f32; 3]) -> bool {
        matches!((self.project(a), self.project(b)), (Some(p), Some(q)) if !self.outside(&p, &q))
    }

    /// Pixel coordinates and the depth in units of the depth's tolerance.
    fn project_with_depth(&self, p: &[f32; 3]) -> Option<[f64; 3]> {
        let [x, y] = self.project(p)?;
        let toward_eye_mm = self.camera.in_picture(&Vector3::from(p.map(f64::from))).z;
        let depth = toward_eye_mm / self.camera.mm_per_px() * (DECIMATION_PX / DEPTH_DECIMATION_PX);
        Some([x, y, depth])
    }

    /// The points that get a dot of this size: none closer than a few dots to its neighbours on the line.
    fn dots(&self, points: &[[f32; 3]], size_px: f32) -> Vec<[f32; 3]> {
        const DOTS_APART: f64 = 2.5;
        if size_px <= 0.0 {
            return Vec::new();
        }
        let pixels: Vec<Option<[f64; 2]>> = points.iter().map(|p| self.project(p)).collect();
        let apart = |i: usize, j: usize| match (pixels[i], pixels[j]) {
            (Some(a), Some(b)) => (a[0] - b[0]).hypot(a[1] - b[1]) >= DOTS_APART * f64::from(size_px),
            _ => true,
        };
        let shown = |i: usize| {
            let inside = pixels[i].is_some_and(|p| !self.outside(&p, &p));
            let end = i + 1 == points.len();
            inside && (i == 0 || apart(i - 1, i)) && (end || apart(i, i + 1))
        };
        (0..points.len()).filter(|&i| shown(i)).map(|i| points[i]).collect()
    }

    /// The polyline's segments, without points that do not show and without segments outside.
    fn segments(&self, points: &[[f32; 3]]) -> Vec<[[f32; 3]; 2]> {
        let pixels: Vec<Option<[f64; 3]>> = points.iter().map(|p| self.project_with_depth(p)).collect();
        let mut kept = Vec::new();
        let mut anchor = 0;
        while anchor + 1 < points.len() {
            let mut next = anchor + 1;
            if let Some(from) = pixels[anchor] {
                while next + 1 < points.len() && next - anchor < LONGEST_RUN {
                    let Some(to) = pixels[next + 1] else { break };
                    let dropped = &pixels[anchor + 1..=next];
                    if !dropped.iter().flatten().all(|p| distance(*p, from, to) < DECIMATION_PX) {
                        break;
                    }
                    next += 1;
                }
                if pixels[next].is_some_and(|to| !self.outside(&from, &to)) {
                    kept.push([points[anchor], points[next]]);
                }
            }
            anchor = next;
        }
        kept
    }
}

fn distance(p: [f64; 3], a: [f64; 3], b: [f64; 3]) -> f64 {
    let [p, a, b] = [p, a, b].map(Vector3::from);
    let d = b - a;
    let length2 = d.norm_squared();
    let t = if length2 > 0.0 { ((p - a).dot(&d) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (p - a - d * t).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Axes, View};

    #[test]
    fn passes_closer_than_the_limit_are_thinned_and_others_are_not() {
        let mut layer = LineLayer { width_px: 1.5, opacity: 1.0, thinned: true, ..LineLayer::default() };
        for pass in 0..100 {
            let y = f64::from(pass);
            let ends = [Point3::new(0.0, y, 0.0), Point3::new(99.0, y, 0.0)];
            layer.add(ends.iter(), &Point3::origin(), [0, 0, 0], pass);
        }
        let scene = Scene { lines: vec![layer], ..Scene::default() };
        // Pictures in which passes are about 8.8, 2.6 and 0.9 px apart.
        for (side, step) in [(1000, 1), (300, 2), (100, 5)] {
            let view = View::top(&Axes::default());
            let camera = Camera::frame(&view, scene.points(), [side; 2]);
            let drawn = visible_lines(&scene, &scene.lines[0], &camera, [side; 2]);
            let rows: Vec<f32> = drawn.segments.iter().map(|s| s.a[1]).collect();
            let expected: Vec<f32> = (0..100_u8).step_by(step).map(f32::from).collect();
            assert_eq!(rows, expected, "{} mm/px", camera.mm_per_px());
        }
    }

    #[test]
    fn decimation_stays_within_its_tolerance_and_drops_most() {
        // A circle of radius 100 mm in 20 000 chords.
        let circle: Vec<Point3> = (0..=20_000)
            .map(|i| {
                let t = f64::from(i) / 20_000.0 * std::f64::consts::TAU;
                Point3::new(100.0 * t.cos(), 100.0 * t.sin(), 0.0)
            })
            .collect();
        let mut scene = Scene::default();
        let mut layer = LineLayer { width_px: 1.0, opacity: 1.0, ..LineLayer::default() };
        layer.add(circle.iter(), &scene.origin, [0, 0, 0], 0);
        scene.lines.push(layer);
        let size = [400, 400];
        let camera = Camera::frame(&View::top(&Axes::default()), scene.points(), size);
        let segments = visible_lines(&scene, &scene.lines[0], &camera, size).segments;
        assert!(segments.len() < 1_000, "{} segments", segments.len());
        let sagitta_px = |s: &Segment| {
            let middle = [0, 1].map(|i| 0.5 * f64::from(s.a[i] + s.b[i]));
            (100.0 - middle[0].hypot(middle[1])) / camera.mm_per_px()
        };
        let worst = segments.iter().map(sagitta_px).fold(0.0, f64::max);
        assert!(worst < DECIMATION_PX, "{worst} px");
        for pair in segments.windows(2) {
            assert_eq!(pair[0].b, pair[1].a, "segments hang together");
        }
    }

    #[test]
    fn lines_over_a_bulge_do_not_cut_through_it_where_they_look_straight() {
        // From above an arc in the plane y = 0 is a straight line.
        let arc: Vec<Point3> = (0..=400)
            .map(|i| {
                let t = f64::from(i) / 400.0 * std::f64::consts::PI;
                Point3::new(-100.0 * t.cos(), 0.0, 100.0 * t.sin())
            })
            .collect();
        let mut scene = Scene::default();
        let mut layer = LineLayer { width_px: 1.0, opacity: 1.0, ..LineLayer::default() };
        layer.add(arc.iter(), &scene.origin, [0, 0, 0], 0);
        scene.lines.push(layer);
        let size = [400, 400];
        let camera = Camera::frame(&View::top(&Axes::default()), scene.points(), size);
        let segments = visible_lines(&scene, &scene.lines[0], &camera, size).segments;
        assert!(segments.len() < 60, "{} segments", segments.len());
        let sunk_px = |s: &Segment| {
            let middle = [0, 2].map(|i| 0.5 * f64::from(s.a[i] + s.b[i]));
            (100.0 - middle[0].hypot(middle[1])) / camera.mm_per_px()
        };
        let worst = segments.iter().map(sunk_px).fold(0.0, f64::max);
        assert!(worst < DEPTH_DECIMATION_PX, "{worst} px");
    }
}
