//! Draws a pane into a texture: the picture first, when it has changed, then the panels over it.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use claymill_viewer::{Gpu, ViewError};
use egui::{FullOutput, TextureId};
use egui_wgpu::{Renderer, RendererOptions, ScreenDescriptor};

use crate::pane::{Pane, Shown};
use crate::stage::{Care, Stage};

/// A picture that rests so long is drawn finely, s.
const REST_S: f64 = 0.2;
/// Quick pictures of a software driver take about so long, and are as small as needed for it.
const QUICK: Duration = Duration::from_millis(45);
/// The smallest part of the size that they get.
const SMALLEST: f64 = 0.3;

/// What draws.
pub struct Easel {
    /// The graphics card or the software driver.
    pub gpu: Gpu,
    stage: Stage,
    renderer: Renderer,
    picture: Option<TextureId>,
    drawn: Option<(Shown, Care)>,
    changed_s: f64,
    /// The picture is there since the last layout only.
    first: bool,
    /// Drawn by the processor: pictures are made small while something moves.
    slow: bool,
    scale: f64,
    last: Option<(Care, Duration)>,
    failed: Arc<Mutex<Option<String>>>,
}

impl Easel {
    /// Sets up for drawing into textures of `format`.
    #[must_use]
    pub fn new(gpu: Gpu, pane: &Pane<'_>, format: wgpu::TextureFormat) -> Self {
        let failed = Arc::new(Mutex::new(None));
        let note = |failed: &Arc<Mutex<Option<String>>>, what: String| {
            if let Ok(mut failed) = failed.lock() {
                failed.get_or_insert(what);
            }
        };
        let (lost, wrong) = (Arc::clone(&failed), Arc::clone(&failed));
        gpu.device.set_device_lost_callback(move |_, message| {
            note(&lost, format!("the device was lost: {message}"))
        });
        gpu.device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| note(&wrong, error.to_string())));
        let options = RendererOptions { dithering: false, ..RendererOptions::default() };
        Easel {
            stage: Stage::new(&gpu, &pane.desk),
            renderer: Renderer::new(&gpu.device, format, options),
            picture: None,
            drawn: None,
            changed_s: 0.0,
            first: false,
            slow: gpu.adapter.get_info().device_type == wgpu::DeviceType::Cpu,
            scale: 0.5,
            last: None,
            failed,
            gpu,
        }
    }

    /// How the last picture was drawn and how long that took; on a graphics card how long it took to ask for it.
    #[must_use]
    pub fn last(&self) -> Option<(Care, Duration)> {
        self.last
    }

    /// Whether the picture is a fine one of what is shown now.
    #[must_use]
    pub fn rests(&self, pane: &Pane<'_>) -> bool {
        self.drawn.as_ref().is_some_and(|(shown, care)| *care == Care::Fine && *shown == pane.shown())
    }

    /// When another frame is due without any event: at once where the picture moves on, after a rest where it can be
    /// drawn better.
    #[must_use]
    pub fn wants_frame_in(&self, pane: &Pane<'_>, now_s: f64) -> Option<Duration> {
        let (_, care) = self.drawn.as_ref()?;
        match care {
            _ if self.first => Some(Duration::ZERO),
            Care::Quick if !pane.desk.clock.playing => {
                Some(Duration::from_secs_f64((self.changed_s + REST_S - now_s).max(0.0)))
            }
            _ => None,
        }
    }

    /// Draws what the pane laid out.
    ///
    /// # Errors
    /// The device was lost, or refused an order.
    pub fn paint(
        &mut self,
        pane: &mut Pane<'_>,
        output: FullOutput,
        target: &wgpu::TextureView,
        size_px: [u32; 2],
        now_s: f64,
    ) -> Result<(), ViewError> {
        self.first = false;
        // A loss shows here or in the picture; the panels' renderer would panic.
        let polled = self.gpu.device.poll(wgpu::PollType::Poll);
        self.renew_picture(pane, now_s);
        if let Err(failure) = polled.map_err(|e| self.failure(e.to_string())).and_then(|_| self.check()) {
            output.drop_without_applying_deltas();
            return Err(failure);
        }
        let FullOutput { mut textures_delta, shapes, pixels_per_point, .. } = output;
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        for (id, deltas) in &textures_delta.set {
            for delta in deltas {
                self.renderer.update_texture(device, queue, *id, delta);
            }
        }
        let jobs = pane.context().tessellate(shapes, pixels_per_point);
        let screen = ScreenDescriptor { size_in_pixels: size_px, pixels_per_point };
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut orders = self.renderer.update_buffers(device, queue, &mut encoder, &jobs, &screen);
        {
            let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: None,
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: target,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: None,
                timestamp_writes: None,
                occlusion_query_set: None,
                multiview_mask: None,
            });
            self.renderer.render(&mut pass.forget_lifetime(), &jobs, &screen);
        }
        orders.push(encoder.finish());
        queue.submit(orders);
        for id in &textures_delta.free {
            self.renderer.free_texture(id);
        }
        textures_delta.clear();
        self.check()
    }

    fn check(&self) -> Result<(), ViewError> {
        match self.failed.lock().ok().and_then(|f| f.clone()) {
            Some(reason) => Err(self.failure(reason)),
            None => Ok(()),
        }
    }

    fn failure(&self, reason: String) -> ViewError {
        ViewError::Device { adapter: self.gpu.name.clone(), reason }
    }

    /// Draws the picture where it is not what is shown, or not as well as it could be.
    fn renew_picture(&mut self, pane: &mut Pane<'_>, now_s: f64) {
        let shown = pane.shown();
        let same = self.drawn.as_ref().is_some_and(|(drawn, _)| *drawn == shown);
        if !same {
            self.changed_s = now_s;
        }
        let rested = now_s - self.changed_s >= REST_S && !pane.desk.clock.playing;
        let care = if self.slow && !rested { Care::Quick } else { Care::Fine };
        let good_enough =
            self.drawn.as_ref().is_some_and(|(_, had)| *had == Care::Fine || care == Care::Quick);
        if !(same && good_enough) {
            let full = pane.desk.sight.size();
            let scale = if care == Care::Quick { self.scale } else { 1.0 };
            let largest = f64::from(self.gpu.largest_side_px);
            let size = full.map(|s| (f64::from(s) * scale).round().clamp(1.0, largest) as u32);
            let began = Instant::now();
            let texture = self.stage.draw(&self.gpu, &pane.desk, size, care);
            let view = texture.create_view(&Default::default());
            if self.slow {
                // Nothing is gained by running ahead of the processor. An error shows in `check`.
                let _ = self.gpu.device.poll(wgpu::PollType::wait_indefinitely());
            }
            let took = began.elapsed();
            self.last = Some((care, took));
            if care == Care::Quick {
                let ratio = (QUICK.as_secs_f64() / took.as_secs_f64().max(1e-4)).sqrt().clamp(0.7, 1.25);
                self.scale = (self.scale * ratio).clamp(SMALLEST, 1.0);
            }
            let (device, filter) = (&self.gpu.device, wgpu::FilterMode::Linear);
            match self.picture {
                Some(id) => self.renderer.update_egui_texture_from_wgpu_texture(device, &view, filter, id),
                None => {
                    let id = self.renderer.register_native_texture(device, &view, filter);
                    self.picture = Some(id);
                    pane.show_picture(id);
                    self.first = true;
                }
            }
            self.drawn = Some((shown, care));
        }
    }
}
