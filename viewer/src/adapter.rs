//! Opens a graphics device (graphics card before software driver, environment variables first) and
//! reads textures back from it.

use wgpu::{Adapter, Backends, DeviceType, Instance, InstanceDescriptor};

use crate::{Picture, ViewError};

/// A device that can draw, and where it runs.
pub struct Gpu {
    /// What draws.
    pub device: wgpu::Device,
    /// Where it takes its orders.
    pub queue: wgpu::Queue,
    /// The adapter that it runs on.
    pub adapter: wgpu::Adapter,
    /// The adapter's name, for reports.
    pub name: String,
    /// Longest side of a picture, pixels.
    pub largest_side_px: u32,
}

/// Longest side of a picture, pixels: what a readback buffer of 256 MiB holds as a square.
const LARGEST_SIDE_PX: u32 = 8192;

/// Opens the best adapter: `WGPU_BACKEND`, `WGPU_ADAPTER_NAME` and `WGPU_FORCE_FALLBACK_ADAPTER` decide when set;
/// else a graphics card goes before a software driver.
pub(crate) fn open() -> Result<Gpu, ViewError> {
    open_on(Backends::from_env().unwrap_or(Backends::PRIMARY))
}

pub(crate) fn open_on(backends: Backends) -> Result<Gpu, ViewError> {
    let instance = Instance::new(InstanceDescriptor {
        backends,
        ..InstanceDescriptor::new_without_display_handle_from_env()
    });
    Gpu::open(&instance, backends, None)
}

impl Gpu {
    /// Opens the best adapter of `backends` that can draw on `surface`, if there is one to draw on:
    /// `WGPU_ADAPTER_NAME` and `WGPU_FORCE_FALLBACK_ADAPTER` decide when set; else a graphics card goes before a
    /// software driver.
    ///
    /// # Errors
    /// There is none, or it refuses to work.
    pub fn open(
        instance: &Instance,
        backends: Backends,
        surface: Option<&wgpu::Surface<'_>>,
    ) -> Result<Self, ViewError> {
        let adapters = pollster::block_on(instance.enumerate_adapters(backends));
        let found: Vec<String> = adapters.iter().map(|a| a.get_info().name).collect();
        let wanted_name = std::env::var("WGPU_ADAPTER_NAME").ok().map(|n| n.to_lowercase());
        let only_software =
            std::env::var("WGPU_FORCE_FALLBACK_ADAPTER").is_ok_and(|v| v != "0" && !v.is_empty());
        let usable = |a: &Adapter| {
            let info = a.get_info();
            wanted_name.as_ref().is_none_or(|wanted| info.name.to_lowercase().contains(wanted))
                && (!only_software || info.device_type == DeviceType::Cpu)
                && surface.is_none_or(|s| a.is_surface_supported(s))
        };
        let Some(adapter) = adapters.into_iter().filter(usable).min_by_key(rank) else {
            let reason = if found.is_empty() {
                format!("none answers on {backends:?}")
            } else {
                format!("not usable here: {}", found.join(", "))
            };
            return Err(ViewError::NoAdapter { reason });
        };
        let info = adapter.get_info();
        let name = format!("{} ({:?}, {:?})", info.name, info.backend, info.device_type);
        let limits = wgpu::Limits::downlevel_defaults().using_resolution(adapter.limits());
        let largest_side_px = limits.max_texture_dimension_2d.min(LARGEST_SIDE_PX);
        let descriptor =
            wgpu::DeviceDescriptor { label: Some("claymill"), required_limits: limits, ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| ViewError::Device { adapter: name.clone(), reason: e.to_string() })?;
        Ok(Gpu { device, queue, adapter, name, largest_side_px })
    }

    /// What a texture of four bytes a pixel holds once all that was asked for is drawn; it must allow to be copied.
    ///
    /// # Errors
    /// The device fails.
    pub fn read(&self, texture: &wgpu::Texture) -> Result<Picture, ViewError> {
        let failed = |e: &dyn std::fmt::Display| ViewError::Device {
            adapter: self.name.clone(),
            reason: e.to_string(),
        };
        let wgpu::Extent3d { width, height, .. } = texture.size();
        let row_bytes = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row_bytes) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row_bytes), rows_per_image: None };
        let destination = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(texture.as_image_copy(), destination, texture.size());
        self.queue.submit([encoder.finish()]);

        let (sender, receiver) = std::sync::mpsc::channel();
        buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| {
            // The receiver waits below; if it is gone nobody is interested.
            let _ = sender.send(result);
        });
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| failed(&e))?;
        receiver.recv().map_err(|e| failed(&e))?.map_err(|e| failed(&e))?;
        let mapped = buffer.slice(..).get_mapped_range().map_err(|e| failed(&e))?;
        let mut rgba = Vec::with_capacity(4 * width as usize * height as usize);
        for row in mapped.chunks_exact(row_bytes as usize) {
            rgba.extend_from_slice(&row[..4 * width as usize]);
        }
        Ok(Picture { width, height, rgba })
    }
}

fn rank(adapter: &Adapter) -> u8 {
    match adapter.get_info().device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_an_adapter_the_message_says_what_to_install() {
        let error = open_on(Backends::empty()).err().expect("no backend, no adapter");
        assert!(matches!(error, ViewError::NoAdapter { .. }));
        assert!(error.to_string().contains("apt-get install mesa-vulkan-drivers libvulkan1"), "{error}");
    }
}
