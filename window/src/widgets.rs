//! Pieces that the panels are made of.

use egui::{Align, Align2, Color32, FontId, Layout, Response, RichText, Sense, Stroke, Ui, Vec2, pos2, vec2};

use crate::theme;

/// Whether something is shown, with its colour, its name and a figure on the right.
pub(crate) fn layer(
    ui: &mut Ui,
    on: &mut bool,
    swatch: Option<Color32>,
    name: &str,
    figure: &str,
) -> Response {
    ui.horizontal(|ui| {
        let response = ui.checkbox(on, "");
        ui.add_space(-6.0);
        if let Some(swatch) = swatch {
            sign(ui, swatch);
        }
        let label = ui.add(egui::Label::new(name).truncate().sense(Sense::click()));
        if label.clicked() {
            *on = !*on;
        }
        figure_right(ui, figure);
        response | label
    })
    .inner
}

/// A filled square of a colour.
pub(crate) fn sign(ui: &mut Ui, colour: Color32) {
    let (rect, _) = ui.allocate_exact_size(vec2(10.0, 10.0), Sense::hover());
    ui.painter().rect_filled(rect, 2.0, colour);
}

pub(crate) fn figure_right(ui: &mut Ui, figure: &str) {
    if !figure.is_empty() {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.label(RichText::new(figure).weak());
        });
    }
}

/// A heading of a part of a panel.
pub(crate) fn heading(ui: &mut Ui, text: &str) {
    ui.add_space(8.0);
    ui.label(RichText::new(text).family(theme::medium()));
    ui.add_space(1.0);
}

/// What a figure is called, and the figure.
pub(crate) fn fact(ui: &mut Ui, name: &str, value: &str) {
    ui.horizontal_top(|ui| {
        let width = 84.0;
        ui.allocate_ui_with_layout(vec2(width, 16.0), Layout::left_to_right(Align::Min), |ui| {
            ui.set_width(width);
            ui.label(RichText::new(name).weak());
        });
        ui.add(egui::Label::new(value).wrap());
    });
}

/// A button that stays pressed.
pub(crate) fn toggle(ui: &mut Ui, on: bool, text: &str, hint: &str) -> bool {
    ui.add(egui::Button::selectable(on, text)).on_hover_text(hint).clicked()
}

/// Signs of a player.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PlayerSign {
    Play,
    Pause,
    Forward,
    Back,
    Start,
    End,
}

/// A button of a player, drawn rather than written.
pub(crate) fn player(ui: &mut Ui, sign: PlayerSign, hint: &str) -> bool {
    let (rect, response) = ui.allocate_exact_size(vec2(26.0, 22.0), Sense::click());
    let visuals = ui.style().interact(&response);
    let painter = ui.painter();
    painter.rect(rect, 3.0, visuals.weak_bg_fill, visuals.bg_stroke, egui::StrokeKind::Inside);
    let (c, ink) = (rect.center(), visuals.fg_stroke.color);
    let triangle = |x: f32, w: f32| {
        let points = vec![pos2(c.x + x, c.y - 5.0), pos2(c.x + x + w, c.y), pos2(c.x + x, c.y + 5.0)];
        painter.add(egui::Shape::convex_polygon(points, ink, Stroke::NONE));
    };
    let bar = |x: f32| {
        let size = Vec2::new(2.2, 10.0);
        painter.rect_filled(egui::Rect::from_center_size(pos2(c.x + x, c.y), size), 0.0, ink);
    };
    match sign {
        PlayerSign::Play => triangle(-3.5, 8.5),
        PlayerSign::Pause => [-2.6, 2.6].into_iter().for_each(bar),
        PlayerSign::Forward => {
            triangle(-5.0, 7.5);
            bar(4.4);
        }
        PlayerSign::Back => {
            triangle(5.0, -7.5);
            bar(-4.4);
        }
        PlayerSign::Start => {
            triangle(1.0, -6.0);
            triangle(7.0, -6.0);
            bar(-6.4);
        }
        PlayerSign::End => {
            triangle(-1.0, 6.0);
            triangle(-7.0, 6.0);
            bar(6.4);
        }
    }
    response.on_hover_text(hint).clicked()
}

/// Words on the picture that can be read over anything.
pub(crate) fn over_picture(painter: &egui::Painter, at: egui::Pos2, anchor: Align2, text: &str, dark: bool) {
    let (ink, ground) = match dark {
        true => (Color32::from_gray(230), Color32::from_black_alpha(150)),
        false => (Color32::from_gray(30), Color32::from_white_alpha(190)),
    };
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(12.0), ink);
    let rect = anchor.anchor_size(at, galley.size());
    painter.rect_filled(rect.expand2(vec2(4.0, 2.0)), 3.0, ground);
    painter.galley(rect.min, galley, ink);
}
