//! The window itself: hands its events to the pane and shows what comes out.

use std::sync::Arc;
use std::time::{Duration, Instant};

use claymill_viewer::{Gpu, ViewError};
use thiserror::Error;
use wgpu::{Backends, CurrentSurfaceTexture, Instance, InstanceDescriptor, Surface};
use winit::application::ApplicationHandler;
use winit::dpi::LogicalSize;
use winit::event::{ElementState, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{Key, ModifiersState};
use winit::window::{Window, WindowId};

use crate::desk::Desk;
use crate::easel::Easel;
use crate::exhibit::{Exhibit, Shared};
use crate::pane::Pane;

/// Why there is no window, or no longer one.
#[derive(Debug, Error)]
pub enum WindowError {
    /// No display answers.
    #[error("no window can be opened: {reason}")]
    NoDisplay {
        /// What the window system said.
        reason: String,
    },
    /// The picture cannot be drawn.
    #[error(transparent)]
    View(#[from] ViewError),
}

/// A wait that is none.
const FOREVER: Duration = Duration::from_secs(3600);

/// How the window opens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindowOptions {
    /// Width and height, points.
    pub size: [u32; 2],
    /// Dark surroundings.
    pub dark: bool,
}

impl Default for WindowOptions {
    fn default() -> Self {
        WindowOptions { size: [1440, 900], dark: false }
    }
}

/// Shows the exhibit until the window is closed; `say` is told what is picked and measured.
///
/// # Errors
/// There is no display, no adapter or nothing to show, or the adapter fails later.
pub fn show(
    exhibit: Exhibit,
    options: WindowOptions,
    say: &mut dyn FnMut(serde_json::Value),
) -> Result<(), WindowError> {
    let no_display = |e: &dyn std::fmt::Display| WindowError::NoDisplay { reason: e.to_string() };
    // Asked first: laying everything out takes longer than saying no.
    let event_loop = EventLoop::new().map_err(|e| no_display(&e))?;
    let exhibit: Shared = Arc::new(exhibit);
    let mut desk = Desk::new(&exhibit, options.size)?;
    desk.dark = options.dark;
    let mut shell = Shell {
        pane: Pane::new(desk),
        title: format!("{} – claymill", exhibit.title),
        size: options.size,
        began: Instant::now(),
        open: None,
        modifiers: ModifiersState::empty(),
        wake: None,
        failure: None,
        say,
    };
    event_loop.run_app(&mut shell).map_err(|e| no_display(&e))?;
    shell.failure.map_or(Ok(()), Err)
}

struct Shell<'a, 's> {
    pane: Pane<'a>,
    title: String,
    size: [u32; 2],
    began: Instant,
    open: Option<Open>,
    modifiers: ModifiersState,
    wake: Option<Instant>,
    failure: Option<WindowError>,
    say: &'s mut dyn FnMut(serde_json::Value),
}

/// A window with what draws into it.
struct Open {
    window: Arc<Window>,
    surface: Surface<'static>,
    format: wgpu::TextureFormat,
    easel: Easel,
    input: egui_winit::State,
    frames: u64,
}

impl Shell<'_, '_> {
    fn open(&self, event_loop: &ActiveEventLoop) -> Result<Open, WindowError> {
        let [width, height] = self.size;
        let attributes = Window::default_attributes()
            .with_title(&self.title)
            .with_inner_size(LogicalSize::new(width, height));
        let no_display = |e: &dyn std::fmt::Display| WindowError::NoDisplay { reason: e.to_string() };
        let window = Arc::new(event_loop.create_window(attributes).map_err(|e| no_display(&e))?);
        let backends = Backends::from_env().unwrap_or(Backends::PRIMARY);
        let display = Box::new(event_loop.owned_display_handle());
        let instance = Instance::new(InstanceDescriptor {
            backends,
            ..InstanceDescriptor::new_with_display_handle_from_env(display)
        });
        let surface = instance
            .create_surface(Arc::clone(&window))
            .map_err(|e| ViewError::NoAdapter { reason: e.to_string() })?;
        let gpu = Gpu::open(&instance, backends, Some(&surface))?;
        let formats = surface.get_capabilities(&gpu.adapter).formats;
        // The panels' colours are as shown already.
        let format = formats.iter().copied().find(|f| !f.is_srgb()).or(formats.first().copied());
        let format = format.ok_or_else(|| ViewError::NoAdapter { reason: "it shows no colours".into() })?;
        let scale = Some(window.scale_factor() as f32);
        let side = Some(gpu.largest_side_px as usize);
        let (ctx, root) = (self.pane.context().clone(), egui::ViewportId::ROOT);
        let input = egui_winit::State::new(ctx, root, &window, scale, None, side);
        let easel = Easel::new(gpu, &self.pane, format);
        let open = Open { window, surface, format, easel, input, frames: 0 };
        open.configure();
        Ok(open)
    }

    fn draw(&mut self) -> Result<(), WindowError> {
        let Some(open) = &mut self.open else { return Ok(()) };
        let texture = match open.surface.get_current_texture() {
            CurrentSurfaceTexture::Success(texture) => texture,
            CurrentSurfaceTexture::Suboptimal(_)
            | CurrentSurfaceTexture::Outdated
            | CurrentSurfaceTexture::Lost => {
                open.configure();
                open.window.request_redraw();
                return Ok(());
            }
            // Hidden, or late: the next event asks again.
            _ => return Ok(()),
        };
        let input = open.input.take_egui_input(&open.window);
        let output = self.pane.frame(input);
        open.input.handle_platform_output(&open.window, output.platform_output.clone());
        let delay = output.viewport_output.get(&egui::ViewportId::ROOT).map_or(FOREVER, |v| v.repaint_delay);
        let pixels_per_point = output.pixels_per_point;
        let now_s = self.began.elapsed().as_secs_f64();
        let size = open.window.inner_size();
        let view = texture.texture.create_view(&Default::default());
        open.easel.paint(&mut self.pane, output, &view, [size.width.max(1), size.height.max(1)], now_s)?;
        open.window.pre_present_notify();
        open.easel.gpu.queue.present(texture);
        let delay = open.easel.wants_frame_in(&self.pane, now_s).map_or(delay, |d| d.min(delay));
        self.wake = Instant::now().checked_add(delay).filter(|_| delay < FOREVER);
        if open.frames == 0 {
            let p = self.pane.place();
            let picture_px = [p.min.x, p.min.y, p.width(), p.height()].map(|v| v * pixels_per_point);
            (self.say)(serde_json::json!({ "window": {
                "adapter": open.easel.gpu.name,
                "size_px": [size.width, size.height],
                "picture_px": picture_px,
            } }));
        }
        open.frames += 1;
        for said in self.pane.desk.take_said() {
            (self.say)(said);
        }
        Ok(())
    }
}

impl Open {
    fn configure(&self) {
        let size = self.window.inner_size();
        let largest = self.easel.gpu.largest_side_px;
        let [width, height] = [size.width, size.height].map(|s| s.clamp(1, largest));
        let usual = self.surface.get_default_config(&self.easel.gpu.adapter, width, height);
        if let Some(usual) = usual {
            let config = wgpu::SurfaceConfiguration { format: self.format, ..usual };
            self.surface.configure(&self.easel.gpu.device, &config);
        }
    }
}

impl ApplicationHandler for Shell<'_, '_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.open.is_some() {
            return;
        }
        match self.open(event_loop) {
            Ok(open) => {
                open.window.request_redraw();
                self.open = Some(open);
            }
            Err(failure) => self.fail(event_loop, failure),
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.open else { return };
        if open.input.on_window_event(&open.window, &event).repaint {
            open.window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(_) => {
                open.configure();
                open.window.request_redraw();
            }
            WindowEvent::ModifiersChanged(modifiers) => self.modifiers = modifiers.state(),
            WindowEvent::KeyboardInput { event, .. }
                if event.state == ElementState::Pressed && self.modifiers.control_key() =>
            {
                if let Key::Character(c) = &event.logical_key
                    && ["q", "w"].contains(&c.as_str())
                {
                    event_loop.exit();
                }
            }
            WindowEvent::RedrawRequested => {
                if let Err(failure) = self.draw() {
                    self.fail(event_loop, failure);
                }
            }
            _ => {}
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let due = self.wake.is_some_and(|w| w <= Instant::now());
        if due && let Some(open) = &self.open {
            self.wake = None;
            open.window.request_redraw();
        }
        event_loop.set_control_flow(self.wake.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }
}

impl Shell<'_, '_> {
    fn fail(&mut self, event_loop: &ActiveEventLoop, failure: WindowError) {
        self.failure = Some(failure);
        event_loop.exit();
    }
}
