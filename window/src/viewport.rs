//! The picture in the middle: what the hand does there, and what is written over it.
//!
//! ```text
//!   left click      picks                     left or middle drag   turns about what is under the pointer
//!   wheel, pinch    zooms to the pointer      right or shift drag   moves
//!                                             ctrl drag             zooms
//!   trackpad        two fingers turn, with shift move, with ctrl zoom
//! ```

use claymill_nurbs::{Point3, Vector3};
use egui::{
    Align2, Color32, Event, Key, Modifiers, MouseWheelUnit, Painter, PointerButton, Pos2, Rect, Stroke, Ui,
    pos2, vec2,
};

use crate::desk::{Desk, Tool};
use crate::widgets::over_picture;

/// A wheel's notch makes everything so much larger.
const NOTCH: f64 = 1.2;
/// Pixels of a drag that doubles the scale.
const ZOOM_DRAG_PX: f64 = 160.0;

const MEASURE: Color32 = Color32::from_rgb(200, 30, 90);

/// What a drag does, and what it holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Drag {
    held: Point3,
    button: PointerButton,
}

/// Whether the picture has to be drawn anew because the camera moved.
pub(crate) fn input(
    ui: &Ui,
    response: &egui::Response,
    desk: &mut Desk<'_>,
    drag: &mut Option<Drag>,
) -> bool {
    let px = f64::from(ui.ctx().pixels_per_point());
    let rect = response.rect;
    let place = |p: Pos2| [f64::from(p.x - rect.min.x) * px, f64::from(p.y - rect.min.y) * px];
    let before = desk.sight.clone();
    let pointer = ui.input(|i| i.pointer.latest_pos());
    if response.clicked()
        && let Some(p) = response.interact_pointer_pos()
    {
        desk.click(place(p));
    }
    if response.double_clicked()
        && let Some(p) = response.interact_pointer_pos()
    {
        let held = desk.hold(place(p));
        desk.sight.zoom(&held, 2.0);
    }
    let buttons = [PointerButton::Primary, PointerButton::Middle, PointerButton::Secondary];
    let down = buttons.into_iter().find(|b| response.dragged_by(*b));
    match (down, *drag) {
        (Some(button), None) => {
            let from = ui.input(|i| i.pointer.press_origin()).or(pointer).unwrap_or(rect.center());
            *drag = Some(Drag { held: desk.hold(place(from)), button });
        }
        (None, Some(_)) => *drag = None,
        _ => {}
    }
    if let Some(Drag { held, button }) = *drag {
        let delta = response.drag_delta();
        let delta_px = [f64::from(delta.x) * px, f64::from(delta.y) * px];
        let modifiers = ui.input(|i| i.modifiers);
        match button {
            _ if modifiers.command => desk.sight.zoom(&held, 2.0_f64.powf(-delta_px[1] / ZOOM_DRAG_PX)),
            PointerButton::Secondary => desk.sight.pan(&held, delta_px),
            _ if modifiers.shift => desk.sight.pan(&held, delta_px),
            _ => desk.sight.orbit(&held, delta_px),
        }
    }
    if response.hovered()
        && let Some(p) = pointer
    {
        wheel(ui, desk, place(p), px);
    }
    desk.sight != before
}

fn wheel(ui: &Ui, desk: &mut Desk<'_>, at_px: [f64; 2], px: f64) {
    let events = ui.input(|i| i.events.clone());
    for event in events {
        match event {
            Event::MouseWheel { unit, delta, modifiers, .. } => {
                let (x, y) = (f64::from(delta.x), f64::from(delta.y));
                let held = desk.hold(at_px);
                match unit {
                    // Fingers on a pad.
                    MouseWheelUnit::Point if modifiers.shift => desk.sight.pan(&held, [x * px, y * px]),
                    MouseWheelUnit::Point if !modifiers.command => desk.sight.orbit(&held, [x * px, y * px]),
                    MouseWheelUnit::Point => desk.sight.zoom(&held, NOTCH.powf(y / 40.0)),
                    MouseWheelUnit::Line => desk.sight.zoom(&held, NOTCH.powf(y)),
                    MouseWheelUnit::Page => desk.sight.zoom(&held, NOTCH.powf(4.0 * y)),
                }
            }
            Event::Zoom(factor) => {
                let held = desk.hold(at_px);
                desk.sight.zoom(&held, f64::from(factor));
            }
            _ => {}
        }
    }
}

/// Keys, when no field takes them. Returns whether the picture changes.
pub(crate) fn keys(ui: &Ui, desk: &mut Desk<'_>) {
    if ui.ctx().egui_wants_keyboard_input() {
        return;
    }
    let pressed = |key| ui.input_mut(|i| i.consume_key(Modifiers::NONE, key));
    let views = [
        (Key::I, "iso"),
        (Key::T, "top"),
        (Key::L, "left"),
        (Key::R, "right"),
        (Key::F, "front"),
        (Key::B, "rear"),
    ];
    for (key, view) in views {
        if pressed(key) {
            desk.look(view);
        }
    }
    if pressed(Key::Home) || pressed(Key::A) {
        desk.fit();
    }
    if pressed(Key::P) {
        let perspective = desk.sight.is_perspective();
        desk.sight.set_perspective(!perspective);
    }
    if pressed(Key::X) {
        desk.cutting.on = !desk.cutting.on;
    }
    if pressed(Key::M) {
        desk.tool = if desk.tool == Tool::Measure { Tool::Select } else { Tool::Measure };
    }
    if pressed(Key::Z) {
        desk.layers.zebra = !desk.layers.zebra;
    }
    if pressed(Key::D) {
        desk.dark = !desk.dark;
    }
    if pressed(Key::Space) {
        desk.play();
    }
    if pressed(Key::ArrowRight) {
        desk.step(true);
    }
    if pressed(Key::ArrowLeft) {
        desk.step(false);
    }
    if pressed(Key::Escape) {
        desk.tool = Tool::Select;
        desk.clear();
    }
}

/// Axes, scale, marks and measures over the picture.
pub(crate) fn overlay(ui: &Ui, rect: Rect, desk: &Desk<'_>) {
    let painter = ui.painter_at(rect);
    let px = ui.ctx().pixels_per_point();
    let place = |p: &Point3| {
        let [x, y] = desk.sight.project(p)?;
        let at = pos2(rect.min.x + x as f32 / px, rect.min.y + y as f32 / px);
        rect.contains(at).then_some(at)
    };
    let pointer = ui.input(|i| i.pointer.latest_pos());
    if desk.layers.marks {
        for mark in desk.marks() {
            let Some(at) = place(&mark.at) else { continue };
            let colour =
                if mark.fault { Color32::from_rgb(200, 20, 40) } else { Color32::from_rgb(180, 110, 0) };
            ring(&painter, at, 4.5, colour);
            if pointer.is_some_and(|p| p.distance(at) < 8.0) {
                over_picture(&painter, at + vec2(10.0, -10.0), Align2::LEFT_BOTTOM, &mark.text, desk.dark);
            }
        }
    }
    if let Some(spot) = desk.picked().and_then(|p| p.spot)
        && let Some(at) = place(&spot.point)
    {
        ring(&painter, at, 4.0, Color32::from_rgb(255, 120, 0));
    }
    let ends: Vec<Option<Pos2>> = desk.measured_points().iter().map(|s| place(&s.point)).collect();
    if let ([Some(a), Some(b)], Some(measured)) = (ends.as_slice(), desk.measured()) {
        // Over everything: most of it is inside the model.
        painter.line_segment([*a, *b], Stroke::new(3.6, Color32::from_white_alpha(120)));
        painter.line_segment([*a, *b], Stroke::new(1.6, MEASURE));
        let text = format!("{:.3} mm", measured.distance_mm);
        over_picture(&painter, a.lerp(*b, 0.5) + vec2(0.0, -5.0), Align2::CENTER_BOTTOM, &text, desk.dark);
    }
    for (end, name) in ends.iter().zip(["A", "B"]) {
        let Some(at) = *end else { continue };
        ring(&painter, at, 4.0, MEASURE);
        over_picture(&painter, at + vec2(8.0, -6.0), Align2::LEFT_BOTTOM, name, desk.dark);
    }
    triad(&painter, pos2(rect.min.x + 46.0, rect.max.y - 46.0), desk);
    scale_bar(&painter, rect, desk, px);
}

fn ring(painter: &Painter, at: Pos2, radius: f32, colour: Color32) {
    painter.circle_stroke(at, radius, Stroke::new(3.6, Color32::from_white_alpha(120)));
    painter.circle_stroke(at, radius, Stroke::new(2.0, colour));
}

fn triad(painter: &Painter, centre: Pos2, desk: &Desk<'_>) {
    let ink = if desk.dark { Color32::from_gray(225) } else { Color32::from_gray(40) };
    let sight = &desk.sight;
    let axes = [
        (Vector3::x(), "X", Color32::from_rgb(196, 48, 43)),
        (Vector3::y(), "Y", Color32::from_rgb(40, 134, 60)),
        (Vector3::z(), "Z", Color32::from_rgb(38, 98, 190)),
    ];
    // The nearest last.
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| sight.forward().dot(&axes[b].0).total_cmp(&sight.forward().dot(&axes[a].0)));
    for i in order {
        let (axis, name, colour) = axes[i];
        let way = vec2(sight.right().dot(&axis) as f32, -sight.up().dot(&axis) as f32);
        if way.length() < 0.06 {
            painter.circle_filled(centre, 3.5, colour);
            continue;
        }
        painter.line_segment([centre, centre + way * 26.0], Stroke::new(2.2, colour));
        painter.text(centre + way * 35.0, Align2::CENTER_CENTER, name, egui::FontId::proportional(12.0), ink);
    }
}

fn scale_bar(painter: &Painter, rect: Rect, desk: &Desk<'_>, px: f32) {
    let mm_per_point = desk.sight.mm_per_px() * f64::from(px);
    let most_mm = 150.0 * mm_per_point;
    let decade = 10.0_f64.powf(most_mm.log10().floor());
    let mm = [5.0, 2.0, 1.0].into_iter().map(|k| k * decade).find(|l| *l <= most_mm).unwrap_or(decade);
    let length = (mm / mm_per_point) as f32;
    let ink = if desk.dark { Color32::from_gray(220) } else { Color32::from_gray(50) };
    let (right, y) = (rect.max.x - 18.0, rect.max.y - 16.0);
    let stroke = Stroke::new(1.6, ink);
    painter.line_segment([pos2(right - length, y), pos2(right, y)], stroke);
    for x in [right - length, right] {
        painter.line_segment([pos2(x, y - 4.0), pos2(x, y + 4.0)], stroke);
    }
    let text = match mm {
        l if l >= 1000.0 => format!("{} m", l / 1000.0),
        l if l >= 1.0 => format!("{l} mm"),
        l => format!("{:.*} mm", (-l.log10().floor()).max(0.0) as usize, l),
    };
    let about = if desk.sight.is_perspective() { "about " } else { "" };
    painter.text(
        pos2(right - 0.5 * length, y - 5.0),
        Align2::CENTER_BOTTOM,
        format!("{about}{text}"),
        egui::FontId::proportional(12.0),
        ink,
    );
}
