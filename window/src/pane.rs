//! Everything inside the window's frame: panels around a picture. Events go in, shapes come out; no display is needed.

use egui::{CentralPanel, FullOutput, Panel, RawInput, Rect, Sense, TextureId, Ui};

use crate::desk::{Cutting, Desk, Picked};
use crate::layers::Layers;
use crate::pick::Spot;
use crate::sight::Sight;
use crate::viewport::{self, Drag};
use crate::{inspector, panels, theme};

/// A desk with its panels.
pub struct Pane<'a> {
    ctx: egui::Context,
    /// What is shown.
    pub desk: Desk<'a>,
    drag: Option<Drag>,
    picture: Option<TextureId>,
    /// Where the picture is, points.
    place: Rect,
    time_s: Option<f64>,
    /// The first layout says how large the picture is.
    framed: bool,
}

/// All that a picture depends on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shown {
    sight: Sight,
    layers: Layers,
    cutting: Cutting,
    now_s: f64,
    dark: bool,
    paintings: u64,
    picked: Option<Picked>,
    measured: Vec<Spot>,
}

impl<'a> Pane<'a> {
    /// Panels around a desk.
    #[must_use]
    pub fn new(desk: Desk<'a>) -> Self {
        let ctx = egui::Context::default();
        theme::install(&ctx);
        Pane { ctx, desk, drag: None, picture: None, place: Rect::ZERO, time_s: None, framed: false }
    }

    /// The toolkit's state.
    #[must_use]
    pub fn context(&self) -> &egui::Context {
        &self.ctx
    }

    /// Where the picture is in the window, points.
    #[must_use]
    pub fn place(&self) -> Rect {
        self.place
    }

    /// Gives the panels the texture in which the picture is.
    pub fn show_picture(&mut self, picture: TextureId) {
        self.picture = Some(picture);
    }

    /// Takes events in, changes the state, and lays the window out anew.
    pub fn frame(&mut self, input: RawInput) -> FullOutput {
        let passed_s = match (input.time, self.time_s) {
            (Some(now), Some(before)) => (now - before).clamp(0.0, 0.25),
            _ => 0.0,
        };
        self.time_s = input.time.or(self.time_s);
        let ctx = self.ctx.clone();
        ctx.set_theme(if self.desk.dark { egui::Theme::Dark } else { egui::Theme::Light });
        if self.desk.tick(passed_s) {
            ctx.request_repaint();
        }
        self.desk.repaint();
        if self.desk.is_cutting_material() {
            ctx.request_repaint_after_secs(0.01);
        }
        if matches!(self.desk.crests(), crate::Crests::Measuring(..)) {
            ctx.request_repaint_after_secs(0.25);
        }
        // Taken out, so that the panels can change it while they are laid out.
        ctx.run_ui(input, |ui| self.lay_out(ui))
    }

    fn lay_out(&mut self, ui: &mut Ui) {
        let Pane { desk, drag, picture, place, framed, .. } = self;
        viewport::keys(ui, desk);
        let frame = |ui: &Ui| egui::Frame::side_top_panel(ui.style());
        Panel::top("tools").frame(frame(ui)).show(ui, |ui| panels::toolbar(ui, desk));
        if desk.exhibit().job.is_some() {
            Panel::bottom("time").frame(frame(ui)).show(ui, |ui| panels::timeline(ui, desk));
        }
        Panel::left("layers").default_size(236.0).frame(frame(ui)).show(ui, |ui| panels::tree(ui, desk));
        Panel::right("facts")
            .default_size(292.0)
            .frame(frame(ui))
            .show(ui, |ui| inspector::inspector(ui, desk));
        CentralPanel::no_frame().show(ui, |ui| {
            let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
            *place = rect;
            let px = ui.ctx().pixels_per_point();
            let size = [rect.width(), rect.height()].map(|s| (s * px).round().max(1.0) as u32);
            if desk.sight.size() != size {
                desk.sight.resize(size);
            }
            if !std::mem::replace(framed, true) {
                desk.fit();
            }
            viewport::input(ui, &response, desk, drag);
            if let Some(picture) = *picture {
                let whole = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
                ui.painter().image(picture, rect, whole, egui::Color32::WHITE);
            }
            viewport::overlay(ui, rect, desk);
        });
    }

    pub(crate) fn shown(&self) -> Shown {
        let desk = &self.desk;
        Shown {
            sight: desk.sight.clone(),
            layers: desk.layers.clone(),
            cutting: desk.cutting,
            now_s: desk.clock.now_s,
            dark: desk.dark,
            paintings: desk.paintings,
            picked: desk.picked().cloned(),
            measured: desk.measured_points().to_vec(),
        }
    }
}
