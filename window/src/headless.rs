//! The window without a display: the same events, the same state, the picture in a texture.

use std::time::Duration;

use claymill_viewer::{Gpu, Picture, ViewError};
use egui::{Event, Modifiers, MouseWheelUnit, PointerButton, Pos2, RawInput, Rect, Vec2};
use wgpu::{Backends, Instance, InstanceDescriptor};

use crate::desk::Desk;
use crate::easel::Easel;
use crate::exhibit::Shared;
use crate::pane::Pane;
use crate::stage::Care;

/// A window that nobody sees.
pub struct Headless<'a> {
    /// What would be in the window.
    pub pane: Pane<'a>,
    easel: Option<Easel>,
    target: Option<wgpu::Texture>,
    size: [u32; 2],
    now_s: f64,
    pointer: Pos2,
    modifiers: Modifiers,
}

impl<'a> Headless<'a> {
    /// Of `size` pixels. Without a graphics adapter everything works but pictures.
    ///
    /// # Errors
    /// There is nothing to show.
    pub fn new(exhibit: &'a Shared, size: [u32; 2]) -> Result<Self, ViewError> {
        let pane = Pane::new(Desk::new(exhibit, size)?);
        let (pointer, modifiers) = (Pos2::new(-1.0, -1.0), Modifiers::NONE);
        Ok(Headless { pane, easel: None, target: None, size, now_s: 0.0, pointer, modifiers })
    }

    /// Opens the adapter that pictures are drawn with.
    ///
    /// # Errors
    /// There is none.
    pub fn open(&mut self) -> Result<(), ViewError> {
        let backends = Backends::from_env().unwrap_or(Backends::PRIMARY);
        let instance = Instance::new(InstanceDescriptor {
            backends,
            ..InstanceDescriptor::new_without_display_handle_from_env()
        });
        let gpu = Gpu::open(&instance, backends, None)?;
        let format = wgpu::TextureFormat::Rgba8Unorm;
        let [width, height] = self.size;
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        self.easel = Some(Easel::new(gpu, &self.pane, format));
        self.target = Some(texture);
        Ok(())
    }

    /// Lets `events` happen and a sixtieth of a second pass, and draws where an adapter is open.
    ///
    /// # Errors
    /// The adapter fails.
    pub fn frame(&mut self, events: Vec<Event>) -> Result<(), ViewError> {
        self.frame_after(events, 1.0 / 60.0)
    }

    /// The same after any time.
    ///
    /// # Errors
    /// The adapter fails.
    pub fn frame_after(&mut self, events: Vec<Event>, passed_s: f64) -> Result<(), ViewError> {
        self.now_s += passed_s;
        let [width, height] = self.size.map(|s| s as f32);
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, Vec2::new(width, height))),
            time: Some(self.now_s),
            events,
            focused: true,
            ..RawInput::default()
        };
        let output = self.pane.frame(input);
        match (&mut self.easel, &self.target) {
            (Some(easel), Some(target)) => {
                let view = target.create_view(&Default::default());
                easel.paint(&mut self.pane, output, &view, self.size, self.now_s)
            }
            _ => {
                output.drop_without_applying_deltas();
                Ok(())
            }
        }
    }

    /// Lets time pass until the picture is a fine one.
    ///
    /// # Errors
    /// The adapter fails.
    pub fn rest(&mut self) -> Result<(), ViewError> {
        for _ in 0..4 {
            self.frame_after(Vec::new(), 0.3)?;
        }
        Ok(())
    }

    /// How the last picture was drawn and how long that took.
    #[must_use]
    pub fn last(&self) -> Option<(Care, Duration)> {
        self.easel.as_ref().and_then(Easel::last)
    }

    /// A place of the picture, pixels from its top left, as a place in the window.
    #[must_use]
    pub fn in_window(&self, at_px: [f64; 2]) -> Pos2 {
        self.pane.place().min + Vec2::new(at_px[0] as f32, at_px[1] as f32)
    }

    /// Moves the pointer to a place in the window.
    ///
    /// # Errors
    /// The adapter fails.
    pub fn point(&mut self, at: Pos2) -> Result<(), ViewError> {
        self.pointer = at;
        self.frame(vec![Event::PointerMoved(at)])
    }

    /// Clicks at a place in the window.
    ///
    /// # Errors
    /// The adapter fails.
    pub fn click(&mut self, at: Pos2) -> Result<(), ViewError> {
        self.point(at)?;
        self.button(PointerButton::Primary, true)?;
        self.button(PointerButton::Primary, false)?;
        // Two clicks must not be taken for a double one.
        self.frame_after(Vec::new(), 0.6)
    }

    /// Drags from one place to another in a few steps.
    ///
    /// # Errors
    /// The adapter fails.
    pub fn drag(&mut self, button: PointerButton, from: Pos2, to: Pos2) -> Result<(), ViewError> {
        self.point(from)?;
        self.button(button, true)?;
        for i in 1..=8 {
            self.point(from + (to - from) * (i as f32 / 8.0))?;
        }
        self.button(button, false)
    }

    /// Takes hold of the middle of the picture.
    ///
    /// # Errors
    /// The adapter fails.
    pub fn begin_turning(&mut self) -> Result<(), ViewError> {
        self.point(self.pane.place().center())?;
        self.button(PointerButton::Middle, true)
    }

    /// Drags what was taken hold of so many points away from there, and waits until that is drawn.
    ///
    /// # Errors
    /// The adapter fails.
    pub fn turn_to(&mut self, [x, y]: [f32; 2]) -> Result<(), ViewError> {
        self.point(self.pane.place().center() + Vec2::new(x, y))?;
        if let Some(easel) = &self.easel {
            let waited = easel.gpu.device.poll(wgpu::PollType::wait_indefinitely());
            waited
                .map_err(|e| ViewError::Device { adapter: easel.gpu.name.clone(), reason: e.to_string() })?;
        }
        Ok(())
    }

    /// What pictures are drawn with.
    #[must_use]
    pub fn adapter(&self) -> Option<&str> {
        self.easel.as_ref().map(|e| e.gpu.name.as_str())
    }

    /// The device that draws, to take it away.
    #[must_use]
    pub fn device(&self) -> Option<&wgpu::Device> {
        self.easel.as_ref().map(|e| &e.gpu.device)
    }

    /// Turns the wheel at a place in the window.
    ///
    /// # Errors
    /// The adapter fails.
    pub fn wheel(&mut self, at: Pos2, notches: f32) -> Result<(), ViewError> {
        self.point(at)?;
        self.frame(vec![Event::MouseWheel {
            unit: MouseWheelUnit::Line,
            delta: Vec2::new(0.0, notches),
            phase: egui::TouchPhase::Move,
            source: egui::MouseWheelSource::Wheel,
            modifiers: self.modifiers,
        }])
    }

    /// Presses and releases a key.
    ///
    /// # Errors
    /// The adapter fails.
    pub fn key(&mut self, key: egui::Key) -> Result<(), ViewError> {
        let modifiers = self.modifiers;
        let event = |pressed| Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
        self.frame(vec![event(true), event(false)])
    }

    /// Holds modifier keys from now on.
    ///
    /// # Errors
    /// The adapter fails.
    pub fn hold(&mut self, modifiers: Modifiers) -> Result<(), ViewError> {
        self.modifiers = modifiers;
        self.frame(vec![Event::ModifiersChanged(modifiers)])
    }

    fn button(&mut self, button: PointerButton, pressed: bool) -> Result<(), ViewError> {
        let (pos, modifiers) = (self.pointer, self.modifiers);
        self.frame(vec![Event::PointerButton { pos, button, pressed, modifiers }])
    }

    /// The window as it is.
    ///
    /// # Errors
    /// No adapter is open, or it fails.
    pub fn picture(&self) -> Result<Picture, ViewError> {
        let (Some(easel), Some(texture)) = (&self.easel, &self.target) else {
            return Err(ViewError::NoAdapter { reason: "none was opened".into() });
        };
        easel.gpu.read(texture)
    }
}
