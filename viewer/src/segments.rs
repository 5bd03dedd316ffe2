use claymill_nurbs::Point3;
use rayon::prelude::*;

use crate::camera::Camera;
use crate::scene::{LineLayer, Scene, Strip};

/// Passes that would come closer together than this in a picture are thinned out, pixels.
pub const CLOSEST_PASSES_PX: f64 = 4.5;
/// A point that moves the drawn line by less than this is left out, pixels.
const DECIMATION_PX: f64 = 0.3;
/// Points that one drawn segment may stand for: bounds the work of testing them again.
const LONGEST_RUN: usize = 64;
/// Opacity of the passes between the emphasised ones.
const FAINT: f32 = 0.16;
/// Passes closer together than this are only a veil: those between the emphasised ones are left out, pixels.
const CLOSEST_FAINT_PX: f64 = 1.8;

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

/// Every how many passes one is drawn in full, for passes `spacing_mm` apart: 1, 2, 5, 10, 20, 50, …
pub(crate) fn emphasis_step(spacing_mm: Option<f64>, mm_per_px: f64) -> u32 {
    let Some(spacing_mm) = spacing_mm.filter(|s| *s > 0.0) else {
        return 1;
    };
    let needed = CLOSEST_PASSES_PX * mm_per_px / spacing_mm;
    let mut decade = 1;
    loop {
        for digit in [1, 2, 5] {
            if f64::from(digit * decade) >= needed || decade >= 100_000 {
                return digit * decade;
            }
        }
        decade *= 10;
    }
}

/// The segments of a layer that matter in this picture, in drawing order: points that do not show are
/// dropped, and so are segments outside the frame.
pub(crate) fn visible_segments(
    scene: &Scene,
    layer: &LineLayer,
    camera: &Camera,
    size: [u32; 2],
) -> Vec<Segment> {
    let step = emphasis_step(layer.spacing_mm, camera.mm_per_px());
    // Enough for the whole width of a line on a surface that slopes at 45 degrees to the line of sight.
    let lift_px = 1.0 + 0.5 * f64::from(layer.width_px);
    let lift_mm = (scene.deviation_mm + lift_px * camera.mm_per_px()) as f32;
    let emphasised = |s: &Strip| s.pass.is_multiple_of(step);
    let draw = |strip: &Strip| {
        let (width_px, opacity) =
            if emphasised(strip) { (layer.width_px, layer.opacity) } else { (1.0, layer.opacity * FAINT) };
        let [r, g, b] = strip.colour;
        let colour = [r, g, b, (opacity * 255.0).round() as u8];
        let points = &layer.points[strip.first..strip.first + strip.count];
        let ends = strip_segments(points, &scene.origin, camera, size, width_px);
        ends.into_iter().map(move |[a, b]| Segment { a, width_px, b, lift_mm, colour })
    };
    let (strong, mut faint): (Vec<&Strip>, Vec<&Strip>) = layer.strips.iter().partition(|s| emphasised(s));
    if layer.spacing_mm.is_some_and(|mm| mm < CLOSEST_FAINT_PX * camera.mm_per_px()) {
        faint.clear();
    }
    // The faint ones first: they must not veil the emphasised ones.
    [faint, strong].concat().into_par_iter().flat_map_iter(draw).collect()
}

fn strip_segments(
    points: &[[f32; 3]],
    origin: &Point3,
    camera: &Camera,
    size: [u32; 2],
    width_px: f32,
) -> Vec<[[f32; 3]; 2]> {
    let project = |p: &[f32; 3]| camera.project(&(Point3::from(p.map(f64::from)) + origin.coords));
    let pixels: Vec<Option<[f64; 2]>> = points.iter().map(project).collect();
    let border = f64::from(width_px) + 1.0;
    let outside = |p: [f64; 2], q: [f64; 2]| {
        (0..2).any(|i| p[i].max(q[i]) < -border || p[i].min(q[i]) > f64::from(size[i]) + border)
    };
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
            if pixels[next].is_some_and(|to| !outside(from, to)) {
                kept.push([points[anchor], points[next]]);
            }
        }
        anchor = next;
    }
    kept
}

fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let length2 = dx * dx + dy * dy;
    let t = if length2 > 0.0 {
        (((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / length2).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p[0] - a[0] - t * dx).hypot(p[1] - a[1] - t * dy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Axes, View};

    #[test]
    fn emphasis_keeps_passes_apart() {
        assert_eq!(emphasis_step(None, 100.0), 1);
        assert_eq!(emphasis_step(Some(2.8), 0.1), 1);
        // 4.5 px of 2.5 mm are 11.25 mm: four passes of 2.8 mm are too few, five are enough.
        assert_eq!(emphasis_step(Some(2.8), 2.5), 5);
        assert_eq!(emphasis_step(Some(2.8), 25.0), 50);
    }

    #[test]
    fn passes_between_the_emphasised_ones_fade_and_then_go() {
        let mut layer =
            LineLayer { width_px: 1.5, opacity: 1.0, spacing_mm: Some(1.0), ..LineLayer::default() };
        for pass in 0..100 {
            let y = f64::from(pass);
            let ends = [Point3::new(0.0, y, 0.0), Point3::new(99.0, y, 0.0)];
            layer.add(ends.iter(), &Point3::origin(), [0, 0, 0], pass);
        }
        let scene = Scene { lines: vec![layer], ..Scene::default() };
        // Pictures in which passes are about 8.8, 2.6 and 0.9 px apart.
        for (side, expected) in [(1000, (100, 0)), (300, (50, 50)), (100, (10, 0))] {
            let view = View::top(&Axes::default());
            let camera = Camera::frame(&view, scene.points(), [side; 2]);
            let segments = visible_segments(&scene, &scene.lines[0], &camera, [side; 2]);
            let strong = segments.iter().filter(|s| s.colour[3] == 255).count();
            assert_eq!((strong, segments.len() - strong), expected, "{} mm/px", camera.mm_per_px());
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
        let segments = visible_segments(&scene, &scene.lines[0], &camera, size);
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
}
