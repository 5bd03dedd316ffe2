//! Markers for places in a picture: five shapes, so that kinds differ without colour too.

use std::collections::BTreeSet;

use claymill_nurbs::Point3;

use crate::camera::Camera;
use crate::lettering::draw_strokes;
use crate::palette::Rgb;
use crate::picture::Picture;

/// The shape of a [`Pin`]: with the colour it tells kinds apart, also for the colour-blind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PinShape {
    /// A ring.
    Ring,
    /// A square on its side.
    Square,
    /// A square on its corner.
    Diamond,
    /// A triangle on its side.
    Triangle,
    /// Two crossed lines.
    Cross,
}

/// A place that is marked, whatever stands before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pin {
    /// Where, mm.
    pub at: Point3,
    /// Its shape.
    pub shape: PinShape,
    /// Its colour.
    pub colour: Rgb,
}

/// Draws pins around their places; those of one kind that would cover each other are drawn once.
pub(crate) fn draw_pins(picture: &mut Picture, pins: &[Pin], camera: &Camera, letter: f32) {
    let mut drawn = BTreeSet::new();
    for pin in pins {
        let Some(at) = camera.project(&pin.at) else { continue };
        let centre = at.map(|c| c as f32);
        let inside = (0.0..picture.width as f32).contains(&centre[0])
            && (0.0..picture.height as f32).contains(&centre[1]);
        let cell = centre.map(|c| (c / (0.5 * letter)) as i64);
        if inside && drawn.insert((cell, pin.shape, pin.colour)) {
            draw_pin(picture, pin.shape, pin.colour, centre, letter);
        }
    }
}

/// One sign of the height of a capital.
pub(crate) fn draw_pin(picture: &mut Picture, shape: PinShape, colour: Rgb, centre: [f32; 2], letter: f32) {
    let segments = outline(shape, centre, 0.75 * letter);
    // A pale border, so that the sign stands out from whatever is behind it.
    draw_strokes(picture, &segments, 0.5 * letter, [255, 255, 255], 0.75);
    draw_strokes(picture, &segments, 0.24 * letter, colour, 1.0);
}

fn outline(shape: PinShape, [x, y]: [f32; 2], radius: f32) -> Vec<[[f32; 2]; 2]> {
    let corner = |turn: f32| {
        let (sin, cos) = (turn * std::f32::consts::TAU).sin_cos();
        [x + radius * cos, y - radius * sin]
    };
    // Corners of a polygon, the first one at this part of a turn.
    let polygon = |corners: u8, first: f32| {
        let at = |i: u8| corner(first + f32::from(i) / f32::from(corners));
        (0..corners).map(|i| [at(i), at(i + 1)]).collect()
    };
    match shape {
        PinShape::Ring => polygon(24, 0.0),
        PinShape::Square => polygon(4, 0.125),
        PinShape::Diamond => polygon(4, 0.0),
        PinShape::Triangle => polygon(3, 0.25),
        PinShape::Cross => vec![[corner(0.125), corner(0.625)], [corner(0.375), corner(0.875)]],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Axes, View};

    #[test]
    fn a_pin_surrounds_its_place_in_its_colour() {
        let size = [200, 100];
        let corners = [Point3::new(-10.0, -10.0, -10.0), Point3::new(10.0, 10.0, 10.0)];
        let camera = Camera::frame(&View::top(&Axes::default()), corners.into_iter(), size);
        let at = Point3::new(1.0, 2.0, 3.0);
        let [x, y] = camera.project(&at).unwrap().map(|c| c as u32);
        for shape in
            [PinShape::Ring, PinShape::Square, PinShape::Diamond, PinShape::Triangle, PinShape::Cross]
        {
            let mut picture = Picture { width: size[0], height: size[1], rgba: vec![255; 4 * 200 * 100] };
            let colour = [200, 10, 30];
            draw_pins(&mut picture, &[Pin { at, shape, colour }; 2], &camera, 12.0);
            let near = |px: u32, py: u32| px.abs_diff(x).max(py.abs_diff(y)) <= 12;
            let painted = |px: u32, py: u32| picture.pixel(px, py) == [200, 10, 30, 255];
            let all: Vec<_> = (0..100).flat_map(|py| (0..200).map(move |px| (px, py))).collect();
            assert!(all.iter().filter(|p| painted(p.0, p.1)).count() > 20, "{shape:?}");
            assert!(all.iter().all(|p| near(p.0, p.1) || picture.pixel(p.0, p.1) == [255; 4]), "{shape:?}");
        }
    }
}
